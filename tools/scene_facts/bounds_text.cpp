// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_facts/bounds_text.hpp"

#include <algorithm>
#include <cstdio>

#include "rt_core/scene/proxy_limits.hpp"
#include "tools/scene_facts/facts_text.hpp"

namespace haptic::tools {
namespace {

constexpr std::size_t kShownReasons = 20;

std::string line(const char* what, std::uint64_t at_most) {
  std::string text = "  " + std::string(what) + " ";
  text.resize(std::max<std::size_t>(text.size(), 40), '.');
  return text + " " + grouped(at_most) + "\n";
}

}  // namespace

std::string short_bytes(std::uint64_t bytes) {
  constexpr const char* kUnits[] = {"bytes", "kB", "MB", "GB", "TB"};
  double x = static_cast<double>(bytes);
  std::size_t unit = 0;
  while (x >= 999.5 && unit + 1 < std::size(kUnits)) {
    x /= 1000;
    ++unit;
  }
  char text[32];
  std::snprintf(text, sizeof text, unit > 0 && x < 9.95 ? "%.1f %s" : "%.0f %s", x, kUnits[unit]);
  return text;
}

std::string piece_name(const SceneFacts& facts, std::uint32_t piece) {
  for (const BodyFacts& body : facts.bodies) {
    if (piece < body.pieces.size()) {
      return "piece " + std::to_string(piece) + " of '" + body.name + "'";
    }
    piece -= static_cast<std::uint32_t>(body.pieces.size());
  }
  return "no piece";
}

std::string pair_name(const SceneFacts& facts, std::size_t pair) {
  const PairFacts& p = facts.pairs[pair];
  return "pair " + std::to_string(pair) + " (" + piece_name(facts, p.piece_a) + ", " +
         piece_name(facts, p.piece_b) + ")";
}

std::string graph_form(const PairFacts& pair, std::optional<std::uint64_t> graph_budget_bytes) {
  if (pair.stored) return "stored, " + short_bytes(pair.graph_bytes);
  return "formed on the fly: stored it would take " + short_bytes(pair.graph_bytes) +
         (graph_budget_bytes ? " of the " + short_bytes(*graph_budget_bytes) : "");
}

std::vector<std::string> unproven_reasons(const SceneFacts& facts) {
  std::vector<std::string> reasons;
  for (std::size_t i = 0; i < facts.pairs.size() && facts.capacity.unproven != 0; ++i) {
    const PairFacts& p = facts.pairs[i];
    if (p.edge_pairs > p.edge_pair_capacity) {
      reasons.push_back(pair_name(facts, i) + ": " + grouped(p.edge_pairs) +
                        " edge pairs, a tick may test " + grouped(p.edge_pair_capacity) +
                        "; simplify the part with more edges");
    }
    if (p.live_nodes > p.near_capacity) {
      reasons.push_back(pair_name(facts, i) + ": " + grouped(p.live_nodes) +
                        " basic contacts, its near set holds " + grouped(p.near_capacity) +
                        "; simplify the part with more faces and edges");
    }
  }
  const SceneCapacity& c = facts.capacity;
  if ((c.unproven & kUnprovenPairVisits) != 0) {
    reasons.push_back(grouped(c.pair_count) + " pairs can be near at once, a tick may search " +
                      grouped(c.max_pair_visits) +
                      "; set [budget] pair_visits = " + std::to_string(c.pair_count) +
                      " where the loop has the time, or make the parts of fewer pieces");
  }
  if ((c.unproven & kUnprovenNearPairs) != 0) {
    reasons.push_back(grouped(facts.pair_count) + " pairs can be near at once, a tick follows " +
                      grouped(c.near_slots) +
                      (facts.state_with_all_pairs > 0
                           ? "; set [budget] near_pairs = " + std::to_string(facts.pair_count) +
                                 ", " + grouped(facts.state_with_all_pairs - c.state_bytes) +
                                 " bytes more of state"
                           : "; [budget] near_pairs may be " + grouped(kMostNearPairs) +
                                 " at the most: make the parts of fewer pieces, with tolerance_m"));
  }
  return reasons;
}

std::string bounds_as_text(const SceneFacts& facts) {
  const SceneCapacity& c = facts.capacity;
  std::string text = "  state of the loop " + grouped(c.state_bytes) + " bytes\n";
  text += "  in one tick at most, for any motion:\n";
  if (c.max_feature_evaluations > 0) text += line("  pairs searched", c.max_pair_visits);
  text += line("  faces and edges evaluated", c.max_feature_evaluations);
  text += line("  pairs of edges tested", c.max_edge_pairs);
  text += line("  support pairs", c.max_support_pairs);
  text += line("  basic contacts in near sets", c.max_near_nodes);
  text += line("  points of a contact polygon", c.max_hull_points);
  if (c.max_work_units > 0) {
    text += line("  units of work", c.max_work_units);
    text += line("  pairs followed", c.near_slots);
    text += line("  passes of the proxy", c.max_proxy_passes);
    text += line("  rounds of one pass", c.max_proxy_rounds);
    text += line("  quadratic programs", c.max_qp_programs);
    text += line("  rows of one program", c.max_qp_rows);
    text += line("  iterations of one program", c.max_qp_iterations);
    text += line("  iterations of all programs", c.max_qp_steps);
  }
  const std::vector<std::string> reasons = unproven_reasons(facts);
  if (reasons.empty()) {
    return text + "  no list of a tick can overflow: the scene can be certified\n" +
           (c.max_work_units > 0
                ? "    (where the units of work are spent, the part lags, with a flag)\n"
                : "");
  }
  text += "  a tick may have to give up exactness, with a flag, to keep to them:\n";
  for (std::size_t i = 0; i < std::min(reasons.size(), kShownReasons); ++i) {
    text += "    " + reasons[i] + "\n";
  }
  if (reasons.size() > kShownReasons) {
    text += "    ... and " + std::to_string(reasons.size() - kShownReasons) + " more\n";
  }
  return text;
}

}  // namespace haptic::tools
