// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Counts and figures of the campaign against several moving bodies.

#include <cstdint>

#include "host_sim/oracle/wide.hpp"
#include "host_sim/report/campaign_text.hpp"

namespace haptic::sim {

struct BodiesTotals {
  std::uint64_t ticks = 0, held = 0;  ///< held: a hand is kept from its goal
  // Each of these must be zero.
  std::uint64_t deep = 0;        ///< two bodies are deeper in each other than allowed
  std::uint64_t dips = 0;        ///< they are on the way of a step, or a move that no step tells
  std::uint64_t rises = 0;       ///< the sum of the springs' energies rose by more than its bound
  std::uint64_t springs = 0;     ///< wrench or energy of a spring is not that of its error
  std::uint64_t sums = 0;        ///< contact forces between bodies do not cancel
  std::uint64_t unbalanced = 0;  ///< at rest, a body's contacts do not hold its spring's pull
  std::uint64_t stuck = 0;       ///< goals stand still: a body does not arrive, or all do not stop
  std::uint64_t recoveries = 0;  ///< bodies in each other, by the law's own account
  std::uint64_t over = 0;        ///< ticks with more units of work than their bound
  std::uint64_t infinite = 0;    ///< a number that is not finite
  // Figures.
  Wide worst_gap_m = 0, worst_way_m = 0;            ///< in tolerances of their scenes
  Wide largest_rise_j = 0, largest_rise_share = 0;  ///< in J, and of its bound
  Wide largest_sum_n = 0;                           ///< what contact forces between bodies leave
  Wide largest_lever_m = 0;      ///< what their torques leave, over the largest force
  Wide largest_rest_n = 0;       ///< what the contacts of a body at rest leave of its spring's pull
  Wide largest_lag_m = 0;        ///< of a driver
  std::uint64_t hand_ticks = 0;  ///< of the hands of a scene file, judged at their ends
  std::uint64_t refused = 0;     ///< of them without a result; must be zero
  std::uint64_t ways = 0;        ///< steps whose ways were judged
  std::uint64_t summed = 0;      ///< ticks whose contact forces were added up
  std::uint64_t rests = 0;       ///< rests at the ends of runs
  std::uint64_t rejected_ticks = 0, limited_ticks = 0, spent_ticks = 0;
  std::uint64_t longest_rejected = 0;  ///< run of ticks without a step, with rejected passes
  std::uint64_t longest_arrival = 0;   ///< ticks from the goals' standing still to the bodies'
  std::uint64_t peak_units = 0, peak_rows = 0, peak_rounds = 0, peak_steps = 0;
  std::uint64_t units_bound = 0;  ///< of a tick
  /// Time of a tick by the clock, with what else the machine did: no two runs have the same.
  std::uint64_t peak_ns = 0;
  FailureLog failures;

  [[nodiscard]] std::uint64_t failed() const {
    return deep + dips + rises + springs + sums + unbalanced + stuck + recoveries + over + refused +
           infinite;
  }
  void add(const BodiesTotals& other);
};

inline constexpr NamedCount<BodiesTotals> kBodiesMustBeZero[] = {
    {"not_free", &BodiesTotals::deep},      {"dips", &BodiesTotals::dips},
    {"energy_rises", &BodiesTotals::rises}, {"wrong_springs", &BodiesTotals::springs},
    {"wrong_sums", &BodiesTotals::sums},    {"unbalanced_rests", &BodiesTotals::unbalanced},
    {"stuck", &BodiesTotals::stuck},        {"recoveries", &BodiesTotals::recoveries},
    {"over_bound", &BodiesTotals::over},    {"refused", &BodiesTotals::refused},
    {"not_finite", &BodiesTotals::infinite}};

inline constexpr NamedCount<BodiesTotals> kBodiesFigures[] = {
    {"judged_steps", &BodiesTotals::ways},
    {"hand_ticks", &BodiesTotals::hand_ticks},
    {"summed_ticks", &BodiesTotals::summed},
    {"rests", &BodiesTotals::rests},
    {"rejected_ticks", &BodiesTotals::rejected_ticks},
    {"limited_ticks", &BodiesTotals::limited_ticks},
    {"spent_ticks", &BodiesTotals::spent_ticks},
    {"longest_rejected", &BodiesTotals::longest_rejected},
    {"longest_arrival", &BodiesTotals::longest_arrival},
    {"peak_units", &BodiesTotals::peak_units},
    {"units_bound", &BodiesTotals::units_bound},
    {"peak_rows", &BodiesTotals::peak_rows},
    {"peak_rounds", &BodiesTotals::peak_rounds},
    {"peak_program_steps", &BodiesTotals::peak_steps}};

}  // namespace haptic::sim
