// SPDX-License-Identifier: Apache-2.0
// From the contacts of all pairs to one wrench, and the hash of the tick.
#include <algorithm>
#include <bit>
#include <cmath>

#include "rt_core/core_state.hpp"

namespace haptic {
namespace {

/// Mixes words into a chain: every result depends on all words before it. Words go in turn to lanes
/// that do not wait for each other.
class StateHash {
 public:
  explicit StateHash(std::uint64_t from) noexcept : lanes_{from, ~from, from >> 32, from << 32} {}
  void add(std::uint64_t word) noexcept {
    std::uint64_t& lane = lanes_[next_];
    lane = (lane ^ word) * 0x9e3779b97f4a7c15ull;
    lane ^= lane >> 29;
    next_ = (next_ + 1) % 4;
  }
  void add(Real value) noexcept {
#if HAPTIC_REAL_IS_FLOAT
    add(std::uint64_t{std::bit_cast<std::uint32_t>(value)});
#else
    add(std::bit_cast<std::uint64_t>(value));
#endif
  }
  void add(const Vec3& v) noexcept {
    for (int k = 0; k < 3; ++k) add(v[k]);
  }
  [[nodiscard]] std::uint64_t value() const noexcept {
    std::uint64_t hash = lanes_[0];
    for (std::size_t k = 1; k < 4; ++k) {
      hash = (hash ^ lanes_[k]) * 0xbf58476d1ce4e5b9ull;
      hash ^= hash >> 31;
    }
    return hash;
  }

