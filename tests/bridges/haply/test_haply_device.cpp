// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "hal/clock/servo_clock.hpp"
#include "tests/bridges/haply/inverse_service.hpp"
#include "tests/support/text_search.hpp"
#include "tools/bridges/haply/haply_device.hpp"
#include "tools/bridges/haply/haply_session.hpp"

using namespace haptic;
using namespace haptic::hal;
using namespace haptic::test;
using namespace haptic::tools;

namespace {

constexpr std::int64_t kMs = 1'000'000;
/// Longer than the device's own 1 ms, so that a busy machine is in time for it.
constexpr std::int64_t kPeriod_ns = 3 * kMs;
/// Tries of what a machine that stalls by itself spoils.
constexpr int kTries = 5;

/// The bridge's part against a service: a period thread that reads, and writes while the drives
/// are on. Each force that is written is another number, so that the service's log tells its age.
class HaplyBench {
 public:
  explicit HaplyBench(InverseKind kind, const std::string& version = "")
      : service(kind, !version.empty()           ? version
                      : kind == InverseKind::k31 ? "3.1.1.0"
                      : kind == InverseKind::k35 ? "3.5.0.0"
                                                 : "3.0.7.0") {
    renew();
  }

  void renew(HaplySettings settings = {}) {
    settings.http_port = service.http_port();
    settings.websocket_port = service.websocket_port();
    settings.times.period_ns = kPeriod_ns;
    device = std::make_unique<HaplyDevice>(settings);
  }
  bool open() {
    why.clear();
    const bool opened = device->open(why);
    CHECK(opened == why.empty());
    return opened;
  }

  /// Until `is_done` or `periods`. `force_n`: of period k, none: the drives are off.
  void run(int periods, const std::function<double(int)>& force_n,
           const std::function<bool()>& is_done = nullptr) {
    std::int64_t next_ns = monotonic_ns();
    for (int k = 0; k < periods; ++k) {
      next_ns = std::max(next_ns + kPeriod_ns, monotonic_ns() - kPeriod_ns);
      sleep_until(next_ns);
      last = device->read(monotonic_ns(), sample);
      silent += last == BridgeRead::kSilent ? 1 : 0;
      faults |= last == BridgeRead::kNew ? sample.faults : 0u;
      if (last == BridgeRead::kLost || (is_done && is_done())) return;
      if (!force_n) {
        static_cast<void>(device->release(monotonic_ns()));
        continue;
      }
      Wrench wrench;
      wrench.force_w.x() = static_cast<Real>(force_n(k) + 1e-9 * ++unique_);
      const std::int64_t now_ns = monotonic_ns();
      if (device->write(now_ns, wrench))
        written.emplace_back(now_ns, static_cast<double>(wrench.force_w.x()));
      else
        ++refused;
    }
  }
  /// A force is on and nothing was wrong so far. False: this machine was late.
  bool is_pressing(int periods) {
    faults = 0;
    const std::size_t before = service.log().size();
    run(periods, [](int) { return 0.5; });
    return faults == 0 && last != BridgeRead::kLost && forceful(before) > periods / 4;
  }
  /// The drives are off for so long, and then without a fault.
  bool is_quiet(int periods) {
    run(periods, nullptr);
    faults = 0;
    run(10, nullptr);
    return faults == 0;
  }
  bool released(int periods) {
    for (int k = 0; k < periods; ++k) {
      if (device->release(monotonic_ns())) return true;
      sleep_until(monotonic_ns() + kPeriod_ns);
    }
    return false;
  }

  /// Forces in the log that were written more than `limit_ns` before the service read them; none
  /// may come that was never written, or after a younger one.
  int older_than(std::int64_t limit_ns) const {
    int older = 0;
    std::size_t at = 0;
    for (const Exerted& e : service.log()) {
      if (e.force_n[0] == 0) continue;
      std::size_t k = at;
      while (k < written.size() && written[k].second != e.force_n[0]) ++k;
      REQUIRE_MESSAGE(k < written.size(), "a force that was not written, or an older one again");
      at = k;
      if (e.at_ns - written[k].first > limit_ns) ++older;
    }
    return older;
  }
  /// The log once the service has seen the end of the last session.
  std::vector<Exerted> log_at_end() const {
    for (int k = 0; k < 2'000; ++k) {
      std::vector<Exerted> log = service.log();
      if (!log.empty() && log.back().is_end) return log;
      sleep_until(monotonic_ns() + kMs);
    }
    return service.log();
  }
  /// Messages from the `at`-th on that exert something.
  int forceful(std::size_t at) const {
    int count = 0;
    const auto log = service.log();
    for (std::size_t k = at; k < log.size(); ++k) count += log[k].force_n[0] != 0 ? 1 : 0;
    return count;
  }

