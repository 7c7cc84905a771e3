// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Laws paper and weighted_region: from the contacts at the goal pose to one wrench, pair by pair.

#include <cstdint>

#include "rt_core/base/bounded_list.hpp"
#include "rt_core/law/weighted_region_law.hpp"
#include "rt_core/tick/goal_contact.hpp"

namespace haptic {

struct DirectForce {
  Wrench wrench_w;
  std::uint32_t hull_points = 0;  ///< of the largest contact
};

class DirectWrench {
 public:
  void place(Arena& arena, const SceneView& scene) noexcept;
  /// `has_seams`: some pair has basic contacts that only separate.
  void read_scene(const SceneView& scene, bool has_seams) noexcept;
  /// Contacts of one body in one plane are one contact: deepest D_near once, points united (METHOD
  /// section 10). Cost: the square of the patches, and O(K log K) of the K points of each contact.
  [[nodiscard]] DirectForce of(const ContactSet& set, const HullScratch& hull) noexcept;

 private:
  [[nodiscard]] bool is_paper() const noexcept { return kSceneTraits.is_law(law_, LawId::kPaper); }
  [[nodiscard]] bool joins(const ContactPatch& patch, const ContactPatch& leader) const noexcept;
  [[nodiscard]] Real weight_of(const NearNode& node, Real d_near_m) const noexcept;
  [[nodiscard]] ContactPatch gather(const ContactSet& set, std::uint32_t first) noexcept;
  void add_nodes(std::span<const NearNode> nodes, Real d_near_m) noexcept;
  void add_points(std::span<const Vec3> points, Real merge_distance_m) noexcept;

  LawId law_ = LawId::kWeightedRegion;
  Real k_f_n_per_m_ = 0, epsilon_m_ = 0, epsilon_o_m_ = 0;
  bool has_seams_ = false;
  std::span<bool> joined_;                 ///< per patch: a contact has it
  BoundedList<WeightedContact> contacts_;  ///< of the contact at hand
  BoundedList<Vec3> points_;               ///< the same of law paper
};

}  // namespace haptic
