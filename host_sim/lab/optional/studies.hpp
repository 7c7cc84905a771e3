// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Whether this build has the studies of the laboratory (lab/studies, HAPTIC_BUILD_STUDIES), and
/// what is said where it has not.

namespace haptic::sim {

[[nodiscard]] bool studies_built();

/// Follows the name of what was asked for.
inline constexpr const char* kStudiesLeftOut =
    " is one of the studies, which this build leaves out; to get them: cmake --preset release "
    "-DHAPTIC_BUILD_STUDIES=ON && cmake --build --preset release --target host_lab";

}  // namespace haptic::sim