  InverseService service;
  std::unique_ptr<HaplyDevice> device;
  std::string why;
  BridgeSample sample;
  BridgeRead last = BridgeRead::kSilent;
  int silent = 0, refused = 0;
  std::uint32_t faults = 0;
  std::vector<std::pair<std::int64_t, double>> written;

 private:
  int unique_ = 0;
};

double half(int /*period*/) { return 0.5; }
double ramp(int k) { return k < 50 ? 0.02 * k : std::max(0.0, 0.02 * (100 - k)); }

}  // namespace

TEST_SUITE("bridges.haply_device") {
  TEST_CASE("open: facts, words and pose of each version that is known") {
    for (const InverseKind kind : {InverseKind::k31, InverseKind::k35}) {
      HaplyBench b(kind);
      TableDevice d = b.service.device();
      d.position_m = {0.01, -0.02, 0.03};
      d.q_wxyz = {0.6, 0, 0, 0.8};
      d.a = d.c = true;
      b.service.set(d);
      REQUIRE(b.open());
      const BridgeFacts& facts = b.device->facts();
      CHECK(test::has(facts.name, "Inverse3, serial 049D, service 3."));
      CHECK(test::has(facts.name, "grip 61548"));
      CHECK(test::has(facts.words, "torque is not felt"));
      CHECK(test::has(facts.words, "forces of other programs go unseen") ==
            (kind == InverseKind::k31));
      CHECK(facts.capabilities.driven_dof == kDofTranslation);
      CHECK(facts.capabilities.max_force_n == 2);
      CHECK(check_capabilities(facts.capabilities) == HalStatus::kOk);
      CHECK(b.device->watched().fd >= 0);
      b.run(500, nullptr, [&] { return b.last == BridgeRead::kNew; });
      REQUIRE(b.last == BridgeRead::kNew);
      CHECK(b.sample.calibrated);
      CHECK(b.sample.pose_dh.p_m[0] == doctest::Approx(0.01));
      CHECK(b.sample.pose_dh.p_m[1] == doctest::Approx(-0.02));
      CHECK(b.sample.pose_dh.q_xyzw[2] == doctest::Approx(0.8));
      CHECK(b.sample.pose_dh.q_xyzw[3] == doctest::Approx(0.6));
      CHECK(b.sample.switches == 5u);
      CHECK(b.sample.faults == 0u);
      CHECK_FALSE(b.sample.twist_valid);  // the grip does not say how fast it turns
      CHECK(test::has(b.service.first_message(), "preset") == (kind == InverseKind::k35));
    }
  }

  TEST_CASE("open: no service, another program, versions that are not known") {
    std::uint16_t free_port = 0;
    {
      HaplyBench b(InverseKind::k31);
      free_port = b.service.http_port();
    }
    HaplySettings nobody;
    nobody.http_port = nobody.websocket_port = free_port;
    std::string why;
    CHECK_FALSE(HaplyDevice(nobody).open(why));
    CHECK(test::has(why, "does not answer at 127.0.0.1:"));
    CHECK(test::has(why, "start it (systemctl start haply-inverse-service"));
    struct Row {
      InverseKind kind;
      const char* version;
      const char* why;
    };
    for (const Row& row : {Row{InverseKind::k30, "3.0.7.0", "speaks the format 3.0"},
                           Row{InverseKind::k31, "3.3.2.0", "3.3.2.0 is none of 3.1 and 3.5"},
                           Row{InverseKind::k35, "4.0.0.0", "4.0.0.0 is none of 3.1 and 3.5"},
                           Row{InverseKind::k35, "x\\y", "names no version"}}) {
      HaplyBench b(row.kind, row.version);
      CHECK_FALSE(b.open());
      CHECK(test::has(b.why, row.why));
    }
  }

  TEST_CASE("open: which device and which grip, and what is not there") {
    HaplyBench b(InverseKind::k35);
    TableDevice d;
    const auto refused = [&](const TableDevice& table, const HaplySettings& settings) {
      b.service.set(table);
      b.renew(settings);
      CHECK_FALSE(b.open());
      return b.why;
    };
    HaplySettings settings;
    d.is_there = false;
    CHECK(test::has(refused(d, settings), "lists no device; plug the Inverse3 in"));
    d.is_there = true;
    d.second_id = "04AA";
    CHECK(test::has(refused(d, settings), "several devices: 049D, 04AA; choose one with device"));
    settings.device = "0000";
    CHECK(test::has(refused(d, settings), "\"0000\" is not there; the service lists 049D, 04AA"));
    settings.device = "049D";
    d.wired_grip = "77";
    CHECK(test::has(refused(d, settings), "several grips: 61548, 77; choose one"));
    settings.grip = "9";
    CHECK(test::has(refused(d, settings), "grip \"9\" is not there; the service lists 61548, 77"));

    settings.grip = "77";
    d.wired_button = true;
    d.velocity_m_per_s = {0.1, 0, 0};
    b.service.set(d);
    b.renew(settings);
    REQUIRE(b.open());
    b.run(500, nullptr, [&] { return b.last == BridgeRead::kNew; });
    CHECK(b.sample.switches == 1u);

    settings.grip = "none";
    b.renew(settings);
    REQUIRE(b.open());
    CHECK(test::has(b.device->facts().words, "no VerseGrip: orientation is held"));
    b.run(500, nullptr, [&] { return b.last == BridgeRead::kNew; });
    CHECK(b.sample.calibrated);
    CHECK(b.sample.twist_valid);
    CHECK(b.sample.twist_d.linear_m_per_s[0] == doctest::Approx(0.1));
    CHECK(b.sample.pose_dh.q_xyzw[3] == 1);
  }

  TEST_CASE("write: force ramps at the service in the order of its making, and ends at zero") {
    for (const InverseKind kind : {InverseKind::k31, InverseKind::k35}) {
      bool was_whole = false;
      for (int k = 0; k < kTries && !was_whole; ++k) {
        HaplyBench b(kind);
        REQUIRE(b.open());
        b.run(10, nullptr);
        b.run(110, ramp);
        CHECK(b.released(200));
        b.device->close();
        const std::vector<Exerted> log = b.log_at_end();
        REQUIRE(log.size() > 20);
        double largest = 0;
        int not_understood = 0;
        for (const Exerted& e : log) {
          largest = std::max(largest, e.force_n[0]);
          not_understood += e.is_end || e.was_understood ? 0 : 1;
        }
        CHECK(not_understood == 0);
        CHECK(log.back().is_end);
        CHECK(log[log.size() - 2].force_n[0] == 0);
        // Younger than two periods when sent; a third for the way to the service.
        was_whole = largest > 0.8 && b.faults == 0 && b.older_than(3 * kPeriod_ns) == 0;
      }
      CHECK(was_whole);
    }
  }

  TEST_CASE("the key of another version exerts nothing, which the log shows") {
    HaplyBench b(InverseKind::k35, "3.1.0.0");  // a 3.5 that says it is a 3.1
    REQUIRE(b.open());
    b.run(30, half);
    CHECK(b.forceful(0) == 0);
    int not_understood = 0;
    for (const Exerted& e : b.service.log()) not_understood += e.was_understood ? 0 : 1;
    CHECK(not_understood > 5);
    // The service tells that it exerts nothing.
    b.run(5'000, half, [&] { return (b.faults & kDeviceDriveFault) != 0; });
    CHECK((b.faults & kDeviceDriveFault) != 0);
    b.device->close();
    REQUIRE(b.open());
    CHECK(has(b.device->facts().words, "exerts nothing of the force"));
  }

  TEST_CASE("an answer too many is passed over: the next pose is that of its own question") {
    HaplyBench b(InverseKind::k35);
    REQUIRE(b.open());
    unsigned least = 1'000;
    for (int k = 0; k < kTries && least > 4; ++k) {
      b.service.answer_twice(8);
      b.run(30, nullptr);
      TableDevice moved = b.service.device();
      moved.position_m[0] += 0.01;
      b.service.set(moved);
      const unsigned before = b.service.messages();
      const auto is_there = [&] {
        return std::abs(static_cast<double>(b.sample.pose_dh.p_m[0]) - moved.position_m[0]) < 1e-6;
      };
      b.run(200, nullptr, is_there);
      CHECK(is_there());
      least = std::min(least, b.service.messages() - before);
    }
    CHECK(least <= 4);  // those 8 answers would come first
  }

  TEST_CASE("a stall of 5 periods: the force goes on") {
    bool went_on = false;
    for (int k = 0; k < kTries && !went_on; ++k) {
      HaplyBench b(InverseKind::k35);
      REQUIRE(b.open());
      if (!b.is_pressing(20)) continue;
      b.service.stall_once(5 * kPeriod_ns);
      went_on = b.is_pressing(30) && b.older_than(9 * kPeriod_ns) == 0;
      CHECK(b.older_than(3 * kPeriod_ns) >= 1);  // the one in flight: it did stall
    }
    CHECK(went_on);
  }

  TEST_CASE("a stall of 20 periods or 300 ms: silent, zero, a drive fault until it was off once") {
    for (const std::int64_t stall_ns : {20 * kPeriod_ns, 300 * kMs}) {
      CAPTURE(stall_ns);
      const int periods = static_cast<int>(stall_ns / kPeriod_ns);
      bool was_whole = false;
      for (int k = 0; k < kTries && !was_whole; ++k) {
        HaplyBench b(InverseKind::k35);
        REQUIRE(b.open());
        if (!b.is_pressing(20)) continue;
        const std::size_t before = b.service.log().size();
        b.service.stall_once(stall_ns);
        b.run(periods + 20, half);  // a host that does not notice
        CHECK(b.silent >= 1);
        CHECK(b.refused >= 1);  // a service that stalls takes nothing
        CHECK(b.faults == kDeviceDriveFault);
        const std::vector<Exerted> log = b.service.log();
        std::size_t gap = before - 1;  // the last message before the stall
        while (gap + 1 < log.size() && log[gap + 1].at_ns - log[gap].at_ns < stall_ns / 2) ++gap;
        REQUIRE(gap + 2 < log.size());
        CHECK(b.forceful(gap + 2) == 0);  // one force was in flight, and none came after it
        CHECK(b.released(100));
        was_whole = b.silent >= periods / 2 && b.is_quiet(5) && b.is_pressing(20);
      }
      CHECK(was_whole);
    }
  }

  TEST_CASE("a stall with the drives off is no fault") {
    HaplyBench b(InverseKind::k31);
    REQUIRE(b.open());
    b.run(20, nullptr);
    b.service.stall_once(30 * kPeriod_ns);
    b.run(50, nullptr);
    CHECK(b.silent >= 5);
    CHECK(b.faults == 0u);
    CHECK(b.last != BridgeRead::kLost);
  }

  TEST_CASE("wrong answers: three are passed over, ten in a row end the connection at zero") {
    for (std::size_t k = 0; k < static_cast<std::size_t>(WrongAnswer::kCount); ++k) {
      const auto how = static_cast<WrongAnswer>(k);
      CAPTURE(k);
      HaplyBench b(InverseKind::k35);
      REQUIRE(b.open());
      b.run(5, half);
      b.service.answer_wrongly(how, 3);
      b.run(10, half);
      const bool at_once = how == WrongAnswer::kLong;
      CHECK((b.last == BridgeRead::kLost) == at_once);
      b.service.answer_wrongly(how, 1'000'000);
      b.run(400, half, nullptr);
      CHECK(b.last == BridgeRead::kLost);
      b.device->close();
      CHECK(test::has(b.device->last_end(), at_once ? "more than 64 kB"
                                            : how == WrongAnswer::kOtherShape
                                                ? "no longer listed"
                                                : "ten messages in a row were wrong"));
      const std::vector<Exerted> log = b.log_at_end();
      REQUIRE(log.size() > 2);
      CHECK(log.back().is_end);
      if (!at_once) CHECK(log[log.size() - 2].force_n[0] == 0);
      b.service.answer_wrongly(how, 0);
      REQUIRE(b.open());
      CHECK(test::has(b.device->facts().words, "the connection before ended: "));
    }
  }

  TEST_CASE("a force of another program: ours goes to zero, a fault, and words at the next open") {
    HaplyBench b(InverseKind::k35);
    REQUIRE(b.open());
    bool was_pressing = false;
    for (int k = 0; k < kTries && !was_pressing; ++k)
      was_pressing = b.is_quiet(10) && b.is_pressing(20);
    CHECK(was_pressing);
    b.service.exert({0, 0, -1});
    b.run(40, half);
    CHECK(b.faults == kDeviceDriveFault);
    const std::size_t after = b.service.log().size();
    b.run(20, half);
    CHECK(b.forceful(after) == 0);
    CHECK_FALSE(b.is_quiet(20));  // it is still there
    b.service.exert({0, 0, 0});
    CHECK(b.is_quiet(20));
    REQUIRE(b.open());
    CHECK(test::has(b.device->facts().words, "a force that another program has set"));

    HaplySettings settings;
    settings.accepts_other_forces = true;
    b.renew(settings);
    REQUIRE(b.open());
    CHECK(test::has(b.device->facts().words, "forces of other programs are accepted"));
    b.service.exert({0, 0, -1});
    was_pressing = false;
    for (int k = 0; k < kTries && !was_pressing; ++k)
      was_pressing = b.is_quiet(20) && b.is_pressing(30);
    CHECK(was_pressing);
  }

  TEST_CASE("OtherForce: shorter than ours is ours, sideways or longer is not") {
    const auto looks = [](double x, double y, int answers) {
      OtherForce other;
      const double ours[3] = {1, 0, 0}, exerted[3] = {x, y, 0};
      for (int k = 0; k < 8; ++k) other.sent(ours);
      bool found = false;
      for (int k = 0; k < answers; ++k) found = other.look(exerted);
      return found;
    };
    CHECK_FALSE(looks(1, 0, 50));
    CHECK_FALSE(looks(0.4, 0.1, 50));
    CHECK_FALSE(looks(0, 0, 50));
    CHECK_FALSE(looks(1.2, 0, 50));
    CHECK(looks(1.4, 0, 50));
    CHECK(looks(-0.4, 0, 50));
    CHECK(looks(0.5, 0.4, 50));
    CHECK_FALSE(looks(0.5, 0.4, 9));
    CHECK(looks(0.5, 0.4, 10));
  }

  TEST_CASE("a second client: said at open, and its force is noticed") {
    HaplyBench b(InverseKind::k35);
    REQUIRE(b.open());
    bool was_whole = false;
    for (int k = 0; k < kTries && !was_whole; ++k) {
      if (!b.is_quiet(10) || !b.is_pressing(20)) continue;
      HaplySettings settings;
      settings.http_port = b.service.http_port();
      settings.websocket_port = b.service.websocket_port();
      HaplyDevice second(settings);
      std::string why;
      REQUIRE(second.open(why));
      CHECK(test::has(second.facts().words, "1 other session connected"));
      const bool is_in_use =
          test::has(second.facts().words, "another program commands this device now");
      BridgeSample sample;
      std::uint32_t faults = 0;
      b.run(60, [&](int) {
        if (second.read(monotonic_ns(), sample) == BridgeRead::kNew) faults |= sample.faults;
        return 0.5;
      });
      was_whole = is_in_use && faults == kDeviceDriveFault;
    }
    CHECK(was_whole);
  }

  TEST_CASE(
      "unplugged, switched off, not calibrated, moved by another program, a grip that is gone") {
    HaplyBench b(InverseKind::k35);
    TableDevice d;
    const auto settle = [&](const TableDevice& table, int periods = 15) {
      b.service.set(table);
      b.run(periods, nullptr);
      b.faults = 0;
      b.run(20, nullptr, [&] { return b.last == BridgeRead::kNew; });
    };
    REQUIRE(b.open());
    settle(d);
    CHECK(b.sample.calibrated);
    d.calibrated = false;
    settle(d);
    CHECK_FALSE(b.sample.calibrated);
    d.calibrated = true;
    d.workspace_m = {0.01, 0, 0};
    settle(d);
    CHECK_FALSE(b.sample.calibrated);
    d.workspace_m = {0, 0, 0};
    d.powered = false;
    settle(d);
    CHECK(b.faults == kDeviceDriveFault);
    d.powered = true;
    d.wireless_grip = "";
    settle(d, 90);
    CHECK_FALSE(b.sample.calibrated);
    d.wireless_grip = "61548";
    d.awake = false;
    settle(d);
    CHECK_FALSE(b.sample.calibrated);
    d.awake = true;
    settle(d);
    CHECK(b.sample.calibrated);
    CHECK(b.faults == 0u);

    d.is_there = false;
    b.service.set(d);
    b.run(100, half);
    CHECK(b.last == BridgeRead::kLost);
    b.device->close();
    CHECK(test::has(b.device->last_end(), "no longer listed: unplugged"));
    CHECK_FALSE(b.open());
    CHECK(test::has(b.why, "lists no device"));
    CHECK(test::has(b.why, "before: the device is no longer listed"));
    d.is_there = true;
    b.service.set(d);
    CHECK(b.open());
  }

  TEST_CASE("a service that ends is lost, and found again when it is started") {
    HaplyBench b(InverseKind::k31);
    REQUIRE(b.open());
    b.run(10, half);
    b.service.stop();
    b.run(100, half);
    CHECK(b.last == BridgeRead::kLost);
    CHECK_FALSE(b.open());
    CHECK(test::has(b.why, "does not answer"));
    CHECK(test::has(b.why, "before: the service closed the connection"));
    b.service.start();
    REQUIRE(b.open());
    const std::size_t before = b.service.log().size();
    b.run(10, nullptr);
    CHECK(b.forceful(before) == 0);  // nothing of the connection before
    bool was_pressing = false;
    for (int k = 0; k < kTries && !was_pressing; ++k)
      was_pressing = b.is_quiet(5) && b.is_pressing(20);
    CHECK(was_pressing);
  }

  TEST_CASE("close while the service stalls: it reads zero next, and close does not wait for it") {
    HaplyBench b(InverseKind::k31);
    REQUIRE(b.open());
    b.run(10, half);
    b.service.stall_once(1'000 * kMs);
    b.run(10, half);
    const std::int64_t begin_ns = monotonic_ns();
    b.device->close();
    CHECK(monotonic_ns() - begin_ns < 800 * kMs);  // 0.1 s on a machine that is free
    const std::vector<Exerted> log = b.log_at_end();
    REQUIRE(log.size() > 3);
    CHECK(log.back().is_end);
    CHECK(log[log.size() - 2].force_n[0] == 0);
  }

  TEST_CASE("a bridge that no longer writes: zero after ten periods") {
    HaplyBench b(InverseKind::k35);
    REQUIRE(b.open());
    b.run(10, half);
    sleep_until(monotonic_ns() + 60 * kPeriod_ns);
    const std::size_t at = b.service.log().size();
    REQUIRE(at > 2);
    CHECK(b.forceful(at - 2) == 0);
  }

  TEST_CASE("make_haply: the keys, and the values that are refused") {
    const auto defect_of = [](const DriverOptions& options) {
      DriverDefect defect;
      const bool made = make_haply(options, defect) != nullptr;
      CHECK(made == defect.key.empty());
      return std::string(defect.key) + ": " + defect.text;
    };
    DriverOptions options;
    CHECK(defect_of(options) == ": ");
    options.values = {{"service", std::string("::1")}, {"http_port", 8400.0},
                      {"websocket_port", 8500.0},      {"device", std::string("049D")},
                      {"grip", std::string("none")},   {"max_force", 3.0},
                      {"accept_other_forces", true}};
    CHECK(defect_of(options) == ": ");
    options.values = {{"service", std::string("ws://localhost:10001")}};
    CHECK(test::has(defect_of(options), "service: 'ws://localhost:10001' is no name or address"));
    options.values = {{"device", std::string("a\"b")}};
    CHECK(test::has(defect_of(options), "device: 'a\"b' is no name of a device"));
    options.values = {{"http_port", 80.5}};
    CHECK(test::has(defect_of(options), "http_port: is no port"));
    options.values = {{"max_force", std::nan("")}};
    CHECK(test::has(defect_of(options), "max_force: is not within 0.1 and 10 N"));
  }
}
