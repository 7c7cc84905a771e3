// SPDX-License-Identifier: Apache-2.0
// Group plan: a scene and two poses to a plan file, by the same steps as `host_sim plan`.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "tools/c_space/pose_text.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/library/call.hpp"
#include "tools/plan/search/plan_ends.hpp"
#include "tools/plan/search/plan_making.hpp"
#include "tools/plan/search/translation_plan.hpp"

using namespace haptic;
using namespace haptic::tools;

struct haptic_planned {
  std::uint64_t magic;
  std::string file;           ///< empty: there is no plan
  std::vector<double> poses;  ///< 7 for each corner, of A's mesh frame in W
  haptic_plan_facts facts;
};

namespace {

constexpr std::uint64_t kPlannedMagic = 0x706c616e6e656400;

int check_handle(const haptic_planned* planned) noexcept {
  if (planned == nullptr) return HAPTIC_ERROR_NULL;
  return planned->magic == kPlannedMagic ? HAPTIC_OK : HAPTIC_ERROR_HANDLE;
}

int check_input(const haptic_plan_input* input) noexcept {
  if (const int error = check_structure(input); error != HAPTIC_OK) return error;
  if (!is_within(input->seconds, 1e-3, 1e9)) return HAPTIC_ERROR_NUMBER;
  const bool poses =
      is_pose(input->goal_pose) && (input->has_start == 0 || is_pose(input->start_pose));
  return poses ? HAPTIC_OK : HAPTIC_ERROR_POSE;
}

void say(haptic_planned& out, const std::string& text) {
  const std::size_t bytes = std::min(text.size(), sizeof out.facts.text - 1);
  std::copy_n(text.data(), bytes, out.facts.text);
  out.facts.text[bytes] = '\0';
}

Pose unit_pose(const double* numbers) {
  Pose pose = pose_of_numbers(numbers);
  pose.q_wa.normalize();
  return pose;
}

/// The scene of the caller in memory of its own.
struct OpenScene {
  OpenScene(const void* scene, std::size_t bytes)
      : copy(std::span(static_cast<const std::byte*>(scene), bytes)),
        status(SceneView::open(copy.span(), view)) {}

  SceneBytes copy;
  SceneView view;
  RtStatus status;
};

/// What is searched in, from where, to where.
struct Task {
  const SceneView& view;
  SlidingPart part{view};
  StepProver prover{view, plan_tolerance_m(view)};
};

/// The plan, written and proved again as its reader would.
int keep(Task& task, const Plan& plan, haptic_planned& out) {
  out.facts.steps = plan.steps();
  if (plan.poses.size() > kMostPlanPoses) {
    say(out, formatted("a motion was found, and its %zu steps are more than a plan file holds (%zu)"
                       "; ask for more shorten_work",
                       plan.steps(), kMostPlanPoses - 1));
    return HAPTIC_ERROR_LIMIT;
  }
  const ProvedText proved = proved_plan_text(task.view, plan, "the plan");
  out.facts.stations = plan.stations.size();
  out.facts.length_m = plan.stations.front().cost_to_go_m;
  out.facts.least_m = proved.proof.least_m;
  out.poses.resize(7 * plan.poses.size());
  for (std::size_t k = 0; k < plan.poses.size(); ++k)
    write_numbers(task.part.mesh_pose(plan.poses[k]), &out.poses[7 * k]);
  out.file = proved.text;
  say(out, formatted("%zu steps, each proved free; %zu stations, %.4g mm", plan.steps(),
                     plan.stations.size(), 1e3 * out.facts.length_m));
  return HAPTIC_OK;
}

int plan_into(const SceneView& view, const haptic_plan_input& input, haptic_planned& out) {
  Task task{view};
  AskedEnds asked;
  asked.goal_wa = unit_pose(input.goal_pose);
  asked.start_wa =
      input.has_start != 0 ? unit_pose(input.start_pose) : pose_from_text(view, "start", "start");
  const PlanEnds ends = checked_ends(view, task.part, task.prover, asked);
  ShorteningLimits shortening;
  shortening.work = input.shorten_work;
  shortening.seed = input.seed;
  if (view.is_locked() && !ends.turned) {
    const TranslationResult cells = plan_translation(view, task.prover, asked.start_wa, ends.start,
                                                     ends.goal, plan_tolerance_m(view));
    out.facts.search_s = cells.seconds;
    if (cells.verdict == TranslationVerdict::kFound) {
      const CorneredMotion motion =
          shortened(cells.motion, task.prover, task.part.radius_m(), shortening);
      return keep(task, plan_from(view, task.part, task.prover, motion, input.seed), out);
    }
    if (cells.verdict == TranslationVerdict::kImpossible) {
      say(out, std::string("no translation leads from the start to the goal: the ") +
                   (cells.goal_is_enclosed ? "goal" : "start") +
                   " is shut in; `host_sim plan` names the C-faces about it");
      return HAPTIC_ERROR_NO_PLAN;
    }
  }
  SearchLimits search;
  search.seconds = input.seconds;
  search.seed = input.seed;
  const MadePlan made = make_plan_between(view, task.part, task.prover, ends.start, ends.goal,
                                          search, shortening, [](const SearchState&) {});
  out.facts.search_s = made.search.state.seconds;
  if (made.search.found) return keep(task, made.plan, out);
  out.facts.nearest_m = made.search.state.nearest_m;
  say(out, formatted("no plan was found in %.3g s; poses reached from the start and from the goal "
                     "came as near as %.4g mm; give more seconds or another goal",
                     made.search.state.seconds, 1e3 * out.facts.nearest_m));
  return HAPTIC_ERROR_NO_PLAN;
}

}  // namespace

