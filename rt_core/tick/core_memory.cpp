// SPDX-License-Identifier: Apache-2.0
#include "rt_core/tick/core_memory.hpp"

namespace haptic {

void CoreMemory::place(Arena& arena, const SceneView& scene) noexcept {
  const SceneCapacity& c = scene.header().capacity;
  arena.enter(StatePart::kPairs);
  pairs = arena.take<PairView>(c.pair_count);
  goal_contact.place(arena, scene);
  const std::size_t near_nodes = std::size_t{c.max_near_nodes} + c.pair_count;
  const std::size_t hull_points = kFormsHulls ? near_nodes : 0;
  hull.points = arena.take<PlanePoint>(hull_points);
  hull.hull = arena.take<PlanePoint>(2 * hull_points);
  output.place(arena, scene);
  arena.enter(StatePart::kLaw);
  if (kSceneTraits.is_law(scene.parameters().law, LawId::kProxy)) {
    free_motion.place(arena, scene);
  } else {
    direct_wrench.place(arena, scene);
  }
}

void CoreMemory::read_scene(const SceneView& scene) noexcept {
  law = scene.parameters().law;
  for (std::uint32_t i = 0; i < pairs.size(); ++i) pairs[i] = scene.pair(i);
  goal.read_scene(scene);
  goal_contact.read_scene(scene, pairs);
  if (has_law(LawId::kProxy)) {
    free_motion.read_scene(scene, pairs);
  } else {
    direct_wrench.read_scene(scene, goal_contact.has_seams());
  }
  output.read_scene(scene);
  reset();
}

void CoreMemory::reset() noexcept {
  goal.reset();
  goal_contact.reset();
  if (has_law(LawId::kProxy)) free_motion.reset();
  output.reset();
  hash = kHashStart;
  peaks = StepPeaks{};
}

}  // namespace haptic
