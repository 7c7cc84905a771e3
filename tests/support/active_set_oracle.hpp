// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The closest point of a polyhedron by trying every set of up to six rows that could hold it.

#include <array>
#include <span>

#include "rt_core/law/proxy_qp.hpp"

namespace haptic::test {

struct EnumeratedPoint {
  std::array<long double, 6> z{};
  /// Largest violation of a row at z: z is the best of all points that rows can hold by pushing;
  /// the problem is feasible where this is rounding.
  long double violation = 0;
  int sets = 0;  ///< whose rows are independent
};

/// min |z| over g_i.z >= h_i, at most 12 rows: 2510 sets, each by a Cholesky factor in long double.
/// Sets with rows that depend on each other to 1e-10 of their length are left out; another set
/// holds the same point without them.
EnumeratedPoint enumerate_active_sets(std::span<const QpRow> rows);

}  // namespace haptic::test
