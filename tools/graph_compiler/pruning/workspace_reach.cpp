// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/pruning/workspace_reach.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "rt_core/scene/graph_rule.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

/// Rounding of the bounds, as a share of the lengths they are made of.
constexpr double kRounding = 1.0e-12;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Values at the corners of the box. At one orientation the differences of C-face values are linear
/// in the place of the grip, so that what holds at the corners holds in the box.
using Corners = std::array<double, 8>;

class Reach {
 public:
  Reach(const PieceShape& a, const PieceShape& b, const MotionRange& range)
      : a_(a), b_(b), angle_rad_(max_angle_of(range.orientation)) {
    const Rotation middle = middle_of(range.orientation);
    for (const auto& v : a.vertices) turned_.push_back(rotated(middle, v));
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      for (std::size_t i = 0; i < 3; ++i) {
        corners_[k][i] = ((k >> i) & 1) != 0 ? range.box.max_m[i] : range.box.min_m[i];
      }
    }
    for (const auto& v : turned_) scale_m_ = std::max(scale_m_, vec::norm(v));
    for (const auto& x : corners_) {
      for (const auto& v : b.vertices) scale_m_ = std::max(scale_m_, vec::distance(x, v));
    }
  }

  [[nodiscard]] double slack_m() const { return kRounding * scale_m_; }

  /// Least of n.R v over the envelope, n in W, `v` turned by R0: a turn brings v at most by its
  /// angle away from n.
  [[nodiscard]] double least(const Direction& n, const Point3& v) const {
    const double length = vec::norm(v);
    if (length == 0.0) return 0.0;
    const double angle = angle_between(n, vec::scaled(v, 1.0 / length));
    return length * std::cos(std::min(std::numbers::pi, angle + angle_rad_));
  }
  [[nodiscard]] double most(const Direction& n, const Point3& v) const {
    const double length = vec::norm(v);
    if (length == 0.0) return 0.0;
    const double angle = angle_between(n, vec::scaled(v, 1.0 / length));
    return length * std::cos(std::max(0.0, angle - angle_rad_));
  }

  /// Values of the plane of face `f` of B with its supporting vertex of A, from below; `n` may be
  /// any other direction in W, with `offset_m` the support of B.
  [[nodiscard]] Corners plane_of_b(const Direction& n, double offset_m) const {
    double support = kInfinity;
    for (const Point3& v : turned_) support = std::min(support, least(n, v));
    Corners values{};
    for (std::size_t k = 0; k < values.size(); ++k) {
      values[k] = vec::dot(n, corners_[k]) + support - offset_m;
    }
    return values;
  }

  /// The same of face `f` of A with its supporting vertex of B.
  [[nodiscard]] Corners plane_of_a(std::size_t f) const {
    Corners values{};
    for (std::size_t k = 0; k < values.size(); ++k) {
      values[k] = kInfinity;
      for (const Point3& v : b_.vertices) {
        values[k] = std::min(values[k], least(a_.face_cones[f], vec::sub(corners_[k], v)));
      }
      values[k] -= offset_of_a(f);
    }
    return values;
  }

  // Values of a node from above, where it is applicable.
  [[nodiscard]] Corners most_a(std::size_t f, std::size_t v) const {
    Corners values{};
    for (std::size_t k = 0; k < values.size(); ++k) {
      values[k] = most(a_.face_cones[f], vec::sub(corners_[k], b_.vertices[v])) - offset_of_a(f);
    }
    return values;
  }
  [[nodiscard]] Corners most_b(std::size_t v, std::size_t f) const {
    const double reach = most(b_.normals[f], turned_[v]) - offset_of_b(f);
    Corners values{};
    for (std::size_t k = 0; k < values.size(); ++k) {
      values[k] = vec::dot(b_.normals[f], corners_[k]) + reach;
    }
    return values;
  }
  /// The normal lies in the arc of either edge, and the value does not depend on the points chosen
  /// on the edges.
  [[nodiscard]] double most_on_edge_of_a(std::size_t e) const {
    double value = kInfinity;
    for (const std::uint16_t v : a_.topology.edges[e].vertex) {
      value = std::min(value, most_in_arc(turned_[v], a_.edge_cones[e]));
    }
    return value;
  }
  [[nodiscard]] Corners most_on_edge_of_b(std::size_t e) const {
    Corners values{};
    for (std::size_t k = 0; k < values.size(); ++k) {
      values[k] = kInfinity;
      for (const std::uint16_t v : b_.topology.edges[e].vertex) {
        const Point3 to = vec::sub(corners_[k], b_.vertices[v]);
        values[k] = std::min(values[k], most_in_arc(to, b_.edge_cones[e]));
      }
    }
    return values;
  }

  [[nodiscard]] double offset_of_b(std::size_t f) const {
    return vec::dot(b_.normals[f], b_.vertices[first_vertex(b_, f)]);
  }

 private:
  static std::uint16_t first_vertex(const PieceShape& piece, std::size_t f) {
    return piece.topology.loop_vertices[piece.topology.faces[f].loop_begin];
  }
  [[nodiscard]] double offset_of_a(std::size_t f) const {
    return vec::dot(a_.normals[f], a_.vertices[first_vertex(a_, f)]);
  }
  static double most_in_arc(const Point3& v, const SphericalArc& arc) {
    const double length = vec::norm(v);
    if (length == 0.0) return 0.0;
    return length * std::cos(angle_to(vec::scaled(v, 1.0 / length), arc));
  }

  const PieceShape &a_, &b_;
  double angle_rad_;
  std::vector<Point3> turned_;  ///< vertices of A at R0, about the grip
  std::array<Point3, 8> corners_{};
  double scale_m_ = 0.0;
};

