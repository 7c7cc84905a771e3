// SPDX-License-Identifier: Apache-2.0
#include "tests/support/cut_bodies.hpp"

#include <algorithm>
#include <cmath>

#include "tests/support/pruned_scenes.hpp"

namespace haptic::test {
namespace {

bool colliding(const LoadedScene& scene) {
  for (std::uint32_t i = 0; i < scene.core->pair_count(); ++i) {
    if (scene.core->pair_report(i).verdict != Verdict::kSeparated) return true;
  }
  return false;
}

double norm(const Vec3& v) { return static_cast<double>(v.norm()); }

}  // namespace

tools::Body block() { return box({-0.03, -0.02, -0.02}, {0.03, 0.02, 0.02}); }
tools::Body plate() { return box({-0.1, -0.1, -0.03}, {0.1, 0.1, 0}); }

std::vector<Division> plate_divisions() {
  const Point lo = {-0.1, -0.1, -0.03}, hi = {0.1, 0.1, 0};
  return {{"two", cut_box(lo, hi, {0.003}, {{}, {}})},
          {"four", cut_box(lo, hi, {0.003}, {{-0.004}, {-0.004}})},
          {"T", cut_box(lo, hi, {0.003}, {{}, {-0.004}})}};
}

std::vector<Division> block_divisions() {
  const Point lo = {-0.03, -0.02, -0.02}, hi = {0.03, 0.02, 0.02};
  return {{"two", cut_box(lo, hi, {0.003}, {{}, {}})},
          {"four", cut_box(lo, hi, {0.003}, {{-0.004}, {-0.004}})},
          {"T", cut_box(lo, hi, {0.003}, {{}, {-0.004}})}};
}

tools::SceneDescription cut_scene(const tools::Body* cut_block, const tools::Body* cut_plate,
                                  LawId law) {
  tools::SceneDescription d = scene_of(cut_block != nullptr ? *cut_block : block(),
                                       {cut_plate != nullptr ? *cut_plate : plate()});
  d.parameters.law = law;
  d.parameters.work_units = 1000;  // the same for every division
  // A rotation error counts like the displacement that it gives at one and a half radii.
  const double length_m = 1.5 * 0.0412;
  d.parameters.coupling.k_r_nm_per_rad = d.parameters.k_f_n_per_m * length_m * length_m;
  if (cut_block == nullptr && cut_plate == nullptr) return d;
  const LoadedScene all(d);
  d.marks = all_marks(all.view);
  if (cut_block != nullptr) mark_cuts(all.view, 0, block(), d.marks);
  if (cut_plate != nullptr) mark_cuts(all.view, 1, plate(), d.marks);
  return d;
}

std::array<double, 4> turned(double tilt_x, double tilt_y, double yaw) {
  const Eigen::Quaternion<double> q =
      Eigen::Quaternion<double>(Eigen::AngleAxis<double>(yaw, Eigen::Vector3d::UnitZ())) *
      Eigen::Quaternion<double>(Eigen::AngleAxis<double>(tilt_x, Eigen::Vector3d::UnitX())) *
      Eigen::Quaternion<double>(Eigen::AngleAxis<double>(tilt_y, Eigen::Vector3d::UnitY()));
  return {q.w(), q.x(), q.y(), q.z()};
}

std::array<double, 4> Slide::rotation(int tick) const {
  const double s = 0.002 * tick;
  return turned(largest_tilt_rad * std::sin(1.7 * s), 0.6 * largest_tilt_rad * std::cos(2.3 * s),
                0.4 * s);
}

Point Slide::position(int tick) const {
  const double s = 0.002 * tick;
  return {0.04 * std::sin(s), 0.04 * std::cos(1.3 * s),
          0.02 - deepest_m + 0.0004 * (1 + std::sin(5 * s))};
}

SlideDifference compare(LoadedScene& cut, LoadedScene& uncut, const Slide& slide) {
  SlideDifference found;
  for (int t = 0; t < Slide::kTicks; ++t) {
    const StepResult a = cut.step(slide.position(t), slide.rotation(t));
    const StepResult b = uncut.step(slide.position(t), slide.rotation(t));
    const double force = norm(b.wrench_w.force_w), scale = std::max(force, 1e-3);
    const double force_n = norm(a.wrench_w.force_w - b.wrench_w.force_w);
    const double torque_nm = norm(a.wrench_w.torque_w - b.wrench_w.torque_w);
    found.force = std::max(found.force, force_n / scale);
    found.torque = std::max(found.torque, torque_nm / scale);
    found.force_n = std::max(found.force_n, force_n);
    found.torque_nm = std::max(found.torque_nm, torque_nm);
    found.largest_n = std::max(found.largest_n, force);
    found.verdicts += colliding(cut) != colliding(uncut) ? 1 : 0;
    found.contacts += force > 0 ? 1 : 0;
    found.ticks += 1;
  }
  return found;
}

}  // namespace haptic::test
