// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/optional/studies.hpp"

bool haptic::sim::studies_built() { return true; }
