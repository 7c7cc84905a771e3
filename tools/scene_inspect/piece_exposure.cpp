// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_inspect/piece_exposure.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/pruning/spherical_sets.hpp"

namespace haptic::tools {
namespace {

/// A face plane, outward.
struct OutwardPlane {
  Direction normal{};
  double offset_m = 0.0;
  std::uint32_t plane = 0;
  int sign = 1;
  [[nodiscard]] double height(const Direction& p) const { return vec::dot(normal, p) - offset_m; }
};

/// One piece in double, with its box.
struct Hull {
  explicit Hull(const PieceView& piece) : view(piece) {
    for (std::uint32_t v = 0; v < piece.vertex_count; ++v) {
      const auto x = piece.vertex(v);
      vertices.push_back(
          {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])});
      box.include(vertices.back());
    }
    for (std::uint32_t f = 0; f < piece.face_count; ++f) {
      const PlaneRecord& plane = piece.planes[piece.faces[f].plane];
      const int sign = piece.faces[f].sign;
      planes.push_back({{sign * static_cast<double>(plane.normal[0]),
                         sign * static_cast<double>(plane.normal[1]),
                         sign * static_cast<double>(plane.normal[2])},
                        sign * static_cast<double>(plane.offset_m),
                        piece.faces[f].plane,
                        sign});
    }
  }
  [[nodiscard]] bool has_plane(const OutwardPlane& own) const {
    return std::any_of(planes.begin(), planes.end(), [&](const OutwardPlane& p) {
      return p.plane == own.plane && p.sign == own.sign;
    });
  }
  PieceView view;
  std::vector<Direction> vertices;
  std::vector<OutwardPlane> planes;  ///< by face
  vec::Box box;
};

/// Twice the area over the perimeter: some half of the width.
double width_of(const FragmentPolygon& polygon) {
  Direction area{0, 0, 0};
  double perimeter = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Direction& next = polygon[(i + 1) % polygon.size()];
    area = vec::add(area, vec::cross(vec::sub(polygon[i], polygon[0]), vec::sub(next, polygon[0])));
    perimeter += vec::distance(polygon[i], next);
  }
  return perimeter > 0.0 ? vec::norm(area) / perimeter : 0.0;
}

class BodyExposure {
 public:
  BodyExposure(const SceneView& view, const BodyRecord& body, double tolerance_m)
      : tolerance_m_(tolerance_m) {
    for (std::uint32_t i = 0; i < body.piece_count; ++i) {
      hulls_.emplace_back(view.piece(body.piece_begin + i));
    }
  }

  std::vector<PieceExposure> run() {
    std::vector<PieceExposure> result(hulls_.size());
    for (std::size_t i = 0; i < hulls_.size(); ++i) {
      others_.clear();
      for (std::size_t j = 0; j < hulls_.size(); ++j) {
        if (j != i && hulls_[i].box.grown(4 * tolerance_m_).meets(hulls_[j].box)) {
          others_.push_back(&hulls_[j]);
        }
      }
      expose_faces(hulls_[i], result[i]);
      expose_edges(hulls_[i], result[i]);
      expose_vertices(hulls_[i], result[i]);
    }
    return result;
  }

 private:
  /// Height over a plane; zero within tolerance: where a plane that is almost parallel to an edge
  /// cuts it, rounding would move the point along the edge by much more.
  [[nodiscard]] double height(const OutwardPlane& plane, const Direction& p) const {
    const double h = plane.height(p);
    return std::abs(h) <= 2 * tolerance_m_ ? 0.0 : h;
  }

