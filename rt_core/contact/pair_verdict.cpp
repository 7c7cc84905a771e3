// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/pair_verdict.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace haptic {
namespace {

/// A support point of the C-obstacle about the interior point c, and the direction that found it.
struct PortalPoint {
  Vec3 v = Vec3::Zero();
  Vec3 direction = Vec3::Zero();
};

/// One attempt: all vectors about c, X = x - c.
class PortalSearch {
 public:
  PortalSearch(const PairPose& pose, SupportPair start, std::uint32_t& support_pairs) noexcept
      : pose_(pose),
        x_(pose.y_w - pose.interior_w),
        last_(start),
        support_pairs_(support_pairs),
        limit_(support_pairs + kMaxSupportPairsPerAttempt),
        tolerance_(16 * kRealEpsilon * pose.size_m) {}

  /// Starts from stored directions. False: they do not span a cone that holds X.
  [[nodiscard]] bool start_warm(const std::array<Vec3, 3>& directions) noexcept {
    for (std::size_t k = 0; k < 3; ++k) {
      portal_[k] = support(directions[k]);
      if (separated_) return true;
    }
    return orient();
  }

  /// Finds a first portal from X alone. False: X is (numerically) on a line or plane through c;
  /// answer is then set where the line decides.
  [[nodiscard]] bool start_cold() noexcept {
    const Real x_norm = std::sqrt(x_.squaredNorm());
    if (!(x_norm > tolerance_)) {  // x is the interior point
      colliding_ = true;
      return true;
    }
    portal_[0] = support(x_ / x_norm);
    if (separated_) return true;
    Vec3 side = portal_[0].v.cross(x_);
    if (!(std::sqrt(side.squaredNorm()) >
          tolerance_ * x_norm)) {  // the ray meets the support point itself
      colliding_ = true;
      return true;
    }
    portal_[1] = support(side.normalized());
    if (separated_) return true;
    Vec3 n = portal_[0].v.cross(portal_[1].v);
    // The third point is sought on X's side of the plane; with (v0, v1) clockwise about X the tests
    // below leave a portal whose cone holds X.
    if (n.dot(x_) < 0) {
      n = -n;
    } else {
      std::swap(portal_[0], portal_[1]);
    }
    while (support_pairs_ < limit_) {
      const Real length = std::sqrt(n.squaredNorm());
      if (!(length > 0)) return false;
      portal_[2] = support(n / length);
      if (separated_) return true;
      if (portal_[0].v.cross(portal_[2].v).dot(x_) < 0) {
        portal_[1] = portal_[2];
      } else if (portal_[2].v.cross(portal_[1].v).dot(x_) < 0) {
        portal_[0] = portal_[2];
      } else {
        return orient();
      }
      n = portal_[0].v.cross(portal_[1].v);
      if (n.dot(x_) < 0) n = -n;
    }
    return false;
  }

  /// Refines the portal until x is decided (method 7.3).
  [[nodiscard]] VerdictResult refine() noexcept {
    VerdictResult result;
    while (!separated_ && !colliding_) {
      const Vec3 cross = (portal_[1].v - portal_[0].v).cross(portal_[2].v - portal_[0].v);
      const Real area = std::sqrt(cross.squaredNorm());
      if (!(area > 0)) break;
      const Vec3 n = cross / area;
      result.normal_w = n;
      if (n.dot(x_ - portal_[0].v) <= 0) {
        colliding_ = certified();
        break;
      }
      if (support_pairs_ >= limit_) break;
      const PortalPoint next = support(n);
      if (separated_) break;
      result.thickness_m = n.dot(next.v - portal_[0].v);
      if (result.thickness_m <= tolerance_) {
        result.verdict = Verdict::kTouching;
        return result;
      }
      replace(next);
    }
    if (separated_) {
      result.verdict = Verdict::kSeparated;
      result.normal_w = separating_normal_;
      result.separation_bound_m = gap_;
    } else if (colliding_) {
      result.verdict = Verdict::kColliding;
    }
    return result;
  }

