// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A second way to the closest point of a polyhedron: its dual as a problem of non-negative least
/// squares (Lawson and Hanson, Solving Least Squares Problems, 1974, chapter 23: LDP by NNLS), with
/// Householder factors computed afresh in every step. Double precision for any Real.

#include <array>
#include <span>

#include "rt_core/law/proxy_qp.hpp"

namespace haptic::test {

struct NnlsResult {
  std::array<double, 6> z{};
  double residual2 = 0;    ///< of the least squares problem; 0: no feasible point
  int steps = 0;           ///< least squares problems solved
  bool converged = false;  ///< not ended by the limit on the steps
};

/// min |z| over g_i.z >= h_i. At least one row.
NnlsResult dual_nnls(std::span<const QpRow> rows);

}  // namespace haptic::test
