// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/part_tables.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "rt_core/bodies/joint_motion.hpp"
#include "rt_core/haptic_core.hpp"
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

/// In place of what a law takes.
constexpr std::uint32_t kToBeCounted = 1;

/// The parts of a scene, in memory of its own.
struct OpenedParts {
  explicit OpenedParts(std::span<const std::byte> source) : scene(source) {
    if (const RtStatus status = PartScenes::open(scene.view, parts); status != RtStatus::kOk)
      throw InputError(std::string("the parts of the scene are refused: ") + to_text(status));
  }
  OpenedScene scene;
  PartScenes parts;
};

/// State of the law of `part`, which may be held, among others that move, and with that of a second
/// hand where there is one.
std::uint32_t law_bytes(const PartScenes& parts, std::uint32_t part) {
  PartsInHands held;
  held.count = parts.hands();
  std::array<std::unique_ptr<const OpenedScene>, kMostHands> opened;
  for (std::uint32_t hand = 0; hand < held.count; ++hand) {
    held.part.at(hand) = part + hand;
    opened.at(hand) = std::make_unique<const OpenedScene>(parts.scene_of(part + hand));
    held.scene.at(hand) = &opened.at(hand)->view;
  }
  const JointScenes::Counts counts = JointScenes::count(parts, held);
  std::vector<SceneView> views(counts.views);
  std::vector<std::uint8_t> kinds(counts.kinds);
  const auto scenes = std::make_unique<JointScenes>();
  const RtStatus status = scenes->open(parts, held, views, kinds);
  if (status == RtStatus::kBlobBadCount)
    throw InputError(
        "the parts of the scene make more than " + std::to_string(JointScenes::kMostKinds) +
        " different pairs of shapes that may meet while they move; give equal parts one mesh, name "
        "pairs that never meet under [bodies] never, or make some parts fixed");
  if (status != RtStatus::kOk)
    throw InputError(std::string("the parts of the scene are refused: ") + to_text(status));
  std::vector<BodyPairScene> slots(scenes->list({}));
  static_cast<void>(scenes->list(slots));
  const std::size_t bytes = JointMotion::state_bytes(parts, *scenes, slots);
  if (bytes > std::numeric_limits<std::uint32_t>::max())
    throw InputError("the law of the parts that move takes more than 4 GB; make some parts fixed");
  return static_cast<std::uint32_t>(bytes);
}

std::uint32_t hands_of(const std::vector<HeldPart>& parts) {
  return parts.size() > 1 && parts[1].role == PartRole::kHand2 ? 2 : 1;
}

/// Scenes one behind the other, each aligned; equal ones once.
class SceneRow {
 public:
  /// Returns where it begins.
  std::uint64_t add(const std::vector<std::byte>& scene) {
    const auto [known, is_new] = begins_.try_emplace(hash_of(scene), 0);
    const auto is_it = [&](std::uint64_t begin) {
      return !scene.empty() && begin + scene.size() <= bytes_.size() &&
             std::equal(scene.begin(), scene.end(),
                        bytes_.begin() + static_cast<std::ptrdiff_t>(begin));
    };
    if (!is_new && is_it(known->second)) return known->second;
    bytes_.resize((bytes_.size() + kSceneAlignment - 1) / kSceneAlignment * kSceneAlignment);
    const std::uint64_t begin = bytes_.size();
    bytes_.insert(bytes_.end(), scene.begin(), scene.end());
    known->second = begin;
    return begin;
  }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  static std::size_t hash_of(const std::vector<std::byte>& scene) {
    return std::hash<std::string_view>{}(
        {reinterpret_cast<const char*>(scene.data()), scene.size()});
  }

  std::vector<std::byte> bytes_;
  std::unordered_map<std::size_t, std::uint64_t> begins_;
};

/// The sections of a scene, but those that `left_out` names.
BlobBuilder sections_without(const SceneView& scene,
                             const std::function<bool(SectionId)>& left_out) {
  BlobBuilder blob;
  for (const SectionEntry& s : scene.sections()) {
    if (left_out(s.id)) continue;
    blob.add_bytes(s.id, s.element_bytes, s.count,
                   scene.blob().subspan(static_cast<std::size_t>(s.offset),
                                        static_cast<std::size_t>(s.count * s.element_bytes)));
  }
  return blob;
}

