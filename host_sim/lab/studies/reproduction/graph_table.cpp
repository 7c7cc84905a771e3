// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/reproduction/graph_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host_sim/oracle/node_set.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/shapes/shapes.hpp"
#include "tools/c_space/c_obstacle.hpp"

namespace haptic::sim {

using tools::FlatPair;
using tools::kApplicable_m;
using tools::place_moving;
using tools::PlacedMoving;
using tools::Point;
using tools::vector_of;

namespace {

// Seeded poses of a pair for counts over many situations.

struct SweepPose {
  Vector x = Vector::Zero();  ///< grip point = origin of A in W [m]
  Rotation q = Rotation::Identity();
};

class PoseSweep {
 public:
  PoseSweep(const SceneView& view, std::uint64_t seed);

  /// Random orientation; x at `gap_m` over a random point of the C-obstacle's boundary along the
  /// normal of the C-face hit (negative: inside).
  [[nodiscard]] SweepPose generic(double gap_m);
  /// Face of A on a face of B, random yaw and offset, tilted afterwards by `tilt_rad` about a
  /// random axis; `depth_m` inside.
  [[nodiscard]] SweepPose face_face(double depth_m, double tilt_rad);
  /// An edge of A on a face of B, or a face of A on an edge of B, in turn.
  [[nodiscard]] SweepPose edge_face(double depth_m, double tilt_rad);

 private:
  [[nodiscard]] Vector point_of_face(const PieceView& piece, std::uint32_t face);
  [[nodiscard]] Rotation turned(const Vector& from, const Vector& to);
  [[nodiscard]] SweepPose placed(const Rotation& q, const Vector& point_a, const Vector& point_b,
                                 const Vector& normal, double depth_m, double tilt_rad);

