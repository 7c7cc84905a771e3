// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Bodies of a study under the law, every tick and every step judged from vertices alone.

#include <optional>
#include <string>
#include <vector>

#include "host_sim/lab/bodies_fuzz/bodies_judge.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_motion.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_session.hpp"
#include "host_sim/lab/bodies_study/bodies_study.hpp"

namespace haptic::sim {

/// A body of convex pieces whose grip point stays within `far_m` of `start`.
[[nodiscard]] FuzzBody study_body(const std::string& name, BodyRole role, std::vector<Solid> pieces,
                                  const Vector& start, double far_m);
[[nodiscard]] std::vector<Solid> one_box(double half_x, double half_y, double half_z);
/// Its top is the plane z = 0.
[[nodiscard]] Solid study_table();
[[nodiscard]] Rotation turn_about(const Vector& axis, double angle_rad);

/// Not movable: the law is a view of memory that lies here.
class StudyBench {
 public:
  /// The bodies are at `starts`, which must be free; `work_units`: the budget of a tick, 0: none.
  /// @throws tools::InputError a pair is refused.
  StudyBench(BodiesScene scene, double friction, const std::vector<BodyPlace>& starts,
             std::optional<BodiesFault> fault, std::uint32_t work_units = 0);
  StudyBench(const StudyBench&) = delete;
  StudyBench& operator=(const StudyBench&) = delete;

  BodiesTick tick(const std::vector<BodyPlace>& goals);

  /// How far a body is behind the goal of the last tick.
  [[nodiscard]] double lag_m(std::size_t body) const;
  [[nodiscard]] double lag_rad(std::size_t body) const;
  /// Force of its spring on its owner, W axes.
  [[nodiscard]] Vector spring_n(std::size_t body) const;
  /// Force of its contacts on it, W axes.
  [[nodiscard]] Vector contact_n(std::size_t body) const;
  [[nodiscard]] BodyPlace place(std::size_t body) const;
  /// Largest change of the spring's force of the first body from one tick to the next.
  [[nodiscard]] double largest_step_n() const { return largest_step_n_; }
  void forget_steps() { largest_step_n_ = 0; }

  /// How deep bodies have been in each other, at ends of ticks or on the way of a step: bounded by
  /// what the law may leave.
  [[nodiscard]] StudyFigure depth_figure() const;

 private:
  [[nodiscard]] std::vector<WidePose> wide_poses(std::span<const GripPose> poses) const;
  void judge_tick();

  CompiledBodies compiled_;
  BodiesSession session_;
  BodiesJudge judge_;
  std::vector<GripPose> goals_;
  std::vector<WidePose> before_;
  Wide least_gap_m_ = 0;
  Vector last_n_ = Vector::Zero();
  double largest_step_n_ = 0;
};

}  // namespace haptic::sim
