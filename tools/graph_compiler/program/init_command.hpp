// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace haptic::tools {

/// graph_compiler init MOVING FIXED.. -o SCENE.toml. `argv[0]` is "init". @return the exit code.
[[nodiscard]] int run_init(int argc, const char* const* argv);

}  // namespace haptic::tools
