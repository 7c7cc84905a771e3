// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The worst-case tests of a scene as a whole. Kept apart: counted work (exact, may fail),
/// instructions (exact), wall time of the code (least of repeats), noise of the repeats, and
/// wake-ups, which are the machine's.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hal/realtime/wakeup_measurement.hpp"
#include "host_sim/lab/wcet/adversarial_search.hpp"
#include "host_sim/lab/wcet/instruction_counts.hpp"
#include "host_sim/session/counters_check.hpp"
#include "host_sim/timing/same_state_times.hpp"

namespace haptic::sim {

struct WcetPlan {
  std::string scene, motion;  ///< names, for the report
  std::uint32_t repeats = 7;
  std::size_t most_same_state = 2000;        ///< ticks that are repeated warm and flushed
  bool exhaustive = true;                    ///< time the plain search against the core
  double wakeup_seconds = 2;                 ///< 0: not measured
  GoalContact goal = GoalContact::kLeftOut;  ///< what the ticks that are timed and counted search
  AdversarialLimits adversarial;
  std::string fault;  ///< name of the bound that the check takes for 0; empty: none
  /// Program that runs the same motion once; state hash and ticks are filled in here.
  InstructionQuestion instructions;
};

struct WcetReport {
  WcetPlan plan;
  WcetResult loop;
  SameStateTimes same_state;
  std::vector<AdversarialFinding> findings;
  std::vector<CounterBound> bounds;  ///< peaks of all ticks of all of these
  std::uint64_t work_bound = 0, proxy_bound = 0;
  InstructionCounts instructions;
  std::unique_ptr<hal::WakeupMeasurement> wakeups;  ///< never null

  /// No counter over its bound, every wrench of the search finite, repeats equal.
  [[nodiscard]] bool passed() const;
};

/// @throws tools::InputError: empty motion, no such bound to damage.
[[nodiscard]] WcetReport measure_wcet(CoreSession& session, std::span<const MotionSample> motion,
                                      const WcetPlan& plan);

/// One line per tick: tick,t_s,core_ns,exhaustive_ns,contact,relocalised,work,warm_ns,flushed_ns,
/// proxy_work,instructions; empty where not measured.
[[nodiscard]] std::string wcet_csv(const WcetReport& report, std::span<const MotionSample> motion);
/// One object, two spaces of indent, keys in a fixed order.
[[nodiscard]] std::string wcet_json(const WcetReport& report);

/// Writes wcet.csv, wcet.json, wcet.svg, trace.json, wakeups.txt (as cyclictest has it, when they
/// were measured) and adversarial_GOAL_seedN.csv into the folder. @throws tools::InputError.
void write_wcet(const std::string& folder, const WcetReport& report,
                std::span<const MotionSample> motion);

/// Name of a finding's motion file in the folder.
[[nodiscard]] std::string motion_file_name(const AdversarialFinding& finding, std::uint64_t seed);

// The account of a worst-case test for people.

/// Tables, each under its own heading: counted work and its bounds, wall time of the code, noise of
/// the repeats, wake-ups of the machine, what the search found.
[[nodiscard]] std::string wcet_table(const WcetReport& report, const SceneView& view,
                                     std::span<const MotionSample> motion);

}  // namespace haptic::sim
