// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/polyhedron/realise.hpp"

namespace haptic::tools {
namespace {

/// Exact plane through all given corners, or false.
bool plane_through_all(const CornerPlaneGraph& graph, const std::vector<Rational3>& corners,
                       const std::vector<std::uint32_t>& which, Rational3& n, Rational& d) {
  // Far pair, then the corner farthest from their line: the least amplification, and deterministic.
  std::size_t second = 0, third = 0;
  double best = 0.0;
  const Point3& a = graph.corners[which[0]];
  for (std::size_t k = 1; k < which.size(); ++k) {
    const double length = vec::distance(a, graph.corners[which[k]]);
    if (length > best) best = length, second = k;
  }
  const Point3 ab = vec::sub(graph.corners[which[second]], a);
  best = 0.0;
  for (std::size_t k = 1; k < which.size(); ++k) {
    const double area = vec::norm(vec::cross(ab, vec::sub(graph.corners[which[k]], a)));
    if (area > best) best = area, third = k;
  }
  if (!(best > 0.0)) return false;
  if (!plane_through(corners[which[0]], corners[which[second]], corners[which[third]], n, d))
    return false;
  return std::all_of(which.begin(), which.end(),
                     [&](std::uint32_t c) { return dot(n, corners[c]) == d; });
}

}  // namespace

bool plane_through(const Rational3& a, const Rational3& b, const Rational3& c, Rational3& n,
                   Rational& d) {
  n = cross(subtract(b, a), subtract(c, a));
  std::size_t main = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (std::abs(to_double(n[i])) > std::abs(to_double(n[main]))) main = i;
  }
  const Rational divisor = n[main];
  if (divisor == 0) return false;
  for (Rational& x : n) x /= divisor;
  d = dot(n, a);
  return true;
}

bool realise_unmoved(const CornerPlaneGraph& graph, bool wishes, Realisation& out) {
  out = Realisation{};
  std::vector<std::vector<std::uint32_t>> plane_corners(graph.planes.size());
  for (std::uint32_t c = 0; c < graph.corners.size(); ++c) {
    const Point3& x = graph.corners[c];
    out.corners.push_back({Rational(x[0]), Rational(x[1]), Rational(x[2])});
    for (const std::uint32_t p : graph.corner_planes[c]) plane_corners[p].push_back(c);
  }
  out.normals.resize(graph.planes.size());
  out.offsets.resize(graph.planes.size());
  for (std::uint32_t p = 0; p < graph.planes.size(); ++p) {
    if (plane_corners[p].size() < 3 ||
        !plane_through_all(graph, out.corners, plane_corners[p], out.normals[p], out.offsets[p])) {
      return false;
    }
    for (const Rational& q : out.normals[p])
      out.largest_bits = std::max(out.largest_bits, bit_size(q));
    out.largest_bits = std::max(out.largest_bits, bit_size(out.offsets[p]));
  }
  for (const Rational3& x : out.corners) {
    for (const Rational& q : x) out.largest_bits = std::max(out.largest_bits, bit_size(q));
  }
  if (!wishes) return true;
  out.wishes_kept = graph.wishes.size();
  return std::all_of(graph.wishes.begin(), graph.wishes.end(), [&](const WishedIncidence& w) {
    return dot(out.normals[w.plane], out.corners[w.corner]) == out.offsets[w.plane];
  });
}

}  // namespace haptic::tools