  const SceneView& view_;
  FlatPair flat_;
  Seeded random_;
  Vector reference_b_;
  bool edge_of_b_ = false;
};

Vector centre_of(const PieceView& piece) {
  const double* c = piece.record->centre_m;
  return {c[0], c[1], c[2]};
}

Vector normal_of(const PieceView& piece, std::uint32_t face) {
  return piece.face_normal(face).cast<double>();
}

PoseSweep::PoseSweep(const SceneView& view, std::uint64_t seed)
    : view_(view), flat_(view, 0), random_(seed) {
  const double* r = view.bodies()[flat_.view().b.record->body].reference_m;
  reference_b_ = Vector(r[0], r[1], r[2]);
}

SweepPose PoseSweep::generic(double gap_m) {
  SweepPose pose;
  pose.q = random_.rotation();
  const Vector centre =
      reference_b_ + centre_of(flat_.view().b) - pose.q * centre_of(flat_.view().a);
  const Vector direction = random_.direction();
  flat_.place(place_moving(view_, pose_at(centre, pose.q)));
  double nearest = std::numeric_limits<double>::infinity();
  Vector normal = direction;
  for (std::uint32_t node = 0; node < flat_.node_count(); ++node) {
    const FlatPair::Value value = flat_.evaluate(node);
    if (value.violation_m > kApplicable_m) continue;
    Point n{}, app{};
    flat_.contact(node, n, app);
    const double slope = vector_of(n).dot(direction);
    if (slope <= 0 || -value.depth_m / slope >= nearest) continue;
    nearest = -value.depth_m / slope;
    normal = vector_of(n);
  }
  pose.x = centre + nearest * direction + gap_m * normal;
  return pose;
}

Vector PoseSweep::point_of_face(const PieceView& piece, std::uint32_t face) {
  Vector sum = Vector::Zero();
  double weights = 0;
  for (const std::uint16_t v : piece.face_vertices(face)) {
    const double w = random_.uniform(0.0, 1.0);
    sum += w * piece.vertex(v).cast<double>();
    weights += w;
  }
  return sum / weights;
}

Rotation PoseSweep::turned(const Vector& from, const Vector& to) {
  const Rotation yaw(Eigen::AngleAxisd(random_.uniform(0.0, 6.283185307179586), to));
  return yaw * turn_between(from, to);
}

SweepPose PoseSweep::placed(const Rotation& q, const Vector& point_a, const Vector& point_b,
                            const Vector& normal, double depth_m, double tilt_rad) {
  SweepPose pose;
  pose.q = q;
  if (tilt_rad != 0) pose.q = Rotation(Eigen::AngleAxisd(tilt_rad, random_.direction())) * q;
  pose.x = reference_b_ + point_b - pose.q * point_a - depth_m * normal;
  return pose;
}

SweepPose PoseSweep::face_face(double depth_m, double tilt_rad) {
  const PieceView &a = flat_.view().a, &b = flat_.view().b;
  // One draw per statement: the order of arguments is the compiler's.
  const std::uint32_t face_a = random_.below(a.face_count);
  const std::uint32_t face_b = random_.below(b.face_count);
  const Vector n = normal_of(b, face_b);
  const Rotation q = turned(normal_of(a, face_a), -n);
  const Vector on_a = point_of_face(a, face_a);
  const Vector on_b = point_of_face(b, face_b);
  return placed(q, on_a, on_b, n, depth_m, tilt_rad);
}

SweepPose PoseSweep::edge_face(double depth_m, double tilt_rad) {
  const PieceView &a = flat_.view().a, &b = flat_.view().b;
  edge_of_b_ = !edge_of_b_;
  // A normal in the wedge of the edge's two faces makes the edge the extreme of its body.
  const PieceView& edged = edge_of_b_ ? b : a;
  const EdgeRecord& edge = edged.edges[random_.below(edged.edge_count)];
  const double share = random_.uniform(0.1, 0.9);
  const Vector wedge =
      ((1 - share) * normal_of(edged, edge.face[0]) + share * normal_of(edged, edge.face[1]))
          .normalized();
  const double along = random_.uniform(0.0, 1.0);
  const Vector on_edge = (1 - along) * edged.vertex(edge.vertex[0]).cast<double>() +
                         along * edged.vertex(edge.vertex[1]).cast<double>();
  if (edge_of_b_) {
    const std::uint32_t face = random_.below(a.face_count);
    const Rotation q = turned(normal_of(a, face), -wedge);
    const Vector on_face = point_of_face(a, face);
    return placed(q, on_face, on_edge, wedge, depth_m, tilt_rad);
  }
  const std::uint32_t face = random_.below(b.face_count);
  const Vector n = normal_of(b, face);
  const Rotation q = turned(wedge, -n);
  const Vector on_face = point_of_face(b, face);
  return placed(q, on_edge, on_face, n, depth_m, tilt_rad);
}

constexpr double kGraphEpsilon_m = 1e-4;
constexpr const char* kTypeNames[3] = {"A", "B", "C"};

std::vector<std::byte> paper_scene() {
  const Solid box = paper_box();
  return scene_of(paper_tetrahedron(), {&box, 1}, 1000.0, kGraphEpsilon_m);
}

/// Two ticks at one pose: the first searches all nodes, the second tracks from its near set.
StepResult settle(CoreSession& session, const SweepPose& pose) {
  StepInput input;
  input.report_goal_contact = true;
  input.pose_wa = pose_at(pose.x, pose.q);
  session.core().reset();
  static_cast<void>(session.core().step(input));
  return session.core().step(input);
}

std::string situation_name(const CoreSession& session, const HapticCore& core) {
  const auto near = near_nodes(core, 0);
  if (near.size() == 1) {
    const auto type = contact_type(session.view().pair(0).record, near[0]);
    return std::string("one node of type ") + kTypeNames[static_cast<std::size_t>(type)];
  }
  switch (core.pair_report(0).situation) {
    case ContactSituation::kEdgeFace:
      return "edge-face contact";
    case ContactSituation::kFaceFace:
      return "face-face contact";
    case ContactSituation::kSeveralPlanes:
      return kSeveralPlanesRow;
    default:
      return "one contact, several near nodes";
  }
}

void count_local(const FlatPair& flat, std::span<const std::uint32_t> near, double d_near_m,
                 LocalSizes& sizes, std::vector<std::uint8_t>& seen) {
  const auto kind = near.size() == 1   ? LocalSizes::kOneNear
                    : near.size() <= 4 ? LocalSizes::kUpToFourNear
                                       : LocalSizes::kMoreNear;
  std::fill(seen.begin(), seen.end(), std::uint8_t{0});
  std::array<std::size_t, LocalSizes::kDeltas_m.size()> members{};
  const auto visit = [&](std::uint32_t node) {
    if (seen[node] != 0) return;
    seen[node] = 1;
    const FlatPair::Value value = flat.evaluate(node);
    if (value.violation_m > kApplicable_m) return;
    for (std::size_t d = 0; d < members.size(); ++d)
      members[d] += std::abs(d_near_m - value.depth_m) < LocalSizes::kDeltas_m[d] ? 1u : 0u;
  };
  for (const std::uint32_t node : near) {
    visit(node);
    const auto [type, i, j] = node_features(flat.view(), node);
    for_each_graph_neighbor(flat.view(), type, i, j, visit);
  }
  sizes.poses[kind] += 1;
  for (std::size_t d = 0; d < members.size(); ++d)
    sizes.count[kind][d][std::min(members[d], LocalSizes::kSizes - 1)] += 1;
}

}  // namespace

GraphFacts graph_facts() {
  const std::vector<std::byte> bytes = paper_scene();
  const CoreSession session(bytes, "tetrahedron and box");
  const PairView pair = session.view().pair(0);
  GraphFacts facts;
  facts.least_degree.fill(UINT32_MAX);
  std::uint32_t entries = 0;
  for (std::uint32_t node = 0; node < pair.record.node_count; ++node) {
    const auto [contact, i, j] = node_features(pair, node);
    std::uint32_t degree = 0;
    for_each_graph_neighbor(pair, contact, i, j, [&](std::uint32_t) { degree += 1; });
    const auto type = static_cast<std::size_t>(contact);
    facts.nodes[type] += 1;
    facts.least_degree[type] = std::min(facts.least_degree[type], degree);
    facts.largest_degree[type] = std::max(facts.largest_degree[type], degree);
    entries += degree;
  }
  facts.arcs = entries / 2;
  return facts;
}

NeighborhoodTable neighborhood_table(std::uint32_t poses) {
  const std::vector<std::byte> bytes = paper_scene();
  CoreSession session(bytes, "tetrahedron and box");
  PoseSweep sweep(session.view(), 20);
  Seeded random(21);
  NeighborhoodTable table;
  for (std::uint32_t k = 0; k < poses; ++k) {
    const double depth = random.uniform(0.0002, 0.002);
    const SweepPose pose = k % 3 == 0   ? sweep.generic(-depth)
                           : k % 3 == 1 ? sweep.edge_face(depth, 0)
                                        : sweep.face_face(depth, 0);
    if (settle(session, pose).d_near_m > 0) continue;  // the offset lay next to the other body
    const HapticCore& core = session.core();
    NeighborhoodRange& range = table[situation_name(session, core)];
    range.poses += 1;
    const std::vector<std::uint32_t> near = near_nodes(core, 0);
    const std::uint32_t size = neighborhood_size(session.view().pair(0), near);
    range.least = std::min(range.least, size);
    range.largest = std::max(range.largest, size);
    range.most_near = std::max(range.most_near, static_cast<std::uint32_t>(near.size()));
  }
  return table;
}

double LocalSizes::share_below(Class kind, std::size_t delta, std::size_t size) const {
  std::uint64_t below = 0;
  for (std::size_t s = 0; s < std::min(size, kSizes); ++s) below += count[kind][delta][s];
  return poses[kind] == 0 ? 1.0 : static_cast<double>(below) / static_cast<double>(poses[kind]);
}

std::size_t LocalSizes::largest(Class kind, std::size_t delta) const {
  for (std::size_t s = kSizes; s-- > 0;) {
    if (count[kind][delta][s] > 0) return s;
  }
  return 0;
}

LocalSizes local_sizes(std::uint32_t poses) {
  const std::vector<std::byte> bytes = paper_scene();
  CoreSession session(bytes, "tetrahedron and box");
  PoseSweep sweep(session.view(), 22);
  Seeded random(23);
  FlatPair flat(session.view(), 0);
  std::vector<std::uint8_t> seen(flat.node_count());
  LocalSizes sizes;
  for (std::uint32_t k = 0; k < poses; ++k) {
    // Eight poses of ten at any orientation, -6 to +50 mm; the others at or near an edge-face or
    // face-face contact, where a hand holds them within a few hundredths of a degree.
    const double depth = random.uniform(0.0002, 0.002), tilt = random.uniform(0.0, 0.002);
    const SweepPose pose = k % 10 == 8   ? sweep.edge_face(depth, tilt)
                           : k % 10 == 9 ? sweep.face_face(depth, tilt)
                                         : sweep.generic(random.uniform(-0.006, 0.050));
    const StepResult result = settle(session, pose);
    flat.place(place_moving(session.view(), pose_at(pose.x, pose.q)));
    count_local(flat, near_nodes(session.core(), 0), static_cast<double>(result.d_near_m), sizes,
                seen);
  }
  return sizes;
}

}  // namespace haptic::sim
