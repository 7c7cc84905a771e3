// SPDX-License-Identifier: Apache-2.0
#include "tools/verdict/flag_names.hpp"

#include <iterator>

namespace haptic::tools {

const char* flag_name(std::size_t bit) {
  constexpr const char* kNames[] = {
      "first_tick",     "relocalised", "far_band",       "verdict_touching", "verdict_undecided",
      "near_set_cut",   "inexact",     "budget_used_up", "motion_exceeded",  "several_planes",
      "bad_pose",       "recovery",    "saturated",      "clutched",         "proxy_limited",
      "proxy_stuck",    "hooked",      "passivity",      "ramping",          "outside_envelope",
      "behind",         "list_full",   "held",           "driven_behind",    "driven_lost",
      "local_set_empty"};
  static_assert(std::size(kNames) == kFlagCount);
  return bit < std::size(kNames) ? kNames[bit] : "unknown";
}

std::vector<std::string> flag_names(std::uint32_t flags) {
  std::vector<std::string> names;
  for (std::size_t bit = 0; bit < kFlagCount; ++bit) {
    if ((flags >> bit & 1u) != 0) names.emplace_back(flag_name(bit));
  }
  return names;
}

}  // namespace haptic::tools
