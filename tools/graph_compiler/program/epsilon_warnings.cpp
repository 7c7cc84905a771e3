// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/epsilon_warnings.hpp"

#include <cstdio>

namespace haptic::tools {
namespace {

std::string millimetres(double x_m) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g mm", 1e3 * x_m);
  return text;
}

/// The worst piece of a part by one measure, and how many fall short of epsilon.
struct Shortfall {
  std::size_t pieces = 0, worst = 0;
  double least_m = 0.0;

  void add(std::size_t piece, double size_m, double epsilon_m) {
    if (size_m > epsilon_m) return;
    if (pieces == 0 || size_m < least_m) {
      worst = piece;
      least_m = size_m;
    }
    pieces += 1;
  }
};

std::string sentence(const std::string& mesh, const Shortfall& shortfall,
                     const std::string& feature, double epsilon_m) {
  std::string text = mesh + ": epsilon_m " + millimetres(epsilon_m) + " exceeds " + feature + " " +
                     millimetres(shortfall.least_m);
  if (shortfall.pieces > 1) {
    text += " (and so in " + std::to_string(shortfall.pieces - 1) + " more pieces)";
  }
  return text + "; the tracker stays exact but is slower; fix: epsilon_m below " +
         millimetres(shortfall.least_m / 2) + ", or a part without such features";
}

}  // namespace

std::vector<std::string> epsilon_warnings(const CompiledScene& compiled) {
  std::vector<std::string> result;
  if (compiled.account.edges.empty()) return result;  // a part that never turns has no such bounds
  const double epsilon_m = compiled.scene.parameters.epsilon_m;
  std::size_t first = 0;
  for (const PartReport& part : compiled.parts) {
    Shortfall width, depth;
    for (std::size_t i = 0; i < part.pieces.size(); ++i) {
      width.add(i, compiled.account.edges[first + i].width_m, epsilon_m);
      depth.add(i, compiled.account.vertices[first + i].depth_m, epsilon_m);
    }
    if (width.pieces > 0) {
      const EdgeRelaxation& edge = compiled.account.edges[first + width.worst];
      result.push_back(sentence(part.mesh, width,
                                "the width of face " + std::to_string(edge.face) + " across edge " +
                                    std::to_string(edge.edge) + " of piece " +
                                    std::to_string(width.worst) + ",",
                                epsilon_m));
    }
    if (depth.pieces > 0) {
      const VertexRelaxation& vertex = compiled.account.vertices[first + depth.worst];
      result.push_back(sentence(part.mesh, depth,
                                "the height of vertex " + std::to_string(vertex.vertex) +
                                    " of piece " + std::to_string(depth.worst) +
                                    " over its neighbors,",
                                epsilon_m));
    }
    first += part.pieces.size();
  }
  return result;
}

}  // namespace haptic::tools
