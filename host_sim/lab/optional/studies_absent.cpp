// SPDX-License-Identifier: Apache-2.0
// Built without HAPTIC_BUILD_STUDIES.
#include "host_sim/lab/optional/studies.hpp"

bool haptic::sim::studies_built() { return false; }
