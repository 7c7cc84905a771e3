// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The whole chain: mesh -> cleaned surface -> flat body -> convex pieces -> bytes of the scene,
/// with an account of what was done to every part.

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/graph_compiler/graph/convex_piece.hpp"
#include "tools/graph_compiler/graph/scene_account.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/mesh/surface.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"
#include "tools/graph_compiler/program/scene_file.hpp"
#include "tools/graph_compiler/program/start_pose.hpp"
#include "tools/graph_compiler/program/steady_work.hpp"
#include "tools/graph_compiler/pruning/pruning_account.hpp"
#include "tools/graph_compiler/simplify/edge_collapse.hpp"
#include "tools/graph_compiler/simplify/simplification.hpp"
#include "tools/graph_compiler/surface/surface_part.hpp"

namespace haptic::tools {

/// Seconds spent; in the report under its own key, since everything else is reproducible.
struct PartTiming {
  double read_s = 0.0, clean_s = 0.0, flatten_s = 0.0, decompose_s = 0.0, facets_s = 0.0;
};

/// Report about one mesh.
struct PartReport {
  std::string mesh;                      ///< as written in the scene file; of a shape its word
  std::string file;                      ///< path that messages of the steps start with
  std::optional<Shape> shape;            ///< instead of a file
  std::optional<Deflection> deflection;  ///< of STEP
  [[nodiscard]] bool is_surface() const { return surface.has_value(); }
  std::array<double, 3> scale_to_m{1, 1, 1};
  std::size_t mesh_vertices = 0, mesh_faces = 0;
  double plane_tolerance_m = 0.0, diagonal_m = 0.0;
  std::vector<CleaningStep> steps;    ///< cleaning, then flattening
  std::vector<std::string> warnings;  ///< of all steps, without the file's name
  std::size_t shells = 0, solids = 0, planes = 0, reflex_edges = 0;
  double largest_move_m = 0.0;  ///< of any vertex from its cleaned position
  std::size_t largest_bits = 0;
  std::optional<SimplifyAccount> simplified;  ///< of a solid; absent: not asked for
  std::optional<CollapseAccount> collapsed;   ///< of a surface; absent: not asked for
  std::size_t face_plane_only_pieces = 0;
  double thinnest_m = 0.0;
  double work = 0.0;
  Certificate certificate;
  std::string
      reason;  ///< why it is what it is, with counts: "2 open edges (a solid needs none); .."
  std::optional<SurfaceAccount> surface;  ///< absent: the part is a solid
  double volume_m3 = 0.0;
  std::vector<ConvexPiece> pieces;
  PartTiming timing;
};

struct CompiledScene {
  std::vector<std::byte> bytes;
  SceneFile scene;
  std::vector<PartReport> parts;         ///< moving part first
  SceneAccount account;                  ///< of the pieces, moving part first
  PruningAccount pruning;                ///< which basic contacts are needed
  std::vector<std::string> notes;        ///< on files, coupling, friction and size
  std::vector<StartShape> start_shapes;  ///< where they start, moving part first; where asked for
  std::optional<SteadyWork> steady;      ///< absent: the scene has no motion limits
  double write_s = 0.0;                  ///< bounds, graph and blob
  double total_s = 0.0;                  ///< of all, also of what was tried and given up
};

struct CompileOptions {
  std::optional<double> plane_tolerance_m;  ///< before that of the scene file
  std::optional<std::size_t> max_reflex;    ///< reflex edges per part; absent: by cost beyond 300
  bool prune = true;                        ///< false: keep every basic contact
  std::optional<std::size_t> max_pieces;    ///< convex pieces per part
  std::optional<double> work_limit;         ///< units of exact work per part
  std::optional<double> simplify_m;         ///< before that of every part
  bool disjoint = false;                    ///< for every part, besides what the parts ask for
  bool propose_tolerance = false;           ///< try which one meets the budget of the rate
  bool for_questions = false;               ///< about places: start shapes are kept
  bool image = false;                       ///< for a core that is compiled for this scene
  double flat_share = 1.0e-14;              ///< of a surface's diagonal (surface_part.hpp)
  /// Called during long work with the part's mesh, what is being done, and the fraction done in [0,
  /// 1].
  std::function<void(const std::string& mesh, const char* step, double fraction)> progress;
};

/// @throws InputError from any step, BudgetError (program/memory_budget.hpp) when the scene exceeds
/// its budget, InputError when a gain exceeds what the device can hold, or when law proxy does not
/// serve the size.
CompiledScene compile_scene(const SceneFile& scene, const CompileOptions& options);

}  // namespace haptic::tools
