// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A folder for result files.

#include <string>

namespace haptic::sim {

/// Makes `path` where it does not exist. @throws tools::InputError  it cannot be made, or written.
void make_output_folder(const std::string& path);

}  // namespace haptic::sim
