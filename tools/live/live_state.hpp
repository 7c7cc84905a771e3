// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A tick as the viewers of a session get it.

#include <array>
#include <cstdint>

#include "tools/live/driven_tick.hpp"
#include "tools/verdict/tick_record.hpp"

namespace haptic::tools {

/// The newest tick in the words of the core that ran it, as the page gets it: its layout is stated
/// by the page's module (host_sim/view/wasm/view_core.hpp). Without gaps.
struct LiveState {
  TickRecord record;          ///< proxy_wa: the device's where not known
  double hand_stamp = 0;      ///< of the hand's order that this tick followed
  std::uint32_t is_over = 0;  ///< no further tick comes
  std::uint32_t knows_felt = 1;
  std::uint64_t driven_count = 0;                ///< movers of the session that are known
  std::array<DrivenTick, kMostDriven> driven{};  ///< movers (tools/common/movers.hpp)
};
static_assert(sizeof(LiveState) == sizeof(TickRecord) + 24 + kMostDriven * sizeof(DrivenTick));

}  // namespace haptic::tools
