// SPDX-License-Identifier: Apache-2.0
// Stages of an assembly: their order found by taking it apart, their plans, and a hand that is led
// through all of them.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host_sim/session/core_session.hpp"
#include "tests/host_sim/plan/stage_bench.hpp"
#include "tests/support/text_search.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/scene_stages.hpp"
#include "tools/plan/assembly_stages.hpp"
#include "tools/plan/plan_check.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

using haptic::test::has;
using StageJson = nlohmann::json;

const std::string kSimulator = HAPTIC_HOST_SIM, kCompiler = HAPTIC_GRAPH_COMPILER;

std::string at(const ScratchFolder& folder, const std::string& name) {
  return "'" + folder.file(name) + "'";
}

void compile_in(const ScratchFolder& folder, const std::string& name) {
  const ProgramResult result = run_program(
      kCompiler, at(folder, name + ".toml") + " -o " + at(folder, name + ".rtscene") + " --quiet");
  CAPTURE(result.err);
  REQUIRE(result.exit_code == 0);
}

std::vector<std::string> order_of(const StageJson& json) {
  std::vector<std::string> names;
  for (const auto& name : json.at("order")) names.push_back(name);
  return names;
}

/// Every stage of an assembly with plans: proved in the scene of the stage.
void check_proved(const std::string& file, const std::string& plans) {
  const tools::CompiledScene compiled = tools::compile_scene(tools::read_scene_file(file), {});
  REQUIRE(!compiled.scene.stages.empty());
  for (std::size_t k = 1; k <= compiled.scene.stages.size(); ++k) {
    CAPTURE(k);
    tools::CompiledScene stage = compiled;
    tools::take_stage(stage, k);
    const tools::SceneBytes bytes{stage.bytes};
    SceneView view;
    REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
    const std::string name = plans + "/" + std::to_string(k) + ".plan";
    CHECK(tools::prove_plan(view, tools::read_plan(name), name).holds());
  }
}

double apart_m(const PartPlace& a, const PartPlace& b) {
  return std::hypot(a.p_wa_m[0] - b.p_wa_m[0], a.p_wa_m[1] - b.p_wa_m[1],
                    a.p_wa_m[2] - b.p_wa_m[2]);
}

/// A part is in place, and what comes after it has room [m].
constexpr double kArrived_m = 1.0e-5;

/// One hand takes part after part and goes where the guide leads it, in one sitting.
void check_sitting(const std::string& scene) {
  const tools::SceneBytes bytes = tools::read_scene_bytes(scene);
  CoreSession session(bytes.span(), scene);
  const tools::AssemblyStages assembly(session.view(), scene);
  PartHand& hand = *session.hand();
  const double length_m = session.view().guide()->turn_m;
  LedHand led(session.view(), length_m);
  const auto step = [&](const StepInput& input) { return session.step(input); };
  double largest_step_n = 0;
  Vec3 last_n = Vec3::Zero();
  const auto tick = [&](bool changes = false) {
    const StepResult result = led.go(step);
    const Vec3 now_n = result.guidance.wrench_w.force_w;
    if (changes)
      largest_step_n = std::max(largest_step_n, static_cast<double>((now_n - last_n).norm()));
    last_n = now_n;
    return result;
  };
  const auto let_go = [&] {
    hand.release();
    for (int n = 0; n < 2000 && hand.phase() != PartHand::Phase::kEmpty; ++n) (void)tick(true);
    REQUIRE(hand.phase() == PartHand::Phase::kEmpty);
    (void)tick(true);
  };
  for (std::size_t k = 0; k < assembly.stages().size(); ++k) {
    const tools::Stage& stage = assembly.stages()[k];
    CAPTURE(assembly.name(k));
    if (stage.part != hand.part()) {
      let_go();
      REQUIRE(hand.prepare(stage.part) == RtStatus::kOk);
      for (int n = 0; n < 10; ++n) (void)tick(true);
    }
    StepResult result;
    int ticks = 0;
    for (; ticks < 60'000; ++ticks) {
      result = tick();
      if (result.guidance.state == GuideState::kOn &&
          static_cast<double>(result.guidance.cost_m) < kArrived_m)
        break;
    }
    CHECK(result.guidance.state == GuideState::kOn);
    CHECK(static_cast<double>(result.guidance.cost_m) < kArrived_m);
    MESSAGE(assembly.name(k) << ": " << ticks << " ticks, " << result.guidance.cost_m
                             << " m to go");
  }
  let_go();
  for (std::size_t k = 0; k < assembly.stages().size(); ++k) {
    CAPTURE(assembly.name(k));
    CHECK(apart_m(hand.places()[assembly.stages()[k].part], assembly.stages()[k].goal) < 1e-4);
  }
  // Neither the change of parts nor the end of a guide is felt as a jump.
  CHECK(largest_step_n < 0.1);
}

