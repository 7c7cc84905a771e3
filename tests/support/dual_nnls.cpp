// SPDX-License-Identifier: Apache-2.0
#include "tests/support/dual_nnls.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <vector>

namespace haptic::test {
namespace {

using Columns = Eigen::Matrix<double, 7, Eigen::Dynamic>;
using Weights = Eigen::VectorXd;
using Vec7 = Eigen::Matrix<double, 7, 1>;

constexpr double kSlope = 1e-13;  // of the objective that counts as none, for columns of length 1

/// min |E x - f| with x >= 0; the columns that may be positive are `passive`.
class NonNegativeLeastSquares {
 public:
  NonNegativeLeastSquares(Columns columns, const Vec7& target)
      : columns_(std::move(columns)),
        target_(target),
        x_(Weights::Zero(columns_.cols())),
        refused_(static_cast<std::size_t>(columns_.cols()), false) {}

  bool run(int limit) {
    while (steps_ < limit) {
      const Vec7 residual = target_ - columns_ * x_;
      Eigen::Index best = -1;
      double slope = kSlope;
      for (Eigen::Index k = 0; k < columns_.cols(); ++k) {
        const double s = columns_.col(k).dot(residual);
        if (s > slope && !refused_[static_cast<std::size_t>(k)] && !is_passive(k)) {
          slope = s;
          best = k;
        }
      }
      if (best < 0) return true;
      enter(best, limit);
    }
    return false;
  }
  Vec7 residual() const { return target_ - columns_ * x_; }
  int steps() const { return steps_; }

 private:
  bool is_passive(Eigen::Index k) const {
    return std::find(passive_.begin(), passive_.end(), k) != passive_.end();
  }

  Weights solve() {
    ++steps_;
    Columns chosen(7, static_cast<Eigen::Index>(passive_.size()));
    for (std::size_t i = 0; i < passive_.size(); ++i)
      chosen.col(static_cast<Eigen::Index>(i)) = columns_.col(passive_[i]);
    return chosen.householderQr().solve(target_);
  }

  /// A column whose weight does not become positive was chosen by rounding: it is refused until
  /// another one has entered.
  void enter(Eigen::Index k, int limit) {
    if (passive_.size() == 7) {
      refused_[static_cast<std::size_t>(k)] = true;
      return;
    }
    passive_.push_back(k);
    Weights wanted = solve();
    if (!(wanted[wanted.size() - 1] > 0)) {
      passive_.pop_back();
      refused_[static_cast<std::size_t>(k)] = true;
      return;
    }
    std::fill(refused_.begin(), refused_.end(), false);
    while (wanted.minCoeff() <= 0 && steps_ < limit) {
      double share = 1;
      for (std::size_t i = 0; i < passive_.size(); ++i) {
        const double to = wanted[static_cast<Eigen::Index>(i)], from = x_[passive_[i]];
        if (to <= 0) share = std::min(share, from / (from - to));
      }
      for (std::size_t i = passive_.size(); i-- > 0;) {
        const double to = wanted[static_cast<Eigen::Index>(i)];
        double& from = x_[passive_[i]];
        const bool ends = to <= 0 && from / (from - to) <= share;
        from = ends ? 0 : from + share * (to - from);
        if (from <= 0) passive_.erase(passive_.begin() + static_cast<std::ptrdiff_t>(i));
      }
      if (passive_.empty()) return;
      wanted = solve();
    }
    for (std::size_t i = 0; i < passive_.size(); ++i)
      x_[passive_[i]] = wanted[static_cast<Eigen::Index>(i)];
  }

  Columns columns_;
  Vec7 target_;
  Weights x_;
  std::vector<bool> refused_;
  std::vector<Eigen::Index> passive_;
  int steps_ = 0;
};

}  // namespace

NnlsResult dual_nnls(std::span<const QpRow> rows) {
  // In units of the largest distance, so that the lengths of z and of the target are alike.
  double unit = 0;
  for (const QpRow& row : rows) unit = std::max(unit, std::abs(static_cast<double>(row.h)));
  if (unit == 0) unit = 1;
  Columns columns(7, static_cast<Eigen::Index>(rows.size()));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto c = static_cast<Eigen::Index>(k);
    for (Eigen::Index i = 0; i < 6; ++i) columns(i, c) = static_cast<double>(rows[k].g[i]);
    columns(6, c) = static_cast<double>(rows[k].h) / unit;
  }
  Vec7 target = Vec7::Zero();
  target[6] = 1;
  NonNegativeLeastSquares problem(columns, target);
  NnlsResult result;
  result.converged = problem.run(20 * static_cast<int>(rows.size()) + 100);
  const Vec7 residual = problem.residual();
  result.residual2 = residual.squaredNorm();
  result.steps = problem.steps();
  // residual = (-G^T x, 1 - h.x); the point is G^T x / (1 - h.x).
  for (Eigen::Index i = 0; i < 6; ++i)
    result.z[static_cast<std::size_t>(i)] = -residual[i] / residual[6] * unit;
  return result;
}

}  // namespace haptic::test
