// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_inspect/pruning_text.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>

#include "tools/common/formatted.hpp"
#include "tools/scene_facts/bounds_text.hpp"
#include "tools/scene_facts/facts_text.hpp"

namespace haptic::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kPrunedRows = 20;

double percent(std::size_t part, std::size_t all) {
  return all > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(all) : 0.0;
}

HiddenCount sum_of(const std::vector<PieceHidden>& pieces, HiddenCount PieceHidden::*of) {
  HiddenCount sum;
  for (const PieceHidden& piece : pieces) {
    sum.hidden += (piece.*of).hidden;
    sum.all += (piece.*of).all;
  }
  return sum;
}

/// "35 of 42".
std::string of_all(const HiddenCount& count) {
  return grouped(count.hidden) + " of " + grouped(count.all);
}

std::string motion_sentence(const EnvelopeParameters& e) {
  std::string text;
  if ((e.given & kOrientationGiven) != 0) {
    text += formatted("The part turns at most %.4g degrees from its middle orientation. ",
                      e.max_angle_rad * 180.0 / std::numbers::pi);
  }
  if ((e.given & kWorkspaceGiven) != 0) {
    text += formatted("The grip stays between (%.4g, %.4g, %.4g) and (%.4g, %.4g, %.4g) m. ",
                      e.min_m[0], e.min_m[1], e.min_m[2], e.max_m[0], e.max_m[1], e.max_m[2]);
  }
  if (!text.empty()) return text;
  return "The part may take every pose ([motion_limits] orientation and workspace of the scene "
         "file "
         "would rule some out). ";
}

/// "saves 12 kB" or "costs 1.0 kB".
std::string change(std::uint64_t without, std::uint64_t with) {
  if (without == with) return "as much";
  return without > with ? "saves " + short_bytes(without - with)
                        : "costs " + short_bytes(with - without);
}

struct CostRow {
  const char* what;
  std::uint64_t with, without;
};

std::vector<CostRow> cost_rows(const Inspection& inspection) {
  const UnprunedScene& all = *inspection.pruning.unpruned;
  const SceneCapacity &c = inspection.facts.capacity, &u = all.capacity;
  return {{"constants, bytes", inspection.facts.bytes, all.bytes},
          {"state, bytes", c.state_bytes, u.state_bytes},
          {"pairs in the scene", c.pair_count, u.pair_count},
          {"faces and edges evaluated", c.max_feature_evaluations, u.max_feature_evaluations},
          {"pairs of edges tested", c.max_edge_pairs, u.max_edge_pairs},
          {"support pairs", c.max_support_pairs, u.max_support_pairs},
          {"basic contacts in near sets", c.max_near_nodes, u.max_near_nodes}};
}

std::string savings_text(const Inspection& inspection) {
  const PruningRecheck& p = inspection.pruning;
  if (!p.unpruned) {
    return p.left_something_out() ? wrapped("The saving cannot be stated: " + p.not_compared, 2)
                                  : wrapped("Nothing was left out, so nothing was saved.", 2);
  }
  const std::vector<CostRow> rows = cost_rows(inspection);
  std::string text = wrapped(
      "Against the same pieces with every contact kept (graphs stored as far as 8 MiB hold them), "
      "leaving these out " +
          change(rows[0].without, rows[0].with) + " of constants (the marks themselves take " +
          short_bytes(p.mark_bytes) + "), and it " + change(rows[1].without, rows[1].with) +
          " of state:",
      2);
  text += formatted("    %-30s %14s %14s\n", "", "this scene", "all kept");
  for (const CostRow& row : rows) {
    text += formatted("    %-30s %14s %14s\n", row.what, grouped(row.with).c_str(),
                      grouped(row.without).c_str());
  }
  return text;
}

std::string counts_cell(const NodeCounts& n) {
  return formatted("%zu (%zu %zu %zu)", n.all(), n.a, n.b, n.c);
}

Json counts_json(const NodeCounts& n) {
  return {{"all", n.all()}, {"a", n.a}, {"b", n.b}, {"c", n.c}};
}

Json hidden_json(const PieceHidden& h) {
  const auto count = [](const HiddenCount& c) {
    return Json{{"hidden", c.hidden}, {"all", c.all}};
  };
  return {{"faces", count(h.faces)},
          {"edges", count(h.edges)},
          {"vertices", count(h.vertices)},
          {"partly_covered_faces", h.partly_covered_faces}};
}

/// Number of a piece within its part, as the drawing has it; with the number of the static part
/// before it where there are several.
std::string piece_label(const SceneFacts& facts, std::uint32_t piece) {
  std::size_t body = 0;
  while (piece >= facts.bodies[body].pieces.size()) {
    piece -= static_cast<std::uint32_t>(facts.bodies[body].pieces.size());
    body += 1;
  }
  const bool several = facts.bodies.size() > 2 && body > 0;
  return (several ? std::to_string(body) + ":" : "") + std::to_string(piece);
}

std::string unshown_rows(std::size_t count) {
  if (count <= kPrunedRows) return "";
  return "    ... and " + std::to_string(count - kPrunedRows) + " more (--json lists all)\n";
}

}  // namespace

