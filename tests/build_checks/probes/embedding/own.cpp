// SPDX-License-Identifier: Apache-2.0
#include "rt_core/haptic_core.hpp"

int main() { return sizeof(haptic::StepResult) == 0; }
