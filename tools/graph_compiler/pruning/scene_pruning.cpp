// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/pruning/scene_pruning.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

#include "rt_core/scene/graph_rule.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/pruning/node_marks.hpp"

namespace haptic::tools {
namespace {

// Contacts that a box around the grip point rules out. A pair of pieces: when it always stays
// apart. A basic contact: when, at every place in the box and every orientation of the envelope,
// its C-face has the grip behind it and lies below another C-face that could carry the force. It
// is then never near, however deep the pieces overlap, and never a plane that separates them, so
// neither the search nor the walk over separating planes ever stands on it. Every bound is
// conservative: what is ruled out is proved, what is kept may still never occur.

/// A motion to bound: grip point in the box, orientation in the envelope (absent: free).
struct MotionRange {
  WorkspaceBox box;
  std::optional<OrientationEnvelope> orientation;
};

/// Lengths [m] that the loop counts with.
struct ReachLimits {
  double clear_m = 0.0;    ///< pieces always farther apart need no search: exact band and motion
  double epsilon_m = 0.0;  ///< width of the near set
  double behind_m = 0.0;   ///< a plane with the grip this far behind it separates nothing
};

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

/// Clears `marks.near`, or the `reachable` of nodes, where the range rules them out. Cost: nodes
/// times faces of the pair times the eight corners of the box.
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

void append(std::vector<PieceShape>& to, std::vector<PieceShape> from) {
  std::move(from.begin(), from.end(), std::back_inserter(to));
}

void count_hidden(const std::vector<PieceShape>& shapes, PruningAccount& account) {
  const auto add = [](HiddenCount& count, const auto& open) {
    count.all += open.size();
    for (const auto& left : open) count.hidden += left.empty() ? 1u : 0u;
  };
  for (const PieceShape& shape : shapes) {
    add(account.faces, shape.open_faces);
    add(account.edges, shape.open_edges);
    add(account.vertices, shape.open_vertices);
  }
}

void count_pair(const PieceShape& a, const PieceShape& b, const PairMarks& marks,
                PruningAccount& account) {
  const PairCounts counts = count_nodes(a, b, marks);
  account.counts.nodes += counts.nodes;
  account.counts.reachable += counts.reachable;
  account.counts.open += counts.open;
  account.counts.live += counts.live;
  account.largest_pair_before = std::max(account.largest_pair_before, counts.nodes.all());
  account.largest_pair_after = std::max(account.largest_pair_after, counts.live.all());
  account.pairs += 1;
  account.pairs_out_of_reach += marks.near ? 0 : 1;
}

std::vector<bool> which_open(const auto& sets) {
  std::vector<bool> open;
  for (const auto& left : sets) open.push_back(!left.empty());
  return open;
}

/// As near_marks has them: a node is exposed where both of its features are open.
OpenFeatures open_features(const PieceShape& shape, const NearCones& near) {
  return {which_open(shape.open_faces), which_open(near.open_edges),
          which_open(near.open_vertices)};
}

/// Counts of all pairs at once, of a scene that does not list them: every contact can occur.
void count_formed_pairs(const std::vector<PieceShape>& moving, const std::vector<PieceShape>& fixed,
                        PruningAccount& account) {
  struct Sums {
    std::size_t faces = 0, edges = 0, vertices = 0;
  };
  Sums all[2], open[2], largest[2];
  for (const std::size_t side : {0u, 1u}) {
    for (const PieceShape& shape : side == 0 ? moving : fixed) {
      const auto add = [&](std::size_t Sums::*field, const auto& sets) {
        const auto is_open = [](const auto& left) { return !left.empty(); };
        all[side].*field += sets.size();
        open[side].*field += static_cast<std::size_t>(std::ranges::count_if(sets, is_open));
        largest[side].*field = std::max(largest[side].*field, sets.size());
      };
      add(&Sums::faces, shape.open_faces);
      add(&Sums::edges, shape.open_edges);
      add(&Sums::vertices, shape.open_vertices);
    }
  }
  const auto products = [](const Sums& a, const Sums& b) -> NodeCounts {
    return {a.faces * b.vertices, a.vertices * b.faces, a.edges * b.edges};
  };
  account.counts.nodes = account.counts.reachable = products(all[0], all[1]);
  account.counts.open = account.counts.live = products(open[0], open[1]);
  account.largest_pair_before = account.largest_pair_after = products(largest[0], largest[1]).all();
  account.pairs = moving.size() * fixed.size();
}

/// A plane separates as long as the depth behind it is within the tolerance of law proxy, of which
/// it takes up to 1.5; scenes with one above r_A / 1000 are refused.
constexpr double kToleranceShare = 2.0e-3;

/// Motion of one tick: 0 where no speed is given, the box then holds every pose there is.
/// `radius_m` of the whole moving part.
ReachLimits reach_limits(const SceneParameters& p, double radius_m) {
  double motion_m = 0.0;
  if (p.motion_limits_given != 0) {
    motion_m = (p.max_linear_speed_m_per_s + p.max_angular_speed_rad_per_s * radius_m) / p.rate_hz;
  }
  return {p.exact_band_m + motion_m, p.epsilon_m, p.epsilon_m + kToleranceShare * radius_m};
}

std::vector<NearCones> all_near_cones(const std::vector<PieceShape>& shapes, double epsilon_m) {
  std::vector<NearCones> result;
  for (const PieceShape& shape : shapes) result.push_back(near_cones(shape, epsilon_m));
  return result;
}

double radius_of(const std::vector<PieceShape>& moving) {
  double radius_m = 0.0;
  for (const PieceShape& shape : moving) {
    for (const auto& v : shape.vertices) radius_m = std::max(radius_m, vec::norm(v));
  }
  return radius_m;
}

/// A scene with surfaces lists no pairs, and what a facet's contact can carry depends on its
/// normal: the core decides it from the facet's cones. Of solids their seams are hidden as in any
/// scene.
void prune_beside_surfaces(SceneDescription& description, PruningAccount& account) {
  const double epsilon_m = description.parameters.epsilon_m;
  std::size_t first = 0;  // piece of the scene
  const auto add = [&](const PlacedBody& placed, const std::array<double, 3>* grip_m) {
    const std::vector<ConvexPiece>& pieces = placed.body.pieces;
    const bool moves = grip_m != nullptr;
    (moves ? account.moving_pieces : account.static_pieces) += pieces.size();
    if (placed.body.pieces.front().is_facet()) {
      for (const ConvexPiece& piece : pieces) {
        const std::size_t corners = piece.vertices.size();
        description.open.push_back({std::vector<bool>(2, true), std::vector<bool>(corners, true),
                                    std::vector<bool>(corners, true)});
      }
    } else {
      const bool known = description.prune && !description.exposure.empty();
      std::vector<PieceShape> shapes = piece_shapes(
          placed, grip_m, known ? description.exposure.data() + first : nullptr, std::nullopt);
      for (const PieceShape& shape : shapes) {
        description.open.push_back(open_features(shape, near_cones(shape, epsilon_m)));
      }
      count_hidden(shapes, account);
    }
    first += pieces.size();
  };
  add(description.moving, &description.grip_m);
  for (const PlacedBody& placed : description.statics) add(placed, nullptr);
  account.pairs = account.moving_pieces * account.static_pieces;
  if (!description.prune) description.open.clear();
}

}  // namespace

PruningAccount prune_scene(SceneDescription& description) {
  const auto begin = std::chrono::steady_clock::now();
  PruningAccount account;
  account.pruned = description.prune;
  description.marks.clear();
  description.open.clear();
  if (has_surfaces(description)) {
    prune_beside_surfaces(description, account);
    const auto spent = std::chrono::steady_clock::now() - begin;
    account.marks_ms = std::chrono::duration<double, std::milli>(spent).count();
    return account;
  }
  if (!description.prune) description.exposure.clear();
  const auto envelope =
      description.prune ? description.orientation : std::optional<OrientationEnvelope>{};
  const PieceExposure* exposure =
      description.exposure.empty() ? nullptr : description.exposure.data();
  std::vector<PieceShape> moving =
      piece_shapes(description.moving, &description.grip_m, exposure, envelope);
  std::vector<PieceShape> fixed;
  for (const PlacedBody& body : description.statics) {
    append(fixed,
           piece_shapes(body, nullptr,
                        exposure == nullptr ? nullptr : exposure + moving.size() + fixed.size(),
                        envelope));
  }
  account.moving_pieces = moving.size();
  account.static_pieces = fixed.size();
  count_hidden(moving, account);
  count_hidden(fixed, account);
  for (const PieceExposure& piece : description.exposure) {
    account.partly_covered_faces += static_cast<std::size_t>(
        std::count_if(piece.face_fragments.begin(), piece.face_fragments.end(),
                      [](const auto& fragments) { return !fragments.empty(); }));
  }
  const ReachLimits limits = reach_limits(description.parameters, radius_of(moving));
  const auto confine = [&](const PieceShape& a, const PieceShape& b, PairMarks& marks) {
    if (!description.workspace || !description.prune) return;
    mark_workspace_reach(a, b, {*description.workspace, envelope}, limits, marks);
  };
  const std::vector<NearCones> near_fixed = all_near_cones(fixed, limits.epsilon_m);
  const bool listed = lists_pairs(description);
  if (!listed) {
    count_formed_pairs(moving, fixed, account);
    for (const PieceShape& shape : moving) {
      description.open.push_back(open_features(shape, near_cones(shape, limits.epsilon_m)));
    }
    for (std::size_t j = 0; j < fixed.size(); ++j) {
      description.open.push_back(open_features(fixed[j], near_fixed[j]));
    }
    if (!description.prune) description.open.clear();
  }
  for (std::size_t i = 0; i < moving.size() && listed; ++i) {
    const PieceShape& a = moving[i];
    const NearCones near_a = near_cones(a, limits.epsilon_m);
    for (std::size_t j = 0; j < fixed.size(); ++j) {
      const PieceShape& b = fixed[j];
      PairMarks touching = prune_pair(a, b, envelope);
      confine(a, b, touching);
      count_pair(a, b, touching, account);
      if (!description.prune) continue;
      PairMarks near = near_marks(a, b, near_a, near_fixed[j], envelope);
      confine(a, b, near);
      description.marks.push_back(std::move(near));
    }
  }
  const auto spent = std::chrono::steady_clock::now() - begin;
  account.marks_ms = std::chrono::duration<double, std::milli>(spent).count();
  return account;
}

}  // namespace haptic::tools
