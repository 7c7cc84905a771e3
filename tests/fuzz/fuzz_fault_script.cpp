// SPDX-License-Identifier: Apache-2.0
/// Any text as a script of device faults: read within the ranges of its kinds, or refused with file
/// and line. The faults of reports then pass over some reports.
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "hal/drivers/reference_codec.hpp"
#include "host_sim/device/device_fault.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tools/common/error.hpp"

namespace {

using namespace haptic::sim;
using haptic::fuzz::MemoryFile;
using haptic::fuzz::require;

constexpr double kRate_hz = 1000;
constexpr std::uint64_t kPeriods = 40;
constexpr std::size_t kMostPassed = 64;

const DeviceFaultRule& rule_of(DeviceFaultKind kind) {
  for (const DeviceFaultRule& rule : device_fault_kinds()) {
    if (rule.kind == kind) return rule;
  }
  throw haptic::fuzz::PropertyBroken("every kind has a rule");
}

void check_events(const std::vector<DeviceFaultEvent>& events) {
  std::uint64_t last = 1;
  for (const DeviceFaultEvent& event : events) {
    const DeviceFaultRule& rule = rule_of(event.kind);
    require(event.report >= last && event.report <= 1'000'000'000, "periods are in order");
    require(event.count >= 1 && event.count <= 1'000'000 && (rule.counted || event.count == 1),
            "counts are in range");
    require(event.amount >= rule.low && event.amount <= rule.high, "amounts are in range");
    require(!event.out_endpoint || rule.has_endpoint, "an endpoint only where it means something");
    last = event.report;
  }
}

/// The first event is moved to the first periods, the others keep their distance.
void pass_reports(std::span<const DeviceFaultEvent> events) {
  ReportFaultFilter filter;
  events = events.first(std::min(events.size(), kMostPassed));
  std::size_t longest = haptic::hal::kReferenceReportBytes;
  for (DeviceFaultEvent event : events) {
    event.report -= events.front().report - 1;
    if (event.kind == DeviceFaultKind::kLong) longest += static_cast<std::size_t>(event.amount);
    filter.add(event);
  }
  haptic::hal::ReferenceReport report;
  std::array<std::uint8_t, haptic::hal::kReferenceReportBytes> bytes{};
  std::size_t sent = 0;
  for (std::uint64_t period = 1; period <= kPeriods; ++period) {
    report.sequence = static_cast<std::uint32_t>(period);
    haptic::hal::encode(report, bytes);
    for (const auto& each : filter.pass(period, bytes)) {
      require(each.size() <= longest, "a report grows by what the script says");
      ++sent;
    }
  }
  require(sent <= kPeriods * (events.size() + 1), "an event adds one report in a period at most");
  if (events.empty()) require(sent == kPeriods, "without a fault each report goes out");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static MemoryFile file;
  file.set({reinterpret_cast<const char*>(data), size});
  try {
    const std::vector<DeviceFaultEvent> events = read_fault_script(file.path(), kRate_hz);
    check_events(events);
    pass_reports(events);
  } catch (const haptic::tools::InputError& error) {
    require(haptic::fuzz::names_place(error.what(), file.path(), 1) ||
                haptic::fuzz::names_place(error.what(), file.path(), 2),
            "a refusal begins with file and line");
  }
  return 0;
}
