// SPDX-License-Identifier: Apache-2.0
// run_device list as a new owner of a device meets it, on made-up buses.
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/program_run.hpp"
#include "tests/support/text_search.hpp"

using haptic::sim::test::ProgramResult;
using haptic::sim::test::run_program;
using haptic::sim::test::ScratchFolder;
using haptic::test::has;
using nlohmann::json;

namespace {

/// A folder that stands for / with USB devices in it.
struct PluggedBus {
  PluggedBus() : folder("list_bus") { put("/sys/bus/usb/devices/usb1/idVendor", "1d6b"); }
  void put(const std::string& path, const std::string& text) const {
    const std::filesystem::path file = folder.file(path.substr(1));
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text << "\n";
  }
  void plug(const std::string& place, const char* vendor, const char* product, const char* name,
            const char* serial) const {
    const std::string device = "/sys/bus/usb/devices/" + place;
    put(device + "/idVendor", vendor);
    put(device + "/idProduct", product);
    if (*name != '\0') put(device + "/product", name);
    if (*serial != '\0') put(device + "/serial", serial);
  }
  [[nodiscard]] ProgramResult list(const std::string& more = "") const {
    return run_program(HAPTIC_RUN_DEVICE, "list --root '" + folder.file("") + "' " + more);
  }
  ScratchFolder folder;
};

/// Bridges look at this machine, so what they find here is not ours to say.
bool has_bridged_device(const PluggedBus& bus) {
  return !json::parse(bus.list("--json").out)["devices"].empty();
}

}  // namespace

TEST_SUITE("tools.run_device.list") {
  TEST_CASE("nothing plugged in: exit code 4, why each bridge found none, and what to do") {
    const PluggedBus bus;
    if (has_bridged_device(bus)) return;
    const ProgramResult r = bus.list();
    CHECK(r.exit_code == 4);
    CHECK(r.err.empty());
    for (const char* bridge : {"spacenav", "haply", "openhaptics", "forcedimension"})
      CHECK(has(r.out, std::string("\n  ") + bridge + ": "));
    // An arm is reached by the port that its owner names.
    CHECK_FALSE(has(r.out, "dynamixel:"));
    CHECK(has(r.out,
              "\nNo device was found. run_device doctor says what a device needs here; "
              "driver = \"sim\" needs none.\n"));
    CHECK(run_program(HAPTIC_RUN_DEVICE, "list --nonsense").exit_code == 2);
  }

  TEST_CASE("each device: its name and place, how it was tested, and the lines to begin with") {
    const PluggedBus bus;
    bus.plug("1-2", "1209", "0001", "Reference 6-DOF", "A1");
    bus.plug("1-3", "256f", "c635", "SpaceMouse Compact", "");
    bus.plug("1-4", "0403", "cb48", "", "");
    bus.plug("1-5", "0403", "6014", "USB <-> Serial Converter", "FT4TH");
    bus.plug("1-6", "1a86", "55d3", "", "");
    bus.plug("1-7", "046d", "c31c", "Keyboard", "");
    bus.put("/dev/serial/by-id/usb-FTDI_USB__-__Serial_Converter_FT4TH-if00-port0", "");
    const ProgramResult r = bus.list();
    CHECK(r.exit_code == 0);
    CHECK(r.err.empty());
    for (const char* text :
         {"Reference 6-DOF at 1-2: driver reference, tested against our model of it",
          "    driver = \"reference\"\n    address = \"1209:0001:A1\"\n",
          "SpaceMouse Compact at 1-3: driver spacemouse", "    address = \"256f:c635@1-3\"\n",
          "Novint Falcon at 1-4: driver falcon, tested against our model of it alone\n",
          "ROBOTIS U2D2 at 1-5: driver dynamixel",
          "    port = "
          "\"/dev/serial/by-id/usb-FTDI_USB__-__Serial_Converter_FT4TH-if00-port0\"\n",
          "    urdf = \"ARM.urdf\"",
          "servo board of SO-100, SO-101, Waveshare at 1-6: driver feetech",
          "    port = \"/dev/serial/by-id/...\"\n", "run_device run FILE\n"}) {
      CAPTURE(text);
      CHECK(has(r.out, text));
    }
    CHECK_FALSE(has(r.out, "Keyboard"));
    const json report = json::parse(bus.list("--json").out);
    CHECK(report["devices"].size() >= 5);
    for (const json& device : report["devices"]) {
      CHECK_FALSE(device["tested"].get<std::string>().empty());
      CHECK(has(device["toml"], "driver = \""));
    }
  }

  TEST_CASE("doctor: a device that was asked for and is not there is a failure") {
    const PluggedBus bus;
    if (has_bridged_device(bus)) return;
    const ProgramResult r =
        run_program(HAPTIC_RUN_DEVICE, "doctor --no-measure --json --device haply");
    CHECK(r.exit_code == 4);
    bool is_there = false;
    const json report = json::parse(r.out);
    for (const json& line : report["lines"]) {
      if (line["name"] != "Haply service") continue;
      is_there = true;
      CHECK(line["level"] == "failure");
      CHECK(has(line["fix"], "systemctl start haply-inverse-service"));
    }
    CHECK(is_there);
    CHECK(run_program(HAPTIC_RUN_DEVICE, "doctor --device falcon").exit_code == 2);
  }
}
