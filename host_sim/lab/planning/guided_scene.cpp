// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/planning/guided_scene.hpp"

#include <utility>

#include "host_sim/report/part_report.hpp"
#include "host_sim/session/child_run.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

namespace haptic::sim {

tools::SceneBytes compiled_scene(const tools::SceneFile& file) {
  return tools::SceneBytes(tools::compile_scene(file, {}).bytes);
}

SceneView opened_scene(const tools::SceneBytes& bytes) {
  SceneView view;
  const RtStatus status = SceneView::open(bytes.span(), view);
  if (status != RtStatus::kOk)
    throw tools::InputError(std::string("the scene does not open: ") + to_text(status));
  return view;
}

tools::SceneBytes guided_scene(tools::SceneFile file, const tools::Plan& plan) {
  const TemporaryFolder folder;
  write_whole_file(folder.file("guide.plan"), tools::plan_as_text(plan));
  file.guide.emplace();
  file.guide->plan = folder.file("guide.plan");
  return compiled_scene(file);
}

tools::SceneBytes with_changed_guide(const tools::SceneBytes& scene, const ChangeGuide& change) {
  tools::SceneBytes bytes(scene.span());
  const SceneView view = opened_scene(bytes);
  if (view.guide() == nullptr) throw tools::InputError("the scene has no guide to change");
  std::byte* const blob = bytes.span().data();
  const auto place_of = [&](const void* in_view) {
    return blob + (static_cast<const std::byte*>(in_view) - blob);
  };
  const std::span<const GuideStation> stations = view.guide_stations();
  change(*reinterpret_cast<GuideRecord*>(place_of(view.guide())),
         {reinterpret_cast<GuideStation*>(place_of(stations.data())), stations.size()});
  auto* const header = reinterpret_cast<SceneHeader*>(blob);
  header->content_hash = scene_content_hash(bytes.span());
  static_cast<void>(opened_scene(bytes));
  return bytes;
}

}  // namespace haptic::sim
