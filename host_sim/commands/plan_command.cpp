// SPDX-License-Identifier: Apache-2.0
// host_sim plan SCENE.rtscene --goal POSE -o PLAN
#include <cstdio>
#include <memory>
#include <string>

#include "host_sim/commands/commands.hpp"
#include "host_sim/plan/plan_making.hpp"
#include "host_sim/report/part_report.hpp"
#include "tools/c_space/pose_text.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"
#include "tools/common/formatted.hpp"
#include "tools/plan/plan_check.hpp"

namespace haptic::sim {
namespace {

struct PlanArguments {
  std::string scene, start = "start", goal, out;
  double seconds = 120, shorten_s = 30;
  std::uint64_t seed = 1;
};

std::string pose_as_option(const Pose& pose) {
  std::string text;
  for (int k = 0; k < 3; ++k)
    text += tools::short_number(static_cast<double>(pose.p_wa[k]), 6) + ",";
  const Quat& q = pose.q_wa;
  for (const Real x : {q.w(), q.x(), q.y()})
    text += tools::short_number(static_cast<double>(x), 9) + ",";
  return text + tools::short_number(static_cast<double>(q.z()), 9);
}

/// "pieces 0 and 3, face of B along (0, 0, 1)".
std::string plane_text(const SceneView& view, const HoldingPlane& plane) {
  const PairRecord pair = view.pair_record(plane.pair);
  const char* const kind = plane.type == ContactType::kA   ? "a face of the moving piece"
                           : plane.type == ContactType::kB ? "a face of the fixed piece"
                                                           : "two edges";
  return tools::formatted("pieces %u and %u, %s, normal (%.3f, %.3f, %.3f)", pair.piece_a,
                          pair.piece_b, kind, plane.normal_w.x(), plane.normal_w.y(),
                          plane.normal_w.z());
}

void require_free(StepProver& prover, const PlanPose& pose, const std::string& option) {
  if (prover.is_free(pose)) return;
  const StepProver::Blocked& pair = prover.blocked();
  throw tools::InputError(option + ": the part is not free there: pieces " +
                          std::to_string(pair.piece_a) + " and " + std::to_string(pair.piece_b) +
                          " overlap; give a pose outside of the obstacles");
}

void say_progress(const SearchState& state) {
  std::fprintf(stderr,
               "host_sim plan: %.0f s, %llu poses from the start and %llu from the goal, "
               "the trees are %.3g mm apart\n",
               state.seconds, static_cast<unsigned long long>(state.nodes_from_start),
               static_cast<unsigned long long>(state.nodes_from_goal), 1e3 * state.nearest_m);
}

void say_failure(const SceneView& view, const SlidingPart& part, const SearchResult& result) {
  std::printf("no plan found in %.0f s (%llu pushes, %llu ticks); got as far as this state:\n",
              result.state.seconds, static_cast<unsigned long long>(result.state.pushes),
              static_cast<unsigned long long>(result.state.ticks));
  std::printf("  from the start to %s\n",
              pose_as_option(part.mesh_pose(result.nearest_to_goal)).c_str());
  std::printf("  from the goal to  %s\n",
              pose_as_option(part.mesh_pose(result.nearest_to_start)).c_str());
  std::printf("  the nearest two poses are %.4g mm apart, a turn of 1 rad counted as %.4g mm\n",
              1e3 * result.state.nearest_m, 1e3 * part.radius_m());
  for (const HoldingPlane& plane : result.goal_held)
    std::printf("  pushed out of the goal it is held by %s\n", plane_text(view, plane).c_str());
}

void say_plan(const MadePlan& made, const tools::PlanProof& proof, const std::string& out) {
  const tools::Plan& plan = made.plan;
  const SearchState& search = made.search.state;
  std::printf("%s: %zu steps, %zu stations, %.4g mm (found %.4g mm)\n", out.c_str(),
              plan.steps.size(), plan.stations.size(), 1e3 * plan.stations.front().cost_to_go_m,
              1e3 * made.found_m);
  std::printf("  search    %.2f s, %llu pushes, %llu ticks of the core\n", search.seconds,
              static_cast<unsigned long long>(search.pushes),
              static_cast<unsigned long long>(search.ticks));
  std::printf("  shortened %.2f s\n", made.shorten_s);
  std::printf("  certified %llu of %llu steps (%.4g %%), by %llu planes; least distance %.3g um\n",
              static_cast<unsigned long long>(proof.certified),
              static_cast<unsigned long long>(proof.steps),
              100.0 * static_cast<double>(proof.certified) / static_cast<double>(proof.steps),
              static_cast<unsigned long long>(proof.planes), 1e6 * proof.least_m);
}

int do_plan(const PlanArguments& o) {
  const tools::SceneBytes bytes = tools::read_scene_bytes(o.scene);
  const CoreSession session(bytes.span(), o.scene, GoalContact::kLeftOut);  // checks the scene
  const SceneView& view = session.view();
  tools::claim_output(o.out, "--out");
  SlidingPart part(view);
  const PlanPose start = part.grip_pose(tools::pose_from_text(view, "--start", o.start));
  const PlanPose goal = part.grip_pose(tools::pose_from_text(view, "--goal", o.goal));
  StepProver prover(view, plan_tolerance_m(view));
  require_free(prover, start, "--start");
  require_free(prover, goal, "--goal");
  if (tools::step_length_m(start, goal, part.radius_m()) < 1e-9 * part.radius_m())
    throw tools::UsageError("--goal: is the start; give another pose");

  SearchLimits limits;
  limits.seconds = o.seconds;
  limits.seed = o.seed;
  ShorteningLimits shortening;
  shortening.seconds = o.shorten_s;
  shortening.seed = o.seed;
  const MadePlan made =
      make_plan_between(view, part, prover, start, goal, limits, shortening, say_progress);
  if (!made.search.found) {
    say_failure(view, part, made.search);
    return tools::kExitCheckFailed;
  }
  // The file as it will be read, so that no plan is written that its reader would not prove.
  const std::string text = tools::plan_as_text(made.plan);
  const tools::PlanProof proof = tools::prove_plan(view, tools::parse_plan(text, o.out), o.out);
  if (!proof.holds()) throw std::runtime_error("the plan is not proved: " + proof.failure);
  write_whole_file(o.out, text);
  say_plan(made, proof, o.out);
  return tools::kExitDone;
}

}  // namespace

Command add_plan_command(CLI::App& program) {
  const auto o = std::make_shared<PlanArguments>();
  CLI::App* app = program.add_subcommand(
      "plan", "Finds a motion of the moving part to a pose, and proves every step of it free.");
  app->add_option("scene,--scene", o->scene, "compiled scene (.rtscene)")->required();
  app->add_option("--goal", o->goal,
                  "where the part is to go: x,y,z[,qw,qx,qy,qz] of its file frame [m, or 5mm]")
      ->required();
  app->add_option("--start", o->start,
                  "where it begins, written alike; default: the scene's start");
  app->add_option("-o,--out", o->out, "plan to write")->required();
  app->add_option("--seconds", o->seconds, "time for the search (default 120)")
      ->check(tools::positive_number());
  app->add_option("--shorten-seconds", o->shorten_s,
                  "time for making the plan shorter (default 30)")
      ->check(tools::number_not_negative());
  app->add_option("--seed", o->seed,
                  "of the random pushes (default 1); the same seed gives the same plan");
  return {app, [o] { return do_plan(*o); },
          "host_sim plan peg.rtscene --goal 0,0,-40mm,1,0,0,0 -o peg.plan"};
}

}  // namespace haptic::sim
