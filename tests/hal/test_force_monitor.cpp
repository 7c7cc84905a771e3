// SPDX-License-Identifier: Apache-2.0
/// The monitor as a property: for every sequence of states, inputs and faults, what is sent never
/// grows while it is blocked, never exceeds the device's own limits and never steps by more than
/// its slew allows. And its probes: what it must catch.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string>
#include <vector>

#include "hal/device_limits.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/usb/output_guard.hpp"
#include "tests/hal/link_bench.hpp"
#include "tests/support/force_monitor.hpp"
#include "tests/support/random.hpp"

using namespace haptic;
using namespace haptic::hal;
using haptic::test::BenchCounts;
using haptic::test::BenchOp;
using haptic::test::ForceBlock;
using haptic::test::ForceMonitor;
using haptic::test::LinkBench;
using haptic::test::Random;
using haptic::test::SentCommand;

namespace {

// Bytes for the bench: mostly a session that goes on as it should, since the faults of one that
// stands still say little.
class ScriptMaker {
 public:
  explicit ScriptMaker(std::uint64_t seed) : random_(seed) {}

  std::vector<std::uint8_t> make(unsigned operations) {
    bytes_ = {byte()};
    begin();
    for (unsigned k = 0; k < operations; ++k) operate();
    return bytes_;
  }

 private:
  std::uint8_t byte() { return static_cast<std::uint8_t>(random_.next() & 0xffu); }
  std::uint8_t below(unsigned limit) { return static_cast<std::uint8_t>(random_.next() % limit); }
  void put(BenchOp op, std::initializer_list<unsigned> takes = {}) {
    bytes_.push_back(static_cast<std::uint8_t>(op));
    for (const unsigned each : takes) bytes_.push_back(static_cast<std::uint8_t>(each));
  }
  void beats(unsigned most) { put(BenchOp::kBeat, {below(most)}); }
  /// Ready, armed and pressing.
  void begin() {
    put(BenchOp::kDeadman, {1});
    put(BenchOp::kPedal, {1});
    beats(16);
    put(BenchOp::kArm);
    put(BenchOp::kCommand, {byte(), byte(), byte(), byte()});
    for (int k = 0; k < 4; ++k) beats(32);
  }
  void operate() {
    switch (below(26)) {
      case 0:
        return begin();
      case 1:
        return put(BenchOp::kReport, {1u << below(8), byte()});
      case 2:
        return raw();
      case 3:
        return put(BenchOp::kCommand, {byte(), byte(), byte(), byte()});
      case 4:
      case 5:
        return hostile();
      case 6:
        return put(BenchOp::kPass, {below(16)});
      case 7:
        return put(BenchOp::kPass, {below(200)});
      case 8:
        return put(BenchOp::kLeap, {below(50)});
      case 9:
        return put(BenchOp::kOutEnd);
      case 10:
        return put(BenchOp::kOutFailed);
      case 11:
        return put(BenchOp::kRefuse, {below(6)});
      case 12:
        return put(BenchOp::kTurn);
      case 13:
        return put(BenchOp::kServoLost, {below(2)});
      case 14:
        return below(4) == 0 ? put(BenchOp::kReplug, {below(16)}) : put(BenchOp::kTurn);
      case 15:
        return below(4) == 0 ? put(BenchOp::kRest) : put(BenchOp::kTurn);
      case 16:
        return put(BenchOp::kArm);
      case 17:
        return put(BenchOp::kDeadman, {below(2)});
      case 18:
        return put(BenchOp::kReport, {0, byte()});
      case 20:
        return below(4) == 0 ? put(BenchOp::kStop) : put(BenchOp::kTurn);
      case 21:
        return put(BenchOp::kSleep, {below(20)});
      case 22:
        return put(BenchOp::kPedal, {below(2)});
      case 19:
        return below(8) == 0 ? scribble() : beats(16);
      default:
        return beats(16);
    }
  }
  void raw() {
    const unsigned size = below(20);
    put(BenchOp::kRawReport, {size});
    for (unsigned k = 0; k < size; ++k) bytes_.push_back(byte());
  }
  void scribble() {
    put(BenchOp::kScribble, {byte(), byte(), 24});
    for (int k = 0; k < 24; ++k) bytes_.push_back(byte());
  }
  void hostile() {
    put(BenchOp::kHostile);
    for (int k = 0; k < 30; ++k) bytes_.push_back(below(3) == 0 ? byte() : below(8));
  }

  Random random_;
  std::vector<std::uint8_t> bytes_;
};

std::string first_broken(LinkBench& bench, std::uint64_t seeds) {
  constexpr unsigned kOperations = 120;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const std::string broken = bench.run(ScriptMaker(seed).make(kOperations));
    if (!broken.empty()) return "seed " + std::to_string(seed) + ": " + broken;
  }
  return {};
}