  void remember(VerdictMemory& memory) const noexcept {
    memory.last_support = last_;
    memory.warm = true;
    if (separated_) {  // the direction that separates is tried first
      memory.direction_w = {separating_normal_, memory.direction_w[0], memory.direction_w[1]};
    } else {
      memory.direction_w = {portal_[0].direction, portal_[1].direction, portal_[2].direction};
    }
  }

 private:
  /// Support point in unit direction n; notes a separation: n.x beyond the support plane.
  PortalPoint support(const Vec3& n) noexcept {
    last_ = support_pair(pose_, n, last_);
    support_pairs_ += 1;
    const Real gap = gap_along(pose_, n, last_);
    if (gap > 0 && !separated_) {
      separated_ = true;
      separating_normal_ = n;
      gap_ = gap;
    }
    return {(pose_.vertex_b(last_.b) - pose_.vertex_a(last_.a)) - pose_.interior_w, n};
  }

  /// Orders the portal counter-clockwise about its outward normal; false when X is not strictly in
  /// its cone.
  [[nodiscard]] bool orient() noexcept {
    if (portal_[0].v.cross(portal_[1].v).dot(portal_[2].v) < 0) std::swap(portal_[0], portal_[1]);
    return portal_[0].v.cross(portal_[1].v).dot(x_) > 0 &&
           portal_[1].v.cross(portal_[2].v).dot(x_) > 0 &&
           portal_[2].v.cross(portal_[0].v).dot(x_) > 0;
  }

  /// Puts `next` in the place that keeps X in the cone. Seen along X, v.(next x X) > 0 says that
  /// `next` is counter-clockwise from v; X is between the two neighbouring portal points with
  /// different signs.
  void replace(const PortalPoint& next) noexcept {
    const Vec3 m = next.v.cross(x_);
    if (portal_[0].v.dot(m) > 0) {
      portal_[portal_[2].v.dot(m) < 0 ? 1 : 0] = next;
    } else {
      portal_[portal_[1].v.dot(m) > 0 ? 2 : 0] = next;
    }
  }

  /// X = sum l_i v_i with l_i >= 0 and sum l_i <= 1, to rounding: the collision certificate.
  [[nodiscard]] bool certified() const noexcept {
    const Vec3 c0 = portal_[1].v.cross(portal_[2].v);
    const Real det = portal_[0].v.dot(c0);
    if (!(det > 0)) return false;
    const Real l0 = x_.dot(c0) / det;
    const Real l1 = x_.dot(portal_[2].v.cross(portal_[0].v)) / det;
    const Real l2 = x_.dot(portal_[0].v.cross(portal_[1].v)) / det;
    const Real slack = 64 * kRealEpsilon;
    return l0 >= -slack && l1 >= -slack && l2 >= -slack && l0 + l1 + l2 <= 1 + slack;
  }

  const PairPose& pose_;
  Vec3 x_;
  SupportPair last_;
  std::uint32_t& support_pairs_;
  std::uint32_t limit_;
  Real tolerance_;
  std::array<PortalPoint, 3> portal_{};
  Vec3 separating_normal_ = Vec3::Zero();
  Real gap_ = 0;
  bool separated_ = false;
  bool colliding_ = false;
};

}  // namespace

VerdictResult pair_verdict(const PairPose& pose, VerdictMemory& memory) noexcept {
  std::uint32_t support_pairs = 0;
  VerdictResult result;
  for (int attempt = memory.warm ? 0 : 1; attempt < 2; ++attempt) {
    PortalSearch search(pose, memory.last_support, support_pairs);
    const bool started = attempt == 0 ? search.start_warm(memory.direction_w) : search.start_cold();
    if (!started) continue;
    result = search.refine();
    if (result.verdict != Verdict::kUndecided) {
      search.remember(memory);
      break;
    }
  }
  if (result.verdict == Verdict::kUndecided) memory.warm = false;
  result.support_pairs = support_pairs;
  return result;
}

}  // namespace haptic
