// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Whether this build has the studies of the laboratory (lab/studies, HAPTIC_BUILD_STUDIES), and
/// what is said where it has not.

#include <string>

#include "tools/common/left_out.hpp"

namespace haptic::sim {

[[nodiscard]] bool studies_built();

/// The command that builds a laboratory with them.
[[nodiscard]] inline std::string build_of_studies() {
  return tools::build_command("host_lab", "-DHAPTIC_BUILD_STUDIES=ON");
}

/// tools::left_out_text of a study.
[[nodiscard]] inline std::string study_left_out(const std::string& what) {
  return tools::left_out_text(what, build_of_studies());
}

}  // namespace haptic::sim