std::string left_out_as_text(const Inspection& inspection) {
  const PruningRecheck& p = inspection.pruning;
  const PairCounts& n = p.counts;
  const std::size_t all = n.nodes.all();
  const std::string occurring = n.reachable.all() == all
                                    ? "All " + grouped(all) + " basic contacts can occur."
                                    : "Of " + grouped(all) + " basic contacts " +
                                          grouped(n.reachable.all()) +
                                          " can occur; the others are not looked at at all.";
  std::string text = wrapped(motion_sentence(inspection.facts.parameters.envelope) + occurring, 2);
  text += wrapped(
      "Where a part goes on in another of its pieces, the seam between them is no surface: " +
          of_all(sum_of(p.pieces, &PieceHidden::faces)) + " faces, " +
          of_all(sum_of(p.pieces, &PieceHidden::edges)) + " edges and " +
          of_all(sum_of(p.pieces, &PieceHidden::vertices)) +
          " vertices are hidden inside. A contact with such a feature carries no force; " +
          grouped(n.open.all()) + " contacts are of two features on the surface.",
      2);
  text += wrapped(formatted("Both together leave %s live contacts, %.1f %% of all. %s more stay to "
                            "tell that two pieces are apart, without ever carrying a force.",
                            grouped(n.live.all()).c_str(), percent(n.live.all(), all),
                            grouped(n.reachable.all() - n.live.all()).c_str()),
                  2);
  const auto out = std::ranges::count_if(p.pairs, [](const PairPruning& x) { return !x.in_scene; });
  if (out > 0) {
    text += wrapped(grouped(static_cast<std::uint64_t>(out)) + " of " + grouped(p.pairs.size()) +
                        " pairs of pieces never come near each other and are not in the scene.",
                    2);
  }
  if (p.needed < n.live.all() && !p.left_something_out()) {
    text += wrapped("Compiled without --no-prune, " + grouped(n.live.all() - p.needed) +
                        " contacts could be left out.",
                    2);
  }
  return text + savings_text(inspection);
}

std::string pruning_tables_as_text(const Inspection& inspection) {
  const PruningRecheck& p = inspection.pruning;
  std::string text = formatted("    %-15s %-22s %-22s %-22s %s\n", "moving, static", "all (A B C)",
                               "can occur", "exposed", "live");
  for (std::size_t i = 0; i < std::min(p.pairs.size(), kPrunedRows); ++i) {
    const PairPruning& pair = p.pairs[i];
    text +=
        formatted("    %-15s %-22s %-22s %-22s %s\n",
                  (piece_label(inspection.facts, pair.piece_a) + ", " +
                   piece_label(inspection.facts, pair.piece_b))
                      .c_str(),
                  counts_cell(pair.counts.nodes).c_str(),
                  counts_cell(pair.counts.reachable).c_str(), counts_cell(pair.counts.open).c_str(),
                  pair.in_scene ? counts_cell(pair.counts.live).c_str() : "never near");
  }
  text += unshown_rows(p.pairs.size());
  text += "    hidden in other pieces: faces, edges, vertices; faces covered in part\n";
  for (std::size_t i = 0; i < std::min(p.pieces.size(), kPrunedRows); ++i) {
    const PieceHidden& h = p.pieces[i];
    text += formatted("    %s: %s, %s, %s; %zu\n",
                      piece_name(inspection.facts, static_cast<std::uint32_t>(i)).c_str(),
                      of_all(h.faces).c_str(), of_all(h.edges).c_str(), of_all(h.vertices).c_str(),
                      h.partly_covered_faces);
  }
  return text + unshown_rows(p.pieces.size());
}

Json pruning_as_json(const Inspection& inspection) {
  const PruningRecheck& p = inspection.pruning;
  const EnvelopeParameters& e = inspection.facts.parameters.envelope;
  Json pairs = Json::array(), pieces = Json::array(), unpruned = nullptr;
  for (const PairPruning& pair : p.pairs) {
    pairs.push_back({{"piece_a", pair.piece_a},
                     {"piece_b", pair.piece_b},
                     {"in_scene", pair.in_scene},
                     {"marked", pair.marked},
                     {"all", counts_json(pair.counts.nodes)},
                     {"reachable", counts_json(pair.counts.reachable)},
                     {"exposed", counts_json(pair.counts.open)},
                     {"live", counts_json(pair.counts.live)},
                     {"missing", pair.missing}});
  }
  for (const PieceHidden& piece : p.pieces) pieces.push_back(hidden_json(piece));
  if (p.unpruned) {
    const SceneCapacity& u = p.unpruned->capacity;
    unpruned = {{"bytes", p.unpruned->bytes},
                {"state_bytes", u.state_bytes},
                {"pair_count", u.pair_count},
                {"max_feature_evaluations", u.max_feature_evaluations},
                {"max_edge_pairs", u.max_edge_pairs},
                {"max_support_pairs", u.max_support_pairs},
                {"max_near_nodes", u.max_near_nodes}};
  }
  Json envelope = Json::object();
  if ((e.given & kOrientationGiven) != 0) {
    envelope["about_wxyz"] = {e.q_wa_xyzw[3], e.q_wa_xyzw[0], e.q_wa_xyzw[1], e.q_wa_xyzw[2]};
    envelope["max_angle_rad"] = e.max_angle_rad;
  }
  if ((e.given & kWorkspaceGiven) != 0) {
    envelope["workspace_min_m"] = e.min_m;
    envelope["workspace_max_m"] = e.max_m;
  }
  return {{"envelope", std::move(envelope)},
          {"all", counts_json(p.counts.nodes)},
          {"reachable", counts_json(p.counts.reachable)},
          {"exposed", counts_json(p.counts.open)},
          {"live", counts_json(p.counts.live)},
          {"needed_by_recheck", p.needed},
          {"missing", p.missing},
          {"mark_bytes", p.mark_bytes},
          {"unpruned", std::move(unpruned)},
          {"not_compared", p.not_compared},
          {"pairs", std::move(pairs)},
          {"pieces", std::move(pieces)}};
}

}  // namespace haptic::tools
