// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/contact_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace haptic {
namespace {

constexpr Real kLowest = -std::numeric_limits<Real>::max();

/// The search of one pair in one tick.
class PairSearch {
 public:
  PairSearch(const PairPose& pose, Real epsilon_m, PairTrack& track,
             TrackerScratch& scratch) noexcept
      : pose_(pose),
        record_(*pose.pair->record),
        epsilon_(epsilon_m),
        tolerance_(applicability_tolerance(pose.size_m)),
        track_(track),
        scratch_(scratch) {
    scratch_.reached.clear();
    scratch_.candidates.clear();
  }

  /// Steps 1-3 over the last neighbor subgraph; ties crossed.
  void search_locally() noexcept {
    for (const NearNode& near : track_.near)
      insert_neighborhood(*pose_.pair, near.node, scratch_.reached);
    track_.neighborhood_size = scratch_.reached.size();
    const std::uint32_t last_near = track_.near.size();
    const std::uint32_t budget = expansion_budget(record_);
    const std::uint32_t nodes = track_.neighborhood_size > budget
                                    ? track_.neighborhood_size + kAuditFaces + kAuditNodes
                                    : budget;
    room_ = nodes + last_near;
    for (const NearNode& near : track_.near) snap(near);
    audit_faces();
    audit_nodes();
    std::uint32_t done = 0;
    evaluate_reached(done);
    cross_ties(done);
    expand_runners_up(done);
    cross_ties(done);  // the runners-up may have found a better plane
    std::uint32_t near_count = 0;
    for (const NearNode& c : scratch_.candidates) near_count += is_near(c) ? 1u : 0u;
    overflowed_ = scratch_.reached.size() > nodes + std::max(last_near, near_count);
  }

  /// Every node of the pair: the first tick, and the answer to whatever the local set could not
  /// decide.
  void search_exhaustively() noexcept {
    scratch_.reached.clear();
    scratch_.candidates.clear();
    best_ = kLowest;
    compacted_at_ = kLowest;
    result_.flags &= ~std::uint32_t{kTrackNearCut};  // the local search's; its candidates are gone
    collect_ = false;  // first the value alone, then what is near it: the candidates need no room
                       // for all nodes
    for (std::uint32_t node = 0; node < record_.node_count; ++node) evaluate(node);
    collect_ = true;
    for (std::uint32_t node = 0; node < record_.node_count; ++node) evaluate(node);
    track_.neighborhood_size = record_.node_count;
    result_.flags |= kTrackRelocalised;
  }

  /// Step 3: D_near and the near set. A node belongs to it while |D_near - f| plus its violation is
  /// below epsilon.
  void select_near() noexcept {
    track_.d_near_m = best_;
    track_.near.clear();
    const NearNode* best_node = nullptr;
    for (const NearNode& c : scratch_.candidates) {
      const bool tied = counts(c) && c.value_m >= best_ - std::min(tolerance_, epsilon_);
      if (tied && (best_node == nullptr || preferred(c, *best_node))) best_node = &c;
    }
    if (empty()) return;
    if (best_node == nullptr) best_node = &leader_;  // the candidates were cut
    track_.best_node = best_node->node;
    static_cast<void>(track_.near.push(*best_node));  // first, so that a cut never loses it
    for (const NearNode& c : scratch_.candidates) {
      if (!is_near(c) || c.node == best_node->node) continue;
      if (!track_.near.push(c)) result_.flags |= kTrackNearCut;
    }
    // A heap sort: no recursion, n log n.
    const auto by_node = [](const NearNode& l, const NearNode& r) { return l.node < r.node; };
    std::make_heap(track_.near.begin(), track_.near.end(), by_node);
    std::sort_heap(track_.near.begin(), track_.near.end(), by_node);
  }

  /// Crossing ties took more nodes than a local search may: the near set has moved to another plane
  /// of many ties within one tick.
  [[nodiscard]] bool overflowed() const noexcept { return overflowed_; }
  [[nodiscard]] bool empty() const noexcept { return best_ == kLowest; }
  [[nodiscard]] Real best() const noexcept { return best_; }
  [[nodiscard]] TrackResult& result() noexcept { return result_; }

 private:
  [[nodiscard]] bool counts(const NearNode& c) const noexcept {
    return c.violation_m <= tolerance_;
  }
  [[nodiscard]] bool is_near(const NearNode& c) const noexcept {
    const Real gap = c.plane.f_m < best_ ? best_ - c.plane.f_m : c.plane.f_m - best_;
    return gap + std::max(c.violation_m, Real{0}) < epsilon_;
  }
  /// Among tied nodes: faces before edges (their normals are exact), then the lowest number.
  [[nodiscard]] static bool preferred(const NearNode& l, const NearNode& r) noexcept {
    const bool l_edges = l.type == ContactType::kC, r_edges = r.type == ContactType::kC;
    return l_edges != r_edges ? r_edges : l.node < r.node;
  }

