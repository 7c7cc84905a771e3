// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/simplify/surface_distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/graph_compiler/mesh/shell_interior.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/simplify/reach_proof.hpp"

namespace haptic::tools {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Roundings of a distance and of the cuts above it, as part of the size of the part.
constexpr double kRounding = 1.0e-13;
// Cuts along borders first; from this depth on halving, which always ends.
constexpr int kBorderDepth = 24;
constexpr double kSlimCut = 1.0e-9;  // of the part's size: a cut nearer to a corner is none

struct Part {
  FaceTriangle t;
  int depth = 0;
};

std::vector<vec::Box> boxes_of(const std::vector<FaceTriangle>& triangles) {
  std::vector<vec::Box> boxes;
  for (const FaceTriangle& t : triangles) boxes.push_back(box_of(t));
  return boxes;
}

double nearest_of(const std::vector<FaceTriangle>& triangles, const BoxTree& tree, const Point3& p,
                  double radius, std::vector<std::uint32_t>& found, std::uint32_t& which) {
  while (true) {
    vec::Box box;
    box.include(p);
    tree.find(box.grown(radius), found);
    double least = kInfinity;
    for (const std::uint32_t k : found) {
      const double d = triangle_distance(p, triangles[k]);
      if (d < least) least = d, which = k;
    }
    if (least <= radius || found.size() == triangles.size()) return least;
    radius = least < kInfinity ? least * (1.0 + 1.0e-12) : 4.0 * radius;
  }
}

/// One direction: points of `from`, distances from `to`.
class OneSided {
 public:
  OneSided(const std::vector<FaceTriangle>& to, const DistanceLimits& limits, double start_radius)
      : to_(to), limits_(limits), tree_(boxes_of(to)), radius_(start_radius) {
    vec::Box all;
    for (const FaceTriangle& t : to) {
      const vec::Box box = box_of(t);
      all.include(box.low);
      all.include(box.high);
    }
    size_ = to.empty() ? 0.0 : all.diagonal();
  }

  void run(const std::vector<FaceTriangle>& from, SurfaceDistance& result, std::size_t& parts);

 private:
  double nearest(const Point3& p, std::uint32_t& which);
  double bound(const FaceTriangle& t);

  const std::vector<FaceTriangle>& to_;
  const DistanceLimits& limits_;
  BoxTree tree_;
  double radius_;
  double size_ = 0.0;
  std::vector<std::uint32_t> found_;
};

double OneSided::nearest(const Point3& p, std::uint32_t& which) {
  return nearest_of(to_, tree_, p, radius_, found_, which);
}

/// Any subset of the other surface gives an upper bound. A sliver's normal is uncertain: reach_of()
/// is never below the distance.
double OneSided::bound(const FaceTriangle& t) {
  tree_.find(box_of(t).grown(radius_), found_);
  double least = kInfinity;
  for (const std::uint32_t k : found_) {
    double worst = 0.0;
    for (std::size_t i = 0; i < 3 && worst < least; ++i) {
      worst = std::max(worst, reach_of(t[i], to_[k]));
    }
    least = std::min(least, worst);
  }
  return least;
}

void OneSided::run(const std::vector<FaceTriangle>& from, SurfaceDistance& result,
                   std::size_t& parts) {
  std::uint32_t which = 0;
  const auto look_at = [&](const Point3& p) {
    const double d = nearest(p, which);
    if (d > result.at_least_m) result.at_least_m = d, result.farthest = p;
  };
  for (const FaceTriangle& t : from) {
    for (const Point3& p : t) look_at(p);
  }
  std::vector<Part> open;
  std::vector<FaceTriangle> cut;
  for (auto t = from.rbegin(); t != from.rend(); ++t) open.push_back({*t, 0});
  while (!open.empty()) {
    const Part part = open.back();
    open.pop_back();
    ++parts;
    radius_ = std::max(radius_, result.at_least_m);
    const double margin = kRounding * size_;
    const double upper = bound(part.t) + margin;
    const double good = std::max(result.at_least_m / (1.0 - limits_.relative),
                                 result.at_least_m + limits_.absolute_m);
    if (upper <= good || parts > limits_.max_parts) {
      result.complete = result.complete && upper <= good;
      result.at_most_m = std::max(result.at_most_m, upper);
      continue;
    }
    const Point3 middle =
        vec::scaled(vec::add(part.t[0], vec::add(part.t[1], part.t[2])), 1.0 / 3.0);
    look_at(middle);
    cut.clear();
    if (part.depth >= kBorderDepth || !cut_at_border(part.t, to_[which], cut)) halve(part.t, cut);
    for (const FaceTriangle& t : cut) open.push_back({t, part.depth + 1});
  }
  result.at_most_m = std::max(result.at_most_m, result.at_least_m);
}

}  // namespace

