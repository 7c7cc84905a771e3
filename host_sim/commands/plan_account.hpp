// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Words in which `host_sim plan` tells of a search: lengths, planes, progress and failure.

#include <string>

#include "rt_core/scene/scene_view.hpp"
#include "tools/plan/plan.hpp"
#include "tools/plan/search/plan_search.hpp"
#include "tools/plan/search/plan_shortening.hpp"

namespace haptic::sim {

/// "0.3 mm", "12 um".
[[nodiscard]] std::string millimetres_or_less(double length_m);
/// As --goal takes it.
[[nodiscard]] std::string pose_as_option(const Pose& pose);
/// "a face of the moving piece".
[[nodiscard]] const char* kind_text(ContactType type);
[[nodiscard]] std::string plane_text(const SceneView& view, PairIndex index,
                                     const std::string& kind, const tools::Vec3d& normal_w);
/// "pieces 0 and 3, a face of the fixed piece, normal (0, 0, 1)".
[[nodiscard]] std::string plane_text(const SceneView& view, const tools::HoldingPlane& plane);

/// Why a plan is not written, where it has more than its file holds; empty: it is.
[[nodiscard]] std::string too_large(const tools::Plan& plan);

/// About once a second, on standard error.
void say_progress(const tools::SearchState& state);
/// Says about once a second how far the shortening is.
[[nodiscard]] tools::ShorteningProgress say_shortening(const tools::ShorteningLimits& limits);

/// How far a search without a plan has got, and what holds the part. `turned`: the goal is turned
/// against the start.
void say_failure(const SceneView& view, const tools::SlidingPart& part,
                 const tools::SearchResult& result, bool turned);

}  // namespace haptic::sim
