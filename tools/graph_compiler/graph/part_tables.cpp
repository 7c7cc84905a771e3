// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/part_tables.hpp"

#include <algorithm>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "rt_core/bodies/joint_motion.hpp"
#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/graph/scene_tables.hpp"

namespace haptic::tools {
namespace {

bool is_of_parts(SectionId id) {
  return id == SectionId::kParts || id == SectionId::kPartBodies || id == SectionId::kPartScenes ||
         id == SectionId::kDriven || id == SectionId::kBodyPairs;
}

/// A scene of a part, in memory of its own.
struct OpenedScene {
  explicit OpenedScene(std::span<const std::byte> source) : bytes(source) {
    if (SceneView::open(bytes.span(), view) != RtStatus::kOk)
      throw std::logic_error("the scene just written does not open");
  }
  SceneBytes bytes;
  SceneView view;
};

/// Parts of which the law is asked for, and the scenes that it is made of.
class LawScenes {
 public:
  LawScenes(const std::vector<HeldPart>& parts, const std::vector<DrivenRecord>& driven)
      : parts_(parts), driven_(driven) {}

  /// State of the law of `part`, which may be held, among driven parts, and with that of a second
  /// hand where there is one.
  std::uint32_t bytes_of(std::size_t part, std::uint32_t hands) {
    JointScenes scenes;
    scenes.hands = hands;
    hands_ = hands;
    for (std::uint32_t hand = 0; hand < hands; ++hand) add(part + hand, scenes.of[hand]);
    for (std::size_t k = 0; k < driven_.size(); ++k)
      if (driven_[k].lead != Lead::kOwner) add(part, driven_[k].part, scenes.movers.at(k));
    for (std::uint32_t a = 0; hands > 1 && a < hands; ++a) {
      const std::vector<std::byte>* const between = pair_of(a, 1 - a);
      if (between == nullptr) continue;
      scenes.between = &open(*between);
      scenes.between_a = a;
    }
    return static_cast<std::uint32_t>(JointMotion::state_bytes(scenes));
  }

 private:
  [[nodiscard]] bool moves(std::uint32_t part) const {
    const PartRole role = parts_.at(part).role;
    return role == PartRole::kDriven || role == PartRole::kLoose || (hands_ > 1 && part < hands_);
  }
  const SceneView& open(std::span<const std::byte> bytes) {
    opened_.push_back(std::make_unique<const OpenedScene>(bytes));
    return opened_.back()->view;
  }
  [[nodiscard]] const std::vector<std::byte>* pair_of(std::size_t a, std::uint32_t b) const {
    const std::vector<PairScene>& pairs = parts_[a].pairs;
    const auto found = std::ranges::find(pairs, b, &PairScene::b);
    return found == pairs.end() ? nullptr : &found->bytes;
  }
  void add(std::size_t part, JointScenes::OfHand& of) {
    of.held = &open(parts_[part].scene);
    of.meets_standing = std::ranges::none_of(parts_[part].others,
                                             [&](std::uint32_t other) { return moves(other); });
    for (std::size_t k = 0; k < driven_.size(); ++k) {
      const std::vector<std::byte>* const pair = pair_of(part, driven_[k].part);
      if (pair != nullptr) of.with.at(k) = &open(*pair);
    }
  }

  /// A loose part; `first`: that of the first hand.
  void add(std::size_t first, std::uint32_t part, JointScenes::OfMover& of) {
    const bool meets_standing = std::ranges::none_of(
        parts_[part].others, [&](std::uint32_t other) { return moves(other) || other < hands_; });
    if (meets_standing) of.standing = &open(parts_[part].scene);
    for (std::uint32_t hand = 0; hand < hands_; ++hand) {
      const auto* const pair = pair_of(part, static_cast<std::uint32_t>(first) + hand);
      if (pair != nullptr) of.with_hand[hand] = &open(*pair);
    }
    for (std::size_t k = 0; k < driven_.size(); ++k) {
      const auto* const pair = pair_of(part, driven_[k].part);
      if (pair != nullptr) of.with.at(k) = &open(*pair);
    }
  }

