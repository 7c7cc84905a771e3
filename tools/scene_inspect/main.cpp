// SPDX-License-Identifier: Apache-2.0
/// scene_inspect SCENE.rtscene [--json] [--explode DIR] [--cspace POSE --cspace-dir DIR [--pair
/// A,B]] [--plan P]: what is in a compiled scene, is it sound, what does it cost; its C-obstacles
/// at a pose; whether a plan holds.
#include <CLI/App.hpp>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "rt_core/haptic_core.hpp"
#include "tools/c_space/pose_text.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"
#include "tools/graph_compiler/program/scene_file.hpp"
#include "tools/plan/plan_check.hpp"
#include "tools/plan/plan_limits.hpp"
#include "tools/scene_facts/facts_text.hpp"
#include "tools/scene_inspect/c_space_view.hpp"
#include "tools/scene_inspect/damage_place.hpp"
#include "tools/scene_inspect/explanation.hpp"
#include "tools/scene_inspect/exploded_view.hpp"
#include "tools/scene_inspect/part_pair.hpp"

namespace haptic::tools {
namespace {

struct Arguments {
  std::string scene, budget, explode, cspace, cspace_folder, plan, pair, other = "start";
  double explode_factor = 0.6;
  bool json = false, brief = false;
};

SceneView opened(const std::string& path, const SceneBytes& bytes) {
  SceneView view;
  SceneFault fault;
  RtStatus status = SceneView::open(bytes.span(), view, fault);
  if (status == RtStatus::kOk &&
      HapticCore::state_bytes(view) != view.header().capacity.state_bytes) {
    status = RtStatus::kBlobBadCapacity;
    fault = {SectionId{0}, 0};
  }
  if (status != RtStatus::kOk) {
    throw InputError(path + ": " + damage_text(bytes.span(), status, fault) +
                     (status == RtStatus::kBlobBadMagic
                          ? "; compile it first: graph_compiler " + path + " -o SCENE.rtscene"
                          : ""));
  }
  return view;
}

/// @throws InputError when the file is no scene file, or that of another scene.
BudgetLimits limits_of(const std::string& path, const std::string& scene) {
  BudgetLimits limits;
  if (path.empty()) return limits;
  const SceneFile file = read_scene_file(path);
  if (file.name != scene) {
    throw InputError(path + ": is the scene '" + file.name + "', the compiled one is '" + scene +
                     "'; give the file that it was compiled from");
  }
  limits.file = path;
  const auto bytes = [](const std::optional<BudgetLimit>& limit) {
    return limit ? std::optional<std::uint64_t>(limit->bytes) : std::nullopt;
  };
  limits.constants = bytes(file.budget.constants);
  limits.state = bytes(file.budget.state);
  limits.stack = bytes(file.budget.stack);
  return limits;
}

/// Writes exploded.obj and exploded.mtl.
void write_exploded(const SceneView& view, const Inspection& inspection,
                    const Arguments& arguments) {
  const std::filesystem::path folder(arguments.explode);
  const std::vector<ExplodedBody> bodies =
      exploded_bodies(view, inspection.pruning.exposure, arguments.explode_factor);
  const std::string obj = exploded_obj(bodies, "exploded.mtl"), mtl = exploded_mtl(bodies);
  write_files({{folder / "exploded.obj", std::as_bytes(std::span(obj))},
               {folder / "exploded.mtl", std::as_bytes(std::span(mtl))}});
}

/// Writes cspace.svg, cspace.obj, cspace.mtl and cspace.csv.
void write_c_space(const CSpaceView& space, const std::string& out) {
  const std::filesystem::path folder(out);
  const std::string svg = c_space_svg(space), csv = c_space_csv(space), mtl = c_space_mtl();
  const std::string obj = c_space_obj(space, "cspace.mtl");
  write_files({{folder / "cspace.svg", std::as_bytes(std::span(svg))},
               {folder / "cspace.obj", std::as_bytes(std::span(obj))},
               {folder / "cspace.mtl", std::as_bytes(std::span(mtl))},
               {folder / "cspace.csv", std::as_bytes(std::span(csv))}});
}

/// The drawing alone: no proof is repeated.
int draw_c_space(const Arguments& arguments, const SceneView& view) {
  CSpaceView space;
  if (arguments.pair.empty()) {
    space = c_space_view(view, pose_from_text(view, "--cspace", arguments.cspace));
  } else {
    const PartPair pair = part_pair_of(view, arguments.pair, arguments.cspace, arguments.other);
    space = c_space_view(pair.view, pair.a_seen_from_b);
    space.a = "'" + pair.a + "'";
    space.axes = pair.b;
  }
  claim_folder(arguments.cspace_folder, "--cspace-dir",
               {"cspace.svg", "cspace.obj", "cspace.mtl", "cspace.csv"});
  write_c_space(space, arguments.cspace_folder);
  const std::string text = c_space_text(space);
  std::fwrite(text.data(), 1, text.size(), stdout);
  return kExitDone;
}

/// The plan alone: proves every step again, in long double from the vertices of the scene, and
/// looks whether it stays within the scene's limits.
int inspect_plan(const Arguments& arguments, const SceneView& view) {
  const Plan plan = read_plan(arguments.plan);
  PlanProof proof = prove_plan(view, plan, arguments.plan);
  if (proof.holds()) proof.failure = PlanLimits(view.parameters().envelope).left_by(plan);
  if (arguments.json) {
    const nlohmann::ordered_json json = {{"plan", arguments.plan},
                                         {"scene", plan.scene},
                                         {"steps", proof.steps},
                                         {"certified", proof.certified},
                                         {"stations", plan.stations.size()},
                                         {"planes", proof.planes},
                                         {"runs", proof.runs},
                                         {"kept_apart", proof.kept_apart},
                                         {"least_m", proof.least_m},
                                         {"tolerance_m", plan.tolerance_m},
                                         {"length_m", plan.stations.front().cost_to_go_m},
                                         {"holds", proof.holds()},
                                         {"failure", proof.failure}};
    const std::string text =
        json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
    std::fwrite(text.data(), 1, text.size(), stdout);
    return proof.holds() ? kExitDone : kExitCheckFailed;
  }
  const auto count = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  const double share = proof.steps == 0 ? 0.0
                                        : 100.0 * static_cast<double>(proof.certified) /
                                              static_cast<double>(proof.steps);
  std::printf("%s: a plan for '%s', %.4g mm long, %zu stations\n", arguments.plan.c_str(),
              plan.scene.c_str(), 1e3 * plan.stations.front().cost_to_go_m, plan.stations.size());
  std::printf(
      "certified: %llu of %llu steps, %.4g %%; %llu pairs in each; %llu planes keep pairs apart "
      "over %llu runs of steps, %llu times in all\n",
      count(proof.certified), count(proof.steps), share, count(proof.pairs), count(proof.planes),
      count(proof.runs), count(proof.kept_apart));
  if (proof.certified > 0) {
    std::printf("least distance proved on the way: %.4g um (a depth of %.3g um counts as free)\n",
                1e6 * proof.least_m, 1e6 * plan.tolerance_m);
  }
  if (!proof.holds()) std::printf("not proved: %s\n", proof.failure.c_str());
  return proof.holds() ? kExitDone : kExitCheckFailed;
}

int inspect(const Arguments& arguments) {
  const SceneBytes bytes = read_scene_bytes(arguments.scene);
  const SceneView view = opened(arguments.scene, bytes);
  if (!arguments.plan.empty()) return inspect_plan(arguments, view);
  if (!arguments.cspace.empty()) return draw_c_space(arguments, view);
  const Inspection inspection = inspection_of(view);
  claim_folder(arguments.explode, "--explode", {"exploded.obj", "exploded.mtl"});
  const BudgetLimits limits = limits_of(arguments.budget, inspection.facts.name);
  if (!arguments.explode.empty()) write_exploded(view, inspection, arguments);
  std::string text;
  if (arguments.json) {
    text = inspection_as_json(inspection, limits)
               .dump(1, ' ', false, nlohmann::json::error_handler_t::replace) +
           "\n";
  } else {
    text = explanation(inspection, limits);
    if (!arguments.brief) text += "\nIn detail\n" + facts_as_text(inspection.facts);
  }
  std::fwrite(text.data(), 1, text.size(), stdout);
  const bool sound = is_sound(certificates_of(inspection));
  return sound && within_budget(inspection.facts, limits) ? kExitDone : kExitCheckFailed;
}

}  // namespace
}  // namespace haptic::tools

