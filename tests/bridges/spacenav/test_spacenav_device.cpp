// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <string>
#include <variant>

#include "hal/drivers/spacemouse_driver.hpp"
#include "tests/bridges/spacenav/spacenav_bench.hpp"
#include "tests/support/random.hpp"
#include "tests/support/spacemouse_counterpart.hpp"
#include "tests/support/text_search.hpp"
#include "tools/bridges/spacenav/spacenav_scale.hpp"

using namespace haptic;
using namespace haptic::test;
using hal::BridgeRead;
using tools::SpacenavDevice;

namespace {

constexpr std::int64_t kEventMs_ns = 1'000'000;
constexpr std::uint64_t kHandSeed = 4711;

/// The largest difference of two poses: metres, or halves of a turn's sine.
double poses_apart(const PoseRecord& a, const PoseRecord& b) {
  double largest = 0;
  for (int k = 0; k < 3; ++k) largest = std::max(largest, std::abs(double{a.p_m[k] - b.p_m[k]}));
  for (int k = 0; k < 4; ++k)
    largest = std::max(largest, std::abs(double{a.q_xyzw[k] - b.q_xyzw[k]}));
  return largest;
}

struct SpacenavModel {
  std::uint16_t vendor_id, product_id;
  bool absolute;
  std::int16_t range;
  bool swap_yz, invert_yz;  ///< the daemon's flags of it
};

/// The largest difference of pose and of velocity between driver `spacemouse` and the bridge, for
/// one hand; `every_ms`: a report so often.
double farthest_apart(const SpacenavModel& model, int every_ms, int reports) {
  EmulatedDevice device;
  device.vendor_id = model.vendor_id;
  device.product_id = model.product_id;
  device.absolute = model.absolute;
  device.minimum = -model.range;
  device.maximum = model.range;
  device.swap_yz = model.swap_yz;
  device.invert_yz = model.invert_yz;
  SpacenavBench bench(1, device);
  REQUIRE(bench.open() == "");
  hal::SpaceMouseSettings settings;
  settings.vendor_id = model.vendor_id;
  settings.product_id = model.product_id;
  SpaceMouseCounterpart counterpart(true, model.range);
  hal::SpaceMouseDriver driver(settings);
  REQUIRE(driver.start(counterpart) == hal::HalStatus::kOk);

  Random random(kHandSeed);
  double farthest = 0;
  std::int64_t now_ns = 1'000 * kEventMs_ns;
  DeviceState state;
  std::array<std::int16_t, 6> raw{};
  for (int k = 0; k < reports; ++k) {
    for (std::int16_t& axis : raw) {
      const auto before = axis;
      while (axis == before || axis == 0)
        axis = static_cast<std::int16_t>(random.uniform(-model.range - 0.9, model.range + 0.9));
    }
    const auto report = hal::encode_long(raw);
    REQUIRE(driver.read(report, now_ns, state) == hal::ReportVerdict::kState);
    bench.daemon.report(raw);
    for (int ms = 0; ms < every_ms; ++ms, now_ns += kEventMs_ns) {
      REQUIRE(driver.rest(now_ns, state));
      REQUIRE(bench.read(now_ns) != BridgeRead::kLost);
      farthest = std::max(farthest, poses_apart(bench.sample.pose_dh, state.pose_dh));
      for (int axis = 0; axis < 3; ++axis) {
        farthest = std::max(farthest, std::abs(double{bench.sample.twist_d.linear_m_per_s[axis] -
                                                      state.twist_d.linear_m_per_s[axis]}));
        farthest = std::max(farthest, std::abs(double{bench.sample.twist_d.angular_rad_per_s[axis] -
                                                      state.twist_d.angular_rad_per_s[axis]}));
      }
    }
  }
  CHECK(bench.bridge.counts().events == static_cast<std::uint64_t>(reports));
  CHECK(vec3_of(state.pose_dh.p_m).norm() > 1e-4_r);  // it has moved
  return farthest;
}

}  // namespace

