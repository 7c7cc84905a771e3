// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/memory_budget.hpp"

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "rt_core/haptic_core.hpp"
#include "rt_core/scene/capacity.hpp"
#include "rt_core/tracking/feature_bounds.hpp"
#include "tools/common/changed_scene.hpp"
#include "tools/graph_compiler/graph/stored_graphs.hpp"
#include "tools/scene_facts/budget_text.hpp"
#include "tools/scene_facts/facts_text.hpp"

namespace haptic::tools {
namespace {

/// State of the scene with other parameters or another budget of visits.
std::uint64_t state_of(const SceneView& scene, std::uint32_t visits,
                       const std::function<void(SceneParameters&)>& change) {
  const SceneBytes bytes = changed_scene(scene, change, visits);
  SceneView changed;
  if (SceneView::open(bytes.span(), changed) != RtStatus::kOk) {
    throw std::logic_error("a scene with other parameters does not open");
  }
  return changed.header().capacity.state_bytes;
}

std::uint64_t saved(std::uint64_t before, std::uint64_t after) {
  return after < before ? before - after : 0;
}

/// No stored graph at all; the sets are formed on the fly.
void propose_graphs(const SceneView& scene, std::vector<BudgetProposal>& proposals) {
  const std::uint64_t without = blob_bytes(
      scene, 0, 0, scene.neighbors_wide() ? sizeof(std::uint32_t) : sizeof(std::uint16_t));
  proposals.push_back({"form the contact graphs on the fly: [memory] graph_bytes = 0",
                       saved(scene.blob().size(), without), 0});
}

/// The most visits whose state fits, else one.
void propose_visits(const SceneView& scene, std::uint64_t state_budget,
                    std::vector<BudgetProposal>& proposals) {
  const std::uint64_t now = HapticCore::state_bytes(scene);
  const auto bytes = [&](std::uint32_t visits) {
    return state_of(scene, visits, [](SceneParameters&) {});
  };
  std::uint32_t fits = 1, too_many = scene.header().capacity.max_pair_visits;
  while (state_budget > 0 && too_many - fits > 1) {  // the state grows with the visits
    const std::uint32_t middle = fits + (too_many - fits) / 2;
    (bytes(middle) <= state_budget ? fits : too_many) = middle;
  }
  if (fits >= scene.header().capacity.max_pair_visits || now <= bytes(fits)) return;
  proposals.push_back({"search fewer pairs in a tick: [budget] pair_visits = " +
                           std::to_string(fits) + " (the others keep their last plane)",
                       0, saved(now, bytes(fits))});
}

/// The most pairs that have a seat at once whose state fits, else as few as there may be.
void propose_near_pairs(const SceneView& scene, std::uint64_t state_budget,
                        std::vector<BudgetProposal>& proposals) {
  const std::uint32_t slots = scene.header().capacity.near_slots;  // of law kProxy alone
  if (!near_seats(slots, 1).take_turns) return;
  const std::uint64_t now = HapticCore::state_bytes(scene);
  const auto bytes = [&](std::uint32_t pairs) {
    return state_of(scene, scene.header().capacity.max_pair_visits,
                    [pairs](SceneParameters& p) { p.coupling.near_pairs = pairs; });
  };
  std::uint32_t fits = kLeastSeats, too_many = slots;
  while (state_budget > 0 && too_many - fits > 1) {  // the state grows with the pairs
    const std::uint32_t middle = fits + (too_many - fits) / 2;
    (bytes(middle) <= state_budget ? fits : too_many) = middle;
  }
  const std::uint64_t fewer = bytes(fits);
  if (now <= fewer) return;
  proposals.push_back(
      {"look at fewer pairs closely at once: [budget] near_pairs = " + std::to_string(fits) +
           ", now " +
           std::to_string(near_seats(slots, scene.parameters().coupling.near_pairs).seats) +
           " (the others take turns, which costs units)",
       0, now - fewer});
}

void propose_parameters(const SceneView& scene, std::vector<BudgetProposal>& proposals) {
  const std::uint64_t now = HapticCore::state_bytes(scene);
  const std::uint32_t visits = scene.header().capacity.max_pair_visits;
  const auto propose = [&](const std::string& what,
                           const std::function<void(SceneParameters&)>& change) {
    const std::uint64_t bytes = saved(now, state_of(scene, visits, change));
    if (bytes > 0) proposals.push_back({what, 0, bytes});
  };
  if (scene.parameters().law == LawId::kProxy) {
    propose("no search at the goal pose: leave out [rendering] goal_contact",
            [](SceneParameters& p) { p.goal_contact = 0; });
  }
  for (const LawRow& law : kLaws) {
    // Law proxy has the most to keep, and a surface no other.
    if (law.id == scene.parameters().law || law.id == LawId::kProxy || has_facets(scene.pieces()))
      continue;
    propose(std::string("take another law: [rendering] law = \"") + law.name + "\"",
            [&](SceneParameters& p) { p.law = law.id; });
  }
  if (scene.parameters().device.given != 0) {
    propose("no estimate of the device's twist: leave out [device] and damping of the coupling",
            [](SceneParameters& p) {
              p.device = DeviceParameters{};
              p.coupling.passivity = 0;
              p.coupling.damping_ns_per_m = 0;
            });
  }
}

/// Bytes that the pieces of a body take in the tables, with the pairs and graphs they are in.
void propose_pieces(const SceneView& scene, std::vector<BudgetProposal>& proposals) {
  for (std::uint32_t b = 0; b < scene.bodies().size(); ++b) {
    const BodyRecord& body = scene.bodies()[b];
    if (body.piece_count < 2) continue;
    const std::uint32_t last = body.piece_begin + body.piece_count;
    std::uint32_t smallest = body.piece_begin;
    for (std::uint32_t i = smallest; i < last; ++i) {
      if (scene.pieces()[i].volume_m3 < scene.pieces()[smallest].volume_m3) smallest = i;
    }
    const PieceRecord& r = scene.pieces()[smallest];
    std::uint64_t constants =
        sizeof(PieceRecord) +
        std::uint64_t{r.vertex_count} *
            (3 * sizeof(Real) + sizeof(std::uint32_t) + sizeof(std::int32_t)) +
        std::uint64_t{r.face_count} * sizeof(FaceRecord) +
        std::uint64_t{r.loop_count} * 2 * sizeof(std::uint16_t) +
        std::uint64_t{r.edge_count} *
            (sizeof(EdgeRecord) + sizeof(EdgeDirection) + 2 * sizeof(std::uint16_t)) +
        stored_lanes(r) * sizeof(Real);
    constants += is_flat(r) ? std::uint64_t{r.edge_count} * 3 * sizeof(Real) +
                                  (std::uint64_t{r.vertex_count} + r.edge_count) * sizeof(ConeRange)
                            : std::uint64_t{r.edge_count} * sizeof(EdgeArc);
    std::uint64_t state = 0;  // of its pairs: the bounds of their faces and edges
    for (std::uint32_t i = 0; i < scene.listed_pairs().size(); ++i) {
      const PairRecord& pair = scene.listed_pairs()[i];
      if (pair.piece_a != smallest && pair.piece_b != smallest) continue;
      constants += sizeof(PairRecord);
      if (!has_goal_contact(scene.parameters())) continue;
      Arena counting;
      FeatureBounds bounds;
      bounds.place(counting, scene.pieces()[pair.piece_a], scene.pieces()[pair.piece_b]);
      state += counting.used();
      const PairView view = scene.pair(i);
      if (!view.graph_stored) continue;
      const std::uint64_t entries = view.neighbors.begin[pair.node_count] - view.neighbors.begin[0];
      constants += graph_bytes({pair.node_count, entries}, scene.neighbors_wide());
    }
    proposals.push_back({"a coarser mesh of '" +
                             std::string(scene.text(body.name_offset, body.name_bytes)) +
                             "' with one of its " + std::to_string(body.piece_count) +
                             " pieces less (the smallest, with the pairs it is in)",
                         constants, state});
  }
}

std::string message_of(const SceneFile& file, const BudgetLimit& limit, const char* what,
                       std::uint64_t needed, const SceneView& scene) {
  const bool of_state = std::strcmp(what, "state") == 0;
  const SceneFacts facts = facts_of(scene);
  std::string text = file.file + ":" + std::to_string(limit.line) + ":" +
                     std::to_string(limit.column) + ": the scene needs " + grouped(needed) +
                     " bytes of " + what + ", the budget allows " + grouped(limit.bytes) +
                     "; raise it, or leave something out\n";
  text += sections_as_text(facts) + nodes_as_text(facts) + state_as_text(facts);
  text += "to leave out:\n";
  const auto bytes_of = [of_state](const BudgetProposal& p) {
    return of_state ? p.state_saved : p.constants_saved;
  };
  std::vector<BudgetProposal> proposals = budget_proposals(scene, of_state ? limit.bytes : 0);
  std::stable_sort(
      proposals.begin(), proposals.end(),
      [&](const BudgetProposal& l, const BudgetProposal& r) { return bytes_of(l) > bytes_of(r); });
  std::size_t listed = 0;
  for (const BudgetProposal& p : proposals) {
    if (bytes_of(p) == 0) continue;
    text += "    " + grouped(bytes_of(p)) + " bytes: " + p.what + "\n";
    listed += 1;
  }
  return listed > 0 ? text : text + "    nothing but parts of the mesh\n";
}

}  // namespace

std::uint64_t blob_bytes(const SceneView& scene, std::uint64_t nodes, std::uint64_t neighbors,
                         std::uint32_t neighbor_bytes) {
  const auto sections = scene.sections();
  std::uint64_t end = sizeof(SceneHeader) + sections.size_bytes();
  for (const SectionEntry& s : sections) {
    std::uint64_t bytes = s.count * s.element_bytes;
    if (s.id == SectionId::kNodes) bytes = nodes * s.element_bytes;
    if (s.id == SectionId::kNeighborBegin) bytes = (nodes + 1) * s.element_bytes;
    if (s.id == SectionId::kNeighbors) bytes = neighbors * neighbor_bytes;
    end = (end + kSceneAlignment - 1) / kSceneAlignment * kSceneAlignment + bytes;
  }
  return end;
}

std::vector<BudgetProposal> budget_proposals(const SceneView& scene, std::uint64_t state_budget) {
  std::vector<BudgetProposal> proposals;
  propose_graphs(scene, proposals);
  propose_visits(scene, state_budget, proposals);
  propose_near_pairs(scene, state_budget, proposals);
  propose_parameters(scene, proposals);
  propose_pieces(scene, proposals);
  std::stable_sort(proposals.begin(), proposals.end(),
                   [](const BudgetProposal& l, const BudgetProposal& r) {
                     return l.constants_saved + l.state_saved > r.constants_saved + r.state_saved;
                   });
  return proposals;
}

std::uint64_t core_stack_bytes() { return HAPTIC_RT_STACK_BYTES; }

void check_budgets(const SceneFile& file, const SceneView& scene, bool image) {
  const auto check = [&](const std::optional<BudgetLimit>& limit, const char* what,
                         std::uint64_t needed) {
    if (!limit || needed <= limit->bytes) return;
    throw BudgetError(message_of(file, *limit, what, needed, scene));
  };
  check(file.budget.constants, "constants", scene.blob().size());
  check(file.budget.state, "state", scene.header().capacity.state_bytes);
  const std::optional<BudgetLimit>& stack = file.budget.stack;
  if (!stack || image || core_stack_bytes() <= stack->bytes) return;
  throw BudgetError(file.file + ":" + std::to_string(stack->line) + ":" +
                    std::to_string(stack->column) + ": the whole core may need " +
                    grouped(core_stack_bytes()) + " bytes of stack, the budget allows " +
                    grouped(stack->bytes) +
                    "; raise it, or build an image of the scene (--traits, IMAGES.md): that "
                    "core needs less, and its build holds it to the budget");
}

}  // namespace haptic::tools
