// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The length of a vector of the core, for comparison in double.

#include "rt_core/base/scalar.hpp"

namespace haptic::test {

[[nodiscard]] inline double norm(const Vec3& v) { return static_cast<double>(v.norm()); }

}  // namespace haptic::test