int haptic_plan(const void* scene, size_t scene_bytes, const haptic_plan_input* input,
                haptic_planned** planned) {
  if (planned == nullptr) return HAPTIC_ERROR_NULL;
  *planned = nullptr;
  if (scene == nullptr) return HAPTIC_ERROR_NULL;
  if (const int error = check_input(input); error != HAPTIC_OK) return error;
  return guarded([&] {
    const OpenScene open(scene, scene_bytes);
    if (open.status != RtStatus::kOk) return int{HAPTIC_ERROR_SCENE};
    auto out = std::make_unique<haptic_planned>();
    out->magic = kPlannedMagic;
    out->facts = HAPTIC_PLAN_FACTS_INIT;
    int error = HAPTIC_OK;
    try {
      error = plan_into(open.view, *input, *out);
    } catch (const LimitError& limit) {
      say(*out, limit.what());
      error = HAPTIC_ERROR_LIMIT;
    } catch (const InputError& wrong) {
      say(*out, wrong.what());
      error = HAPTIC_ERROR_INPUT;
    } catch (const UsageError& wrong) {
      say(*out, wrong.what());
      error = HAPTIC_ERROR_INPUT;
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception& fault) {
      say(*out, fault.what());
      error = HAPTIC_ERROR_INTERNAL;
    }
    *planned = out.release();
    return error;
  });
}

int haptic_planned_bytes(const haptic_planned* planned, const void** bytes, size_t* count) {
  if (bytes == nullptr || count == nullptr) return HAPTIC_ERROR_NULL;
  *bytes = nullptr;
  *count = 0;
  if (const int error = check_handle(planned); error != HAPTIC_OK) return error;
  if (planned->file.empty()) return HAPTIC_ERROR_SIZE;
  *bytes = planned->file.data();
  *count = planned->file.size();
  return HAPTIC_OK;
}

int haptic_planned_poses(const haptic_planned* planned, const double** poses, size_t* count) {
  if (poses == nullptr || count == nullptr) return HAPTIC_ERROR_NULL;
  *poses = nullptr;
  *count = 0;
  if (const int error = check_handle(planned); error != HAPTIC_OK) return error;
  if (planned->poses.empty()) return HAPTIC_ERROR_SIZE;
  *poses = planned->poses.data();
  *count = planned->poses.size() / 7;
  return HAPTIC_OK;
}

int haptic_planned_facts(const haptic_planned* planned, haptic_plan_facts* facts) {
  if (const int error = check_structure(facts); error != HAPTIC_OK) return error;
  *facts = HAPTIC_PLAN_FACTS_INIT;
  if (const int error = check_handle(planned); error != HAPTIC_OK) return error;
  *facts = planned->facts;
  return HAPTIC_OK;
}

int haptic_planned_free(haptic_planned** planned) {
  if (planned == nullptr) return HAPTIC_ERROR_NULL;
  if (*planned == nullptr) return HAPTIC_OK;
  if (const int error = check_handle(*planned); error != HAPTIC_OK) return error;
  (*planned)->magic = 0;
  delete *planned;
  *planned = nullptr;
  return HAPTIC_OK;
}
