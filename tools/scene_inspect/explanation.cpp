// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_inspect/explanation.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "tools/common/formatted.hpp"
#include "tools/scene_facts/bounds_text.hpp"
#include "tools/scene_facts/coupling_text.hpp"
#include "tools/scene_facts/facts_text.hpp"
#include "tools/scene_facts/parts_text.hpp"
#include "tools/scene_inspect/certificates.hpp"

namespace haptic::tools {
namespace {

// Contacts left out of a scene and the saving, as text and as JSON.

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

/// Why contacts could be left out, how many, and bytes and work with and without; some sentences
/// and a small table.
std::string left_out_as_text(const Inspection& inspection) {
  const PruningRecheck& p = inspection.pruning;
  const PairCounts& n = p.counts;
  if (p.has_facets) {
    return wrapped(
        motion_sentence(inspection.facts.parameters.envelope) +
            "Beside a surface no contact is left out beforehand: whether it carries a force is "
            "told in the tick by what goes on beside the facet. " +
            of_all(sum_of(p.pieces, &PieceHidden::faces)) + " faces, " +
            of_all(sum_of(p.pieces, &PieceHidden::edges)) + " edges and " +
            of_all(sum_of(p.pieces, &PieceHidden::vertices)) +
            " vertices are hidden where a part goes on in another piece.",
        2);
  }
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

/// Basic contacts by pair and type (all, reachable, exposed, live), hidden features by piece; the
/// first 20 of each.
std::string pruning_tables_as_text(const Inspection& inspection) {
  const PruningRecheck& p = inspection.pruning;
  std::string text;
  if (!p.pairs.empty()) {
    text = formatted("    %-15s %-22s %-22s %-22s %s\n", "moving, static", "all (A B C)",
                     "can occur", "exposed", "live");
  }
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

/// All of it.
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

std::string counted(std::uint64_t n, const std::string& one) {
  return grouped(n) + " " + one + (n == 1 ? "" : "s");
}

std::string simplified_sentence(const BodyFacts& body) {
  if (!body.simplified) return "";
  const SimplifiedBody& s = *body.simplified;
  const bool is_solid = !body.is_surface();
  const std::string text = std::string("It is NOT the ") + (is_solid ? "solid" : "surface") +
                           " of its mesh but was simplified: no point of either surface is "
                           "farther than " +
                           short_number(1e3 * s.distance_m, 4) + " mm from the other";
  if (!is_solid) return text + ". ";
  return text + ", the volume changed by " + short_number(1e6 * s.volume_change_m3, 4) + " cm3. ";
}

const char* motion_sentence_of(const BodyFacts& body, std::size_t index) {
  if (index == 0) return "moves with the hand. ";
  switch (body.role.value_or(PartRole::kFixed)) {
    case PartRole::kHand2:
      return "moves with the second hand. ";
    case PartRole::kDriven:
      return "moves as its owner has it, and pushes the part in the hand. ";
    case PartRole::kLoose:
      return "is loose: it stays where what moves has pushed it. ";
    case PartRole::kPlaced:
      return "stands until the hand holds it, and where it is then let go. ";
    case PartRole::kFixed:
    case PartRole::kHand:
      break;
  }
  return "stands still. ";
}

/// `first_piece` of the body within the scene.
std::string body_sentences(const Inspection& inspection, std::size_t index,
                           std::size_t first_piece) {
  const BodyFacts& body = inspection.facts.bodies[index];
  std::string text = "'" + body.name + "' " + motion_sentence_of(body, index);
  const std::size_t pieces = body.pieces.size();
  if (body.is_surface()) {
    return text + "It is a surface of " + counted(pieces, "flat facet") + " in " +
           counted(body.planes, "plane") + ". " + simplified_sentence(body);
  }
  text += "Volume " + short_number(1e6 * body.volume_m3, 4) + " cm3, " +
          counted(body.planes, "plane") + ". " + simplified_sentence(body);
  if (pieces == 1) {
    const PieceFacts& p = body.pieces[0];
    return text + "It is convex and stays one piece, of " + grouped(p.vertices) + " vertices, " +
           grouped(p.edges) + " edges and " + grouped(p.faces) + " faces.";
  }
  std::size_t seams = 0, faces = 0, partly = 0;
  for (std::size_t i = 0; i < pieces; ++i) {
    const PieceHidden& hidden = inspection.pruning.pieces[first_piece + i];
    seams += hidden.faces.hidden;
    faces += hidden.faces.all;
    partly += hidden.partly_covered_faces;
  }
  text += "It is not convex and was made of " + grouped(pieces) + " convex pieces. Of their " +
          counted(faces, "face") + " " + grouped(seams) + " are seams inside the part";
  if (partly > 0) text += ", " + grouped(partly) + " more are covered in part";
  return text + (body.recheck.separated_pairs == body.recheck.piece_pairs
                     ? "."
                     : ". The pieces overlap: a cover.");
}

std::string contents(const Inspection& inspection) {
  const SceneFacts& facts = inspection.facts;
  std::string text;
  std::size_t pieces = 0;
  for (std::size_t b = 0; b < facts.bodies.size(); ++b) {
    text += wrapped(body_sentences(inspection, b, pieces), 2);
    pieces += facts.bodies[b].pieces.size();
  }
  const SceneParameters& p = facts.parameters;
  return text +
         wrapped(
             "Contacts are looked for in " + counted(facts.capacity.pair_count, "pair") +
                 " of a moving and a static piece, " + short_number(p.rate_hz, 4) +
                 " times a second. A basic contact is a face against a vertex (type A), a "
                 "vertex against a face (B) or an edge against an edge (C). Forces follow law " +
                 law_name(p.law) + ".",
             2);
}

std::string tick_cost(const SceneFacts& facts) {
  const SceneCapacity& c = facts.capacity;
  std::string text = wrapped(
      "Not a time but a count, proved for every motion, also for the first tick and for a jump: "
      "one "
      "tick searches at most " +
          counted(c.max_pair_visits, "pair") + ", evaluates " + grouped(c.max_feature_evaluations) +
          " faces and edges, tests " + grouped(c.max_edge_pairs) + " pairs of edges and has " +
          grouped(c.max_near_nodes) +
          " basic contacts near. Steady motion needs a small part of it; seconds are for the "
          "machine to tell (host_sim wcet).",
      2);
  if (facts.parts && facts.parts->moving > 1)
    text += wrapped("These are of '" + facts.bodies[0].name +
                        "' alone among what stands. What moves at once has bounds of its own, "
                        "above; 'host_lab bodies-fuzz --scene' counts its ticks.",
                    2);
  return text + bounds_as_text(facts);
}

}  // namespace

Inspection inspection_of(const SceneView& view) { return {facts_of(view), recheck_pruning(view)}; }

std::string explanation(const Inspection& inspection, const BudgetLimits& limits) {
  const SceneFacts& facts = inspection.facts;
  const std::vector<SceneProof> certificates = certificates_of(inspection);
  std::string text = "scene '" + facts.name + "': " + grouped(facts.bytes) + " bytes, " +
                     (facts.scalar_bytes == 8 ? "double" : "float") + " numbers\n\n";
  text += "Contents\n" + contents(inspection) + "\n";
  if (facts.parts) text += "Parts\n" + parts_as_text(facts) + "\n";
  text += "Proved again from these bytes alone\n" + certificates_as_text(certificates) + "\n";
  text += "Cost of a tick\n" + tick_cost(facts) + "\n";
  text += "Left out, and the saving\n" + left_out_as_text(inspection) + "\n";
  text += "Basic contacts by pair\n" + pruning_tables_as_text(inspection) + "\n";
  return text + "Where the memory goes\n" + memory_as_text(facts, limits);
}

nlohmann::ordered_json inspection_as_json(const Inspection& inspection,
                                          const BudgetLimits& limits) {
  nlohmann::ordered_json result = facts_as_json(inspection.facts);
  result["pruning"] = pruning_as_json(inspection);
  result["certificates"] = certificates_as_json(certificates_of(inspection));
  result["memory"] = memory_as_json(inspection.facts, limits);
  return result;
}

}  // namespace haptic::tools
