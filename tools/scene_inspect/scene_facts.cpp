// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_inspect/scene_facts.hpp"

#include <algorithm>

#include "rt_core/scene/graph_rule.hpp"

namespace haptic::tools {
namespace {

void add_node(NeighborhoodFacts& facts, std::uint32_t size) {
  facts.smallest = facts.nodes == 0 ? size : std::min(facts.smallest, size);
  facts.largest = std::max(facts.largest, size);
  facts.nodes += 1;
  facts.mean += size;  // a sum until finish()
}

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

/// The means are still sums.
PairFacts pair_facts(const PairView& pair) {
  const PairRecord& record = *pair.record;
  PairFacts facts;
  facts.piece_a = record.piece_a;
  facts.piece_b = record.piece_b;
  facts.nodes = record.node_count;
  facts.max_degree = record.max_degree;
  facts.near_capacity = record.near_capacity;
  facts.neighborhood_capacity = record.neighborhood_capacity;
  std::uint64_t entries = 0;
  for (std::uint32_t node = 0; node < record.node_count; ++node) {
    const std::uint32_t degree = pair.neighbors.count(node);
    entries += degree;
    add_node(facts.types[static_cast<std::size_t>(contact_type(record, node))], degree + 1);
  }
  facts.arcs = entries / 2;
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
                                           "text"};
  const auto number = static_cast<std::uint32_t>(id);
  static_assert(std::size(kNames) == static_cast<std::size_t>(SectionId::kText));
  if (number >= 1 && number <= std::size(kNames)) return kNames[number - 1];
  return "section " + std::to_string(number);
}

SceneFacts facts_of(const SceneView& view) {
  SceneFacts facts;
  const SceneHeader& header = view.header();
  facts.parameters = view.parameters();
  facts.name = view.text(facts.parameters.name_offset, facts.parameters.name_bytes);
  facts.bytes = header.byte_count;
  facts.content_hash = header.content_hash;
  facts.scalar_bytes = header.scalar_bytes;
  facts.capacity = header.capacity;
  for (const SectionEntry& s : view.sections()) {
    facts.sections.push_back(
        {s.id, section_name(s.id), s.element_bytes, s.count, s.count * s.element_bytes});
  }
  for (std::uint32_t b = 0; b < view.bodies().size(); ++b) {
    const BodyRecord& record = view.bodies()[b];
    BodyFacts body;
    body.name = view.text(record.name_offset, record.name_bytes);
    std::copy(std::begin(record.reference_m), std::end(record.reference_m),
              body.reference_m.begin());
    body.volume_m3 = record.volume_m3;
    body.planes = record.plane_count;
    for (std::uint32_t i = 0; i < record.piece_count; ++i) {
      body.pieces.push_back(piece_facts(view.piece(record.piece_begin + i)));
    }
    body.recheck = recheck_body(view, b);
    facts.bodies.push_back(std::move(body));
  }
  for (std::uint32_t i = 0; i < view.pairs().size(); ++i) {
    PairFacts pair = pair_facts(view.pair(i));
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
