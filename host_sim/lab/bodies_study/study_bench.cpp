// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/bodies_study/study_bench.hpp"

#include <algorithm>
#include <utility>

namespace haptic::sim {
namespace {

std::vector<GripPose> grip_poses(const std::vector<BodyPlace>& places) {
  std::vector<GripPose> poses;
  for (const BodyPlace& place : places) poses.push_back(grip_pose_at(place.p, place.q));
  return poses;
}

constexpr double kNanometres = 1e9;

}  // namespace

FuzzBody study_body(const std::string& name, BodyRole role, std::vector<Solid> pieces,
                    const Vector& start, double far_m) {
  FuzzBody body;
  body.name = name;
  body.role = role;
  body.pieces = std::move(pieces);
  body.start = start;
  body.range.home = start;
  body.range.reach_m = Vector(far_m, 0, 0);
  return body;
}

std::vector<Solid> one_box(double half_x, double half_y, double half_z) {
  return {centred_box("box", half_x, half_y, half_z)};
}

Solid study_table() { return box_solid("table", {-0.15, -0.15, -0.02}, {0.15, 0.15, 0}); }

Rotation turn_about(const Vector& axis, double angle_rad) {
  return Rotation(Eigen::AngleAxisd(angle_rad, axis));
}

StudyBench::StudyBench(BodiesScene scene, double friction, const std::vector<BodyPlace>& starts,
                       std::optional<BodiesFault> fault, std::uint32_t work_units)
    : compiled_(compiled_bodies(std::move(scene), friction)),
      session_(compiled_, work_units, fault),
      judge_(compiled_),
      goals_(grip_poses(starts)),
      before_(wide_poses(goals_)) {
  session_.begin(goals_);
}

std::vector<WidePose> StudyBench::wide_poses(std::span<const GripPose> poses) const {
  std::vector<WidePose> wide;
  for (const GripPose& pose : poses) wide.push_back(wide_pose(pose_of(pose)));
  return wide;
}

BodiesTick StudyBench::tick(const std::vector<BodyPlace>& goals) {
  goals_ = grip_poses(goals);
  const BodiesTick told = session_.tick(goals_);
  judge_tick();
  const Vector force = spring_n(0);
  largest_step_n_ = std::max(largest_step_n_, (force - last_n_).norm());
  last_n_ = force;
  session_.release_anchors();
  return told;
}

void StudyBench::judge_tick() {
  // Deep ways take long to judge, and one is enough.
  if (least_gap_m_ < -judge_.allowed_depth_m()) return;
  const BodyLaw& law = session_.law();
  for (std::uint32_t k = 0; k < law.steps_of_tick(); ++k) {
    std::vector<WidePose> after = wide_poses(law.after_step(k));
    least_gap_m_ = std::min(least_gap_m_, judge_.way_gap(before_, after).gap_m);
    before_ = std::move(after);
  }
  std::vector<GripPose> poses;
  for (std::uint32_t k = 0; k < law.body_count(); ++k) poses.push_back(law.pose(k));
  before_ = wide_poses(poses);
  least_gap_m_ = std::min(least_gap_m_, judge_.end_gap(before_, least_gap_m_).gap_m);
}

double StudyBench::lag_m(std::size_t body) const {
  const GripPose& pose = session_.law().pose(static_cast<std::uint32_t>(body));
  return static_cast<double>(pose_error(goals_[body], pose).translation_m.norm());
}

double StudyBench::lag_rad(std::size_t body) const {
  const GripPose& pose = session_.law().pose(static_cast<std::uint32_t>(body));
  return static_cast<double>(pose_error(goals_[body], pose).rotation_rad.norm());
}

Vector StudyBench::spring_n(std::size_t body) const {
  return session_.law().spring_w(static_cast<std::uint32_t>(body)).force_w.cast<double>();
}

Vector StudyBench::contact_n(std::size_t body) const {
  return session_.law().contact_w(static_cast<std::uint32_t>(body)).force_w.cast<double>();
}

BodyPlace StudyBench::place(std::size_t body) const {
  const Pose pose = pose_of(session_.law().pose(static_cast<std::uint32_t>(body)));
  return {pose.p_wa.cast<double>(), pose.q_wa.cast<double>().normalized()};
}

StudyFigure StudyBench::depth_figure() const {
  return {"depth_nm", "deepest overlap, nm",
          std::max(0.0, -kNanometres * static_cast<double>(least_gap_m_)), -StudyFigure::kNone,
          kNanometres * static_cast<double>(judge_.allowed_depth_m())};
}

}  // namespace haptic::sim
