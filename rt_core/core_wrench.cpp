// SPDX-License-Identifier: Apache-2.0
// From the contacts of all pairs to one wrench, and the hash of the tick.
#include <algorithm>
#include <bit>
#include <cmath>

#include "rt_core/core_state.hpp"

namespace haptic {
namespace {

/// Two patches of one static body are one contact when their planes agree this closely.
constexpr Real kSamePlaneChord = HAPTIC_REAL_IS_FLOAT ? 1.0e-3_r : 1.0e-6_r;

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

}  // namespace

/// Takes a patch's contacts into the lists of its group: the near nodes with their weights, or the
/// paper's distinct points.
void HapticCore::State::add_to_group(const ContactPatch& patch, ContactPatch& group) noexcept {
  group.d_near_m = std::min(group.d_near_m, patch.d_near_m);
  if (law == LawId::kPaper) {
    const Real distance = patch.merge_distance_m;
    for (std::uint32_t k = 0; k < patch.point_count; ++k) {
      const Vec3& p = points[patch.point_begin + k];
      bool known = false;
      for (const Vec3& q : merged_points) {
        known = known || (q - p).squaredNorm() <= distance * distance;
      }
      if (!known) static_cast<void>(merged_points.push(p));
    }
    return;
  }
  for (std::uint32_t k = 0; k < patch.near_count; ++k) {
    const NearNode& n = near[patch.near_begin + k];
    Real weight =
        contact_weight(n.f_m, patch.d_near_m, n.violation_m, n.outside_m, epsilon_m, epsilon_o_m);
    if (n.rise_m > (kMaxRise - 1) * epsilon_m) weight *= kMaxRise - n.rise_m / epsilon_m;
    if (weight > 0) static_cast<void>(contacts.push({n.normal_w, n.app_w, weight}));
  }
}

/// Contacts of one body in one plane are one contact: deepest D_near once, points united (method
/// section 10).
Wrench HapticCore::State::total_wrench(StepResult& result) noexcept {
  Wrench total;
  std::fill_n(merged.begin(), patches.size(), std::uint8_t{0});
  for (std::uint32_t i = 0; i < patches.size(); ++i) {
    if (merged[i] != 0) continue;
    ContactPatch group = patches[i];
    merged_points.clear();
    contacts.clear();
    add_to_group(patches[i], group);
    for (std::uint32_t j = i + 1; j < patches.size(); ++j) {
      const ContactPatch& other = patches[j];
      const bool same_plane =
          other.body_b == group.body_b &&
          (other.normal_w - patches[i].normal_w).squaredNorm() <=
              kSamePlaneChord * kSamePlaneChord &&
          std::abs(other.d_near_m - patches[i].d_near_m) <= other.merge_distance_m;
      if (!same_plane || merged[j] != 0) continue;
      merged[j] = 1;
      add_to_group(other, group);
    }
    Wrench wrench;
    std::uint32_t hull_points = 0;
    if (law == LawId::kPaper) {
      hull_points = merged_points.size();
      wrench = paper_wrench(group, merged_points.view(), k_f_n_per_m, group.size_m, hull);
    } else {
      hull_points = contacts.size();
      wrench =
          weighted_region_wrench(contacts.view(), group.d_near_m, k_f_n_per_m, group.size_m, hull);
    }
    result.counters.hull_points = std::max(result.counters.hull_points, hull_points);
    total.force_w += wrench.force_w;
    total.torque_w += wrench.torque_w;
  }
  return total;
}

void HapticCore::State::chain_hash(const StepResult& result) noexcept {
  StateHash chain(hash);
  chain.add(result.wrench_w.force_w);
  chain.add(result.wrench_w.torque_w);
  chain.add(result.d_near_m);
  chain.add(std::uint64_t{result.flags} << 32 | result.nearest_pair);
  chain.add(std::uint64_t{result.counters.feature_evaluations} << 32 | result.counters.edge_pairs);
  chain.add(std::uint64_t{result.counters.near_nodes} << 32 | result.counters.support_pairs);
  hash = chain.value();
}

void raise_peaks(const StepCounters& counters, StepPeaks& peaks) noexcept {
  for (const auto field :
       {&StepCounters::pair_visits, &StepCounters::support_pairs,
        &StepCounters::feature_evaluations, &StepCounters::edge_pairs, &StepCounters::near_nodes,
        &StepCounters::hull_points, &StepCounters::stale_pairs, &StepCounters::proxy_passes,
        &StepCounters::proxy_rejected, &StepCounters::proxy_rounds, &StepCounters::proxy_rows,
        &StepCounters::qp_iterations, &StepCounters::plane_gaps, &StepCounters::valid_nodes,
        &StepCounters::full_searches}) {
    peaks.*field = std::max(peaks.*field, counters.*field);
  }
}

}  // namespace haptic
