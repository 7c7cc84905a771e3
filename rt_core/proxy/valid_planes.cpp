// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/valid_planes.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "rt_core/contact/basic_contact.hpp"
#include "rt_core/contact/piece_sphere.hpp"
#include "rt_core/proxy/valid_set.hpp"

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
        least_gap_m_(least_gap_m + pair_.skin_m),
        tolerance_(applicability_tolerance(pose.size_m)),
        scratch_(scratch),
        set_(pose, planes) {}

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
    if (set_.result.count == 0) {
      enter_cell(support);
      spread();
    }
    for (std::uint32_t k = 0; k < entered_; ++k) scratch_.slots[scratch_.used[k]] = 0;
    return set_.result;
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
      set_.result.cut = true;
      return;
    }
    scratch_.slots[slot] = node + 1;
    scratch_.used[entered_] = static_cast<std::uint16_t>(slot);
    scratch_.queue[entered_++] = node;
  }

  void spread() noexcept {
    for (; next_ < entered_; ++next_) {
      const NodeFeatures node = node_features(pair_, scratch_.queue[next_]);
      set_.result.visited += 1;
      const NodePlane plane = node_plane(pose_, node.type, node.i, node.j);
      if (!plane.defined || plane.f_m < least_gap_m_) continue;
      const Real violation = node_violation(pose_, node.type, node.i, node.j, plane);
      if (violation > tolerance_) continue;
      const Real gap = node_value(pose_, node.type, node.i, node.j, plane, violation);
      if (gap < least_gap_m_) continue;
      set_.keep(node, plane.normal_w, gap - pair_.skin_m);
      for_each_graph_neighbor(pair_, node.type, node.i, node.j,
                              [&](std::uint32_t other) { enter(other); });
    }
  }

  const PairPose& pose_;
  const PairView& pair_;
  Real least_gap_m_;  ///< skin included
  Real tolerance_;
  const ValidScratch& scratch_;
  ValidSet set_;
  std::uint32_t entered_ = 0;  ///< nodes in the queue
  std::uint32_t next_ = 0;     ///< the first of them not yet looked at
};

/// All nodes of a pair, one after the other, of those faces and edges that can have a plane with a
/// gap: the gap along a normal n is at most that of any point of the one piece from any of the
/// other. A face needs these points on its outer side. So does an edge one of its two faces: where
/// n.v is negative at both ends of an arc of less than half a circle it is so between them. Of the
/// pairs of such edges four signs leave those that can apply.
class ValidScan {
 public:
  ValidScan(const PairPose& pose, Real least_gap_m, const ValidScratch& scratch,
            std::span<ValidPlane> planes) noexcept
      : pose_(pose),
        pair_(*pose.pair),
        least_gap_m_(least_gap_m + pair_.skin_m),
        tolerance_(applicability_tolerance(pose.size_m)),
        edges_a_(scratch.queue.first(scratch.queue.size() / 2)),
        edges_b_(scratch.queue.subspan(scratch.queue.size() / 2)),
        set_(pose, planes) {}

  /// False: the pair is too large for a scan, nothing was found. `support`: of any plane; the
  /// nearer, the fewer edges are left.
  [[nodiscard]] bool run(SupportPair support, ValidResult& result) noexcept {
    if (std::max(pair_.a.face_count, pair_.b.face_count) > kMostScannedFaces) return false;
    const auto& to_a = pose_.r_wa.transpose();
    const Vec3 centre_a = piece_centre(*pair_.a.record), centre_b = piece_centre(*pair_.b.record);
    const Points of_b_a{to_a * (pose_.vertex_b(support.b) - pose_.y_w),
                        to_a * (centre_b - pose_.y_w)};
    const Points of_a_w{pose_.y_w + pose_.vertex_a(support.a), pose_.y_w + pose_.r_wa * centre_a};
    Sides a, b;
    find_sides(pair_.a, of_b_a, a);
    find_sides(pair_.b, of_a_w, b);
    if (!take_edges(pair_.a, a, edges_a_) || !take_edges(pair_.b, b, edges_b_) ||
        edges_a_.size() * edges_b_.size() > kMostScannedPairs) {
      return false;
    }
    for (std::uint32_t f = 0; f < pair_.a.face_count; ++f) {
      if (a[f] != kBoth || !is_reachable(pair_.marks.features.face_a(f))) continue;
      take_face({ContactType::kA, static_cast<std::uint16_t>(f), 0, false}, support);
    }
    for (std::uint32_t f = 0; f < pair_.b.face_count; ++f) {
      if (b[f] != kBoth || !is_reachable(pair_.marks.features.face_b(f))) continue;
      take_face({ContactType::kB, 0, static_cast<std::uint16_t>(f), false}, support);
    }
    take_sides(support);
    for (const std::uint32_t e : edges_a_) take_pairs_of(e);
    const std::uint32_t features =
        pair_.a.face_count + pair_.b.face_count + pair_.a.edge_count + pair_.b.edge_count;
    const auto pairs = static_cast<std::uint32_t>(edges_a_.size() * edges_b_.size());
    set_.result.visited += features / kFeaturesOfNode + pairs / kEdgePairsOfUnit;
    result = set_.result;
    return true;
  }

