// SPDX-License-Identifier: Apache-2.0
/// graph_compiler SCENE.toml -o SCENE.rtscene: from meshes to a scene that the servo loop reads in
/// place.
#include <CLI/App.hpp>
#include <algorithm>
#include <cstdio>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"
#include "tools/common/progress_line.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/init_command.hpp"
#include "tools/graph_compiler/program/memory_budget.hpp"
#include "tools/graph_compiler/program/report.hpp"
#include "tools/graph_compiler/program/scene_stages.hpp"
#include "tools/graph_compiler/program/traits_header.hpp"

namespace haptic::tools {
namespace {

struct Arguments {
  std::string scene, output, report, traits;
  std::vector<std::string> without, with;
  double plane_tolerance_m = 0.0;
  double simplify_m = 0.0, work_limit = 0.0;
  std::size_t max_reflex = 0, max_pieces = 0, stage = 0;
  bool has_tolerance = false, has_reflex = false, has_pieces = false, has_work = false;
  bool has_simplify = false, disjoint = false, propose = false, quiet = false, full = false,
       no_prune = false, certified = false, progress = false, json = false;
};

std::string header_of(const CompiledScene& compiled, const Arguments& arguments) {
  const SceneBytes aligned{compiled.bytes};
  SceneView view;
  if (SceneView::open(aligned.span(), view) != RtStatus::kOk) {
    throw std::logic_error("the scene just written does not open");
  }
  return traits_header(image_traits(view, arguments.without, arguments.with), compiled.scene.name);
}

/// Warnings that are shown without --full.
constexpr std::size_t kMostShownWarnings = 8;

int compile(const Arguments& arguments) {
  const bool has_report = !arguments.report.empty();
  const bool has_traits = !arguments.traits.empty();
  const SceneFile scene = read_scene_file(arguments.scene);
  // At once, for a number of another unit may be why the rest fails.
  for (const std::string& warning : scene.warnings) {
    std::fprintf(stderr, "graph_compiler: warning: %s\n", warning.c_str());
  }
  claim_output(arguments.output, "--out", {FileFormat::kScene, {}});
  claim_output(arguments.report, "--report", json_kind("scene"));
  claim_output(arguments.traits, "--traits", text_kind("// Written by graph_compiler"));
  ProgressLine line(arguments.progress || (!arguments.quiet && is_terminal(stderr)));
  CompileOptions options;
  if (arguments.has_tolerance) options.plane_tolerance_m = arguments.plane_tolerance_m;
  if (arguments.has_reflex) options.max_reflex = arguments.max_reflex;
  options.prune = !arguments.no_prune;
  if (arguments.has_pieces) options.max_pieces = arguments.max_pieces;
  if (arguments.has_work) options.work_limit = arguments.work_limit;
  if (arguments.has_simplify) options.simplify_m = arguments.simplify_m;
  options.disjoint = arguments.disjoint;
  options.propose_tolerance = arguments.propose;
  options.image = has_traits;
  options.progress = [&](const std::string& mesh, const char* step, double fraction) {
    line.show(mesh, step, fraction);
  };
  CompiledScene compiled;
  try {
    compiled = compile_scene(scene, options);
  } catch (const BudgetError& error) {
    line.clear();
    std::fprintf(stderr, "graph_compiler: %s\n", error.what());
    return kExitCheckFailed;
  }
  line.clear();
  if (arguments.stage > 0) take_stage(compiled, arguments.stage);
  if (arguments.certified) {
    const std::vector<std::string> reasons = unproven_of(compiled);
    for (const std::string& reason : reasons) {
      std::fprintf(stderr, "graph_compiler: not certified: %s\n", reason.c_str());
    }
    if (!reasons.empty()) return kExitCheckFailed;
  }

  std::vector<PendingFile> files{{arguments.output, std::span(compiled.bytes)}};
  std::string json, header;
  if (has_traits) {
    header = header_of(compiled, arguments);
    files.push_back({arguments.traits, std::as_bytes(std::span(header))});
  }
  if (has_report || arguments.json) json = report_as_json(compiled);
  if (has_report) {
    files.push_back({arguments.report, std::as_bytes(std::span(json))});
  }
  write_files(files);
  std::vector<std::string> warnings = warnings_of(compiled);
  warnings.erase(warnings.begin(),
                 warnings.begin() + static_cast<std::ptrdiff_t>(scene.warnings.size()));
  const std::size_t shown = arguments.full ? warnings.size() : kMostShownWarnings;
  for (std::size_t k = 0; k < std::min(shown, warnings.size()); ++k) {
    std::fprintf(stderr, "graph_compiler: warning: %s\n", warnings[k].c_str());
  }
  if (warnings.size() > shown) {
    std::fprintf(stderr, "graph_compiler: warning: and %zu more; --full lists them\n",
                 warnings.size() - shown);
  }
  if (arguments.json || !arguments.quiet) {
    const std::string text = arguments.json   ? json
                             : arguments.full ? report_as_text(compiled)
                                              : summary_as_text(compiled, arguments.output);
    std::fwrite(text.data(), 1, text.size(), stdout);
  }
  return kExitDone;
}

}  // namespace
}  // namespace haptic::tools

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "init")
    return haptic::tools::run_init(argc - 1, argv + 1);
  if (argc > 2 && std::string_view(argv[1]) == "help" && std::string_view(argv[2]) == "init") {
    const char* const asks[] = {"init", "--help"};
    return haptic::tools::run_init(2, asks);
  }
  CLI::App app(
      "Compiles a scene (meshes, poses, stiffness) into the contact graph that the servo loop "
      "reads. `graph_compiler init` writes a scene file to begin with.",
      "graph_compiler");
  haptic::tools::Arguments arguments;
  app.add_option("scene,--scene", arguments.scene, "scene file (TOML)")->required();
  app.add_option("-o,--out,--output", arguments.output, "compiled scene (.rtscene)")->required();
  app.add_option("--report", arguments.report, "write a report of the compilation (JSON)");
  app.add_option(
      "--traits", arguments.traits,
      "write the header that makes an image of this scene (rt_core/scene/scene_image.hpp)");
  app.add_option("--without", arguments.without,
                 "with --traits: leave contact_geometry out of the image")
      ->take_all()
      ->check(CLI::IsMember(haptic::tools::optional_traits()));
  app.add_option("--with", arguments.with,
                 "with --traits: compile a feature that the scene does not need; repeatable")
      ->take_all()
      ->check(CLI::IsMember(haptic::tools::trait_names()));
  CLI::Option* tolerance =
      app.add_option("--plane-tolerance", arguments.plane_tolerance_m,
                     "distance [m] within which a vertex lies on a plane; default: from the mesh")
          ->check(haptic::tools::positive_number());
  CLI::Option* reflex =
      app.add_option("--max-reflex", arguments.max_reflex,
                     "reflex edges up to which a part is a solid (default: 300, and beyond where "
                     "its pieces are cheaper than its facets)")
          ->check(haptic::tools::number_not_negative());
  CLI::Option* pieces = app.add_option("--max-pieces", arguments.max_pieces,
                                       "convex pieces allowed per part (default 4000)")
                            ->check(haptic::tools::positive_number());
  CLI::Option* work = app.add_option("--work-limit", arguments.work_limit,
                                     "units of exact work per part, of 40 to 150 ns (default 2e8)")
                          ->check(haptic::tools::positive_number());
  CLI::Option* simplify =
      app.add_option(
             "--simplify", arguments.simplify_m,
             "simplify every part: bevels, fillets and rounds of solids, edges of surfaces; no "
             "point of the surface is then farther than this from the other surface [m]")
          ->check(haptic::tools::positive_number());
  app.add_option(
         "--stage", arguments.stage,
         "write the scene of this [[stage]] alone, from 1: its part moves, those of earlier "
         "stages stand at their goals and all others where they start")
      ->check(haptic::tools::positive_number());
  app.add_flag("--disjoint", arguments.disjoint,
               "cut overlapping solids of a part apart instead of keeping them as a cover");
  app.add_flag("--propose-tolerance", arguments.propose,
               "try which tolerance_m brings contact all over surfaces into the budget of a tick");
  app.add_flag("--progress", arguments.progress,
               "show progress, also if standard error is not a terminal");
  app.add_flag("--certified", arguments.certified,
               "refuse a scene if one of its ticks may have to give up exactness");
  app.add_flag("--no-prune", arguments.no_prune,
               "keep every basic contact, also those that no pose of the scene uses");
  app.add_flag("--json", arguments.json, "the report as JSON on stdout instead of the summary");
  app.add_flag("--full", arguments.full, "everything instead of a summary of ten lines");
  app.add_flag("--quiet", arguments.quiet, "no summary; warnings and errors only");
  const auto run = [&] {
    arguments.has_tolerance = tolerance->count() > 0;
    arguments.has_reflex = reflex->count() > 0;
    arguments.has_pieces = pieces->count() > 0;
    arguments.has_work = work->count() > 0;
    arguments.has_simplify = simplify->count() > 0;
    return haptic::tools::compile(arguments);
  };
  const haptic::tools::Command commands[] = {
      {&app, run, "graph_compiler scene.toml -o peg.rtscene --report peg.json"}};
  return haptic::tools::run_program(
      app, commands,
      "0 done, 1 not certified or over its budget, 2 usage, 3 the scene or a mesh cannot be used, "
      "4 the system refused",
      argc, argv);
}
