// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_facts/budget_text.hpp"

#include <cstdio>
#include <iterator>
#include <nlohmann/json.hpp>

#include "tools/scene_facts/facts_text.hpp"

namespace haptic::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kParts = static_cast<std::size_t>(StatePart::kCount);
constexpr const char* kPartKeys[] = {"core",     "pairs",  "bounds", "search",
                                     "contacts", "output", "law"};
static_assert(std::size(kPartKeys) == kParts);

bool fits(std::uint64_t bytes, const std::optional<std::uint64_t>& limit) {
  return !limit || bytes <= *limit;
}

/// ", 12 % of the limit 1 000 000" or ", OVER the limit 1 000 by 23".
std::string against(std::uint64_t bytes, const std::optional<std::uint64_t>& limit) {
  if (!limit) return "";
  if (bytes > *limit)
    return ", OVER the limit " + grouped(*limit) + " by " + grouped(bytes - *limit);
  char share[32];
  std::snprintf(share, sizeof share, ", %.0f %% of the limit ",
                *limit > 0 ? 100.0 * static_cast<double>(bytes) / static_cast<double>(*limit) : 0);
  return share + grouped(*limit);
}

Json limit_json(std::uint64_t bytes, const std::optional<std::uint64_t>& limit) {
  if (!limit) return nullptr;
  return {{"limit_bytes", *limit}, {"fits", fits(bytes, limit)}};
}

}  // namespace

const char* state_part_name(StatePart part) {
  static constexpr const char* kNames[] = {
      "core", "pairs", "bounds of the search", "search", "contacts", "output", "law"};
  static_assert(std::size(kNames) == kParts);
  return kNames[static_cast<std::size_t>(part)];
}

std::string state_as_text(const SceneFacts& facts) {
  std::string text = "    state " + grouped(facts.state.total()) + " bytes\n";
  for (std::size_t part = 0; part < kParts; ++part) {
    if (facts.state.bytes[part] == 0) continue;
    std::string line = std::string("      ") + state_part_name(static_cast<StatePart>(part));
    line.resize(28, ' ');
    text += line + grouped(facts.state.bytes[part]) + "\n";
  }
  return text;
}

Json state_as_json(const SceneFacts& facts) {
  Json parts = Json::object();
  for (std::size_t part = 0; part < kParts; ++part) {
    parts[kPartKeys[part]] = facts.state.bytes[part];
  }
  return parts;
}

bool within_budget(const SceneFacts& facts, const BudgetLimits& limits) {
  return fits(facts.bytes, limits.constants) && fits(facts.state.total(), limits.state);
}

std::string memory_as_text(const SceneFacts& facts, const BudgetLimits& limits) {
  std::string text = "    constants " + grouped(facts.bytes) + " bytes" +
                     against(facts.bytes, limits.constants) + "\n" + sections_as_text(facts);
  text += state_as_text(facts);
  if (limits.state) {
    text += "      in all" + against(facts.state.total(), limits.state).substr(1) + "\n";
  }
  text += "    stack: " +
          (limits.stack ? "limit " + grouped(*limits.stack) + " bytes; " : std::string()) +
          "reported and checked where an image of the scene is linked\n";
  if (limits.file.empty()) return text;
  const bool any = limits.constants || limits.state || limits.stack;
  return text + "    " + limits.file + (any ? "" : " has no limits: [budget] names none") +
         (any ? within_budget(facts, limits) ? ": within its budget" : ": OVER ITS BUDGET" : "") +
         "\n";
}

Json memory_as_json(const SceneFacts& facts, const BudgetLimits& limits) {
  const std::uint64_t state = facts.state.total();
  Json result = {{"constants_bytes", facts.bytes},
                 {"state_bytes", state},
                 {"state_parts", state_as_json(facts)}};
  if (!limits.file.empty()) {
    result["budget"] = {{"file", limits.file},
                        {"constants", limit_json(facts.bytes, limits.constants)},
                        {"state", limit_json(state, limits.state)},
                        {"stack_limit_bytes", limits.stack ? Json(*limits.stack) : Json(nullptr)},
                        {"fits", within_budget(facts, limits)}};
  }
  return result;
}

}  // namespace haptic::tools
