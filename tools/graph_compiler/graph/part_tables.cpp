// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/part_tables.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/graph/scene_tables.hpp"

namespace haptic::tools {
namespace {

bool is_of_parts(SectionId id) {
  return id == SectionId::kParts || id == SectionId::kPartBodies || id == SectionId::kPartScenes;
}

}  // namespace

std::vector<std::byte> with_parts(const std::vector<std::byte>& scene,
                                  const std::vector<HeldPart>& parts) {
  const SceneBytes around{scene};
  SceneView view;
  if (SceneView::open(around.span(), view) != RtStatus::kOk)
    throw std::logic_error("the scene just written does not open");
  std::vector<PartRecord> records;
  std::vector<std::uint32_t> bodies;
  std::vector<std::byte> scenes;
  for (const HeldPart& part : parts) {
    PartRecord record{};
    record.role = part.role;
    std::copy_n(part.start.p_wa_m, 3, record.start_p_wa_m);
    std::copy_n(part.start.q_wa_xyzw, 4, record.start_q_wa_xyzw);
    scenes.resize((scenes.size() + kSceneAlignment - 1) / kSceneAlignment * kSceneAlignment);
    record.scene_begin = scenes.size();
    record.scene_bytes = part.scene.size();
    scenes.insert(scenes.end(), part.scene.begin(), part.scene.end());
    record.body_begin = static_cast<std::uint32_t>(bodies.size());
    record.body_count = static_cast<std::uint32_t>(part.others.size());
    bodies.insert(bodies.end(), part.others.begin(), part.others.end());
    records.push_back(record);
  }
  BlobBuilder blob;
  for (const SectionEntry& s : view.sections()) {
    if (is_of_parts(s.id)) continue;
    const auto bytes = view.blob().subspan(static_cast<std::size_t>(s.offset),
                                           static_cast<std::size_t>(s.count * s.element_bytes));
    blob.add_bytes(s.id, s.element_bytes, s.count, bytes);
  }
  blob.add(SectionId::kParts, records);
  blob.add(SectionId::kPartBodies, bodies);
  blob.add(SectionId::kPartScenes, scenes);
  std::vector<std::byte> whole = blob.finish(view.header().capacity);
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
  std::vector<HeldPart> parts;
  for (std::uint32_t k = 0; k < scenes.count(); ++k) {
    HeldPart part{scenes[k].role, scenes.start_of(k), {}, {}};
    if (scenes.may_be_held(k)) {
      SceneView held;
      if (SceneView::open(scenes.scene_of(k), held) != RtStatus::kOk)
        throw std::logic_error("a part's scene has opened before");
      const SceneBytes inside = changed(held);
      part.scene.assign(inside.span().begin(), inside.span().end());
      part.others.assign(scenes.others_of(k).begin(), scenes.others_of(k).end());
    }
    parts.push_back(std::move(part));
  }
  return SceneBytes{with_parts({around.span().begin(), around.span().end()}, parts)};
}

}  // namespace haptic::tools
