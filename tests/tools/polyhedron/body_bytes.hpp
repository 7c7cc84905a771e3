// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Every bit of a body as text, to compare runs, compilers and arithmetic back ends.

#include <string>

#include "tools/graph_compiler/graph/convex_piece.hpp"

namespace haptic::tools::test {

/// Doubles in hexadecimal, indices in decimal, one element per line.
std::string body_text(const Body& body);

}  // namespace haptic::tools::test
