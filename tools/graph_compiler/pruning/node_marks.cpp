// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/pruning/node_marks.hpp"

#include <algorithm>

#include "rt_core/scene/graph_rule.hpp"

namespace haptic::tools {
namespace {

template <typename T>
std::size_t open_count(const std::vector<std::vector<T>>& cones) {
  return static_cast<std::size_t>(
      std::count_if(cones.begin(), cones.end(), [](const auto& open) { return !open.empty(); }));
}

/// Marks the nodes of one type after the other: every feature of A with every feature of B, A
/// outermost.
class NodeMarker {
 public:
  explicit NodeMarker(PairMarks& marks) : marks_(marks) {}

  /// `of`: the features' whole cones; `open`: what the body leaves of each, several or none.
  /// `meets(i, cone of i, j, cone of j)`: some orientation brings the two together. `anywhere`:
  /// open features are exposed regardless of the orientations.
  template <typename OfA, typename OfB, typename Meets>
  void add(const std::vector<OfA>& of_a, const std::vector<OfB>& of_b,
           const std::vector<std::vector<OfA>>& open_a, const std::vector<std::vector<OfB>>& open_b,
           const Meets& meets, bool anywhere = false) {
    for (std::size_t i = 0; i < of_a.size(); ++i) {
      for (std::size_t j = 0; j < of_b.size(); ++j) {
        const bool reachable = meets(i, of_a[i], j, of_b[j]);
        bool exposed = anywhere && !open_a[i].empty() && !open_b[j].empty();
        for (std::size_t s = 0; !anywhere && reachable && !exposed && s < open_a[i].size(); ++s) {
          for (std::size_t t = 0; !exposed && t < open_b[j].size(); ++t) {
            exposed = meets(i, open_a[i][s], j, open_b[j][t]);
          }
        }
        marks_.reachable.push_back(reachable);
        marks_.exposed.push_back(exposed);
      }
    }
  }

 private:
  PairMarks& marks_;
};

NodeCounts marked(const NodeNumbering& nodes, const PairMarks& marks,
                  bool (*counts)(const PairMarks&, std::size_t)) {
  NodeCounts result;
  for (std::size_t node = 0; node < marks.reachable.size(); ++node) {
    if (!counts(marks, node)) continue;
    ++(node < nodes.count_a()                     ? result.a
       : node < nodes.count_a() + nodes.count_b() ? result.b
                                                  : result.c);
  }
  return result;
}

}  // namespace

NodeCounts& NodeCounts::operator+=(const NodeCounts& other) {
  a += other.a;
  b += other.b;
  c += other.c;
  return *this;
}

PairMarks prune_pair(const PieceShape& a, const PieceShape& b,
                     const std::optional<OrientationEnvelope>& envelope) {
  PairMarks marks;
  NodeMarker marker(marks);
  const double angle_rad = max_angle_of(envelope);
  const auto forward = [&](std::size_t, const auto& of_a, std::size_t, const auto& of_b) {
    return within_envelope(of_a, of_b, angle_rad);
  };
  const auto backward = [&](std::size_t, const auto& of_a, std::size_t, const auto& of_b) {
    return within_envelope(of_b, of_a, angle_rad);
  };
  marker.add(a.face_cones, b.vertex_cones, a.open_faces, b.open_vertices, forward);
  marker.add(a.vertex_cones, b.face_cones, a.open_vertices, b.open_faces, backward);
  marker.add(a.edge_cones, b.edge_cones, a.open_edges, b.open_edges, forward);
  return marks;
}

PairMarks near_marks(const PieceShape& a, const PieceShape& b, const NearCones& near_a,
                     const NearCones& near_b, const std::optional<OrientationEnvelope>& envelope) {
  PairMarks marks;
  NodeMarker marker(marks);
  const double angle_rad = max_angle_of(envelope);
  marker.add(
      a.face_cones, b.vertex_cones, a.open_faces, near_b.open_vertices,
      [&](std::size_t, const Direction& face, std::size_t v, const SphericalPolygon& cone) {
        return within_envelope(face, cone, angle_rad + near_b.vertex_reach_rad[v]);
      },
      true);
  marker.add(
      a.vertex_cones, b.face_cones, near_a.open_vertices, b.open_faces,
      [&](std::size_t v, const SphericalPolygon& cone, std::size_t, const Direction& face) {
        return within_envelope(face, cone, angle_rad + near_a.vertex_reach_rad[v]);
      },
      true);
  marker.add(
      near_a.edges, near_b.edges, near_a.open_edges, near_b.open_edges,
      [&](std::size_t, const NearArc& of_a, std::size_t, const NearArc& of_b) {
        return of_a.all_round || of_b.all_round || within_envelope(of_a.arc, of_b.arc, angle_rad);
      },
      true);
  return marks;
}

PairCounts count_nodes(const PieceShape& a, const PieceShape& b, const PairMarks& marks) {
  const NodeNumbering nodes = numbering(a.topology.view(), b.topology.view());
  PairCounts counts;
  counts.nodes = {nodes.count_a(), nodes.count_b(),
                  static_cast<std::size_t>(nodes.count()) - nodes.count_a() - nodes.count_b()};
  counts.open = {open_count(a.open_faces) * open_count(b.open_vertices),
                 open_count(a.open_vertices) * open_count(b.open_faces),
                 open_count(a.open_edges) * open_count(b.open_edges)};
  counts.reachable = marked(
      nodes, marks, [](const PairMarks& m, std::size_t node) -> bool { return m.reachable[node]; });
  counts.live =
      marked(nodes, marks, [](const PairMarks& m, std::size_t node) { return m.live(node); });
  return counts;
}

}  // namespace haptic::tools
