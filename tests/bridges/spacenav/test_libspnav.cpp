// SPDX-License-Identifier: Apache-2.0
// The emulated spacenavd before libspnav 1.0, the library that clients of the real one use: what it
// sees is what the emulator was told.
#include <doctest/doctest.h>
#include <spnav.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "tests/bridges/spacenav/spacenav_emulator.hpp"

using haptic::test::EmulatedDevice;
using haptic::test::SpacenavEmulator;

namespace {

struct JudgedDaemon {
  explicit JudgedDaemon(int version) : daemon(path, version) {
    started = daemon.start();
    setenv("SPNAV_SOCKET", path.c_str(), 1);
  }
  ~JudgedDaemon() {
    (void)spnav_close();
    unsetenv("SPNAV_SOCKET");
    (void)unlink(path.c_str());
  }
  JudgedDaemon(const JudgedDaemon&) = delete;
  JudgedDaemon& operator=(const JudgedDaemon&) = delete;

  std::string path = "/tmp/libspnav-" + std::to_string(getpid()) + ".sock";
  SpacenavEmulator daemon;
  bool started = false;
};

void check_motion(int x, int y, int z, int rx, int ry, int rz) {
  spnav_event event{};
  REQUIRE(spnav_poll_event(&event) == SPNAV_EVENT_MOTION);
  const int expected[] = {x, y, z, rx, ry, rz};
  for (int k = 0; k < 6; ++k) CHECK(event.motion.data[k] == expected[k]);
  CHECK(event.motion.period == 8u);
}

void check_button(int number, int pressed) {
  spnav_event event{};
  REQUIRE(spnav_poll_event(&event) == SPNAV_EVENT_BUTTON);
  CHECK(event.button.bnum == number);
  CHECK(event.button.press == pressed);
}

void check_device(int op, const EmulatedDevice& device) {
  spnav_event event{};
  REQUIRE(spnav_poll_event(&event) == SPNAV_EVENT_DEV);
  CHECK(event.dev.op == op);
  CHECK(event.dev.id == device.id);
  CHECK(event.dev.devtype == device.type);
  CHECK(event.dev.usbid[0] == device.vendor_id);
  CHECK(event.dev.usbid[1] == device.product_id);
}

}  // namespace

TEST_SUITE("bridges.libspnav") {
  TEST_CASE("version 1: requests, and the same events as were sent") {
    JudgedDaemon judged(1);
    REQUIRE(judged.started);
    EmulatedDevice device;
    device.name = "3Dconnexion SpaceMouse Wireless, a name of several pieces of text";
    REQUIRE(spnav_open() == 0);
    CHECK(spnav_protocol() == 1);
    char name[256] = {};
    CHECK(spnav_dev_name(name, sizeof name) == -1);  // no device yet
    judged.daemon.plug(device);
    check_device(SPNAV_DEV_ADD, device);
    CHECK(spnav_dev_name(name, sizeof name) == static_cast<int>(device.name.size()));
    CHECK(std::string(name) == device.name);
    unsigned vendor = 0, product = 0;
    CHECK(spnav_dev_usbid(&vendor, &product) == 0);
    CHECK(vendor == 0x256fu);
    CHECK(product == 0xc62eu);
    CHECK(spnav_dev_axes() == 6);
    CHECK(spnav_dev_buttons() == 2);
    CHECK(spnav_dev_type() == SPNAV_DEV_SMW);
    CHECK(spnav_client_name("a client") == 0);
    CHECK(spnav_evmask(SPNAV_EVMASK_DEFAULT) == 0);
    CHECK(judged.daemon.client_name() == "a client");
    CHECK(judged.daemon.mask() == SPNAV_EVMASK_DEFAULT);

    // A current model: right, towards, down.
    judged.daemon.report({10, 20, 30, -40, -50, -60});
    judged.daemon.press(1, true);
    judged.daemon.report({10, 20, 30, -40, -50, -60});  // unchanged: no event of absolute axes
    judged.daemon.report({1, 20, 0, -40, -50, 500});
    judged.daemon.press(1, false);
    judged.daemon.unplug();
    check_motion(10, -30, -20, -40, 60, 50);
    check_button(1, 1);
    check_motion(0, 0, -20, -40, -500, 50);  // 1 is within the daemon's dead zone
    check_button(1, 0);
    check_device(SPNAV_DEV_RM, device);
    spnav_event event{};
    CHECK(spnav_poll_event(&event) == 0);
    CHECK(spnav_dev_usbid(&vendor, &product) == -1);

    CHECK(spnav_evmask(SPNAV_EVMASK_BUTTON) == 0);
    judged.daemon.plug(device);
    judged.daemon.report({10, 0, 0, 0, 0, 0});
    judged.daemon.press(0, true);
    check_button(0, 1);
    CHECK(spnav_poll_event(&event) == 0);
  }

  TEST_CASE("version 0: after its time, with the sensitivity asked for") {
    JudgedDaemon judged(0);
    REQUIRE(judged.started);
    EmulatedDevice device;
    device.absolute = false;
    judged.daemon.plug(device);
    REQUIRE(spnav_open() == 0);
    CHECK(spnav_protocol() == 0);
    const auto wait_for = [&](float sensitivity) {
      for (int k = 0; k < 200 && judged.daemon.sensitivity() != sensitivity; ++k) usleep(1000);
      CHECK(judged.daemon.sensitivity() == sensitivity);
    };
    wait_for(1.0F);
    judged.daemon.report({100, 0, 0, 0, 0, 0});
    judged.daemon.report({0, 7, 0, 0, 0, 0});  // relative: what is zero is no event, and x stays
    judged.daemon.report({0, 0, 0, 0, 0, 0});
    check_motion(100, 0, 0, 0, 0, 0);
    check_motion(100, 0, -7, 0, 0, 0);
    CHECK(spnav_sensitivity(0.5) == 0);
    wait_for(0.5F);
    judged.daemon.report({300, 0, 0, 0, 0, 0});
    judged.daemon.press(3, true);
    check_motion(150, 0, -3, 0, 0, 0);
    check_button(3, 1);
    judged.daemon.unplug();
    spnav_event event{};
    CHECK(spnav_poll_event(&event) == 0);
  }

  TEST_CASE("killed: the library hears the end") {
    JudgedDaemon judged(1);
    REQUIRE(judged.started);
    judged.daemon.plug({});
    REQUIRE(spnav_open() == 0);
    judged.daemon.kill();
    spnav_event event{};
    CHECK(spnav_wait_event(&event) == 0);
    CHECK(spnav_close() == 0);
    REQUIRE(judged.daemon.start());
    CHECK(spnav_open() == 0);
  }
}
