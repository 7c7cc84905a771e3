// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A core in memory of the caller, as the calls of the group find it there.

#include <array>
#include <atomic>
#include <cstdint>

#include "rt_core/hands.hpp"
#include "rt_core/haptic_core.hpp"
#include "tools/library/bodies.hpp"
#include "tools/library/contact_shares.hpp"
#include "tools/library/handle_call.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {

/// A scene whose parts are held, by one hand or two, has this.
struct alignas(kStateAlignment) PartsOfCore {
  PartScenes scenes;
  Hands hands;
  std::array<FrameRecord, kMostDriven> driven;  ///< the newest poses

  /// The first one.
  [[nodiscard]] PartHand& hand() noexcept { return hands.hand(0); }
  [[nodiscard]] const PartHand& hand() const noexcept { return hands.hand(0); }
};

/// Known to a core besides the state of the tick.
struct CoreCounts {
  std::uint64_t ticks = 0;
  std::int64_t last_ns = 0;       ///< time of the last step
  std::uint64_t is_felt = 0;      ///< the last step had a wrench
  std::uint64_t was_refused = 0;  ///< and its pose was
};

}  // namespace haptic::tools

/// At the begin of the caller's memory. What follows: of a scene of one moving part the core's
/// state; else PartsOfCore and the two rooms of its hand.
struct alignas(haptic::kStateAlignment) haptic_core {
  std::atomic<std::uint64_t> magic{0};
  std::atomic<bool> busy{false};
  haptic::SceneView view;
  haptic::tools::PartsOfCore* parts = nullptr;  ///< null: the scene has one moving part
  haptic::HapticCore* core = nullptr;           ///< null: the scene has parts
  haptic::tools::HeldNow held;
  haptic::tools::CoreCounts counts;
  haptic::tools::SessionJudge judge, second_judge;  ///< by hand
  haptic::tools::FeltTick last;                     ///< the last step

  static constexpr std::uint64_t kOpenMagic = 0x636f72656f70656e;
  static constexpr std::uint64_t kClosedMagic = 0x73687574636f7265;
};

namespace haptic::tools {
using CoreCall = HandleCall<haptic_core>;
}  // namespace haptic::tools