  /// The part of `polygon` on one side of a plane; `side` 1: above it.
  [[nodiscard]] FragmentPolygon clipped(const FragmentPolygon& polygon, const OutwardPlane& plane,
                                        double side) const {
    FragmentPolygon result;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Direction &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
      const double at_p = side * height(plane, p), at_q = side * height(plane, q);
      if (at_p >= 0.0) result.push_back(p);
      if ((at_p > 0.0 && at_q < 0.0) || (at_p < 0.0 && at_q > 0.0)) {
        result.push_back(vec::add(p, vec::scaled(vec::sub(q, p), at_p / (at_p - at_q))));
      }
    }
    return result;
  }

  [[nodiscard]] bool is_thin(const FragmentPolygon& polygon) const {
    return polygon.size() < 3 || width_of(polygon) <= 8 * tolerance_m_;
  }

  [[nodiscard]] bool lies_in(const FragmentPolygon& polygon, const OutwardPlane& plane) const {
    return std::all_of(polygon.begin(), polygon.end(),
                       [&](const Direction& p) { return height(plane, p) == 0.0; });
  }

  /// Appends what `other` leaves of a polygon; true when it covers some of it.
  bool cut_away(const Hull& other, const FragmentPolygon& polygon,
                std::vector<FragmentPolygon>& left) const {
    FragmentPolygon inside = polygon;
    std::vector<FragmentPolygon> outside;
    for (const OutwardPlane& plane : other.planes) {
      if (lies_in(polygon, plane)) continue;  // nothing to cut off
      FragmentPolygon above = clipped(inside, plane, 1.0);
      if (!is_thin(above)) outside.push_back(std::move(above));
      inside = clipped(inside, plane, -1.0);
      if (is_thin(inside)) {
        left.push_back(polygon);
        return false;
      }
    }
    std::move(outside.begin(), outside.end(), std::back_inserter(left));
    return true;
  }

  void expose_faces(const Hull& hull, PieceExposure& exposure) const {
    for (std::uint32_t f = 0; f < hull.view.face_count; ++f) {
      std::vector<FragmentPolygon> open(1);
      for (const std::uint16_t v : hull.view.face_vertices(f)) {
        open[0].push_back(hull.vertices[v]);
      }
      bool cut = false;
      for (const Hull* const other : others_) {
        if (other->has_plane(hull.planes[f])) continue;
        std::vector<FragmentPolygon> left;
        for (const FragmentPolygon& polygon : open) {
          cut |= cut_away(*other, polygon, left);
        }
        open = std::move(left);
      }
      exposure.face_hidden.push_back(open.empty());
      exposure.face_fragments.push_back(cut ? std::move(open) : std::vector<FragmentPolygon>{});
    }
  }

  /// An edge of a piece, its line and the plane of directions about it.
  struct Edge {
    Direction from{}, to{}, along{}, first{}, second{};
    double length_m = 0.0, arc_rad = 0.0;  ///< of the normals, from `first` on
    /// Angle of a normal about the edge, -pi to pi.
    [[nodiscard]] double angle(const Direction& n) const {
      return std::atan2(vec::dot(n, second), vec::dot(n, first));
    }
    [[nodiscard]] Direction normal(double angle_rad) const {
      return vec::add(vec::scaled(first, std::cos(angle_rad)),
                      vec::scaled(second, std::sin(angle_rad)));
    }
  };
  struct Arc {
    double begin_rad = 0.0, end_rad = 0.0;
  };
  /// Effect of a piece on a part of an edge, in shares of the way.
  struct Overlap {
    double begin = 0.0, end = 1.0;
    std::optional<Arc> arc;  ///< of its own normals there; nothing: not an edge of the piece
  };

  static Edge edge_of(const Hull& hull, std::uint32_t e) {
    const EdgeRecord& record = hull.view.edges[e];
    Edge edge;
    edge.from = hull.vertices[record.vertex[0]];
    edge.to = hull.vertices[record.vertex[1]];
    edge.length_m = vec::distance(edge.from, edge.to);
    edge.along = vec::unit(vec::sub(edge.to, edge.from));
    edge.first = hull.planes[record.face[0]].normal;
    edge.second = vec::cross(edge.along, edge.first);
    edge.arc_rad = edge.angle(hull.planes[record.face[1]].normal);
    return edge;
  }

  [[nodiscard]] std::optional<Overlap> overlap_of(const Hull& other, const Edge& edge) const {
    Overlap overlap;
    std::vector<double> angles;
    for (const OutwardPlane& plane : other.planes) {
      const double a = height(plane, edge.from), b = height(plane, edge.to);
      if (a == 0.0 && b == 0.0) {
        angles.push_back(edge.angle(plane.normal));
        continue;
      }
      if (a <= 0.0 && b <= 0.0) continue;
      if (a >= 0.0 && b >= 0.0) return std::nullopt;
      double& end = a > 0.0 ? overlap.begin : overlap.end;
      end = a > 0.0 ? std::max(end, a / (a - b)) : std::min(end, a / (a - b));
    }
    if ((overlap.end - overlap.begin) * edge.length_m <= 4 * tolerance_m_) return std::nullopt;
    if (angles.size() >= 2) {
      // The shorter way round: the normals of an edge of a convex piece.
      Arc arc{angles[0], angles[1]};
      double turn = std::remainder(arc.end_rad - arc.begin_rad, 2 * std::numbers::pi);
      if (turn < 0.0) {
        arc.begin_rad = angles[1];
        turn = -turn;
      }
      arc.end_rad = arc.begin_rad + turn;
      overlap.arc = arc;
    }
    return overlap;
  }

  /// Intersection of two arcs shorter than pi, if it is more than a direction.
  static std::optional<Arc> common(const Arc& a, const Arc& b) {
    for (const double turn : {-2 * std::numbers::pi, 0.0, 2 * std::numbers::pi}) {
      const Arc both{std::max(a.begin_rad, b.begin_rad + turn),
                     std::min(a.end_rad, b.end_rad + turn)};
      if (both.end_rad - both.begin_rad > kThinnest_rad) return both;
    }
    return std::nullopt;
  }

  void expose_edges(const Hull& hull, PieceExposure& exposure) const {
    for (std::uint32_t e = 0; e < hull.view.edge_count; ++e) {
      std::vector<ExposedArc> open = open_arcs(hull, e);
      exposure.edge_hidden.push_back(open.empty());
      exposure.edge_arcs.push_back(std::move(open));
    }
  }

  /// Stretches of an edge that the other pieces leave open, in its order.
  [[nodiscard]] std::vector<ExposedArc> open_arcs(const Hull& hull, std::uint32_t e) const {
    const Edge edge = edge_of(hull, e);
    std::vector<Overlap> overlaps;
    std::vector<double> ends{0.0, 1.0};
    for (const Hull* const other : others_) {
      const auto overlap = overlap_of(*other, edge);
      if (!overlap) continue;
      overlaps.push_back(*overlap);
      ends.insert(ends.end(), {overlap->begin, overlap->end});
    }
    std::sort(ends.begin(), ends.end());
    std::vector<ExposedArc> open;
    for (std::size_t k = 0; k + 1 < ends.size(); ++k) {
      if ((ends[k + 1] - ends[k]) * edge.length_m <= 4 * tolerance_m_) continue;
      const double middle = (ends[k] + ends[k + 1]) / 2;
      std::optional<Arc> arc = Arc{0.0, edge.arc_rad};
      for (const Overlap& o : overlaps) {
        if (!arc || middle < o.begin || middle > o.end) continue;
        arc = o.arc ? common(*arc, *o.arc) : std::nullopt;
      }
      if (!arc) continue;
      open.push_back(
          {ends[k], ends[k + 1], edge.normal(arc->begin_rad), edge.normal(arc->end_rad)});
    }
    return open;
  }

  /// An open edge of the piece ends at its vertex `v`: no other piece carries it on.
  [[nodiscard]] bool edge_ends_at(const Hull& hull, std::uint32_t v) const {
    for (const std::uint16_t e : hull.view.edges_at(v)) {
      const std::vector<ExposedArc> open = open_arcs(hull, e);
      if (open.empty()) continue;
      const Edge edge = edge_of(hull, e);
      const bool at_begin = hull.view.edges[e].vertex[0] == v;
      const double gap = at_begin ? open.front().begin : 1.0 - open.back().end;
      if (gap * edge.length_m > 4 * tolerance_m_) continue;
      const ExposedArc& last = at_begin ? open.front() : open.back();
      if (!goes_on(last, hull.vertices[v], at_begin ? edge.along : vec::scaled(edge.along, -1.0))) {
        return true;
      }
    }
    return false;
  }

  /// Another piece has an edge between the normals of `arc` at `point`, on the side away from
  /// `back`.
  [[nodiscard]] bool goes_on(const ExposedArc& arc, const Direction& point,
                             const Direction& back) const {
    const auto equal = [](const Direction& l, const Direction& r) {
      return vec::norm(vec::sub(l, r)) <= kThinnest_rad;
    };
    for (const Hull* const other : others_) {
      for (std::uint32_t e = 0; e < other->view.edge_count; ++e) {
        const EdgeRecord& record = other->view.edges[e];
        const Direction& first = other->planes[record.face[0]].normal;
        const Direction& second = other->planes[record.face[1]].normal;
        if (!(equal(first, arc.from) && equal(second, arc.to)) &&
            !(equal(second, arc.from) && equal(first, arc.to))) {
          continue;
        }
        const Edge edge = edge_of(*other, e);
        const Direction way = vec::sub(point, edge.from);
        const double along = vec::dot(way, edge.along);
        const double aside = vec::norm(vec::sub(way, vec::scaled(edge.along, along)));
        const bool reaches =
            along >= -4 * tolerance_m_ && along <= edge.length_m + 4 * tolerance_m_;
        if (aside > 4 * tolerance_m_ || !reaches) continue;
        const bool with_back = vec::dot(edge.along, back) > 0.0;
        const double beyond = with_back ? along : edge.length_m - along;
        if (beyond > 4 * tolerance_m_) return true;
      }
    }
    return false;
  }

  /// Unit directions along which the edges of a piece leave its vertex `v`.
  static void add_directions(const Hull& hull, std::uint32_t v, std::vector<Direction>& to) {
    for (const std::uint16_t e : hull.view.edges_at(v)) {
      to.push_back(vec::unit(vec::sub(hull.vertices[hull.view.other_end(e, v)], hull.vertices[v])));
    }
  }

  [[nodiscard]] std::optional<std::uint32_t> corner_at(const Hull& hull,
                                                       const Direction& point) const {
    for (std::uint32_t v = 0; v < hull.view.vertex_count; ++v) {
      if (vec::distance(hull.vertices[v], point) <= 4 * tolerance_m_) return v;
    }
    return std::nullopt;
  }

  void expose_vertices(const Hull& hull, PieceExposure& exposure) const {
    for (std::uint32_t v = 0; v < hull.view.vertex_count; ++v) {
      const Direction& point = hull.vertices[v];
      std::vector<Direction> own;
      add_directions(hull, v, own);
      std::vector<Direction> all = own;
      bool hidden = false;
      for (const Hull* const other : others_) {
        const bool holds =
            std::all_of(other->planes.begin(), other->planes.end(),
                        [&](const OutwardPlane& p) { return height(p, point) <= 0.0; });
        if (!holds) continue;
        const auto corner = corner_at(*other, point);
        hidden = hidden || !corner;
        if (corner) add_directions(*other, *corner, all);
      }
      std::vector<Direction> narrowed;
      if (!hidden && all.size() > own.size()) {
        narrowed = spherical_polygon(all).sides;
        hidden = !is_open(all);
      }
      exposure.edge_end.push_back(hidden && edge_ends_at(hull, v));
      exposure.vertex_hidden.push_back(hidden);
      exposure.vertex_cone.push_back(hidden ? std::vector<Direction>{} : std::move(narrowed));
    }
  }

  /// Some direction lies clearly on the inner side of all.
  static bool is_open(const std::vector<Direction>& sides) {
    const SphericalPolygon cone = spherical_polygon(sides);
    Direction middle{0, 0, 0};
    for (const Direction& corner : cone.corners) middle = vec::add(middle, corner);
    middle = vec::unit(middle);
    return cone.corners.size() >= 3 &&
           std::all_of(sides.begin(), sides.end(),
                       [&](const Direction& d) { return vec::dot(middle, d) < -kThinnest_rad; });
  }

  /// Directions closer than this are one [rad]: rounding of the coordinates over short edges.
  static constexpr double kThinnest_rad = sizeof(Real) == sizeof(double) ? 1.0e-9 : 1.0e-4;

  double tolerance_m_;
  std::vector<Hull> hulls_;
  std::vector<const Hull*> others_;  ///< pieces that may meet the present one
};

}  // namespace

std::vector<PieceExposure> exposure_of_body(const SceneView& view, std::uint32_t body,
                                            double tolerance_m) {
  return BodyExposure(view, view.bodies()[body], tolerance_m).run();
}

}  // namespace haptic::tools
