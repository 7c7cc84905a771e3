// SPDX-License-Identifier: Apache-2.0
#include "rt_core/safety/safety_limits.hpp"

namespace haptic {

SafetyLimits usable(const SafetyLimits& limits) noexcept { return limits; }

}  // namespace haptic
