// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Findings of the writer about the pieces of a scene in addition to the bytes: where its bounds of
/// the search are reached, for the words of a report.

#include <cstdint>
#include <vector>

namespace haptic::tools {

/// PieceRecord::edge_relax_ratio, and where it is taken.
struct EdgeRelaxation {
  double ratio = 1.0;
  std::uint32_t edge = 0, face = 0;  ///< face of the side that rises
  double width_m = 0.0;              ///< of that face across the edge
};

/// PieceRecord::vertex_relax_m, and where it is taken.
struct VertexRelaxation {
  double relax_m = 0.0;
  std::uint32_t vertex = 0;
  double depth_m =
      0.0;  ///< of that vertex over a plane through three of its neighbors (VertexRise)
};

/// By piece, in the order of the scene.
struct SceneAccount {
  std::vector<EdgeRelaxation> edges;
  std::vector<VertexRelaxation> vertices;
};

}  // namespace haptic::tools