  std::uint32_t hands_ = 1;
  const std::vector<HeldPart>& parts_;
  const std::vector<DrivenRecord>& driven_;
  std::vector<std::unique_ptr<const OpenedScene>> opened_;
};

std::uint32_t hands_of(const std::vector<HeldPart>& parts) {
  return parts.size() > 1 && parts[1].role == PartRole::kHand2 ? 2 : 1;
}

/// Scenes one behind the other, each aligned.
class SceneRow {
 public:
  /// Returns where it begins.
  std::uint64_t add(const std::vector<std::byte>& scene) {
    bytes_.resize((bytes_.size() + kSceneAlignment - 1) / kSceneAlignment * kSceneAlignment);
    const std::uint64_t begin = bytes_.size();
    bytes_.insert(bytes_.end(), scene.begin(), scene.end());
    return begin;
  }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

}  // namespace

std::vector<std::byte> with_parts(const std::vector<std::byte>& scene,
                                  const std::vector<HeldPart>& parts,
                                  const std::vector<DrivenRecord>& driven) {
  const OpenedScene around(scene);
  std::vector<PartRecord> records;
  const std::uint32_t hands = hands_of(parts);
  LawScenes laws(parts, driven);
  std::vector<std::uint32_t> bodies;
  SceneRow scenes;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const HeldPart& part = parts[k];
    PartRecord record{};
    record.role = part.role;
    const bool moves_alone = driven.empty() && hands == 1;
    const bool leads_law = part.role != PartRole::kHand2 && part.role != PartRole::kLoose;
    if (!moves_alone && !part.scene.empty() && leads_law)
      record.law_bytes = laws.bytes_of(k, hands);
    std::copy_n(part.start.p_wa_m, 3, record.start_p_wa_m);
    std::copy_n(part.start.q_wa_xyzw, 4, record.start_q_wa_xyzw);
    record.scene_begin = scenes.add(part.scene);
    record.scene_bytes = part.scene.size();
    record.body_begin = static_cast<std::uint32_t>(bodies.size());
    record.body_count = static_cast<std::uint32_t>(part.others.size());
    bodies.insert(bodies.end(), part.others.begin(), part.others.end());
    records.push_back(record);
  }
  std::vector<BodyPairRecord> pairs;
  for (std::uint32_t k = 0; k < parts.size(); ++k)
    for (const PairScene& pair : parts[k].pairs)
      pairs.push_back({k, pair.b, scenes.add(pair.bytes), pair.bytes.size()});
  BlobBuilder blob;
  for (const SectionEntry& s : around.view.sections()) {
    if (is_of_parts(s.id)) continue;
    const auto bytes = around.view.blob().subspan(
        static_cast<std::size_t>(s.offset), static_cast<std::size_t>(s.count * s.element_bytes));
    blob.add_bytes(s.id, s.element_bytes, s.count, bytes);
  }
  blob.add(SectionId::kParts, records);
  blob.add(SectionId::kPartBodies, bodies);
  blob.add(SectionId::kPartScenes, scenes.bytes());
  if (!driven.empty()) blob.add(SectionId::kDriven, driven);
  if (!driven.empty() || hands > 1) blob.add(SectionId::kBodyPairs, pairs);
  std::vector<std::byte> whole = blob.finish(around.view.header().capacity);
  const SceneBytes written{whole};
  SceneView opened;
  PartScenes read;
  RtStatus status = SceneView::open(written.span(), opened);
  if (status == RtStatus::kOk) status = PartScenes::open(opened, read);
  if (status != RtStatus::kOk)
    throw InputError(std::string("the parts of the scene are refused: ") + to_text(status));
  return whole;
}

SceneBytes with_changed(const SceneView& scene,
                        const std::function<SceneBytes(const SceneView&)>& changed) {
  PartScenes scenes;
  if (const RtStatus status = PartScenes::open(scene, scenes); status != RtStatus::kOk)
    throw InputError(std::string("the parts of the scene are refused: ") + to_text(status));
  SceneBytes around = changed(scene);
  if (scenes.count() == 0) return around;
  const auto bytes_changed = [&](std::span<const std::byte> of) {
    SceneView held;
    if (SceneView::open(of, held) != RtStatus::kOk)
      throw std::logic_error("a part's scene has opened before");
    const SceneBytes inside = changed(held);
    return std::vector<std::byte>(inside.span().begin(), inside.span().end());
  };
  std::vector<HeldPart> parts;
  for (std::uint32_t k = 0; k < scenes.count(); ++k) {
    HeldPart part{scenes[k].role, scenes.start_of(k), {}, {}, {}};
    if (!scenes.scene_of(k).empty()) {
      part.scene = bytes_changed(scenes.scene_of(k));
      part.others.assign(scenes.others_of(k).begin(), scenes.others_of(k).end());
    }
    for (std::uint32_t b = 0; b < scenes.count(); ++b) {
      const std::span<const std::byte> pair = scenes.pair_scene(k, b);
      if (!pair.empty()) part.pairs.push_back({b, bytes_changed(pair)});
    }
    parts.push_back(std::move(part));
  }
  return SceneBytes{with_parts({around.span().begin(), around.span().end()}, parts,
                               {scenes.driven().begin(), scenes.driven().end()})};
}

}  // namespace haptic::tools
