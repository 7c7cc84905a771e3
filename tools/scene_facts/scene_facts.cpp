// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_facts/scene_facts.hpp"

#include <algorithm>

#include "rt_core/haptic_core.hpp"
#include "rt_core/scene/part_scenes.hpp"
#include "tools/common/changed_scene.hpp"
#include "tools/common/error.hpp"
#include "tools/common/held_parts.hpp"
#include "tools/common/movers.hpp"
#include "tools/graph_compiler/graph/stored_graphs.hpp"

namespace haptic::tools {
namespace {

void merge(NeighborhoodFacts& into, const NeighborhoodFacts& from) {
  if (from.nodes == 0) return;
  into.smallest = into.nodes == 0 ? from.smallest : std::min(into.smallest, from.smallest);
  into.largest = std::max(into.largest, from.largest);
  into.nodes += from.nodes;
  into.mean += from.mean;
}

void finish(NeighborhoodFacts& facts) {
  if (facts.nodes > 0) facts.mean /= static_cast<double>(facts.nodes);
}

PieceFacts piece_facts(const PieceView& piece) {
  PieceFacts facts;
  facts.volume_m3 = piece.record->volume_m3;
  facts.radius_m = piece.record->radius_m;
  facts.reach_m = piece.record->reach_m;
  facts.vertex_relax_m = piece.record->vertex_relax_m;
  facts.edge_relax_ratio = piece.record->edge_relax_ratio;
  facts.vertices = piece.vertex_count;
  facts.edges = piece.edge_count;
  facts.faces = piece.face_count;
  SourceFacts& source = facts.source;
  for (std::uint32_t v = 0; v < piece.vertex_count; ++v) {
    source.vertices.push_back(piece.source_vertices[v]);
    ++(piece.source_vertices[v] >= 0 ? source.mesh_vertices : source.cut_vertices);
  }
  for (std::uint32_t f = 0; f < piece.face_count; ++f) {
    source.faces.push_back(piece.faces[f].source_face);
    ++(piece.faces[f].source_face >= 0 ? source.mesh_faces : source.cut_faces);
  }
  return facts;
}

/// Smallest, largest and sum of a count over the features of a piece.
struct Spread {
  std::uint64_t count = 0, smallest = UINT64_MAX, largest = 0, sum = 0;
  void add(std::uint64_t x) {
    count += 1;
    smallest = std::min(smallest, x);
    largest = std::max(largest, x);
    sum += x;
  }
};
struct PieceSpread {
  explicit PieceSpread(const PieceView& piece) {
    for (std::uint32_t f = 0; f < piece.face_count; ++f) loops.add(piece.faces[f].loop_count);
    for (std::uint32_t v = 0; v < piece.vertex_count; ++v) degrees.add(piece.edges_at(v).size());
    for (std::uint32_t e = 0; e < piece.edge_count; ++e) {
      const EdgeRecord& edge = piece.edges[e];
      adjacent.add(piece.edges_at(edge.vertex[0]).size() + piece.edges_at(edge.vertex[1]).size() -
                   2);
    }
  }
  Spread loops, degrees, adjacent;
};

/// Neighborhoods of the nodes (face of l sides, vertex of d edges): l + d + 2 l d neighbors and the
/// node itself. The mean is still a sum.
NeighborhoodFacts face_vertex_facts(const Spread& l, const Spread& d) {
  const auto size = [](std::uint64_t loop, std::uint64_t degree) {
    return static_cast<std::uint32_t>(loop + degree + 2 * loop * degree + 1);
  };
  NeighborhoodFacts facts;
  facts.nodes = l.count * d.count;
  facts.smallest = size(l.smallest, d.smallest);
  facts.largest = size(l.largest, d.largest);
  facts.mean =
      static_cast<double>(l.sum * d.count + d.sum * l.count + 2 * l.sum * d.sum + facts.nodes);
  return facts;
}

/// The same for pairs of edges: their adjacent edges, eight more, and the node itself.
NeighborhoodFacts edge_edge_facts(const Spread& a, const Spread& b) {
  NeighborhoodFacts facts;
  facts.nodes = a.count * b.count;
  facts.smallest = static_cast<std::uint32_t>(a.smallest + b.smallest + 9);
  facts.largest = static_cast<std::uint32_t>(a.largest + b.largest + 9);
  facts.mean = static_cast<double>(a.sum * b.count + b.sum * a.count + 9 * facts.nodes);
  return facts;
}

/// The means are still sums.
PairFacts pair_facts(const PairView& pair, const PieceSpread& a, const PieceSpread& b, bool wide) {
  const PairRecord& record = pair.record;
  PairFacts facts;
  facts.piece_a = record.piece_a;
  facts.piece_b = record.piece_b;
  facts.nodes = record.node_count;
  facts.max_degree = record.max_degree;
  facts.near_capacity = record.near_capacity;
  facts.edge_pair_capacity = record.edge_pair_capacity;
  const PieceRecord &of_a = *pair.a.record, &of_b = *pair.b.record;
  facts.edge_pairs = live_counts(pair.marks, NodeScope::kReachable, record, of_a, of_b).edge_pairs;
  facts.live_nodes = live_counts(pair.marks, NodeScope::kLive, record, of_a, of_b).nodes;
  facts.types = {face_vertex_facts(a.loops, b.degrees), face_vertex_facts(b.loops, a.degrees),
                 edge_edge_facts(a.adjacent, b.adjacent)};
  const GraphSize size = graph_size(pair.a, pair.b);
  facts.arcs = size.neighbor_entries / 2;
  facts.stored = pair.graph_stored;
  facts.graph_bytes = graph_bytes(size, facts.stored ? wide : wide || needs_wide_lists(size));
  return facts;
}

/// True if the stored lists have 32-bit numbers.
bool wide_lists(const SceneView& view) {
  for (const SectionEntry& s : view.sections()) {
    if (s.id == SectionId::kNeighbors) return s.element_bytes == sizeof(std::uint32_t);
  }
  return false;
}

void add_driven(const PartScenes& parts, SceneFacts& facts) {
  for (std::uint32_t j = 0; j < parts.driven().size(); ++j) {
    DrivenFacts driven;
    driven.record = parts.driven()[j];
    for (std::uint32_t k = 0; k < parts.count(); ++k) {
      const std::size_t bytes = parts.pair_scene(k, parts.driven()[j].part).size();
      driven.scenes += bytes > 0 ? 1 : 0;
      driven.scene_bytes += bytes;
    }
    facts.bodies[driven.record.part].driven = driven;
  }
}

PartPairFacts part_pair(const PartScenes& parts, std::uint32_t a, std::string b,
                        std::span<const std::byte> bytes) {
  PartPairFacts pair{std::string(parts.name(a)), std::move(b), bytes.size(), 0};
  SceneView view;
  if (SceneView::open(bytes, view) == RtStatus::kOk) pair.pairs = view.pair_count();
  return pair;
}

PartsFacts parts_facts(const SceneView& view, const PartScenes& parts) {
  PartsFacts facts;
  facts.hands = parts.hands();
  facts.moving =
      std::min(facts.hands + static_cast<std::uint32_t>(parts.driven().size()), kMostMoving);
  facts.rooms = kMostHands;
  facts.scene_bytes = parts.most_bytes();
  facts.state_bytes = parts.most_state_bytes();
  facts.law_bytes = parts.most_law_bytes();
  for (std::uint32_t a = 0; a < parts.count(); ++a) {
    if (!parts.scene_of(a).empty() && parts.meets_standing(a))
      facts.pairs.push_back(part_pair(parts, a, "", parts.scene_of(a)));
    for (std::uint32_t b = 0; b < parts.count(); ++b) {
      const std::span<const std::byte> bytes = parts.pair_scene(a, b);
      if (!bytes.empty())
        facts.pairs.push_back(part_pair(parts, a, std::string(parts.name(b)), bytes));
    }
  }
  std::unique_ptr<HeldParts> held;
  const RtStatus status = HeldParts::open(view, held);
  if (status != RtStatus::kOk)
    throw InputError(std::string("the parts of the scene are refused: ") + to_text(status) +
                     "; compile it again");
  if (held != nullptr) facts.bounds = held->hands.bounds();
  return facts;
}

}  // namespace

std::string section_name(SectionId id) {
  static constexpr const char* kNames[] = {"parameters",
                                           "bodies",
                                           "planes",
                                           "pieces",
                                           "vertices",
                                           "faces",
                                           "loop vertices",
                                           "loop edges",
                                           "edges",
                                           "edge directions",
                                           "vertex edge begin",
                                           "vertex edges",
                                           "pairs",
                                           "nodes",
                                           "neighbor begin",
                                           "neighbors",
                                           "source vertices",
                                           "text",
                                           "vertex lanes",
                                           "edge arcs",
                                           "node marks",
                                           "simplified",
                                           "cone ranges",
                                           "cone directions",
                                           "guide",
                                           "guide stations",
                                           "parts",
                                           "part bodies",
                                           "part scenes",
                                           "driven parts",
                                           "body pairs",
                                           "stages"};
  const auto number = static_cast<std::uint32_t>(id);
  static_assert(std::size(kNames) == static_cast<std::size_t>(SectionId::kStages));
  if (number >= 1 && number <= std::size(kNames)) return kNames[number - 1];
  return "section " + std::to_string(number);
}

SceneFacts facts_of(const SceneView& view) {
  SceneFacts facts;
  const SceneHeader& header = view.header();
  facts.parameters = view.parameters();
  facts.name = view.text(facts.parameters.name_offset, facts.parameters.name_bytes);
  facts.size = served_size(view);
  facts.budget = passivity_budget(facts.parameters, facts.size.radius_m);
  facts.bytes = header.byte_count;
  facts.content_hash = header.content_hash;
  facts.scalar_bytes = header.scalar_bytes;
  facts.capacity = header.capacity;
  facts.pair_count = view.pair_count();
  facts.state = HapticCore::state_account(view);
  if ((header.capacity.unproven & kUnprovenNearPairs) != 0 && facts.pair_count <= kMostNearPairs) {
    const SceneBytes roomy = changed_scene(view, [&](SceneParameters& p) {
      p.coupling.near_pairs = static_cast<std::uint32_t>(facts.pair_count);
    });
    SceneView changed;
    if (SceneView::open(roomy.span(), changed) == RtStatus::kOk) {
      facts.state_with_all_pairs = changed.header().capacity.state_bytes;
    }
  }
  for (const SectionEntry& s : view.sections()) {
    facts.sections.push_back(
        {s.id, section_name(s.id), s.element_bytes, s.count, s.count * s.element_bytes});
  }
  PartScenes parts;
  const bool has_parts = PartScenes::open(view, parts) == RtStatus::kOk && parts.count() > 0;
  for (std::uint32_t b = 0; b < view.bodies().size(); ++b) {
    const BodyRecord& record = view.bodies()[b];
    BodyFacts body;
    if (has_parts) {
      body.role = parts[b].role;
      body.held_bytes = parts.may_be_held(b) ? parts.scene_of(b).size() : 0;
    }
    body.name = view.text(record.name_offset, record.name_bytes);
    std::copy(std::begin(record.reference_m), std::end(record.reference_m),
              body.reference_m.begin());
    body.volume_m3 = record.volume_m3;
    body.friction = record.friction;
    body.friction_static = record.friction_static;
    body.planes = record.plane_count;
    for (std::uint32_t i = 0; i < record.piece_count; ++i) {
      body.pieces.push_back(piece_facts(view.piece(record.piece_begin + i)));
    }
    body.recheck = recheck_body(view, b);
    facts.bodies.push_back(std::move(body));
  }
  if (has_parts) {
    facts.parts = parts_facts(view, parts);
    add_driven(parts, facts);
  }
  for (const SimplifiedBody& s : view.simplified_bodies()) facts.bodies[s.body].simplified = s;
  std::vector<PieceSpread> spreads;
  for (std::uint32_t i = 0; i < view.pieces().size(); ++i) spreads.emplace_back(view.piece(i));
  const bool wide = wide_lists(view);
  for (std::uint32_t i = 0; i < view.listed_pairs().size(); ++i) {
    const PairRecord& record = view.listed_pairs()[i];
    PairFacts pair =
        pair_facts(view.pair(i), spreads[record.piece_a], spreads[record.piece_b], wide);
    if (pair.stored) facts.stored_graph_bytes += pair.graph_bytes;
    facts.nodes += pair.nodes;
    facts.arcs += pair.arcs;
    for (std::size_t k = 0; k < 3; ++k) {
      merge(facts.types[k], pair.types[k]);
      finish(pair.types[k]);
    }
    facts.pairs.push_back(pair);
  }
  for (NeighborhoodFacts& type : facts.types) finish(type);
  return facts;
}

}  // namespace haptic::tools