/// The guard as it is, for a sequence of its own calls.
struct SoundGuard {
  explicit SoundGuard(const SafetyLimits& limits) : guard(limits) {}
  Wrench update(std::int64_t now_ns, const DeviceCommand& command) {
    return guard.update(now_ns, command).wrench_d;
  }
  void latch() { guard.latch(kLinkSilent); }
  OutputGuard guard;
};

/// Passes on what the servo asks for, within the limits.
struct TrustingGuard : SoundGuard {
  explicit TrustingGuard(const SafetyLimits& its) : SoundGuard(its), limits(its) {}
  Wrench update(std::int64_t, const DeviceCommand& command) {
    Wrench w = wrench_of(command.wrench_d);
    w.torque_w = Vec3::Zero();
    for (int k = 0; k < 3; ++k) {
      const Real most = limits.max_axis_force_n[k] > 0 ? limits.max_axis_force_n[k] : 5.0_r;
      w.force_w[k] = std::clamp(w.force_w[k], -most, most);
    }
    return w;
  }
  SafetyLimits limits;
};

/// Does not hear of a fault.
struct DeafGuard : SoundGuard {
  using SoundGuard::SoundGuard;
  void latch() {}
};

/// Grows by a little where it should come down.
struct SwellingGuard : SoundGuard {
  using SoundGuard::SoundGuard;
  Wrench update(std::int64_t now_ns, const DeviceCommand& command) {
    if (!blocked || std::abs(last.force_w.y()) > 5) {
      last = SoundGuard::update(now_ns, command);
    } else {
      last.force_w.y() += std::copysign(0.01_r, last.force_w.y());
    }
    return last;
  }
  void latch() {
    blocked = true;
    SoundGuard::latch();
  }
  bool blocked = false;
  Wrench last;
};

/// Makes up for a stall in one step: the slew of a clock that runs on.
struct HastyGuard : SoundGuard {
  explicit HastyGuard(const SafetyLimits& limits) : SoundGuard(limits) {}
  Wrench update(std::int64_t now_ns, const DeviceCommand& command) {
    Wrench w;
    for (std::int64_t t = last_ns + 1'000'000; last_ns > 0 && t < now_ns; t += 1'000'000) {
      DeviceCommand fresh = command;
      fresh.stamp_ns = t;
      w = SoundGuard::update(t, fresh);
    }
    w = SoundGuard::update(now_ns, command);
    last_ns = now_ns;
    return w;
  }
  std::int64_t last_ns = 0;
};

/// Beyond the limits of one axis.
struct NormGuard : SoundGuard {
  static SafetyLimits without_axes(SafetyLimits limits) {
    limits.max_axis_force_n = Vec3::Zero();
    return limits;
  }
  explicit NormGuard(const SafetyLimits& limits) : SoundGuard(without_axes(limits)) {}
};

DeviceCapabilities limited_by_axes() {
  DeviceCapabilities c = reference_capabilities();
  c.max_axis_force_n = Vec3(2, 0, 3);
  return c;
}

/// A servo that presses, stalls, and is latched against: the rule that `Guard` breaks.
template <class Guard>
std::string broken_by(std::uint64_t seed) {
  const DeviceCapabilities device = limited_by_axes();
  const SafetyLimits limits = limits_of(device, 1'000'000);
  ForceMonitor monitor(ForceBlock::of(device, limits));
  Guard guard(limits);
  Random random(seed);
  std::int64_t now_ns = 1'000'000'000;
  DeviceCommand command;
  command.arming = 0;
  bool blocked = true;
  for (int k = 0; k < 2000; ++k) {
    const std::uint64_t what = random.next() % 100;
    now_ns += what == 0 ? 40'000'000 : 1'000'000;
    ++command.tick;
    command.stamp_ns = now_ns;
    if (k % 50 == 0) {
      const auto component = [&] { return static_cast<Real>(random.uniform(-15, 15)); };
      command.wrench_d = record_of(
          Wrench{Vec3(component(), component(), component()), Vec3(0, 0, 0.02_r * component())});
    }
    if (k == 20 || (blocked && what < 4)) {
      ++command.arming;
      blocked = false;
    } else if (what >= 98) {
      guard.latch();
      blocked = true;
    }
    SentCommand sent;
    sent.stamp_ns = now_ns;
    sent.wrench_d = guard.update(now_ns, command);
    sent.drives_on = sent.ready = true;
    sent.blocked = blocked;
    if (std::string broken = monitor.on_send(sent); !broken.empty()) return broken;
  }
  return {};
}

void expect(const std::string& broken, const char* rule) {
  CAPTURE(broken);
  CAPTURE(rule);
  CHECK(broken.find(rule) != std::string::npos);
}

}  // namespace

