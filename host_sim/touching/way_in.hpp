// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The way into the place that a part is made for, where a scene has one: the goal of the scene's
/// guide, or the place that the mesh files were drawn in.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host_sim/session/core_session.hpp"
#include "tools/plan/search/pose_algebra.hpp"

namespace haptic::sim {

struct WayInLimits {
  double seconds = 20;                     ///< of the search for a way that is not straight
  std::uint64_t shortening = 200'000'000;  ///< ShorteningLimits::work
};

/// Called about once a second with what is being done: "looking for the way in, 3 s".
using TouchProgress = std::function<void(const std::string&)>;

struct WayIn {
  /// Poses of the grip point from the scene's start to the goal, at least two, joined by straight
  /// ways: those of the planner are proved free, those between the stations of a guide are not.
  /// Empty: there is no such place, or no way to it was found.
  std::vector<tools::PlanPose> corners;
  /// Such a place is there, and no way to it was found: a sentence.
  std::string not_found;
};

/// What looks for a way in: find_way_in, or what stands for it in a program without the planner.
using WayInSearch = std::function<WayIn(CoreSession&, const WayInLimits&, const TouchProgress&)>;

/// A scene with a guide: the way of its plan. Another one: the goal is the pose of the mesh file,
/// where that is free, not the start, and fixed parts are near on two sides of it; the way is
/// straight, or what the planner finds (host_sim plan). Of scenes of more than 4 million pairs
/// none. Leaves the core reset. Cost: a few thousand ticks; a search up to its limits.
[[nodiscard]] WayIn find_way_in(CoreSession& session, const WayInLimits& limits,
                                const TouchProgress& progress);

}  // namespace haptic::sim