std::string refused_stage(const std::string& stages) {
  const std::string parts =
      "[[part]]\nname = \"table\"\nrole = \"fixed\"\nshape = \"box\"\nsize_m = [0.2, 0.2, 0.02]\n"
      "[[part]]\nname = \"peg\"\nrole = \"hand\"\nshape = \"box\"\nsize_m = [0.01, 0.01, 0.01]\n"
      "position_m = [0, 0, 0.1]\n";
  try {
    static_cast<void>(tools::parse_scene_file(kAssemblyHead + parts + stages, "s.toml", "."));
    return "";
  } catch (const tools::InputError& error) {
    return error.what();
  }
}

/// An assembly of `data`, its moving part in the end and its fixed part, as two parts.
struct SharedPart {
  std::string task;
  double shift_m;  ///< along x, so that several stand side by side
};

std::string shared_text(const std::vector<SharedPart>& tasks) {
  const std::filesystem::path data = std::filesystem::path(HAPTIC_SHARED_DIR) / "data";
  std::string text = kAssemblyHead;
  bool has_hand = false;
  for (const SharedPart& of : tasks) {
    const StageJson task = StageJson::parse(text_of_file((data / of.task / "task.json").string()));
    const auto part = [&](const char* which, const std::string& role) {
      const auto& node = task.at(which);
      return "[[part]]\nname = \"" + of.task + "_" + which + "\"\nrole = \"" + role +
             "\"\nmesh = \"" + (data / of.task / node.at("file").get<std::string>()).string() +
             "\"\nscale_to_m = " + node.at("scale_to_m").dump() + "\n";
    };
    const auto& p = task.at("assembled_pose").at("position_m");
    const auto& q = task.at("assembled_pose").at("quaternion_wxyz");
    text += part("static", "fixed") + "position_m = [" + std::to_string(of.shift_m) + ", 0, 0]\n";
    text += part("moving", has_hand ? "placed" : "hand") + "position_m = [" +
            std::to_string(p[0].get<double>() + of.shift_m) + ", " + p[1].dump() + ", " +
            p[2].dump() + "]\nquaternion = { w = " + q[0].dump() + ", x = " + q[1].dump() +
            ", y = " + q[2].dump() + ", z = " + q[3].dump() + " }\n";
    has_hand = true;
  }
  return text;
}

}  // namespace

