// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/peers/exhaustive_peer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "tools/c_space/flat_pair.hpp"

namespace haptic::sim {

using tools::operator+;
using tools::operator-;
using tools::cross;
using tools::dot;
using tools::scaled;
namespace {

/// Below this sine the plane of two edges loses digits, and the value is taken from the supports:
/// that can only lose, not lie.
constexpr double kIllConditionedSine = 0.01;
/// Below this one the edges count as parallel; the faces at them carry the value.
constexpr double kParallelSine = 1e-14;

}  // namespace

ExhaustivePeer::Body ExhaustivePeer::body_of(const PeerSolid& solid) {
  Body body;
  body.vertices = solid.vertices;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> faces_of_edge;
  for (std::uint32_t f = 0; f < solid.loops.size(); ++f) {
    const auto& loop = solid.loops[f];
    PeerVector normal{};
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const std::uint32_t from = loop[k], to = loop[(k + 1) % loop.size()];
      faces_of_edge[std::minmax(from, to)].push_back(f);
      const PeerVector c = cross(solid.vertices[from] - solid.vertices[loop[0]],
                                 solid.vertices[to] - solid.vertices[loop[0]]);
      for (std::size_t i = 0; i < 3; ++i) normal[i] += c[i];
    }
    normal = scaled(1.0 / std::sqrt(dot(normal, normal)), normal);
    body.normals.push_back(normal);
    body.offsets.push_back(dot(normal, solid.vertices[loop[0]]));
    body.face_vertex.push_back(loop[0]);
  }
  for (const auto& [ends, faces] : faces_of_edge)
    body.edges.push_back({{ends.first, ends.second}, {faces.at(0), faces.at(1)}});
  return body;
}

ExhaustivePeer::ExhaustivePeer(const PeerSolid& a, const PeerSolid& b)
    : a_(body_of(a)), b_(body_of(b)), va_(a_.vertices), na_(a_.normals), ea_(a_.edges.size()) {
  for (const EdgeIndex& e : b_.edges) {
    EdgeEntry entry;
    entry.vertex = b_.vertices[e.vertex[0]];
    entry.along = b_.vertices[e.vertex[1]] - entry.vertex;
    entry.normal[0] = b_.normals[e.face[0]];
    entry.normal[1] = b_.normals[e.face[1]];
    entry.length_squared = dot(entry.along, entry.along);
    eb_.push_back(entry);
  }
}

void ExhaustivePeer::move_a() {
  const auto& r = pose_.r_wa;
  const PeerVector& p = pose_.p_wa;
  for (std::size_t v = 0; v < va_.size(); ++v) {
    const PeerVector& a = a_.vertices[v];
    va_[v] = {p[0] + dot(r[0], a), p[1] + dot(r[1], a), p[2] + dot(r[2], a)};
  }
  for (std::size_t f = 0; f < na_.size(); ++f) {
    const PeerVector& n = a_.normals[f];
    na_[f] = {dot(r[0], n), dot(r[1], n), dot(r[2], n)};
  }
  for (std::size_t e = 0; e < ea_.size(); ++e) {
    const EdgeIndex& edge = a_.edges[e];
    EdgeEntry& entry = ea_[e];
    entry.vertex = va_[edge.vertex[0]];
    entry.along = va_[edge.vertex[1]] - entry.vertex;
    entry.normal[0] = na_[edge.face[0]];
    entry.normal[1] = na_[edge.face[1]];
    entry.length_squared = dot(entry.along, entry.along);
  }
}

void ExhaustivePeer::search_faces() {
  for (std::size_t f = 0; f < na_.size(); ++f) {
    const PeerVector& n = na_[f];
    double high = -std::numeric_limits<double>::infinity();  // of -n.b: the support of B
    for (const PeerVector& b : b_.vertices) high = std::max(high, -dot(n, b));
    const double value = -dot(n, va_[a_.face_vertex[f]]) - high;
    if (value <= best_m_) continue;
    best_m_ = value;
    normal_ = scaled(-1.0, n);
  }
  for (std::size_t f = 0; f < b_.normals.size(); ++f) {
    const PeerVector& n = b_.normals[f];
    double low = std::numeric_limits<double>::infinity();
    for (const PeerVector& a : va_) low = std::min(low, dot(n, a));
    const double value = low - b_.offsets[f];
    if (value <= best_m_) continue;
    best_m_ = value;
    normal_ = n;
  }
}

double ExhaustivePeer::gap_along(const PeerVector& n) const {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const PeerVector& a : va_) low = std::min(low, dot(n, a));
  for (const PeerVector& b : b_.vertices) high = std::max(high, dot(n, b));
  return low - high;
}

void ExhaustivePeer::search_edges() {
  for (const EdgeEntry& b : eb_) {
    for (const EdgeEntry& a : ea_) {
      // The arcs of the Gauss sphere cross: each edge parts the normals of the other.
      const double c0 = dot(b.normal[0], a.along), c1 = dot(b.normal[1], a.along);
      if (c0 * c1 >= 0) continue;
      const double d0 = dot(a.normal[0], b.along), d1 = dot(a.normal[1], b.along);
      if (d0 * d1 >= 0) continue;
      // And on one side of the sphere: the normal that is outward of B is inward of A.
      const PeerVector m = cross(a.along, b.along);
      const double out_b = dot(m, b.normal[0]) + dot(m, b.normal[1]);
      const double out_a = dot(m, a.normal[0]) + dot(m, a.normal[1]);
      if (out_a * out_b > 0) continue;
      const double m_squared = dot(m, m);
      double along = dot(m, a.vertex - b.vertex);
      if (out_b < 0) along = -along;
      // along / |m| > best without the root.
      if (best_m_ >= 0 ? (along <= 0 || along * along <= best_m_ * best_m_ * m_squared)
                       : (along < 0 && along * along >= best_m_ * best_m_ * m_squared))
        continue;
      const double lengths = a.length_squared * b.length_squared;
      if (m_squared <= kParallelSine * kParallelSine * lengths) continue;
      const double inverse = (out_b < 0 ? -1.0 : 1.0) / std::sqrt(m_squared);
      const PeerVector n = scaled(inverse, m);
      double value = along * std::abs(inverse);
      if (m_squared < kIllConditionedSine * kIllConditionedSine * lengths) {
        value = gap_along(n);
        if (value <= best_m_) continue;
      }
      best_m_ = value;
      normal_ = n;
    }
  }
}

void ExhaustivePeer::query() {
  best_m_ = -std::numeric_limits<double>::infinity();
  move_a();
  search_faces();
  search_edges();
}

PeerAnswer ExhaustivePeer::answer() const {
  PeerAnswer answer;
  answer.penetrating = best_m_ <= 0;
  answer.depth_m = best_m_;
  answer.normal_w = normal_;
  answer.patch_points = 1;
  answer.separated = SeparatedValue::kPlane;
  return answer;
}

}  // namespace haptic::sim
