// SPDX-License-Identifier: Apache-2.0
// The program host_sim that tools/quickstart builds: what it has, and what it says of the rest.
#include <doctest/doctest.h>

#include <fstream>
#include <string>

#include "tests/host_sim/sample_scenes.hpp"
#include "tests/support/program_run.hpp"

using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

ProgramResult quick(const std::string& arguments) {
  return run_program(HAPTIC_HOST_SIM_QUICK, arguments);
}

}  // namespace

TEST_SUITE("host_sim.quick_program") {
  TEST_CASE("a command that is left out says how to build it, with any words behind its name") {
    for (const std::string command :
         {"plan", "plan s.rtscene --goal 0,0,0 -o p.plan", "play r.hrec --scene s.rtscene",
          "run --scene s.rtscene --serve --port 8000", "serve 2 --hand firm", "usb-device -x"}) {
      CAPTURE(command);
      const ProgramResult said = quick(command);
      CHECK(said.exit_code == 2);
      CHECK(said.out.empty());
      const std::string name = command.substr(0, command.find(' '));
      const std::string text =
          name +
          " is not in this build; to get it: cmake --preset release && cmake --build --preset "
          "release --target host_sim";
      CHECK(said.err == "host_sim: " + text + "\n");
      const ProgramResult help = quick("help " + name);
      CHECK(help.exit_code == 0);
      CHECK(help.out.find(text) != std::string::npos);
    }
    CHECK(quick("--help").out.find("Not in this build.") != std::string::npos);
    const ProgramResult laboratory = quick("wcet s.rtscene");
    CHECK(laboratory.exit_code == 2);
    CHECK(laboratory.err ==
          "host_sim: wcet is not in this build; to get it: cmake --preset release && cmake --build "
          "--preset release --target host_lab\n");
  }

  TEST_CASE("what it has gives the bytes of the whole program") {
    const ScratchFolder folder("quick");
    const std::string scene = folder.file("s.rtscene"), motion = folder.file("m.csv");
    const std::vector<std::byte> bytes = scene_of(tetrahedron(), box(0.1, 0.06, 0.05));
    std::ofstream(scene, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    CHECK(quick("motion --for '" + scene + "' -o '" + motion + "'").exit_code == 0);
    const std::string replay = "replay '" + scene + "' '" + motion + "' --check --out ";
    CHECK(quick(replay + "'" + folder.file("quick.csv") + "'").exit_code == 0);
    CHECK(run_program(HAPTIC_HOST_SIM, replay + "'" + folder.file("whole.csv") + "'").exit_code ==
          0);
    CHECK(text_of_file(folder.file("quick.csv")) == text_of_file(folder.file("whole.csv")));
  }

  TEST_CASE("it looks for the way into a fit, and finds that of the whole program") {
    const ScratchFolder folder("quick_way_in");
    const std::string scene = folder.file("s.rtscene");
    const ProgramResult compiled =
        run_program(HAPTIC_GRAPH_COMPILER,
                    "'" HAPTIC_SCENES_DIR "/gear_on_shaft/scene.toml' -o '" + scene + "'");
    CAPTURE(compiled.err);
    REQUIRE(compiled.exit_code == 0);
    const std::string make = "motion --for '" + scene + "' -o ";
    const ProgramResult made = quick(make + "'" + folder.file("quick.csv") + "'");
    CHECK(made.exit_code == 0);
    CHECK(made.out.find("straight ways to where the part belongs") != std::string::npos);
    CHECK(run_program(HAPTIC_HOST_SIM, make + "'" + folder.file("whole.csv") + "'").exit_code == 0);
    CHECK(text_of_file(folder.file("quick.csv")) == text_of_file(folder.file("whole.csv")));
  }
}
