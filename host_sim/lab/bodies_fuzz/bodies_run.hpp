// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One run of several bodies under seeded goals: the law over its scenes, and the judge.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/bodies_fuzz/bodies_judge.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_motion.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_session.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_totals.hpp"

namespace haptic::sim {

/// Not movable: it holds pointers into itself.
class BodiesRun {
 public:
  /// `compiled` must outlive it. @throws tools::InputError when a blob is refused.
  BodiesRun(const CompiledBodies& compiled, const std::string& label, std::uint32_t work_units,
            std::optional<BodiesFault> fault);
  BodiesRun(const BodiesRun&) = delete;
  BodiesRun& operator=(const BodiesRun&) = delete;

  /// Run `number` of a campaign of this seed: `ticks` ticks from free places, then the goals stand
  /// still until the bodies do. @throws tools::InputError when the scene's own starts are not free.
  [[nodiscard]] BodiesTotals run(std::uint64_t ticks, std::uint64_t seed, std::uint64_t number);

 private:
  /// One tick, with the poses in long double.
  struct Tick {
    std::uint64_t number = 0, ns = 0;
    BodiesTick told;
    std::vector<GripPose> goals;
    std::vector<WidePose> before, after, wide_goals, goals_before;
    /// Poses of all bodies after each step. A law that is right ends the tick at the last ones.
    std::vector<std::vector<WidePose>> steps;
  };
  [[nodiscard]] std::vector<BodyPlace> draw_starts(Seeded& random);
  void look(Tick& tick);
  void check_free(const Tick& tick, BodiesTotals& totals);
  void check_ways(const Tick& tick, BodiesTotals& totals);
  void check_energy(const Tick& tick, BodiesTotals& totals);
  void check_springs(const Tick& tick, BodiesTotals& totals);
  void check_sums(const Tick& tick, BodiesTotals& totals);
  void note_work(const Tick& tick, BodiesTotals& totals);
  [[nodiscard]] bool check_rest(const Tick& tick, BodiesTotals& totals);
  void check_arrived(const Tick& tick, BodiesTotals& totals);
  [[nodiscard]] bool moves(const Tick& tick) const;
  [[nodiscard]] bool is_finite_tick(const Tick& tick) const;
  [[nodiscard]] Wrench contact_w(std::size_t body) const;
  [[nodiscard]] Wide torque_sum_nm(std::span<const WidePose> poses) const;
  [[nodiscard]] WidePull pull_of(std::size_t body, const Tick& tick) const;
  void fail(const Tick& tick, const char* kind, const std::string& what, std::uint64_t& count,
            BodiesTotals& totals) const;

  const BodiesScene& scene_;
  const bool has_loose_;
  BodiesSession session_;
  BodiesJudge judge_;
  std::string scene_label_, label_;
  std::optional<BodiesFault> fault_;
  std::uint64_t resting_ = 0;   ///< ticks since the goals have stood still
  std::uint64_t still_ = 0;     ///< of them at the end: without a move
  std::uint64_t rejected_ = 0;  ///< ticks in a row without a step, with rejected passes
};

}  // namespace haptic::sim
