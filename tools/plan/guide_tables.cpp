// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/guide_tables.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace haptic::tools {
namespace {

using Vector = Eigen::Vector3d;

/// The pull fades over the last of the way, in lengths of a turn of 1 rad: there it is a spring, of
/// pull_n over so much.
constexpr double kNearGoal = 0.1;
/// Planes of contact whose normals differ by less are one.
constexpr double kSamePlane = 1.0e-3;

/// A plane in which pieces touch at a station.
struct TouchPlane {
  Vector normal = Vector::Zero();
  double offset_m = 0;
  TouchKind kind = TouchKind::kEdges;
};

/// Extreme of a piece at a pose, or where its body stands: the least of normal.x, and how many
/// vertices are no farther from it than `near_m`.
struct Extreme {
  double least = 0;
  int count = 0;
};
Extreme extreme_of(const PieceView& piece, const Eigen::Matrix3d& r, const Vector& x0,
                   const Vector& normal, double near_m) {
  std::vector<double> heights;
  for (std::uint32_t v = 0; v < piece.vertex_count; ++v) {
    heights.push_back(normal.dot(x0 + r * piece.vertex(v).cast<double>()));
  }
  const double least = *std::min_element(heights.begin(), heights.end());
  return {least, static_cast<int>(std::count_if(heights.begin(), heights.end(),
                                                [&](double h) { return h <= least + near_m; }))};
}

TouchKind kind_of(int of_a, int of_b) {
  const int few = std::min(of_a, of_b), many = std::max(of_a, of_b);
  if (few >= 3) return TouchKind::kFaces;
  if (many < 3) return TouchKind::kEdges;
  return few == 2 ? TouchKind::kEdgeOnFace : TouchKind::kVertexOnFace;
}

/// The direction of a plane at an orientation of the part.
Vector normal_at(const Eigen::Matrix3d& r, const PlanDirection& direction) {
  const Vector of_b(direction.of_b[0], direction.of_b[1], direction.of_b[2]);
  if (direction.kind == 'B') return of_b.normalized();
  const Vector of_a = r * Vector(direction.of_a[0], direction.of_a[1], direction.of_a[2]);
  return (direction.kind == 'A' ? of_a : Vector(of_a.cross(of_b))).normalized();
}

/// The planes in which pieces touch at a station: of the plan's planes before and after, the one
/// that leaves each pair the largest distance.
std::vector<TouchPlane> touch_planes(const SceneView& scene, const Plan& plan,
                                     const PlanStation& station, PlanSweep& sweep) {
  const PlanPose& pose = plan.poses[station.pose];
  const Eigen::Matrix3d r =
      Eigen::Quaterniond(pose.q_wxyz[0], pose.q_wxyz[1], pose.q_wxyz[2], pose.q_wxyz[3])
          .normalized()
          .toRotationMatrix();
  const Vector x0(pose.x0_m[0], pose.x0_m[1], pose.x0_m[2]);
  std::vector<PlanWitness> near;
  if (station.pose > 0) near = sweep.at(station.pose - 1);
  if (station.pose < plan.steps()) {
    const std::vector<PlanWitness>& after = sweep.at(station.pose);
    near.insert(near.end(), after.begin(), after.end());
  }
  std::vector<TouchPlane> planes;
  for (const PlanContact& contact : station.contacts) {
    const PieceView a = scene.piece(contact.piece_a), b = scene.piece(contact.piece_b);
    const Vector origin_b(scene.bodies()[b.record->body].reference_m);
    double best = -std::numeric_limits<double>::infinity();
    TouchPlane plane;
    for (const PlanWitness& witness : near) {
      if (witness.piece_a != contact.piece_a || witness.piece_b != contact.piece_b) continue;
      const Vector n = normal_at(r, witness.direction);
      const Extreme of_a = extreme_of(a, r, x0, n, plan.contact_m);
      const Extreme of_b = extreme_of(b, Eigen::Matrix3d::Identity(), origin_b, -n, plan.contact_m);
      const double gap = of_a.least + of_b.least;
      if (gap <= best) continue;
      best = gap;
      plane = {n, -of_b.least, kind_of(of_a.count, of_b.count)};
    }
    const auto same = std::find_if(planes.begin(), planes.end(), [&](const TouchPlane& other) {
      return (other.normal - plane.normal).norm() < kSamePlane &&
             std::abs(other.offset_m - plane.offset_m) < plan.contact_m;
    });
    if (same == planes.end()) {
      planes.push_back(plane);
    } else {
      same->kind = std::min(same->kind, plane.kind);
    }
  }
  return planes;
}

GuideStation station_of(const SceneView& scene, const Plan& plan, const PlanStation& from,
                        PlanSweep& sweep) {
  const PlanPose& pose = plan.poses[from.pose];
  GuideStation station{};
  double square = 0;
  for (const double q : pose.q_wxyz) square += q * q;
  for (std::size_t k = 0; k < 3; ++k) {
    station.x0_m[k] = static_cast<Real>(pose.x0_m[k]);
    station.q_wa_xyzw[k] = static_cast<Real>(pose.q_wxyz[k + 1] / std::sqrt(square));
  }
  station.q_wa_xyzw[3] = static_cast<Real>(pose.q_wxyz[0] / std::sqrt(square));
  station.cost_m = static_cast<Real>(from.cost_to_go_m);
  station.clearance_m = static_cast<Real>(std::max(from.clearance_m, 0.0));
  station.contacts = static_cast<std::uint32_t>(from.contacts.size());
  for (const TouchPlane& plane : touch_planes(scene, plan, from, sweep)) {
    std::uint8_t& count = station.touching[static_cast<std::size_t>(plane.kind)];
    if (count < std::numeric_limits<std::uint8_t>::max()) ++count;
  }
  return station;
}

/// The way to the next station, from the numbers as they are stored.
void add_way(const GuideStation& next, double turn_m, GuideStation& station) {
  const auto at = [](const Real* v, int k) { return static_cast<double>(v[k]); };
  const Real *const q = station.q_wa_xyzw, *const r = next.q_wa_xyzw;
  double cosine = 0, square = 0;
  for (int k = 0; k < 4; ++k) cosine += at(q, k) * at(r, k);
  const double twice = cosine < 0 ? -2 * turn_m : 2 * turn_m;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const double cross = at(r, i) * at(q, j) - at(r, j) * at(q, i);
    const double way = at(next.x0_m, k) - at(station.x0_m, k);
    const double turn = twice * (at(r, k) * at(q, 3) - at(q, k) * at(r, 3) - cross);
    station.way_m[k] = static_cast<Real>(way);
    station.turn_way_m[k] = static_cast<Real>(turn);
    square += way * way + turn * turn;
  }
  station.per_square = static_cast<Real>(1 / square);
}

}  // namespace

GuideTables guide_tables(const SceneView& scene, const Plan& plan, const GuideGains& gains) {
  GuideTables tables;
  GuideRecord& g = tables.record;
  g.plan_geometry = plan.geometry;
  g.turn_m = plan.length_m;
  g.pull_n = gains.pull_n;
  g.hold_n = gains.hold_n;
  g.ramp_s = gains.ramp_s;
  g.let_go_m = gains.let_go_m > 0 ? gains.let_go_m : kDefaultLetGo * plan.length_m;
  g.near_goal_m = kNearGoal * plan.length_m;
  // The difference of its potential between the farthest place and the goal.
  g.energy_j = g.pull_n * plan.stations.front().cost_to_go_m + g.hold_n * g.let_go_m;
  PlanSweep sweep(plan);
  for (const PlanStation& station : plan.stations) {
    tables.stations.push_back(station_of(scene, plan, station, sweep));
  }
  for (std::size_t k = 0; k + 1 < tables.stations.size(); ++k) {
    add_way(tables.stations[k + 1], g.turn_m, tables.stations[k]);
  }
  return tables;
}

}  // namespace haptic::tools
