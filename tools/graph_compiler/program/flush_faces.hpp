// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Faces of different fixed parts that go on beside each other and are almost in one plane: the
/// step between them, which the eye does not see, is climbed by law kProxy up to its climb_m and
/// holds the part beyond.

#include <span>
#include <string>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "tools/graph_compiler/graph/pruning_marks.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {

/// The highest step between faces of two fixed bodies.
struct FlushStep {
  std::uint32_t body = 0, other = 0;  ///< of the scene; static part k is body k + 1
  double height_m = 0.0;
  Point3 place_m{0, 0, 0};  ///< W
};

/// One for every two fixed bodies that have faces nearly in one plane (within 0.6 degrees), facing
/// the same way, beside or over each other, whose height differs by more than `least_m` and no more
/// than `most_m`. Steps are measured at the corners of the faces. `exposure`: of all pieces; faces
/// within a part do not count; empty: all do. By body. Cost: O(faces log faces).
std::vector<FlushStep> flush_steps(const SceneView& scene, std::span<const PieceExposure> exposure,
                                   double least_m, double most_m);

/// Steps up to so many times the height that is climbed are told of.
inline constexpr double kToldClimbs = 20.0;

/// "faces of [[static]] 1 (a.stl) and 2 (b.stl) lie 7.3e-08 m apart in height near (..) m: ..".
std::string flush_step_text(const FlushStep& step, const std::string& mesh,
                            const std::string& other_mesh, double climb_m);

}  // namespace haptic::tools
