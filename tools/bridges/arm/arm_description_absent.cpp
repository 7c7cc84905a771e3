// SPDX-License-Identifier: Apache-2.0
/// Stands in for the reader of robot descriptions in a build without tinyxml2.
#include "tools/bridges/arm/arm_description.hpp"
#include "tools/common/error.hpp"

namespace haptic::tools {

bool can_read_arms() { return false; }

ArmDescription arm_of(const std::string&, const std::string& file, const std::string&,
                      const std::string&) {
  throw InputError(file +
                   ": this build reads no robot descriptions; install libtinyxml2-dev, "
                   "configure and build again");
}

ArmDescription read_arm(const std::filesystem::path& urdf, const std::string& base,
                        const std::string& tip) {
  return arm_of({}, urdf.string(), base, tip);
}

}  // namespace haptic::tools
