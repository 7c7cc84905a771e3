// SPDX-License-Identifier: Apache-2.0
#include "rt_core/scene/scene_needs.hpp"

#include <algorithm>

#include "rt_core/scene/fixed_planes.hpp"

namespace haptic {

SceneTraits needs_of(const SceneView& scene) noexcept {
  const SceneParameters& p = scene.parameters();
  const SceneCapacity& c = scene.header().capacity;
  constexpr SceneTraits kAll{};
  SceneTraits needs{};
  needs.image = true;
  needs.content_hash = scene.header().content_hash;
  needs.paper = p.law == LawId::kPaper;
  needs.weighted_region = p.law == LawId::kWeightedRegion;
  needs.proxy = p.law == LawId::kProxy;
  needs.friction = false;
  for (const BodyRecord& body : scene.bodies()) {
    needs.friction = needs.friction || (needs.proxy && body.friction > 0);
  }
  needs.coupling_damping = needs.proxy && p.coupling.damping_ns_per_m > 0;
  needs.several_pairs = c.pair_count > 1;
  needs.visit_budget = c.pair_count > c.max_pair_visits;
  needs.stored_graphs = needs.formed_graphs = false;
  std::uint32_t nodes = 0;
  for (const PairRecord& pair : scene.pairs()) {
    (pair.node_begin == kGraphNotStored ? needs.formed_graphs : needs.stored_graphs) = true;
    nodes = std::max(nodes, pair.node_count);
  }
  needs.wide_lists = needs.stored_graphs && scene.neighbors_wide();
  needs.narrow_lists = needs.stored_graphs && !scene.neighbors_wide();
  needs.fixed_orientation = is_one_orientation(p.envelope);
  needs.free_orientation = !needs.fixed_orientation;
  needs.passivity = p.coupling.passivity != 0;
  needs.device_twist = p.device.given != 0;
  needs.clutch = needs.contact_geometry = needs.table_checks = false;
  // Where a pass displaces a step it has one row per pair (law/proxy_pass.cpp).
  needs.qp_rows =
      needs.friction ? kAll.qp_rows : std::clamp(c.pair_count, kMaxProxyRows, kAll.qp_rows);
  needs.valid_visits = std::min(nodes, kAll.valid_visits);
  return needs;
}

bool covers(const SceneTraits& compiled, const SceneTraits& needed) noexcept {
  if (compiled.image && compiled.content_hash != needed.content_hash) return false;
  for (const auto feature :
       {&SceneTraits::paper, &SceneTraits::weighted_region, &SceneTraits::proxy,
        &SceneTraits::friction, &SceneTraits::coupling_damping, &SceneTraits::several_pairs,
        &SceneTraits::visit_budget, &SceneTraits::stored_graphs, &SceneTraits::formed_graphs,
        &SceneTraits::narrow_lists, &SceneTraits::wide_lists, &SceneTraits::fixed_orientation,
        &SceneTraits::free_orientation, &SceneTraits::passivity, &SceneTraits::device_twist,
        &SceneTraits::clutch, &SceneTraits::contact_geometry, &SceneTraits::table_checks}) {
    if (needed.*feature && !(compiled.*feature)) return false;
  }
  return compiled.qp_rows >= needed.qp_rows && compiled.valid_visits >= needed.valid_visits;
}

}  // namespace haptic
