// SPDX-License-Identifier: Apache-2.0
// The servo group and a session whose device is the caller's, each by the callback of its example:
// the rows of host_sim/lab/faults that a program
// with a device loop of its own can meet, in each of three states, judged by what is sent.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/tools/library/block_on_plate.hpp"

// The examples themselves, which are C.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wunused-function"
#define main example_main
#include "tools/library/examples/own_device_loop.c"
#undef main
#define main external_main
#include "tools/library/examples/external_device.c"
#undef main
#pragma GCC diagnostic pop

using namespace haptic::test;

namespace {

constexpr double kPeriod_s = 1e-3;
constexpr double kMost_n = 3, kMostStep_n = 600 * 2 * kPeriod_s;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kTouches_m = -0.020, kPressed_m = -0.024, kFree_m = -0.005;

// Of SafetyFault.
constexpr std::uint32_t kBadPose = 1u << 1, kStale = 1u << 2, kLate = 1u << 3, kLost = 1u << 4,
                        kDevice = 1u << 5, kStop = 1u << 6, kJump = 1u << 11, kSequence = 1u << 12;
constexpr std::uint32_t kIsArmed = 2, kIsFaulted = 4;

void free_memory(void* memory) { std::free(memory); }

double length(const double* v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/// Who makes the ticks.
enum class By { kServo, kSession };

/// A device with a hand on it, and the loop of the example.
class Loop {
 public:
  explicit Loop(By by = By::kServo) {
    if (by == By::kSession) {
      char why[256];
      session_ = open_device(block_scene().data(), block_scene().size(), why);
      REQUIRE(session_ != nullptr);
      report_ = {0, 0, {0, 0, 0}, {0, 0, 0, 1}, 0, 1, 0};
      return;
    }
    void* memory = nullptr;
    servo_ = begin_loop(block_scene().data(), block_scene().size(), &memory);
    memory_.reset(memory);
    REQUIRE(servo_ != nullptr);
    report_ = {0, 0, {0, 0, 0}, {0, 0, 0, 1}, 0, 1, 0};
  }
  ~Loop() {
    if (servo_ != nullptr) (void)haptic_servo_close(servo_);
    (void)haptic_session_free(&session_);
  }
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  [[nodiscard]] haptic_servo* servo() const { return servo_; }
  [[nodiscard]] haptic_session* session() const { return session_; }
  [[nodiscard]] int stop() const {
    return session_ != nullptr ? haptic_session_stop(session_) : haptic_servo_stop(servo_);
  }
  [[nodiscard]] const std::array<double, 3>& force() const { return force_; }
  [[nodiscard]] double force_n() const { return length(force_.data()); }
  device_report& report() { return report_; }

  /// The hand goes towards `z_m` at 0.1 m/s.
  void lead() {
    const double way_m = std::clamp(wanted_m_ - report_.position_m[2], -1e-4, 1e-4);
    report_.position_m[2] += way_m;
  }
  void hold(double z_m, std::uint32_t buttons) {
    wanted_m_ = z_m;
    buttons_ = buttons;
  }
  /// A period with a report.
  void pass() {
    time_s_ += kPeriod_s;
    lead();
    report_.number += 1;
    report_.time_s = time_s_;
    report_.buttons = buttons_;
    call(report_, time_s_);
  }
  void pass(int ticks) {
    for (int k = 0; k < ticks; ++k) pass();
  }
  /// A period that passes without a callback, or with one without a new report.
  void miss_tick() {
    time_s_ += kPeriod_s;
    lead();
    report_.number += 1;
    report_.time_s = time_s_;
  }
  void miss_report() {
    time_s_ += kPeriod_s;
    call(report_, time_s_);
  }
  /// With anything in the report's place, and any time.
  void call(const device_report& report, double now_s) {
    const std::array<double, 3> before = force_;
    if (session_ != nullptr) {
      handle_report same{};
      static_assert(sizeof same == sizeof report);
      std::memcpy(&same, &report, sizeof same);
      goes_on_ = session_callback(session_, &same, now_s, force_.data()) != 0;
    } else {
      device_callback(servo_, &report, now_s, force_.data());
    }
    double step[3];
    for (std::size_t k = 0; k < 3; ++k) step[k] = force_[k] - before[k];
    largest_step_n_ = std::max(largest_step_n_, length(step));
    is_finite_ = is_finite_ && std::isfinite(force_n());
    largest_n_ = std::max(largest_n_, force_n());
  }
  [[nodiscard]] double now_s() const { return time_s_; }
  [[nodiscard]] bool goes_on() const { return goes_on_; }
  /// In any case.
  void check_wire() const {
    CHECK(is_finite_);
    CHECK(largest_n_ <= kMost_n * (1 + 1e-9));
    CHECK(largest_step_n_ <= kMostStep_n * (1 + 1e-9));
  }
  /// State after a tick that changes nothing: the same report at the same time.
  [[nodiscard]] haptic_servo_output state() {
    haptic_servo_input input = HAPTIC_SERVO_INPUT_INIT;
    haptic_servo_output output = HAPTIC_SERVO_OUTPUT_INIT;
    input.ready = report_.is_ready;
    input.switches = buttons_;
    input.report = report_.number;
    input.report_time_s = report_.time_s;
    input.time_s = time_s_;
    input.device_faults = report_.faults;
    std::memcpy(input.pose, report_.position_m, sizeof report_.position_m);
    std::memcpy(input.pose + 3, report_.orientation_xyzw, sizeof report_.orientation_xyzw);
    REQUIRE((session_ != nullptr ? haptic_session_tick(session_, &input, &output)
                                 : haptic_servo_tick(servo_, &input, &output)) == HAPTIC_OK);
    std::copy_n(output.wrench, 3, force_.begin());
    return output;
  }
  bool arm(double z_m) {
    hold(kFree_m, 0);
    pass(300);
    hold(kFree_m, 1);
    pass(200);
    hold(z_m, 1);
    pass(400);
    return state().arming == kIsArmed;
  }

 private:
  std::unique_ptr<void, void (*)(void*)> memory_{nullptr, free_memory};
  haptic_servo* servo_ = nullptr;
  haptic_session* session_ = nullptr;
  bool goes_on_ = true;
  device_report report_{};
  std::array<double, 3> force_{};
  std::uint32_t buttons_ = 0;
  double time_s_ = 1, wanted_m_ = 0;
  double largest_step_n_ = 0, largest_n_ = 0;
  bool is_finite_ = true;
};

enum class Out { kUnchanged, kDips, kRampsToZero };

/// A row: what happens, and what must come of it. Names are those of host_sim/lab/faults where a
/// row there is the same.
struct Row {
  const char* name;
  Out out;
  std::uint32_t faults;  ///< latched; several: any of them
  int within_ticks;      ///< found and on the way to zero
  void (*play)(Loop& loop);
};

void miss_reports(Loop& loop, int count) {
  for (int k = 0; k < count; ++k) loop.miss_report();
}
void miss_ticks(Loop& loop, int count) {
  for (int k = 0; k < count; ++k) loop.miss_tick();
}
/// One report is another, for `count` periods.
template <class Change>
void spoil(Loop& loop, int count, const Change& change) {
  for (int k = 0; k < count; ++k) {
    loop.miss_tick();
    device_report report = loop.report();
    report.buttons = 1;
    double now_s = loop.now_s();
    change(report, now_s);
    loop.call(report, now_s);
  }
}

constexpr int kLostPeriods = 7;  // SafetyLimits::lost_periods, one to find it and one to act

const Row kRows[] = {
    {"none", Out::kUnchanged, 0, 0, [](Loop& l) { l.pass(20); }},
    {"lost 1", Out::kUnchanged, 0, 0, [](Loop& l) { miss_reports(l, 1); }},
    {"lost 3", Out::kDips, 0, 0, [](Loop& l) { miss_reports(l, 3); }},
    {"lost 50", Out::kRampsToZero, kStale, kLostPeriods, [](Loop& l) { miss_reports(l, 50); }},
    {"frozen 100", Out::kRampsToZero, kStale, kLostPeriods, [](Loop& l) { miss_reports(l, 100); }},
    {"doubled", Out::kUnchanged, 0, 0, [](Loop& l) { l.call(l.report(), l.now_s()); }},
    {"report time is old", Out::kRampsToZero, kStale, 1,
     [](Loop& l) { spoil(l, 3, [](device_report& r, double&) { r.time_s -= 0.05; }); }},
    {"report time is none", Out::kRampsToZero, kStale, 1,
     [](Loop& l) { spoil(l, 3, [](device_report& r, double&) { r.time_s = kNone; }); }},
    {"encoder jump 1 mm", Out::kUnchanged, 0, 0,
     [](Loop& l) { spoil(l, 1, [](device_report& r, double&) { r.position_m[0] += 1e-3; }); }},
    {"encoder jump 30 mm", Out::kRampsToZero, kJump, 0,
     [](Loop& l) { spoil(l, 1, [](device_report& r, double&) { r.position_m[0] += 0.03; }); }},
    {"pose is not a number", Out::kRampsToZero, kBadPose, 0,
     [](Loop& l) { spoil(l, 1, [](device_report& r, double&) { r.position_m[1] = kNone; }); }},
    {"pose is infinite", Out::kRampsToZero, kBadPose | kJump, 0,
     [](Loop& l) { spoil(l, 1, [](device_report& r, double&) { r.position_m[1] = 1 / 0.0; }); }},
    {"quaternion is not of unit length", Out::kRampsToZero, kBadPose, 0,
     [](Loop& l) { spoil(l, 1, [](device_report& r, double&) { r.orientation_xyzw[3] = 0.9; }); }},
    {"reordered", Out::kRampsToZero, kSequence, 0,
     [](Loop& l) { spoil(l, 1, [](device_report& r, double&) { r.number -= 5; }); }},
    {"emergency stop of the device", Out::kRampsToZero, kStop, 0,
     [](Loop& l) { spoil(l, 1, [](device_report& r, double&) { r.buttons = 3; }); }},
    {"emergency stop by call", Out::kRampsToZero, kStop, 0,
     [](Loop& l) {
       REQUIRE(l.stop() == HAPTIC_OK);
       l.pass();
     }},
    {"drive fault", Out::kRampsToZero, kDevice, 0,
     [](Loop& l) { spoil(l, 1, [](device_report& r, double&) { r.faults = 1u << 3; }); }},
    {"unplug in flight", Out::kRampsToZero, kLost, 0,
     [](Loop& l) { spoil(l, 3, [](device_report& r, double&) { r.is_ready = 0; }); }},
    {"calibration lost", Out::kRampsToZero, kLost | kDevice, 0,
     [](Loop& l) { spoil(l, 3, [](device_report& r, double&) { r.faults = 1u << 4; }); }},
    {"servo stalled 1", Out::kUnchanged, 0, 0, [](Loop& l) { miss_ticks(l, 1), l.pass(); }},
    {"servo stalled 3", Out::kDips, 0, 0, [](Loop& l) { miss_ticks(l, 3), l.pass(); }},
    {"servo stalled 10", Out::kRampsToZero, kLate, 0, [](Loop& l) { miss_ticks(l, 10), l.pass(); }},
    {"servo stalled 100", Out::kRampsToZero, kLate, 0,
     [](Loop& l) { miss_ticks(l, 100), l.pass(); }},
    {"time is none", Out::kRampsToZero, kLate, 0,
     [](Loop& l) { spoil(l, 1, [](device_report&, double& now_s) { now_s = kNone; }); }},
    {"time goes back", Out::kRampsToZero, kLate, 0,
     [](Loop& l) { spoil(l, 1, [](device_report&, double& now_s) { now_s -= 0.5; }); }},
    {"time stands", Out::kRampsToZero, kLate | kStale, kLostPeriods,
     [](Loop& l) {
       const double at_s = l.now_s();
       spoil(l, 20, [at_s](device_report&, double& now_s) { now_s = at_s; });
     }},
    {"deadman released", Out::kRampsToZero, 0, 0,
     [](Loop& l) {
       l.hold(kPressed_m, 0);
       l.pass();
     }},
};

constexpr By kBoth[] = {By::kServo, By::kSession};

/// Ticks until the force is zero, `most` at most.
int ticks_to_zero(Loop& loop, int most) {
  int ticks = 0;
  for (; ticks < most && loop.force_n() > 0; ++ticks) loop.pass();
  return ticks;
}

}  // namespace

TEST_SUITE("tools.library") {
  TEST_CASE("servo: each row of the fault table that applies, with a pressed part") {
    for (std::size_t k = 0; k < 2 * std::size(kRows); ++k) {
      const Row& row = kRows[k / 2];
      const std::string name = row.name;
      CAPTURE(name);
      CAPTURE(k % 2);
      Loop loop(kBoth[k % 2]);
      REQUIRE(loop.arm(kPressed_m));
      const double before_n = loop.force_n();
      CHECK(before_n == doctest::Approx(500 * 0.0039).epsilon(0.05));
      row.play(loop);
      if (row.out == Out::kUnchanged) {
        CHECK(loop.force_n() == doctest::Approx(before_n).epsilon(0.3));
        CHECK(loop.state().safety_faults == 0);
        loop.pass(200);
        CHECK(loop.force_n() == doctest::Approx(before_n).epsilon(0.01));
      } else if (row.out == Out::kDips) {
        CHECK(loop.force_n() < before_n);
        CHECK(loop.force_n() > 0.2 * before_n);
        CHECK(loop.state().safety_faults == 0);
        loop.pass(200);
        CHECK(loop.force_n() == doctest::Approx(before_n).epsilon(0.01));
      } else {
        // The ramp of the largest force, from the tick on in which it was found.
        const int ramp_ticks = static_cast<int>(std::ceil(kMost_n / (600 * kPeriod_s)));
        CHECK(ticks_to_zero(loop, 100) <= row.within_ticks + ramp_ticks);
        haptic_servo_output state = loop.state();
        if (row.faults != 0) CHECK((state.safety_faults & row.faults) != 0);
        CHECK(state.arming == (row.faults != 0 ? kIsFaulted : 0u));
        // Nothing comes back by itself.
        loop.pass(300);
        CHECK(loop.force_n() == 0);
        CHECK(loop.state().arming != kIsArmed);
        // Released and pressed again it does: after a fault from the start once more, 5 mm deeper.
        CHECK(loop.arm(kPressed_m + kFree_m));
        state = loop.state();
        CHECK(state.safety_faults == 0);
        CHECK(state.armings == 2);
        CHECK(loop.force_n() > 0);
      }
      loop.check_wire();
    }
  }

  TEST_CASE("servo: each row while the force ramps in, and with the part free") {
    for (const double z_m : {kFree_m, kPressed_m}) {
      for (std::size_t k = 0; k < 2 * std::size(kRows); ++k) {
        const Row& row = kRows[k / 2];
        const std::string name = row.name;
        CAPTURE(name);
        CAPTURE(z_m);
        CAPTURE(k % 2);
        Loop loop(kBoth[k % 2]);
        loop.hold(kTouches_m, 0);
        loop.pass(300);
        loop.hold(z_m, 1);
        loop.pass(50);  // of 100
        row.play(loop);
        if (row.out == Out::kRampsToZero) {
          (void)ticks_to_zero(loop, 100);
          loop.pass(100);
          CHECK(loop.force_n() == 0);
          CHECK(loop.state().arming != kIsArmed);
        } else {
          loop.pass(300);
          CHECK(loop.state().arming == kIsArmed);
        }
        loop.check_wire();
      }
    }
  }

  TEST_CASE("servo: the check of the wire sees a jump") {
    // Straight from the core, with no servo between: the first touch of a hand that is deep inside.
    const CoreBench bench;
    haptic_step_input input = HAPTIC_STEP_INPUT_INIT;
    haptic_step_output output = HAPTIC_STEP_OUTPUT_INIT;
    double largest_n = 0, last_n = 0;
    for (int k = 0; k < 10; ++k) {
      input.time_s = 0.001 * k;
      input.pose[2] = k < 5 ? 0.016 : 0.005;
      REQUIRE(haptic_core_step(bench.core(), &input, &output) == HAPTIC_OK);
      largest_n = std::max(largest_n, std::abs(output.wrench[2] - last_n));
      last_n = output.wrench[2];
    }
    CHECK(largest_n > kMostStep_n);
  }

  TEST_CASE("servo: any numbers in, and what is sent is finite, bounded and without a jump") {
    std::mt19937_64 random(20'251);
    const auto pick = [&random](std::size_t n) { return random() % n; };
    const double odd[] = {kNone, 1e308, -1e308, 0, -0.0, 1e-310, 9e9, 8.9e9, -1, 1e6};
    By by = By::kServo;
    SUBCASE("the servo group") { by = By::kServo; }
    SUBCASE("a session") { by = By::kSession; }
    Loop loop(by);
    REQUIRE(loop.arm(kPressed_m));
    unsigned armed = 0;
    for (int k = 0; k < 20'000; ++k) {
      loop.miss_tick();
      device_report report = loop.report();
      report.buttons = k / 150 % 2 == 0 ? 1 : 0;
      double now_s = loop.now_s();
      if (pick(4) == 0) {
        const double value = pick(2) == 0 ? odd[pick(std::size(odd))]
                                          : std::ldexp(static_cast<double>(pick(1000)) - 500.0,
                                                       static_cast<int>(pick(40)) - 30);
        switch (pick(8)) {
          case 0:
            report.position_m[pick(3)] = value;
            break;
          case 1:
            report.orientation_xyzw[pick(4)] = value;
            break;
          case 2:
            report.time_s = value;
            break;
          case 3:
            now_s = value;
            break;
          case 4:
            report.number = random();
            break;
          case 5:
            report.faults = static_cast<std::uint32_t>(random());
            break;
          case 6:
            report.buttons = static_cast<std::uint32_t>(random());
            break;
          default:
            report.is_ready = 0;
            break;
        }
      }
      loop.call(report, now_s);
      if (loop.force_n() > 0) armed += 1;
    }
    CHECK(armed > 0);
    loop.check_wire();
    loop.report().number = UINT64_MAX / 2;
    loop.pass(2000);
    CHECK(loop.arm(kPressed_m));  // none of it stays
  }

  TEST_CASE("servo: refusals, each with its number; the wrench is zero then") {
    const std::span<const std::byte> scene = block_scene();
    haptic_servo_options good = HAPTIC_SERVO_OPTIONS_INIT;
    haptic_servo_bounds bounds = HAPTIC_SERVO_BOUNDS_INIT;
    REQUIRE(haptic_servo_bounds_of(scene.data(), scene.size(), &good, &bounds) == HAPTIC_OK);
    CHECK(bounds.most_work > 0);
    CHECK(bounds.longest_ramp_s == doctest::Approx(3.0 / 600).epsilon(0.01));
    CHECK(bounds.lost_periods == 5);
    const auto refused = [&](auto change) {
      haptic_servo_options options = good;
      change(options);
      return haptic_servo_bounds_of(scene.data(), scene.size(), &options, &bounds);
    };
    CHECK(refused([](auto& o) { o.deadman = 0; }) == HAPTIC_ERROR_NUMBER);
    CHECK(refused([](auto& o) { o.clutch = 1; }) == HAPTIC_ERROR_NUMBER);
    CHECK(refused([](auto& o) { o.emergency_stop = 1; }) == HAPTIC_ERROR_NUMBER);
    CHECK(refused([](auto& o) { o.driven_axes = 0x40; }) == HAPTIC_ERROR_NUMBER);
    CHECK(refused([](auto& o) { o.scale = kNone; }) == HAPTIC_ERROR_NUMBER);
    CHECK(refused([](auto& o) { o.scale = 0; }) == HAPTIC_ERROR_NUMBER);
    CHECK(refused([](auto& o) { o.max_force_n = -1; }) == HAPTIC_ERROR_NUMBER);
    CHECK(refused([](auto& o) { o.slew_n_per_s = kNone; }) == HAPTIC_ERROR_NUMBER);
    CHECK(refused([](auto& o) { o.ramp_in_s = 0.01; }) == HAPTIC_ERROR_NUMBER);
    CHECK(refused([](auto& o) { o.rate_hz = 20'000; }) == HAPTIC_ERROR_NUMBER);
    CHECK(refused([](auto& o) { o.offset_m[1] = kNone; }) == HAPTIC_ERROR_NUMBER);
    CHECK(refused([](auto& o) { o.rotation[0] = 1; }) == HAPTIC_ERROR_POSE);
    CHECK(refused([](auto& o) { o.struct_size -= 8; }) == HAPTIC_ERROR_VERSION);
    CHECK(haptic_servo_bounds_of(scene.data(), 64, &good, &bounds) == HAPTIC_ERROR_SCENE);
    CHECK(haptic_servo_bounds_of(nullptr, 64, &good, &bounds) == HAPTIC_ERROR_NULL);
    CHECK(haptic_servo_bounds_of(scene.data(), scene.size(), nullptr, &bounds) ==
          HAPTIC_ERROR_NULL);

    Loop loop;
    haptic_servo_input input = HAPTIC_SERVO_INPUT_INIT;
    haptic_servo_output output = HAPTIC_SERVO_OUTPUT_INIT;
    output.wrench[0] = 7;
    CHECK(haptic_servo_tick(nullptr, &input, &output) == HAPTIC_ERROR_NULL);
    CHECK(output.wrench[0] == 0);
    input.struct_size = 4;
    output.wrench[0] = 7;
    CHECK(haptic_servo_tick(loop.servo(), &input, &output) == HAPTIC_ERROR_VERSION);
    CHECK(output.wrench[0] == 0);
    haptic_servo* servo = nullptr;
    alignas(64) std::array<std::byte, 256> small{};
    CHECK(haptic_servo_begin(scene.data(), scene.size(), small.data(), small.size(), &good,
                             &servo) == HAPTIC_ERROR_MEMORY);
    CHECK(servo == nullptr);
    CHECK(haptic_servo_stop(reinterpret_cast<haptic_servo*>(small.data())) == HAPTIC_ERROR_HANDLE);
  }

  TEST_CASE("servo: closed is closed; a stop from another thread meets the loop") {
    Loop loop;
    REQUIRE(loop.arm(kPressed_m));
    std::thread([&] { CHECK(haptic_servo_stop(loop.servo()) == HAPTIC_OK); }).join();
    loop.pass();
    CHECK((loop.state().safety_faults & kStop) != 0);
    haptic_verdict verdict = HAPTIC_VERDICT_INIT;
    CHECK(haptic_servo_verdict(loop.servo(), &verdict) == HAPTIC_OK);
    CHECK(verdict.ticks > 500);
    CHECK(haptic_servo_close(loop.servo()) == HAPTIC_OK);
    CHECK(haptic_servo_stop(loop.servo()) == HAPTIC_ERROR_CLOSED);
    CHECK(haptic_servo_verdict(loop.servo(), &verdict) == HAPTIC_ERROR_CLOSED);
    CHECK(haptic_servo_close(loop.servo()) == HAPTIC_ERROR_CLOSED);
  }

  TEST_CASE("external: a session gives the bits of the servo group, and other threads read them") {
    Loop servo, session(By::kSession);
    haptic_device_status status = HAPTIC_DEVICE_STATUS_INIT;
    REQUIRE(haptic_session_device(session.session(), 0, &status) == HAPTIC_OK);
    CHECK(status.phase == HAPTIC_DEVICE_STARTS);
    CHECK(std::string(status.waits_for).find("has not called") != std::string::npos);
    REQUIRE(servo.arm(kPressed_m));
    REQUIRE(session.arm(kPressed_m));
    CHECK(servo.force() == session.force());
    const haptic_servo_output one = servo.state(), other = session.state();
    CHECK(one.state_hash == other.state_hash);
    haptic_state state = HAPTIC_STATE_INIT;
    haptic_verdict verdict = HAPTIC_VERDICT_INIT;
    std::vector<haptic_tick> ticks(2000);
    std::size_t count = 0;
    std::thread([&] {
      CHECK(haptic_session_state(session.session(), &state) == HAPTIC_OK);
      CHECK(haptic_session_device(session.session(), 0, &status) == HAPTIC_OK);
      CHECK(haptic_session_verdict(session.session(), &verdict) == HAPTIC_OK);
      CHECK(haptic_session_history(session.session(), ticks.data(), ticks.size(), sizeof ticks[0],
                                   &count) == HAPTIC_OK);
    }).join();
    CHECK(state.state_hash == other.state_hash);
    CHECK(state.tick == 902);
    CHECK(state.arming == kIsArmed);
    CHECK(state.hand_held == 1);
    CHECK(state.hand_pose[2] == doctest::Approx(0.035 + kPressed_m + 1e-4).epsilon(1e-6));
    CHECK(state.felt_pose[2] == doctest::Approx(0.015).epsilon(1e-3));
    CHECK(state.sent_wrench[2] == doctest::Approx(session.force()[2]).epsilon(1e-9));
    CHECK(status.phase == HAPTIC_DEVICE_RUNS);
    CHECK(status.force_n == doctest::Approx(session.force_n()).epsilon(1e-9));
    CHECK((status.is_silent != 0 || std::string(status.waits_for).empty()));  // a busy machine
    CHECK(count == 902);
    CHECK(ticks[901].sent_wrench[2] == doctest::Approx(session.force()[2]).epsilon(1e-9));
    CHECK(ticks[901].hand_pose[2] == doctest::Approx(state.hand_pose[2]).epsilon(1e-9));
    CHECK(verdict.contact_ticks > 100);

    // A loop that calls no more: it is said, with the force that the device still has.
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    REQUIRE(haptic_session_device(session.session(), 0, &status) == HAPTIC_OK);
    CHECK(status.is_silent == 1);
    CHECK(status.force_n > 1);
    CHECK(std::string(status.waits_for).find("has not called") != std::string::npos);

    // Fixed parts that are somewhere else at once take the force away by its ramp.
    haptic_frame frame = HAPTIC_FRAME_INIT;
    frame.stands = 1;
    frame.pose[2] = 0.003;
    REQUIRE(haptic_session_frame(session.session(), &frame) == HAPTIC_OK);
    session.pass(100);
    session.check_wire();
    REQUIRE(haptic_session_state(session.session(), &state) == HAPTIC_OK);
    CHECK((state.safety_faults & 1u << 13) != 0);
    CHECK(session.force_n() == 0);
  }

  TEST_CASE("external: a close ramps to zero in the next ticks, of whichever thread they are") {
    Loop loop(By::kSession);
    REQUIRE(loop.arm(kPressed_m));
    REQUIRE(loop.force_n() > 1);
    REQUIRE(haptic_session_close(loop.session()) == HAPTIC_OK);  // the loop's thread: at once
    CHECK(haptic_session_close(loop.session()) == HAPTIC_ERROR_CLOSED);
    int ticks = 0;
    for (; ticks < 100 && loop.goes_on(); ++ticks) loop.pass();
    CHECK(ticks > 2);
    CHECK(ticks <= 10);
    CHECK(loop.force_n() == 0);
    loop.check_wire();
    haptic_device_status status = HAPTIC_DEVICE_STATUS_INIT;
    REQUIRE(haptic_session_device(loop.session(), 0, &status) == HAPTIC_OK);
    CHECK(status.phase == HAPTIC_DEVICE_ENDED);

    Loop other(By::kSession);
    REQUIRE(other.arm(kPressed_m));
    std::thread device([&] {
      while (other.goes_on()) {
        other.pass();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    });
    haptic_state state = HAPTIC_STATE_INIT;
    do {  // until the loop is that thread's
      REQUIRE(haptic_session_state(other.session(), &state) == HAPTIC_OK);
    } while (state.tick < 903);
    CHECK(haptic_session_close(other.session()) == HAPTIC_OK);
    CHECK(haptic_session_device(other.session(), 0, &status) == HAPTIC_OK);
    CHECK(status.phase == HAPTIC_DEVICE_ENDED);  // waited for
    device.join();
    CHECK(other.force_n() == 0);
    other.check_wire();
  }

  TEST_CASE("external: two threads at once, one ticks and one is busy; refusals with their words") {
    Loop loop(By::kSession);
    REQUIRE(loop.arm(kPressed_m));
    haptic_servo_input input = HAPTIC_SERVO_INPUT_INIT;
    std::atomic<int> done{0}, busy{0}, wrong{0};
    const auto call = [&] {
      for (int k = 0; k < 3000; ++k) {
        haptic_servo_output output = HAPTIC_SERVO_OUTPUT_INIT;
        output.wrench[0] = 7;
        const int error = haptic_session_tick(loop.session(), &input, &output);
        const bool is_zero = length(output.wrench) == 0;
        if (error == HAPTIC_OK) done += 1;
        if (error == HAPTIC_ERROR_BUSY && is_zero) busy += 1;
        if (error != HAPTIC_OK && (error != HAPTIC_ERROR_BUSY || !is_zero)) wrong += 1;
      }
    };
    std::thread one(call), two(call);
    one.join();
    two.join();
    CHECK(wrong == 0);
    CHECK(done + busy == 6000);
    CHECK(done > 0);
    haptic_state state = HAPTIC_STATE_INIT;
    CHECK(haptic_session_state(loop.session(), &state) == HAPTIC_OK);
    CHECK(state.tick == 901u + static_cast<unsigned>(done));

    haptic_session_options options = HAPTIC_SESSION_OPTIONS_INIT;
    haptic_servo_options servo = HAPTIC_SERVO_OPTIONS_INIT;
    haptic_session* session = nullptr;
    char text[256] = "";
    const auto opened = [&] {
      const int error = haptic_session_open_external(block_scene().data(), block_scene().size(),
                                                     &options, &servo, &session, text, sizeof text);
      (void)haptic_session_free(&session);
      return error;
    };
    CHECK(opened() == HAPTIC_ERROR_DEVICE);  // "sim"
    CHECK(std::string(text).find("external") != std::string::npos);
    options.device = "external";
    CHECK(opened() == HAPTIC_OK);
    options.rate_hz = servo.rate_hz = 500;
    CHECK(opened() == HAPTIC_ERROR_NUMBER);
    CHECK(std::string(text).find("given twice") != std::string::npos);
    options.rate_hz = 0;
    options.priority = 50;
    CHECK(opened() == HAPTIC_ERROR_NUMBER);
    options.priority = 0;
    options.hands = 2;
    CHECK(opened() == HAPTIC_ERROR_PART);
    options.hands = 0;
    servo.max_force_n = kNone;
    CHECK(opened() == HAPTIC_ERROR_NUMBER);
    CHECK(haptic_session_open_external(block_scene().data(), block_scene().size(), &options,
                                       nullptr, &session, text, sizeof text) == HAPTIC_ERROR_NULL);
    // The plain call has the defaults; another device's loop is its own.
    REQUIRE(haptic_session_open(block_scene().data(), block_scene().size(), &options, &session) ==
            HAPTIC_OK);
    haptic_servo_output output = HAPTIC_SERVO_OUTPUT_INIT;
    CHECK(haptic_session_tick(session, &input, &output) == HAPTIC_OK);
    haptic_hand_goal goal = HAPTIC_HAND_GOAL_INIT;
    CHECK(haptic_session_move_hand(session, &goal, nullptr) == HAPTIC_ERROR_DEVICE);
    CHECK(haptic_session_tick(nullptr, &input, &output) == HAPTIC_ERROR_NULL);
    input.struct_size = 3;
    CHECK(haptic_session_tick(session, &input, &output) == HAPTIC_ERROR_VERSION);
    (void)haptic_session_free(&session);
  }
}
