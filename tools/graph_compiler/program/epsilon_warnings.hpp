// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Says where epsilon, the width of the near set, is larger than the features of a part: the search
/// stays exact, but has to look at far more.

#include <string>
#include <vector>

#include "tools/graph_compiler/program/compile_scene.hpp"

namespace haptic::tools {

/// At most two sentences per part, about its worst piece: a face narrower than epsilon across an
/// edge, a vertex that stands less than epsilon over its neighbors. Empty in the ordinary case.
std::vector<std::string> epsilon_warnings(const CompiledScene& compiled);

}  // namespace haptic::tools
