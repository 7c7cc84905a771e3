// SPDX-License-Identifier: Apache-2.0
#pragma once
/// From a cleaned surface in double to exact solids: planes fitted by vertex distance, coplanar
/// faces merged into polygons, planes and corners realised as rationals such that every incidence
/// holds exactly (METHOD section 3, steps 4-6, and "Corners on more than three planes").

#include <optional>

#include "tools/common/error.hpp"
#include "tools/graph_compiler/mesh/surface.hpp"
#include "tools/graph_compiler/polyhedron/exact.hpp"
#include "tools/graph_compiler/polyhedron/flatten_merge.hpp"
#include "tools/graph_compiler/polyhedron/plane_fit.hpp"

namespace haptic::tools {

/// More reflex edges than a limit allows.
class ReflexLimitError : public LimitError {
 public:
  ReflexLimitError(const std::string& text, std::size_t edge_count, std::size_t plane_count)
      : LimitError(text), edges(edge_count), planes(plane_count) {}
  std::size_t edges;   ///< count_reflex
  std::size_t planes;  ///< planes_through_reflex
};

struct FlattenLimits {
  std::size_t max_reflex_edges =
      300;                        ///< per body, counted in double before anything exact is computed
  std::size_t first_bits = 4000;  ///< then again without wished-for incidences up to max_bits
  std::size_t max_bits = 65536;
  /// How far a corner may move onto its planes; absent: four plane tolerances.
  std::optional<double> max_move_m = std::nullopt;
};

/// One solid of a body: exact boundary, outer shell and voids together.
struct FlatSolid {
  Solid solid;
  std::vector<std::uint32_t> shells;  ///< indices into Surface::shells
};

struct FlatBody {
  ExactWorld world;
  std::vector<FlatSolid> solids;
  std::size_t merged_plane_count = 0;  ///< planes after fitting
  std::size_t reflex_edge_count = 0;
  double largest_move_m = 0.0;  ///< of any vertex from its cleaned position
  std::size_t largest_bits = 0;
  std::vector<CleaningStep> steps;  ///< "fit planes", "merge coplanar faces", "realise corners"
  std::vector<std::string> warnings;
};

/// @throws InputError with file, element, place in metres (file frame) and fix (METHOD section 9);
/// ReflexLimitError.
FlatBody flatten(const Surface& surface, const FlattenLimits& limits);

/// The same with planes and polygons that were found already. Vertices, `merged.vertex_planes` and
/// the planes of `fit` must agree to within the movement allowed.
FlatBody flatten(const Surface& surface, PlaneFit fit, MergedSurface merged,
                 const FlattenLimits& limits);

}  // namespace haptic::tools
