// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/verification/deliberate_fault.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <span>

#include "host_sim/lab/peers/pair_tables.hpp"
#include "host_sim/lab/verification/contact_poses.hpp"
#include "host_sim/lab/verification/near_campaign.hpp"
#include "host_sim/lab/verification/verdict_campaign.hpp"
#include "rt_core/tracking/near_set.hpp"

namespace haptic::sim {

namespace {

// The core's search for the near set, driven without the rest of the core, with its bounds open to
// the caller.

/// Not movable: the tables point into its memory.
class DirectSearch {
 public:
  /// Pair 0 of the scene, which must outlive it. A keeps the orientation `q_wa`.
  DirectSearch(const SceneView& view, const Quat& q_wa);
  DirectSearch(const DirectSearch&) = delete;
  DirectSearch& operator=(const DirectSearch&) = delete;

  /// Moves A's origin to `p_w` in a straight line and searches there.
  NearResult search(const Vec3& p_w);
  /// Near set of the last search.
  [[nodiscard]] std::span<const NearNode> near() const { return tables_.near.view(); }

  /// The stale upper bounds of the pair's faces and edges.
  [[nodiscard]] FeatureBounds& bounds() { return tables_.bounds; }

 private:
  const SceneView& view_;
  PairView pair_;
  Mat3 r_wa_;
  Vec3 grip_w_, reference_w_;
  PairTables tables_;
  Odometer odometer_;
  Vec3 last_p_w_ = Vec3::Zero();
  bool moved_ = false;
};

DirectSearch::DirectSearch(const SceneView& view, const Quat& q_wa)
    : view_(view),
      pair_(view.pair(0)),
      r_wa_(q_wa.normalized().toRotationMatrix()),
      grip_w_(r_wa_ * reference_of(view.bodies()[0])),
      reference_w_(reference_of(view.bodies()[1])),
      tables_(pair_) {
  turn_vertices(pair_.a, r_wa_, tables_.lanes.data());
}

NearResult DirectSearch::search(const Vec3& p_w) {
  if (moved_) {
    const double step = static_cast<double>((p_w - last_p_w_).norm());
    odometer_.of_a += step;
    odometer_.of_b += step;
  }
  last_p_w_ = p_w;
  moved_ = true;
  const PairPose pose =
      make_pair_pose(pair_, tables_.lanes.data(), r_wa_, (p_w + grip_w_) - reference_w_);
  tables_.bounds.advance(odometer_, pose.size_m);
  tables_.near.clear();
  return find_near_set(pose, static_cast<Real>(view_.parameters().epsilon_m), tables_.bounds,
                       tables_.scratch, tables_.near);
}

constexpr double kEpsilon_m = 1e-4;
constexpr std::uint64_t kNearPoses = 6000;
constexpr std::uint64_t kVerdictQueries = 6000;

/// The bytes of an open scene. They are the session's own, mutable memory; the view only promises
/// not to write to them.
std::byte* writable(CoreSession& session, const void* at) {
  const std::span<const std::byte> blob = session.view().blob();
  const auto offset = static_cast<const std::byte*>(at) - blob.data();
  return const_cast<std::byte*>(blob.data()) + offset;
}

void overwrite(CoreSession& session, const void* at, const void* from, std::size_t bytes) {
  std::memcpy(writable(session, at), from, bytes);
}

// --- A key lowered -----------------------------------------------------------------------------

/// One corner of the tetrahedron stands in the box, by its top: 1 mm behind the side x, and rising.
/// The side gives D_near; the top comes nearer by exactly what the odometer counts and then becomes
/// the nearest. Epsilon is so small that the margins of the search, at most 16 of it, are less than
/// what the bound is lowered by.
constexpr double kKeyEpsilon_m = 2e-8;
constexpr Real kLowering_m = 1e-6_r;
constexpr double kStart_m = 1.5e-6, kRise_m = 1e-7;  // top below side; rise per tick
constexpr int kTicks = 30;
constexpr double kSide_m = 0.06, kTop_m = 0.04;  // of the box

/// Turns corner 0 of the tetrahedron, which is on its z axis, towards -x -z.
Rotation corner_down() {
  return turn_between(Vector::UnitZ(), Vector(-1.0, 0.02, -1.0).normalized());
}

NearTotals rise_past_top(bool lowered) {
  VerifiedBodies bodies = class_pair(0);
  VerifiedPair pair(bodies, kKeyEpsilon_m);
  const Rotation q = corner_down();
  const Vector corner = q * bodies.a.vertices[0];
  const double depth_m = 1e-3;
  const Vector x0 = Vector(kSide_m - depth_m, 0, kTop_m - depth_m - kStart_m) - corner;
  DirectSearch search(pair.view(), q.cast<Real>());
  NearTotals totals;
  for (int tick = 0; tick < kTicks; ++tick) {
    const Pose pose = pose_at(x0 + tick * kRise_m * Vector::UnitZ(), q);
    static_cast<void>(search.search(pose.p_wa));
    check_near_set(pair, pose, search.near(), totals);
    if (tick > 0 || !lowered) continue;
    const PieceView b = pair.view().pair(0).b;
    for (std::uint32_t f = 0; f < b.face_count; ++f) {
      if (b.face_normal(f)[2] > 0.5_r) search.bounds().b.faces.key[f] -= kLowering_m;
    }
  }
  return totals;
}

// --- An arc removed ----------------------------------------------------------------------------

/// Overwrites `edge` in the list at vertex `v` with another edge of the list.
void forget_edge(CoreSession& session, const PieceView& piece, std::uint32_t v,
                 std::uint32_t edge) {
  const std::span<const std::uint16_t> list = piece.edges_at(v);
  for (const std::uint16_t& entry : list) {
    if (entry == edge) overwrite(session, &entry, &list[list[0] == edge ? 1 : 0], sizeof entry);
  }
}

/// The same in the stored neighbor list of a node, if the pair has one: among the neighbors that
/// keep the face.
void forget_neighbor(CoreSession& session, const PairView& pair, std::uint32_t node,
                     std::uint32_t neighbor) {
  if (pair.nodes == nullptr) return;
  const NeighborLists& lists = pair.neighbors;
  const std::size_t width = lists.wide ? 4 : 2;
  const std::uint32_t first = pair.nodes[node].keep_begin;
  const std::byte* const list =
      static_cast<const std::byte*>(lists.table) + lists.begin[node] * width;
  for (std::uint32_t k = first; k < first + pair.nodes[node].keep_count; ++k) {
    if (lists.at(node, k) != neighbor) continue;
    const std::uint32_t other = k == first ? first + 1 : first;
    overwrite(session, list + k * width, list + other * width, width);
  }
}

/// Removes the arcs between (v0, F) and (v1, F), v0 and v1 the ends of edge 0 of A, for every face
/// F of B.
void remove_arcs(VerifiedPair& pair) {
  const PairView view = pair.view().pair(0);
  const EdgeRecord edge = view.a.edges[0];
  const NodeNumbering nodes = numbering(view.a, view.b);
  for (int side = 0; side < 2; ++side) {
    const std::uint32_t from = edge.vertex[side], to = edge.vertex[1 - side];
    for (std::uint32_t f = 0; f < view.b.face_count; ++f) {
      forget_neighbor(pair.session(), view, nodes.type_b(from, f), nodes.type_b(to, f));
    }
    forget_edge(pair.session(), view.a, from, 0);
  }
}

// --- A support table damaged -------------------------------------------------------------------

/// Puts vertex 0 in the place of vertex 1 of A, in the lanes alone.
void damage_supports(VerifiedPair& pair) {
  const PieceView a = pair.view().pair(0).a;
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    const Real* lane = a.lanes + std::size_t{axis} * a.lane_count;
    overwrite(pair.session(), lane + 1, lane, sizeof(Real));
  }
}

std::string first_of(const FailureLog& failures) {
  return failures.empty() ? std::string() : failures.lines().front();
}

std::uint64_t failures_of(const NearTotals& totals) {
  return totals.missing + totals.extra + totals.subset_missing;
}

FaultOutcome compare(const NearTotals& sound, const NearTotals& damaged) {
  return {damaged.poses, failures_of(sound), failures_of(damaged), first_of(damaged.failures)};
}

FaultOutcome run_arc(std::uint64_t seed) {
  const VerifiedBodies bodies = class_pair(1);
  VerifiedPair pair(bodies, kEpsilon_m);
  const NearTotals sound = run_near_sets_on(pair, bodies, kNearPoses, seed);
  remove_arcs(pair);
  return compare(sound, run_near_sets_on(pair, bodies, kNearPoses, seed));
}

FaultOutcome run_support(std::uint64_t seed) {
  const VerifiedBodies bodies = class_pair(1);
  VerifiedPair pair(bodies, kEpsilon_m);
  const auto failures = [](const VerdictTotals& t) {
    return t.bad_certificates() + t.wrong_verdicts + t.wrong_boundaries;
  };
  const VerdictTotals sound = run_verdicts_on(pair, bodies, kVerdictQueries, 4, seed);
  damage_supports(pair);
  const VerdictTotals damaged = run_verdicts_on(pair, bodies, kVerdictQueries, 4, seed);
  return {damaged.queries, failures(sound), failures(damaged), first_of(damaged.failures)};
}

}  // namespace

