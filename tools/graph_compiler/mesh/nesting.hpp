// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which shell lies in which: solids, their voids, and the final orientation (METHOD section 3,
/// step 3).

#include <cstdint>
#include <vector>

#include "tools/graph_compiler/mesh/shells.hpp"

namespace haptic::tools {

/// Tells solids from cavities and turns every shell to its side: a shell inside material that is
/// inverted against the outermost shell around it is a void of the innermost solid there; one that
/// points the same way is a solid that overlaps the one around it (a warning); one in a void is a
/// solid again. A part that is inside-out as a whole is turned as a whole. A shell lies in another
/// iff none of its vertices is outside of it and one (or, if all are on its surface, the middle of
/// a face) is inside; shells that overlap lie side by side. Cost: O(V log F) for shells whose boxes
/// are nested, nothing for the others.
/// @return the shells as the surface lists them; `solid_count` is set.
std::vector<Shell> nest_shells(WorkMesh& mesh, std::vector<WorkShell>& work_shells,
                               std::vector<std::uint8_t>& flipped, std::size_t& solid_count);

}  // namespace haptic::tools
