// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_inspect/pruning_recheck.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/pruning/scene_pruning.hpp"
#include "tools/scene_facts/scene_facts.hpp"
#include "tools/scene_inspect/piece_exposure.hpp"

namespace haptic::tools {
namespace {

/// The repeated decision asks for a little less than the compiler's, so that rounding never makes
/// it ask for more: an envelope narrower by this [rad], a box smaller by this share.
constexpr double kNarrower_rad = sizeof(Real) == sizeof(double) ? 1.0e-6 : 1.0e-3;
constexpr double kSmaller = sizeof(Real) == sizeof(double) ? 1.0e-9 : 1.0e-5;

/// Lengths that are none between the pieces of a body. In single precision a bevel may be as small
/// as the 256 roundings of body_tolerance, and planes beside an edge would seem to hold it: 16,
/// where stored vertices and planes are off by a few.
double exposure_tolerance(const SceneView& view, std::uint32_t body) {
  constexpr double kShare = HAPTIC_REAL_IS_FLOAT ? 1.0 / 16 : 1.0;
  return kShare * body_tolerance(view, body);
}

ConvexPiece piece_of(const PieceView& view) {
  ConvexPiece piece;
  for (std::uint32_t v = 0; v < view.vertex_count; ++v) {
    const auto x = view.vertex(v);
    piece.vertices.push_back(
        {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])});
    piece.source_vertex.push_back(view.source_vertices[v]);
  }
  for (std::uint32_t f = 0; f < view.face_count; ++f) {
    const auto loop = view.face_vertices(f);
    piece.faces.push_back({view.faces[f].plane,
                           view.faces[f].sign,
                           {loop.begin(), loop.end()},
                           view.faces[f].source_face});
  }
  piece.volume_m3 = view.record->volume_m3;
  return piece;
}

PlacedBody body_of(const SceneView& view, std::uint32_t index) {
  const BodyRecord& record = view.bodies()[index];
  PlacedBody placed;
  placed.body.name = view.text(record.name_offset, record.name_bytes);
  placed.body.volume_m3 = record.volume_m3;
  placed.friction = record.friction;
  placed.friction_static = record.friction_static;
  for (std::uint32_t i = 0; i < record.piece_count; ++i) {
    placed.body.pieces.push_back(piece_of(view.piece(record.piece_begin + i)));
  }
  const PlaneRecord* const planes = view.piece(record.piece_begin).planes;
  for (std::uint32_t p = 0; p < record.plane_count; ++p) {
    placed.body.planes.push_back(
        {{static_cast<double>(planes[p].normal[0]), static_cast<double>(planes[p].normal[1]),
          static_cast<double>(planes[p].normal[2])},
         static_cast<double>(planes[p].offset_m)});
  }
  if (index == 0) {
    std::ranges::copy(record.reference_m, placed.mesh_origin_m.begin());
  } else {
    std::ranges::copy(record.reference_m, placed.position_m.begin());
  }
  return placed;
}

void narrow(SceneDescription& description) {
  if (description.orientation) {
    double& angle = description.orientation->max_angle_rad;
    angle = std::max(0.0, angle - kNarrower_rad);
  }
  if (!description.workspace) return;
  WorkspaceBox& box = *description.workspace;
  for (std::size_t k = 0; k < 3; ++k) {
    const double size = std::max({std::abs(box.min_m[k]), std::abs(box.max_m[k]), 1.0e-3});
    const double by = std::min(kSmaller * size, (box.max_m[k] - box.min_m[k]) / 2);
    box.min_m[k] += by;
    box.max_m[k] -= by;
  }
}

HiddenCount hidden_count(const std::vector<bool>& hidden) {
  return {static_cast<std::size_t>(std::ranges::count(hidden, true)), hidden.size()};
}

PieceHidden hidden_of(const PieceExposure& exposure) {
  const auto covered =
      std::ranges::count_if(exposure.face_fragments, [](const auto& f) { return !f.empty(); });
  return {hidden_count(exposure.face_hidden), hidden_count(exposure.edge_hidden),
          hidden_count(exposure.vertex_hidden), static_cast<std::size_t>(covered)};
}

