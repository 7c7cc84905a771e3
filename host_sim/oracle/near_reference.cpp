// SPDX-License-Identifier: Apache-2.0
#include "host_sim/oracle/near_reference.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace haptic::sim {
namespace {

using Point = std::array<double, 3>;

/// Values closer to the largest one than this are evaluated again in long double. Far above the
/// rounding of the double search.
constexpr double kBand_m = 1e-7;
/// Of a dot of a unit normal and an edge, per length of the edge.
constexpr double kSignSlack = 1e-12;
constexpr double kParallelSine = 1e-12;  // below the one of every scalar of the core

double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Point narrow(const WideVec& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}
std::vector<Point> narrow(const std::vector<WideVec>& list) {
  std::vector<Point> points;
  for (const WideVec& v : list) points.push_back(narrow(v));
  return points;
}

/// min over `points` of n.p.
double least_along(const Point& n, const std::vector<Point>& points) {
  double least = std::numeric_limits<double>::infinity();
  for (const Point& p : points) least = std::min(least, dot(n, p));
  return least;
}

Point negated(const Point& n) { return {-n[0], -n[1], -n[2]}; }

/// Both on one side of zero by more than `slack`.
bool same_side(double x, double y, double slack) {
  return (x > slack && y > slack) || (x < -slack && y < -slack);
}

}  // namespace

NearReference::NearReference(OraclePiece a, OraclePiece b)
    : a_(std::move(a)),
      b_(std::move(b)),
      size_m_(std::max(diameter(a_.vertices), diameter(b_.vertices))),
      va_local_(narrow(a_.vertices)),
      na_local_(narrow(a_.normals)),
      va_(va_local_),
      na_(na_local_),
      vb_(narrow(b_.vertices)),
      nb_(narrow(b_.normals)),
      ea_(a_.edges.size()),
      face_a_m_(a_.loops.size()),
      face_b_m_(b_.loops.size()) {
  for (const OracleEdge& e : b_.edges) {
    eb_.push_back({vb_[e.vertex[0]],
                   minus(vb_[e.vertex[1]], vb_[e.vertex[0]]),
                   {nb_[e.face[0]], nb_[e.face[1]]}});
  }
}

std::uint64_t NearReference::node_count() const {
  return std::uint64_t{a_.loops.size()} * b_.vertices.size() +
         std::uint64_t{a_.vertices.size()} * b_.loops.size() +
         std::uint64_t{a_.edges.size()} * b_.edges.size();
}

double NearReference::face_values() {
  double largest = -std::numeric_limits<double>::infinity();
  for (std::size_t f = 0; f < face_a_m_.size(); ++f) {
    const Point n = negated(na_[f]);
    face_a_m_[f] = dot(n, va_[a_.loops[f].front()]) + least_along(na_[f], vb_);
    largest = std::max(largest, face_a_m_[f]);
  }
  for (std::size_t f = 0; f < face_b_m_.size(); ++f) {
    face_b_m_[f] = least_along(nb_[f], va_) - dot(nb_[f], vb_[b_.loops[f].front()]);
    largest = std::max(largest, face_b_m_[f]);
  }
  return largest;
}

void NearReference::keep_edges(double face_value_m) {
  kept_.clear();
  for (std::uint32_t g = 0; g < eb_.size(); ++g) {
    const Edge& eb = eb_[g];
    const double v_norm = std::sqrt(dot(eb.along, eb.along));
    for (std::uint32_t e = 0; e < ea_.size(); ++e) {
      const Edge& ea = ea_[e];
      // Lengths of edges are below 1 m here, so the slack holds for both dots.
      if (same_side(dot(eb.normal[0], ea.along), dot(eb.normal[1], ea.along), kSignSlack)) continue;
      if (same_side(dot(ea.normal[0], eb.along), dot(ea.normal[1], eb.along), kSignSlack)) continue;
      const Point m = cross(ea.along, eb.along), w = minus(ea.vertex, eb.vertex);
      const double m_norm = std::sqrt(dot(m, m)),
                   sine = m_norm / (v_norm * std::sqrt(dot(ea.along, ea.along)));
      if (sine < kParallelSine) continue;
      // Whichever orientation of m is the outward one: its value is at most this.
      const double value = std::abs(dot(m, w)) / m_norm;
      const double side = dot(m, eb.normal[0]) + dot(m, eb.normal[1]);
      const double outward = side < 0 ? -dot(m, w) / m_norm : dot(m, w) / m_norm;
      const bool sure = std::abs(side) > 1e-6 * m_norm;
      const double error = 1e-14 / sine * std::sqrt(dot(w, w));
      if ((sure ? outward : value) + error < face_value_m - kBand_m) continue;
      kept_.push_back({e, g});
    }
  }
}

NearTruth NearReference::at(const OraclePose& pose) {
  const Point rows[3] = {narrow(pose.r.row[0]), narrow(pose.r.row[1]), narrow(pose.r.row[2])};
  const Point x = narrow(pose.x);
  const auto turned = [&rows](const Point& v) {
    return Point{dot(rows[0], v), dot(rows[1], v), dot(rows[2], v)};
  };
  for (std::size_t v = 0; v < va_.size(); ++v) {
    const Point r = turned(va_local_[v]);
    va_[v] = {x[0] + r[0], x[1] + r[1], x[2] + r[2]};
  }
  for (std::size_t f = 0; f < na_.size(); ++f) na_[f] = turned(na_local_[f]);
  for (std::size_t e = 0; e < ea_.size(); ++e) {
    const OracleEdge& edge = a_.edges[e];
    ea_[e] = {va_[edge.vertex[0]],
              minus(va_[edge.vertex[1]], va_[edge.vertex[0]]),
              {na_[edge.face[0]], na_[edge.face[1]]}};
  }
  const double face_value = face_values();
  keep_edges(face_value);
  PairSearch search(a_, b_, pose, size_m_, precision_of_real());
  std::vector<PairSearch::Plane> planes;
  for (std::uint32_t f = 0; f < face_a_m_.size(); ++f) {
    if (face_a_m_[f] < face_value - kBand_m) continue;
    search.add_face_a(f);
    planes.push_back(search.last());
  }
  for (std::uint32_t f = 0; f < face_b_m_.size(); ++f) {
    if (face_b_m_[f] < face_value - kBand_m) continue;
    search.add_face_b(f);
    planes.push_back(search.last());
  }
  for (const EdgePair& pair : kept_) {
    if (search.add_edge_pair(pair.a, pair.b)) planes.push_back(search.last());
  }
  NearTruth result;
  result.truth = search.truth();
  for (const PairSearch::Plane& plane : planes) {
    if (plane.value_m >= result.truth.reference_m - widen(kTie_m))
      result.normals.push_back(plane.normal);
  }
  return result;
}

}  // namespace haptic::sim
