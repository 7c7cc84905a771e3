// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_inspect/explanation.hpp"

#include <nlohmann/json.hpp>

#include "tools/common/formatted.hpp"
#include "tools/scene_facts/bounds_text.hpp"
#include "tools/scene_facts/coupling_text.hpp"
#include "tools/scene_facts/facts_text.hpp"
#include "tools/scene_inspect/pruning_text.hpp"

namespace haptic::tools {
namespace {

std::string counted(std::uint64_t n, const std::string& one) {
  return grouped(n) + " " + one + (n == 1 ? "" : "s");
}

std::string simplified_sentence(const BodyFacts& body) {
  if (!body.simplified) return "";
  const SimplifiedBody& s = *body.simplified;
  return "It is NOT the solid of its mesh but was simplified: no point of either surface is "
         "farther than " +
         short_number(1e3 * s.distance_m, 4) + " mm from the other, the volume changed by " +
         short_number(1e6 * s.volume_change_m3, 4) + " cm3. ";
}

/// `first_piece` of the body within the scene.
std::string body_sentences(const Inspection& inspection, std::size_t index,
                           std::size_t first_piece) {
  const BodyFacts& body = inspection.facts.bodies[index];
  std::string text = "'" + body.name + "' " +
                     (index == 0 ? "moves with the hand." : "stands still.") + " Volume " +
                     short_number(1e6 * body.volume_m3, 4) + " cm3, " +
                     counted(body.planes, "plane") + ". " + simplified_sentence(body);
  const std::size_t pieces = body.pieces.size();
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
             "Contacts are looked for in " + counted(facts.pairs.size(), "pair") +
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
