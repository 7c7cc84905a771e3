// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which shell lies in which: solids, their voids, and the final orientation (decomposition section
/// 3, step 3).

#include <cstdint>
#include <vector>

#include "tools/graph_compiler/mesh/shells.hpp"

namespace haptic::tools {

/// Turns every shell as its nesting depth asks: even depth outward, odd depth a void of the
/// innermost shell around it, deeper ones solids again. A shell lies in another iff none of its
/// vertices is outside of it and one (or, if all are on its surface, the middle of a face) is
/// inside; shells that overlap lie side by side. A void that points outward in the file is a
/// warning. Cost: O(V log F) for shells whose boxes are nested, nothing for the others.
/// @return the shells as the surface lists them; `solid_count` is set.
std::vector<Shell> nest_shells(WorkMesh& mesh, std::vector<WorkShell>& work_shells,
                               std::vector<std::uint8_t>& flipped, std::size_t& solid_count);

}  // namespace haptic::tools
