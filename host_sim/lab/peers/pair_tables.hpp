// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the core's search keeps of one pair, for those that drive it without the rest of the core.

#include <cstddef>
#include <vector>

#include "rt_core/tracking/near_set.hpp"
#include "tools/common/scene_bytes.hpp"

namespace haptic::sim {

/// Reference point of a body; of the moving one its grip point [m].
[[nodiscard]] inline Vec3 reference_of(const BodyRecord& body) {
  return {static_cast<Real>(body.reference_m[0]), static_cast<Real>(body.reference_m[1]),
          static_cast<Real>(body.reference_m[2])};
}

/// Bounds, scratch and near set in memory of its own. Not movable: the tables point into it.
class PairTables {
 public:
  explicit PairTables(const PairView& pair) : lanes(3 * std::size_t{pair.a.lane_count}) {
    NearScratch::Size size;
    size.fit(*pair.a.record, *pair.b.record);
    const auto place = [&](Arena& arena) {
      bounds.place(arena, *pair.a.record, *pair.b.record);
      scratch.place(arena, size);
      near = BoundedList<NearNode>(arena.take<NearNode>(pair.record.near_capacity));
    };
    Arena counting;
    place(counting);
    memory_ = tools::SceneBytes(counting.used());
    Arena arena(memory_.span().data());
    place(arena);
    bounds.reset(pair.marks);
  }
  PairTables(const PairTables&) = delete;
  PairTables& operator=(const PairTables&) = delete;

  std::vector<Real> lanes;  ///< turned vertices of A
  FeatureBounds bounds;     ///< the stale upper bounds of faces and edges
  NearScratch scratch;
  BoundedList<NearNode> near;

 private:
  tools::SceneBytes memory_;
};

}  // namespace haptic::sim
