// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Room for the valid set of one pair while it is being found: planes in their classes. Not for
/// inclusion outside contact/.

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "rt_core/contact/basic_contact.hpp"
#include "rt_core/proxy/surface_cone.hpp"
#include "rt_core/proxy/valid_planes.hpp"

namespace haptic {

/// Planes that can carry a force come first, and of each kind those of faces before those of edge
/// pairs.
class ValidSet {
 public:
  ValidSet(const PairPose& pose, std::span<ValidPlane> planes) noexcept
      : pose_(pose), pair_(*pose.pair), planes_(planes) {}

  /// Takes the plane of a node in, once.
  void keep(const NodeFeatures& node, const Vec3& normal_w, Real gap_m) noexcept {
    ValidPlane valid;
    valid.id.type = node.type;
    valid.gap_m = gap_m;
    switch (node.type) {
      case ContactType::kA:
        valid.id.i = static_cast<std::uint16_t>(node.i);
        valid.support = {pair_.a.plane_vertex(node.i), node.j};
        break;
      case ContactType::kB:
        valid.id.j = static_cast<std::uint16_t>(node.j);
        valid.support = {node.i, pair_.b.plane_vertex(node.j)};
        break;
      case ContactType::kC: {
        valid.id.i = static_cast<std::uint16_t>(node.i);
        valid.id.j = static_cast<std::uint16_t>(node.j);
        const Vec3 v = ConstVec3Map(pair_.b.edge_directions[node.j].unit);
        valid.id.flipped = normal_w.dot(pose_.direction_a(node.i).cross(v)) < 0;
        valid.support = {pair_.a.edges[node.i].vertex[0], pair_.b.edges[node.j].vertex[0]};
        break;
      }
    }
    if (node.type != ContactType::kC) {  // several vertices on one face: one plane
      for (std::uint32_t k = 0; k < result.count; ++k) {
        if (planes_[k].id == valid.id) return;
      }
    }
    insert(valid, is_hidden(node, normal_w) ? kHiddenFaces : kFaces);
  }

  ValidResult result;

 private:
  /// The part goes on in another piece where the plane is: no contact of it carries a force.
  [[nodiscard]] bool is_hidden(const NodeFeatures& node, const Vec3& normal_w) const noexcept {
    const NodeMarks& marks = pair_.marks;
    if (!goes_on_behind(pair_, pose_.r_wa, node, normal_w)) return true;
    if (!marks.given()) return false;
    switch (node.type) {
      case ContactType::kA:
        return !pair_.a.is_facet() &&
               !marks.feature(NodeScope::kLive, marks.features.face_a(node.i));
      case ContactType::kB:
        return !pair_.b.is_facet() &&
               !marks.feature(NodeScope::kLive, marks.features.face_b(node.j));
      case ContactType::kC:
        break;
    }
    return !marks.node(NodeScope::kLive, node_number(pair_, node.type, node.i, node.j));
  }

  /// Puts a plane behind those of its class; the first of each class behind moves to its end.
  void insert(const ValidPlane& valid, std::uint32_t faces_class) noexcept {
    const std::uint32_t own = faces_class + (valid.id.type == ContactType::kC ? 1u : 0u);
    if (result.count == planes_.size()) {
      result.cut = true;
      if (own == kClasses - 1 || end_[own] == result.count) return replace_least(valid, own);
      result.count -= 1;  // the last makes room for one of a class before it
      for (std::uint32_t& end : end_) end = std::min(end, result.count);
    }
    for (std::uint32_t k = kClasses - 1; k > own; --k) {
      planes_[end_[k]] = planes_[end_[k - 1]];
      end_[k] += 1;
    }
    planes_[end_[own]++] = valid;
    result.count += 1;
    result.exposed = end_[kHiddenFaces - 1];
  }

  /// Of a class that has no more room the plane with the smallest gap leaves.
  void replace_least(const ValidPlane& valid, std::uint32_t own) noexcept {
    ValidPlane* const begin = planes_.data() + (own == 0 ? 0 : end_[own - 1]);
    ValidPlane* const end = planes_.data() + end_[own];
    if (begin == end) return;
    ValidPlane& least = *std::min_element(
        begin, end, [](const ValidPlane& l, const ValidPlane& r) { return l.gap_m < r.gap_m; });
    if (least.gap_m < valid.gap_m) least = valid;
  }

  /// Classes of planes in their order: each of faces, and behind it one of edge pairs.
  static constexpr std::uint32_t kFaces = 0, kHiddenFaces = 2, kClasses = 4;

  const PairPose& pose_;
  const PairView& pair_;
  std::span<ValidPlane> planes_;
  std::array<std::uint32_t, kClasses> end_{};  ///< of each class among the planes
};

}  // namespace haptic
