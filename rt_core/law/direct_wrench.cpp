// SPDX-License-Identifier: Apache-2.0
#include "rt_core/law/direct_wrench.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/law/paper_law.hpp"

namespace haptic {
namespace {

/// Two patches of one static body are one contact when their planes agree this closely.
constexpr Real kSamePlaneChord = HAPTIC_REAL_IS_FLOAT ? 1.0e-3_r : 1.0e-6_r;

}  // namespace

void DirectWrench::place(Arena& arena, const SceneView& scene) noexcept {
  const SceneCapacity& c = scene.header().capacity;
  joined_ = arena.take<bool>(c.pair_count);
  const std::size_t near_nodes = std::size_t{c.max_near_nodes} + c.pair_count;
  points_ = BoundedList<Vec3>(arena.take<Vec3>(near_nodes));
}

void DirectWrench::read_scene(const SceneView& scene, bool has_seams) noexcept {
  law_ = scene.parameters().law;
  k_f_n_per_m_ = static_cast<Real>(scene.parameters().k_f_n_per_m);
  has_seams_ = has_seams;
}

/// True if a patch is part of the contact that `leader` leads: one plane of the static body, which
/// a rigid part meets at its deepest point, however far each piece reaches, or one plane at one
/// depth.
bool DirectWrench::joins(const ContactPatch& patch, const ContactPatch& leader) const noexcept {
  if (patch.body_b != leader.body_b) return false;
  if (has_seams_ && !patch.plane.of_a && patch.plane.sign != 0 && patch.plane == leader.plane) {
    return true;
  }
  return (patch.normal_w - leader.normal_w).squaredNorm() <= kSamePlaneChord * kSamePlaneChord &&
         std::abs(patch.d_near_m - leader.d_near_m) <= patch.merge_distance_m;
}

void DirectWrench::add_points(std::span<const Vec3> points, Real merge_distance_m) noexcept {
  for (const Vec3& p : points) {
    bool known = false;
    for (const Vec3& q : points_) {
      known = known || (q - p).squaredNorm() <= merge_distance_m * merge_distance_m;
    }
    if (!known) static_cast<void>(points_.push(p));
  }
}

/// The contact that patch `first` leads, with those that join it, as deep as the deepest; its
/// points stand in the list.
ContactPatch DirectWrench::gather(const ContactSet& set, std::uint32_t first) noexcept {
  const std::span<const ContactPatch> patches = set.patches;
  ContactPatch contact = patches[first];
  const auto for_each_joined = [&](const auto& visit) {
    visit(first);
    for (std::uint32_t j = first + 1; j < patches.size(); ++j) {
      if (!joined_[j] && joins(patches[j], patches[first])) visit(j);
    }
  };
  for_each_joined(
      [&](std::uint32_t j) { contact.d_near_m = std::min(contact.d_near_m, patches[j].d_near_m); });
  points_.clear();
  for_each_joined([&](std::uint32_t j) {
    const ContactPatch& patch = patches[j];
    joined_[j] = true;
    add_points(set.points.subspan(patch.point_begin, patch.point_count), patch.merge_distance_m);
  });
  return contact;
}

/// The wrench of one contact, by the scene's law.
Wrench DirectWrench::wrench_of(const ContactPatch& contact,
                               const HullScratch& hull) const noexcept {
  switch (law_) {
    case LawId::kPaper:
      return paper_wrench(contact, points_.view(), k_f_n_per_m_, contact.size_m, hull);
    case LawId::kProxy:
      break;  // not by contacts at the goal
  }
  return {};
}

DirectForce DirectWrench::of(const ContactSet& set, const HullScratch& hull) noexcept {
  DirectForce total;
  const auto count = static_cast<std::uint32_t>(set.patches.size());
  std::fill_n(joined_.begin(), count, false);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (joined_[i]) continue;
    const ContactPatch contact = gather(set, i);
    const Wrench wrench = wrench_of(contact, hull);
    total.hull_points = std::max(total.hull_points, points_.size());
    total.wrench_w.force_w += wrench.force_w;
    total.wrench_w.torque_w += wrench.torque_w;
  }
  return total;
}

}  // namespace haptic
