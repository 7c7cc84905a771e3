// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/piece_tree.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/scene/scene_traits.hpp"

namespace haptic {
namespace {

/// Radii are rounded up by this share.
constexpr Real kRoundedUp = 1 + 16 * kRealEpsilon;

/// The two ends of a box.
struct BoxEnds {
  Vec3 low = Vec3::Constant(std::numeric_limits<Real>::max());
  Vec3 high = Vec3::Constant(-std::numeric_limits<Real>::max());
};

PieceBox round_boxes(std::span<const PieceBox> boxes,
                     std::span<const std::uint32_t> pieces) noexcept {
  BoxEnds all;
  for (const std::uint32_t i : pieces) {
    all.low = all.low.cwiseMin(boxes[i].middle - boxes[i].half);
    all.high = all.high.cwiseMax(boxes[i].middle + boxes[i].half);
  }
  return {0.5_r * (all.low + all.high), 0.5_r * (all.high - all.low)};
}

}  // namespace

void PieceTree::build(std::span<const PieceSphere> spheres,
                      std::span<const PieceBox> boxes) noexcept {
  for (std::uint32_t i = 0; i < order_.size(); ++i) order_[i] = i;
  nodes_[0] = {{}, 0, static_cast<std::uint32_t>(order_.size()), 0};
  std::uint32_t made = 1;
  for (std::uint32_t k = 0; k < made; ++k) {
    PieceNode& node = nodes_[k];
    const std::span<std::uint32_t> pieces = order_.subspan(node.begin, node.count);
    BoxEnds box;
    for (const std::uint32_t i : pieces) {
      box.low = box.low.cwiseMin(spheres[i].centre);
      box.high = box.high.cwiseMax(spheres[i].centre);
    }
    node.sphere.centre = 0.5_r * (box.low + box.high);
    for (const std::uint32_t i : pieces) {
      const Real far = std::sqrt((spheres[i].centre - node.sphere.centre).squaredNorm());
      node.sphere.radius_m =
          std::max(node.sphere.radius_m, (far + spheres[i].radius_m) * kRoundedUp);
    }
    if (!boxes_.empty()) {
      boxes_[k] = round_boxes(boxes, pieces);
    }
    if (node.count == 1) continue;
    const Vec3 side = box.high - box.low;
    const int axis = side[0] >= side[1] && side[0] >= side[2] ? 0 : side[1] >= side[2] ? 1 : 2;
    const std::uint32_t half = node.count / 2;
    std::nth_element(pieces.data(), pieces.data() + half, pieces.data() + pieces.size(),
                     [&](std::uint32_t l, std::uint32_t r) {
                       const Real at_l = spheres[l].centre[axis], at_r = spheres[r].centre[axis];
                       return at_l < at_r || (at_l == at_r && l < r);
                     });
    node.child = made;
    nodes_[made] = {{}, node.begin, half, 0};
    nodes_[made + 1] = {{}, node.begin + half, node.count - half, 0};
    made += 2;
  }
}

}  // namespace haptic