 private:
  std::uint64_t lanes_[4];
  std::size_t next_ = 0;
};

/// How much steeper than by epsilon a node comes into a group that is deeper than its own patch.
constexpr Real kOwnSlope = 4;

/// What a node that lies in its features still counts among those past their ends.
constexpr Real kInsideShare = 1.0e-6_r;

}  // namespace

/// Adds a contact; where bodies have seams, one that several pairs have found counts once, with the
/// largest weight: it lies in or nearest to the features of that pair.
void HapticCore::State::add_contact(std::uint32_t k, Real weight) noexcept {
  const WeightedContact contact{near[k].normal_w, near[k].app_w, weight};
  if (has_seams) {
    const std::uint32_t own = classes.class_of(k), at = contact_at[own];
    if (at < contacts.size() && contact_classes[at] == own) {
      if (weight > contacts[at].weight) contacts[at] = contact;
      return;
    }
    contact_at[own] = contacts.size();
    static_cast<void>(contact_classes.push(own));
  }
  static_cast<void>(contacts.push(contact));
}

Real HapticCore::State::weight_of(const NearNode& node, Real d_near_m,
                                  Real outside_m) const noexcept {
  const Real weight =
      contact_weight(node.f_m, d_near_m, node.violation_m, outside_m, epsilon_m, epsilon_o_m);
  if (node.rise_m <= (kMaxRise - 1) * epsilon_m) return weight;
  return weight * (kMaxRise - node.rise_m / epsilon_m);
}

/// Weight of node `k` of a patch in the group, of which `weight` is that at the group's depth. A
/// node of the near set comes and goes where it is epsilon from the patch's own depth: it does so
/// at zero.
Real HapticCore::State::joining_weight(const ContactPatch& patch, std::uint32_t k, Real outside_m,
                                       Real weight) const noexcept {
  if (!patch.is_of_neighbour() && k < patch.near_begin + patch.near_count) {
    weight = std::min(weight, kOwnSlope * weight_of(near[k], patch.d_near_m, outside_m));
  }
  return weight * node_shares[k].joining;
}

/// Takes a patch's contacts into the lists of its group: the near nodes with their weights, or the
/// paper's distinct points.
void HapticCore::State::add_to_group(const ContactPatch& patch,
                                     const ContactPatch& group) noexcept {
  if (has_law(LawId::kPaper)) return add_points(patch);
  const Real d_near_m = has_seams ? group.d_near_m : patch.d_near_m;
  for (std::uint32_t k = patch.near_begin; k < patch.nodes_end(); ++k) {
    if (has_seams && node_shares[k].joining == 0) continue;
    Real weight = weight_of(near[k], d_near_m, near[k].outside_m);
    if (has_seams) weight = joining_weight(patch, k, near[k].outside_m, weight);
    if (weight > 0) add_contact(k, weight);
  }
}

void HapticCore::State::add_points(const ContactPatch& patch) noexcept {
  const Real distance = patch.merge_distance_m;
  for (std::uint32_t k = 0; k < patch.point_count; ++k) {
    const Vec3& p = points[patch.point_begin + k];
    bool known = false;
    for (const Vec3& q : merged_points) {
      known = known || (q - p).squaredNorm() <= distance * distance;
    }
    if (!known) static_cast<void>(merged_points.push(p));
  }
}

/// How far the point of a node lies past the end of a feature, 0 to 1.
Real HapticCore::State::past_end(const NearNode& node) const noexcept {
  return 1 - contact_weight(0, 0, 0, node.outside_m, epsilon_m, epsilon_o_m);
}

/// How much of what a patch is nearest to lies past the ends of its features, where others may have
/// it.
Real HapticCore::State::past_ends(const ContactPatch& patch) const noexcept {
  Real most = 0;
  for (std::uint32_t k = patch.near_begin; k < patch.near_begin + patch.near_count; ++k) {
    most = std::max(most, weight_of(near[k], patch.d_near_m, 0) * past_end(near[k]));
  }
  return most;
}

/// The patch that leads the next group, or their number. Where bodies have seams those go first
/// that hold what they are nearest to; what may be the contact of another piece comes last: only
/// where no group has taken it is it one of its own.
std::uint32_t HapticCore::State::next_leader() const noexcept {
  std::uint32_t next = patches.size();
  for (std::uint32_t i = 0; i < patches.size(); ++i) {
    if (shares[i].led || patches[i].lends) continue;
    if (shares[i].left == 0 && (!shares_nodes() || patches[i].is_of_neighbour())) continue;
    if (next == patches.size()) {
      next = i;
      if (!has_seams) break;
      continue;
    }
    const bool late = patches[i].is_of_neighbour(), next_late = patches[next].is_of_neighbour();
    if (late != next_late ? next_late : shares[i].past_ends < shares[next].past_ends) next = i;
  }
  return next;
}

/// Contacts of one body in one plane are one contact: deepest D_near once, points united (method
/// section 10).
Wrench HapticCore::State::total_wrench(StepResult& result) noexcept {
  Wrench total;
  std::fill_n(shares.begin(), patches.size(), PatchShare{});
  if (shares_nodes()) {
    begin_shares();
    for (std::uint32_t i = 0; i < patches.size(); ++i) shares[i].past_ends = past_ends(patches[i]);
  }
  for (std::uint32_t count = 0; count < patches.size(); ++count) {
    const std::uint32_t first = next_leader();
    if (first == patches.size()) break;
    const Wrench wrench = group_wrench(first, result);
    total.force_w += wrench.force_w;
    total.torque_w += wrench.torque_w;
  }
  return total;
}

/// Takes a patch's near nodes, however far past the end of a feature their points lie. Those that
/// lie in their features count in the contact as it is: here next to nothing, or they would hold
/// the place of what is nearest until they are no longer near.
void HapticCore::State::add_past_ends(const ContactPatch& patch,
                                      const ContactPatch& group) noexcept {
  for (std::uint32_t k = patch.near_begin; k < patch.nodes_end(); ++k) {
    const NearNode& n = near[k];
    if (node_shares[k].joining == 0) continue;
    const Real weight = joining_weight(patch, k, 0, weight_of(n, group.d_near_m, 0));
    if (!(weight > 0)) continue;
    const Real past = epsilon_o_m / (epsilon_o_m + n.outside_m);
    const Real outside = kInsideShare + past_end(n);
    add_contact(k, weight * outside * past * past);
  }
}

/// Of a whole pair the nearest C-face holds its application point, which gives it full weight. One
/// whose nearest nodes only separate may have none: the part goes on past the end of a feature into
/// the piece beside. As the largest weight falls, the contact becomes that of the nearest nodes
/// past their ends, as deep as the pair is by all its nodes: it leaves when the pair comes apart.
/// `share`: of the leader that no other group has.
void HapticCore::State::hold_on(const ContactPatch& leader, const ContactPatch& group, Real share,
                                Wrench& wrench) noexcept {
  Real largest = 0;
  for (const WeightedContact& contact : contacts) largest = std::max(largest, contact.weight);
  if (largest == 1) return;
  wrench.force_w *= largest;
  wrench.torque_w *= largest;
  if (share <= largest) return;
  contacts.clear();
  contact_classes.clear();
  add_past_ends(leader, group);
  for (std::uint32_t j = 0; j < patches.size(); ++j) {
    if (shares[j].joining > 0) add_past_ends(patches[j], group);
  }
  Real nearest = 0;
  for (const WeightedContact& contact : contacts) nearest = std::max(nearest, contact.weight);
  if (!(nearest > 0)) return;
  for (WeightedContact& contact : contacts) contact.weight /= nearest;
  const Wrench past =
      weighted_region_wrench(contacts.view(), group.full_m, k_f_n_per_m, group.size_m, hull);
  wrench.force_w += (share - largest) * past.force_w;
  wrench.torque_w += (share - largest) * past.torque_w;
}

/// No neighbour has the contact of this patch: it is one of its own, at the node that was passed
/// over for it. A depth beyond it would be one to the far side of the piece.
void HapticCore::State::lead_with_passed(ContactPatch& group) noexcept {
  const NearNode& node = near[group.passed_node];
  const bool of_a = node.type == ContactType::kA;
  group.plane = group.of_neighbour[0].sign != 0 && group.of_neighbour[0].of_a == of_a
                    ? group.of_neighbour[0]
                    : group.of_neighbour[1];
  group.of_neighbour = {};
  group.normal_w = node.normal_w;
  group.d_near_m = std::min(node.f_m, Real{0});
  group.near_begin = group.passed_node;
  group.near_count = 1;
  group.nearest = 1;
  group.lent_count = 0;
  group.point_count = 0;
  if (has_law(LawId::kPaper)) static_cast<void>(merged_points.push(node.app_w));
}

/// Gives the patches their shares in the group that `first` leads; its depths are the deepest of
/// both, in the measure of the shares.
ContactPatch HapticCore::State::form_group(std::uint32_t first, const ContactPatch& leader,
                                           StepCounters& counters) noexcept {
  ContactPatch group = leader;
  for (std::uint32_t j = 0; j < patches.size(); ++j) shares[j].joining = shares[j].held = 0;
  shares[first].left = 0;
  shares[first].led = true;
  Real in_plane = 1;
  if (kSceneTraits.several_pairs && shares_nodes()) {
    find_held(first, leader, counters);
    in_plane = coplanar_in(leader, leader.normal_w);
  }
  for (std::uint32_t j = 0; kSceneTraits.several_pairs && j < patches.size(); ++j) {
    const ContactPatch& patch = patches[j];
    PatchShare& share = shares[j];
    if (share.left == 0) continue;
    const Real in_group = joins(patch, leader) ? std::max(share.held, in_plane) : share.held;
    share.joining = share.left * in_group;
    share.left *= 1 - in_group;
    if (share.joining > 0 && shares_nodes()) share_nodes(patch, leader, in_group, counters);
    if (share.joining == 0 || patch.lends || patch.is_of(leader.plane)) continue;  // no own depth
    const Real d = leader.d_near_m + share.joining * (patch.d_near_m - leader.d_near_m);
    const Real full = leader.full_m + share.joining * (patch.full_m - leader.full_m);
    group.d_near_m = std::min(group.d_near_m, share.joining == 1 ? patch.d_near_m : d);
    group.full_m = std::min(group.full_m, full);
  }
  return group;
}

/// Wrench of the contact that patch `first` leads, with the patches of which others have not all.
Wrench HapticCore::State::group_wrench(std::uint32_t first, StepResult& result) noexcept {
  ContactPatch leader = patches[first];
  merged_points.clear();
  contacts.clear();
  contact_classes.clear();
  const Real share = shares[first].left;
  if (leader.is_of_neighbour()) {
    lead_with_passed(leader);
    if (shares_nodes()) node_shares[leader.near_begin].left = share;  // no more than its patch
  }
  const ContactPatch group = form_group(first, leader, result.counters);
  if (shares_nodes()) {
    for (std::uint32_t k = leader.near_begin; k < leader.near_begin + leader.near_count; ++k) {
      node_shares[k] = {0, node_shares[k].left, 0};
    }
  }
  add_to_group(leader, group);
  for (std::uint32_t j = 0; kSceneTraits.several_pairs && j < patches.size(); ++j) {
    if (shares[j].joining > 0) add_to_group(patches[j], group);
  }
  if (has_law(LawId::kPaper)) {
    result.counters.hull_points = std::max(result.counters.hull_points, merged_points.size());
    return paper_wrench(group, merged_points.view(), k_f_n_per_m, group.size_m, hull);
  }
  Wrench wrench =
      weighted_region_wrench(contacts.view(), group.d_near_m, k_f_n_per_m, group.size_m, hull);
  std::uint32_t hull_points = contacts.size();
  if (has_seams) {
    hold_on(leader, group, share, wrench);
    hull_points = std::max(hull_points, contacts.size());
  }
  result.counters.hull_points = std::max(result.counters.hull_points, hull_points);
  return wrench;
}

/// Nothing that a caller may ask for or not is part of it: of law kProxy neither D_near nor the
/// work of the search at the goal pose.
void HapticCore::State::chain_hash(const StepResult& result) noexcept {
  StateHash chain(hash);
  chain.add(result.wrench_w.force_w);
  chain.add(result.wrench_w.torque_w);
  if (has_law(LawId::kProxy)) {
    const StepCounters& n = result.counters;
    chain.add(result.proxy_pose_wa.p_wa);
    for (int k = 0; k < 4; ++k) chain.add(result.proxy_pose_wa.q_wa.coeffs()[k]);
    chain.add(result.proxy_gap_m);
    chain.add(std::uint64_t{result.flags & ~kGoalContactFlags} << 32 |
              static_cast<std::uint32_t>(result.situation));
    chain.add(std::uint64_t{n.plane_gaps} << 32 | n.valid_nodes);
    chain.add(std::uint64_t{n.full_searches} << 32 | n.qp_steps);
    hash = chain.value();
    return;
  }
  chain.add(result.d_near_m);
  chain.add(std::uint64_t{result.flags} << 32 | result.nearest_pair);
  chain.add(std::uint64_t{result.counters.feature_evaluations} << 32 | result.counters.edge_pairs);
  chain.add(std::uint64_t{result.counters.near_nodes} << 32 | result.counters.support_pairs);
  hash = chain.value();
}

}  // namespace haptic