TEST_SUITE("host_sim.stages") {
  TEST_CASE("the one order of an assembly is found, proved, and followed with its guides") {
    const ScratchFolder folder("stages");
    write_case(folder);
    compile_in(folder, "case");
    const ProgramResult found = run_program(
        kSimulator, "plan " + at(folder, "case.rtscene") +
                        " --order --shorten-millions 50 --json -o " + at(folder, "out"));
    CAPTURE(found.err);
    CAPTURE(found.out);
    REQUIRE(found.exit_code == 0);
    CHECK(order_of(StageJson::parse(found.out)) ==
          std::vector<std::string>{"block", "pin", "cover", "bar"});
    check_proved(folder.file("out/assembly.toml"), folder.file("out"));
    // The scene that it writes is what the compiler makes of the file that it writes.
    const std::vector<std::byte> compiled =
        tools::compile_scene(tools::read_scene_file(folder.file("out/assembly.toml")), {}).bytes;
    const tools::SceneBytes written = tools::read_scene_bytes(folder.file("out/assembly.rtscene"));
    REQUIRE(compiled.size() == written.span().size());
    CHECK(std::memcmp(compiled.data(), written.span().data(), compiled.size()) == 0);
    check_sitting(folder.file("out/assembly.rtscene"));

    // The plans are made again from the stages alone, and one of them by its number.
    const ProgramResult all =
        run_program(kSimulator, "plan " + at(folder, "out/assembly.rtscene") +
                                    " --stage all --shorten-millions 50 -o " + at(folder, "plans"));
    CAPTURE(all.out);
    CAPTURE(all.err);
    CHECK(all.exit_code == 0);
    CHECK(has(all.out, "all 4 stages are proved"));
    check_proved(folder.file("out/assembly.toml"), folder.file("plans"));
    const ProgramResult one =
        run_program(kSimulator, "plan " + at(folder, "out/assembly.rtscene") +
                                    " --stage 4 --shorten-millions 50 -o " + at(folder, "4.plan"));
    CHECK(one.exit_code == 0);
    CHECK(has(one.out, "stage 4 is proved"));
    CHECK(text_of_file(folder.file("4.plan")) == text_of_file(folder.file("plans/4.plan")));

    // The scene of one stage alone has its guide, and scene_inspect proves its plan there.
    const ProgramResult alone =
        run_program(kCompiler, at(folder, "out/assembly.toml") + " --stage 2 -o " +
                                   at(folder, "2.rtscene") + " --quiet");
    CHECK(alone.exit_code == 0);
    const ProgramResult inspected = run_program(
        HAPTIC_SCENE_INSPECT, at(folder, "2.rtscene") + " --plan " + at(folder, "out/2.plan"));
    CAPTURE(inspected.out);
    CHECK(inspected.exit_code == 0);
    CoreSession session(folder.file("2.rtscene"));
    CHECK(session.parts() == nullptr);
    CHECK(session.view().guide() != nullptr);

    // A plan of another stage is refused, and so is a stage that there is not.
    std::string text = text_of_file(folder.file("out/assembly.toml"));
    const std::size_t plan = text.find("2.plan");
    REQUIRE(plan != std::string::npos);
    write_text(folder.file("out/wrong.toml"), text.replace(plan, 6, "3.plan"));
    CHECK_THROWS_AS(
        (void)tools::compile_scene(tools::read_scene_file(folder.file("out/wrong.toml")), {}),
        tools::InputError);
    const ProgramResult none =
        run_program(kSimulator, "plan " + at(folder, "out/assembly.rtscene") + " --stage 5 -o " +
                                    at(folder, "5.plan"));
    CHECK(none.exit_code == 2);
    CHECK(has(none.err, "a number from 1 to 4"));
  }

  TEST_CASE("a stage without a plan is named in the last line, and ends with 1") {
    const ScratchFolder folder("stages");
    write_case(folder);
    // The cover before the block: then the block does not get in.
    std::string text = text_of_file(folder.file("case.toml"));
    int count = 0;
    for (const char* const lying : {"\"cover\"", "\"bar\"", "\"block\"", "\"pin\""}) {
      const std::size_t part = text.find(lying);
      REQUIRE(part != std::string::npos);
      text.insert(text.find("scale_to_m", part),
                  "position_m = [0." + std::to_string(count += 2) + ", 0.2, 0]\n");
    }
    for (const char* const part : {"cover", "block"})
      text += "[[stage]]\npart = \"" + std::string(part) + "\"\nposition_m = [0, 0, 0]\n";
    write_text(folder.file("case.toml"), text);
    compile_in(folder, "case");
    const ProgramResult result = run_program(
        kSimulator, "plan " + at(folder, "case.rtscene") +
                        " --stage all --seconds 2 --shorten-millions 50 -o " + at(folder, "plans"));
    CAPTURE(result.out);
    CAPTURE(result.err);
    CHECK(result.exit_code == 1);
    CHECK(has(result.out, "stage 2, 'block': no plan found"));
  }

  TEST_CASE("a chain is not taken apart: its links are named, and what holds them") {
    const ScratchFolder folder("stages");
    write_chain(folder);
    compile_in(folder, "chain");
    const ProgramResult result =
        run_program(kSimulator, "plan " + at(folder, "chain.rtscene") + " --order --seconds 4 -o " +
                                    at(folder, "out"));
    CAPTURE(result.out);
    CAPTURE(result.err);
    CHECK(result.exit_code == 1);
    CHECK(has(result.out, "taken out are 'brick'"));
    CHECK(has(result.out, "parts left: 'one', 'two'"));
    CHECK(has(result.out, "held by 'two'"));
    CHECK(has(result.out, "one part is moved at a time"));
    CHECK_FALSE(std::filesystem::exists(folder.file("out/assembly.toml")));
  }

  TEST_CASE("parts that overlap by rounding are moved apart, and by more are refused") {
    const ScratchFolder folder("stages");
    // A brick 0.2 um in the floor of a box of 0.1 m, then 2 um.
    for (const double depth_mm : {2e-4, 2e-2}) {
      write_boxes(folder.file("floor.obj"), {{{{-50, -50, -10}, {50, 50, 0}}}});
      write_boxes(folder.file("brick.obj"), {{{{-10, -10, -depth_mm}, {10, 10, 20}}}});
      write_text(folder.file("two.toml"),
                 kAssemblyHead + part_text("floor", "fixed") + part_text("brick", "hand"));
      compile_in(folder, "two");
      const ProgramResult result =
          run_program(kSimulator, "plan " + at(folder, "two.rtscene") +
                                      " --order --shorten-millions 50 -o " + at(folder, "out"));
      CAPTURE(result.out);
      CAPTURE(result.err);
      if (depth_mm < 1e-3) {
        CHECK(result.exit_code == 0);
        CHECK(has(result.out, "overlaps at its goal by rounding"));
      } else {
        CHECK(result.exit_code == 3);
        CHECK(has(result.err, "'brick' and 'floor' overlap where they are assembled"));
        // The depth that it names helps.
        const std::string named = "or [coupling] tolerance_m = ";
        const std::size_t at_depth = result.err.find(named);
        REQUIRE(at_depth != std::string::npos);
        const std::string counted = result.err.substr(at_depth + named.size(), 7);
        write_text(folder.file("counted.toml"), kAssemblyHead + part_text("floor", "fixed") +
                                                    part_text("brick", "hand") +
                                                    "[coupling]\ntolerance_m = " + counted + "\n");
        compile_in(folder, "counted");
        CHECK(run_program(kSimulator, "plan " + at(folder, "counted.rtscene") +
                                          " --order --shorten-millions 50 -o " +
                                          at(folder, "counted"))
                  .exit_code == 0);
      }
    }
  }

  TEST_CASE("parts given assembled are laid apart, though surfaces touch there") {
    const ScratchFolder folder("stages");
    write_case(folder);
    std::string text = text_of_file(folder.file("case.toml"));
    for (std::size_t k = text.find("scale_to_m"); k != std::string::npos;
         k = text.find("scale_to_m", k + 30))
      text.insert(k, "as = \"surface\"\n");
    write_text(folder.file("apart.toml"), text + "[bodies]\nassembled = true\n");
    compile_in(folder, "apart");
    const ProgramResult found = run_program(
        kSimulator, "plan " + at(folder, "apart.rtscene") +
                        " --order --shorten-millions 50 --json -o " + at(folder, "out"));
    CAPTURE(found.err);
    CAPTURE(found.out);
    REQUIRE(found.exit_code == 0);
    CHECK(order_of(StageJson::parse(found.out)) ==
          std::vector<std::string>{"block", "pin", "cover", "bar"});
    check_proved(folder.file("out/assembly.toml"), folder.file("out"));
    write_text(folder.file("both.toml"), text +
                                             "[bodies]\nassembled = true\n[[stage]]\n"
                                             "part = \"pin\"\nposition_m = [0, 0, 0]\n");
    CHECK_THROWS_AS((void)tools::read_scene_file(folder.file("both.toml")), tools::InputError);
  }

  TEST_CASE("stages are refused with their line and a fix") {
    const std::string place = "position_m = [0, 0, 0.02]\n";
    CHECK(refused_stage("[[stage]]\npart = \"peg\"\n" + place).empty());
    CHECK(has(refused_stage("[[stage]]\npart = \"peck\"\n" + place), "did you mean 'peg'?"));
    CHECK(has(refused_stage("[[stage]]\npart = \"peck\"\n" + place), "s.toml:17:"));
    CHECK(has(refused_stage("[[stage]]\npart = \"table\"\n" + place), "'table' is fixed"));
    CHECK(has(refused_stage("[[stage]]\npart = \"peg\"\n"), "position_m"));
    CHECK(has(refused_stage("[[stage]]\n" + place), "name the part"));
    const std::string good = "[[stage]]\npart = \"peg\"\n" + place;
    CHECK(has(refused_stage(good + good), "has a stage already, in line 17"));
    CHECK(has(refused_stage(good + "pull_n = 1\n"), "give plan too"));
    CHECK(has(refused_stage(good + "goal = 1\n"), "goal"));
  }

  TEST_CASE("a scene without stages says how to give some, and keeps its bytes") {
    const ScratchFolder folder("stages");
    write_chain(folder);
    compile_in(folder, "chain");
    const ProgramResult result = run_program(
        kSimulator, "plan " + at(folder, "chain.rtscene") + " --stage all -o " + at(folder, "out"));
    CHECK(result.exit_code == 3);
    CHECK(has(result.err, "has no stages; add [[stage]] tables"));
    const tools::SceneBytes bytes = tools::read_scene_bytes(folder.file("chain.rtscene"));
    SceneView view;
    REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
    for (const SectionEntry& s : view.sections()) CHECK(s.id != SectionId::kStages);
  }

  TEST_CASE("assemblies of public meshes: order found, proved, followed") {
    if (!std::filesystem::exists(std::filesystem::path(HAPTIC_SHARED_DIR) / "data")) {
      MESSAGE("skipped: no shared data");
      return;
    }
    const std::vector<std::vector<SharedPart>> assemblies{
        {{"square_peg", 0}, {"cube_in_cup", 0.12}, {"prism_stack", 0.24}},
        {{"octagon_peg", 0}, {"rect_peg_16mm", 0.1}, {"ell_fixture", 0.25}},
        {{"corner_bracket", 0}},
        {{"plug_socket", 0}}};
    for (const std::vector<SharedPart>& assembly : assemblies) {
      const ScratchFolder folder("stages");
      CAPTURE(assembly.front().task);
      write_text(folder.file("shared.toml"), shared_text(assembly));
      compile_in(folder, "shared");
      const ProgramResult found = run_program(
          kSimulator, "plan " + at(folder, "shared.rtscene") +
                          " --order --shorten-millions 50 --json -o " + at(folder, "out"));
      CAPTURE(found.err);
      CAPTURE(found.out);
      REQUIRE(found.exit_code == 0);
      CHECK(order_of(StageJson::parse(found.out)).size() == assembly.size());
      check_proved(folder.file("out/assembly.toml"), folder.file("out"));
      check_sitting(folder.file("out/assembly.rtscene"));
    }
  }
}
