// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule although every size is fixed: Eigen's product of 8 x 8 takes its
// workspace from the heap where it does not fit the compiler's idea of a small product.
#include <Eigen/Core>

void product(const Eigen::Matrix<double, 200, 200>& a, const Eigen::Matrix<double, 200, 200>& b,
             Eigen::Matrix<double, 200, 200>& c) {
  c.noalias() = a * b;
}