std::size_t shown(const HiddenCount& count) { return count.all - count.hidden; }

NodeCounts node_counts(const PieceHidden& a, const PieceHidden& b,
                       std::size_t (*of)(const HiddenCount&)) {
  return {of(a.faces) * of(b.vertices), of(a.vertices) * of(b.faces), of(a.edges) * of(b.edges)};
}

NodeCounts marked(const NodeMarks& marks, NodeScope scope, const PairRecord& record) {
  NodeCounts counts;
  for (std::uint32_t node = 0; node < record.node_count; ++node) {
    if (!marks.node(scope, node)) continue;
    ++(node < record.node_count_a                         ? counts.a
       : node < record.node_count_a + record.node_count_b ? counts.b
                                                          : counts.c);
  }
  return counts;
}

/// Nodes that the repeated decision needs, and those of them that the scene has not.
struct Needed {
  std::uint64_t live = 0, missing = 0;
};
Needed compare(const PairMarks& again, const NodeMarks* stated) {
  Needed needed;
  for (std::uint32_t node = 0; node < again.reachable.size(); ++node) {
    if (again.live(node)) ++needed.live;
    if (stated == nullptr) {
      needed.missing += again.near && again.reachable[node] ? 1u : 0u;
    } else {
      const bool left_out = (again.reachable[node] && !stated->node(NodeScope::kReachable, node)) ||
                            (again.live(node) && !stated->node(NodeScope::kLive, node));
      needed.missing += left_out ? 1u : 0u;
    }
  }
  return needed;
}

/// The scene with everything kept; `result.unpruned`, or why there is none.
void write_unpruned(const SceneView& view, SceneDescription description, PruningRecheck& result) {
  description.prune = false;
  description.marks.clear();
  description.exposure.clear();
  description.workspace.reset();
  description.orientation.reset();
  description.parameters.envelope = {};
  const std::uint32_t visits = view.header().capacity.max_pair_visits;
  // A scene that may search all its pairs is compared with one that may search all of them.
  const bool all = visits == view.pair_count();
  description.max_pair_visits = all ? std::numeric_limits<std::uint32_t>::max() : visits;
  try {
    const SceneBytes bytes{write_scene(description)};
    SceneHeader header;
    std::memcpy(&header, bytes.span().data(), sizeof header);
    result.unpruned = UnprunedScene{header.byte_count, header.capacity};
  } catch (const InputError& error) {
    result.not_compared = error.what();
  }
}

PairPruning pair_pruning(const SceneView& view, std::uint32_t a, std::uint32_t b,
                         std::uint32_t& next, const PairMarks& again, PruningRecheck& result) {
  PairPruning pair;
  pair.piece_a = a;
  pair.piece_b = b;
  pair.counts.nodes = node_counts(result.pieces[a], result.pieces[b],
                                  [](const HiddenCount& count) { return count.all; });
  pair.counts.open = node_counts(result.pieces[a], result.pieces[b], shown);
  pair.in_scene = next < view.pair_count() && view.pair_record(next).piece_a == a &&
                  view.pair_record(next).piece_b == b;
  Needed needed;
  if (pair.in_scene) {
    const PairView stated = view.pair(next++);
    pair.marked = stated.marks.given();
    pair.counts.reachable = marked(stated.marks, NodeScope::kReachable, stated.record);
    pair.counts.live = marked(stated.marks, NodeScope::kLive, stated.record);
    needed = compare(again, &stated.marks);
  } else {
    needed = compare(again, nullptr);
  }
  pair.missing = needed.missing;
  result.needed += needed.live;
  result.counts.nodes += pair.counts.nodes;
  result.counts.open += pair.counts.open;
  result.counts.reachable += pair.counts.reachable;
  result.counts.live += pair.counts.live;
  return pair;
}

