// SPDX-License-Identifier: Apache-2.0
/// scene_inspect SCENE.rtscene [--json]: what is in a compiled scene, and is it sound.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "rt_core/haptic_core.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/run_main.hpp"
#include "tools/scene_inspect/facts_text.hpp"

namespace haptic::tools {
namespace {

int inspect(const std::string& path, bool json) {
  const SceneBytes bytes = read_scene_bytes(path);
  SceneView view;
  RtStatus status = SceneView::open(bytes.span(), view);
  if (status == RtStatus::kOk &&
      HapticCore::state_bytes(view) != view.header().capacity.state_bytes) {
    status = RtStatus::kBlobBadCapacity;
  }
  if (status != RtStatus::kOk) throw InputError(path + ": " + to_text(status));
  const SceneFacts facts = facts_of(view);
  const std::string text =
      json ? facts_as_json(facts).dump(1, ' ', false, nlohmann::json::error_handler_t::replace) +
                 "\n"
           : facts_as_text(facts);
  std::fwrite(text.data(), 1, text.size(), stdout);
  bool sound = true;
  for (const BodyFacts& body : facts.bodies)
    sound = sound && body.recheck.convex && body.recheck.source_conflicts == 0;
  return sound ? kExitDone : kExitCheckFailed;
}

}  // namespace
}  // namespace haptic::tools

int main(int argc, char** argv) {
  CLI::App app{
      "Shows what a compiled scene holds and checks its geometry.\n"
      "Exit codes: 0 sound, 1 its geometry fails the check, 2 usage, 3 the file is not a sound "
      "scene."};
  std::string path;
  bool json = false;
  app.add_option("scene", path, "compiled scene (.rtscene)")->required();
  app.add_flag("--json", json, "all facts as JSON");
  app.set_version_flag("--version", "scene_inspect " HAPTIC_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? haptic::tools::kExitDone : haptic::tools::kExitUsage;
  }
  return haptic::tools::run_main("scene_inspect",
                                 [&] { return haptic::tools::inspect(path, json); });
}