std::optional<DeliberateFault> fault_named(const std::string& name) {
  if (name == "key") return DeliberateFault::kKey;
  if (name == "arc") return DeliberateFault::kArc;
  if (name == "support") return DeliberateFault::kSupport;
  return std::nullopt;
}

FaultOutcome run_with_fault(DeliberateFault fault, std::uint64_t seed) {
  switch (fault) {
    case DeliberateFault::kKey:
      return compare(rise_past_top(false), rise_past_top(true));
    case DeliberateFault::kArc:
      return run_arc(seed);
    case DeliberateFault::kSupport:
      break;
  }
  return run_support(seed);
}

CampaignEnd fault_end(const FaultOutcome& outcome, const std::string& fault, std::uint64_t seed) {
  std::string said = tools::formatted(
      "fault %s, seed %llu: %llu checks, %llu fail without it, %llu with it\n", fault.c_str(),
      static_cast<unsigned long long>(seed), static_cast<unsigned long long>(outcome.checks),
      static_cast<unsigned long long>(outcome.sound_failures),
      static_cast<unsigned long long>(outcome.fault_failures));
  if (!outcome.first_failure.empty()) said += "  " + outcome.first_failure + "\n";
  return {said, {}, outcome.sound_failures + outcome.fault_failures == 0};
}

}  // namespace haptic::sim
