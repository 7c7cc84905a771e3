// SPDX-License-Identifier: Apache-2.0
#include "rt_core/bodies/joint_scenes.hpp"

#include <algorithm>

namespace haptic {
namespace {

/// The member that a part is; of a part that is none, `kNoMember`.
constexpr std::uint8_t kNoMember = 0xff;

/// The law turns the part about the grip point of its scenes.
bool turns_about(const DrivenRecord& record, const SceneView& scene) noexcept {
  return std::equal(record.middle_m, record.middle_m + 3, scene.bodies()[0].reference_m);
}

/// The moving bodies of both scenes are one.
bool is_same_part(const SceneView& one, const SceneView& other) noexcept {
  const BodyRecord &a = one.bodies()[0], &b = other.bodies()[0];
  return a.piece_count == b.piece_count &&
         std::equal(a.reference_m, a.reference_m + 3, b.reference_m);
}

bool is_held(const PartsInHands& held, std::uint32_t part) noexcept {
  const auto end = held.part.begin() + held.count;
  return std::find(held.part.begin(), end, part) != end;
}

}  // namespace

std::uint32_t JointScenes::part_of(std::uint32_t member) const noexcept {
  return member < held_.count ? held_.part[member] : parts_->driven()[mover_[member]].part;
}

bool JointScenes::is_loose(std::uint32_t member) const noexcept {
  return member >= held_.count && parts_->driven()[mover_[member]].lead != Lead::kOwner;
}

/// A mover has a place in the law: it is loose, or may meet a part in a hand or a loose one.
bool JointScenes::meets(const PartScenes& parts, const PartsInHands& held,
                        std::uint32_t part) noexcept {
  if (parts[part].role == PartRole::kLoose) return true;
  return std::any_of(parts.pairs().begin(), parts.pairs().end(), [&](const BodyPairRecord& pair) {
    return pair.b == part && (is_held(held, pair.a) || parts[pair.a].role == PartRole::kLoose);
  });
}

JointScenes::Counts JointScenes::count(const PartScenes& parts, const PartsInHands& held) noexcept {
  Counts counts;
  const std::size_t most = held.count + parts.driven().size();
  counts.kinds = most * (most + 1);
  const auto moves = [&](std::uint32_t part) {
    const PartRole role = parts[part].role;
    return is_held(held, part) || role == PartRole::kLoose || role == PartRole::kDriven;
  };
  const auto is_asked = [&](const BodyPairRecord& pair) { return moves(pair.a) && moves(pair.b); };
  const auto is_new = [&](std::uint64_t begin, std::size_t pairs, std::uint32_t loose) {
    for (std::size_t k = 0; k < pairs; ++k)
      if (parts.pairs()[k].scene_begin == begin && is_asked(parts.pairs()[k])) return false;
    for (std::uint32_t k = 0; k < loose; ++k)
      if (parts[k].role == PartRole::kLoose && parts[k].scene_begin == begin) return false;
    return true;
  };
  for (std::size_t k = 0; k < parts.pairs().size(); ++k) {
    const BodyPairRecord& pair = parts.pairs()[k];
    counts.views += is_asked(pair) && is_new(pair.scene_begin, k, 0) ? 1u : 0u;
  }
  for (std::uint32_t k = 0; k < parts.count(); ++k) {
    const bool is_loose = parts[k].role == PartRole::kLoose;
    if (is_loose && is_new(parts[k].scene_begin, parts.pairs().size(), k)) counts.views += 1;
  }
  counts.views = std::min(counts.views, kMostKinds);
  return counts;
}

/// Where they take turns those that do come last.
void JointScenes::find_members(const PartScenes& parts) noexcept {
  const std::span<const DrivenRecord> movers = parts.driven();
  const auto add_those = [&](const auto& is_one) {
    for (std::size_t k = 0; k < movers.size(); ++k) {
      if (is_one(movers[k]) && meets(parts, held_, movers[k].part) && count_ < kMostMembers)
        mover_[count_++] = static_cast<std::uint8_t>(k);
    }
  };
  count_ = held_.count;
  add_those([](const DrivenRecord&) { return true; });
  if (!takes_turns()) return;
  count_ = held_.count;
  add_those([](const DrivenRecord& mover) { return mover.lead == Lead::kOwner; });
  add_those([](const DrivenRecord& mover) { return mover.lead != Lead::kOwner; });
}

RtStatus JointScenes::open_kind(std::span<const std::byte> bytes, std::span<SceneView> views,
                                std::uint8_t& kind) noexcept {
  for (std::uint32_t k = 0; k < kind_count_; ++k) {
    if (views_[k]->blob().data() != bytes.data()) continue;
    kind = static_cast<std::uint8_t>(k);
    return RtStatus::kOk;
  }
  if (kind_count_ == kMostKinds || opened_ == views.size()) return RtStatus::kBlobBadCount;
  SceneView& view = views[opened_++];
  kind = static_cast<std::uint8_t>(kind_count_);
  views_[kind_count_++] = &view;
  return SceneView::open(bytes, view);
}

RtStatus JointScenes::open(const PartScenes& parts, const PartsInHands& held,
                           std::span<SceneView> views, std::span<std::uint8_t> kinds) noexcept {
  parts_ = &parts;
  held_ = held;
  kind_count_ = opened_ = 0;
  find_members(parts);
  kinds_ = kinds.first(std::size_t{count_} * (count_ + 1));
  std::fill(kinds_.begin(), kinds_.end(), kNone);
  const auto at = [&](std::uint32_t a, std::uint32_t b) -> std::uint8_t& {
    return kinds_[std::size_t{a} * (count_ + 1) + b];
  };
  std::array<std::uint8_t, kMostParts> member_of;
  member_of.fill(kNoMember);
  for (std::uint32_t m = 0; m < count_; ++m) member_of[part_of(m)] = static_cast<std::uint8_t>(m);
  for (std::uint32_t hand = 0; hand < held_.count; ++hand) {
    if (!parts.meets_standing(held_.part[hand])) continue;
    at(hand, count_) = static_cast<std::uint8_t>(kind_count_);
    views_[kind_count_++] = held_.scene[hand];
  }
  for (std::uint32_t m = held_.count; m < count_; ++m) {
    const std::uint32_t part = part_of(m);
    if (!is_loose(m) || !parts.meets_standing(part)) continue;
    const RtStatus status = open_kind(parts.scene_of(part), views, at(m, count_));
    if (status != RtStatus::kOk) return status;
    if (!turns_about(parts.driven()[mover_[m]], scene(at(m, count_))))
      return RtStatus::kBlobBadNumber;
  }
  for (const BodyPairRecord& pair : parts.pairs()) {
    const std::uint8_t a = member_of[pair.a], b = member_of[pair.b];
    if (a == kNoMember || b == kNoMember) continue;
    const RtStatus status = open_kind(parts.scene_of(pair), views, at(a, b));
    if (status != RtStatus::kOk) return status;
    const SceneView& opened = scene(at(a, b));
    const bool agrees = a < held_.count ? is_same_part(opened, *held_.scene[a])
                                        : turns_about(parts.driven()[mover_[a]], opened);
    if (!agrees) return RtStatus::kBlobBadNumber;
  }
  return RtStatus::kOk;
}

/// One of the two takes turns.
bool JointScenes::is_shared(std::uint32_t a, std::uint32_t b) const noexcept {
  return takes_turns() && (is_loose(a) || (b != kStanding && is_loose(b)));
}

std::uint32_t JointScenes::shared_slots(std::uint8_t kind) const noexcept {
  std::uint32_t pairs = 0, always = 0, most = kSlotsOfKind;
  for (std::uint32_t a = 0; a < count_; ++a) {
    for (std::uint32_t b = 0; b <= count_; ++b) {
      const std::uint32_t other = b == count_ ? kStanding : b;
      if (this->kind(a, other) != kind || !is_shared(a, other)) continue;
      const bool has_loose_only = is_loose(a) && (other == kStanding || is_loose(other));
      (has_loose_only ? pairs : always) += 1;
      if (other == kStanding) most = kMostMovingBodies;  // one for each that moves
    }
  }
  return always + std::min(pairs, most);
}

// First each hand's part with all that stands there, then with each other, then with the movers,
// and these with what they may meet.
std::uint32_t JointScenes::list(std::span<BodyPairScene> slots) const noexcept {
  std::uint32_t count = 0;
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint8_t kind, bool is_open) {
    if (count < slots.size()) slots[count] = {a, b, views_[kind], is_open};
    count += 1;
  };
  const auto add_own = [&](std::uint32_t a, std::uint32_t b) {
    const std::uint8_t kind = this->kind(a, b);
    if (kind != kNone && !is_shared(a, b)) add(a, b, kind, true);
  };
  for (std::uint32_t hand = 0; hand < held_.count; ++hand) add_own(hand, kStanding);
  for (std::uint32_t a = 0; a < held_.count; ++a)
    for (std::uint32_t b = 0; b < held_.count; ++b) add_own(a, b);
  for (std::uint32_t m = held_.count; m < count_; ++m)
    for (std::uint32_t hand = 0; hand < held_.count; ++hand) add_own(hand, m);
  for (std::uint32_t m = held_.count; m < count_; ++m) {
    add_own(m, kStanding);
    for (std::uint32_t other = 0; other < count_; ++other) add_own(m, other);
  }
  if (!takes_turns()) return count;
  for (std::uint32_t k = 0; k < kind_count_; ++k) {
    const auto kind = static_cast<std::uint8_t>(k);
    for (std::uint32_t n = shared_slots(kind); n > 0; --n) add(0, kStanding, kind, false);
  }
  return count;
}

}  // namespace haptic
