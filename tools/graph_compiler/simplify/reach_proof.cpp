// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/simplify/reach_proof.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/simplify/surface_distance.hpp"

namespace haptic::tools {
namespace {

constexpr int kMostDepth = 60;
constexpr int kDeepestBorder = 24;  // from here on halving, which always ends
constexpr std::size_t kPartsOfTarget = 4, kLeastParts = 64;
/// A part longer than so many targets is halved: borders of small targets cut too little off.
constexpr double kLongPart = 4.0;

/// Point of the triangle that is nearest to p, by the region of the plane that p lies over.
Point3 nearest_point(const Point3& p, const FaceTriangle& t) {
  const Point3 ab = vec::sub(t[1], t[0]), ac = vec::sub(t[2], t[0]), ap = vec::sub(p, t[0]);
  const double d1 = vec::dot(ab, ap), d2 = vec::dot(ac, ap);
  if (d1 <= 0.0 && d2 <= 0.0) return t[0];
  const Point3 bp = vec::sub(p, t[1]);
  const double d3 = vec::dot(ab, bp), d4 = vec::dot(ac, bp);
  if (d3 >= 0.0 && d4 <= d3) return t[1];
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    return vec::add(t[0], vec::scaled(ab, d1 / (d1 - d3)));
  }
  const Point3 cp = vec::sub(p, t[2]);
  const double d5 = vec::dot(ab, cp), d6 = vec::dot(ac, cp);
  if (d6 >= 0.0 && d5 <= d6) return t[2];
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    return vec::add(t[0], vec::scaled(ac, d2 / (d2 - d6)));
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 >= d3 && d5 >= d6) {
    const double share = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return vec::add(t[1], vec::scaled(vec::sub(t[2], t[1]), share));
  }
  const double sum = va + vb + vc;
  const double v = std::clamp(vb / sum, 0.0, 1.0), w = std::clamp(vc / sum, 0.0, 1.0 - v);
  return vec::add(t[0], vec::add(vec::scaled(ab, v), vec::scaled(ac, w)));
}

double longest_side(const FaceTriangle& t) {
  return std::max(
      {vec::distance(t[0], t[1]), vec::distance(t[1], t[2]), vec::distance(t[2], t[0])});
}

}  // namespace

double reach_of(const Point3& p, const FaceTriangle& t) {
  // The foot on a sliver is uncertain along it; the corners bound what that can cost.
  const double at_corner =
      std::min({vec::distance(p, t[0]), vec::distance(p, t[1]), vec::distance(p, t[2])});
  const double at_foot = vec::distance(p, nearest_point(p, t));
  return at_foot < at_corner ? at_foot : at_corner;  // also where the foot is no number
}

bool ReachProof::holds(const FaceTriangle& t, std::span<const FaceTriangle> targets,
                       double within_m, std::size_t effort) {
  targets_ = targets;
  within_m_ = within_m;
  bound_m_ = 0.0;
  used_.assign(targets.size(), 0);
  near_.resize(targets.size());
  boxes_.resize(targets.size());
  for (std::uint32_t k = 0; k < near_.size(); ++k) {
    near_[k] = k;
    boxes_[k] = box_of(targets[k]);
  }
  const std::size_t most = effort * (kLeastParts + kPartsOfTarget * targets.size());
  parts_.assign(1, {t, 0, near_.size(), 0});
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (i >= most || !look_at(i)) return false;
  }
  return true;
}

/// Proves the part or cuts it. False: a corner is too far, or the part is too small to be cut.
bool ReachProof::look_at(std::size_t index) {
  const Part part = parts_[index];
  const FaceTriangle& t = part.t;
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const vec::Box reach = box_of(t).grown(within_m_);
  std::array<double, 3> least{kFar, kFar, kFar};
  double best = kFar;
  std::uint32_t nearest = 0;
  const std::size_t begin = near_.size();
  for (std::size_t i = part.begin; i < part.end; ++i) {
    const std::uint32_t k = near_[i];
    if (!boxes_[k].meets(reach)) continue;
    double worst = 0.0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double d = reach_of(t[c], targets_[k]);
      least[c] = std::min(least[c], d);
      worst = std::max(worst, d);
    }
    near_.push_back(k);
    if (worst < best) {
      best = worst;
      nearest = k;
    }
  }
  if (best <= within_m_) {
    used_[nearest] = 1;
    bound_m_ = std::max(bound_m_, best);
    near_.resize(begin);
    return true;
  }
  if (part.depth >= kMostDepth || near_.size() == begin) return false;
  if (*std::max_element(least.begin(), least.end()) > within_m_) return false;
  std::vector<FaceTriangle> cut;
  const bool is_long = longest_side(t) > kLongPart * longest_side(targets_[nearest]);
  if (is_long || part.depth >= kDeepestBorder || !cut_at_border(t, targets_[nearest], cut)) {
    cut.clear();
    halve(t, cut);
  }
  for (const FaceTriangle& piece : cut) {
    parts_.push_back({piece, begin, near_.size(), part.depth + 1});
  }
  return true;
}

}  // namespace haptic::tools
