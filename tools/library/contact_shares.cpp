// SPDX-License-Identifier: Apache-2.0
#include "tools/library/contact_shares.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace haptic::tools {
namespace {

using Six = Eigen::Matrix<double, 6, 1>;
using SixBySix = Eigen::Matrix<double, 6, 6>;
using Three = Eigen::Vector3d;

constexpr std::size_t kPointsOfPlane = 8;  ///< corners of a rounder region are thinned out
constexpr std::size_t kMostPoints = kMaxFeltPlanes * kPointsOfPlane;
constexpr std::size_t kSidesOfCone = 8;  ///< a pyramid within the cone of friction
constexpr double kSmall = 1e-7;          ///< weight of the shares beside what is left of the wrench
constexpr int kMostRounds = 48;

struct Point {
  Three at_w, normal_w;
  double friction = 0;
  std::uint32_t body = 0, situation = 0;
};
struct Points {
  std::array<Point, kMostPoints> of;
  std::size_t count = 0;
};

Three three(const Vec3& v) noexcept { return v.cast<double>(); }

/// Corners of the contact region of a plane, evenly thinned out.
void add_plane(const FeltPlane& plane, const ContactGeometry& geometry, const SceneView& scene,
               Points& points) noexcept {
  const std::size_t corners = geometry.polygon_w.size();
  const std::size_t kept = std::min(corners, kPointsOfPlane);
  const BodyRecord& body = scene.bodies()[geometry.body_b];
  for (std::size_t k = 0; k < kept; ++k) {
    const auto corner = static_cast<std::uint32_t>(k * corners / kept);
    Point& point = points.of[points.count++];
    point.at_w = three(geometry.x0_w + geometry.polygon_w[corner]);
    point.normal_w = three(plane.normal_w);
    point.friction = std::max(body.friction, body.friction_static);
    point.body = geometry.body_b;
    point.situation = static_cast<std::uint32_t>(geometry.situation);
  }
}

Points points_of(HapticCore& core, const SceneView& scene) noexcept {
  Points points;
  std::array<Vec3, 64> corners;
  ContactGeometry geometry;
  const FeltContact& felt = core.felt_contact();
  for (std::uint32_t k = 0; k < felt.plane_count; ++k) {
    const FeltPlane& plane = felt.planes[k];
    if (plane.pair >= core.pair_count()) continue;  // a moving part's
    geometry.polygon_w = BoundedList<Vec3>(corners);
    core.contact_geometry(plane.pair, geometry);
    // It describes one plane of a pair with two: the other has no region that is known.
    constexpr double kSamePlane = 1 - 1e-6;
    if (three(geometry.normal_w).dot(three(plane.normal_w)) < kSamePlane) continue;
    add_plane(plane, geometry, scene, points);
  }
  return points;
}

/// Directions in which a point pushes: the normal, or the sides of its cone.
std::size_t directions_of(const Point& point,
                          std::array<Three, kSidesOfCone>& directions) noexcept {
  if (!(point.friction > 0)) {
    directions[0] = point.normal_w;
    return 1;
  }
  const Three e1 = point.normal_w.unitOrthogonal(), e2 = point.normal_w.cross(e1);
  for (std::size_t k = 0; k < kSidesOfCone; ++k) {
    const double angle = 2 * 3.14159265358979323846 * static_cast<double>(k) / kSidesOfCone;
    directions[k] = point.normal_w + point.friction * (std::cos(angle) * e1 + std::sin(angle) * e2);
  }
  return kSidesOfCone;
}

/// Columns a_i of min 1/2 |w - sum s_i a_i|^2 + kSmall/2 |s|^2, s_i >= 0.
struct Columns {
  std::array<Six, kMostPoints * kSidesOfCone> a;
  std::array<std::uint32_t, kMostPoints * kSidesOfCone> point;
  std::size_t count = 0;
};

/// The rest, r: s_i = max(0, a_i . r) / kSmall, and r + sum s_i a_i = w. The zero of a gradient
/// that is piecewise linear: Newton's steps, shortened where the sum that they lower would rise.
Six rest_of(const Columns& columns, const Six& w) noexcept {
  const auto cost = [&](const Six& r) {
    double sum = 0.5 * r.squaredNorm() - w.dot(r);
    for (std::size_t i = 0; i < columns.count; ++i) {
      const double push = std::max(0.0, columns.a[i].dot(r));
      sum += push * push / (2 * kSmall);
    }
    return sum;
  };
  Six r = w;
  double at = cost(r);
  for (int round = 0; round < kMostRounds; ++round) {
    Six gradient = r - w;
    SixBySix slope = SixBySix::Identity();
    for (std::size_t i = 0; i < columns.count; ++i) {
      const Six& a = columns.a[i];
      const double push = a.dot(r);
      if (push <= 0) continue;
      gradient += push / kSmall * a;
      slope += 1 / kSmall * a * a.transpose();
    }
    const Six step = -slope.ldlt().solve(gradient);
    if (!(step.norm() > 1e-14 * (1 + w.norm()))) break;
    double share = 1;
    Six next = r + step;
    double there = cost(next);
    for (int half = 0; half < 20 && !(there <= at); ++half) {
      share /= 2;
      next = r + share * step;
      there = cost(next);
    }
    if (!(there <= at)) break;
    r = next;
    at = there;
  }
  return r;
}

}  // namespace

