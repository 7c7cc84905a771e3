// SPDX-License-Identifier: Apache-2.0
#include "rt_core/scene/part_scenes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

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

std::span<const std::byte> PartScenes::pair_scene(std::uint32_t a, std::uint32_t b) const noexcept {
  for (const BodyPairRecord& pair : pairs_) {
    if (pair.a == a && pair.b == b) return scene_of(pair);
  }
  return {};
}

std::span<const std::byte> PartScenes::scene_of(const BodyPairRecord& pair) const noexcept {
  return scenes_.subspan(static_cast<std::size_t>(pair.scene_begin),
                         static_cast<std::size_t>(pair.scene_bytes));
}

/// It is driven, loose, or one of those that two hands hold.
bool PartScenes::moves_beside(std::uint32_t part) const noexcept {
  const PartRole role = parts_[part].role;
  return role == PartRole::kDriven || role == PartRole::kLoose || (hands() > 1 && part < hands());
}

bool PartScenes::has_loose() const noexcept {
  return std::any_of(parts_.begin(), parts_.end(),
                     [](const PartRecord& part) { return part.role == PartRole::kLoose; });
}

bool PartScenes::meets_standing(std::uint32_t part) const noexcept {
  const std::span<const std::uint32_t> others = others_of(part);
  const bool is_loose = parts_[part].role == PartRole::kLoose;
  return std::none_of(others.begin(), others.end(), [&](std::uint32_t other) {
    return moves_beside(other) || (is_loose && other < hands());
  });
}

bool PartScenes::holds_bytes(std::uint64_t begin, std::uint64_t bytes) const noexcept {
  return begin % kSceneAlignment == 0 && begin <= scenes_.size() && bytes <= scenes_.size() - begin;
}

/// Checks what the scene says of driven parts, after the records of all parts.
RtStatus PartScenes::check_driven() const noexcept {
  const auto owned = std::count_if(driven_.begin(), driven_.end(), [](const DrivenRecord& driven) {
    return driven.lead == Lead::kOwner;
  });
  const bool some_loose = driven_.size() > static_cast<std::size_t>(owned);
  const auto moving =
      static_cast<std::size_t>(owned) + std::max(hands(), 1u) + (some_loose ? 1 : 0);
  const std::size_t movers = driven_.size() + std::max(hands(), 1u);
  if (movers > kMostDriven + 1 || moving > kMostMoving) return RtStatus::kBlobBadCount;
  const auto is_positive = [](double x) { return x > 0 && x < HUGE_VAL; };
  std::uint32_t next = 0;
  for (const DrivenRecord& driven : driven_) {
    const bool is_owned = driven.lead == Lead::kOwner;
    const bool is_known = is_owned || driven.lead == Lead::kAnchor || driven.lead == Lead::kWeight;
    if (driven.part < next || driven.part >= count() || !is_known ||
        parts_[driven.part].role != (is_owned ? PartRole::kDriven : PartRole::kLoose)) {
      return RtStatus::kBlobBadIndex;
    }
    next = driven.part + 1;
    bool is_right = driven.late_s <= kLatestDriven_s && (driven.ratio > 1 || !is_owned);
    for (const double x : {driven.fastest_m_per_s, driven.fastest_rad_per_s, driven.late_s,
                           driven.push_n, driven.ratio, driven.radius_m})
      is_right = is_right && is_positive(x);
    for (const double x : driven.middle_m) is_right = is_right && check::is_coordinate(x);
    if (!is_right) return RtStatus::kBlobBadNumber;
  }
  const auto is_driven = [](const PartRecord& part) {
    return part.role == PartRole::kDriven || part.role == PartRole::kLoose;
  };
  if (std::cmp_not_equal(std::count_if(parts_.begin(), parts_.end(), is_driven), driven_.size()))
    return RtStatus::kBlobBadCount;
  return RtStatus::kOk;
}

