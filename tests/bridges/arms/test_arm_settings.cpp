// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>

#include "tests/bridges/arms/dynamixel_emulator.hpp"
#include "tests/bridges/arms/random_arm.hpp"
#include "tests/support/program_run.hpp"
#include "tests/support/text_search.hpp"
#include "tools/bridges/dynamixel/dynamixel_device.hpp"
#include "tools/bridges/serial/serial_port.hpp"

using namespace haptic::tools;
using haptic::hal::DriverDefect;
using haptic::hal::DriverOptions;
using haptic::sim::test::ScratchFolder;
using haptic::test::has;

namespace {

using KeyValue = std::pair<std::string_view, std::variant<std::string, bool, double>>;

DriverOptions arm_options(const ScratchFolder& folder, const std::vector<KeyValue>& more = {}) {
  const std::string urdf = folder.file("arm.urdf");
  std::ofstream(urdf) << haptic::test::urdf_of(haptic::test::leader_chain());
  DriverOptions options;
  options.values = {{"port", std::string("/dev/null")},
                    {"urdf", urdf},
                    {"base_link", std::string("base")},
                    {"tip_link", std::string("tip")}};
  // The first value of a key counts.
  options.values.insert(options.values.begin(), more.begin(), more.end());
  return options;
}

std::string defect_with(const ScratchFolder& folder, const std::vector<KeyValue>& more) {
  DriverDefect defect;
  const auto device = make_dynamixel(arm_options(folder, more), defect);
  CHECK((device != nullptr) == defect.key.empty());
  return std::string(defect.key) + ": " + defect.text;
}

std::string opened(const std::string& path, std::uint32_t baud, const SerialSystem& system = {}) {
  SerialPort port;
  std::string why;
  return port.open(path, baud, why, system) ? "open" : why;
}

}  // namespace