SceneBytes with_guide(const SceneView& scene, const GuideTables& guide) {
  BlobBuilder blob = sections_without(scene, [](SectionId id) {
    return id == SectionId::kGuide || id == SectionId::kGuideStations;
  });
  blob.add(SectionId::kGuide, std::vector<GuideRecord>{guide.record});
  blob.add(SectionId::kGuideStations, guide.stations);
  SceneCapacity capacity = scene.header().capacity;
  // The state's size depends on the opened scene.
  const OpenedScene opened(blob.finish(capacity));
  capacity.state_bytes = HapticCore::state_bytes(opened.view);
  return SceneBytes{blob.finish(capacity)};
}

PartScenes opened_parts(const SceneView& scene) {
  PartScenes scenes;
  if (const RtStatus status = PartScenes::open(scene, scenes); status != RtStatus::kOk)
    throw InputError(std::string("the parts of the scene are refused: ") + to_text(status));
  return scenes;
}

/// @param changed  is given a scene and the part that is held in it; kMostParts in that of a loose
/// part, or of two parts that both move. Scenes that parts share it is given once.
SceneBytes with_each_changed(
    const SceneView& scene,
    const std::function<SceneBytes(const SceneView&, std::uint32_t part)>& changed) {
  const PartScenes scenes = opened_parts(scene);
  SceneBytes around = changed(scene, 0);
  if (scenes.count() == 0) return around;
  using Place = std::pair<const std::byte*, std::uint32_t>;
  std::map<Place, std::vector<std::byte>> known;
  const auto bytes_changed = [&](std::span<const std::byte> of, std::uint32_t part) {
    const auto [found, is_new] = known.try_emplace(Place(of.data(), part));
    if (!is_new) return found->second;
    SceneView held;
    if (SceneView::open(of, held) != RtStatus::kOk)
      throw std::logic_error("a part's scene has opened before");
    const SceneBytes inside = changed(held, part);
    found->second.assign(inside.span().begin(), inside.span().end());
    return found->second;
  };
  std::vector<HeldPart> parts;
  for (std::uint32_t k = 0; k < scenes.count(); ++k) {
    HeldPart part{scenes[k].role, scenes.start_of(k), {}, {}, {}};
    if (!scenes.scene_of(k).empty()) {
      part.scene =
          bytes_changed(scenes.scene_of(k), part.role == PartRole::kLoose ? kMostParts : k);
      part.others.assign(scenes.others_of(k).begin(), scenes.others_of(k).end());
    }
    for (std::uint32_t b = 0; b < scenes.count(); ++b) {
      const std::span<const std::byte> pair = scenes.pair_scene(k, b);
      if (!pair.empty()) part.pairs.push_back({b, bytes_changed(pair, kMostParts)});
    }
    parts.push_back(std::move(part));
  }
  return SceneBytes{with_parts({around.span().begin(), around.span().end()}, parts,
                               {scenes.driven().begin(), scenes.driven().end()})};
}

}  // namespace

