// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/falcon_kinematics.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace haptic::hal {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr double kLongestStep_m = 0.020;
constexpr int kMostHalvings = 8;
/// Below this share the rows of the Jacobian are taken to lie in a plane.
constexpr double kLeastShare = 1.0e-6;

double rad_per_count(const FalconGeometry& g) noexcept {
  return 2.0 * std::numbers::pi / g.counts_per_turn * g.motor_shaft_m / g.pulley_m;
}

}  // namespace

/// One leg at a position: what its angle and its row of the Jacobian are made of.
struct FalconKinematics::Leg {
  double u_m, v_m, w_m;  ///< with c and f added: the shin's far end in the leg's frame
  double out_m;          ///< b sin t3: how much of the parallelogram is in the plane
  double length_m;       ///< L
  double t1_rad;
};

FalconKinematics::FalconKinematics(const FalconGeometry& geometry) noexcept : geometry_(geometry) {
  for (std::size_t i = 0; i < 3; ++i) {
    cos_phi_[i] = std::cos(geometry.phi_deg[i] * kRadPerDeg);
    sin_phi_[i] = std::sin(geometry.phi_deg[i] * kRadPerDeg);
  }
}

FalconAngles FalconKinematics::angles_of(const std::array<std::int16_t, 3>& counts) const noexcept {
  FalconAngles angles{};
  for (std::size_t i = 0; i < 3; ++i) {
    angles[i] = geometry_.zero_angle_deg * kRadPerDeg + counts[i] * rad_per_count(geometry_);
  }
  return angles;
}

std::array<std::int16_t, 3> FalconKinematics::counts_of(const FalconAngles& angles) const noexcept {
  std::array<std::int16_t, 3> counts{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double turns = (angles[i] - geometry_.zero_angle_deg * kRadPerDeg);
    counts[i] = static_cast<std::int16_t>(
        std::clamp(std::nearbyint(turns / rad_per_count(geometry_)), -32768.0, 32767.0));
  }
  return counts;
}

bool FalconKinematics::leg_at(std::size_t i, const Column3& position_f, Leg& leg) const noexcept {
  const FalconGeometry& g = geometry_;
  leg.u_m = position_f.x() * cos_phi_[i] + position_f.y() * sin_phi_[i] - g.r_m + g.c_m;
  leg.v_m = -position_f.x() * sin_phi_[i] + position_f.y() * cos_phi_[i] - g.s_m + g.f_m;
  leg.w_m = position_f.z();
  const double out_square = g.b_m * g.b_m - leg.v_m * leg.v_m;
  if (!(out_square > 0.0)) return false;
  leg.out_m = std::sqrt(out_square);
  leg.length_m = g.d_m + g.e_m + leg.out_m;
  // u cos t1 + w sin t1 = k has two solutions; the knee of this arm is on the outer side, which is
  // the smaller angle.
  const double far_square = leg.u_m * leg.u_m + leg.w_m * leg.w_m;
  const double k = (far_square + g.a_m * g.a_m - leg.length_m * leg.length_m) / (2.0 * g.a_m);
  const double rest = far_square - k * k;
  if (!(rest >= 0.0)) return false;
  leg.t1_rad = std::atan2(leg.w_m, leg.u_m) - std::atan2(std::sqrt(rest), k);
  return true;
}

bool FalconKinematics::angles_at(const Column3& position_f, FalconAngles& angles) const noexcept {
  FalconAngles found{};
  for (std::size_t i = 0; i < 3; ++i) {
    Leg leg;
    if (!leg_at(i, position_f, leg)) return false;
    found[i] = leg.t1_rad;
  }
  angles = found;
  return true;
}

bool FalconKinematics::jacobian_at(const Column3& position_f, Square3& jacobian) const noexcept {
  Square3 rows;
  for (std::size_t i = 0; i < 3; ++i) {
    Leg leg;
    if (!leg_at(i, position_f, leg)) return false;
    // g(t1, u, v, w) = |(u, w) - a (cos t1, sin t1)|^2 - L(v)^2 = 0, differentiated and halved;
    // dL/dv = -v / out.
    const double cos_t1 = std::cos(leg.t1_rad);
    const double sin_t1 = std::sin(leg.t1_rad);
    const double by_t1 = geometry_.a_m * (leg.u_m * sin_t1 - leg.w_m * cos_t1);
    const double by_u = leg.u_m - geometry_.a_m * cos_t1;
    const double by_v = leg.length_m * leg.v_m / leg.out_m;
    const double by_w = leg.w_m - geometry_.a_m * sin_t1;
    // |by_t1| is a times the distance of the shin's line from the motor's axis: none when
    // stretched.
    if (!(std::abs(by_t1) > 1.0e-4 * geometry_.a_m * leg.length_m)) return false;
    const auto row = static_cast<Eigen::Index>(i);
    rows(row, 0) = -(by_u * cos_phi_[i] - by_v * sin_phi_[i]) / by_t1;
    rows(row, 1) = -(by_u * sin_phi_[i] + by_v * cos_phi_[i]) / by_t1;
    rows(row, 2) = -by_w / by_t1;
  }
  jacobian = rows;
  return true;
}

bool FalconKinematics::position_at(const FalconAngles& angles, Column3& position_f) const noexcept {
  const Column3 middle(0.0, 0.0, kFalconCentre_m);
  Column3 p = position_f;
  FalconAngles now{};
  if (!is_finite(p) || !angles_at(p, now)) return false;
  for (int step = 0; step <= kMaxSteps; ++step) {
    const Column3 error(angles[0] - now[0], angles[1] - now[1], angles[2] - now[2]);
    if (!is_finite(error)) return false;
    if (error.cwiseAbs().maxCoeff() <= kResidual_rad) {
      if (!((p - middle).norm() <= kFalconReach_m)) return false;
      position_f = p;
      return true;
    }
    Square3 jacobian;
    Column3 move = Column3::Zero();
    if (!jacobian_at(p, jacobian) || !solve3(jacobian, error, kLeastShare, move)) return false;
    const double length_m = move.norm();
    if (length_m > kLongestStep_m) move *= kLongestStep_m / length_m;
    bool reached = false;
    for (int halving = 0; halving <= kMostHalvings && !reached; ++halving, move *= 0.5) {
      const Column3 next = p + move;
      reached = angles_at(next, now);
      if (reached) p = next;
    }
    if (!reached) return false;
  }
  return false;
}

bool FalconKinematics::torques_for(const Square3& jacobian, const Column3& force_f,
                                   Column3& torques_nm) noexcept {
  return solve3(jacobian.transpose(), force_f, kLeastShare, torques_nm);
}

Column3 FalconKinematics::force_of(const Square3& jacobian, const Column3& torques_nm) noexcept {
  return jacobian.transpose() * torques_nm;
}

}  // namespace haptic::hal