TEST_SUITE("hal.force_monitor") {
  TEST_CASE("any sequence of states, inputs and faults: what is sent obeys the monitor") {
    LinkBench bench;
    CHECK(first_broken(bench, 1500) == "");
    // The property is not one of links that stand still.
    const BenchCounts& counts = bench.counts();
    CHECK(counts.sends > 300'000u);
    CHECK(counts.pushing > 60'000u);
    CHECK(counts.pushing_blocked > 2'000u);
    CHECK(counts.full > 3'000u);
  }

  TEST_CASE("[long] any sequence, a hundred thousand times") {
    LinkBench bench;
    CHECK(first_broken(bench, 100'000) == "");
  }

  TEST_CASE("the guard alone obeys the monitor over stalls and latches") {
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
      CAPTURE(seed);
      CHECK(broken_by<SoundGuard>(seed) == "");
    }
  }

  TEST_CASE("probe: guards with one rule broken are caught by that rule") {
    const auto caught = [](auto run) {
      for (std::uint64_t seed = 1; seed <= 50; ++seed) {
        if (std::string broken = run(seed); !broken.empty()) return broken;
      }
      return std::string("not caught");
    };
    expect(caught(broken_by<TrustingGuard>), "grows while blocked");
    expect(caught(broken_by<SwellingGuard>), "grows while blocked");
    expect(caught(broken_by<HastyGuard>), "steps by more than its slew");
    expect(caught(broken_by<NormGuard>), "beyond the device's axis");
    expect(caught(broken_by<DeafGuard>), "while blocked");
  }

  TEST_CASE("probe: drivers that send something else are caught on the link") {
    const auto caught = [](LinkBench::Sabotage how) {
      LinkBench bench;
      bench.sabotage(how);
      return first_broken(bench, 200);
    };
    expect(caught(LinkBench::Sabotage::kLouder), "slew");
    expect(caught(LinkBench::Sabotage::kDrivesOn), "not ready");
    expect(caught(LinkBench::Sabotage::kNotFinite), "not finite");

    // Full force, and then the deadman is released.
    std::vector<std::uint8_t> script = {8, 0, 11, 14, 3, 64, 64, 0, 0};
    for (int k = 0; k < 8; ++k) script.insert(script.end(), {0, 31});
    script.insert(script.end(), {15, 0, 0, 31, 0, 31});
    LinkBench stuck;
    CHECK(stuck.run(script) == "");
    stuck.sabotage(LinkBench::Sabotage::kStuck);
    expect(stuck.run(script), "stays on while blocked");
  }

  TEST_CASE("probe: each rule by one command") {
    const DeviceCapabilities device = limited_by_axes();
    const SafetyLimits limits = limits_of(device, 1'000'000);
    const ForceBlock block = ForceBlock::of(device, limits);
    const auto after = [&](const Vec3& first, const Vec3& second, std::int64_t apart_ns,
                           bool blocked, bool cut) {
      // Brought up within the slew, then one more command.
      ForceMonitor monitor(block);
      SentCommand sent;
      sent.ready = true;
      for (int k = 0; k <= 100; ++k) {
        sent.stamp_ns = 1'000'000'000 + k * std::int64_t{1'000'000};
        sent.wrench_d.force_w = static_cast<Real>(k) / 100 * first;
        REQUIRE(monitor.on_send(sent) == "");
      }
      sent.stamp_ns += apart_ns;
      sent.wrench_d.force_w = second;
      sent.blocked = blocked;
      sent.cut = cut;
      return monitor.on_send(sent);
    };
    const Vec3 push(1, -2, 0.5_r);
    const std::int64_t period_ns = 1'000'000;
    CHECK(after(push, push, period_ns, true, false) == "");
    CHECK(after(push, 0.9_r * push, period_ns, true, false) == "");
    expect(after(push, push + Vec3(0, 0, 0.01_r), period_ns, true, false), "grows");
    expect(after(push, Vec3(-0.1_r, -2, 0.5_r), period_ns, true, false), "grows");
    expect(after(push, Vec3(1, 3, 0.5_r), period_ns, false, false), "slew");
    expect(after(Vec3(1, -8, 0), Vec3::Zero(), period_ns, true, false), "slew");
    CHECK(after(Vec3(1, -8, 0), Vec3::Zero(), period_ns, true, true) == "");
    expect(after(push, Vec3(2.5_r, -2, 0.5_r), period_ns, false, false), "axis");
    expect(after(Vec3(1, -11, 0), Vec3(1, -12.5_r, 0), period_ns, false, false), "block");
    // Ten periods late: two of them count.
    const Real most = block.slew_n_per_s * 2.0e-3_r;
    CHECK(after(push, push - Vec3(0, most, 0), 10 * period_ns, false, false) == "");
    expect(after(push, push - Vec3(0, 1.01_r * most, 0), 10 * period_ns, false, false), "slew");
  }
}