  /// Exact ties: a node that shares the best plane may be the only way to the next one (method 7.2:
  /// nodes of one plane count as one vertex of the dual graph). The best value only rises, so a
  /// candidate that is no tie when it is passed never becomes one, and new ones come behind; only
  /// when candidates have moved to lower places does the pass begin again.
  void cross_ties(std::uint32_t& done) noexcept {
    std::uint32_t k = 0;
    while (k < scratch_.candidates.size()) {
      const NearNode& tied = scratch_.candidates[k];
      compacted_ = false;
      if (counts(tied) && tied.value_m >= best_ - tolerance_) {
        insert_neighborhood(*pose_.pair, tied.node, scratch_.reached);
        evaluate_reached(done);
      }
      k = compacted_ ? 0 : k + 1;
    }
  }

  void evaluate_reached(std::uint32_t& done) noexcept {
    for (; done < scratch_.reached.size(); ++done)
      scratch_.reached_f[done] = evaluate(scratch_.reached[done]);
  }

  /// Values outside the C-obstacle have local maxima two hops apart: what is left of the budget
  /// goes to the neighbors of the next best applicable nodes, best first (method 7.3).
  void expand_runners_up(std::uint32_t& done) noexcept {
    const std::uint32_t budget = expansion_budget(record_);
    for (std::uint32_t look = 0; look < kRunnersUp; ++look) {
      std::uint32_t next = 0;
      Real next_f = kLowest;
      for (std::uint32_t k = 0; k < scratch_.reached.size(); ++k) {
        if (scratch_.reached_f[k] > next_f) {
          next = k;
          next_f = scratch_.reached_f[k];
        }
      }
      if (next_f == kLowest) return;
      scratch_.reached_f[next] = kLowest;  // looked at
      const std::uint32_t node = scratch_.reached[next];
      if (scratch_.reached.size() + pose_.pair->neighbors.count(node) > budget) return;
      const NodeRecord& features = pose_.pair->nodes[node];
      const ContactType type = contact_type(record_, node);
      const NodePlane plane = node_plane(pose_, type, features.a, features.b);
      if (node_violation(pose_, type, features.a, features.b, plane) > tolerance_) continue;
      insert_neighborhood(*pose_.pair, node, scratch_.reached);
      evaluate_reached(done);
    }
  }

  /// Plane, value and violation of a node; kept as a candidate when it can still matter. f is never
  /// below the node's value, so a node with f below best - epsilon is neither near nor best and its
  /// violation need not be known.
  Real evaluate(std::uint32_t node) noexcept {
    result_.nodes_evaluated += 1;
    const NodeRecord& features = pose_.pair->nodes[node];
    NearNode c;
    c.node = node;
    c.type = contact_type(record_, node);
    c.plane = node_plane(pose_, c.type, features.a, features.b);
    if (!c.plane.defined) return kLowest;
    if (c.plane.f_m < best_ - std::max(epsilon_, tolerance_)) return c.plane.f_m;
    c.violation_m = node_violation(pose_, c.type, features.a, features.b, c.plane);
    if (c.violation_m >= std::max(epsilon_, tolerance_)) return kLowest;
    if (counts(c)) {
      c.value_m = node_value(pose_, c.type, features.a, features.b, c.plane, c.violation_m);
      if (c.value_m > best_) {
        best_ = c.value_m;
        leader_ = c;
      }
    }
    if (collect_ && !scratch_.candidates.push(c)) drop_far_candidates(c);
    return c.plane.f_m;
  }

  /// Candidates are full: those that have fallen behind make room. Nothing has fallen behind while
  /// the best value has not risen since the last time.
  void drop_far_candidates(const NearNode& c) noexcept {
    if (best_ <= compacted_at_) {
      result_.flags |= kTrackNearCut;
      return;
    }
    compacted_at_ = best_;
    compacted_ = true;
    std::uint32_t kept = 0;
    BoundedList<NearNode>& list = scratch_.candidates;
    const std::uint32_t size = list.size();
    for (std::uint32_t k = 0; k < size; ++k) {
      if (list[k].plane.f_m >= best_ - std::max(epsilon_, tolerance_)) list[kept++] = list[k];
    }
    list.clear();
    for (std::uint32_t k = 0; k < kept; ++k) static_cast<void>(list.push(list[k]));
    if (!list.push(c)) result_.flags |= kTrackNearCut;
  }

