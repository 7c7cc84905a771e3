// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_inspect/certificates.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tools/common/formatted.hpp"
#include "tools/scene_facts/bounds_text.hpp"
#include "tools/scene_facts/facts_text.hpp"

namespace haptic::tools {
namespace {

constexpr std::size_t kWidth = 100;
/// Share of a volume that rounding of the coordinates may change.
constexpr double kVolumeShare = sizeof(Real) == sizeof(double) ? 1.0e-9 : 1.0e-3;

SceneProof convexity(const SceneFacts& facts) {
  SceneProof proof{"convex",
                   "No vertex lies outside a face plane of its own piece, and every vertex of a "
                   "face lies in its plane: each piece is the convex body that its faces say, "
                   "which the search for contacts rests on.",
                   "", ProofResult::kHolds};
  for (const BodyFacts& body : facts.bodies) {
    const BodyRecheck& r = body.recheck;
    proof.figures += formatted("%s'%.100s': at most %.2g m off, %.2g m allowed%s",
                               proof.figures.empty() ? "" : "; ", body.name.c_str(),
                               std::max(r.largest_outside_m, r.largest_off_m), r.tolerance_m,
                               r.convex ? "" : ", NOT CONVEX");
    if (!r.convex) proof.result = ProofResult::kFails;
  }
  return proof;
}

SceneProof disjointness(const SceneFacts& facts) {
  SceneProof proof{
      "disjoint",
      "Between every two pieces of a part lies a plane, of a face or along edges: no two "
      "share volume, so that a depth is never counted twice.",
      "", ProofResult::kHolds};
  for (const BodyFacts& body : facts.bodies) {
    const BodyRecheck& r = body.recheck;
    const bool apart = r.separated_pairs == r.piece_pairs;
    proof.figures += (proof.figures.empty() ? "'" : "; '") + body.name + "': ";
    proof.figures += r.piece_pairs == 0 && body.pieces.size() > 1
                         ? "a surface: its facets have no volume"
                     : r.piece_pairs == 0 ? "one piece"
                                          : grouped(r.separated_pairs) + " of " +
                                                grouped(r.piece_pairs) + " pairs of pieces apart";
    if (apart) continue;
    proof.figures +=
        " (a cover of overlapping solids: contact or not stays right, volumes count twice)";
    proof.result = ProofResult::kLimited;
  }
  return proof;
}

SceneProof wholeness(const SceneFacts& facts) {
  SceneProof proof{"whole",
                   "The pieces have the volume that the part is stated to have, and a vertex of "
                   "the mesh is the same point in every piece. That they fill the part without a "
                   "gap was proved by the compiler on exact numbers, which rounded bytes can not "
                   "repeat; a piece lost or doubled since then would show here.",
                   "", ProofResult::kHolds};
  for (const BodyFacts& body : facts.bodies) {
    const double off_m3 = std::abs(body.recheck.volume_m3 - body.volume_m3);
    const double share = body.is_surface() ? 0 : off_m3 / body.volume_m3;
    proof.figures += (proof.figures.empty() ? "'" : "; '") + body.name + "': ";
    proof.figures += body.is_surface() ? "a surface, without volume, "
                                       : formatted("volumes %.2g apart, ", share);
    proof.figures += grouped(body.recheck.source_conflicts) + " vertices at odds";
    if (!(share <= kVolumeShare) || body.recheck.source_conflicts > 0) {
      proof.result = ProofResult::kFails;
    }
  }
  return proof;
}

SceneProof completeness(const Inspection& inspection) {
  const PruningRecheck& p = inspection.pruning;
  SceneProof proof{
      "complete",
      "No basic contact that can occur is missing, and none that can carry a force "
      "is marked as unable to: which features other pieces hide and which orientations "
      "are allowed was decided again from these bytes, with other arithmetic.",
      "", ProofResult::kHolds};
  if (p.holds() && p.has_facets) {
    proof.figures =
        "beside surfaces only features inside of solids are left out, and the second decision "
        "hides each of them too";
    return proof;
  }
  if (p.holds()) {
    proof.figures = grouped(p.needed) + " contacts are needed by the second decision, " +
                    grouped(p.counts.live.all()) + " are kept, none is missing";
    return proof;
  }
  proof.result = ProofResult::kFails;
  if (p.pairs.empty()) {
    proof.figures = grouped(p.missing) + " open features are marked as HIDDEN, the first of " +
                    piece_name(inspection.facts, static_cast<std::uint32_t>(p.first_missing)) +
                    "; compile the scene again";
    return proof;
  }
  const PairPruning& pair = p.pairs[p.first_missing];
  proof.figures = grouped(p.missing) + " contacts are MISSING, the first in the pair of " +
                  piece_name(inspection.facts, pair.piece_a) + " and " +
                  piece_name(inspection.facts, pair.piece_b) + "; compile the scene again";
  return proof;
}

SceneProof boundedness(const SceneFacts& facts) {
  SceneProof proof{"bounded",
                   "For any motion of the hand, no tick exceeds the bounds below, and none of its "
                   "lists can overflow: the scene can be certified. Where the units of work of law "
                   "proxy are spent the part lags, with a flag.",
                   "no list of a tick can overflow", ProofResult::kHolds};
  const std::vector<std::string> reasons = unproven_reasons(facts);
  if (reasons.empty()) return proof;
  proof.result = ProofResult::kLimited;
  proof.proves =
      "For any motion of the hand, no tick exceeds the bounds below. The scene can NOT be "
      "certified: "
      "to "
      "keep to them a tick may have to give up exactness, with a flag.";
  proof.figures = std::to_string(reasons.size()) +
                  (reasons.size() == 1 ? " reason: " : " reasons, the first: ") + reasons[0];
  return proof;
}

/// The blank that ends the word at `at`; those within "1 234" do not.
std::size_t word_end(const std::string& text, std::size_t at) {
  const auto digit = [&](std::size_t i) {
    return i < text.size() && text[i] >= '0' && text[i] <= '9';
  };
  std::size_t end = text.find(' ', at);
  while (end != std::string::npos && end > 0 && digit(end - 1) && digit(end + 1)) {
    end = text.find(' ', end + 1);
  }
  return std::min(end, text.size());
}

const char* result_name(ProofResult result) {
  if (result == ProofResult::kHolds) return "holds";
  return result == ProofResult::kFails ? "FAILS" : "limited";
}

}  // namespace

std::vector<SceneProof> certificates_of(const Inspection& inspection) {
  return {convexity(inspection.facts), disjointness(inspection.facts), wholeness(inspection.facts),
          completeness(inspection), boundedness(inspection.facts)};
}

bool is_sound(const std::vector<SceneProof>& certificates) {
  return std::ranges::none_of(certificates,
                              [](const SceneProof& c) { return c.result == ProofResult::kFails; });
}

std::string certificates_as_text(const std::vector<SceneProof>& certificates) {
  std::string text;
  for (const SceneProof& c : certificates) {
    std::string head = "  " + c.name;
    head.resize(14, ' ');
    text += head + "[" + result_name(c.result) + "]\n" + wrapped(c.proves, 6) +
            wrapped("Found: " + c.figures + ".", 6);
  }
  return text;
}

nlohmann::ordered_json certificates_as_json(const std::vector<SceneProof>& certificates) {
  nlohmann::ordered_json result = nlohmann::ordered_json::array();
  for (const SceneProof& c : certificates) {
    result.push_back({{"name", c.name},
                      {"result", c.result == ProofResult::kFails ? "fails" : result_name(c.result)},
                      {"proves", c.proves},
                      {"found", c.figures}});
  }
  return result;
}

std::string wrapped(const std::string& text, std::size_t indent) {
  std::string result, line(indent, ' ');
  bool empty = true;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = word_end(text, at);
    const std::string word = text.substr(at, end - at);
    at = end + 1;
    if (!empty && line.size() + 1 + word.size() > kWidth) {
      result += line + "\n";
      line.assign(indent, ' ');
      empty = true;
    }
    line += (empty ? "" : " ") + word;
    empty = false;
  }
  return result + line + "\n";
}

}  // namespace haptic::tools
