// SPDX-License-Identifier: Apache-2.0
// host_lab plan-sampled SCENE.rtscene --goal POSE -o PLAN [--start POSE] [--seconds S] [--seed N]
#include <cstdio>
#include <memory>
#include <string>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/planning/sampled_plan.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/session/moving_parts.hpp"
#include "tools/c_space/pose_text.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"
#include "tools/plan/search/plan_ends.hpp"
#include "tools/plan/search/plan_making.hpp"

namespace haptic::sim {
namespace {

struct PlanSampledArguments {
  std::string scene, start = "start", goal, out;
  double seconds = 120;
  std::uint32_t seed = 1;
};

int do_plan_sampled(const PlanSampledArguments& o) {
  const tools::SceneBytes bytes = tools::read_scene_bytes(o.scene);
  const CoreSession session(bytes.span(), o.scene, GoalContact::kLeftOut);  // checks the scene
  require_one_moving_part(session, o.scene, "plan-sampled",
                          "give a scene in which the others are of role fixed");
  const SceneView& view = session.view();
  tools::claim_output(o.out, "--out", {tools::FileFormat::kPlan, {}});
  const tools::SlidingPart part(view);
  tools::StepProver prover(view, tools::plan_tolerance_m(view));
  const tools::PlanEnds ends =
      tools::checked_ends(view, part, prover,
                          {tools::pose_from_text(view, "--start", o.start),
                           tools::pose_from_text(view, "--goal", o.goal), "--start", "--goal"});
  if (sampling_planners().empty()) {
    std::printf(
        "no plan: this program was built without OMPL; install libompl-dev and build it "
        "again\n");
    return tools::kExitCheckFailed;
  }
  const auto found =
      sampled_plan(view, ends.start, ends.goal, o.seconds, o.seed, [](const std::string& planner) {
        std::fprintf(stderr, "host_lab plan-sampled: %s\n", planner.c_str());
      });
  if (!found) {
    std::printf(
        "no plan found by OMPL's planners in %.4g s each; that is no proof that there is "
        "none\n",
        o.seconds);
    return tools::kExitCheckFailed;
  }
  const tools::PlanProof proof = tools::write_proved_plan(view, found->plan, o.out);
  std::printf("%s: %zu steps, %zu stations, %.4g mm\n  %s, %.2f s; certified %llu of %llu steps\n",
              o.out.c_str(), found->plan.steps(), found->plan.stations.size(),
              1e3 * found->plan.stations.front().cost_to_go_m, found->planner.c_str(),
              found->seconds, static_cast<unsigned long long>(proof.certified),
              static_cast<unsigned long long>(proof.steps));
  return tools::kExitDone;
}

}  // namespace

Command add_plan_sampled_command(CLI::App& program) {
  const auto o = std::make_shared<PlanSampledArguments>();
  CLI::App* app = program.add_subcommand(
      "plan-sampled", "Finds a plan by OMPL's planners, where they are built in.");
  app->add_option("scene,--scene", o->scene, "compiled scene (.rtscene)")->required();
  app->add_option("--goal", o->goal,
                  "where the part is to go: x,y,z[,qw,qx,qy,qz] of its file frame [m, or 5mm]")
      ->required();
  app->add_option("--start", o->start,
                  "where it begins, written alike; default: the scene's start");
  app->add_option("-o,--out", o->out, "plan to write")->required();
  app->add_option("--seconds", o->seconds, "of a processor, for each planner (default 120)")
      ->check(tools::positive_number());
  app->add_option("--seed", o->seed, "of the planners (default 1)");
  return {app, [o] { return do_plan_sampled(*o); },
          "host_sim plan-sampled peg.rtscene --goal 0,0,-40mm,1,0,0,0 -o peg.plan"};
}

}  // namespace haptic::sim
