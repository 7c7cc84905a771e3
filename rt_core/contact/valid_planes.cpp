// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/valid_planes.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "rt_core/contact/basic_contact.hpp"
#include "rt_core/contact/fixed_obstacle.hpp"

namespace haptic {
namespace {

/// Slots of the open table: twice the nodes, so that a search for a free one is short.
constexpr std::uint32_t kSlots = std::bit_ceil(2 * kValidVisits);
constexpr int kSlotBits = std::bit_width(kSlots - 1);

/// A walk over the valid nodes of one pair.
class ValidWalk {
 public:
  ValidWalk(const PairPose& pose, Real least_gap_m, const ValidScratch& scratch,
            std::span<ValidPlane> planes) noexcept
      : pose_(pose),
        pair_(*pose.pair),
        least_gap_m_(least_gap_m),
        tolerance_(applicability_tolerance(pose.size_m)),
        scratch_(scratch),
        planes_(planes) {}

  [[nodiscard]] ValidResult run(const PlaneId& seed, SupportPair support) noexcept {
    switch (seed.type) {
      case ContactType::kA:
        enter(node_number(pair_, seed.type, seed.i, support.b));
        break;
      case ContactType::kB:
        enter(node_number(pair_, seed.type, support.a, seed.j));
        break;
      case ContactType::kC:
        enter(node_number(pair_, seed.type, seed.i, seed.j));
        break;
    }
    spread();
    if (result_.count == 0) {
      enter_cell(support);
      spread();
    }
    for (std::uint32_t k = 0; k < entered_; ++k) scratch_.slots[scratch_.used[k]] = 0;
    return result_;
  }

 private:
  /// All nodes whose C-faces have the two support vertices as a corner.
  void enter_cell(SupportPair support) noexcept {
    for_each_face_at(pair_.a, support.a, [&](std::uint32_t f) {
      enter(node_number(pair_, ContactType::kA, f, support.b));
    });
    for_each_face_at(pair_.b, support.b, [&](std::uint32_t f) {
      enter(node_number(pair_, ContactType::kB, support.a, f));
    });
    for (const std::uint16_t e : pair_.a.edges_at(support.a)) {
      for (const std::uint16_t g : pair_.b.edges_at(support.b)) {
        enter(node_number(pair_, ContactType::kC, e, g));
      }
    }
  }

  void enter(std::uint32_t node) noexcept {
    if (!pair_.marks.node(NodeScope::kReachable, node)) return;  // applies in no pose
    std::uint32_t slot = (node * 0x9e3779b9u) >> (32 - kSlotBits);
    while (scratch_.slots[slot] != 0) {  // at most half of the slots are taken
      if (scratch_.slots[slot] == node + 1) return;
      slot = (slot + 1) % kSlots;
    }
    if (entered_ == kValidVisits) {
      result_.cut = true;
      return;
    }
    scratch_.slots[slot] = node + 1;
    scratch_.used[entered_] = static_cast<std::uint16_t>(slot);
    scratch_.queue[entered_++] = node;
  }

  void spread() noexcept {
    for (; next_ < entered_; ++next_) {
      const NodeFeatures node = node_features(pair_, scratch_.queue[next_]);
      result_.visited += 1;
      const NodePlane plane = node_plane(pose_, node.type, node.i, node.j);
      if (!plane.defined || plane.f_m < least_gap_m_) continue;
      const Real violation = node_violation(pose_, node.type, node.i, node.j, plane);
      if (violation > tolerance_) continue;
      const Real gap = node_value(pose_, node.type, node.i, node.j, plane, violation);
      if (gap < least_gap_m_) continue;
      keep(node, plane, gap);
      for_each_graph_neighbor(pair_, node.type, node.i, node.j,
                              [&](std::uint32_t other) { enter(other); });
    }
  }

  void keep(const NodeFeatures& node, const NodePlane& plane, Real gap) noexcept {
    ValidPlane valid;
    valid.id.type = node.type;
    valid.gap_m = gap;
    switch (node.type) {
      case ContactType::kA:
        valid.id.i = static_cast<std::uint16_t>(node.i);
        valid.support = {pair_.a.face_vertices(node.i)[0], node.j};
        break;
      case ContactType::kB:
        valid.id.j = static_cast<std::uint16_t>(node.j);
        valid.support = {node.i, pair_.b.face_vertices(node.j)[0]};
        break;
      case ContactType::kC: {
        valid.id.i = static_cast<std::uint16_t>(node.i);
        valid.id.j = static_cast<std::uint16_t>(node.j);
        const Vec3 v = ConstVec3Map(pair_.b.edge_directions[node.j].unit);
        valid.id.flipped = plane.normal_w.dot(pose_.direction_a(node.i).cross(v)) < 0;
        valid.support = {pair_.a.edges[node.i].vertex[0], pair_.b.edges[node.j].vertex[0]};
        break;
      }
    }
    if (node.type != ContactType::kC) {  // several vertices on one face: one plane
      for (std::uint32_t k = 0; k < result_.count; ++k) {
        if (planes_[k].id == valid.id) return;
      }
    }
    insert(valid, is_hidden(node) ? kHiddenFaces : kFaces);
  }

