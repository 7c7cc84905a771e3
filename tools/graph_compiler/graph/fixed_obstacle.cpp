// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/fixed_obstacle.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/contact/basic_contact.hpp"
#include "rt_core/contact/near_set.hpp"
#include "rt_core/scene/graph_rule.hpp"

namespace haptic::tools {
namespace {

/// Edges closer to parallel than this have no plane, as in the core's search.
constexpr Wide kParallelSine = HAPTIC_REAL_IS_FLOAT ? 1.0e-5L : 1.0e-12L;

Real nearest_real(Wide x) { return static_cast<Real>(x); }

/// n . v of every vertex.
std::vector<Wide> heights(const WidePiece& piece, const Wide3& n) {
  std::vector<Wide> along;
  along.reserve(piece.vertices.size());
  for (const Wide3& v : piece.vertices) along.push_back(dot(n, v));
  return along;
}

class ObstacleBuilder {
 public:
  ObstacleBuilder(const WidePiece& a, const WidePiece& b, double epsilon_m, double size_m,
                  const PairMarks* marks)
      : a_(a),
        b_(b),
        numbers_(numbering(a.topology->view(), b.topology->view())),
        epsilon_(static_cast<Wide>(epsilon_m)),
        tolerance_(64 * static_cast<Wide>(kRealEpsilon) * static_cast<Wide>(size_m)),
        marks_(marks) {}

  [[nodiscard]] FixedObstacle build() {
    for (std::uint32_t f = 0; f < numbers_.nfa; ++f) add_face_of_a(f);
    for (std::uint32_t f = 0; f < numbers_.nfb; ++f) add_face_of_b(f);
    std::vector<EdgePlane> near_only;
    for (std::uint32_t e = 0; e < numbers_.nea; ++e) {
      for (std::uint32_t g = 0; g < numbers_.neb; ++g) {
        EdgePlane plane;
        if (!edge_plane(e, g, plane)) continue;
        if (plane.applies) {
          add_edges(plane);
        } else {
          near_only.push_back(plane);
        }
      }
    }
    built_.bounding_count = static_cast<std::uint32_t>(planes_.size());
    for (const EdgePlane& plane : near_only) add_edges(plane);
    for (Plane& plane : planes_) {
      plane.record.node_begin = static_cast<std::uint32_t>(built_.nodes.size());
      plane.record.node_count = static_cast<std::uint32_t>(plane.nodes.size());
      built_.planes.push_back(plane.record);
      built_.nodes.insert(built_.nodes.end(), plane.nodes.begin(), plane.nodes.end());
    }
    return std::move(built_);
  }

 private:
  struct EdgePlane {
    std::uint32_t e = 0, g = 0;
    Wide3 normal{};
    Wide sine = 0, violation = 0;
    bool applies = false;  ///< it counts for D_near
  };

  [[nodiscard]] bool exposed(std::uint64_t node) const {
    return marks_ == nullptr || marks_->exposed[node];
  }

  /// A plane that grows.
  struct Plane {
    FixedPlane record{};
    Wide3 normal{};
    Wide offset = 0;
    std::vector<FixedNode> nodes;
  };

  /// Begins a plane with normal n; its offset is the height of the supports.
  Plane& begin_plane(ContactType type, const Wide3& n, Wide offset) {
    Plane plane;
    for (std::size_t k = 0; k < 3; ++k) plane.record.normal[k] = nearest_real(n[k]);
    plane.record.offset_m = nearest_real(offset);
    plane.record.type = static_cast<std::uint8_t>(type);
    plane.normal = n;
    plane.offset = offset;
    planes_.push_back(std::move(plane));
    return planes_.back();
  }

  /// A plane begun before that is this one except for the rounding of normals, or null.
  [[nodiscard]] Plane* same_plane(const Wide3& n, Wide offset, PlaneForce force) {
    constexpr Wide kSame = 8 * static_cast<Wide>(kRealEpsilon);
    for (Plane& plane : planes_) {
      const Wide3 apart = plane.normal - n;
      const Wide height = plane.offset - offset;
      if (dot(apart, apart) <= kSame * kSame && height <= tolerance_ && -height <= tolerance_ &&
          has_force(plane.record, force)) {
        return &plane;
      }
    }
    return nullptr;
  }

