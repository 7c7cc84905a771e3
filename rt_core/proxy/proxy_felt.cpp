// SPDX-License-Identifier: Apache-2.0
// What the proxy touches at the end of a tick, from the planes of its last quadratic program.
#include <algorithm>
#include <cmath>

#include "rt_core/contact/basic_contact.hpp"
#include "rt_core/proxy/proxy_law.hpp"

namespace haptic {
namespace {

/// A point of a contact region, and how far it lies over the plane's support.
struct FeltPoint {
  Vec3 app_w;
  Real above_m = 0;
};

/// The contact points of all planes: all are counted, the first are kept for the situation.
struct FeltPoints {
  std::array<FeltPoint, 2 * kMaxManifoldPoints> points;
  std::uint32_t count = 0, kept = 0;

  void add(const Vec3& app_w, Real above_m) noexcept {
    count += 1;
    if (kept < points.size()) points[kept++] = {app_w, above_m};
  }
};

/// Which features touch, with the width `share` epsilon of a contact.
ContactSituation label_of(const FeltContact& felt, const FeltPoints& points, Real epsilon_m,
                          Real share) noexcept {
  const Real tolerance = share * epsilon_m;
  const Real chord = share * kCoplanarAngle_rad;
  for (std::uint32_t k = 1; k < felt.plane_count; ++k) {
    const Vec3 between = felt.planes[k].normal_w - felt.planes[0].normal_w;
    if (between.squaredNorm() >= chord * chord) return ContactSituation::kSeveralPlanes;
  }
  // The first point that touches, the one farthest from it, then one beside the line through both.
  const FeltPoint* first = nullptr;
  Vec3 span = Vec3::Zero();
  for (std::uint32_t k = 0; k < points.kept; ++k) {
    const FeltPoint& p = points.points[k];
    if (!(p.above_m < tolerance)) continue;
    if (first == nullptr) first = &p;
    const Vec3 way = p.app_w - first->app_w;
    if (way.squaredNorm() > span.squaredNorm()) span = way;
  }
  const Real length = std::sqrt(span.squaredNorm());
  if (first == nullptr || length <= tolerance) return single_contact(felt.planes[0].type);
  for (std::uint32_t k = 0; k < points.kept; ++k) {
    const FeltPoint& p = points.points[k];
    if (!(p.above_m < tolerance)) continue;
    const Vec3 aside = span.cross(p.app_w - first->app_w);
    if (aside.squaredNorm() > tolerance * tolerance * length * length) {
      return ContactSituation::kFaceFace;
    }
  }
  return ContactSituation::kEdgeFace;
}

}  // namespace

/// Keeps those planes of the last program that p touches: a step that was cut short may have ended
/// before it reached them.
void Proxy::feel(ProxyTick& tick) noexcept {
  FeltContact& contact = felt_[0];
  const ContactSituation last = contact.situation;
  const Real epsilon = parameters_.epsilon_m;
  contact.plane_count = contact.point_count = 0;
  contact.situation = ContactSituation::kNone;
  FeltPoints points;
  for (const ImposedPlane& active : kept_.active) {
    ProxyPair& pair = near_.pairs[active.pair];
    need_view(pair, tick);
    const PlaneRegion& region = region_at_p(active.pair, active.id, active.support, tick);
    const PlaneGap& gap = region.gap;
    if (!gap.defined || !(gap.gap_m < epsilon)) continue;
    const std::uint32_t before = points.count;
    FeltPlane& felt = contact.planes[contact.plane_count++];
    felt = {pair.index, gap.normal_w, gap.gap_m, 0, active.id.type};
    for (std::uint32_t k = 0; k < region.count; ++k) {
      const Real above = region.points[k].gap_m - gap.gap_m;
      if (above < epsilon) points.add(region.points[k].app_w, above);
    }
    felt.point_count = points.count - before;
  }
  contact.point_count = points.count;
  if (contact.plane_count == 0) return;
  // Only the label waits, so that tremor does not make it chatter.
  contact.situation = label_of(contact, points, epsilon, 1);
  if (contact.situation != last && label_of(contact, points, epsilon, 0.5_r) == last) {
    contact.situation = last;
  }
}

NearResult Proxy::near_set_of(PairIndex index, NearScratch& scratch, BoundedList<NearNode>& near,
                              PairPose& pose) noexcept {
  const auto slots = near_.list.slots();
  const auto slot = std::find_if(slots.begin(), slots.end(),
                                 [&](std::uint32_t s) { return near_.pairs[s].index == index; });
  if (slot == slots.end()) return {};
  ProxyPair& pair = near_.pairs[*slot];
  ProxyTick report;
  need_view(pair, report);
  FeatureBounds bounds;
  pose = pose_of(pair);
  Arena arena(reinterpret_cast<std::byte*>(scratch_.search_memory.data()));
  bounds.place(arena, *pair.view->a.record, *pair.view->b.record);
  bounds.reset(pair.view->marks);
  return find_near_set(pose, parameters_.epsilon_m, bounds, scratch, near, NodeScope::kLive);
}

}  // namespace haptic