  /// Adds the applicable node on the same face as a near node that has ceased to apply: keeps a
  /// face that turned over to another vertex (method 7.3, snap).
  void snap(const NearNode& near) noexcept {
    if (near.type == ContactType::kC) return;
    const NodeRecord& features = pose_.pair->nodes[near.node];
    const NodePlane plane = node_plane(pose_, near.type, features.a, features.b);
    if (node_violation(pose_, near.type, features.a, features.b, plane) <= tolerance_) return;
    const NodeNumbering numbers = numbering(pose_.pair->a, pose_.pair->b);
    const std::uint32_t node =
        near.type == ContactType::kA
            ? numbers.type_a(features.a, highest_vertex_b(pose_, plane.normal_w, features.b))
            : numbers.type_b(lowest_vertex_a(pose_, plane.normal_w, features.a), features.b);
    if (scratch_.reached.size() < room_) scratch_.reached.insert(node);
  }

  /// Adds the next face directions in turn, each at its support vertex: a face that has become the
  /// nearest one behind the back of the local search is seen after at most (faces / kAuditFaces)
  /// ticks (method 7.3, audit).
  void audit_faces() noexcept {
    const NodeNumbering numbers = numbering(pose_.pair->a, pose_.pair->b);
    const std::uint32_t faces = numbers.nfa + numbers.nfb;
    SupportPair start = track_.audit_support;
    for (std::uint32_t k = 0; k < std::min(kAuditFaces, faces); ++k) {
      if (scratch_.reached.size() >= room_) break;
      const std::uint32_t face = track_.audit_next;
      track_.audit_next = face + 1 == faces ? 0 : face + 1;
      std::uint32_t node = 0;
      if (face < numbers.nfa) {
        start.b = highest_vertex_b(pose_, -pose_.normal_a(face), start.b);
        node = numbers.type_a(face, start.b);
      } else {
        start.a = lowest_vertex_a(pose_, pose_.pair->b.face_normal(face - numbers.nfa), start.a);
        node = numbers.type_b(start.a, face - numbers.nfa);
      }
      scratch_.reached.insert(node);
    }
    track_.audit_support = start;
  }

  /// Adds the next nodes of the pair in turn, whatever they are: bounds the life of a wrong maximum
  /// by node_count / kAuditNodes ticks, at rest too (method 7.3).
  void audit_nodes() noexcept {
    for (std::uint32_t k = 0; k < kAuditNodes && scratch_.reached.size() < room_; ++k) {
      scratch_.reached.insert(track_.audit_node);
      track_.audit_node = track_.audit_node + 1 == record_.node_count ? 0 : track_.audit_node + 1;
    }
  }

  const PairPose& pose_;
  const PairRecord& record_;
  Real epsilon_;
  Real tolerance_;
  PairTrack& track_;
  TrackerScratch& scratch_;
  Real best_ = kLowest;
  std::uint32_t room_ = 0;  ///< nodes that neighbor subgraph, snaps and audits may take together
  bool overflowed_ = false;
  bool collect_ = true;          ///< keep candidates
  bool compacted_ = false;       ///< candidates have moved to lower places
  Real compacted_at_ = kLowest;  ///< best value when they did
  NearNode leader_;              ///< node of the best value
  TrackResult result_;
};

}  // namespace

TrackResult track_pair(const PairPose& pose, const PairMotion& motion, Real epsilon_m,
                       PairTrack& track, TrackerScratch& scratch) noexcept {
  PairSearch search(pose, epsilon_m, track, scratch);
  TrackResult& result = search.result();
  const Real rounding = 64 * kRealEpsilon * (pose.size_m + std::sqrt(pose.y_w.squaredNorm()));
  if (!track.valid) {
    search.search_exhaustively();
    result.flags |= kTrackFirst;
  } else {
    search.search_locally();
    // Inside, D_near is the largest gap over all directions, and none of them falls by more than
    // the motion.
    const bool fell =
        search.best() <= 0 && search.best() < track.d_near_m - motion.bound_m - rounding;
    if (search.empty() || fell || search.overflowed()) {
      result.flags |= search.empty() ? kTrackEmpty : fell ? kTrackContradiction : kTrackOverflow;
      search.search_exhaustively();
    }
  }
  if (search.best() <= 0) {  // a positive value is its own certificate
    const VerdictResult verdict = pair_verdict(pose, track.verdict);
    result.support_pairs += verdict.support_pairs;
    if (verdict.verdict == Verdict::kUndecided) result.flags |= kTrackUndecided;
    const bool contradicts =
        verdict.verdict == Verdict::kUndecided ||
        (verdict.verdict == Verdict::kSeparated && verdict.separation_bound_m > rounding);
    if (contradicts && (result.flags & kTrackRelocalised) == 0) {
      result.flags |= kTrackContradiction;
      search.search_exhaustively();
    }
  }
  search.select_near();
  track.valid = true;
  return result;
}

}  // namespace haptic
