// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The part among others that move too: what a law of all of them says of it, in place of the
/// part's own.

#include <cstdint>

#include "rt_core/base/pose.hpp"
#include "rt_core/proxy/felt_contact.hpp"
#include "rt_core/proxy/proxy_parts.hpp"

namespace haptic {

class Proxy;

/// After a tick of that law. Owner: the servo thread.
struct SharedMotion {
  ProxyTick told;    ///< of the part alone, but for the work
  GripPose pose;     ///< of the part
  FeltContact felt;  ///< planes that hold it; those of another that moves by kMovingPlanes
  Real held_m = 0;   ///< of the pull's length, what the planes of the last program hold
  /// Energy of its spring from the others, less what it gave, since whoever renders it has set it
  /// to 0.
  double given_j = 0;
  bool started = false;  ///< false: the next tick is a first one, and the part begins at its goal
  std::uint32_t flags = 0;         ///< StepFlag, of this tick
  Proxy* over_standing = nullptr;  ///< contacts with all that stands; null: nothing does
};

}  // namespace haptic