/// Checks what it says of parts that meet while both move.
RtStatus PartScenes::check_pairs() const noexcept {
  for (const BodyPairRecord& pair : pairs_) {
    if (pair.a >= count() || pair.b >= count() || pair.a == pair.b ||
        parts_[pair.a].scene_bytes == 0 || !(moves_beside(pair.b) || pair.b < hands()) ||
        pair.scene_bytes == 0 || !holds_bytes(pair.scene_begin, pair.scene_bytes)) {
      return RtStatus::kBlobBadIndex;
    }
    // One that is shared has been opened for the first that has it.
    const auto is_shared = [&](const BodyPairRecord& other) {
      return other.scene_begin == pair.scene_begin && other.scene_bytes == pair.scene_bytes;
    };
    if (&*std::find_if(pairs_.begin(), pairs_.end(), is_shared) != &pair) continue;
    SceneView opened;
    const RtStatus status = SceneView::open(scene_of(pair), opened);
    if (status != RtStatus::kOk) return status;
    if (opened.bodies().size() != 2) return RtStatus::kBlobBadCount;
  }
  return RtStatus::kOk;
}

/// Its role is one that part `k` of this scene may have.
bool PartScenes::has_known_role(std::uint32_t k) const noexcept {
  const bool is_held = parts_[k].scene_bytes > 0;
  switch (parts_[k].role) {
    case PartRole::kHand:
      return k == 0 && is_held;
    case PartRole::kHand2:
      return k == 1 && is_held;
    case PartRole::kPlaced:
      return k > 0 && hands() == 1 && is_held && !has_loose();
    case PartRole::kLoose:
      return k >= hands() && is_held;
    case PartRole::kFixed:
    case PartRole::kDriven:
      return k > 0 && !is_held;
  }
  return false;
}

RtStatus PartScenes::open(const SceneView& scene, PartScenes& parts) noexcept {
  PartScenes p;
  p.scene_ = &scene;
  p.parts_ = section<PartRecord>(scene, SectionId::kParts);
  p.bodies_ = section<std::uint32_t>(scene, SectionId::kPartBodies);
  p.scenes_ = section<std::byte>(scene, SectionId::kPartScenes);
  p.driven_ = section<DrivenRecord>(scene, SectionId::kDriven);
  p.pairs_ = section<BodyPairRecord>(scene, SectionId::kBodyPairs);
  if (p.parts_.empty() && p.bodies_.empty() && p.scenes_.empty()) {
    parts = p;
    return RtStatus::kOk;
  }
  if (p.parts_.size() != scene.bodies().size() || p.parts_.size() > kMostParts)
    return RtStatus::kBlobBadCount;
  for (std::uint32_t k = 0; k < p.count(); ++k) {
    const PartRecord& part = p.parts_[k];
    const bool is_held = part.scene_bytes > 0, has_law = part.law_bytes > 0;
    if (!p.has_known_role(k) || !is_place(start_in(part))) return RtStatus::kBlobBadNumber;
    const bool moves_alone = p.driven_.empty() && p.hands() == 1;
    const bool leads_law = part.role != PartRole::kHand2 && part.role != PartRole::kLoose;
    if (has_law != (is_held && !moves_alone && leads_law)) return RtStatus::kBlobBadNumber;
    if (!is_held) continue;
    if (!check::within(part.body_begin, part.body_count, p.bodies_.size()) ||
        !p.holds_bytes(part.scene_begin, part.scene_bytes)) {
      return RtStatus::kBlobBadIndex;
    }
    for (const std::uint32_t other : p.others_of(k))
      if (other >= p.count() || other == k) return RtStatus::kBlobBadIndex;
    SceneView held;
    const RtStatus status = SceneView::open(p.scene_of(k), held);
    if (status != RtStatus::kOk) return status;
    if (held.bodies().size() != std::size_t{part.body_count} + 1) return RtStatus::kBlobBadCount;
    if (part.role == PartRole::kLoose) continue;
    p.most_bytes_ = std::max(p.most_bytes_, p.scene_of(k).size());
    p.most_state_bytes_ =
        std::max(p.most_state_bytes_, static_cast<std::size_t>(held.header().capacity.state_bytes));
    p.most_law_bytes_ = std::max(p.most_law_bytes_, std::size_t{part.law_bytes});
  }
  RtStatus status = p.check_driven();
  if (status == RtStatus::kOk) status = p.check_pairs();
  if (status == RtStatus::kOk) parts = p;
  return status;
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
