// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Working memory of searches, lent from stage to stage within a tick.

#include <cstdint>

#include "rt_core/base/bounded_list.hpp"
#include "rt_core/tracking/near_set.hpp"

namespace haptic {

/// Working memory of searches for near sets; `near` also holds those of the search at the goal.
struct SearchRoom {
  NearScratch scratch;
  BoundedList<NearNode> near;
  BoundedList<std::uint32_t> contact_nodes;  ///< of them, those with their point in both features
};

}  // namespace haptic
