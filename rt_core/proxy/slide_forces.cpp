// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/slide_forces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace haptic {
namespace {

/// Added to the squares of a balance, as a share of all: planes that depend on each other share
/// what is asked of them.
constexpr Real kSoftShare = sizeof(Real) == sizeof(float) ? 1.0e-5_r : 1.0e-12_r;

using QpMatrix = Eigen::Matrix<Real, kQpSize, kQpSize, Eigen::DontAlign>;

/// Of a symmetric, positive definite matrix, the lower triangle of its Cholesky factor in place.
void factorise(QpMatrix& a, int size) noexcept {
  for (int i = 0; i < size; ++i) {
    for (int k = 0; k <= i; ++k) {
      Real sum = a(i, k);
      for (int j = 0; j < k; ++j) sum -= a(i, j) * a(k, j);
      a(i, k) = i > k ? sum / a(k, k) : std::sqrt(std::max(sum, std::numeric_limits<Real>::min()));
    }
  }
}

void solve(const QpMatrix& factor, int size, QpVector& x) noexcept {
  for (int i = 0; i < size; ++i) {
    for (int k = 0; k < i; ++k) x[i] -= factor(i, k) * x[k];
    x[i] /= factor(i, i);
  }
  for (int i = size; i-- > 0;) {
    for (int k = i + 1; k < size; ++k) x[i] -= factor(k, i) * x[k];
    x[i] /= factor(i, i);
  }
}

}  // namespace

QpVector balance(std::span<SlideForce> forces, const QpVector& error) noexcept {
  const int count = static_cast<int>(std::min<std::size_t>(forces.size(), kQpSize));
  const auto at = [&](int k) -> SlideForce& { return forces[static_cast<std::size_t>(k)]; };
  // A z = sum f_i d_i + b, with what the friction turns by on the left.
  QpMatrix a = QpMatrix::Identity(), moves = QpMatrix::Zero();
  QpVector z = QpVector::Zero();
  for (int k = 0; k < count; ++k) {
    const SlideForce& force = at(k);
    if (!(force.turns > 0)) continue;
    for (int i = 0; i < kQpSize; ++i) a.col(i) += force.turns * force.across[i] * force.across;
    z -= force.turns * force.across.dot(error) * force.across;
  }
  factorise(a, kQpSize);
  solve(a, kQpSize, z);
  for (int k = 0; k < count; ++k) {
    QpVector move = at(k).along;
    solve(a, kQpSize, move);
    moves.col(k) = move;
    z += at(k).size * move;
  }
  // The smallest change of the forces, by the squares of their equations.
  QpMatrix m = QpMatrix::Zero(), squares = QpMatrix::Zero();
  QpVector change = QpVector::Zero();
  for (int i = 0; i < count; ++i) {
    const Real lacks = at(i).h - at(i).plane.dot(z);
    for (int k = 0; k < count; ++k) {
      m(i, k) = at(i).plane.dot(moves.col(k));
      change[k] += lacks * m(i, k);
    }
  }
  Real trace = 0;
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k <= i; ++k) {
      Real sum = 0;
      for (int j = 0; j < count; ++j) sum += m(j, i) * m(j, k);
      squares(i, k) = sum;
    }
    trace += squares(i, i);
  }
  for (int i = 0; i < count; ++i) squares(i, i) += kSoftShare * trace;
  factorise(squares, count);
  solve(squares, count, change);
  for (int k = 0; k < count; ++k) {
    at(k).size += change[k];
    z += change[k] * moves.col(k);
  }
  return z;
}

}  // namespace haptic
