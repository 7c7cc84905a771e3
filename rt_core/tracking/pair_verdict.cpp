// SPDX-License-Identifier: Apache-2.0
#include "rt_core/tracking/pair_verdict.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rt_core/base/exact_sum.hpp"

namespace haptic {
namespace {

/// Depth, in sizes, up to which an answer without a certificate is touching.
constexpr Real kTouchingShare = HAPTIC_REAL_IS_FLOAT ? 1.0e-5_r : 1.0e-10_r;

/// A point of the C-obstacle about the interior point c, and the vertices that make it.
struct PortalPoint {
  Vec3 v = Vec3::Zero();
  SupportPair vertices;
};

/// Some unit vector orthogonal to v; v must not be zero.
Vec3 orthogonal_to(const Vec3& v) noexcept {
  const Vec3 a(std::abs(v[0]), std::abs(v[1]), std::abs(v[2]));
  const Vec3 axis = a[0] <= a[1] && a[0] <= a[2] ? Vec3(1, 0, 0)
                    : a[1] <= a[2]               ? Vec3(0, 1, 0)
                                                 : Vec3(0, 0, 1);
  return v.cross(axis).normalized();
}

/// One attempt: all vectors about c, X = x - c.
class PortalSearch {
 public:
  PortalSearch(const PairPose& pose, std::uint32_t& support_pairs) noexcept
      : pose_(pose),
        x_(pose.y_w - pose.interior_w),
        support_pairs_(support_pairs),
        limit_(support_pairs + kMaxSupportPairsPerAttempt),
        tolerance_(16 * kRealEpsilon * pose.size_m) {}

  /// Takes up stored vertices.
  void take(const std::array<SupportPair, 3>& portal) noexcept {
    for (std::size_t k = 0; k < 3; ++k) portal_[k] = point(portal[k]);
    last_ = portal[0];
  }

  /// Starts from what was taken up. False: it does not span a cone that holds X.
  [[nodiscard]] bool start_warm() noexcept { return orient(0); }

  /// Finds a first portal from X alone. False: none whose cone holds X was found.
  [[nodiscard]] bool start_cold() noexcept {
    const Real x_norm = std::sqrt(x_.squaredNorm());
    const Vec3 along = x_norm > tolerance_ ? Vec3(x_ / x_norm) : Vec3(0, 0, 1);
    portal_[0] = support(along);
    if (separated_) return true;
    Vec3 side = portal_[0].v.cross(x_);
    // The ray may meet the support point itself; then any plane through both will do.
    const bool aligned = !(std::sqrt(side.squaredNorm()) > tolerance_ * x_norm);
    portal_[1] = support(aligned ? orthogonal_to(portal_[0].v) : Vec3(side.normalized()));
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
        return orient(tolerance_ * pose_.size_m * pose_.size_m);
      }
      n = portal_[0].v.cross(portal_[1].v);
      if (n.dot(x_) < 0) n = -n;
    }
    return false;
  }

  /// Refines the portal until x is decided (METHOD section 7.3).
  [[nodiscard]] VerdictResult refine() noexcept {
    VerdictResult result;
    while (!separated_) {
      const Vec3 cross = (portal_[1].v - portal_[0].v).cross(portal_[2].v - portal_[0].v);
      const Real area = std::sqrt(cross.squaredNorm());
      if (!(area > 0)) break;
      const Vec3 n = cross / area;
      result.normal_w = n;
      if (certified()) {
        result.verdict = Verdict::kColliding;
        return result;
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
    }
    return result;
  }

  /// X = sum l_k v_k with l_k >= 0 and sum l_k <= 1, to rounding: the collision certificate. Plain
  /// products decide where their rounding cannot; else determinants of twice the digits do.
  [[nodiscard]] bool certified() const noexcept {
    const Vec3 &v0 = portal_[0].v, &v1 = portal_[1].v, &v2 = portal_[2].v;
    const Vec3 c0 = v1.cross(v2);
    const Real det = v0.dot(c0);
    const Real l0 = x_.dot(c0), l1 = x_.dot(v2.cross(v0)), l2 = x_.dot(v0.cross(v1));
    const Real rest = det - ((l0 + l1) + l2);
    const Real longest =
        std::max({x_.squaredNorm(), v0.squaredNorm(), v1.squaredNorm(), v2.squaredNorm()});
    const Real doubt = 64 * kRealEpsilon * longest * std::sqrt(longest);
    const Real least = std::min({l0, l1, l2, rest});
    if (det > 4 * doubt && least > doubt) return true;
    return least >= -doubt && certified_in_doubt(doubt);
  }

  void remember(VerdictMemory& memory) const noexcept {
    for (std::size_t k = 0; k < 3; ++k) memory.portal[k] = portal_[k].vertices;
    memory.warm = true;
  }

 private:
  /// The same with twice the digits. A portal whose determinant is rounding even then says nothing.
  [[nodiscard]] bool certified_in_doubt(Real doubt) const noexcept {
    const Vec3 &v0 = portal_[0].v, &v1 = portal_[1].v, &v2 = portal_[2].v;
    const LongReal det = long_determinant(v0, v1, v2);
    if (!(det.high > doubt)) return false;  // then its own rounding is far below the slack
    const LongReal l0 = long_determinant(x_, v1, v2), l1 = long_determinant(x_, v2, v0),
                   l2 = long_determinant(x_, v0, v1);
    const LongReal rest = det + -((l0 + l1) + l2);
    const Real slack = kCertificateSlack * det.high;
    return l0.high >= -slack && l1.high >= -slack && l2.high >= -slack && rest.high >= -slack;
  }

  [[nodiscard]] PortalPoint point(const SupportPair& s) const noexcept {
    return {(pose_.vertex_b(s.b) - pose_.vertex_a(s.a)) - pose_.interior_w, s};
  }

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
    return point(last_);
  }

