// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "hal/realtime/flight_report.hpp"
#include "rt_core/exchange/device_exchange.hpp"
#include "rt_core/safety/arming.hpp"

using namespace haptic;
using namespace haptic::hal;

namespace {

std::vector<StepTrace> some_ticks(std::size_t count) {
  std::vector<StepTrace> records(count);
  for (std::size_t k = 0; k < count; ++k) {
    StepTrace& r = records[k];
    r.tick = 100 + k;
    r.sequence = 90 + k;
    r.now_ns = 5'000'000'000 + static_cast<std::int64_t>(k) * 1'000'000;
    r.stamp_ns = r.now_ns - 250'000;
    r.state_hash = 0xfedcba9876543210u + k;
    r.pose_p_m[2] = 0.05;
    r.command_force_n[0] = 3;
    r.command_force_n[1] = 4;
    r.d_near_m = -0.001 / 3;
    r.link = static_cast<std::uint8_t>(LinkState::kReady);
    r.arming = static_cast<std::uint8_t>(ArmingState::kArmed);
  }
  return records;
}

std::vector<std::string> split(const std::string& text, char by) {
  std::vector<std::string> parts;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(by, at), text.size());
    parts.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return parts;
}

bool has(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_SUITE("hal.flight_report") {
  TEST_CASE("texts: every bit by name, unknown ones too") {
    CHECK(safety_fault_texts(0).empty());
    CHECK(safety_fault_texts(kFaultStaleState | kFaultDeviceLost) ==
          std::string(fault_text(kFaultStaleState)) + "; " + fault_text(kFaultDeviceLost));
    CHECK(safety_fault_texts(1u << 31) == "unknown fault");
    CHECK(device_fault_texts(kLinkServoLost | kDeviceWatchdogCut) ==
          "the device's watchdog cut the drives; the servo process ended");
    CHECK(device_fault_texts(1u << 30) == "unknown fault");
    CHECK(device_fault_texts(0).empty());
  }

  TEST_CASE("text: the last ticks, times to the last one, faults where they change") {
    std::vector<StepTrace> records = some_ticks(20);
    for (std::size_t k = 15; k < 20; ++k) records[k].faults = kFaultLateTick;
    records[19].device_faults = kLinkStaleCommand;
    const std::string text = flight_text(records, 6);
    const std::vector<std::string> lines = split(text, '\n');
    REQUIRE(lines.size() == 2 + 6 + 3);  // heading, columns, ticks, three lines of faults
    CHECK(lines[0] == "flight recorder: ticks 114 to 119, the last of 20");
    CHECK(has(lines[2], "114    -5.000   0.250"));
    CHECK(has(lines[2], "ready"));
    CHECK(has(lines[2], "armed"));
    CHECK(has(lines[2], "5.000"));  // norm of the command
    CHECK(has(lines[4], fault_text(kFaultLateTick)));
    CHECK(has(lines[9], fault_text(kFaultLateTick)));
    CHECK(has(lines[10], "the servo's command was too old"));
    CHECK(split(flight_text(records, 1000), '\n').size() == 2 + 20 + 3);
    CHECK(flight_text({}, 10) == "flight recorder: no tick was recorded\n");
    CHECK(flight_text(records, 0).empty());
  }

  TEST_CASE("text: gaps, faults that end, and bytes that no servo tick wrote") {
    std::vector<StepTrace> records = some_ticks(4);
    records.erase(records.begin() + 1);
    records[0].faults = kFaultJump;
    std::string text = flight_text(records, 10);
    CHECK(has(text, "ticks are missing"));
    CHECK(has(text, "no fault any more"));
    records[2].link = 200;
    records[2].arming = 77;
    records[2].pose_p_m[0] = std::numeric_limits<double>::quiet_NaN();
    records[2].pose_p_m[1] = std::numeric_limits<double>::max();
    records[2].now_ns = std::numeric_limits<std::int64_t>::min();
    records[2].stamp_ns = std::numeric_limits<std::int64_t>::max();
    text = flight_text(records, 10);
    CHECK(has(text, " ? "));
    CHECK(has(text, "nan"));
    CHECK(text.back() == '\n');
  }

  TEST_CASE("csv: as many fields as columns; numbers read back as they were") {
    std::vector<StepTrace> records = some_ticks(3);
    records[1].command_force_n[2] = 0.1 + 0.2;
    records[2].d_near_m = std::numeric_limits<double>::infinity();
    const std::vector<std::string> lines = split(flight_csv(records), '\n');
    REQUIRE(lines.size() == 4);
    const std::vector<std::string> columns = split(lines[0], ',');
    for (const std::string& line : lines) CHECK(split(line, ',').size() == columns.size());
    const auto field = [&](std::size_t line, const std::string& name) {
      const auto at = std::find(columns.begin(), columns.end(), name);
      REQUIRE(at != columns.end());
      return split(lines[line], ',')[static_cast<std::size_t>(at - columns.begin())];
    };
    CHECK(field(1, "tick") == "100");
    CHECK(field(2, "state_hash") == "fedcba9876543211");
    CHECK(std::stod(field(2, "command_fz_n")) == 0.1 + 0.2);
    CHECK(std::stod(field(1, "d_near_m")) == -0.001 / 3);
    CHECK(std::isinf(std::stod(field(3, "d_near_m"))));
    CHECK(field(3, "arming") == "2");
    CHECK(field(3, "work") == "0");
  }
}