TEST_SUITE("bridges.spacenav") {
  TEST_CASE("open: nobody listens, no device, a path too long: each says what helps") {
    const SocketFolder folder;
    std::string why;
    SpacenavDevice absent({folder.path(), 0, {}});
    CHECK_FALSE(absent.open(why));
    CHECK(has(why, "no spacenavd listens at " + folder.path() + " (No such file or directory)"));
    CHECK(has(why, "sudo systemctl start spacenavd"));
    hal::BridgeSample sample;
    CHECK(absent.read(kEventMs_ns, sample) == BridgeRead::kLost);
    CHECK(absent.watched().fd < 0);

    SpacenavEmulator daemon(folder.path());
    REQUIRE(daemon.start());
    SpacenavDevice empty({folder.path(), 0, {}});
    CHECK_FALSE(empty.open(why));
    CHECK(has(why, "spacenavd at " + folder.path() + " has no device; plug one in"));
    daemon.plug({});
    CHECK(empty.open(why));
    CHECK(empty.watched().fd >= 0);
    daemon.kill();
    CHECK_FALSE(empty.open(why));
    CHECK(has(why, "(Connection refused)"));  // the file of a killed daemon's socket is there still

    hal::DriverOptions options;
    hal::DriverDefect defect;
    CHECK(tools::make_spacenav(options, defect) != nullptr);
    options.values = {{"socket", std::string(108, 'x')}};
    CHECK(tools::make_spacenav(options, defect) == nullptr);
    CHECK(defect.key == "socket");
    CHECK(has(defect.text, "longer than the 107 bytes"));
    options.values = {{"socket", std::string(107, 'x')}, {"full_scale", 350.0}};
    CHECK(tools::make_spacenav(options, defect) != nullptr);
  }

  TEST_CASE("open: version 1 says who we are, and who the device is") {
    EmulatedDevice device;
    device.name = "A device of a name that needs more than two pieces of text \x01";
    SpacenavBench bench(1, device);
    REQUIRE(bench.started);
    REQUIRE(bench.open() == "");
    CHECK(bench.bridge.version() == 1);
    CHECK(bench.daemon.client_version() == 1);
    CHECK(bench.daemon.client_name() == "haptic device_bridge");
    CHECK(bench.daemon.mask() == 7);
    CHECK(bench.daemon.sensitivity() == 1.0F);
    const hal::BridgeFacts& facts = bench.bridge.facts();
    CHECK(facts.name ==
          "A device of a name that needs more than two pieces of text ? (256f:c62e), "
          "spacenavd at " +
              bench.folder.path() + ", protocol 1");
    CHECK(facts.words.empty());
    CHECK(facts.capabilities.sensed_dof == hal::kDofAll);
    CHECK(facts.capabilities.driven_dof == 0u);
    CHECK(hal::check_capabilities(facts.capabilities) == hal::HalStatus::kOk);
    CHECK(bench.bridge.can_be_confined());
    CHECK(bench.bridge.write(kEventMs_ns, Wrench{}));
    CHECK(bench.bridge.release(kEventMs_ns));

    device.vendor_id = device.product_id = 0;  // on a serial line
    bench.daemon.plug(device);
    REQUIRE(bench.open() == "");
    CHECK_FALSE(has(bench.bridge.facts().name, "0000"));
    bench.bridge.close();
  }

  TEST_CASE("open: a motion that came behind the last answer is over; a button stays pressed") {
    SpacenavBench bench;
    REQUIRE(bench.started);
    bench.daemon.say_behind_answers({0, 500, 500, 500, 0, 0, 0, 8, 1, 3, 1, 0, 0, 0, 0, 0});
    REQUIRE(bench.open() == "");
    for (int ms = 0; ms < 20; ++ms) {
      REQUIRE(bench.read((1'000 + ms) * kEventMs_ns) != BridgeRead::kLost);
      CHECK(vec3_of(bench.sample.pose_dh.p_m).norm() == 0);
    }
    CHECK(bench.sample.switches == 8);
    CHECK(bench.bridge.counts().unknown == 0);
  }

  TEST_CASE("open: version 0 after 0.3 s, with a sensitivity that is a number again") {
    SpacenavBench bench(0);
    REQUIRE(bench.open() == "");
    CHECK(bench.bridge.version() == 0);
    CHECK(has(bench.bridge.facts().words, "does not say when the device is unplugged"));
    for (int k = 0; k < 100 && bench.daemon.sensitivity() != 1.0F; ++k) usleep(1000);
    CHECK(bench.daemon.sensitivity() == 1.0F);
    bench.daemon.report({500, 0, 0, 0, 0, 0});
    bench.daemon.press(1, true);
    CHECK(bench.read(kEventMs_ns) == BridgeRead::kNew);
    CHECK(bench.sample.twist_d.linear_m_per_s[0] == doctest::Approx(0.1));
    CHECK(bench.sample.switches == 2u);
    bench.daemon.unplug();  // of which version 0 says nothing
    for (int ms = 2; ms < 100; ++ms) CHECK(bench.read(ms * kEventMs_ns) != BridgeRead::kLost);
    CHECK(bench.read(100 * kEventMs_ns) == BridgeRead::kSame);
  }

  TEST_CASE("read: the pose of driver spacemouse to 1e-9, for current and older models") {
    const SpacenavModel current{0x256f, 0xc62e, true, 500, true, true};
    const SpacenavModel relative{0x256f, 0xc635, false, 350, true, true};
    const SpacenavModel older{0x046d, 0xc606, true, 500, false, false};
    CHECK(farthest_apart(current, 8, 200) < 1e-9);
    CHECK(farthest_apart(relative, 16, 200) < 1e-9);
    CHECK(farthest_apart(older, 8, 200) < 1e-9);
    CHECK(farthest_apart(current, 60, 30) < 1e-9);  // longer than a velocity lasts
    // It can tell: signs of another model, and a range that the daemon rescales.
    CHECK(farthest_apart({0x256f, 0xc62e, true, 500, true, false}, 8, 20) > 1e-3);
    CHECK(farthest_apart({0x256f, 0xc62e, true, 350, true, true}, 8, 20) > 1e-6);
  }

  TEST_CASE("read: right, away and up are x, y and z, and turns about them alike") {
    SpacenavBench bench;
    REQUIRE(bench.open() == "");
    // As a current model reports it: right, towards, down.
    const std::array<std::array<std::int16_t, 6>, 3> raw{
        {{500, 0, 0, 500, 0, 0}, {0, -500, 0, 0, -500, 0}, {0, 0, -500, 0, 0, -500}}};
    std::int64_t now_ns = kEventMs_ns;
    for (std::size_t axis = 0; axis < 3; ++axis, now_ns += kEventMs_ns) {
      bench.daemon.report(raw[axis]);
      REQUIRE(bench.read(now_ns) == BridgeRead::kNew);
      for (std::size_t k = 0; k < 3; ++k) {
        CHECK(bench.sample.twist_d.linear_m_per_s[k] == (k == axis ? 0.1_r : 0.0_r));
        CHECK(bench.sample.twist_d.angular_rad_per_s[k] == (k == axis ? 1.0_r : 0.0_r));
      }
    }
  }

  TEST_CASE("read: at rest the pose stands, and a velocity ends by itself") {
    SpacenavBench bench;
    REQUIRE(bench.open() == "");
    CHECK(bench.read(kEventMs_ns) == BridgeRead::kNew);  // the first one
    CHECK(bench.sample.sampled_ns == kEventMs_ns);
    CHECK(bench.sample.calibrated);
    CHECK(bench.sample.twist_valid);
    CHECK(bench.read(2 * kEventMs_ns) == BridgeRead::kSame);
    bench.daemon.report({500, 0, 0, 0, 0, 0});
    for (int ms = 10; ms <= 60; ++ms) CHECK(bench.read(ms * kEventMs_ns) == BridgeRead::kNew);
    CHECK(bench.sample.pose_dh.p_m[0] == doctest::Approx(0.005));
    CHECK(bench.sample.twist_d.linear_m_per_s[0] == 0.0_r);  // 50 ms without an event
    CHECK(bench.read(61 * kEventMs_ns) == BridgeRead::kSame);
    bench.daemon.report({500, 250, 0, 0, 0, 0});
    CHECK(bench.read(2000 * kEventMs_ns) == BridgeRead::kNew);
    CHECK(bench.sample.pose_dh.p_m[0] == doctest::Approx(0.005));  // nothing of the time between
    bench.daemon.report({0, 0, 0, 0, 0, 0});
    CHECK(bench.read(2010 * kEventMs_ns) == BridgeRead::kNew);
    CHECK(bench.sample.pose_dh.p_m[0] == doctest::Approx(0.006));
    CHECK(bench.read(2011 * kEventMs_ns) == BridgeRead::kSame);
  }

  TEST_CASE("read: buttons are switches, and bring no velocity back") {
    SpacenavBench bench;
    REQUIRE(bench.open() == "");
    bench.daemon.press(0, true);
    bench.daemon.press(30, true);
    bench.daemon.press(31, true);
    CHECK(bench.read(kEventMs_ns) == BridgeRead::kNew);
    CHECK(bench.sample.switches == 0xc0000001u);
    bench.daemon.press(0, false);
    bench.daemon.press(32, true);
    bench.daemon.press(-1, true);
    CHECK(bench.read(2 * kEventMs_ns) == BridgeRead::kNew);
    CHECK(bench.sample.switches == 0xc0000000u);
    CHECK(bench.bridge.counts().impossible == 2u);
    bench.daemon.report({500, 0, 0, 0, 0, 0});
    for (int ms = 10; ms <= 70; ++ms) (void)bench.read(ms * kEventMs_ns);
    bench.daemon.press(1, true);
    CHECK(bench.read(71 * kEventMs_ns) == BridgeRead::kNew);
    CHECK(bench.sample.twist_d.linear_m_per_s[0] == 0.0_r);
    CHECK(bench.sample.pose_dh.p_m[0] == doctest::Approx(0.005));
  }

  TEST_CASE("spacenav_full_scale: 500 where the kernel calls all six axes absolute") {
    const std::string list =
        "I: Bus=0003 Vendor=046d Product=c626 Version=0110\n"
        "N: Name=\"3Dconnexion SpaceNavigator\"\nB: EV=17\nB: KEY=3 0 0 0 0\nB: REL=3f\n\n"
        "I: Bus=0003 Vendor=256f Product=c62e Version=0111\n"
        "N: Name=\"3Dconnexion SpaceMouse Wireless\"\nB: EV=1b\nB: ABS=100 3f\n\n"
        "I: Bus=0003 Vendor=256f Product=c652 Version=0111\nB: ABS=3\n\n"
        "I: Bus=0003 Vendor=256f Product=c652 Version=0111\nB: ABS=3f";
    CHECK(tools::spacenav_full_scale(list, 0x046d, 0xc626) == hal::kDisplacementFullScale);
    CHECK(tools::spacenav_full_scale(list, 0x256f, 0xc62e) == 500);
    CHECK(tools::spacenav_full_scale(list, 0x256f, 0xc652) == 500);
    CHECK(tools::spacenav_full_scale(list, 0x256f, 0xc635) == hal::kDisplacementFullScale);
    for (const char* damaged : {"", "\n\n", "I:", "B: ABS=", "I: Vendor= Product=\nB: ABS=zz",
                                "I: Vendor=256f Product=c62e\nB: ABS= "})
      CHECK(tools::spacenav_full_scale(damaged, 0x256f, 0xc62e) == hal::kDisplacementFullScale);
  }
}