std::size_t write_contacts(HapticCore& core, const SceneView& scene, const FeltTick& tick,
                           std::span<haptic_contact> contacts, Wrench& rest) noexcept {
  const Points points = points_of(core, scene);
  const double* const reference = scene.bodies()[0].reference_m;
  const Three grip_w =
      three(tick.felt_wa.p_wa) +
      tick.felt_wa.q_wa.cast<double>() * Three(reference[0], reference[1], reference[2]);
  double length_m = 1e-3;  // of torques against forces
  for (std::size_t k = 0; k < points.count; ++k)
    length_m = std::max(length_m, (points.of[k].at_w - grip_w).norm());
  Columns columns;
  std::array<Three, kMostPoints * kSidesOfCone> pushes;
  for (std::size_t k = 0; k < points.count; ++k) {
    std::array<Three, kSidesOfCone> directions;
    const std::size_t count = directions_of(points.of[k], directions);
    for (std::size_t j = 0; j < count; ++j) {
      Six& a = columns.a[columns.count];
      a.head<3>() = directions[j];
      a.tail<3>() = (points.of[k].at_w - grip_w).cross(directions[j]) / length_m;
      pushes[columns.count] = directions[j];
      columns.point[columns.count++] = static_cast<std::uint32_t>(k);
    }
  }
  Six w;
  w.head<3>() = three(tick.wrench_w.force_w);
  w.tail<3>() = three(tick.wrench_w.torque_w) / length_m;
  const Six left = rest_of(columns, w);
  std::array<Three, kMostPoints> forces;
  forces.fill(Three::Zero());
  for (std::size_t i = 0; i < columns.count; ++i)
    forces[columns.point[i]] += std::max(0.0, columns.a[i].dot(left)) / kSmall * pushes[i];
  // From the contacts as they are written, which the caller adds up.
  Three force_w = three(tick.wrench_w.force_w), torque_w = three(tick.wrench_w.torque_w);
  for (std::size_t k = 0; k < points.count; ++k) {
    force_w -= forces[k];
    torque_w -= (points.of[k].at_w - grip_w).cross(forces[k]);
    if (k >= contacts.size()) continue;
    haptic_contact& to = contacts[k];
    to = haptic_contact{};
    for (int i = 0; i < 3; ++i) {
      to.point_m[i] = points.of[k].at_w[i];
      to.normal[i] = points.of[k].normal_w[i];
      to.force_n[i] = forces[k][i];
    }
    to.part = points.of[k].body;
    to.situation = points.of[k].situation;
  }
  rest = {force_w.cast<Real>(), torque_w.cast<Real>()};
  return points.count;
}

void turn_into(const Pose& frame_wf, std::span<haptic_contact> contacts, Wrench& rest) noexcept {
  const Eigen::Quaterniond q = frame_wf.q_wa.cast<double>();
  for (haptic_contact& contact : contacts) {
    Eigen::Map<Three> point(contact.point_m), normal(contact.normal), force(contact.force_n);
    point = three(frame_wf.p_wa) + q * Three(point);
    normal = q * Three(normal);
    force = q * Three(force);
  }
  rest = {frame_wf.q_wa * rest.force_w, frame_wf.q_wa * rest.torque_w};
}

}  // namespace haptic::tools
