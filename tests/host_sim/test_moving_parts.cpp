// SPDX-License-Identifier: Apache-2.0
// A scene in which several parts move is refused where a command is about one, and judged by
// host_lab bodies-fuzz --scene.
#include <doctest/doctest.h>

#include <fstream>
#include <string>

#include "host_sim/lab/bodies_fuzz/bodies_campaign.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_of_file.hpp"
#include "host_sim/session/moving_parts.hpp"
#include "tests/support/program_run.hpp"
#include "tests/support/text_search.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;
using haptic::test::has;

namespace {

std::string scene_box(const std::string& name, const std::string& role, const std::string& size,
                      const std::string& at, const std::string& more = "") {
  return "[[part]]\nname = \"" + name + "\"\nrole = \"" + role + "\"\nshape = \"box\"\nsize_m = [" +
         size + "]\nposition_m = [" + at + "]\n" + more;
}

/// Writes the compiled scene and says where.
std::string moving_scene(const ScratchFolder& folder, const std::string& more) {
  const std::string path = folder.file("scene.toml"), compiled = folder.file("scene.rtscene");
  std::ofstream(path) << "format = 1\nname = \"moving\"\n" +
                             scene_box("held", "hand", "0.03, 0.024, 0.02", "0, 0, 0.06") +
                             scene_box("table", "fixed", "0.3, 0.3, 0.02", "0, 0, -0.01") + more +
                             "[rendering]\nk_f_n_per_m = 1000\n";
  const std::vector<std::byte> bytes = tools::compile_scene(tools::read_scene_file(path), {}).bytes;
  std::ofstream(compiled, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  return compiled;
}

const std::string kRobotBox = scene_box("robot", "driven", "0.04, 0.04, 0.02", "0.05, 0, 0.05",
                                        "fastest_m_per_s = 0.2\nfastest_rad_per_s = 1\n");
const std::string kLooseBox = scene_box("screw", "loose", "0.02, 0.02, 0.02", "-0.05, 0, 0.0101");
const std::string kPlacedBox = scene_box("ring", "placed", "0.02, 0.02, 0.02", "-0.05, 0, 0.0101");

std::string one_part_refusal(const std::string& scene) {
  const CoreSession session(scene, GoalContact::kLeftOut);
  try {
    require_one_moving_part(session, scene, "wcet", "give one");
  } catch (const tools::InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_SUITE("host_sim.moving_parts") {
  TEST_CASE("refused where other parts move, and only there") {
    const ScratchFolder folder("moving_parts");
    CHECK(one_part_refusal(moving_scene(folder, kPlacedBox)).empty());
    const std::string text = one_part_refusal(moving_scene(folder, kRobotBox + kLooseBox));
    INFO(text);
    CHECK(has(text, "part 'robot' is driven"));
    CHECK(has(text, "part 'screw' is loose"));
    CHECK(has(text, "; give one"));
  }

  TEST_CASE("programs: exit 3 with the command that judges such a scene") {
    const ScratchFolder folder("moving_programs");
    const std::string scene = moving_scene(folder, kRobotBox);
    const ProgramResult wcet = run_program(HAPTIC_HOST_SIM, "wcet " + scene + " --once");
    INFO(wcet.err);
    CHECK(wcet.exit_code == 3);
    CHECK(has(wcet.err, "host_lab bodies-fuzz --scene"));
    std::ofstream(folder.file("motion.csv"))
        << "t,x,y,z,qw,qx,qy,qz\n0,0,0,0.06,1,0,0,0\n0.001,0,0,0.06,1,0,0,0\n";
    const std::string replay = "replay " + scene + " " + folder.file("motion.csv");
    CHECK(run_program(HAPTIC_HOST_SIM, replay + " --check").exit_code == 3);
    CHECK(run_program(HAPTIC_HOST_SIM, replay).exit_code == 0);
  }

  TEST_CASE("judged: roles, pairs and springs are those of the file") {
    const ScratchFolder folder("moving_judged");
    const std::string scene = moving_scene(folder, kRobotBox + kLooseBox);
    const CompiledBodies compiled = bodies_of_file(scene);
    REQUIRE(compiled.scene.bodies.size() == 3);
    CHECK(compiled.scene.bodies[1].role == BodyRole::kDriver);
    CHECK(compiled.scene.bodies[2].role == BodyRole::kLoose);
    CHECK(compiled.scene.bodies[1].fastest_m_per_s == 0.2);
    CHECK(compiled.pairs.size() == 5);  // with the table hand and screw; three with each other
    BodiesFuzzSize size;
    size.scene = scene;
    size.ticks = 4000;
    size.seed = 3;
    const BodiesFuzzResult result = run_bodies_fuzz(size, {2, false});
    const BodiesTotals t = result.totals();
    INFO(bodies_fuzz_page(result));
    CHECK(t.failed() == 0);
    CHECK(t.held > 100);
    CHECK(t.peak_units > 0);
    CHECK(t.peak_units <= t.units_bound);
    size.fault = BodiesFault::kCertificate;
    CHECK(run_bodies_fuzz(size, {2, false}).totals().failed() > 0);
  }

  TEST_CASE("judged: more parts than move in one tick, as programs move them") {
    const ScratchFolder folder("moving_turns");
    std::string screws = kRobotBox;
    for (int k = 0; k < 10; ++k) {
      screws += scene_box("screw " + std::to_string(k), "loose", "0.016, 0.016, 0.016",
                          std::to_string(-0.05 + 0.0162 * (k % 5)) + ", " +
                              std::to_string(0.0162 * (k / 5)) + ", 0.00802");
    }
    BodiesFuzzSize size;
    size.scene = moving_scene(folder, screws);
    size.ticks = 6000;
    size.seed = 3;
    const BodiesTotals t = run_bodies_fuzz(size, {2, false}).totals();
    CHECK(t.failed() == 0);
    CHECK(t.hand_ticks == 6000);
    CHECK(t.ticks == 0);
    CHECK(t.worst_gap_m < 0);  // they met
    for (const BodiesFault fault : {BodiesFault::kBound, BodiesFault::kGoal}) {
      size.fault = fault;
      CHECK(run_bodies_fuzz(size, {2, false}).totals().failed() > 0);
    }
    size.fault = BodiesFault::kCertificate;
    CHECK_THROWS_AS(static_cast<void>(run_bodies_fuzz(size, {2, false})), tools::InputError);
  }

  TEST_CASE("judged: a scene in which one part moves is refused") {
    const ScratchFolder folder("moving_refused");
    CHECK_THROWS_AS(static_cast<void>(bodies_of_file(moving_scene(folder, kPlacedBox))),
                    tools::InputError);
  }
}
