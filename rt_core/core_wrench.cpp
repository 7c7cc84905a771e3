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

/// Two patches of one static body are one contact when their planes agree this closely.
constexpr Real kSamePlaneChord = HAPTIC_REAL_IS_FLOAT ? 1.0e-3_r : 1.0e-6_r;

}  // namespace

/// Whether a patch is part of the contact that `leader` leads: one plane of the static body, which
/// a rigid part meets at its deepest point whatever its pieces reach, or one plane at one depth.
bool HapticCore::State::joins(const ContactPatch& patch,
                              const ContactPatch& leader) const noexcept {
  if (patch.body_b != leader.body_b) return false;
  if (has_seams && !patch.plane.of_a && patch.plane.sign != 0 && patch.plane == leader.plane) {
    return true;
  }
  return (patch.normal_w - leader.normal_w).squaredNorm() <= kSamePlaneChord * kSamePlaneChord &&
         std::abs(patch.d_near_m - leader.d_near_m) <= patch.merge_distance_m;
}

/// Weight of a near node in a contact of this depth.
Real HapticCore::State::weight_of(const NearNode& node, Real d_near_m) const noexcept {
  const Real weight =
      contact_weight(node.f_m, d_near_m, node.violation_m, node.outside_m, epsilon_m, epsilon_o_m);
  if (node.rise_m <= (kMaxRise - 1) * epsilon_m) return weight;
  return weight * (kMaxRise - node.rise_m / epsilon_m);
}

/// Takes a patch into the lists of its contact: the near nodes with their weights, or the paper's
/// distinct points.
void HapticCore::State::add_to_contact(const ContactPatch& patch,
                                       const ContactPatch& contact) noexcept {
  if (has_law(LawId::kPaper)) return add_points(patch);
  for (std::uint32_t k = patch.near_begin; k < patch.near_begin + patch.near_count; ++k) {
    const Real weight = weight_of(near[k], contact.d_near_m);
    if (weight > 0) static_cast<void>(contacts.push({near[k].normal_w, near[k].app_w, weight}));
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

/// Contacts of one body in one plane are one contact: deepest D_near once, points united (METHOD
/// section 10).
Wrench HapticCore::State::total_wrench(StepResult& result) noexcept {
  Wrench total;
  std::fill_n(joined.begin(), patches.size(), false);
  for (std::uint32_t i = 0; i < patches.size(); ++i) {
    if (joined[i]) continue;
    const Wrench wrench = contact_wrench(i, result);
    total.force_w += wrench.force_w;
    total.torque_w += wrench.torque_w;
  }
  return total;
}

/// Wrench of the contact that patch `first` leads, with the patches that join it.
Wrench HapticCore::State::contact_wrench(std::uint32_t first, StepResult& result) noexcept {
  const ContactPatch& leader = patches[first];
  merged_points.clear();
  contacts.clear();
  ContactPatch contact = leader;
  const auto for_each_joined = [&](const auto& visit) {
    visit(first);
    for (std::uint32_t j = first + 1; kSceneTraits.several_pairs && j < patches.size(); ++j) {
      if (!joined[j] && joins(patches[j], leader)) visit(j);
    }
  };
  for_each_joined(
      [&](std::uint32_t j) { contact.d_near_m = std::min(contact.d_near_m, patches[j].d_near_m); });
  for_each_joined([&](std::uint32_t j) {
    add_to_contact(patches[j], contact);
    joined[j] = true;
  });
  const std::uint32_t count = std::max(merged_points.size(), contacts.size());
  result.counters.hull_points = std::max(result.counters.hull_points, count);
  if (has_law(LawId::kPaper)) {
    return paper_wrench(contact, merged_points.view(), k_f_n_per_m, contact.size_m, hull);
  }
  Wrench wrench =
      weighted_region_wrench(contacts.view(), contact.d_near_m, k_f_n_per_m, contact.size_m, hull);
  if (!has_seams) return wrench;
  // Past the end of what its piece has of a feature the contact fades: another piece touches there.
  Real largest = 0;
  for (const WeightedContact& c : contacts) largest = std::max(largest, c.weight);
  wrench.force_w *= largest;
  wrench.torque_w *= largest;
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
