// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The frame of every offline program: exceptions become one line on stderr and an exit code.

#include <functional>

namespace haptic::tools {

/// Runs `body` and returns its exit code; UsageError gives kExitUsage, InputError kExitBadInput,
/// exhausted memory and what the operating system refuses kExitDeviceOrOs, any other
/// exception (a defect of the program) kExitCheckFailed. The line starts with `program`.
int run_main(const char* program, const std::function<int()>& body);

}  // namespace haptic::tools
