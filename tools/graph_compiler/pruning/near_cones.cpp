// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/pruning/near_cones.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

/// A corner this far beyond a side is still on it.
constexpr double kOnSide = 1.0e-9;
/// Longer arcs [rad] are taken for all round: an arc is shorter than pi.
constexpr double kLongestArc_rad = 0.999 * std::numbers::pi;

/// {n : n.d <= rise}, one side of the directions in which no neighbour rises by epsilon.
struct RaisedSide {
  Direction d{};
  double rise = 0.0;
};

/// Appends the unit directions with n.d = rise of both sides.
void add_corners(const RaisedSide& p, const RaisedSide& q, std::vector<Direction>& to) {
  const double g = vec::dot(p.d, q.d), square = 1.0 - g * g;
  const Direction across = vec::cross(p.d, q.d);
  if (!(square > 0.0) || !(vec::norm(across) > 0.0)) return;
  const double x = (p.rise - g * q.rise) / square, y = (q.rise - g * p.rise) / square;
  const double left = 1.0 - (x * x + y * y + 2.0 * x * y * g);
  if (left < 0.0) return;  // the two never rise together
  const Direction within = vec::add(vec::scaled(p.d, x), vec::scaled(q.d, y));
  const double height = std::sqrt(left);
  for (const double sign : {height, -height}) {
    to.push_back(vec::unit(vec::add(within, vec::scaled(vec::unit(across), sign))));
  }
}

/// The angle to a cone is largest at a corner of the raised sides, or all along one of them.
double vertex_reach(const PieceShape& shape, std::uint32_t v, double epsilon_m) {
  const PieceView view = shape.topology.view();
  const SphericalPolygon& cone = shape.vertex_cones[v];
  std::vector<RaisedSide> sides;
  double reach = 0.0;
  for (const std::uint16_t e : view.edges_at(v)) {
    const Direction along = vec::sub(shape.vertices[view.other_end(e, v)], shape.vertices[v]);
    const double length = vec::norm(along);
    if (!(length > epsilon_m)) return std::numbers::pi;
    sides.push_back(
        {rotated(shape.to_cones, vec::scaled(along, 1.0 / length)), epsilon_m / length});
    reach = std::max(reach, std::asin(sides.back().rise));
  }
  std::vector<Direction> corners;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    for (std::size_t k = i + 1; k < sides.size(); ++k) add_corners(sides[i], sides[k], corners);
  }
  bool any = false;
  for (const Direction& n : corners) {
    const bool is_corner = std::ranges::all_of(
        sides, [&](const RaisedSide& side) { return vec::dot(n, side.d) <= side.rise + kOnSide; });
    if (!is_corner) continue;
    any = true;
    reach = std::max(reach, angle_to(n, cone));
  }
  return any ? reach : std::numbers::pi;
}

/// Angles [rad] by which the normals of edge `e` go on beyond those of its faces; pi: all round.
std::array<double, 2> edge_reach(const PieceShape& shape, std::uint32_t e, double epsilon_m) {
  const EdgeRecord& edge = shape.topology.edges[e];
  const Direction& origin = shape.vertices[edge.vertex[0]];
  const Direction along = vec::unit(vec::sub(shape.vertices[edge.vertex[1]], origin));
  std::array<double, 2> reach{};
  for (std::size_t k = 0; k < 2; ++k) {
    const Direction apex = vec::sub(shape.vertices[edge.apex[k]], origin);
    const double width_m = vec::norm(vec::cross(along, apex));
    reach[k] = width_m > epsilon_m ? std::asin(epsilon_m / width_m) : std::numbers::pi;
  }
  return reach;
}

NearArc longer(const SphericalArc& arc, const std::array<double, 2>& by_rad) {
  const double length = angle_between(arc.from, arc.to) + by_rad[0] + by_rad[1];
  if (length > kLongestArc_rad) return {arc, true};
  const auto turned = [&](const Direction& n, double angle_rad) {
    return vec::add(vec::scaled(n, std::cos(angle_rad)),
                    vec::scaled(vec::cross(arc.pole, n), std::sin(angle_rad)));
  };
  return {{turned(arc.from, -by_rad[0]), turned(arc.to, by_rad[1]), arc.pole}, false};
}

}  // namespace

NearCones near_cones(const PieceShape& shape, double epsilon_m) {
  NearCones near;
  for (std::uint32_t v = 0; v < shape.topology.vertex_count; ++v) {
    near.vertex_reach_rad.push_back(vertex_reach(shape, v, epsilon_m));
  }
  for (std::uint32_t e = 0; e < shape.edge_cones.size(); ++e) {
    const std::array<double, 2> by_rad = edge_reach(shape, e, epsilon_m);
    near.edges.push_back(longer(shape.edge_cones[e], by_rad));
    near.open_edges.emplace_back();
    for (const SphericalArc& open : shape.open_edges[e]) {
      near.open_edges.back().push_back(longer(open, by_rad));
    }
  }
  near.open_vertices = shape.open_vertices;
  for (const std::uint32_t v : shape.edge_ends) {
    near.open_vertices[v].push_back(shape.vertex_cones[v]);
  }
  return near;
}

}  // namespace haptic::tools
