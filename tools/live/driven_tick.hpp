// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A driven part after a tick, or the part of a second hand, as viewers get it.

#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "rt_core/bodies/driven_parts.hpp"
#include "rt_core/tick/step.hpp"
#include "tools/verdict/tick_record.hpp"

namespace haptic::tools {

/// Trivially copyable, doubles alone: messages to pages hold it as it is.
struct DrivenTick {
  PoseNumbers commanded_wa,
      felt_wa;                    ///< of its mesh frame in W: where its owner has it, where it is
  double lag_m = 0, lag_rad = 0;  ///< between the two, at its middle
  double push_n[3] = {0, 0, 0};   ///< by what it touches, W axes
  double push_nm[3] = {0, 0, 0};  ///< about its mesh frame's origin, W axes
};
inline constexpr std::size_t kDrivenTickNumbers = 22;
static_assert(sizeof(DrivenTick) == 8 * kDrivenTickNumbers &&
              std::is_trivially_copyable_v<DrivenTick>);

[[nodiscard]] DrivenTick driven_tick(const DrivenState& state);
/// The part of a second hand, with what that felt: commanded where the hand leads it, pushed by
/// what the hand feels, about its grip point.
[[nodiscard]] DrivenTick driven_tick(const StepResult& result);

}  // namespace haptic::tools
