// SPDX-License-Identifier: Apache-2.0
#include "host_sim/touching/way_in.hpp"

#include <optional>

#include "host_sim/touching/touch_search.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/plan/search/inside_surface.hpp"
#include "tools/plan/search/plan_making.hpp"
#include "tools/plan/search/translation_plan.hpp"

namespace haptic::sim {
namespace {

/// Most pairs of a scene in which a way in is looked for: a step of a proof looks at all that are
/// near.
constexpr std::uint64_t kMostPairs = 4'000'000;

/// True if the straight way is proved free, within `seconds`.
bool is_straight(tools::StepProver& prover, const tools::PlanPose& start,
                 const tools::PlanPose& goal, double seconds) {
  constexpr int kParts = 32, kHalvings = 7;
  const double end_s = tools::wall_clock_s() + seconds;
  for (int k = 0; k < kParts; ++k) {
    const auto at = [&](int part) { return tools::between(start, goal, part / double{kParts}); };
    if (tools::wall_clock_s() > end_s || !prover.prove(at(k), at(k + 1), kHalvings)) return false;
  }
  return true;
}

std::vector<tools::PlanPose> way_of_guide(const SceneView& view) {
  if (view.guide_stations().empty()) return {};
  const HeldPart at_start = held_at_start(view);
  std::vector<tools::PlanPose> corners{tools::plan_pose(at_start.grip_w, at_start.q_wa)};
  for (const GuideStation& station : view.guide_stations()) {
    const Real *const x = station.x0_m, *const q = station.q_wa_xyzw;
    corners.push_back(tools::plan_pose(Vec3(x[0], x[1], x[2]).cast<double>(),
                                       Quat(q[3], q[0], q[1], q[2]).cast<double>()));
  }
  return corners;
}

/// True if fixed parts are near on both sides along an axis of W.
bool is_held_between(CoreSession& session, const HeldPart& held) {
  for (int axis = 0; axis < 3; ++axis) {
    const Vector along = Vector::Unit(axis);
    if (way_to_touch(session, held, along, 0.5 * held.radius_m).length_m &&
        way_to_touch(session, held, -along, 0.5 * held.radius_m).length_m)
      return true;
  }
  return false;
}

/// The planner's way, or none.
std::optional<tools::CorneredMotion> planned(const SceneView& view, tools::SlidingPart& part,
                                             tools::StepProver& prover, const Pose& start_wa,
                                             const tools::PlanPose& start,
                                             const tools::PlanPose& goal, const WayInLimits& limits,
                                             const TouchProgress& progress) {
  if (view.is_locked()) {
    progress("looking for the way in by the cells of the free places");
    tools::TranslationResult cells =
        tools::plan_translation(view, prover, start_wa, start, goal, tools::plan_tolerance_m(view));
    if (cells.verdict == tools::TranslationVerdict::kFound) return std::move(cells.motion);
    if (cells.verdict == tools::TranslationVerdict::kImpossible) return std::nullopt;
  }
  tools::SearchLimits search;
  search.seconds = limits.seconds;
  tools::SearchResult found = tools::search_plan(
      view, part, prover, start, goal, search, [&](const tools::SearchState& state) {
        progress(tools::formatted("looking for the way in, %.0f s of at most %.3g", state.seconds,
                                  limits.seconds));
      });
  if (!found.found) return std::nullopt;
  tools::ShorteningLimits shortening;
  shortening.work = limits.shortening;
  return tools::shortened(found.motion, prover, part.radius_m(), shortening);
}

WayIn way_to_drawn_place(CoreSession& session, const WayInLimits& limits,
                         const TouchProgress& progress) {
  const SceneView& view = session.view();
  if (view.pair_count() > kMostPairs) return {};
  tools::SlidingPart part(view);
  tools::StepProver prover(view, tools::plan_tolerance_m(view));
  const HeldPart at_start = held_at_start(view);
  const tools::PlanPose start = tools::plan_pose(at_start.grip_w, at_start.q_wa);
  const tools::PlanPose goal = part.grip_pose(Pose{});
  const bool turned = tools::turn_between(start, goal).norm() > 0;
  if (tools::step_length_m(start, goal, part.radius_m()) < 1e-3 * part.radius_m()) return {};
  if (view.is_locked() && turned) return {};
  if (!prover.is_free(goal) || !prover.is_free(start)) return {};
  if (!is_held_between(session, held_at(view, goal))) return {};
  if (tools::enclosing_body(view, goal) || tools::enclosing_body(view, start)) return {};
  if (is_straight(prover, start, goal, limits.seconds)) return {{start, goal}, {}};
  const std::optional<tools::CorneredMotion> motion =
      planned(view, part, prover, at_start.mesh_pose(), start, goal, limits, progress);
  if (motion) return {motion->corners, {}};
  return {{},
          tools::formatted("no way to where the files have the part was found in %.3g s",
                           limits.seconds)};
}

}  // namespace

WayIn find_way_in(CoreSession& session, const WayInLimits& limits, const TouchProgress& progress) {
  WayIn way;
  way.corners = way_of_guide(session.view());
  if (way.corners.size() > 1) return way;
  try {
    return way_to_drawn_place(session, limits, progress);
  } catch (const tools::InputError& error) {
    return {{}, std::string("no way in was looked for: ") + error.what()};
  }
}

}  // namespace haptic::sim
