// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/surface/facet_merge.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/surface/triangle_crossing.hpp"

namespace haptic::tools {
namespace {

/// A round that changes less than this share of the polygons is the last.
constexpr double kWorthARound = 1.0e-3;

using Loop = std::vector<std::uint32_t>;

/// A side of a polygon; equal keys are the same edge of the mesh.
struct PolygonSide {
  std::uint64_t key = 0;  ///< smaller end in the upper half
  std::uint32_t face = 0;
  bool forward = false;
};

/// Two polygons that share a side, candidates for a union.
struct Seam {
  double square = 0.0;  ///< of its length
  std::uint32_t f = 0, g = 0, u = 0, v = 0;
};

class FacetMerger {
 public:
  FacetMerger(const std::vector<Point3>& points, std::vector<Loop>& loops,
              std::vector<std::uint32_t>& source, const MergeLimits& limits)
      : points_(points), loops_(loops), source_(source), limits_(limits) {}

  void run() {
    for (int round = 0; round < kMergeRounds; ++round) {
      const std::size_t merged = merge_seams();
      const std::size_t straightened = merged > 0 || round == 0 ? drop_straight_corners() : 0;
      const auto least =
          static_cast<std::size_t>(kWorthARound * static_cast<double>(loops_.size()));
      if (merged + straightened <= least) break;
    }
  }

 private:
  [[nodiscard]] std::uint32_t face_of(std::uint32_t f) {
    while (parent_[f] != f) {
      parent_[f] = parent_[parent_[f]];
      f = parent_[f];
    }
    return f;
  }

  [[nodiscard]] Point3 normal_of(const Loop& loop) {
    corners_.clear();
    for (const std::uint32_t v : loop) corners_.push_back(points_[v]);
    return vec::unit(exact_twice_area(corners_.data(), corners_.size()));
  }

  [[nodiscard]] bool is_flat(const Loop& loop, const Point3& normal) const {
    for (const std::uint32_t v : loop) {
      const double height = vec::dot(normal, vec::sub(points_[v], points_[loop[0]]));
      if (!(std::abs(height) <= limits_.plane_m)) return false;
    }
    return true;
  }

  /// Distance of b from the line a-c, positive for a corner that turns left about the normal.
  [[nodiscard]] double bulge(std::uint32_t a, std::uint32_t b, std::uint32_t c,
                             const Point3& normal) const {
    const Point3 along = vec::sub(points_[c], points_[a]);
    const double length = vec::norm(along);
    const Point3 out = vec::cross(vec::sub(points_[b], points_[a]), along);
    return length > 0.0 ? vec::dot(normal, out) / length : -HUGE_VAL;
  }

  std::size_t merge_seams();
  bool merge(std::uint32_t f, std::uint32_t g, std::uint32_t u, std::uint32_t v);
  std::vector<Seam> seams();
  std::size_t drop_straight_corners();

  const std::vector<Point3>& points_;
  std::vector<Loop>& loops_;
  std::vector<std::uint32_t>& source_;
  MergeLimits limits_;
  std::vector<std::uint32_t> parent_;  ///< polygon that a polygon has been merged into
  std::vector<std::uint32_t> uses_;    ///< polygons at each point
  std::vector<Point3> corners_;        ///< scratch
};

std::vector<Seam> FacetMerger::seams() {
  std::vector<PolygonSide> sides;
  std::vector<Point3> normals(loops_.size());
  for (std::uint32_t f = 0; f < loops_.size(); ++f) {
    const Loop& loop = loops_[f];
    if (loop.empty()) continue;
    normals[f] = normal_of(loop);
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const std::uint32_t a = loop[k], b = loop[k + 1 == loop.size() ? 0 : k + 1];
      sides.push_back({std::uint64_t{std::min(a, b)} << 32 | std::max(a, b), f, a < b});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const PolygonSide& a, const PolygonSide& b) {
    return a.key != b.key ? a.key < b.key : a.face < b.face;
  });
  std::vector<Seam> found;
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].key == sides[i].key) ++end;
    const PolygonSide &a = sides[i], &b = sides[i + 1 < sides.size() ? i + 1 : i];
    // A region that is bent by more than this cannot be flat to within rounding, at any size.
    constexpr double kBent = 1.0e-2;
    if (end == i + 2 && a.face != b.face && a.forward != b.forward &&
        vec::distance(normals[a.face], normals[b.face]) < kBent) {
      const auto low = static_cast<std::uint32_t>(a.key >> 32);
      const auto high = static_cast<std::uint32_t>(a.key);
      const Point3 along = vec::sub(points_[high], points_[low]);
      const PolygonSide &with = a.forward ? a : b, &against = a.forward ? b : a;
      found.push_back({vec::dot(along, along), with.face, against.face, low, high});
    }
    i = end;
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Seam& a, const Seam& b) { return a.square > b.square; });
  return found;
}

std::size_t FacetMerger::merge_seams() {
  parent_.resize(loops_.size());
  for (std::uint32_t f = 0; f < parent_.size(); ++f) parent_[f] = f;
  uses_.assign(points_.size(), 0);
  for (const Loop& loop : loops_) {
    for (const std::uint32_t v : loop) ++uses_[v];
  }
  std::size_t merged = 0;
  for (const Seam& seam : seams()) {
    const std::uint32_t f = face_of(seam.f), g = face_of(seam.g);
    if (f != g && merge(f, g, seam.u, seam.v)) ++merged;
  }
  return merged;
}