 private:
  /// Two points of the other piece, in a piece's axes; and by face which of them lie on its outer
  /// side.
  using Points = std::array<Vec3, 2>;
  using Sides = std::array<std::uint8_t, kMostScannedFaces>;
  static constexpr std::uint8_t kBoth = 3;

  [[nodiscard]] bool is_reachable(std::uint32_t feature) const noexcept {
    return !pair_.marks.given() || pair_.marks.feature(NodeScope::kReachable, feature);
  }

  /// A plane that applies within the tolerance may lie a little beyond the normals of its edge.
  void find_sides(const PieceView& piece, const Points& points, Sides& sides) const noexcept {
    const Real least = loose_m_ - kBeyondArc * pose_.size_m;
    for (std::uint32_t f = 0; f < piece.face_count; ++f) {
      const Vec3 normal = piece.face_normal(f);
      const Real at = piece.face_offset(f) + least;
      sides[f] = static_cast<std::uint8_t>((normal.dot(points[0]) >= at ? 1u : 0u) |
                                           (normal.dot(points[1]) >= at ? 2u : 0u));
    }
  }

  [[nodiscard]] static bool take_edges(const PieceView& piece, const Sides& sides,
                                       std::span<std::uint32_t>& edges) noexcept {
    std::uint32_t count = 0;
    for (std::uint32_t e = 0; e < piece.edge_count; ++e) {
      const EdgeRecord& edge = piece.edges[e];
      if ((sides[edge.face[0]] | sides[edge.face[1]]) != kBoth) continue;
      if (count == edges.size()) return false;
      edges[count++] = e;
    }
    edges = edges.first(count);
    return true;
  }

  /// The planes of a facet's sides.
  void take_sides(SupportPair support) noexcept {
    const auto take = [&](const PlaneId& id) {
      const Real bound = face_bound(pair_, pose_.r_wa, pose_.y_w, id, support);
      if (bound + pair_.skin_m >= least_gap_m_) take_face(id, support);
    };
    for (std::uint32_t p = pair_.a.face_count; p < plane_count(*pair_.a.record); ++p)
      take({ContactType::kA, static_cast<std::uint16_t>(p), 0, false});
    for (std::uint32_t p = pair_.b.face_count; p < plane_count(*pair_.b.record); ++p)
      take({ContactType::kB, 0, static_cast<std::uint16_t>(p), false});
  }

  void take_face(const PlaneId& id, SupportPair support) noexcept {
    set_.result.visited += 1;
    const PlaneGap gap = plane_gap(pair_, pose_.r_wa, pose_.y_w, id, support);
    if (gap.gap_m + pair_.skin_m < least_gap_m_) return;
    const bool of_a = id.type == ContactType::kA;
    set_.keep({id.type, of_a ? id.i : gap.support.a, of_a ? gap.support.b : id.j}, gap.normal_w,
              gap.gap_m);
  }

