// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Principal axes of points, for fitting planes.

#include <array>

namespace haptic::tools {

/// Eigenvectors of a symmetric 3x3 matrix by cyclic Jacobi rotations, in double: they become the
/// columns of `vectors`, and `a` becomes diagonal. At most 24 sweeps; two or three suffice. The
/// same bits with every compiler.
void diagonalise(std::array<std::array<double, 3>, 3>& a,
                 std::array<std::array<double, 3>, 3>& vectors);

}  // namespace haptic::tools
