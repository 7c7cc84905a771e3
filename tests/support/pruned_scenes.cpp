// SPDX-License-Identifier: Apache-2.0
#include "tests/support/pruned_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace haptic::test {
namespace {

using Wide3 = Eigen::Matrix<double, 3, 1>;

Wide3 wide(const Vec3& v) { return v.cast<double>(); }

/// Whether each side of the vertex's cone, by itself, can be kept by a direction within `angle_rad`
/// of `n`.
bool cone_in_reach(const PieceView& piece, std::uint32_t v, const Wide3& n, double angle_rad) {
  return std::ranges::all_of(piece.edges_at(v), [&](std::uint16_t e) {
    const Wide3 d = wide(piece.vertex(piece.other_end(e, v)) - piece.vertex(v)).normalized();
    return std::asin(std::clamp(d.dot(n), -1.0, 1.0)) <= angle_rad + 1e-6;
  });
}

struct Cap {
  Wide3 middle;
  double angle_rad;
};
Cap cap_of(const PieceView& piece, std::uint32_t e) {
  const Wide3 p = wide(piece.face_normal(piece.edges[e].face[0]));
  const Wide3 q = wide(piece.face_normal(piece.edges[e].face[1]));
  return {(p + q).normalized(), std::acos(std::clamp(p.dot(q), -1.0, 1.0)) / 2};
}

double angle_between(const Wide3& a, const Wide3& b) {
  return std::acos(std::clamp(a.dot(b), -1.0, 1.0));
}

/// A face, an edge or a vertex of a piece lies in a plane that the uncut body does not have.
struct CutFeatures {
  std::vector<bool> faces, edges, vertices;
};
CutFeatures cut_features(const PieceView& piece, const tools::Body& uncut, const Vec3& reference) {
  CutFeatures cut;
  cut.vertices.assign(piece.vertex_count, false);
  for (std::uint32_t f = 0; f < piece.face_count; ++f) {
    const Wide3 n = wide(piece.face_normal(f));
    const double offset = static_cast<double>(piece.face_offset(f)) + n.dot(wide(reference));
    const bool known = std::ranges::any_of(uncut.pieces[0].faces, [&](const auto& face) {
      const tools::BodyPlane& plane = uncut.planes[face.plane];
      const Wide3 m = face.sign * Wide3(plane.normal[0], plane.normal[1], plane.normal[2]);
      return (m - n).norm() < 1e-6 && std::abs(face.sign * plane.offset_m - offset) < 1e-6;
    });
    cut.faces.push_back(!known);
    if (known) continue;
    for (const std::uint16_t v : piece.face_vertices(f)) cut.vertices[v] = true;
  }
  for (std::uint32_t e = 0; e < piece.edge_count; ++e) {
    const EdgeRecord& edge = piece.edges[e];
    cut.edges.push_back(cut.faces[edge.face[0]] || cut.faces[edge.face[1]]);
  }
  return cut;
}

}  // namespace

std::vector<tools::PairMarks> all_marks(const SceneView& view) {
  std::vector<tools::PairMarks> marks;
  for (const PairRecord& pair : view.listed_pairs()) {
    tools::PairMarks all;
    all.reachable.assign(pair.node_count, true);
    all.exposed.assign(pair.node_count, true);
    marks.push_back(all);
  }
  return marks;
}

void mark_envelope(const SceneView& view, const std::array<double, 4>& q, double max_angle_rad,
                   std::vector<tools::PairMarks>& marks) {
  const Eigen::Matrix<double, 3, 3> r =
      Eigen::Quaternion<double>(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
  for (std::uint32_t p = 0; p < view.pair_count(); ++p) {
    const PairView pair = view.pair(p);
    for (std::uint32_t node = 0; node < pair.record.node_count; ++node) {
      const NodeFeatures of = node_features(pair, node);
      bool in_reach = true;
      if (of.type == ContactType::kA) {
        in_reach =
            cone_in_reach(pair.b, of.j, -(r * wide(pair.a.face_normal(of.i))), max_angle_rad);
      } else if (of.type == ContactType::kB) {
        in_reach = cone_in_reach(pair.a, of.i, -(r.transpose() * wide(pair.b.face_normal(of.j))),
                                 max_angle_rad);
      } else {
        const Cap a = cap_of(pair.a, of.i), b = cap_of(pair.b, of.j);
        in_reach = angle_between(-(r * a.middle), b.middle) <=
                   a.angle_rad + b.angle_rad + max_angle_rad + 1e-6;
      }
      if (!in_reach) marks[p].reachable[node] = false;
    }
  }
}

void mark_cuts(const SceneView& view, std::uint32_t body, const tools::Body& uncut,
               std::vector<tools::PairMarks>& marks) {
  for (std::uint32_t p = 0; p < view.pair_count(); ++p) {
    const PairView pair = view.pair(p);
    const bool of_a = body == 0;
    const PieceView& piece = of_a ? pair.a : pair.b;
    if (piece.record->body != body) continue;
    const double* at = view.bodies()[body].reference_m;
    const CutFeatures cut = cut_features(
        piece, uncut,
        Vec3(static_cast<Real>(at[0]), static_cast<Real>(at[1]), static_cast<Real>(at[2])));
    for (std::uint32_t node = 0; node < pair.record.node_count; ++node) {
      const NodeFeatures of = node_features(pair, node);
      const std::uint32_t k = of_a ? of.i : of.j;
      const bool face = of.type == (of_a ? ContactType::kA : ContactType::kB);
      const bool hidden = of.type == ContactType::kC ? cut.edges[k]
                          : face                     ? cut.faces[k]
                                                     : cut.vertices[k];
      if (hidden) marks[p].exposed[node] = false;
    }
  }
}

tools::SceneDescription with_envelope(tools::SceneDescription description,
                                      const std::array<double, 4>& q_wa, double max_angle_rad) {
  const LoadedScene all(description);
  if (description.marks.empty()) description.marks = all_marks(all.view);
  mark_envelope(all.view, q_wa, max_angle_rad, description.marks);
  description.orientation = tools::OrientationEnvelope{q_wa, max_angle_rad};
  return description;
}

tools::Body cut_box(const Point& lo, const Point& hi, const std::vector<double>& cuts_x,
                    const std::vector<std::vector<double>>& cuts_y) {
  std::vector<tools::Body> pieces;
  double from_x = lo[0];
  for (std::size_t i = 0; i <= cuts_x.size(); ++i) {
    const double to_x = i < cuts_x.size() ? cuts_x[i] : hi[0];
    double from_y = lo[1];
    for (std::size_t j = 0; j <= cuts_y[i].size(); ++j) {
      const double to_y = j < cuts_y[i].size() ? cuts_y[i][j] : hi[1];
      pieces.push_back(box({from_x, from_y, lo[2]}, {to_x, to_y, hi[2]}));
      from_y = to_y;
    }
    from_x = to_x;
  }
  tools::Body joined = join(pieces);
  // Corners of the uncut box are vertices of the mesh, the others are made by the cuts.
  for (tools::ConvexPiece& piece : joined.pieces) {
    piece.source_vertex.assign(piece.vertices.size(), -1);
    for (std::size_t v = 0; v < piece.vertices.size(); ++v) {
      std::int64_t corner = 0;
      bool is_corner = true;
      for (std::size_t k = 0; k < 3; ++k) {
        const double x = piece.vertices[v][k];
        is_corner = is_corner && (x == lo[k] || x == hi[k]);
        corner |= x == hi[k] ? std::int64_t{1} << k : 0;
      }
      if (is_corner) piece.source_vertex[v] = corner;
    }
  }
  return joined;
}

}  // namespace haptic::test