double lowest(const Corners& values) { return *std::min_element(values.begin(), values.end()); }

/// True when a plane separates the pieces by more than `clear_m` in all of the range.
bool always_apart(const PieceShape& a, const PieceShape& b, const Reach& reach, double clear_m) {
  const auto clear = [&](const Corners& gap) { return lowest(gap) > clear_m + reach.slack_m(); };
  for (std::size_t f = 0; f < b.normals.size(); ++f) {
    if (clear(reach.plane_of_b(b.normals[f], reach.offset_of_b(f)))) return true;
  }
  for (std::size_t f = 0; f < a.normals.size(); ++f) {
    if (clear(reach.plane_of_a(f))) return true;
  }
  for (std::size_t k = 0; k < 6; ++k) {
    Direction n{0, 0, 0};
    n[k / 2] = k % 2 == 0 ? 1.0 : -1.0;
    double offset = -kInfinity;
    for (const auto& v : b.vertices) offset = std::max(offset, vec::dot(n, v));
    if (clear(reach.plane_of_b(n, offset))) return true;
  }
  return false;
}

/// Planes below which a node can be passed over: faces that nothing covers, and whose contacts in
/// the envelope all meet vertices that nothing covers. One of these contacts is applicable at every
/// orientation, and its value is the plane's.
std::vector<Corners> ruling_planes(const PieceShape& a, const PieceShape& b, const Reach& reach,
                                   const NodeNumbering& nodes, const PairMarks& marks) {
  std::vector<Corners> planes;
  for (std::uint32_t f = 0; f < nodes.nfb; ++f) {
    bool open = b.whole_faces[f];
    for (std::uint32_t v = 0; v < nodes.nva; ++v) {
      open = open && (a.whole_vertices[v] || !marks.reachable[nodes.type_b(v, f)]);
    }
    if (open) planes.push_back(reach.plane_of_b(b.normals[f], reach.offset_of_b(f)));
  }
  for (std::uint32_t f = 0; f < nodes.nfa; ++f) {
    bool open = a.whole_faces[f];
    for (std::uint32_t v = 0; v < nodes.nvb; ++v) {
      open = open && (b.whole_vertices[v] || !marks.reachable[nodes.type_a(f, v)]);
    }
    if (open) planes.push_back(reach.plane_of_a(f));
  }
  return planes;
}

/// True when the values are behind everywhere and one plane is above them everywhere.
bool ruled_out(const Corners& values, const std::vector<Corners>& planes, const ReachLimits& limits,
               double slack_m) {
  if (!(*std::max_element(values.begin(), values.end()) < -limits.behind_m - slack_m)) return false;
  return std::any_of(planes.begin(), planes.end(), [&](const Corners& plane) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (!(plane[k] - values[k] > limits.epsilon_m + slack_m)) return false;
    }
    return true;
  });
}

}  // namespace

void mark_workspace_reach(const PieceShape& a, const PieceShape& b, const MotionRange& range,
                          const ReachLimits& limits, PairMarks& marks) {
  const Reach reach(a, b, range);
  if (always_apart(a, b, reach, limits.clear_m)) {
    marks.near = false;
    std::fill(marks.reachable.begin(), marks.reachable.end(), false);
    return;
  }
  const NodeNumbering nodes = numbering(a.topology.view(), b.topology.view());
  const std::vector<Corners> planes = ruling_planes(a, b, reach, nodes, marks);
  const auto mark = [&](std::uint32_t node, const Corners& values) {
    if (ruled_out(values, planes, limits, reach.slack_m())) marks.reachable[node] = false;
  };
  for (std::uint32_t f = 0; f < nodes.nfa; ++f) {
    for (std::uint32_t v = 0; v < nodes.nvb; ++v) mark(nodes.type_a(f, v), reach.most_a(f, v));
  }
  for (std::uint32_t v = 0; v < nodes.nva; ++v) {
    for (std::uint32_t f = 0; f < nodes.nfb; ++f) mark(nodes.type_b(v, f), reach.most_b(v, f));
  }
  std::vector<Corners> on_b;
  for (std::uint32_t g = 0; g < nodes.neb; ++g) on_b.push_back(reach.most_on_edge_of_b(g));
  for (std::uint32_t e = 0; e < nodes.nea; ++e) {
    const double on_a = reach.most_on_edge_of_a(e);
    for (std::uint32_t g = 0; g < nodes.neb; ++g) {
      Corners values = on_b[g];
      for (double& x : values) x += on_a;
      mark(nodes.type_c(e, g), values);
    }
  }
}

}  // namespace haptic::tools