int main(int argc, char** argv) {
  CLI::App app("Explains what a compiled scene holds and proves it again from its bytes.",
               "scene_inspect");
  haptic::tools::Arguments arguments;
  app.add_option("scene,--scene", arguments.scene, "compiled scene (.rtscene)")->required();
  CLI::Option* json = app.add_flag("--json", arguments.json, "all facts as JSON");
  app.add_flag("--brief", arguments.brief, "only the page, without the tables behind it")
      ->excludes(json);
  app.add_option("--budget", arguments.budget,
                 "scene file with the [budget] to check the scene against");
  CLI::Option* explode = app.add_option(
      "-o,--explode", arguments.explode,
      "folder for the pieces pushed apart, for any viewer: exploded.obj, exploded.mtl");
  app.add_option("--explode-factor", arguments.explode_factor,
                 "how far: share of a piece's way from the middle of its part (default 0.6)")
      ->check(haptic::tools::number_within(0.0, 100.0))
      ->needs(explode);
  CLI::Option* cspace =
      app.add_option("--cspace", arguments.cspace,
                     "draw C-space at this pose and nothing else: start, or x,y,z[,qw,qx,qy,qz] of "
                     "the moving part's file frame [m, or 5mm]")
          ->excludes(json)
          ->excludes(explode);
  CLI::Option* folder =
      app.add_option("--cspace-dir", arguments.cspace_folder,
                     "folder for it: cspace.svg, cspace.obj, cspace.mtl, cspace.csv")
          ->needs(cspace);
  cspace->needs(folder);
  CLI::Option* pair =
      app.add_option("--pair", arguments.pair,
                     "for it two parts that both move, such as peg,socket: the pose is that of the "
                     "first, and all is drawn in the axes of the one that the law takes for "
                     "standing")
          ->needs(cspace);
  app.add_option("--other", arguments.other, "pose of the second part; default: start")
      ->needs(pair);
  app.add_option("--plan", arguments.plan,
                 "prove this plan of host_sim plan again, and nothing else")
      ->excludes(cspace)
      ->excludes(explode);
  using haptic::tools::Command;
  const Command commands[] = {{&app, [&] { return haptic::tools::inspect(arguments); },
                               "scene_inspect peg.rtscene --explode drawing"}};
  return haptic::tools::run_program(app, commands,
                                    "0 sound, 1 a certificate or a plan fails, or the scene "
                                    "exceeds its budget, 2 usage, 3 the file is not "
                                    "a sound scene, 4 the system refused",
                                    argc, argv);
}
