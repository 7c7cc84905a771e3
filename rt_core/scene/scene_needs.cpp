// SPDX-License-Identifier: Apache-2.0
#include "rt_core/scene/scene_needs.hpp"

#include <algorithm>

#include "rt_core/scene/fixed_planes.hpp"
#include "rt_core/scene/graph_rule.hpp"

namespace haptic {
namespace {

/// Types of the basic contacts of a pair that some pose can need. Cost: its marks or planes.
void need_types(const PairView& pair, SceneTraits& needs) noexcept {
  if (pair.fixed != nullptr) {
    needs.type_a = needs.type_b = true;  // every face has a plane
    for (std::uint32_t k = 0; k < pair.fixed->plane_count; ++k) {
      needs.type_c |= static_cast<ContactType>(pair.planes[k].type) == ContactType::kC;
    }
    for (std::uint32_t k = 0; k < pair.fixed->node_count; ++k) {
      needs.type_c |= static_cast<ContactType>(pair.plane_nodes[k].type) == ContactType::kC;
    }
    return;
  }
  if (pair.record->mark_begin == kNotMarked) {
    needs.type_a = needs.type_b = needs.type_c = true;
    return;
  }
  const std::uint64_t* const reachable = pair.marks.words;
  const std::uint64_t a = pair.record->node_count_a, b = a + pair.record->node_count_b;
  const bool faces = count_bits(reachable, 0, b) > 0;
  needs.type_a |= !faces || count_bits(reachable, 0, a) > 0;  // no contact at all has that type
  needs.type_b |= count_bits(reachable, a, b) > 0;
  needs.type_c |= count_bits(reachable, b, pair.record->node_count) > 0;
  needs.type_b |= needs.type_c;  // in addition to last tick's edge pair a search tries a face of B
}

/// Whether some node of a pair only separates.
bool hides(const PairView& pair) noexcept {
  if (pair.fixed != nullptr) return pair.fixed->hidden != 0;
  const auto counts = [&](NodeScope scope) {
    return live_counts(pair.marks, scope, *pair.record, *pair.a.record, *pair.b.record);
  };
  return has_hidden(counts(NodeScope::kReachable), counts(NodeScope::kLive));
}

}  // namespace

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
  needs.type_a = needs.type_b = needs.type_c = false;
  needs.marked_nodes = needs.hidden_nodes = false;
  std::uint32_t nodes = 0;
  for (std::uint32_t i = 0; i < c.pair_count; ++i) {
    const PairView pair = scene.pair(i);
    (pair.graph_stored ? needs.stored_graphs : needs.formed_graphs) = true;
    nodes = std::max(nodes, pair.record->node_count);
    need_types(pair, needs);
    needs.marked_nodes = needs.marked_nodes || pair.record->mark_begin != kNotMarked;
    needs.hidden_nodes = needs.hidden_nodes || hides(pair);
  }
  needs.wide_lists = needs.stored_graphs && scene.neighbors_wide();
  needs.narrow_lists = needs.stored_graphs && !scene.neighbors_wide();
  needs.fixed_orientation = is_one_orientation(p.envelope);
  needs.free_orientation = !needs.fixed_orientation;
  needs.orientation_limits =
      (p.envelope.given & kOrientationGiven) != 0 && p.envelope.max_angle_rad > 0;
  needs.workspace_limits = (p.envelope.given & kWorkspaceGiven) != 0;
  needs.device_turns = needs.free_orientation || !needs.proxy;
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
  for (const auto feature : {&SceneTraits::paper,
                             &SceneTraits::weighted_region,
                             &SceneTraits::proxy,
                             &SceneTraits::friction,
                             &SceneTraits::coupling_damping,
                             &SceneTraits::several_pairs,
                             &SceneTraits::visit_budget,
                             &SceneTraits::stored_graphs,
                             &SceneTraits::formed_graphs,
                             &SceneTraits::narrow_lists,
                             &SceneTraits::wide_lists,
                             &SceneTraits::type_a,
                             &SceneTraits::type_b,
                             &SceneTraits::type_c,
                             &SceneTraits::marked_nodes,
                             &SceneTraits::hidden_nodes,
                             &SceneTraits::fixed_orientation,
                             &SceneTraits::free_orientation,
                             &SceneTraits::orientation_limits,
                             &SceneTraits::workspace_limits,
                             &SceneTraits::device_turns,
                             &SceneTraits::passivity,
                             &SceneTraits::device_twist,
                             &SceneTraits::clutch,
                             &SceneTraits::contact_geometry,
                             &SceneTraits::table_checks}) {
    if (needed.*feature && !(compiled.*feature)) return false;
  }
  return compiled.qp_rows >= needed.qp_rows && compiled.valid_visits >= needed.valid_visits;
}

}  // namespace haptic
