// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The machine, for reports of time.

#include <string>

namespace haptic::sim {

/// Model name of the processor as the operating system tells it, "unknown processor" otherwise.
[[nodiscard]] std::string processor_name();

}  // namespace haptic::sim
