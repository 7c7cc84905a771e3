// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What must happen at each fault in each state: the stated failure semantics of the device side.

#include <cstdint>
#include <span>
#include <string>

#include "host_sim/lab/faults/fault_case.hpp"
#include "rt_core/safety/safety_limits.hpp"

namespace haptic::sim {

/// What the hand feels of a fault at full force.
enum class FaultOutput : std::uint8_t {
  kUnchanged = 0,  ///< except for an output that is missed or comes late
  kDips,           ///< then comes back within the slew limit
  kBounded,        ///< follows what is asked, within force and slew limits
  kRampsToZero,    ///< and stays there until armed again
  kCut             ///< the device takes its drives off itself; zero until armed again
};
[[nodiscard]] const char* to_text(FaultOutput output);

/// Failure semantics of one fault, as it is with the device calibrated and reporting.
struct FaultRule {
  const char* fault;  ///< Fault::name
  const char* noticed_by;
  FaultOutput output = FaultOutput::kUnchanged;
  std::uint32_t safety = 0;  ///< SafetyFault that latch
  std::uint32_t device = 0;  ///< DeviceFault that the servo tick gets, at any time
  unsigned noticed_ms = 0;   ///< from the fault to the begin of the ramp, or to the device's cut
  const char* cleared_by;    ///< apart from releasing the deadman switch and pressing it again
};
/// One rule for each of faults(), in their order.
[[nodiscard]] std::span<const FaultRule> fault_rules();

/// What a cell must show.
struct FaultExpectation {
  FaultOutput output = FaultOutput::kUnchanged;
  std::uint32_t safety = 0;      ///< latched at the end of the watch
  std::uint32_t safety_may = 0;  ///< and these too, or not
  std::uint32_t device = 0;      ///< reported during the watch
  double zero_within_s = 0;      ///< of what acts at the device; outputs that end at zero
};
/// `linked`: there is a bus, and a link that tells of its own faults.
[[nodiscard]] FaultExpectation expectation_of(const FaultCase& cell, const SafetyLimits& limits,
                                              bool linked);

/// Names of the bits, joined by " + "; "-" for none.
[[nodiscard]] std::string safety_fault_names(std::uint32_t faults);
[[nodiscard]] std::string device_fault_names(std::uint32_t faults);

/// fault_rules() as a Markdown table; faults with equal rules share a row. Latched: SafetyFault, in
/// brackets what the servo tick gets (DeviceFault).
[[nodiscard]] std::string failure_semantics();

}  // namespace haptic::sim
