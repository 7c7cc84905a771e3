// SPDX-License-Identifier: Apache-2.0
#pragma once
/// How far the core may be from the golden vectors.

#include <string>

#include "host_sim/oracle/wide.hpp"

namespace haptic::sim {

/// Shares of the size of the bodies (the larger diameter). With s the size, l the lever (the larger
/// of s and A's reach from its origin) and D the depth:
///   depth   depth * s
///   force   k_F * max(relative * |D|, force * s)
///   torque  k_F * l * max(relative * |D|, torque * s)
///   SCP     depth * s + relative * |D|
///   normal  max(relative, twice the tolerance of the force / |force|)
struct GoldenTolerance {
  Wide depth = 0, force = 0, torque = 0, relative = 0;
  /// In place of `relative` for the weighted contact region.
  Wide weighted = 0;
};

/// In double precision 1e-12, and 1e-10 where coordinates exceed 100 sizes (`far_away`), with 1e-9
/// relative (weighted region: 1e-5 far away). In single precision a row of a table per family,
/// about four times the measured error; families without a row get 1e-6 (2e-2 far away); `relative`
/// is 0.
[[nodiscard]] GoldenTolerance golden_tolerance(const std::string& family, bool far_away);

}  // namespace haptic::sim
