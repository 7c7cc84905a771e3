// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A motion that touches, for a scene that comes without one: to the fixed parts, press, slide,
/// tilt, and back. It is played through the core before it is given out.

#include <string>
#include <vector>

#include "host_sim/session/motion_script.hpp"
#include "host_sim/session/replay.hpp"
#include "host_sim/touching/touch_search.hpp"
#include "host_sim/touching/way_in.hpp"

namespace haptic::sim {

/// How the hand moves. Its lengths go with the part and the stiffness.
struct TouchingScript {
  MotionScript script;
  std::vector<tools::PlanPose> way_in;  ///< WayIn::corners that it follows first; empty: none
  Vector along_w = Vector::Zero();      ///< unit: the straight way to the touch, and of the press
  double way_m = 0;                     ///< length of that way, to touch_step_m
  double press_m = 0, slide_m = 0;      ///< beyond the touch; to each side
  double tilt_rad = 0;
};

/// Least share of its ticks in which a motion that is made to touch does.
inline constexpr double kLeastTouchedShare = 0.01;

struct TouchingMotion {
  TouchingScript touching;
  std::vector<MotionSample> motion;
  ReplayResult played;      ///< of that motion, with a verdict that expects contact
  std::size_t tried = 0;    ///< straight ways on which a touch was looked for
  std::string no_way_in;    ///< WayIn::not_found
  std::string not_touched;  ///< why there is no motion, with what helps; empty: there is one
};

struct TouchingOptions {
  WayInSearch find_way_in;  ///< empty: no way in is looked for
  WayInLimits way_in;
  TouchProgress progress;    ///< may be empty
  bool shows_ticks = false;  ///< of the motions that are played: ReplayOptions::progress
};

/// Tries, until the played motion touches in kLeastTouchedShare of its ticks: the way in of the
/// scene (way_in.hpp) and on until the part touches; the axes of W on which it touches, the soonest
/// one first; the ways to the nearest places of the fixed parts. A straight way is at most 2 m
/// long, or as long as the scene is large, and leads to no place farther than 10 m from the origin,
/// which no player takes. Leaves the core reset. Cost: some thousand ticks for each way, and those
/// of each motion that is played.
[[nodiscard]] TouchingMotion touching_motion(CoreSession& session,
                                             const TouchingOptions& options = {});

/// "-z", "+x", or three numbers.
[[nodiscard]] std::string way_text(const Vector& along_w);

}  // namespace haptic::sim
