// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Laws but proxy: from the contacts at the goal pose to one wrench, pair by pair.

#include <cstdint>

#include "rt_core/base/bounded_list.hpp"
#include "rt_core/tracking/goal_contact.hpp"
#include "rt_core/tracking/planar_hull.hpp"

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
  [[nodiscard]] bool joins(const ContactPatch& patch, const ContactPatch& leader) const noexcept;
  [[nodiscard]] ContactPatch gather(const ContactSet& set, std::uint32_t first) noexcept;
  void add_points(std::span<const Vec3> points, Real merge_distance_m) noexcept;
  [[nodiscard]] Wrench wrench_of(const ContactPatch& contact,
                                 const HullScratch& hull) const noexcept;

  Real k_f_n_per_m_ = 0;
  LawId law_ = LawId::kPaper;
  bool has_seams_ = false;
  std::span<bool> joined_;    ///< per patch: a contact has it
  BoundedList<Vec3> points_;  ///< of the contact at hand
};

}  // namespace haptic
