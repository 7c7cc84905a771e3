// SPDX-License-Identifier: Apache-2.0
/// graph_compiler SCENE.toml -o SCENE.rtscene: from meshes to a scene that the servo loop reads in
/// place.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <span>

#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/run_main.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/report.hpp"

namespace haptic::tools {
namespace {

struct Arguments {
  std::string scene, output, report;
  double plane_tolerance_m = 0.0;
  std::size_t max_reflex = 0;
  bool has_tolerance = false, has_reflex = false, quiet = false, certified = false;
};

/// One line on a terminal, from the second second on: nothing for quick scenes, nothing in log
/// files.
class ProgressLine {
 public:
  void show(const std::string& mesh, const char* step, double fraction) {
    if (!enabled_) return;
    const auto now = std::chrono::steady_clock::now();
    if (now - begin_ < std::chrono::seconds(1) || now - last_ < std::chrono::milliseconds(100)) {
      return;
    }
    last_ = now;
    shown_ = true;
    std::fprintf(stderr, "\r\033[K%s: %s %3.0f %%", mesh.c_str(), step, 100.0 * fraction);
    std::fflush(stderr);
  }
  void clear() {
    if (shown_) std::fputs("\r\033[K", stderr);
    shown_ = false;
  }
  ~ProgressLine() { clear(); }
  explicit ProgressLine(bool enabled) : enabled_(enabled) {}
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

 private:
  bool enabled_ = false, shown_ = false;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now(), last_ = begin_;
};

/// Two names of one file, of which one would overwrite the other.
bool same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  return std::filesystem::weakly_canonical(a, error) == std::filesystem::weakly_canonical(b, error);
}

int compile(const Arguments& arguments) {
  const bool has_report = !arguments.report.empty();
  if (same_file(arguments.scene, arguments.output) ||
      (has_report && (same_file(arguments.scene, arguments.report) ||
                      same_file(arguments.output, arguments.report)))) {
    std::fputs("graph_compiler: scene, output and report must be different files\n", stderr);
    return kExitUsage;
  }
  const SceneFile scene = read_scene_file(arguments.scene);
  ProgressLine line(!arguments.quiet && ::isatty(STDERR_FILENO) == 1);
  CompileOptions options;
  if (arguments.has_tolerance) options.plane_tolerance_m = arguments.plane_tolerance_m;
  if (arguments.has_reflex) options.max_reflex = arguments.max_reflex;
  options.progress = [&](const std::string& mesh, const char* step, double fraction) {
    line.show(mesh, step, fraction);
  };
  const CompiledScene compiled = compile_scene(scene, options);
  line.clear();
  if (arguments.certified) {
    const std::vector<std::string> reasons = unproven_of(compiled);
    for (const std::string& reason : reasons) {
      std::fprintf(stderr, "graph_compiler: not certified: %s\n", reason.c_str());
    }
    if (!reasons.empty()) return kExitCheckFailed;
  }

  std::vector<PendingFile> files{{arguments.output, std::span(compiled.bytes)}};
  std::string json;
  if (has_report) {
    json = report_as_json(compiled);
    files.push_back({arguments.report, std::as_bytes(std::span(json))});
  }
  write_files(files);
  for (const std::string& warning : warnings_of(compiled)) {
    std::fprintf(stderr, "graph_compiler: warning: %s\n", warning.c_str());
  }
  if (!arguments.quiet) {
    const std::string text = report_as_text(compiled);
    std::fwrite(text.data(), 1, text.size(), stdout);
  }
  return kExitDone;
}

}  // namespace
}  // namespace haptic::tools

int main(int argc, char** argv) {
  CLI::App app{
      "Compiles a scene (meshes, poses, stiffness) into the contact graph that the servo loop "
      "reads.\n"
      "Exit codes: 0 done, 1 not certified, 2 usage, 3 the scene or a mesh cannot be used, 4 the "
      "system refused."};
  haptic::tools::Arguments arguments;
  app.add_option("scene", arguments.scene, "scene file (TOML)")->required();
  app.add_option("-o,--output", arguments.output, "compiled scene (.rtscene)")->required();
  app.add_option("--report", arguments.report, "write an account of the compilation (JSON)");
  CLI::Option* tolerance =
      app.add_option("--plane-tolerance", arguments.plane_tolerance_m,
                     "distance within which a vertex lies on a plane [m]; default: from the mesh")
          ->check(CLI::PositiveNumber);
  CLI::Option* reflex = app.add_option("--max-reflex", arguments.max_reflex,
                                       "reflex edges allowed per part (default 300)");
  app.add_flag("--certified", arguments.certified,
               "refuse a scene of which a tick may have to give up exactness");
  app.add_flag("--quiet", arguments.quiet, "no summary; warnings and errors only");
  app.set_version_flag("--version", "graph_compiler " HAPTIC_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? haptic::tools::kExitDone : haptic::tools::kExitUsage;
  }
  arguments.has_tolerance = tolerance->count() > 0;
  arguments.has_reflex = reflex->count() > 0;
  return haptic::tools::run_main("graph_compiler",
                                 [&] { return haptic::tools::compile(arguments); });
}
