// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Is friction Coulomb's where a part has little room? Parts slid along the walls of tight fits,
/// parts that have come to rest in them or go around in them, and nuts on their bolts.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/report/part_report.hpp"
#include "host_sim/report/shard_run.hpp"

namespace haptic::sim {

/// A fault made on purpose, which the study must find.
enum class FrictionFault : std::uint8_t {
  kCoefficient,  ///< the scene rubs by a quarter more than it is judged by
  kBudget,       ///< 50 units of work a tick
  kCreep,        ///< the hand that is said to rest moves on by 20 um
  kLate,         ///< what is felt comes 200 ms late
};
/// @throws tools::UsageError where no fault has this name.
[[nodiscard]] FrictionFault friction_fault_named(const std::string& name);

struct FrictionSize {
  bool is_short = false;
  std::optional<FrictionFault> fault;
  std::uint32_t work_units = 0;  ///< of a tick; 0: the compiler's default
  /// Of a tick, with `few` where their lack is the fault.
  [[nodiscard]] std::uint32_t units(std::uint32_t few) const {
    return fault == FrictionFault::kBudget ? few : work_units;
  }
};

/// fits.csv: slot, square hole, tube, dovetail, V grooves and corner, 1 um to 1 mm of clearance,
/// friction 0.05 to 1, 5 to 300 mm/s, pressed by 0.2 to 5 N, 1, 3 and 5 passes a tick. Failed: a
/// force that is more than 5 % off Coulomb's where that has one, or more than one tick of a
/// thousand behind. Cost: some 4000 cells of a second, ten minutes; short: 60.
[[nodiscard]] PartReport fit_study(const FrictionSize& size, const RunOptions& options);

/// stops.csv: hands that wander in eleven fits and stop; the wrench from 30 ticks after that on for
/// a second. Failed: more than 2 in 1000 of those with a force that change by more than 2 %. Cost:
/// some 5000 stops of a second, five minutes; short: 700.
[[nodiscard]] PartReport stop_study(const FrictionSize& size, const RunOptions& options);

/// loops.csv: hands that go around slowly in the same fits, twice, and what the second loop gives
/// them. Failed: a loop that gives energy, or that nothing is felt in. Cost: 132 loops of 4.5 s, a
/// minute; short: 11.
[[nodiscard]] PartReport loop_study(const FrictionSize& size, const RunOptions& options);

/// threads.csv: nuts turned on their bolts while pressed. Failed: a torque above three times that
/// of screw mechanics with the largest friction of the flank, or a lag of more than 10 mrad.
[[nodiscard]] PartReport thread_study(const FrictionSize& size, const RunOptions& options);

}  // namespace haptic::sim
