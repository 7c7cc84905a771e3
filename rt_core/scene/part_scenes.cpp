// SPDX-License-Identifier: Apache-2.0
#include "rt_core/scene/part_scenes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "rt_core/scene/placed_bodies.hpp"
#include "rt_core/scene/scene_check.hpp"

namespace haptic {
namespace {

template <typename T>
std::span<const T> section(const SceneView& scene, SectionId id) noexcept {
  for (const SectionEntry& s : scene.sections()) {
    if (s.id != id) continue;
    if (s.element_bytes != sizeof(T)) return {};
    return {reinterpret_cast<const T*>(scene.blob().data() + s.offset),
            static_cast<std::size_t>(s.count)};
  }
  return {};
}

PartPlace start_in(const PartRecord& part) noexcept {
  PartPlace place;
  std::copy_n(part.start_p_wa_m, 3, place.p_wa_m);
  std::copy_n(part.start_q_wa_xyzw, 4, place.q_wa_xyzw);
  return place;
}

bool is_place(const PartPlace& place) noexcept {
  double q2 = 0;
  for (const double x : place.q_wa_xyzw) q2 += x * x;
  bool near = std::abs(q2 - 1) <= 1e-6;
  for (const double x : place.p_wa_m) near = near && check::is_coordinate(x);
  return near;
}

Eigen::Quaterniond turn_of(const PartPlace& place) noexcept {
  const double* const q = place.q_wa_xyzw;
  return Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized();
}

/// From one place to another.
BodyMove move_between(const PartPlace& from, const PartPlace& to) noexcept {
  BodyMove move;
  if (from == to) return move;
  const Eigen::Quaterniond turn = (turn_of(to) * turn_of(from).conjugate()).normalized();
  const Eigen::Vector3d shift = Eigen::Vector3d(to.p_wa_m) - turn * Eigen::Vector3d(from.p_wa_m);
  for (int k = 0; k < 4; ++k) move.turn_xyzw[k] = turn.coeffs()[k];
  for (int k = 0; k < 3; ++k) move.shift_m[k] = shift[k];
  return move;
}

}  // namespace

std::string_view PartScenes::name(std::uint32_t part) const noexcept {
  const BodyRecord& body = scene_->bodies()[part];
  return scene_->text(body.name_offset, body.name_bytes);
}

PartPlace PartScenes::start_of(std::uint32_t part) const noexcept { return start_in(parts_[part]); }

std::span<const std::uint32_t> PartScenes::others_of(std::uint32_t part) const noexcept {
  return bodies_.subspan(parts_[part].body_begin, parts_[part].body_count);
}

std::span<const std::byte> PartScenes::scene_of(std::uint32_t part) const noexcept {
  return scenes_.subspan(static_cast<std::size_t>(parts_[part].scene_begin),
                         static_cast<std::size_t>(parts_[part].scene_bytes));
}

RtStatus PartScenes::open(const SceneView& scene, PartScenes& parts) noexcept {
  PartScenes p;
  p.scene_ = &scene;
  p.parts_ = section<PartRecord>(scene, SectionId::kParts);
  p.bodies_ = section<std::uint32_t>(scene, SectionId::kPartBodies);
  p.scenes_ = section<std::byte>(scene, SectionId::kPartScenes);
  if (p.parts_.empty() && p.bodies_.empty() && p.scenes_.empty()) {
    parts = p;
    return RtStatus::kOk;
  }
  if (p.parts_.size() != scene.bodies().size() || p.parts_.size() > kMostParts)
    return RtStatus::kBlobBadCount;
  for (std::uint32_t k = 0; k < p.count(); ++k) {
    const PartRecord& part = p.parts_[k];
    const bool is_hand = part.role == PartRole::kHand, is_held = part.scene_bytes > 0;
    const bool is_known =
        is_hand || part.role == PartRole::kPlaced || part.role == PartRole::kFixed;
    if (!is_known || is_hand != (k == 0) || is_held != (part.role != PartRole::kFixed) ||
        part.reserved != 0 || !is_place(start_in(part))) {
      return RtStatus::kBlobBadNumber;
    }
    if (!is_held) continue;
    if (!check::within(part.body_begin, part.body_count, p.bodies_.size()) ||
        part.scene_begin % kSceneAlignment != 0 || part.scene_begin > p.scenes_.size() ||
        part.scene_bytes > p.scenes_.size() - part.scene_begin) {
      return RtStatus::kBlobBadIndex;
    }
    for (const std::uint32_t other : p.others_of(k))
      if (other >= p.count() || other == k) return RtStatus::kBlobBadIndex;
    SceneView held;
    const RtStatus status = SceneView::open(p.scene_of(k), held);
    if (status != RtStatus::kOk) return status;
    if (held.bodies().size() != std::size_t{part.body_count} + 1) return RtStatus::kBlobBadCount;
    p.most_bytes_ = std::max(p.most_bytes_, p.scene_of(k).size());
    p.most_state_bytes_ =
        std::max(p.most_state_bytes_, static_cast<std::size_t>(held.header().capacity.state_bytes));
  }
  parts = p;
  return RtStatus::kOk;
}

RtStatus PartScenes::place(std::uint32_t part, std::span<const PartPlace> places,
                           std::span<std::byte> memory, SceneView& view) const noexcept {
  if (part >= count() || !may_be_held(part)) return RtStatus::kBlobBadIndex;
  if (places.size() != parts_.size()) return RtStatus::kBlobBadCount;
  for (const PartPlace& place : places)
    if (!is_place(place)) return RtStatus::kBlobBadNumber;
  SceneView held;
  RtStatus status = SceneView::open(scene_of(part), held);
  if (status != RtStatus::kOk) return status;
  PlacedBodies placed;
  status = placed.begin(held, places[part], memory);
  std::size_t body = 1;
  for (const std::uint32_t other : others_of(part)) {
    if (status == RtStatus::kOk)
      status = placed.move(body++, move_between(start_of(other), places[other]));
  }
  return status == RtStatus::kOk ? SceneView::open(placed.finish(), view) : status;
}

}  // namespace haptic