TEST_SUITE("bridges.arm_settings") {
  TEST_CASE("keys: read into joints, D and trigger") {
    const ScratchFolder folder("arm_settings");
    ArmSettings settings;
    DriverDefect defect;
    REQUIRE(read_arm_settings(arm_options(folder, {{"ids", std::string("11 12,13 14 15 16")},
                                                   {"baud", 4e6},
                                                   {"offsets_rad", std::string("0 1.57 0 0 0 -3")},
                                                   {"signs", std::string("1 -1 +1 1 1 -1")},
                                                   {"origin_m", std::string("0.2 0 0.1")},
                                                   {"trigger_id", 17.0},
                                                   {"trigger_rad", std::string("3.1 2.5")}}),
                              settings, defect));
    CHECK(settings.baud == 4'000'000);
    CHECK(settings.ids == std::vector<std::uint8_t>{11, 12, 13, 14, 15, 16});
    CHECK(settings.offsets_rad[1] == 1.57);
    CHECK(settings.signs[5] == -1);
    // x of the base, forward, is y of D, away from the operator.
    const ArmPlace place = place_of(settings.arm.model, {});
    CHECK(place.tip.x() == doctest::Approx(0).epsilon(1e-12));
    CHECK(place.tip.y() == doctest::Approx(0.37 - 0.2));
    CHECK(place.tip.z() == doctest::Approx(0.09 - 0.1));
    CHECK_FALSE(is_pulled(settings.trigger, 2.8, false));
    CHECK(is_pulled(settings.trigger, 2.7, false));
    CHECK(is_pulled(settings.trigger, 2.8, true));
    CHECK_FALSE(is_pulled(settings.trigger, 2.9, true));
  }

  TEST_CASE("keys: what cannot be meant is refused with its key and a fix") {
    const ScratchFolder folder("arm_defects");
    const auto text = [](const char* t) { return std::string(t); };
    CHECK(defect_with(folder, {}) == ": ");
    CHECK(has(defect_with(folder, {{"port", text("")}}), "port: is missing; name the adapter"));
    CHECK(has(defect_with(folder, {{"urdf", text("none.urdf")}}), "urdf: none.urdf"));
    CHECK(has(defect_with(folder, {{"tip_link", text("hand")}}), "no link 'hand', which tip_link"));
    CHECK(has(defect_with(folder, {{"ids", text("1 2 3")}}), "ids: has 3 numbers; give 6"));
    CHECK(has(defect_with(folder, {{"ids", text("1 2 3 4 5 5")}}), "ids: are whole numbers"));
    CHECK(has(defect_with(folder, {{"ids", text("1 2 3 4 5 253")}}), "'253' is no number from 0"));
    CHECK(has(defect_with(folder, {{"signs", text("1 1 1 1 1 0.5")}}), "signs: are 1 or -1"));
    CHECK(has(defect_with(folder, {{"offsets_rad", text("0 0 nan 0 0 0")}}), "'nan' is no number"));
    CHECK(has(defect_with(folder, {{"offsets_rad", text("0 0 1x 0 0 0")}}), "'1x' is no number"));
    CHECK(has(defect_with(folder, {{"torque_limits_nm", text("1 1 1 1 1 99")}}), "from 0 to 20"));
    CHECK(has(defect_with(folder, {{"trigger_id", 7.0}}), "trigger_rad: is missing"));
    CHECK(has(defect_with(folder, {{"trigger_id", 6.0}, {"trigger_rad", text("0 1")}}),
              "trigger_id: is the whole number of a servo that is no joint's"));
    CHECK(has(defect_with(folder, {{"trigger_id", 7.0}, {"trigger_rad", text("1 1")}}),
              "leaves the trigger no way"));
    CHECK(has(defect_with(folder, {{"baud", 1000000.5}}), "baud: is a whole number"));
  }

  TEST_CASE("find_driver: both bridges have a row with their keys") {
    for (const std::string_view name : {"dynamixel", "feetech"}) {
      const haptic::hal::DriverRow* const row = haptic::hal::find_driver(name);
      REQUIRE(row != nullptr);
      CHECK(row->is_bridged);
      CHECK(row->keys.size() >= 12);
    }
  }

  TEST_CASE("serial port: rates that no table has, held alone, and what is no serial port") {
    haptic::test::DynamixelEmulator bus(1, 1220);
    for (const std::uint32_t baud : {57'600u, 1'000'000u, 4'000'000u, 1'234'567u})
      CHECK(opened(bus.path(), baud) == "open");
    SerialPort held;
    std::string why;
    REQUIRE(held.open(bus.path(), 1'000'000, why));
    CHECK(has(opened(bus.path(), 1'000'000), "another program holds it; end that program"));
    held.close();
    const ScratchFolder folder("serial_port");
    const SerialSystem system{folder.file("")};
    CHECK(has(opened("/dev/null", 9600, system), "'/dev/null': this is no serial port; name one"));
    CHECK(has(opened(folder.file(""), 9600, system), "this is no serial port"));
    CHECK(has(opened("/dev/none", 9600, system), "no such port; plug the adapter in"));
    CHECK(has(opened("/dev/none", 9600, system), "no serial port is plugged in"));
    std::filesystem::create_directories(folder.file("dev/serial/by-id"));
    std::ofstream(folder.file("dev/serial/by-id/usb-ROBOTIS")) << "";
    CHECK(has(opened("/dev/none", 9600, system), "dev/serial/by-id/usb-ROBOTIS"));
  }

  TEST_CASE("serial_advice: latency timer and ModemManager, where they are") {
    const ScratchFolder folder("serial_advice");
    const SerialSystem system{folder.file("")};
    CHECK(serial_advice("/dev/ttyUSB7", system).empty());
    const std::string timers = folder.file("sys/bus/usb-serial/devices/ttyUSB7");
    std::filesystem::create_directories(timers);
    std::ofstream(timers + "/latency_timer") << "16\n";
    CHECK(
        has(serial_advice("/dev/ttyUSB7", system), "holds answers back for 16 ms: echo 1 | sudo"));
    std::ofstream(timers + "/latency_timer") << "1\n";
    CHECK(serial_advice("/dev/ttyUSB7", system).empty());
    std::filesystem::create_directories(folder.file("run/systemd/units"));
    std::filesystem::create_symlink(
        "f00d", folder.file("run/systemd/units/invocation:ModemManager.service"));
    CHECK(has(serial_advice("/dev/ttyACM0", system), "disable --now ModemManager"));
    CHECK(serial_advice("/dev/ttyUSB7", system).empty());
  }
}