  /// The part goes on in another piece where the plane is: no contact of it carries a force.
  [[nodiscard]] bool is_hidden(const NodeFeatures& node) const noexcept {
    const NodeMarks& marks = pair_.marks;
    if (!marks.given()) return false;
    switch (node.type) {
      case ContactType::kA:
        return !marks.feature(NodeScope::kLive, marks.features.face_a(node.i));
      case ContactType::kB:
        return !marks.feature(NodeScope::kLive, marks.features.face_b(node.j));
      case ContactType::kC:
        break;
    }
    return !marks.node(NodeScope::kLive, node_number(pair_, node.type, node.i, node.j));
  }

  /// Puts a plane behind those of its class; the first of each class behind moves to its end.
  void insert(const ValidPlane& valid, std::uint32_t faces_class) noexcept {
    const std::uint32_t own = faces_class + (valid.id.type == ContactType::kC ? 1u : 0u);
    if (result_.count == planes_.size()) {
      result_.cut = true;
      if (own == kClasses - 1 || end_[own] == result_.count) return;
      result_.count -= 1;  // the last makes room for one of a class before it
      for (std::uint32_t& end : end_) end = std::min(end, result_.count);
    }
    for (std::uint32_t k = kClasses - 1; k > own; --k) {
      planes_[end_[k]] = planes_[end_[k - 1]];
      end_[k] += 1;
    }
    planes_[end_[own]++] = valid;
    result_.count += 1;
    result_.exposed = end_[kHiddenFaces - 1];
  }

  /// Classes of planes in their order: each of faces, and behind it one of edge pairs.
  static constexpr std::uint32_t kFaces = 0, kHiddenFaces = 2, kClasses = 4;

  const PairPose& pose_;
  const PairView& pair_;
  Real least_gap_m_;
  Real tolerance_;
  const ValidScratch& scratch_;
  std::span<ValidPlane> planes_;
  std::uint32_t entered_ = 0;                  ///< nodes in the queue
  std::uint32_t next_ = 0;                     ///< the first of them not yet looked at
  std::array<std::uint32_t, kClasses> end_{};  ///< of each class among the planes
  ValidResult result_;
};

}  // namespace

void ValidScratch::place(Arena& arena) noexcept {
  slots = arena.take<std::uint32_t>(kSlots);
  queue = arena.take<std::uint32_t>(kValidVisits);
  used = arena.take<std::uint16_t>(kValidVisits);
}

ValidResult find_valid_planes(const PairPose& pose, const PlaneId& seed, SupportPair support,
                              Real least_gap_m, const ValidScratch& scratch,
                              std::span<ValidPlane> planes) noexcept {
  if (pose.pair->is_fixed())
    return find_valid_fixed_planes(*pose.pair, pose.y_w, least_gap_m, planes);
  return ValidWalk(pose, least_gap_m, scratch, planes).run(seed, support);
}

bool plane_applies(const PairView& pair, const Mat3& r_wa, const PlaneId& id) noexcept {
  if (pair.is_fixed() || id.type != ContactType::kC) return true;
  const Vec3 v = ConstVec3Map(pair.b.edge_directions[id.j].unit);
  const Vec3 u = r_wa * ConstVec3Map(pair.a.edge_directions[id.i].unit);
  const Vec3 v_a = r_wa.transpose() * v;
  const EdgeArc& arc_a = pair.a.arcs[id.i];
  const EdgeArc& arc_b = pair.b.arcs[id.j];
  const Real sign = id.flipped ? -1.0_r : 1.0_r;
  // Heights of the apexes over the plane, times the sine of the edges' angle (contact/near_set).
  const Real c0 = sign * ConstVec3Map(arc_b.tilt[0]).dot(u);
  const Real c1 = sign * ConstVec3Map(arc_b.tilt[1]).dot(u);
  const Real d0 = sign * ConstVec3Map(arc_a.tilt[0]).dot(v_a);
  const Real d1 = sign * ConstVec3Map(arc_a.tilt[1]).dot(v_a);
  const Real size = static_cast<Real>(pair.a.record->radius_m + pair.b.record->radius_m);
  const Real height = std::max(std::max(c0, -c1), std::max(d0, -d1));
  if (height <= 0) return true;
  const Real tolerance = applicability_tolerance(size);
  return height * height <= tolerance * tolerance * u.cross(v).squaredNorm();
}

}  // namespace haptic
