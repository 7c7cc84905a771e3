// SPDX-License-Identifier: Apache-2.0
// The bridge to Force Dimension's devices on a stand-in of libdhd.
#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <string>

#include "hal/device.hpp"
#include "tests/bridges/vendor/vendor_bench.hpp"
#include "tools/bridges/forcedimension/dhd_handle.hpp"
#include "tools/bridges/forcedimension/forcedimension_device.hpp"

using namespace haptic;
using namespace haptic::test;
using hal::BridgeRead;
using tools::kGripperSwitch;
using tools::make_forcedimension;

namespace {

struct DhdBench : VendorBench {
  explicit DhdBench(std::vector<std::pair<std::string_view, Value>> keys = {},
                    const std::string& library = HAPTIC_DHD_FAKE)
      : VendorBench(make_forcedimension, library, std::move(keys)) {}
};

std::string dhd_refusal(const char* fault) {
  const FakeEnvironment environment(fault);
  DhdBench b;
  const std::uint64_t closed = b.trace->closed.load(), opened = b.trace->opened.load();
  const std::string why = b.refusal();
  b.device->close();
  // What was opened on the way was closed again.
  CHECK(b.trace->closed.load() - closed == b.trace->opened.load() - opened);
  return why;
}

/// The child of a fork: what the stand-in does to it must not reach doctest's handlers.
[[noreturn]] void crash_in_child() {
  (void)signal(SIGSEGV, SIG_DFL);
  const FakeEnvironment environment("crashes@20");
  DhdBench b;
  if (b.open()) b.run(10'000, [](int ms) { return ramp(ms, 5); });
  _exit(0);
}

}  // namespace

TEST_SUITE_BEGIN("bridges.forcedimension");

TEST_CASE("a library that is not there, is none, lacks a function or is of another version") {
  CHECK(contains(DhdBench({}, "/nowhere/libdhd.so").refusal(), "key library"));
  const std::string text_file = HAPTIC_DHD_FAKE ".txt";
  std::ofstream(text_file) << "no library\n";
  CHECK(contains(DhdBench({}, text_file).refusal(), "cannot be loaded"));
  const std::string lacks = DhdBench({}, HAPTIC_DHD_OLD_FAKE).refusal();
  CHECK(contains(lacks, "has no dhdGetWatchdog:"));
  CHECK(contains(dhd_refusal("version"), "version 4.17.6"));
  CHECK(contains(dhd_refusal("silent_version"), "version -1"));
  // A library of another vendor lacks them all.
  CHECK(contains(DhdBench({}, HAPTIC_HD_FAKE).refusal(), "dhdOpenSerial"));
}

TEST_CASE("the usual names are tried, and told, where the key library is absent") {
  hal::DriverDefect defect;
  const auto device = make_forcedimension({}, defect);
  REQUIRE(device != nullptr);
  std::string why;
  if (device->open(why)) return;  // someone has the SDK installed
  CHECK(contains(why, "libdhd.so"));
}

TEST_CASE("a device that is not there, and keys that name none") {
  const std::string absent = dhd_refusal("no_device");
  CHECK(contains(absent, "no Force Dimension device (no device found; "));
  CHECK(contains(absent, ", sees 0)"));
  CHECK(contains(DhdBench({{"serial", 12.0}}).refusal(), "serial number 12"));
  CHECK(contains(DhdBench({{"index", 3.0}}).refusal(), "index 3"));
  CHECK(DhdBench({{"serial", 4711.0}}).refusal().empty());
  CHECK(DhdBench({{"index", 0.0}}).refusal().empty());
  hal::DriverOptions options;
  options.values = {{"serial", 4711.0}, {"index", 0.0}};
  // At the configuration, before a bridge is started.
  hal::DriverDefect defect;
  const hal::DriverRow& row = *hal::find_driver("forcedimension");
  CHECK(row.make(options, defect) == nullptr);
  CHECK(defect.key == "index");
  options.values = {{"serial", 4711.5}};
  CHECK(row.make(options, defect) == nullptr);
  CHECK(defect.key == "serial");
  const FakeEnvironment controller("", "81");
  CHECK(contains(DhdBench().refusal(), "no base that moves"));
}

TEST_CASE(
    "the watchdog of the device is set to 20 ms and read back; one that is not kept is refused") {
  DhdBench b;
  REQUIRE(b.open());
  CHECK(b.trace->watchdog_units.load() == 160);
  CHECK_FALSE(b.device->can_be_confined());
  b.device->close();
  CHECK(contains(dhd_refusal("watchdog_not_kept"), "0 are read back"));
  CHECK(contains(dhd_refusal("watchdog_refused"), "the call fails"));
}

TEST_CASE("what each type senses and drives") {
  struct Row {
    const char* type;
    std::uint32_t sensed, driven;
    Real force_n, torque_nm, stiffness;
  };
  using namespace hal;
  const Row rows[] = {{"33", kDofTranslation, kDofTranslation, 12, 0, 5000},
                      {"34", kDofAll, kDofTranslation, 12, 0, 5000},
                      {"60", kDofTranslation, kDofTranslation, 8, 0, 3000},
                      {"63", kDofTranslation, kDofTranslation, 20, 0, 5000},
                      {"104", kDofAll, kDofAll, 12, 0.2_r, 4000},
                      {"109", kDofAll, kDofAll, 12, 0.2_r, 8000},
                      {"203", kDofAll, kDofAll, 8, 0.1_r, 0}};
  for (const Row& row : rows) {
    CAPTURE(row.type);
    const FakeEnvironment environment("", row.type);
    DhdBench b;
    REQUIRE(b.open());
    const DeviceCapabilities& c = b.device->facts().capabilities;
    CHECK(c.sensed_dof == row.sensed);
    CHECK(c.driven_dof == row.driven);
    CHECK(c.max_force_n == row.force_n);
    CHECK(c.max_torque_nm == row.torque_nm);
    CHECK(c.max_stiffness_n_per_m == row.stiffness);
    CHECK(c.report_period_ns == 1'000'000);
    CHECK(check_capabilities(c) == HalStatus::kOk);
    CHECK(contains(b.device->facts().name, "serial 4711, SDK 3.17.6"));
    CHECK(contains(b.device->facts().words, "no source") == (row.stiffness == 0));
  }
  const FakeEnvironment limited("max_force");
  DhdBench b({{"rate", 2000.0}});
  REQUIRE(b.open());
  CHECK(b.device->facts().capabilities.max_force_n == 5);
  CHECK(b.device->facts().capabilities.report_period_ns == 500'000);
}

TEST_CASE("poses, twists, buttons and forces in the axes of D") {
  DhdBench b({{"device_velocity", true}});
  REQUIRE(b.open());
  fake::Trace& t = *b.trace;
  t.is_fixed.store(1);
  const double p[3] = {0.01, 0.02, 0.03}, v[3] = {0.1, 0.2, 0.3}, w[3] = {1, 2, 3};
  // A quarter turn about the axis that points up, as rows.
  const double r[9] = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  for (int k = 0; k < 3; ++k) {
    t.position_m[k].store(p[k]);
    t.velocity[k].store(v[k]);
    t.angular_velocity[k].store(w[k]);
  }
  for (int k = 0; k < 9; ++k) t.rotation[k].store(r[k]);
  t.buttons.store(0b101);
  REQUIRE(b.run_until([&] { return b.sample.pose_dh.p_m[2] == 0.03_r && b.sample.switches == 5; }));
  b.run(5);
  const Pose pose = pose_of(b.sample.pose_dh);
  CHECK((pose.p_wa - Vec3(0.02_r, -0.01_r, 0.03_r)).norm() < 1.0e-7_r);
  CHECK(std::abs(pose.q_wa.z()) == doctest::Approx(std::sqrt(0.5)));
  CHECK(pose.q_wa.z() * pose.q_wa.w() > 0);
  CHECK(b.sample.twist_valid);
  const Twist twist = twist_of(b.sample.twist_d);
  CHECK((twist.linear_w - Vec3(0.2_r, -0.1_r, 0.3_r)).norm() < 1.0e-6_r);
  CHECK((twist.angular_w - Vec3(2, -1, 3)).norm() < 1.0e-6_r);
  CHECK(b.sample.calibrated);
  CHECK(b.sample.faults == 0);
  // From small to this: force to the right, away and up; torque alike.
  Wrench full;
  full.force_w = Vec3(1, 2, 3);
  full.torque_w = Vec3(0.01_r, 0.02_r, 0.03_r);
  REQUIRE(b.reach(full));
  CHECK((b.force() - Vec3(-2, 1, 3)).norm() < 1.0e-6_r);
  CHECK((b.torque() - Vec3(-0.02_r, 0.01_r, 0.03_r)).norm() < 1.0e-6_r);
  CHECK(b.release());
  CHECK(b.force().norm() == 0);
}

TEST_CASE("a wrist without motors gets no torque, and a device without one no orientation") {
  {
    const FakeEnvironment omega6("", "34");
    DhdBench b;
    REQUIRE(b.open());
    CHECK_FALSE(b.sample.twist_valid);
    REQUIRE(b.reach(0.3_r));
    const Wrench twisted = {Vec3(0.3_r, 0, 0), Vec3(0.1_r, 0, 0)};
    b.run(10, [&](int) { return twisted; });
    CHECK(b.torque().norm() == 0);
  }
  const FakeEnvironment omega3("", "33");
  DhdBench b;
  REQUIRE(b.open());
  for (int k = 0; k < 9; ++k) b.trace->rotation[k].store(0.5);  // never looked at
  REQUIRE(b.run(10) != BridgeRead::kLost);
  CHECK(b.news > 0);
  CHECK(b.sample.pose_dh.q_xyzw[3] == 1);
}

TEST_CASE("the force follows a ramp step by step, and is zero at the end") {
  DhdBench b;
  REQUIRE(b.open());
  CHECK(b.trace->force_on.load() == 0);
  const std::uint64_t from = b.trace->wrenches.load(), closed = b.trace->closed.load(),
                      stopped = b.trace->stopped.load();
  REQUIRE(b.reach(6));
  CHECK(b.trace->force_on.load() == 1);
  CHECK(b.release());
  CHECK(b.force().norm() == 0);
  CHECK(b.trace->force_on.load() == 0);
  // 0.1 N a millisecond was asked for, and a turn that comes after more than 20 ms gives nothing.
  CHECK(b.largest_rise_n(from) <= 2.3f);
  CHECK(b.reach(3));
  b.device->close();  // with force on
  CHECK(b.force().norm() == 0);
  CHECK(b.trace->stopped.load() == stopped + 1);
  CHECK(b.trace->closed.load() == closed + 1);
  CHECK(b.device->read(hal::monotonic_ns(), b.sample) == BridgeRead::kLost);
}

TEST_CASE("a bridge that stalls with force on") {
  DhdBench b;
  REQUIRE(b.open());
  REQUIRE(b.reach(5));
  REQUIRE(b.run_until([&] { return b.force().norm() == 0; }));
  CHECK(b.trace->force_on.load() == 0);
  b.run(30, [](int) { return ramp(60, 5); });
  CHECK(b.writes_refused == 30);
  CHECK(b.force().norm() == 0);
  CHECK(b.release());
  CHECK(b.reach(5));
}

TEST_CASE("a call that blocks for a second: silence, no force, and no jump when it comes back") {
  const FakeEnvironment environment("blocks@600");
  DhdBench b;
  const int cuts = b.trace->watchdog_cuts.load();
  REQUIRE(b.open());
  REQUIRE(b.reach(5));
  const auto push = [](int) { return ramp(60, 5); };
  REQUIRE(b.run_until([&] {
    b.run(1, push);
    return b.trace->frames.load() >= 600;
  }));
  const bool had_force = b.trace->force_on.load() != 0;
  // None of the bridge's own calls waits: hundreds pass while the library's does not return.
  int looks = 0;
  while (b.look() != BridgeRead::kNew || looks < 20) {
    (void)b.device->write(hal::monotonic_ns(), push(0));
    ++looks;
    b.run(1);
    REQUIRE(looks < 60'000);
  }
  CHECK(looks > 200);
  if (had_force) CHECK(b.trace->watchdog_cuts.load() > cuts);  // the device's own
  CHECK((b.sample.faults & kDeviceDriveFault) != 0);
  b.run(30, push);
  CHECK(b.force().norm() == 0);
  CHECK(b.writes_refused == 30);
  CHECK(b.release());
  CHECK(b.reach(5));
}

TEST_CASE("the device drops its force by itself") {
  const FakeEnvironment environment("velocity@801");  // a turn that asks for the status
  DhdBench b;
  REQUIRE(b.open());
  REQUIRE(b.reach(4));
  REQUIRE(b.run_until([&] {
    b.run(1, [](int) { return ramp(60, 4); });
    return b.trace->force_on.load() == 0;
  }));
  b.run(40, [](int) { return ramp(60, 4); });
  CHECK(b.writes_refused > 5);
  CHECK((b.sample.faults & kDeviceDriveFault) != 0);
  CHECK(b.trace->force_on.load() == 0);
  CHECK(b.release());
  b.run(5);
  CHECK(b.sample.faults == 0);
}

TEST_CASE("calls that fail: once, for ever, for the force alone") {
  {
    const FakeEnvironment environment("fails_once@40");
    DhdBench b;
    REQUIRE(b.open());
    CHECK(b.run(80) != BridgeRead::kLost);
  }
  {
    const FakeEnvironment environment("fails@40");
    DhdBench b;
    REQUIRE(b.open());
    CHECK(b.run_until([&] { return b.look() == BridgeRead::kLost; }));
  }
  const FakeEnvironment environment("force_fails@60");
  DhdBench b;
  REQUIRE(b.open());
  CHECK(b.run_until([&] {
    b.run(1, [](int) { return Wrench{}; });
    // A machine that was busy has cut the force off before it could fail: from the start, then.
    if (b.writes_refused > 0) {
      (void)b.device->release(hal::monotonic_ns());
      b.run(2);
    }
    return b.look() == BridgeRead::kLost;
  }));
  CHECK_FALSE(b.device->write(hal::monotonic_ns(), Wrench{}));
}

TEST_CASE("unplugged in the middle, then there again") {
  DhdBench b;
  {
    const FakeEnvironment environment("unplugged@100");
    REQUIRE(b.open());
    b.run(60, [](int ms) { return ramp(ms, 5); });
    REQUIRE(b.run_until([&] { return b.look() == BridgeRead::kLost; }));
    CHECK_FALSE(b.device->write(hal::monotonic_ns(), ramp(60, 5)));
    b.device->close();
  }
  REQUIRE(b.open());
  CHECK(b.run_until([&] { return b.look() == BridgeRead::kNew; }));
}

TEST_CASE("poses that are none are never passed on") {
  CHECK(contains(dhd_refusal("nan"), "says no pose"));
  CHECK(contains(dhd_refusal("no_rotation"), "says no pose"));
  for (const char* fault : {"nan@60", "far@60", "no_rotation@60"}) {
    CAPTURE(fault);
    const FakeEnvironment environment(fault);
    DhdBench b;
    REQUIRE(b.open());
    BridgeRead read = BridgeRead::kSame;
    REQUIRE(b.run_until([&] {
      read = b.look();
      const Pose pose = pose_of(b.sample.pose_dh);
      REQUIRE(is_finite(pose.p_wa));
      REQUIRE(pose.p_wa.norm() < 1);
      return read == BridgeRead::kLost;
    }));
  }
}

TEST_CASE("a device that is not calibrated or has no power says so") {
  {
    const FakeEnvironment environment("not_calibrated");
    DhdBench b;
    REQUIRE(b.open());
    CHECK(contains(b.device->facts().words, "calibration pit"));
    b.run(5);
    CHECK_FALSE(b.sample.calibrated);
  }
  const FakeEnvironment environment("no_power");
  DhdBench b;
  REQUIRE(b.open());
  b.run(5);
  CHECK((b.sample.faults & kDeviceDriveFault) != 0);
}

TEST_CASE("the gripper as a switch, with play; gravity compensation") {
  const double closed = 0.1;
  DhdBench b({{"gripper_closed", closed}, {"no_gravity_compensation", true}});
  REQUIRE(b.open());
  CHECK(b.trace->gravity.load() == 0);
  const auto is_closed = [&](double angle) {
    b.trace->gripper_rad.store(angle);
    int seen = 0;
    REQUIRE(b.run_until([&] {
      seen += b.look() == BridgeRead::kNew ? 1 : 0;
      return seen >= 3;
    }));
    return ((b.sample.switches >> kGripperSwitch) & 1u) != 0;
  };
  CHECK_FALSE(is_closed(0.3));
  CHECK_FALSE(is_closed(closed + 0.02));
  CHECK(is_closed(closed - 0.01));
  CHECK(is_closed(closed + 0.02));
  CHECK_FALSE(is_closed(closed + 0.04));
  CHECK_FALSE(is_closed(-1.0));
  CHECK_FALSE(is_closed(std::nan("")));
  b.device->close();
  const FakeEnvironment omega3("", "33");
  CHECK(contains(DhdBench({{"gripper_closed", closed}}).refusal(), "no gripper"));
}

TEST_CASE("a library that crashes takes the bridge's process with it") {
  const pid_t child = fork();
  if (child == 0) crash_in_child();
  REQUIRE(child > 0);
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WIFSIGNALED(status));
  CHECK(WTERMSIG(status) == SIGSEGV);
}

TEST_CASE(
    "a call that does not return: closed all the same, and opened again only afterwards [long]") {
  const FakeEnvironment environment("blocks@50", "", 4000);
  DhdBench b;
  REQUIRE(b.open());
  REQUIRE(b.run_until([&] { return b.trace->frames.load() >= 50; }));
  b.device->close();
  CHECK(contains(b.refusal(), "has not returned"));
  CHECK(b.run_until([&] { return b.trace->force_on.load() == 0 && b.open(); }));
}

TEST_SUITE_END();
