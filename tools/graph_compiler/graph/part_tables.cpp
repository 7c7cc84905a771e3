// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/part_tables.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/graph/scene_tables.hpp"

namespace haptic::tools {

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

}  // namespace haptic::tools
