// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/moving_parts.hpp"

#include "tools/common/error.hpp"
#include "tools/common/movers.hpp"

namespace haptic::sim {
namespace {

const char* role_words(PartRole role) {
  if (role == PartRole::kDriven) return "is driven";
  return role == PartRole::kLoose ? "is loose" : "is in the second hand";
}

}  // namespace

std::string parts_that_move_too(const CoreSession& session) {
  std::string text;
  const PartScenes* const parts = session.parts();
  if (parts == nullptr) return text;
  for (std::uint32_t mover = 0; mover < tools::mover_count(*parts); ++mover) {
    const std::uint32_t part = tools::part_of_mover(*parts, mover);
    text += text.empty() ? "part '" : ", part '";
    text += std::string(parts->name(part)) + "' " + role_words((*parts)[part].role);
  }
  return text;
}

void require_one_moving_part(const CoreSession& session, const std::string& scene,
                             const std::string& what, const std::string& fix) {
  const std::string others = parts_that_move_too(session);
  if (others.empty()) return;
  throw tools::InputError(scene + ": " + what + " is for one part among bodies that stand, and " +
                          others + "; " + fix);
}

}  // namespace haptic::sim
