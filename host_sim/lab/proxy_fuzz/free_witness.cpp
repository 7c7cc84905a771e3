// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/proxy_fuzz/free_witness.hpp"

#include <algorithm>

namespace haptic::sim {
namespace {

constexpr int kLongestClimb = 24;
/// Cross products of edges closer to parallel than this say nothing that faces do not.
constexpr Wide kLeastSine = 1e-12L;

WideVec turned_back(const WideRotation& r, const WideVec& v) {
  return v.x * r.row[0] + v.y * r.row[1] + v.z * r.row[2];
}

WideVec along(const OraclePiece& piece, std::uint32_t edge) {
  const OracleEdge& e = piece.edges[edge];
  return piece.vertices[e.vertex[1]] - piece.vertices[e.vertex[0]];
}

}  // namespace

FreeWitness::Incidence::Incidence(const OraclePiece& piece)
    : faces(piece.vertices.size()), edges(piece.vertices.size()) {
  for (std::uint32_t f = 0; f < piece.loops.size(); ++f) {
    for (const std::uint32_t v : piece.loops[f]) faces[v].push_back(f);
  }
  for (std::uint32_t e = 0; e < piece.edges.size(); ++e) {
    for (const std::uint32_t v : piece.edges[e].vertex) edges[v].push_back(e);
  }
  for (const WideVec& v : piece.vertices) centre = centre + v;
  centre = (1.0L / static_cast<Wide>(piece.vertices.size())) * centre;
  for (const WideVec& v : piece.vertices) radius_m = std::max(radius_m, norm(v - centre));
}

FreeWitness::FreeWitness(const OraclePiece& a, const OraclePiece& b)
    : a_(a),
      b_(b),
      at_a_(a),
      at_b_(b),
      size_m_(std::max(diameter(a.vertices), diameter(b.vertices))) {}

bool FreeWitness::normal_of(const OraclePose& pose, const Direction& d, WideVec& normal) const {
  switch (d.kind) {
    case Kind::kFaceA:
      normal = -1.0L * (pose.r * a_.normals[d.i]);
      return true;
    case Kind::kFaceB:
      normal = b_.normals[d.j];
      return true;
    case Kind::kEdges:
      break;
  }
  const WideVec u = pose.r * along(a_, d.i), v = along(b_, d.j);
  const WideVec n = cross(u, v);
  const Wide length = norm(n);
  if (!(length > kLeastSine * norm(u) * norm(v))) return false;
  normal = (d.sign / length) * n;
  return true;
}

FreeGap FreeWitness::gap_along(const OraclePose& pose, const WideVec& normal) const {
  FreeGap gap;
  gap.normal_w = normal;
  const WideVec in_a = turned_back(pose.r, normal);
  Wide lowest = std::numeric_limits<Wide>::infinity(), highest = -lowest;
  for (std::uint32_t v = 0; v < a_.vertices.size(); ++v) {
    const Wide height = dot(in_a, a_.vertices[v]);
    if (height < lowest) {
      lowest = height;
      gap.vertex_a = v;
    }
  }
  for (std::uint32_t v = 0; v < b_.vertices.size(); ++v) {
    const Wide height = dot(normal, b_.vertices[v]);
    if (height > highest) {
      highest = height;
      gap.vertex_b = v;
    }
  }
  gap.gap_m = dot(normal, pose.x) + lowest - highest;
  return gap;
}

void FreeWitness::consider(const OraclePose& pose, const Direction& d, Direction& best,
                           FreeGap& gap) const {
  WideVec normal;
  if (!normal_of(pose, d, normal)) return;
  const FreeGap found = gap_along(pose, normal);
  if (!(found.gap_m > gap.gap_m)) return;
  gap = found;
  best = d;
}

/// Goes to the best of the directions whose planes touch both support vertices, while it gains.
void FreeWitness::climb(const OraclePose& pose, Wide wanted_m, Direction& best,
                        FreeGap& gap) const {
  for (int step = 0; step < kLongestClimb && gap.gap_m < wanted_m; ++step) {
    const FreeGap from = gap;
    for (const std::uint32_t f : at_a_.faces[from.vertex_a]) {
      consider(pose, {Kind::kFaceA, f, 0, 1}, best, gap);
    }
    for (const std::uint32_t f : at_b_.faces[from.vertex_b]) {
      consider(pose, {Kind::kFaceB, 0, f, 1}, best, gap);
    }
    for (const std::uint32_t e : at_a_.edges[from.vertex_a]) {
      for (const std::uint32_t g : at_b_.edges[from.vertex_b]) {
        consider(pose, {Kind::kEdges, e, g, 1}, best, gap);
        consider(pose, {Kind::kEdges, e, g, -1}, best, gap);
      }
    }
    if (!(gap.gap_m > from.gap_m)) return;
  }
}

FreeGap FreeWitness::find(const OraclePose& pose, Wide wanted_m) {
  FreeGap gap;
  Direction best = last_;
  consider(pose, last_, best, gap);
  if (gap.gap_m < wanted_m && gap.gap_m > -size_m_) climb(pose, wanted_m, best, gap);
  if (gap.gap_m < wanted_m) {
    for (std::uint32_t f = 0; f < a_.loops.size(); ++f) {
      consider(pose, {Kind::kFaceA, f, 0, 1}, best, gap);
    }
    for (std::uint32_t f = 0; f < b_.loops.size(); ++f) {
      consider(pose, {Kind::kFaceB, 0, f, 1}, best, gap);
    }
    climb(pose, wanted_m, best, gap);
  }
  last_ = best;
  return gap;
}

Wide FreeWitness::exhaustive_m(const OraclePose& pose) const {
  return search_pair(a_, b_, pose, size_m_, precision_of_real()).reference_m;
}

bool FreeWitness::far(const OraclePose& pose, Wide distance_m) const {
  const WideVec between = pose.x + pose.r * at_a_.centre - at_b_.centre;
  return norm(between) - at_a_.radius_m - at_b_.radius_m > distance_m;
}

}  // namespace haptic::sim