  /// Orders the portal counter-clockwise about its outward normal; false when X is not in its cone,
  /// to `slack` [m^3].
  [[nodiscard]] bool orient(Real slack) noexcept {
    if (portal_[0].v.cross(portal_[1].v).dot(portal_[2].v) < 0) std::swap(portal_[0], portal_[1]);
    return portal_[0].v.cross(portal_[1].v).dot(x_) >= -slack &&
           portal_[1].v.cross(portal_[2].v).dot(x_) >= -slack &&
           portal_[2].v.cross(portal_[0].v).dot(x_) >= -slack;
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
};

/// The nearest C-face's plane as a certificate of separation: a face's value is a gap by itself, an
/// edge pair's is confirmed by both supports.
bool separates(const PairPose& pose, const NearResult& near, VerdictResult& result) noexcept {
  result.normal_w = near.best.normal_w;
  // The reported one of two tied faces may have the smaller gap: its own value is what it
  // certifies.
  result.separation_bound_m = near.best.f_m;
  if (near.best.type == ContactType::kC) {
    const SupportPair support = support_pair(pose, near.best.normal_w, near.support);
    result.support_pairs += 1;
    result.separation_bound_m =
        std::min(near.d_near_m, gap_along(pose, near.best.normal_w, support));
  }
  if (!(result.separation_bound_m > pose.rounding_m)) return false;
  result.verdict = Verdict::kSeparated;
  return true;
}

}  // namespace

VerdictResult portal_verdict(const PairPose& pose, VerdictMemory& memory) noexcept {
  std::uint32_t support_pairs = 0;
  VerdictResult result;
  for (int attempt = memory.warm ? 0 : 1; attempt < 2; ++attempt) {
    PortalSearch search(pose, support_pairs);
    if (attempt == 0) {
      search.take(memory.portal);
      if (search.certified()) {  // last tick's portal holds x still
        result.verdict = Verdict::kColliding;
        return result;
      }
    }
    const bool started = attempt == 0 ? search.start_warm() : search.start_cold();
    if (!started) continue;
    result = search.refine();
    if (result.verdict == Verdict::kColliding) search.remember(memory);
    if (result.verdict != Verdict::kUndecided) break;
  }
  if (result.verdict == Verdict::kUndecided) memory.warm = false;
  result.support_pairs = support_pairs;
  return result;
}

VerdictResult verdict_alone(const PairPose& pose, VerdictMemory& memory,
                            NearResult& plane) noexcept {
  plane.d_near_m = kNoDepth;
  VerdictResult result = portal_verdict(pose, memory);
  result.thickness_m = std::max(result.thickness_m, pose.rounding_m);
  if (result.verdict != Verdict::kSeparated) return result;
  plane.best.type = ContactType::kC;  // no face's normal
  plane.best.normal_w = result.normal_w;
  plane.best.f_m = plane.d_near_m = result.separation_bound_m;
  plane.support = memory.portal[0];
  if (!(result.separation_bound_m > pose.rounding_m)) {  // a gap that rounding explains
    result.verdict = Verdict::kTouching;
    result.separation_bound_m = 0;
  }
  return result;
}

VerdictResult pair_verdict(const PairPose& pose, const NearResult& near,
                           VerdictMemory& memory) noexcept {
  VerdictResult result;
  if (near.d_near_m > pose.rounding_m && separates(pose, near, result)) return result;
  if (near.d_near_m < -pose.rounding_m) {
    const std::uint32_t confirmed = result.support_pairs;
    result = portal_verdict(pose, memory);
    result.support_pairs += confirmed;
    result.thickness_m = std::max(result.thickness_m, pose.rounding_m);
    // Only where D_near is a mere lower bound can a portal find a gap that rounding does not
    // explain.
    if (result.verdict == Verdict::kSeparated && result.separation_bound_m > pose.rounding_m) {
      return result;
    }
    result.separation_bound_m = 0;
    if (result.verdict == Verdict::kSeparated) result.verdict = Verdict::kUndecided;
    // Without a certificate x is as near to the boundary as D_near says; within a tolerance of it
    // that is touching, however the portal ended.
    if (result.verdict != Verdict::kColliding) {
      result.thickness_m = std::max(result.thickness_m, -near.d_near_m);
      if (result.thickness_m <= kTouchingShare * pose.size_m) result.verdict = Verdict::kTouching;
    }
  } else {
    result.verdict = Verdict::kTouching;
    result.separation_bound_m = 0;
    result.thickness_m = std::max(std::abs(near.d_near_m), pose.rounding_m);
  }
  result.normal_w = near.best.normal_w;
  return result;
}

}  // namespace haptic
