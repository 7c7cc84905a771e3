// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which features of a body's pieces lie on its surface, from the tables of a compiled scene alone
/// (tools/graph_compiler/METHOD.md section 11, "Seams"). The compiler decides this with exact
/// numbers before it rounds; here the rounded tables decide, in double with a tolerance, so that
/// the two answers check each other. Planes that pieces share are still known by their number, not
/// by their digits.

#include <cstdint>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "tools/graph_compiler/graph/pruning_marks.hpp"

namespace haptic::tools {

/// Exposure of the pieces of `body` in their order, features numbered as in the tables; coordinates
/// in the body's geometry frame. Anything thinner than `tolerance_m` counts as covered.
/// Cost: pairs of pieces that meet, times their faces times vertices.
std::vector<PieceExposure> exposure_of_body(const SceneView& view, std::uint32_t body,
                                            double tolerance_m);

}  // namespace haptic::tools
