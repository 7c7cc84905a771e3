// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_facts/parts_text.hpp"

#include <algorithm>

#include "tools/common/formatted.hpp"
#include "tools/scene_facts/facts_text.hpp"

namespace haptic::tools {
namespace {

constexpr std::size_t kShownPairs = 20;

std::string bound_line(const char* what, std::uint64_t at_most) {
  std::string text = "    " + std::string(what) + " ";
  text.resize(std::max<std::size_t>(text.size(), 42), '.');
  return text + " " + grouped(at_most) + "\n";
}

std::string role_text(const BodyFacts& body) {
  if (body.driven) return driven_as_text(*body.driven);
  if (body.held_bytes.value_or(0) == 0) return "stands still";
  const char* when = *body.role == PartRole::kHand    ? "held at the start"
                     : *body.role == PartRole::kHand2 ? "held by the second hand all the time"
                                                      : "may be held, and stays where it is let go";
  return std::string(when) + "; its scene has " + grouped(*body.held_bytes) + " bytes";
}

}  // namespace

const char* role_name(PartRole role) {
  switch (role) {
    case PartRole::kFixed:
      return "fixed";
    case PartRole::kHand:
      return "hand";
    case PartRole::kPlaced:
      return "placed";
    case PartRole::kDriven:
      return "driven";
    case PartRole::kHand2:
      return "hand2";
    case PartRole::kLoose:
      break;
  }
  return "loose";
}

std::string parts_as_text(const SceneFacts& facts) {
  if (!facts.parts) return "";
  const PartsFacts& parts = *facts.parts;
  std::string text;
  for (const BodyFacts& body : facts.bodies) {
    if (!body.role) continue;
    text += formatted("  %-7s '%s': %s\n", role_name(*body.role), body.name.c_str(),
                      role_text(body).c_str());
  }
  text += parts.moving > 1
              ? "  up to " + grouped(parts.moving) + " of them move in one tick, by one law\n"
              : "  one of them moves in a tick; the others stand where they are\n";
  text += "  may touch:\n";
  for (std::size_t k = 0; k < std::min(parts.pairs.size(), kShownPairs); ++k) {
    const PartPairFacts& pair = parts.pairs[k];
    text += "    '" + pair.a + "' and " +
            (pair.b.empty() ? std::string("what stands where it moves") : "'" + pair.b + "'") +
            ": " + grouped(pair.pairs) + (pair.pairs == 1 ? " pair" : " pairs") +
            " of pieces, a scene of " + grouped(pair.bytes) + " bytes\n";
  }
  if (parts.pairs.size() > kShownPairs)
    text += "    ... and " + grouped(parts.pairs.size() - kShownPairs) + " more\n";
  text += "  memory: " + grouped(parts.rooms) + " rooms, each a scene of " +
          grouped(parts.scene_bytes) + " bytes, a state of " + grouped(parts.state_bytes) +
          " and a law of " + grouped(parts.law_bytes) + "\n";
  text += "  in one tick at most, of all that moves, with what is held at the start:\n";
  const SceneCapacity& c = parts.bounds;
  text += bound_line("units of work", c.max_work_units);
  text += bound_line("nodes of the trees of pieces", c.max_list_visits);
  text += bound_line("searches without history", c.max_full_searches);
  text += bound_line("passes", c.max_proxy_passes);
  text += bound_line("rounds of one pass", c.max_proxy_rounds);
  text += bound_line("quadratic programs", c.max_qp_programs);
  text += bound_line("rows of one program", c.max_qp_rows);
  return text + bound_line("iterations of one program", c.max_qp_iterations);
}

}  // namespace haptic::tools