  /// The pairs of edge `e` of A with the edges of B. Heights of the apexes over the plane, times
  /// the sine of the edges' angle, as plane_applies has them: all four on one side, or none.
  void take_pairs_of(std::uint32_t e) noexcept {
    const Vec3 u = pose_.direction_a(e);
    const Vec3 d0_w = pose_.r_wa * pair_.a.tilt(e, 0);
    const Vec3 d1_w = pose_.r_wa * pair_.a.tilt(e, 1);
    const Vec3 a0 = pose_.y_w + pose_.vertex_a(pair_.a.edges[e].vertex[0]);
    const Real most = 2 * tolerance_;
    const Real least = loose_m_;
    for (const std::uint32_t g : edges_b_) {
      const Real c0 = pair_.b.tilt(g, 0).dot(u);
      const Real c1 = pair_.b.tilt(g, 1).dot(u);
      bool as_is = c0 <= most && -c1 <= most;
      bool turned = -c0 <= most && c1 <= most;
      if (!as_is && !turned) continue;
      const Vec3 v = ConstVec3Map(pair_.b.edge_directions[g].unit);
      const Real d0 = d0_w.dot(v);
      const Real d1 = d1_w.dot(v);
      as_is = as_is && d0 <= most && -d1 <= most;
      turned = turned && -d0 <= most && d1 <= most;
      if (!as_is && !turned) continue;
      // The gap times the sine, of the plane and of the same plane turned.
      const Real gap = u.cross(v).dot(a0 - pose_.vertex_b(pair_.b.edges[g].vertex[0]));
      if ((as_is && gap >= least) || (turned && -gap >= least)) take_edge_pair(e, g);
    }
  }

  void take_edge_pair(std::uint32_t e, std::uint32_t g) noexcept {
    if (!pair_.marks.node(NodeScope::kReachable, node_number(pair_, ContactType::kC, e, g))) return;
    if (edge_pairs_ == kMaxValidVisits) {
      set_.result.cut = true;
      return;
    }
    edge_pairs_ += 1;
    set_.result.visited += 1;
    const NodePlane plane = node_plane(pose_, ContactType::kC, e, g);
    if (!plane.defined || plane.f_m < least_gap_m_ || plane.edge_violation_m > tolerance_) return;
    const Real gap = node_value(pose_, ContactType::kC, e, g, plane, plane.edge_violation_m);
    if (gap < least_gap_m_) return;
    set_.keep({ContactType::kC, e, g}, plane.normal_w, gap - pair_.skin_m);
  }

  /// Features whose bounds take as long as one node.
  static constexpr std::uint32_t kFeaturesOfNode = 16;
  static constexpr Real kBeyondArc = 1.0e-5_r;

  const PairPose& pose_;
  const PairView& pair_;
  Real least_gap_m_;  ///< skin included
  /// No gap and no share of one that counts is smaller.
  Real loose_m_ = std::min(2 * least_gap_m_, Real{0});
  Real tolerance_;
  std::span<std::uint32_t> edges_a_, edges_b_;
  ValidSet set_;
  std::uint32_t edge_pairs_ = 0;  ///< whose signs have left them
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
  ValidResult result;
  if (ValidScan(pose, least_gap_m, scratch, planes).run(support, result)) return result;
  return ValidWalk(pose, least_gap_m, scratch, planes).run(seed, support);
}

bool plane_applies(const PairView& pair, const Mat3& r_wa, const PlaneId& id) noexcept {
  if (id.type != ContactType::kC) return true;
  const Vec3 v = ConstVec3Map(pair.b.edge_directions[id.j].unit);
  const Vec3 u = r_wa * ConstVec3Map(pair.a.edge_directions[id.i].unit);
  const Vec3 v_a = r_wa.transpose() * v;
  const Real sign = id.flipped ? -1.0_r : 1.0_r;
  // Heights of the apexes over the plane, times the sine of the edges' angle (tracking/near_set).
  const Real c0 = sign * pair.b.tilt(id.j, 0).dot(u);
  const Real c1 = sign * pair.b.tilt(id.j, 1).dot(u);
  const Real d0 = sign * pair.a.tilt(id.i, 0).dot(v_a);
  const Real d1 = sign * pair.a.tilt(id.i, 1).dot(v_a);
  const Real size = static_cast<Real>(pair.a.record->radius_m + pair.b.record->radius_m);
  const Real height = std::max(std::max(c0, -c1), std::max(d0, -d1));
  if (height <= 0) return true;
  const Real tolerance = applicability_tolerance(size);
  return height * height <= tolerance * tolerance * u.cross(v).squaredNorm();
}

}  // namespace haptic
