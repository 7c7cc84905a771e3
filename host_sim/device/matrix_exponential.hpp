// SPDX-License-Identifier: Apache-2.0
#pragma once
/// exp of a small square matrix, for exact discretisation of linear systems.

#include <Eigen/Core>
#include <cmath>

namespace haptic::sim {

/// Scaling and squaring over a Taylor sum of degree 18: the scaled norm is at most 1/2, where the
/// rest of the sum is below 1e-22. `a` is square and finite. Cost: about 20 + log2(|a|) products.
template <typename Matrix>
[[nodiscard]] Matrix matrix_exponential(const Matrix& a) {
  constexpr int kDegree = 18;
  const double norm = a.cwiseAbs().colwise().sum().maxCoeff();
  int halvings = 0;
  if (norm > 0.5) halvings = std::max(0, std::ilogb(norm) + 2);
  const Matrix scaled = std::ldexp(1.0, -halvings) * a;
  const Matrix one = Matrix::Identity(a.rows(), a.cols());
  Matrix sum = one;
  for (int k = kDegree; k >= 1; --k) sum = one + scaled * sum / static_cast<double>(k);
  for (int k = 0; k < halvings; ++k) sum = (sum * sum).eval();
  return sum;
}

}  // namespace haptic::sim
