// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The nearest C-faces of one C-obstacle, exactly and completely, in every tick (paper Sec. III).
/// D_near is the largest value over all applicable basic contacts; the near set holds every basic
/// contact within epsilon of it. Faces and edges keep stale upper bounds of what they can carry
/// (contact/feature_bounds.hpp): what is not looked at provably cannot matter.

#include <cstdint>

#include "rt_core/base/bounded_list.hpp"
#include "rt_core/contact/basic_contact.hpp"
#include "rt_core/contact/feature_bounds.hpp"

namespace haptic {

/// A node of the near set: |D_near - f| + max(violation, 0) < epsilon.
struct NearNode {
  std::uint32_t node = 0;  ///< number in the pair
  ContactType type = ContactType::kA;
  std::uint16_t i = 0, j = 0;     ///< features of A and B
  Vec3 normal_w = Vec3::Zero();   ///< outward unit normal of the C-face
  Real f_m = 0;                   ///< n.((x - b) + R a)
  Real violation_m = 0;           ///< largest height of a neighbouring vertex (method section 2)
};

enum NearFlag : std::uint32_t {
  kNearAllStale = 1u << 0,      ///< every face and edge was evaluated: first tick, or a jump
  kNearSetCut = 1u << 1,        ///< more near nodes than room
  kNearEdgePairsCut = 1u << 2   ///< more pairs of edges than may be tested: D_near is a lower bound
};

/// What one search returns.
struct NearResult {
  Real d_near_m = 0;   ///< largest value: D_near, or a lower bound of it when edge pairs were cut
  NearNode best;       ///< node of D_near; among ties a face, then the lowest number
  SupportPair support;  ///< support vertices along its normal: with them d_near_m certifies itself
  std::uint32_t flags = 0;  ///< NearFlag
  std::uint32_t feature_evaluations = 0;
  std::uint32_t edge_pairs = 0;
  std::uint32_t support_pairs = 0;
};

/// Finds D_near at `pose` and appends the near set to `near`, in the order in which the search met
/// it. `bounds` must have been advanced to this pose. Exact at every pose, whatever the motion since
/// the last call. Cost: at most every face and edge of both pieces once, the pair's
/// edge_pair_capacity edge pairs and near_capacity near nodes; typically a handful of each.
[[nodiscard]] NearResult find_near_set(const PairPose& pose, Real epsilon_m, FeatureBounds& bounds,
                                       BoundedList<NearNode>& near) noexcept;

}  // namespace haptic
