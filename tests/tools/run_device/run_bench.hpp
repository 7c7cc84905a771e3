// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A scene and a configuration for `run_device run`, and the lines that it writes.

#include <doctest/doctest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/program_run.hpp"

namespace haptic::tools::test {

// The tetrahedron's grip point 40 mm above the box: the hand presses it some 5 mm in.
inline constexpr const char* kWorkspace = "[workspace]\noffset_m = [0.0, 0.0, 0.04]\n";
inline constexpr const char* kHead = "scene = \"t.rtscene\"\n[device]\ndriver = \"sim\"\n";

inline void write(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

/// A folder with a compiled scene and a configuration that works.
struct Bench {
  sim::test::ScratchFolder folder{"run_device_loop"};
  std::string config = folder.file("run.toml");

  explicit Bench(const char* scene_name = "tetrahedron_on_box",
                 const std::string& head = std::string(kHead) + kWorkspace) {
    const std::string scene = std::string(HAPTIC_SCENES) + "/" + scene_name + "/scene.toml";
    const sim::test::ProgramResult r = sim::test::run_program(
        HAPTIC_GRAPH_COMPILER, "'" + scene + "' -o '" + folder.file("t.rtscene") + "'");
    REQUIRE(r.exit_code == 0);
    write(config, head);
  }
  void clock(const std::string& clocking) const {
    write(config, std::string(kHead) + kWorkspace + "[loop]\nrate_hz = 500\nclocking = \"" +
                      clocking + "\"\n");
  }
  [[nodiscard]] sim::test::ProgramResult run(const std::string& arguments) const {
    return sim::test::run_program(HAPTIC_RUN_DEVICE, "run '" + config + "' " + arguments);
  }
  /// The same, again where the machine was too busy for the loop: what it does then is of other
  /// tests. The sixth run counts in any case.
  [[nodiscard]] sim::test::ProgramResult run_in_time(const std::string& arguments) const {
    sim::test::ProgramResult r = run(arguments);
    for (int k = 0; k < 5; ++k) {
      const bool late = r.err.find("the servo tick came too late") != std::string::npos ||
                        r.err.find("counts only once it has been released") != std::string::npos;
      if (!late) break;
      r = run(arguments);
    }
    return r;
  }
};

inline std::vector<nlohmann::json> lines_of(const std::string& text) {
  std::vector<nlohmann::json> lines;
  std::istringstream stream(text);
  std::string line;
  while (std::getline(stream, line)) {
    // The last one may still be in the making.
    if (!stream.eof()) lines.push_back(nlohmann::json::parse(line));
  }
  return lines;
}

}  // namespace haptic::tools::test