/// Polygon f has the side u -> v, g has v -> u, unless one of them has lost it by an earlier union.
bool FacetMerger::merge(std::uint32_t f, std::uint32_t g, std::uint32_t u, std::uint32_t v) {
  const Loop &a = loops_[f], &b = loops_[g];
  const std::size_t n = a.size(), m = b.size();
  std::size_t first = n, other = m;
  for (std::size_t k = 0; k < n; ++k) {
    if (a[k] == u && a[(k + 1) % n] == v) first = k;
  }
  for (std::size_t k = 0; k < m; ++k) {
    if (b[k] == v && b[(k + 1) % m] == u) other = k;
  }
  if (first == n || other == m) return false;
  // The chain a[begin] .. a[begin + length] is b, backwards, from b[at] on.
  std::size_t begin = first, length = 1, at = (other + 1) % m;  // b[at] == u == a[begin]
  while (length < std::min(n, m) - 1 && a[(begin + n - 1) % n] == b[(at + 1) % m]) {
    begin = (begin + n - 1) % n;
    at = (at + 1) % m;
    ++length;
  }
  while (length < std::min(n, m) - 1 &&
         a[(begin + length + 1) % n] == b[(at + m - (length + 1) % m) % m]) {
    ++length;
  }
  for (std::size_t k = 1; k < length; ++k) {
    if (uses_[a[(begin + k) % n]] != 2) return false;
  }
  if (n + m - 2 * length > limits_.most_corners || n + m - 2 * length < 3) return false;
  Loop joined;
  for (std::size_t k = length; k <= n; ++k) joined.push_back(a[(begin + k) % n]);
  for (std::size_t k = 1; k + length < m; ++k) joined.push_back(b[(at + k) % m]);
  Loop sorted = joined;
  std::sort(sorted.begin(), sorted.end());
  if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) return false;
  const Point3 normal = normal_of(joined);
  if (!is_flat(joined, normal)) return false;
  for (std::size_t k = 0; k < joined.size(); ++k) {
    const std::size_t size = joined.size();
    const double out =
        bulge(joined[(k + size - 1) % size], joined[k], joined[(k + 1) % size], normal);
    if (!(out >= -limits_.plane_m)) return false;
  }
  for (std::size_t k = 1; k < length; ++k) uses_[a[(begin + k) % n]] = 0;
  --uses_[a[begin]];
  --uses_[a[(begin + length) % n]];
  source_[f] = std::min(source_[f], source_[g]);
  parent_[g] = f;
  loops_[f] = std::move(joined);
  loops_[g].clear();
  return true;
}

/// A corner goes when all polygons that have it go straight through it between the same two
/// neighbours.
std::size_t FacetMerger::drop_straight_corners() {
  std::vector<std::uint32_t> begin(points_.size() + 1, 0), at;
  for (const Loop& loop : loops_) {
    for (const std::uint32_t v : loop) ++begin[v + 1];
  }
  for (std::size_t v = 0; v < points_.size(); ++v) begin[v + 1] += begin[v];
  at.resize(begin.back());
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for (std::uint32_t f = 0; f < loops_.size(); ++f) {
    for (const std::uint32_t v : loops_[f]) at[next[v]++] = f;
  }
  std::size_t dropped = 0;
  for (std::uint32_t v = 0; v < points_.size(); ++v) {
    std::uint32_t low = 0, high = 0;
    bool straight = begin[v] < begin[v + 1];
    for (std::uint32_t i = begin[v]; i < begin[v + 1] && straight; ++i) {
      const Loop& loop = loops_[at[i]];
      const std::size_t n = loop.size();
      const auto k =
          static_cast<std::size_t>(std::find(loop.begin(), loop.end(), v) - loop.begin());
      const std::uint32_t a = loop[(k + n - 1) % n], b = loop[(k + 1) % n];
      if (i == begin[v]) {
        low = std::min(a, b);
        high = std::max(a, b);
      }
      const Point3 along = vec::unit(vec::sub(points_[b], points_[a]));
      const Point3 from = vec::sub(points_[v], points_[a]);
      straight = n > 3 && low == std::min(a, b) && high == std::max(a, b) &&
                 vec::norm(vec::cross(from, along)) <= limits_.plane_m &&
                 vec::dot(from, vec::sub(points_[b], points_[v])) > 0.0;
    }
    if (!straight) continue;
    for (std::uint32_t i = begin[v]; i < begin[v + 1]; ++i) {
      Loop& loop = loops_[at[i]];
      loop.erase(std::find(loop.begin(), loop.end(), v));
    }
    ++dropped;
  }
  return dropped;
}

}  // namespace

void merge_facets(const std::vector<Point3>& points, std::vector<Loop>& loops,
                  std::vector<std::uint32_t>& source, const MergeLimits& limits) {
  FacetMerger(points, loops, source, limits).run();
}

}  // namespace haptic::tools
