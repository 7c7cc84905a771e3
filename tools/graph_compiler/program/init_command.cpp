// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/init_command.hpp"

#include <CLI/App.hpp>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"
#include "tools/common/progress_line.hpp"
#include "tools/graph_compiler/program/draft_mesh.hpp"
#include "tools/graph_compiler/program/scene_draft.hpp"

namespace haptic::tools {
namespace {

struct InitArguments {
  std::string moving, output, hand;
  std::vector<std::string> fixed;
  double scale_to_m = 0.0, stiffness_n_per_m = 800.0;
  bool has_scale = false, has_hand = false, progress = false;
};

int init(const InitArguments& arguments) {
  const std::filesystem::path output = arguments.output;
  std::error_code error;
  if (std::filesystem::exists(output, error))
    throw UsageError(arguments.output + ": exists already; give another name, or remove it");
  DraftRequest request;
  request.moving = arguments.moving;
  note_input(draft_source(request.moving).file, "a mesh of the scene");
  for (const std::string& mesh : arguments.fixed) {
    request.fixed.emplace_back(mesh);
    note_input(draft_source(mesh).file, "a mesh of the scene");
  }
  claim_output(arguments.output, "--out", scene_file_kind());
  if (arguments.has_scale) request.scale_to_m = arguments.scale_to_m;
  request.stiffness_n_per_m = arguments.stiffness_n_per_m;
  request.folder = output.parent_path();
  if (arguments.has_hand) request.hand = arguments.hand;
  const NodeName moving = draft_source(request.moving);
  request.name = std::filesystem::path(moving.file).stem().string();
  if (moving.node && !request.fixed.empty()) request.name = *moving.node;
  ProgressLine line(arguments.progress || is_terminal(stderr));
  request.progress = [&](const std::string& mesh, const char* step, double fraction) {
    line.show(mesh, step, fraction);
  };
  const SceneDraft draft = draft_scene(request);
  line.clear();
  write_files({{output, std::as_bytes(std::span(draft.toml))}});
  for (const std::string& remark : draft.remarks) std::printf("%s\n", remark.c_str());
  std::printf("next: graph_compiler %s -o %s\n", arguments.output.c_str(),
              std::filesystem::path(output).replace_extension(".rtscene").string().c_str());
  return kExitDone;
}

}  // namespace

int run_init(int argc, const char* const* argv) {
  CLI::App app(
      "Writes a scene file to begin with, from meshes alone: guesses the unit from the size, and "
      "finds a start that is free. One file alone is an assembly: lists its nodes with their "
      "sizes, "
      "and takes one of them for the part in the hand, all others for fixed parts, each where the "
      "file has it.",
      "graph_compiler init");
  InitArguments arguments;
  app.add_option(
         "moving", arguments.moving,
         "mesh of the part in the hand (STL, OBJ, OFF, PLY, 3MF, STEP, ...), FILE#NODE for a node "
         "of it or FILE.urdf#LINK; or an assembly: one file with several nodes, or a robot "
         "description")
      ->required();
  app.add_option("fixed", arguments.fixed,
                 "meshes of the fixed parts, nodes or links likewise; none: the other nodes of the "
                 "assembly");
  CLI::Option* hand = app.add_option("--hand", arguments.hand,
                                     "of an assembly: the node in the hand; default: the smallest "
                                     "part without open edges that a hand can hold");
  app.add_option("-o,--out", arguments.output, "scene file to write (TOML)")->required();
  CLI::Option* scale = app.add_option("--scale", arguments.scale_to_m,
                                      "metres per unit of files that state none; default: guessed")
                           ->check(positive_number());
  app.add_option("--stiffness", arguments.stiffness_n_per_m,
                 "stiffness that the hand feels [N/m]; default 800")
      ->check(positive_number());
  app.add_flag("--progress", arguments.progress,
               "show progress, also if standard error is not a terminal");
  const Command commands[] = {{&app,
                               [&] {
                                 arguments.has_scale = scale->count() > 0;
                                 arguments.has_hand = hand->count() > 0;
                                 return init(arguments);
                               },
                               "graph_compiler init peg.stl hole.stl -o scene.toml"}};
  return run_program(app, commands,
                     "0 done, 2 usage, 3 a mesh cannot be used, 4 the system refused", argc, argv);
}

}  // namespace haptic::tools