/// Where pairs are not listed: open features by the repeated decision that the scene calls hidden.
void recheck_pieces(const SceneView& view, const SceneDescription& again,
                    const PruningAccount& account, PruningRecheck& result) {
  result.counts = account.counts;
  NodeCounts open[2];  // faces, edges and vertices that the scene has open, by side
  for (std::uint32_t i = 0; i < view.pieces().size(); ++i) {
    const PieceMarks stated = piece_marks(view.marks().data(), view.pieces()[i]);
    const OpenFeatures& needed = again.open[i];
    NodeCounts& sum = open[i < view.bodies()[0].piece_count ? 0 : 1];
    std::uint64_t missing = 0;
    const auto compare = [&](const std::vector<bool>& features, std::size_t& count,
                             const auto& is_open) {
      for (std::uint32_t k = 0; k < features.size(); ++k) {
        count += is_open(k) ? 1u : 0u;
        missing += features[k] && !is_open(k) ? 1u : 0u;
      }
    };
    compare(needed.faces, sum.a, [&](std::uint32_t f) { return stated.face(f); });
    compare(needed.edges, sum.c, [&](std::uint32_t e) { return stated.edge(e); });
    compare(needed.vertices, sum.b, [&](std::uint32_t v) { return stated.vertex(v); });
    if (result.missing == 0) result.first_missing = i;
    result.missing += missing;
  }
  if (result.has_facets) return;
  result.needed = account.counts.live.all();
  result.counts.live = {open[0].a * open[1].b, open[0].b * open[1].a, open[0].c * open[1].c};
}

}  // namespace

SceneDescription description_of(const SceneView& view) {
  SceneDescription description;
  const SceneParameters& p = view.parameters();
  description.name = view.text(p.name_offset, p.name_bytes);
  description.parameters = p;
  description.moving = body_of(view, 0);
  description.grip_m = description.moving.mesh_origin_m;
  std::ranges::copy(p.start_p_wa_m, description.moving.position_m.begin());
  for (std::size_t k = 0; k < 4; ++k) {
    description.moving.quaternion_wxyz[k] = p.start_q_wa_xyzw[(k + 3) % 4];
  }
  for (std::uint32_t b = 1; b < view.bodies().size(); ++b) {
    description.statics.push_back(body_of(view, b));
  }
  if ((p.envelope.given & kOrientationGiven) != 0) {
    OrientationEnvelope& envelope = description.orientation.emplace();
    std::ranges::copy(p.envelope.q_wa_xyzw, envelope.about_xyzw.begin());
    envelope.max_angle_rad = p.envelope.max_angle_rad;
  }
  if ((p.envelope.given & kWorkspaceGiven) != 0) {
    WorkspaceBox& box = description.workspace.emplace();
    std::ranges::copy(p.envelope.min_m, box.min_m.begin());
    std::ranges::copy(p.envelope.max_m, box.max_m.begin());
  }
  return description;
}

PruningRecheck recheck_pruning(const SceneView& view) {
  PruningRecheck result;
  result.has_facets = view.has_facets();
  for (std::uint32_t b = 0; b < view.bodies().size(); ++b) {
    for (PieceExposure& exposure : exposure_of_body(view, b, exposure_tolerance(view, b))) {
      result.pieces.push_back(hidden_of(exposure));
      result.exposure.push_back(std::move(exposure));
    }
  }
  SceneDescription description = description_of(view);
  SceneDescription again = description;
  again.exposure = result.exposure;
  narrow(again);
  const PruningAccount account = prune_scene(again);
  if (!view.lists_pairs()) recheck_pieces(view, again, account, result);
  const std::uint32_t moving = view.bodies()[0].piece_count;
  std::uint32_t next = 0;
  for (std::uint32_t a = 0; a < moving && view.lists_pairs(); ++a) {
    for (auto b = moving; b < view.pieces().size(); ++b) {
      const PairMarks& marks = again.marks[result.pairs.size()];
      result.pairs.push_back(pair_pruning(view, a, b, next, marks, result));
      if (result.missing == 0) result.first_missing = result.pairs.size() - 1;
      result.missing += result.pairs.back().missing;
    }
  }
  for (const SectionEntry& s : view.sections()) {
    if (s.id == SectionId::kNodeMarks) result.mark_bytes = s.count * s.element_bytes;
  }
  if (result.left_something_out()) write_unpruned(view, std::move(description), result);
  return result;
}

}  // namespace haptic::tools
