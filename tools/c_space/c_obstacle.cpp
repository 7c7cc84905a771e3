// SPDX-License-Identifier: Apache-2.0
#include "tools/c_space/c_obstacle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "rt_core/proxy/surface_cone.hpp"

namespace haptic::tools {
namespace {

// Bodies of 0.1 m; the scene's numbers are rounded to Real, the sums here are double.
constexpr double kSamePoint_m = HAPTIC_REAL_IS_FLOAT ? 1e-7 : 1e-9;
/// Farther than any scene is wide.
constexpr Real kAnywhere_m = 1.0e6_r;
constexpr double kSameNormal = HAPTIC_REAL_IS_FLOAT ? 1e-5 : 1e-7;

/// Vertices of the pair in W axes: those of A about the grip point, those of B in W.
struct PlacedVertices {
  std::vector<Vector> a, b;

  PlacedVertices(const SceneView& view, const PairView& pair, const PlacedMoving& moving) {
    const double* reference = view.bodies()[pair.b.record->body].reference_m;
    const Vector origin(reference[0], reference[1], reference[2]);
    for (std::uint32_t v = 0; v < pair.a.vertex_count; ++v) {
      const Vector local = pair.a.vertex(v).cast<double>();
      Vector turned;
      for (std::size_t i = 0; i < 3; ++i)
        turned[static_cast<int>(i)] = vector_of(moving.r_wa[i]).dot(local);
      a.push_back(turned);
    }
    for (std::uint32_t v = 0; v < pair.b.vertex_count; ++v)
      b.emplace_back(origin + pair.b.vertex(v).cast<double>());
  }
};

/// Corners of a node's C-face: b - R a over the vertices of its two features.
void add_corners(const PairView& pair, const PlacedVertices& placed, std::uint32_t node,
                 std::vector<Vector>& corners) {
  const NodeFeatures features = node_features(pair, node);
  switch (contact_type(pair.record, node)) {
    case ContactType::kA:
      for (const std::uint16_t v : pair.a.face_vertices(features.i))
        corners.emplace_back(placed.b[features.j] - placed.a[v]);
      return;
    case ContactType::kB:
      for (const std::uint16_t v : pair.b.face_vertices(features.j))
        corners.emplace_back(placed.b[v] - placed.a[features.i]);
      return;
    case ContactType::kC:
      for (const std::uint16_t va : pair.a.edges[features.i].vertex) {
        for (const std::uint16_t vb : pair.b.edges[features.j].vertex)
          corners.emplace_back(placed.b[vb] - placed.a[va]);
      }
      return;
  }
}

}  // namespace

const CFace* CObstacle::face_of(std::uint32_t node) const {
  for (const CFace& face : faces) {
    if (std::binary_search(face.nodes.begin(), face.nodes.end(), node)) return &face;
  }
  return nullptr;
}

std::vector<Vector> planar_hull(std::span<const Vector> points, const Vector& normal) {
  Vector axis = Vector::UnitX();
  if (std::abs(normal[0]) > 0.6) axis = Vector::UnitY();
  const Vector e1 = axis.cross(normal).normalized(), e2 = normal.cross(e1);
  struct Flat {
    double u, v;
    Vector p;
  };
  std::vector<Flat> flat;
  for (const Vector& p : points) {
    bool known = false;
    for (const Flat& other : flat) known = known || (other.p - p).norm() < kSamePoint_m;
    if (!known) flat.push_back({e1.dot(p - points[0]), e2.dot(p - points[0]), p});
  }
  std::sort(flat.begin(), flat.end(),
            [](const Flat& l, const Flat& r) { return l.u < r.u || (l.u == r.u && l.v < r.v); });
  const auto left_turn = [](const Flat& a, const Flat& b, const Flat& c) {
    const double cross = (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
    return cross > kSamePoint_m * std::hypot(c.u - a.u, c.v - a.v);
  };
  std::vector<Flat> chain;
  for (int pass = 0; pass < 2; ++pass) {  // lower chain, then upper chain
    const std::size_t start = chain.size();
    for (const Flat& point : flat) {
      while (chain.size() >= start + 2 &&
             !left_turn(chain[chain.size() - 2], chain[chain.size() - 1], point))
        chain.pop_back();
      chain.push_back(point);
    }
    chain.pop_back();  // first point of the other chain
    std::reverse(flat.begin(), flat.end());
  }
  std::vector<Vector> hull;
  for (const Flat& point : chain) hull.push_back(point.p);
  if (hull.empty() && !flat.empty()) hull.push_back(flat.front().p);
  return hull;
}

std::vector<std::uint32_t> applicable_nodes(const FlatPair& pair, double tolerance_m) {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t node = 0; node < pair.node_count(); ++node) {
    if (pair.evaluate(node).violation_m <= tolerance_m) nodes.push_back(node);
  }
  return nodes;
}

std::string node_text(const PairView& pair, std::uint32_t node) {
  constexpr const char* kLetters[3][3] = {{"A", "f", "v"}, {"B", "v", "f"}, {"C", "e", "e"}};
  const NodeFeatures features = node_features(pair, node);
  const auto& letters = kLetters[static_cast<std::size_t>(contact_type(pair.record, node))];
  return std::to_string(node) + " " + letters[0] + " (" + letters[1] + std::to_string(features.i) +
         ", " + letters[2] + std::to_string(features.j) + ")";
}

bool only_separates(const PairView& pair, const Mat3& r_wa, std::uint32_t node,
                    const Vector& normal) {
  const NodeFeatures features = node_features(pair, node);
  if (!goes_on_behind(pair, r_wa, features, normal.cast<Real>())) return true;
  return pair.marks.given() && !pair.marks.node(NodeScope::kLive, node);
}

CObstacle make_c_obstacle(const SceneView& view, PairIndex pair, const Pose& pose_wa) {
  const PlacedMoving moving = place_moving(view, pose_wa);
  FlatPair flat(view, pair);
  flat.place(moving);
  const PlacedVertices placed(view, flat.view(), moving);
  const Mat3 r_wa = pose_wa.q_wa.normalized().toRotationMatrix();
  CObstacle obstacle;
  std::vector<std::vector<Vector>> corners;
  for (const std::uint32_t node : applicable_nodes(flat, kApplicable_m)) {
    Point n{}, app{};
    flat.contact(node, n, app);
    std::vector<Vector> points;
    add_corners(flat.view(), placed, node, points);
    const Vector normal = vector_of(n);
    const double offset = normal.dot(points.front());
    std::size_t at = 0;
    while (at < obstacle.faces.size() &&
           ((obstacle.faces[at].normal - normal).norm() > kSameNormal ||
            std::abs(obstacle.faces[at].offset_m - offset) > kSamePoint_m))
      ++at;
    if (at == obstacle.faces.size()) {
      obstacle.faces.push_back({{}, normal, offset, {}, true});
      corners.emplace_back();
    }
    obstacle.faces[at].nodes.push_back(node);
    obstacle.faces[at].hidden =
        obstacle.faces[at].hidden && only_separates(flat.view(), r_wa, node, normal);
    corners[at].insert(corners[at].end(), points.begin(), points.end());
  }
  for (std::size_t f = 0; f < corners.size(); ++f)
    obstacle.faces[f].polygon = planar_hull(corners[f], obstacle.faces[f].normal);
  return obstacle;
}

ObstacleSearch::ObstacleSearch(const SceneView& view, const NearLimits& limits)
    : view_(&view), limits_(limits) {
  const auto slots =
      static_cast<std::uint32_t>(std::min<PairIndex>(limits.most_tried, view.pair_count()));
  Arena counting;
  pairs_.place(counting, view, slots, false);
  memory_.resize(counting.used() / sizeof(std::uint64_t) + 1);
  Arena arena(reinterpret_cast<std::byte*>(memory_.data()));
  pairs_.place(arena, view, slots, false);
  pairs_.read_scene(view);
}

std::vector<NearObstacle> ObstacleSearch::nearest(const Pose& pose_wa, std::size_t& too_large) {
  const PlacedMoving moving = place_moving(*view_, pose_wa);
  GripPose at;
  at.q_wa = pose_wa.q_wa;
  for (int k = 0; k < 3; ++k) {
    const auto row = static_cast<std::size_t>(k);
    at.x0_w[k] = static_cast<Real>(moving.grip_w[row]);
    for (int l = 0; l < 3; ++l)
      at.r_wa(k, l) = static_cast<Real>(moving.r_wa[row][static_cast<std::size_t>(l)]);
  }
  pairs_.reset();
  pairs_.begin(at, 0, kAnywhere_m);
  while (!pairs_.go_on(std::numeric_limits<std::uint32_t>::max(), 0, 0)) {
  }
  std::vector<std::pair<Real, PairIndex>> by_bound;
  for (const std::uint32_t slot : pairs_.slots())
    by_bound.emplace_back(pairs_[slot].gap_m, pairs_[slot].pair);
  std::sort(by_bound.begin(), by_bound.end());
  const Vector point = vector_of(moving.grip_w);
  std::vector<NearObstacle> found;
  for (const auto& [bound_m, pair] : by_bound) {
    // No pair behind is nearer than its bound is.
    if (found.size() >= limits_.most &&
        static_cast<double>(bound_m) > found[limits_.most - 1].distance_m)
      break;
    if (view_->pair_record(pair).node_count > limits_.most_nodes) {
      too_large += 1;
      continue;
    }
    NearObstacle near{pair, make_c_obstacle(*view_, pair, pose_wa), 0};
    near.distance_m = -std::numeric_limits<double>::infinity();
    for (const CFace& face : near.obstacle.faces)
      near.distance_m = std::max(near.distance_m, face.normal.dot(point) - face.offset_m);
    const auto behind = std::find_if(found.begin(), found.end(), [&](const NearObstacle& other) {
      return other.distance_m > near.distance_m;
    });
    found.insert(behind, std::move(near));
  }
  if (found.size() > limits_.most) found.resize(limits_.most);
  return found;
}

}  // namespace haptic::tools
