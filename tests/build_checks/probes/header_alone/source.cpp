// SPDX-License-Identifier: Apache-2.0
#include <cstdint>

#include "tests/build_checks/probes/header_alone/needs_its_neighbour.hpp"

std::uint32_t four() { return twice(2); }