bool cut_at_border(const FaceTriangle& t, const FaceTriangle& other,
                   std::vector<FaceTriangle>& out) {
  const Point3 normal =
      vec::unit(vec::cross(vec::sub(other[1], other[0]), vec::sub(other[2], other[0])));
  if (!(vec::norm(normal) > 0.0)) return false;
  const double size = box_of(t).diagonal();
  double best = kSlimCut * size;
  std::array<double, 3> heights{};
  for (std::size_t e = 0; e < 3; ++e) {
    const Point3 along = vec::unit(vec::sub(other[(e + 1) % 3], other[e]));
    const Point3 across = vec::cross(normal, along);
    std::array<double, 3> h{};
    double low = 0.0, high = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      h[i] = vec::dot(across, vec::sub(t[i], other[e]));
      if (std::abs(h[i]) < kSlimCut * size) h[i] = 0.0;
      low = std::min(low, h[i]);
      high = std::max(high, h[i]);
    }
    if (std::min(-low, high) > best) best = std::min(-low, high), heights = h;
  }
  if (!(best > kSlimCut * size)) return false;
  // The corner that is alone on its side, or the one on the line.
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    const auto at = [&](std::size_t p, std::size_t q) {
      return vec::add(t[p],
                      vec::scaled(vec::sub(t[q], t[p]), heights[p] / (heights[p] - heights[q])));
    };
    if (heights[i] == 0.0 && heights[j] * heights[k] < 0.0) {
      const Point3 m = at(j, k);
      out.push_back({t[i], t[j], m});
      out.push_back({t[i], m, t[k]});
      return true;
    }
    if (heights[i] * heights[j] < 0.0 && heights[i] * heights[k] < 0.0) {
      const Point3 m = at(i, j), n = at(i, k);
      out.push_back({t[i], m, n});
      out.push_back({m, t[j], t[k]});
      out.push_back({m, t[k], n});
      return true;
    }
  }
  return false;
}

void halve(const FaceTriangle& t, std::vector<FaceTriangle>& out) {
  std::size_t longest = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (vec::distance(t[i], t[(i + 1) % 3]) > vec::distance(t[longest], t[(longest + 1) % 3])) {
      longest = i;
    }
  }
  const Point3& a = t[longest];
  const Point3& b = t[(longest + 1) % 3];
  const Point3& c = t[(longest + 2) % 3];
  const Point3 m = vec::scaled(vec::add(a, b), 0.5);
  out.push_back({a, m, c});
  out.push_back({m, b, c});
}

SurfaceMeasure::SurfaceMeasure(const std::vector<FaceTriangle>& triangles, double guess_m)
    : triangles_(triangles), tree_(boxes_of(triangles)), guess_(guess_m) {}

double SurfaceMeasure::distance(const Point3& point, std::uint32_t* which) const {
  std::vector<std::uint32_t> found;
  std::uint32_t nearest = 0;
  const double d = nearest_of(triangles_, tree_, point, guess_, found, nearest);
  if (which != nullptr) *which = nearest;
  return d;
}

SurfaceDistance hausdorff_distance(const std::vector<FaceTriangle>& a,
                                   const std::vector<FaceTriangle>& b,
                                   const DistanceLimits& limits) {
  SurfaceDistance result;
  if (a.empty() || b.empty()) {
    result.at_most_m = a.empty() && b.empty() ? 0.0 : kInfinity;
    result.at_least_m = result.at_most_m;
    return result;
  }
  std::size_t parts = 0;
  const double radius = std::max(limits.absolute_m, 1.0e-12);
  OneSided(b, limits, radius).run(a, result, parts);
  OneSided(a, limits, radius).run(b, result, parts);
  return result;
}

}  // namespace haptic::tools