std::vector<std::byte> with_parts(const std::vector<std::byte>& scene,
                                  const std::vector<HeldPart>& parts,
                                  const std::vector<DrivenRecord>& driven) {
  const OpenedScene around(scene);
  std::vector<PartRecord> records;
  const std::uint32_t hands = hands_of(parts);
  std::vector<std::uint32_t> bodies;
  SceneRow scenes;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const HeldPart& part = parts[k];
    PartRecord record{};
    record.role = part.role;
    const bool moves_alone = driven.empty() && hands == 1;
    const bool leads_law = part.role != PartRole::kHand2 && part.role != PartRole::kLoose;
    if (!moves_alone && !part.scene.empty() && leads_law) record.law_bytes = kToBeCounted;
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
  const auto written = [&] {
    BlobBuilder blob = sections_without(around.view, is_of_parts);
    blob.add(SectionId::kParts, records);
    blob.add(SectionId::kPartBodies, bodies);
    blob.add(SectionId::kPartScenes, scenes.bytes());
    if (!driven.empty()) blob.add(SectionId::kDriven, driven);
    if (!driven.empty() || hands > 1) blob.add(SectionId::kBodyPairs, pairs);
    return blob.finish(around.view.header().capacity);
  };
  // The memory of a law is counted over the scenes as they stand in the file.
  std::vector<std::byte> whole = written();
  const OpenedParts counted(whole);
  bool has_law = false;
  for (std::uint32_t k = 0; k < records.size(); ++k) {
    if (records[k].law_bytes != kToBeCounted) continue;
    records[k].law_bytes = law_bytes(counted.parts, k);
    has_law = true;
  }
  if (!has_law) return whole;
  whole = written();
  static_cast<void>(OpenedParts(whole));
  return whole;
}

SceneBytes with_changed(const SceneView& scene,
                        const std::function<SceneBytes(const SceneView&)>& changed) {
  return with_each_changed(scene, [&](const SceneView& of, std::uint32_t) { return changed(of); });
}

std::vector<std::byte> with_stages(const SceneView& scene, const std::vector<Stage>& stages) {
  std::vector<StageRecord> records;
  for (const Stage& stage : stages) {
    StageRecord record{};
    record.part = stage.part;
    std::copy_n(stage.goal.p_wa_m, 3, record.goal_p_wa_m);
    std::copy_n(stage.goal.q_wa_xyzw, 4, record.goal_q_wa_xyzw);
    records.push_back(record);
  }
  BlobBuilder blob = sections_without(scene, [](SectionId id) { return id == SectionId::kStages; });
  if (!records.empty()) blob.add(SectionId::kStages, records);
  std::vector<std::byte> whole = blob.finish(scene.header().capacity);
  const OpenedScene written(whole);
  static_cast<void>(stages_of(written.view));
  return whole;
}

std::vector<Stage> stages_of(const SceneView& scene) {
  std::vector<Stage> stages;
  for (const SectionEntry& s : scene.sections()) {
    if (s.id != SectionId::kStages) continue;
    const PartScenes parts = opened_parts(scene);
    if (s.element_bytes != sizeof(StageRecord) || s.count > parts.count())
      throw InputError("the stages of the scene are refused: there are more than parts");
    const auto* const records =
        reinterpret_cast<const StageRecord*>(scene.blob().data() + s.offset);
    for (const StageRecord& record : std::span(records, static_cast<std::size_t>(s.count))) {
      const bool is_new = std::ranges::find(stages, record.part, &Stage::part) == stages.end();
      if (record.part >= parts.count() || !parts.may_be_taken(record.part) || !is_new)
        throw InputError("the stages of the scene are refused: part " +
                         std::to_string(record.part) + " is none that the hand may take once");
      double q2 = 0;
      bool is_place = true;
      for (const double x : record.goal_q_wa_xyzw) q2 += x * x;
      for (const double x : record.goal_p_wa_m)
        is_place = is_place && std::abs(x) <= kMaxSceneLength_m;
      if (!is_place || !(std::abs(q2 - 1) <= 1e-6))
        throw InputError("the stages of the scene are refused: the goal of part " +
                         std::to_string(record.part) + " is no pose");
      Stage stage;
      stage.part = record.part;
      std::copy_n(record.goal_p_wa_m, 3, stage.goal.p_wa_m);
      std::copy_n(record.goal_q_wa_xyzw, 4, stage.goal.q_wa_xyzw);
      stages.push_back(stage);
    }
  }
  return stages;
}

std::vector<std::byte> with_guides(const SceneView& scene,
                                   const std::vector<std::optional<GuideTables>>& guides) {
  const SceneBytes guided = with_each_changed(scene, [&](const SceneView& of, std::uint32_t part) {
    return part < guides.size() && guides[part] ? with_guide(of, *guides[part])
                                                : SceneBytes{of.blob()};
  });
  return {guided.span().begin(), guided.span().end()};
}

}  // namespace haptic::tools
