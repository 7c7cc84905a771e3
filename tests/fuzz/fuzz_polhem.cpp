// SPDX-License-Identifier: Apache-2.0
/// The Polhem driver and codec against any bytes: steps that read a report or write a wrench.
#include <array>
#include <cstdlib>

#include "hal/drivers/polhem_driver.hpp"
#include "tests/fuzz/report_stream.hpp"

namespace {

using namespace haptic;
using namespace haptic::hal;
using haptic::fuzz::ReportStream;
using haptic::fuzz::require;

void check_codec(std::span<const std::uint8_t> bytes) {
  std::array<std::uint8_t, kPolhemReportBytes> again{};
  PolhemReport report;
  if (decode(bytes, report) == PolhemVerdict::kOk) {
    encode(report, again);
    require(std::equal(bytes.begin(), bytes.end(), again.begin(), again.end()),
            "a report that is read is written the same");
  }
  PolhemCommand command, back;
  if (decode(bytes, command) == PolhemVerdict::kOk) {
    encode(command, again);
    require(decode(again, back) == PolhemVerdict::kOk && back == command,
            "a command that is read is written to the same meaning");
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ReportStream input(std::span(data, size));
  PolhemSettings settings;
  settings.has_deadman = true;
  PolhemDriver driver(settings);
  DeviceState state;
  bool counts_were_set = false;
  while (!input.empty()) {
    if ((input.byte() & 1u) == 0) {
      const auto report = input.report();
      check_codec(report);
      const DeviceState before = state;
      const ReportVerdict verdict = driver.read(report, 0, state);
      if (verdict != ReportVerdict::kState) fuzz::require_same(before, state);
      fuzz::require_usable(state);
      if (state.link == LinkState::kReady) {
        require(counts_were_set, "ready only after the counts were set");
      }
      continue;
    }
    std::array<std::uint8_t, kPolhemReportBytes> bytes{};
    Wrench delivered;
    require(driver.write(input.wrench(), 1, bytes, delivered) == bytes.size(), "a report is sent");
    PolhemCommand command;
    require(decode(bytes, command) == PolhemVerdict::kOk, "what is sent is a command");
    counts_were_set = counts_were_set || command.set_counts;
    require(is_finite(delivered) && delivered.torque_w.isZero(), "a finite force is delivered");
    for (const std::int16_t ma : command.currents_ma) {
      require(std::abs(int{ma}) <= 2000, "currents are within what the drives can carry");
      if (state.link != LinkState::kReady) require(ma == 0, "no current before calibration");
    }
    if (command.set_counts) require(delivered.force_w.isZero(), "setting counts is no force");
  }
  return 0;
}
