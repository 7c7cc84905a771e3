// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Facts about a compiled scene: counts, sizes, distances. One source
/// of facts for scene_inspect and for the compiler's report.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rt_core/base/state_account.hpp"
#include "rt_core/scene/scene_view.hpp"
#include "tools/graph_compiler/coupling/passivity_budget.hpp"
#include "tools/graph_compiler/coupling/served_size.hpp"

namespace haptic::tools {

struct SectionFacts {
  SectionId id;
  std::string name;
  std::uint64_t element_bytes = 0, count = 0, bytes = 0;
};

/// Features of a piece that come from the user's mesh, and those that cuts made.
struct SourceFacts {
  std::vector<std::int32_t> vertices, faces;  ///< 0-based element of the mesh, -1: made by a cut
  std::uint32_t mesh_vertices = 0, cut_vertices = 0;
  std::uint32_t mesh_faces = 0, cut_faces = 0;
};

struct PieceFacts {
  double volume_m3 = 0.0, radius_m = 0.0, reach_m = 0.0;
  double vertex_relax_m = 0.0, edge_relax_ratio = 1.0;
  std::uint32_t vertices = 0, edges = 0, faces = 0;
  SourceFacts source;
};

/// Sizes of the neighbor subgraphs of single nodes: a node and its neighbors (paper Sec. II-A).
struct NeighborhoodFacts {
  std::uint64_t nodes = 0;
  std::uint32_t smallest = 0, largest = 0;
  double mean = 0.0;
};

struct PairFacts {
  std::uint32_t piece_a = 0, piece_b = 0;
  std::array<NeighborhoodFacts, 3> types;  ///< A (face, vertex), B (vertex, face), C (edge, edge)
  std::uint32_t nodes = 0, max_degree = 0, near_capacity = 0, edge_pair_capacity = 0;
  std::uint64_t edge_pairs = 0;   ///< that can occur
  std::uint64_t live_nodes = 0;   ///< that can be in the near set
  std::uint64_t arcs = 0;         ///< undirected
  bool stored = false;            ///< its graph; else it is formed on the fly
  std::uint64_t graph_bytes = 0;  ///< that its stored graph takes, or would take
};

/// How the pieces of a body lie to each other and to their planes, in doubles
/// (tools/graph_compiler/METHOD.md section 7).
struct BodyRecheck {
  double largest_outside_m = 0.0;  ///< largest height of a vertex over a plane of its own piece
  double largest_off_m = 0.0;  ///< largest distance of a vertex from the plane of a face it bounds
  double tolerance_m = 0.0;    ///< 1e-12 of the body's size, or the rounding of a float scene
  bool convex = false;         ///< both within tolerance
  double volume_m3 = 0.0;      ///< of all pieces, from their vertices
  std::uint64_t piece_pairs = 0;       ///< of solids; facets may cross
  std::uint64_t source_conflicts = 0;  ///< vertices at odds with the mesh vertex that they name
  std::uint64_t separated_pairs =
      0;  ///< within tolerance, by a face plane of one of the two or a plane along edges of both
};

/// A part that its owner moves.
struct DrivenFacts {
  DrivenRecord record{};
  std::uint64_t scenes = 0, scene_bytes = 0;  ///< with the parts that may be held
};

/// A part and another one, or all that stands where the first one moves, that may touch: a scene of
/// their own.
struct PartPairFacts {
  std::string a, b;         ///< `b` empty: all that stands
  std::uint64_t bytes = 0;  ///< of that scene
  PairIndex pairs = 0;      ///< of pieces
};

/// The parts of a scene that may be held, driven or loose, and their memory.
struct PartsFacts {
  std::uint32_t hands = 0;   ///< that hold a part at the start
  std::uint32_t moving = 0;  ///< parts that may move in one tick: 1, one after another
  std::vector<PartPairFacts> pairs;
  /// For one hand two, as it goes on with the other when it takes another part; for two one each.
  std::uint32_t rooms = 0;
  std::uint64_t scene_bytes = 0, state_bytes = 0, law_bytes = 0;  ///< of a room; law: of all parts
  SceneCapacity bounds{};  ///< of a tick of all that moves, with the parts that are held at first
};

struct BodyFacts {
  std::string name;
  std::array<double, 3> reference_m{0, 0, 0};
  double volume_m3 = 0.0;
  double friction = 0.0;                     ///< against the moving part, while it slides
  double friction_static = 0.0;              ///< the same while it sticks
  std::optional<SimplifiedBody> simplified;  ///< absent: the solid of its mesh
  std::uint32_t planes = 0;
  std::vector<PieceFacts> pieces;
  BodyRecheck recheck;
  /// Size of the scene in which the hand holds it, 0: it never does; absent: one part alone moves.
  std::optional<std::uint64_t> held_bytes;
  std::optional<DrivenFacts> driven;  ///< absent: no owner moves it
  std::optional<PartRole> role;       ///< absent: one part alone moves
  /// A surface: facets, which have no volume.
  [[nodiscard]] bool is_surface() const { return !pieces.empty() && pieces.front().faces == 2; }
};

struct SceneFacts {
  std::string name;
  std::uint64_t bytes = 0, content_hash = 0;
  std::uint32_t scalar_bytes = 0;
  SceneCapacity capacity{};
  PairIndex pair_count = 0;
  StateAccount state;  ///< what the loop's memory is for
  /// Size of the state with room for every pair that can be near [bytes]; 0: it has that room, or
  /// no scene may ask for as much.
  std::uint64_t state_with_all_pairs = 0;
  SceneParameters parameters{};
  ServedSize size;         ///< lengths of law proxy
  PassivityBudget budget;  ///< of the device, if there is one
  std::vector<SectionFacts> sections;
  std::vector<BodyFacts> bodies;    ///< body 0 moves
  std::optional<PartsFacts> parts;  ///< absent: one part alone moves
  std::vector<PairFacts> pairs;
  std::array<NeighborhoodFacts, 3> types;  ///< over all pairs
  std::uint64_t nodes = 0, arcs = 0;
  std::uint64_t stored_graph_bytes = 0;  ///< of all stored graphs
};

/// Graph facts are counted from degrees, stored or not. Cost: O(bytes) and O(pieces^2 faces
/// vertices) per body for the recheck.
SceneFacts facts_of(const SceneView& view);

BodyRecheck recheck_body(const SceneView& view, std::uint32_t body);

/// Distance [m] within which a body's tables agree with each other: BodyRecheck::tolerance_m.
double body_tolerance(const SceneView& view, std::uint32_t body);

/// Name of a section for people: "vertices"; "section 42" when unknown.
std::string section_name(SectionId id);

}  // namespace haptic::tools
