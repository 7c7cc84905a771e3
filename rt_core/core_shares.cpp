// SPDX-License-Identifier: Apache-2.0
// Which patches of a tick are one contact, and how groups of them share nodes. Each patch leads at
// most one group: with P patches the loops over patches of all groups run at most P^2 times, and of
// N near nodes each pair is compared at most twice (SceneCapacity::max_node_pairs).
#include <algorithm>
#include <cmath>

#include "rt_core/core_state.hpp"

namespace haptic {
namespace {

/// Two patches of one static body are one contact when their planes agree this closely.
constexpr Real kSamePlaneChord = HAPTIC_REAL_IS_FLOAT ? 1.0e-3_r : 1.0e-6_r;

/// Contacts with normals this close are of one plane where two pairs share a contact; beyond, less
/// and less, and none at twice the angle.
constexpr Real kOnePlaneChord = kCoplanarAngle_rad;

/// How alike two normals are: 1 of one plane, 0 beyond twice that.
Real alike(const Vec3& m, const Vec3& n) noexcept {
  return std::clamp(2 - (m - n).norm() / kOnePlaneChord, Real{0}, Real{1});
}

}  // namespace

/// Whether a patch is part of the contact that `group` leads: one plane at one depth, or where the
/// part goes on in the piece whose plane the group has.
bool HapticCore::State::joins(const ContactPatch& patch, const ContactPatch& group) const noexcept {
  if (patch.body_b != group.body_b) return false;
  if (patch.is_of(group.plane)) return true;
  // One rigid body meets one plane of another at its deepest point, whatever its pieces reach.
  if (has_seams && !patch.plane.of_a && patch.plane.sign != 0 && patch.plane == group.plane) {
    return true;
  }
  return (patch.normal_w - group.normal_w).squaredNorm() <= kSamePlaneChord * kSamePlaneChord &&
         std::abs(patch.d_near_m - group.d_near_m) <= patch.merge_distance_m;
}

/// No group has any node yet; which of them are one contact.
void HapticCore::State::begin_shares() noexcept {
  std::fill_n(node_shares.begin(), near.size(), NodeShare{});
  classes.clear();
  for (std::uint32_t i = 0; i < patches.size(); ++i) {
    ContactPatch& patch = patches[i];
    Real nearest = 0;
    for (std::uint32_t k = patch.near_begin; k < patch.near_begin + patch.near_count; ++k) {
      nearest = std::max(nearest, weight_of(near[k], patch.d_near_m, 0));
    }
    if (nearest > 0) patch.nearest = nearest;
    const auto add = [&](std::uint32_t k) {
      classes.add(k, i, patch.body_b, contact_identity(pairs[patch.pair].view, near[k]));
    };
    for (std::uint32_t k = patch.near_begin; k < patch.nodes_end(); ++k) add(k);
    if (patch.is_of_neighbour()) add(patch.passed_node);
  }
  classes.form();
}

/// Weight of a near node of the patch at the patch's own depth. What a patch is nearest to counts
/// whole: depth and planes are rounded apart, and no remainder of a contact may be rounding.
Real HapticCore::State::own_weight(const ContactPatch& patch, const NearNode& node,
                                   Real outside_m) const noexcept {
  return weight_of(node, patch.d_near_m, outside_m) / patch.nearest;
}

/// How much of what a patch is nearest to lies in its own features and not in the plane of `n`.
Real HapticCore::State::holding_beside(const ContactPatch& patch, const Vec3& n) const noexcept {
  Real most = 0;
  for (std::uint32_t k = patch.near_begin; k < patch.near_begin + patch.near_count; ++k) {
    const NearNode& m = near[k];
    const Real weight = own_weight(patch, m, m.outside_m) * node_shares[k].left;
    if (weight > most) most = std::max(most, weight * (1 - alike(m.normal_w, n)));
  }
  return most;
}

/// How much of a contact of this weight the patch with the same contact `k` has: it lies in its
/// features.
Real HapticCore::State::held_with(Real weight, std::uint32_t k,
                                  const ContactPatch& patch) const noexcept {
  const NearNode& node = near[k];
  if (node.outside_m >= epsilon_o_m) return 0;
  return weight * own_weight(patch, node, node.outside_m) * node_shares[k].left;
}

/// Share 0 to 1 of the nearest contacts of each patch that `leader` has, or of the leader's that
/// the patch has. Where the leader holds a contact of its own in another plane, that is the one it
/// leads, and what the patch has is another. Which face names the plane of a patch changes from
/// tick to tick; what two pairs find of one contact does not.
void HapticCore::State::find_held(std::uint32_t first, const ContactPatch& leader,
                                  StepCounters& counters) noexcept {
  counters.node_pairs += leader.near_count;  // for the group's own plane
  for (std::uint32_t l = leader.near_begin; l < leader.near_begin + leader.near_count; ++l) {
    const Real nearest = own_weight(leader, near[l], 0) * node_shares[l].left;
    node_shares[l].nearest = nearest;
    if (node_shares[l].left == 0) continue;
    Real led = -1;  // formed where another patch has the contact
    for (const ContactClasses::Member& member : classes.same_as(l)) {
      const std::uint32_t k = member.node, j = classes.patch_of(k);
      if (j == first) continue;
      counters.node_pairs += 1;
      const ContactPatch& patch = patches[j];
      if (shares[j].left == 0 || k >= patch.near_begin + patch.near_count) continue;
      if (node_shares[k].left == 0) continue;
      if (led < 0) {
        led = nearest * (1 - holding_beside(leader, near[l].normal_w));
        counters.node_pairs += leader.near_count;
      }
      const Real weight = own_weight(patch, near[k], 0) * node_shares[k].left;
      const Real held = std::max(held_with(weight, l, leader), held_with(led, k, patch));
      shares[j].held = std::max(shares[j].held, held);
    }
  }
}

/// How far a contact with the normal `n` is of a plane that `leader` is near, 0 to 1.
Real HapticCore::State::coplanar_in(const ContactPatch& leader, const Vec3& n) const noexcept {
  Real most = 0;
  for (std::uint32_t l = leader.near_begin; l < leader.near_begin + leader.near_count; ++l) {
    const Real weight = node_shares[l].nearest;
    if (weight > most) most = std::max(most, alike(near[l].normal_w, n) * weight);
  }
  return most;
}

/// Gives the group of `leader` the nodes of a patch that lie in its planes.
void HapticCore::State::share_nodes(const ContactPatch& patch, const ContactPatch& leader,
                                    Real share, StepCounters& counters) noexcept {
  const auto give = [&](std::uint32_t k) {
    node_shares[k].joining = 0;
    if (node_shares[k].left == 0) return;
    const Real taken = share * coplanar_in(leader, near[k].normal_w);
    node_shares[k].joining = node_shares[k].left * taken;
    node_shares[k].left *= 1 - taken;
    counters.node_pairs += leader.near_count;
  };
  for (std::uint32_t k = patch.near_begin; k < patch.nodes_end(); ++k) give(k);
}

}  // namespace haptic