  [[nodiscard]] static std::uint8_t number_of(PlaneForce force) {
    return static_cast<std::uint8_t>(force);
  }

  static void add_node(Plane& plane, ContactType type, std::uint32_t i, std::uint32_t j, Wide rise,
                       Wide violation) {
    FixedNode node{};
    node.i = static_cast<std::uint16_t>(i);
    node.j = static_cast<std::uint16_t>(j);
    node.type = static_cast<std::uint32_t>(type);
    node.rise_m = nearest_real(rise);
    node.violation_m = nearest_real(violation);
    plane.nodes.push_back(node);
  }

  /// Height of the lowest neighbour of a vertex.
  [[nodiscard]] static Wide lowest_beside(const PieceView& view, const std::vector<Wide>& above,
                                          std::uint32_t v) {
    Wide lowest = above[view.other_end(view.edges_at(v)[0], v)];
    for (const std::uint16_t e : view.edges_at(v))
      lowest = std::min(lowest, above[view.other_end(e, v)]);
    return lowest;
  }

  /// Nodes of a face with the vertices of the other piece, which lie `above[v]` over their support.
  /// `node_at(v)` numbers the node; `put(v)` writes its features.
  template <typename NodeAt, typename Put>
  void add_face_nodes(const WidePiece& other, const std::vector<Wide>& above, const NodeAt& node_at,
                      const Put& put) {
    const PieceView view = other.topology->view();
    Plane& plane = planes_.back();
    const auto type = static_cast<ContactType>(plane.record.type);
    std::uint32_t support = 0;
    bool bears = false, found = false, elsewhere = false;
    for (std::uint32_t v = 0; v < view.vertex_count; ++v) {
      elsewhere = elsewhere || exposed(node_at(v));
      if (above[v] <= tolerance_ && exposed(node_at(v)) && !bears) {
        support = v;
        bears = found = true;
      }
      if (!found && above[v] == 0) {
        support = v;
        found = true;
      }
      const Wide violation = above[v] - lowest_beside(view, above, v);
      if (!(violation < epsilon_ && above[v] < static_cast<Wide>(kMaxRise) * epsilon_)) {
        continue;
      }
      if (exposed(node_at(v))) {
        const auto [i, j] = put(v);
        add_node(plane, type, i, j, above[v], violation);
      } else {
        built_.hidden = true;
      }
    }
    const auto [i, j] = put(support);
    plane.record.i = static_cast<std::uint16_t>(i);
    plane.record.j = static_cast<std::uint16_t>(j);
    plane.record.force = number_of(bears       ? PlaneForce::kBears
                                   : elsewhere ? PlaneForce::kElsewhere
                                               : PlaneForce::kHidden);
    built_.hidden = built_.hidden || !bears;
  }

  using Features = std::array<std::uint32_t, 2>;

  void add_face_of_a(std::uint32_t f) {
    const Wide3 n = -1 * a_.normals[f];
    const std::vector<Wide> of_a = heights(a_, n);
    std::vector<Wide> above = heights(b_, n);
    const Wide highest = *std::ranges::max_element(above);
    begin_plane(ContactType::kA, n, highest - *std::ranges::min_element(of_a));
    for (Wide& h : above) h = highest - h;
    add_face_nodes(
        b_, above, [&](std::uint32_t v) { return numbers_.type_a(f, v); },
        [&](std::uint32_t v) {
          return Features{f, v};
        });
  }

  void add_face_of_b(std::uint32_t f) {
    const Wide3& n = b_.normals[f];
    const std::vector<Wide> of_b = heights(b_, n);
    std::vector<Wide> above = heights(a_, n);
    const Wide lowest = *std::ranges::min_element(above);
    begin_plane(ContactType::kB, n, *std::ranges::max_element(of_b) - lowest);
    for (Wide& h : above) h -= lowest;
    add_face_nodes(
        a_, above, [&](std::uint32_t v) { return numbers_.type_b(v, f); },
        [&](std::uint32_t v) {
          return Features{v, f};
        });
  }

