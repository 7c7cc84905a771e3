// SPDX-License-Identifier: Apache-2.0
#include "rt_core/tick/core_memory.hpp"

#include <bit>
#include <cstddef>

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

}  // namespace

std::uint64_t chained_hash(std::uint64_t before, const StepResult& result, bool felt) noexcept {
  StateHash chain(before);
  chain.add(result.wrench_w.force_w);
  chain.add(result.wrench_w.torque_w);
  if (felt) {
    const StepCounters& n = result.counters;
    chain.add(result.proxy_pose_wa.p_wa);
    for (int k = 0; k < 4; ++k) chain.add(result.proxy_pose_wa.q_wa.coeffs()[k]);
    chain.add(result.proxy_gap_m);
    chain.add(std::uint64_t{result.flags & ~kGoalContactFlags} << 32 |
              static_cast<std::uint32_t>(result.situation));
    chain.add(std::uint64_t{n.plane_gaps} << 32 | n.valid_nodes);
    chain.add(std::uint64_t{n.full_searches} << 32 | n.qp_steps);
    if (kSceneTraits.guide && result.guidance.state != GuideState::kNone) {
      const Guidance& g = result.guidance;
      chain.add(g.wrench_w.force_w);
      chain.add(g.wrench_w.torque_w);
      chain.add(std::uint64_t{g.station} << 32 | static_cast<std::uint32_t>(g.state));
      chain.add(g.energy_j);
    }
    return chain.value();
  }
  chain.add(result.d_near_m);
  chain.add(std::uint64_t{result.flags} << 32 | result.nearest_pair);
  chain.add(std::uint64_t{result.counters.feature_evaluations} << 32 | result.counters.edge_pairs);
  chain.add(std::uint64_t{result.counters.near_nodes} << 32 | result.counters.support_pairs);
  return chain.value();
}

void CoreMemory::place(Arena& arena, const SceneView& scene) noexcept {
  const SceneCapacity& c = scene.header().capacity;
  arena.enter(StatePart::kPairs);
  searches_goal = kSceneTraits.goal_contact && has_goal_contact(scene.parameters());
  if (searches_goal) pairs = arena.take<PairView>(c.pair_count);
  goal_contact.place(arena, scene, searches_goal);
  const std::size_t near_nodes = near_room(c, searches_goal);
  const std::size_t hull_points = kFormsHulls ? near_nodes : 0;
  hull.points = arena.take<PlanePoint>(hull_points);
  hull.hull = arena.take<PlanePoint>(2 * hull_points);
  output.place(arena, scene);
  arena.enter(StatePart::kLaw);
  if (kSceneTraits.is_law(scene.parameters().law, LawId::kProxy)) {
    free_motion.place(arena, scene);
    if (kSceneTraits.guide && scene.guide() != nullptr) guide = arena.take<GuideStage>(1).data();
  } else {
    direct_wrench.place(arena, scene);
  }
}

void CoreMemory::read_scene(const SceneView& scene) noexcept {
  law = scene.parameters().law;
  pair_count = scene.pair_count();
  for (std::uint32_t i = 0; i < pairs.size(); ++i) pairs[i] = scene.pair(i);
  goal.read_scene(scene);
  goal_contact.read_scene(scene, pairs);
  if (has_law(LawId::kProxy)) {
    free_motion.read_scene(scene);
    if (has_guide()) guide->read_scene(scene);
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
  if (has_guide()) guide->reset();
  output.reset();
  hash = kHashStart;
  peaks = StepPeaks{};
}

}  // namespace haptic
