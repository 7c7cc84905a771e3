// SPDX-License-Identifier: Apache-2.0
// The bridge to 3D Systems' devices on a stand-in of libHD.
#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <string>

#include "hal/device.hpp"
#include "tests/bridges/vendor/vendor_bench.hpp"
#include "tools/bridges/openhaptics/openhaptics_device.hpp"

using namespace haptic;
using namespace haptic::test;
using hal::BridgeRead;
using tools::make_openhaptics;

namespace {

struct HdBench : VendorBench {
  explicit HdBench(std::vector<std::pair<std::string_view, Value>> keys = {},
                   const std::string& library = HAPTIC_HD_FAKE)
      : VendorBench(make_openhaptics, library, std::move(keys)) {}
};

std::string hd_refusal(const char* fault) {
  const FakeEnvironment environment(fault);
  HdBench b;
  const std::uint64_t closed = b.trace->closed.load(), opened = b.trace->opened.load();
  const std::string why = b.refusal();
  CHECK(b.trace->closed.load() - closed == b.trace->opened.load() - opened);
  return why;
}

/// The variable for as long as this lives.
struct PairingFolder {
  explicit PairingFolder(const char* folder) {
    if (folder != nullptr)
      setenv("GTDD_HOME", folder, 1);
    else
      unsetenv("GTDD_HOME");
  }
  ~PairingFolder() { unsetenv("GTDD_HOME"); }
};

[[noreturn]] void crash_in_hd_child() {
  (void)signal(SIGSEGV, SIG_DFL);
  const FakeEnvironment environment("crashes@40");
  HdBench b;
  if (b.open()) b.run(10'000, [](int ms) { return ramp(ms, 2); });
  _exit(0);
}

}  // namespace

TEST_SUITE_BEGIN("bridges.openhaptics");

TEST_CASE("a library that is not there, lacks a function or is of another version") {
  CHECK(contains(HdBench({}, "/nowhere/libHD.so").refusal(), "key library"));
  CHECK(contains(HdBench({}, HAPTIC_HD_OLD_FAKE).refusal(), "has no hdStopScheduler:"));
  CHECK(contains(HdBench({}, HAPTIC_DHD_FAKE).refusal(), "hdInitDevice"));
  CHECK(contains(hd_refusal("version"), "version 2.0.24"));
  hal::DriverDefect defect;
  const auto device = make_openhaptics({}, defect);
  REQUIRE(device != nullptr);
  std::string why;
  if (device->open(why)) return;  // someone has it installed
  CHECK(contains(why, "libHD.so"));
}

TEST_CASE("a device that is not there: the error, the rights, the pairing in words") {
  {
    const PairingFolder unset(nullptr);
    const std::string why = hd_refusal("no_device");
    CHECK(contains(why, "HD_COMM_ERROR (0x0302, internal 42)"));
    CHECK(contains(why, "dialout"));
    CHECK(contains(why, "GTDD_HOME is not set"));
  }
  const PairingFolder empty("/nowhere");
  CHECK(contains(hd_refusal("no_device"), "/nowhere/config/Default Device.config"));
  CHECK(contains(hd_refusal("no_handle"), "gives no reason"));
  CHECK(contains(hd_refusal("busy"), "another program"));
  const std::string other = HdBench({{"device", std::string("Left Hand")}}).refusal();
  CHECK(contains(other, "'Left Hand'"));
  CHECK(contains(other, "config/Left Hand.config"));
  CHECK(HdBench({{"device", std::string("Right Hand")}}).refusal().empty());
  hal::DriverOptions options;
  options.values = {{"device", std::string("../passwd")}};
  hal::DriverDefect defect;
  CHECK(make_openhaptics(options, defect) == nullptr);
  CHECK(defect.key == "device");
}

TEST_CASE("what the library refuses or states is said") {
  CHECK(contains(hd_refusal("rate"), "key rate"));
  CHECK(contains(hd_refusal("no_clamping"), "clamping"));
  CHECK(contains(hd_refusal("no_limits"), "no haptic device"));
  CHECK_FALSE(hd_refusal("endless_errors").empty());
}

TEST_CASE("limits of the device become those of the session") {
  HdBench b({{"rate", 500.0}});
  REQUIRE(b.open());
  const hal::DeviceCapabilities& c = b.device->facts().capabilities;
  CHECK(c.sensed_dof == hal::kDofAll);
  CHECK(c.driven_dof == hal::kDofTranslation);
  CHECK(c.max_force_n == doctest::Approx(3.3));
  CHECK(c.max_torque_nm == 0);
  CHECK(c.max_stiffness_n_per_m == doctest::Approx(1020));
  CHECK(c.max_damping_ns_per_m == doctest::Approx(3));
  CHECK(c.workspace_radius_m == doctest::Approx(0.07));
  CHECK(c.report_period_ns == 2'000'000);
  CHECK(hal::check_capabilities(c) == hal::HalStatus::kOk);
  CHECK(b.trace->rate_hz.load() == 500);
  CHECK(contains(b.device->facts().name, "stand-in, serial 4711, HDAPI 3.4.0"));
  CHECK(contains(b.device->facts().words, "0.88 N"));
  CHECK_FALSE(b.device->can_be_confined());
}

TEST_CASE("poses, twists, buttons and forces in the axes of D, by columns and in metres") {
  setenv("HAPTIC_FAKE_SIX", "1", 1);
  HdBench b({{"device_velocity", true}});
  REQUIRE(b.open());
  unsetenv("HAPTIC_FAKE_SIX");
  CHECK(b.device->facts().capabilities.driven_dof == hal::kDofAll);
  CHECK(b.device->facts().capabilities.max_torque_nm == doctest::Approx(0.188));
  fake::Trace& t = *b.trace;
  t.is_fixed.store(1);
  const double p[3] = {0.01, 0.02, 0.03}, v[3] = {0.1, 0.2, 0.3}, w[3] = {1, 2, 3};
  // A quarter turn about the axis that points up, which is y here; as rows.
  const double r[9] = {0, 0, 1, 0, 1, 0, -1, 0, 0};
  for (int k = 0; k < 3; ++k) {
    t.position_m[k].store(p[k]);
    t.velocity[k].store(v[k]);
    t.angular_velocity[k].store(w[k]);
  }
  for (int k = 0; k < 9; ++k) t.rotation[k].store(r[k]);
  t.buttons.store(2);
  REQUIRE(b.run_until([&] { return std::abs(b.sample.pose_dh.p_m[2] - 0.02_r) < 1.0e-7_r; }));
  b.run(5);
  const Pose pose = pose_of(b.sample.pose_dh);
  CHECK((pose.p_wa - Vec3(0.01_r, -0.03_r, 0.02_r)).norm() < 1.0e-7_r);
  CHECK(pose.q_wa.z() * pose.q_wa.w() == doctest::Approx(0.5));
  CHECK(b.sample.twist_valid);
  const Twist twist = twist_of(b.sample.twist_d);
  CHECK((twist.linear_w - Vec3(0.1_r, -0.3_r, 0.2_r)).norm() < 1.0e-6_r);
  CHECK((twist.angular_w - Vec3(1, -3, 2)).norm() < 1.0e-6_r);
  CHECK(b.sample.switches == 2);
  CHECK(b.sample.calibrated);
  REQUIRE(b.reach({Vec3(1, 2, 0.5_r), Vec3(0.01_r, 0.02_r, 0.03_r)}));
  CHECK((b.force() - Vec3(1, 0.5_r, -2)).norm() < 1.0e-6_r);
  CHECK((b.torque() - Vec3(0.01_r, 0.03_r, -0.02_r)).norm() < 1.0e-6_r);
}

TEST_CASE("the force follows a ramp step by step, and is zero at the end") {
  HdBench b;
  REQUIRE(b.open());
  CHECK(b.trace->force_on.load() == 1);
  CHECK(b.force().norm() == 0);
  const std::uint64_t from = b.trace->wrenches.load(), closed = b.trace->closed.load();
  REQUIRE(b.reach(3));
  CHECK(b.torque().norm() == 0);
  CHECK(b.release());
  CHECK(b.force().norm() == 0);
  // 0.05 N a millisecond was asked for, and a turn that comes after more than 20 ms gives nothing.
  CHECK(b.largest_rise_n(from) <= 1.2f);
  CHECK(b.reach(2));
  b.device->close();
  CHECK(b.force().norm() == 0);
  CHECK(b.trace->force_on.load() == 0);
  CHECK(b.trace->closed.load() == closed + 1);
}

TEST_CASE("a bridge that stalls with force on, on the SDK's thread") {
  HdBench b;
  REQUIRE(b.open());
  REQUIRE(b.reach(3));
  REQUIRE(b.run_until([&] { return b.force().norm() == 0; }));
  b.run(30, [](int) { return ramp(60, 3); });
  CHECK(b.force().norm() == 0);
  CHECK(b.writes_refused == 30);
  CHECK(b.release());
  CHECK(b.reach(3));
}

TEST_CASE("a frame that blocks for a second is silence, and no force afterwards") {
  const FakeEnvironment environment("blocks@600");
  HdBench b;
  REQUIRE(b.open());
  REQUIRE(b.reach(3));
  REQUIRE(b.run_until([&] {
    b.run(1, [](int) { return ramp(60, 3); });
    return b.trace->frames.load() >= 600;
  }));
  int silent = 0, looks = 0;
  while (b.look() != BridgeRead::kNew || looks < 20) {
    silent += b.device->read(hal::monotonic_ns(), b.sample) == BridgeRead::kSilent ? 1 : 0;
    ++looks;
    b.run(1);
    REQUIRE(looks < 60'000);
  }
  CHECK(silent > 100);
  CHECK(b.release());
  CHECK(b.force().norm() == 0);
}

TEST_CASE("a scheduler that stalls is lost after 100 ms, and its force goes off before its end") {
  const FakeEnvironment environment("blocks@600", "", 4000);
  HdBench b;
  REQUIRE(b.open());
  REQUIRE(b.reach(3));
  REQUIRE(b.run_until([&] {
    b.run(1, [](int) { return ramp(60, 3); });
    return b.trace->frames.load() >= 600;
  }));
  const std::int64_t asked_ns = hal::monotonic_ns();
  CHECK_FALSE(b.device->release(asked_ns));
  REQUIRE(b.run_until([&] { return b.look() == BridgeRead::kLost; }));
  const std::int64_t lost_ns = hal::monotonic_ns();
  CHECK(lost_ns - asked_ns >= 100'000'000);
  CHECK(lost_ns - asked_ns < 1'500'000'000);
  CHECK(b.trace->force_on.load() == 1);
  b.device->close();
  const std::uint64_t last = b.trace->wrenches.load() - 1;
  CHECK(b.force().norm() == 0);
  CHECK(b.trace->history_us[last % fake::kHistory].load() * 1000 - lost_ns < 1'500'000'000);
  // The call is still held up: nobody else may open the device meanwhile.
  REQUIRE(b.run_until([&] { return b.trace->force_on.load() == 0; }));
  REQUIRE(b.run_until([&] { return b.open() || !contains(b.why, "has not returned"); }));
}

TEST_CASE(
    "errors of a frame: a hiccup, warm motors, a force that the SDK has taken away, unplugged") {
  {
    const FakeEnvironment environment("hiccup@60");
    HdBench b;
    REQUIRE(b.open());
    CHECK(b.run(120) != BridgeRead::kLost);
    CHECK(b.sample.faults == 0);
  }
  {
    const FakeEnvironment environment("warm@60");
    HdBench b;
    REQUIRE(b.open());
    CHECK(b.run_until([&] { return (b.sample.faults & kDeviceOverheated) != 0; }));
    CHECK(b.reach(2));  // the host decides
  }
  {
    const FakeEnvironment environment("velocity@800");
    HdBench b;
    REQUIRE(b.open());
    const auto push = [](int) { return ramp(60, 2); };
    REQUIRE(b.reach(2));
    REQUIRE(b.run_until([&] {
      b.run(1, push);
      return (b.sample.faults & kDeviceDriveFault) != 0;
    }));
    b.run(20, push);
    CHECK(b.writes_refused == 20);
    CHECK(b.force().norm() == 0);
    CHECK(b.release());
    b.run(5);
    CHECK(b.sample.faults == 0);
  }
  const FakeEnvironment environment("unplugged@80");
  HdBench b;
  REQUIRE(b.open());
  CHECK(b.run_until([&] { return b.look() == BridgeRead::kLost; }));
}

TEST_CASE("calibration: by hand it is told, by an update it waits for a frame without force") {
  {
    const FakeEnvironment environment("needs_input");
    HdBench b;
    REQUIRE(b.open());
    CHECK(contains(b.device->facts().words, "inkwell"));
    CHECK_FALSE(b.sample.calibrated);
    CHECK(b.trace->updates.load() == 0);
  }
  HdBench b;
  REQUIRE(b.open());
  REQUIRE(b.reach(2));
  b.trace->needs_update.store(1);
  // The pose counts as not calibrated at once, so that the host lets go.
  bool was_said = false;
  b.run(20, [&](int) {
    was_said = was_said || !b.sample.calibrated;
    return ramp(60, 2);
  });
  CHECK(was_said);
  CHECK(b.release());
  REQUIRE(b.run_until([&] { return b.sample.calibrated; }));
  CHECK(b.trace->updates.load() == 1);
  CHECK(b.trace->updated_n.load() == 0);
}

TEST_CASE(
    "calibration: with the drives on and no force in them it waits, and is told for 50 frames") {
  HdBench b;
  REQUIRE(b.open());
  REQUIRE(b.reach(2));
  const std::uint64_t from = b.trace->frames.load();
  // Through zero, as a force that changes its sign.
  REQUIRE(b.run_until([&] {
    b.run(1, [](int) { return Wrench{}; });
    return b.force().norm() == 0;
  }));
  b.trace->needs_update.store(1);
  REQUIRE(b.run_until([&] {
    b.run(1, [](int) { return Wrench{}; });
    return b.trace->frames.load() > from + 100;
  }));
  CHECK(b.trace->updates.load() == 0);
  CHECK_FALSE(b.sample.calibrated);
  CHECK(b.release());
  REQUIRE(b.run_until([&] { return b.trace->updates.load() == 1; }));
  const std::uint64_t updated = b.trace->frames.load();
  REQUIRE(b.run_until([&] { return b.sample.calibrated; }));
  CHECK(b.trace->frames.load() - updated >= 40);
}

TEST_CASE("poses that are none are never passed on") {
  CHECK(contains(hd_refusal("nan"), "says no pose"));
  const FakeEnvironment environment("nan@80");
  HdBench b;
  REQUIRE(b.open());
  REQUIRE(b.run_until([&] {
    const BridgeRead read = b.look();
    REQUIRE(is_finite(pose_of(b.sample.pose_dh).p_wa));
    return read == BridgeRead::kLost;
  }));
}

TEST_CASE("a library that crashes on its own thread takes the bridge's process with it") {
  const pid_t child = fork();
  if (child == 0) crash_in_hd_child();
  REQUIRE(child > 0);
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WIFSIGNALED(status));
  CHECK(WTERMSIG(status) == SIGSEGV);
}

TEST_SUITE_END();
