// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/part_tables.hpp"

#include <algorithm>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "rt_core/bodies/driven_motion.hpp"
#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/graph/scene_tables.hpp"

namespace haptic::tools {
namespace {

bool is_of_parts(SectionId id) {
  return id == SectionId::kParts || id == SectionId::kPartBodies || id == SectionId::kPartScenes ||
         id == SectionId::kDriven || id == SectionId::kDrivenPairs;
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

/// State of the law of `parts[number]`, which may be held, among driven parts.
std::uint32_t law_bytes_of(const std::vector<HeldPart>& parts, std::size_t number) {
  const HeldPart& part = parts[number];
  const OpenedScene held(part.scene);
  DrivenScenes scenes;
  scenes.held = &held.view;
  scenes.meets_standing = std::ranges::none_of(
      part.others, [&](std::uint32_t other) { return parts.at(other).role == PartRole::kDriven; });
  std::vector<std::unique_ptr<const OpenedScene>> with;
  for (const PairScene& pair : part.pairs) {
    with.push_back(std::make_unique<const OpenedScene>(pair.bytes));
    scenes.with.at(pair.driven) = &with.back()->view;
  }
  return static_cast<std::uint32_t>(DrivenMotion::state_bytes(scenes));
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
  std::vector<std::uint32_t> bodies;
  SceneRow scenes;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const HeldPart& part = parts[k];
    PartRecord record{};
    record.role = part.role;
    if (!driven.empty() && !part.scene.empty()) record.law_bytes = law_bytes_of(parts, k);
    std::copy_n(part.start.p_wa_m, 3, record.start_p_wa_m);
    std::copy_n(part.start.q_wa_xyzw, 4, record.start_q_wa_xyzw);
    record.scene_begin = scenes.add(part.scene);
    record.scene_bytes = part.scene.size();
    record.body_begin = static_cast<std::uint32_t>(bodies.size());
    record.body_count = static_cast<std::uint32_t>(part.others.size());
    bodies.insert(bodies.end(), part.others.begin(), part.others.end());
    records.push_back(record);
  }
  std::vector<DrivenPair> pairs;
  for (std::uint32_t k = 0; k < parts.size(); ++k)
    for (const PairScene& pair : parts[k].pairs)
      pairs.push_back({k, pair.driven, scenes.add(pair.bytes), pair.bytes.size()});
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
  if (!driven.empty()) {
    blob.add(SectionId::kDriven, driven);
    blob.add(SectionId::kDrivenPairs, pairs);
  }
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
    if (scenes.may_be_held(k)) {
      part.scene = bytes_changed(scenes.scene_of(k));
      part.others.assign(scenes.others_of(k).begin(), scenes.others_of(k).end());
    }
    for (std::uint32_t j = 0; j < scenes.driven().size(); ++j) {
      const std::span<const std::byte> pair = scenes.pair_scene(k, j);
      if (!pair.empty()) part.pairs.push_back({j, bytes_changed(pair)});
    }
    parts.push_back(std::move(part));
  }
  return SceneBytes{with_parts({around.span().begin(), around.span().end()}, parts,
                               {scenes.driven().begin(), scenes.driven().end()})};
}

}  // namespace haptic::tools