  /// Plane of two edges; false: parallel, or neither applicable nor ever near.
  [[nodiscard]] bool edge_plane(std::uint32_t e, std::uint32_t g, EdgePlane& plane) const {
    const Wide3 m = cross(a_.along[e], b_.along[g]);
    plane.e = e;
    plane.g = g;
    plane.sine = norm(m);
    if (plane.sine < kParallelSine) return false;
    plane.normal = (1 / plane.sine) * m;
    const EdgeRecord &of_a = a_.topology->edges[e], &of_b = b_.topology->edges[g];
    // Heights of the apexes along the normal; A must lie above its plane, B below.
    Wide up = 0, down = 0;  // violations of the normal and of its opposite
    for (std::size_t k = 0; k < 2; ++k) {
      const Wide ha = dot(plane.normal, a_.vertices[of_a.apex[k]] - a_.vertices[of_a.vertex[0]]);
      const Wide hb = dot(plane.normal, b_.vertices[of_b.apex[k]] - b_.vertices[of_b.vertex[0]]);
      const Wide one = std::max(-ha, hb), other = std::max(ha, -hb);
      up = k == 0 ? one : std::max(up, one);
      down = k == 0 ? other : std::max(down, other);
    }
    if (down < up) plane.normal = -1 * plane.normal;
    plane.violation = std::min(up, down);
    plane.applies = plane.violation * plane.sine <= tolerance_;
    return plane.applies || plane.violation < epsilon_;
  }

  void add_edges(const EdgePlane& at) {
    const std::vector<Wide> of_a = heights(a_, at.normal), of_b = heights(b_, at.normal);
    const Wide lowest = *std::ranges::min_element(of_a), highest = *std::ranges::max_element(of_b);
    const Wide rise_a = of_a[a_.topology->edges[at.e].vertex[0]] - lowest;
    const Wide rise_b = highest - of_b[b_.topology->edges[at.g].vertex[0]];
    Wide violation = at.violation;
    if (violation > 0) violation = std::max({violation, rise_a, rise_b});
    const bool near = violation < epsilon_ && at.sine >= static_cast<Wide>(kMinEdgeSine);
    if (!at.applies && !near) return;
    const bool bears = exposed(numbers_.type_c(at.e, at.g));
    const PlaneForce force = bears ? PlaneForce::kBears : PlaneForce::kHidden;
    built_.hidden = built_.hidden || !bears;
    if (!at.applies && !bears) return;
    Plane* plane = at.applies ? same_plane(at.normal, highest - lowest, force) : nullptr;
    if (plane == nullptr) {
      plane = &begin_plane(ContactType::kC, at.normal, highest - lowest);
      plane->record.i = static_cast<std::uint16_t>(at.e);
      plane->record.j = static_cast<std::uint16_t>(at.g);
      plane->record.force = number_of(force);
    }
    if (near && bears) add_node(*plane, ContactType::kC, at.e, at.g, rise_a + rise_b, violation);
  }

  const WidePiece &a_, &b_;
  NodeNumbering numbers_;
  Wide epsilon_;
  Wide tolerance_;  ///< of the core's search: below it a sign may be rounding [m]
  const PairMarks* marks_;
  std::vector<Plane> planes_;
  FixedObstacle built_;
};

}  // namespace

WideTurn::WideTurn(const std::array<double, 4>& q) {
  const auto x = static_cast<Wide>(q[0]), y = static_cast<Wide>(q[1]), z = static_cast<Wide>(q[2]),
             w = static_cast<Wide>(q[3]);
  const Wide s = 2 / (x * x + y * y + z * z + w * w);
  row_[0] = {1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)};
  row_[1] = {s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)};
  row_[2] = {s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)};
}

Wide3 WideTurn::operator()(const Wide3& v) const {
  return {dot(row_[0], v), dot(row_[1], v), dot(row_[2], v)};
}

WidePiece turned(const WidePiece& piece, const WideTurn& turn) {
  WidePiece result = piece;
  for (Wide3& v : result.vertices) v = turn(v);
  for (Wide3& n : result.normals) n = turn(n);
  for (Wide3& u : result.along) u = turn(u);
  return result;
}

FixedObstacle fixed_obstacle(const WidePiece& a, const WidePiece& b, double epsilon_m,
                             double size_m, const PairMarks* marks) {
  return ObstacleBuilder(a, b, epsilon_m, size_m, marks).build();
}

}  // namespace haptic::tools
