// SPDX-License-Identifier: Apache-2.0
#include "rt_core/scene/scene_needs.hpp"

#include <algorithm>

#include "rt_core/scene/capacity.hpp"

namespace haptic {
SceneTraits needs_of(const SceneView& scene) noexcept {
  const SceneParameters& p = scene.parameters();
  const SceneCapacity& c = scene.header().capacity;
  constexpr SceneTraits kAll{};
  SceneTraits needs{};
  needs.image = true;
  needs.content_hash = scene.header().content_hash;
  const bool proxy = p.law == LawId::kProxy;
  needs.laws = law_set(p.law);
  needs.friction = false;
  for (const BodyRecord& body : scene.bodies()) {
    needs.friction = needs.friction || (proxy && body.friction > 0);
  }
  std::uint32_t nodes = 0;
  for (const PairRecord& pair : scene.listed_pairs()) nodes = std::max(nodes, pair.node_count);
  if (!scene.lists_pairs()) {
    const std::uint32_t moving = scene.bodies()[0].piece_count;
    nodes =
        static_cast<std::uint32_t>(basic_contacts(largest_counts(scene.pieces().first(moving)),
                                                  largest_counts(scene.pieces().subspan(moving))));
  }
  needs.free_orientation = !is_one_orientation(p.envelope);
  needs.facets = has_facets(scene.pieces());
  const bool screened = is_screened(scene.pieces(), scene.bodies()[0].piece_count);
  needs.many_pairs =
      proxy && !screened &&
      (c.pair_count > c.near_slots || near_seats(c.near_slots, p.coupling.near_pairs).take_turns);
  needs.device =
      p.coupling.passivity != 0 || p.device.given != 0 || p.coupling.damping_ns_per_m > 0;
  needs.goal_contact = has_goal_contact(p);
  needs.guide = proxy && scene.guide() != nullptr;
  needs.contact_geometry = needs.table_checks = false;
  // Where a pass displaces a step it has one row per pair (proxy/proxy_pass.cpp).
  needs.qp_rows =
      needs.friction ? kAll.qp_rows : std::clamp(c.pair_count, kMaxProxyRows, kAll.qp_rows);
  needs.valid_visits = std::min(nodes, kAll.valid_visits);
  return needs;
}

bool covers(const SceneTraits& compiled, const SceneTraits& needed) noexcept {
  if (compiled.image && compiled.content_hash != needed.content_hash) return false;
  if ((needed.laws & ~compiled.laws) != 0) return false;
  for (const auto feature :
       {&SceneTraits::friction, &SceneTraits::free_orientation, &SceneTraits::facets,
        &SceneTraits::many_pairs, &SceneTraits::goal_contact, &SceneTraits::device,
        &SceneTraits::guide, &SceneTraits::contact_geometry, &SceneTraits::table_checks}) {
    if (needed.*feature && !(compiled.*feature)) return false;
  }
  return compiled.qp_rows >= needed.qp_rows && compiled.valid_visits >= needed.valid_visits;
}

}  // namespace haptic
