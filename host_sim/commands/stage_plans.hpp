// SPDX-License-Identifier: Apache-2.0
#pragma once
/// host_sim plan --stage and --order: plans of the stages of an assembly, and the order of one.

#include <cstdint>
#include <string>

#include "tools/plan/search/plan_shortening.hpp"

namespace haptic::sim {

/// Work on making the plan of a stage shorter, where --shorten-millions does not say.
inline constexpr std::uint64_t kStageShorteningWork = 600'000'000;

struct StageRequest {
  std::string scene, scene_file;
  std::string out;       ///< plan of one stage, or folder
  double seconds = 120;  ///< for the search of one stage; for the order in all
  tools::ShorteningLimits shortening;
  bool json = false;
};

/// Plans one stage, or "all". @return exit code: 1 where one has no proved plan, and the last line
/// says which.
[[nodiscard]] int plan_stages(const StageRequest& request, const std::string& which);

/// Finds the order of the assembly, and writes it as a scene file and a compiled scene with its
/// stages and their plans. @return exit code: 1 where there is none.
[[nodiscard]] int plan_order(const StageRequest& request);

}  // namespace haptic::sim
