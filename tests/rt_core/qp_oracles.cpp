// SPDX-License-Identifier: Apache-2.0
#include "tests/rt_core/qp_oracles.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace haptic::test {
namespace {

using Wide = long double;
using Wide6 = std::array<Wide, 6>;

Wide dot(const Wide6& l, const Wide6& r) {
  Wide sum = 0;
  for (std::size_t i = 0; i < 6; ++i) sum += l[i] * r[i];
  return sum;
}

struct WideRow {
  Wide6 g;
  Wide h;
};

/// The point that the rows of `set` hold, if they are independent and all push.
bool held_point(const std::vector<const WideRow*>& set, Wide6& z, bool& independent) {
  std::array<Wide6, 6> factor{};
  Wide6 weight{};
  const std::size_t count = set.size();
  for (std::size_t j = 0; j < count; ++j) {
    for (std::size_t i = 0; i <= j; ++i) {
      Wide sum = dot(set[j]->g, set[i]->g);
      for (std::size_t k = 0; k < i; ++k) sum -= factor[j][k] * factor[i][k];
      if (i < j) {
        factor[j][i] = sum / factor[i][i];
      } else {
        independent = sum > 1e-20L * dot(set[j]->g, set[j]->g);
        if (!independent) return false;
        factor[j][j] = std::sqrt(sum);
      }
    }
    Wide sum = set[j]->h;
    for (std::size_t k = 0; k < j; ++k) sum -= factor[j][k] * weight[k];
    weight[j] = sum / factor[j][j];
  }
  for (std::size_t j = count; j-- > 0;) {
    for (std::size_t k = j + 1; k < count; ++k) weight[j] -= factor[k][j] * weight[k];
    weight[j] /= factor[j][j];
    if (weight[j] < 0) return false;
  }
  z = Wide6{};
  for (std::size_t j = 0; j < count; ++j)
    for (std::size_t i = 0; i < 6; ++i) z[i] += weight[j] * set[j]->g[i];
  return true;
}

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

Point tilted(Random& random, Point n, double tilt_rad) {
  double length2 = 0;
  for (double& x : n) {
    x += random.uniform(-tilt_rad, tilt_rad);
    length2 += x * x;
  }
  for (double& x : n) x /= std::sqrt(length2);
  return n;
}

/// The rows n + s friction t for t along and across the way, s = -1 and 1.
void add_pyramid(std::vector<QpRow>& rows, const Point& n, const Point& lever_m, double gap_m,
                 const std::array<double, 6>& way_m, double friction) {
  const double up = n[0] * way_m[0] + n[1] * way_m[1] + n[2] * way_m[2];
  Point t{};
  double length2 = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    t[i] = way_m[i] - up * n[i];
    length2 += t[i] * t[i];
  }
  for (double& x : t) x /= std::sqrt(length2);
  const Point b{n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]};
  for (const Point& side : {t, b}) {
    for (const double s : {-friction, friction}) {
      const Point w{n[0] + s * side[0], n[1] + s * side[1], n[2] + s * side[2]};
      rows.push_back(qp_row(w, lever_m, gap_m, way_m));
    }
  }
}

}  // namespace

EnumeratedPoint enumerate_active_sets(std::span<const QpRow> rows) {
  if (rows.size() > 12) throw std::invalid_argument("enumerate_active_sets: more than 12 rows");
  std::vector<WideRow> wide;
  for (const QpRow& row : rows) {
    WideRow w{{}, static_cast<Wide>(row.h)};
    for (std::size_t i = 0; i < 6; ++i)
      w.g[i] = static_cast<Wide>(row.g[static_cast<Eigen::Index>(i)]);
    wide.push_back(w);
  }
  EnumeratedPoint best;
  best.violation = HUGE_VALL;
  std::vector<const WideRow*> set;
  for (unsigned mask = 0; mask < 1u << wide.size(); ++mask) {
    if (std::popcount(mask) > 6) continue;
    set.clear();
    for (std::size_t k = 0; k < wide.size(); ++k)
      if ((mask >> k & 1u) != 0) set.push_back(&wide[k]);
    Wide6 z{};
    bool independent = true;
    const bool pushes = held_point(set, z, independent);
    best.sets += independent ? 1 : 0;
    if (!pushes) continue;
    Wide violation = 0;
    for (const WideRow& row : wide) violation = std::max(violation, row.h - dot(row.g, z));
    if (violation < best.violation) {
      best.violation = violation;
      best.z = z;
    }
  }
  return best;
}

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

Point random_direction(Random& random) {
  for (;;) {
    Point n{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    const double length2 = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    if (length2 > 1 || length2 < 0.01) continue;
    for (double& x : n) x /= std::sqrt(length2);
    return n;
  }
}

QpRow qp_row(const Point& n, const Point& r, double gap_m, const std::array<double, 6>& way_m) {
  const std::array<double, 6> g = {n[0],
                                   n[1],
                                   n[2],
                                   (r[1] * n[2] - r[2] * n[1]) / kQpLever_m,
                                   (r[2] * n[0] - r[0] * n[2]) / kQpLever_m,
                                   (r[0] * n[1] - r[1] * n[0]) / kQpLever_m};
  QpRow row;
  double along = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    row.g[static_cast<Eigen::Index>(i)] = static_cast<Real>(g[i]);
    along += static_cast<double>(row.g[static_cast<Eigen::Index>(i)]) * way_m[i];
  }
  row.h = static_cast<Real>(-gap_m - along);
  return row;
}

std::vector<QpRow> make_qp(Random& random, const QpFamily& family) {
  std::array<double, 6> way_m{};
  for (double& x : way_m) x = random.uniform(-5e-3, 5e-3);
  std::vector<QpRow> rows;
  Point normal{};
  double gap_m = 0;
  for (int plane = 0; plane < family.planes; ++plane) {
    if (family.opposite && plane % 2 == 1) {
      for (double& x : normal) x = -x;
      gap_m = family.clearance_m - gap_m;
    } else {
      normal = random_direction(random);
      gap_m = random.uniform(0, family.clearance_m);
    }
    for (int point = 0; point < family.points; ++point) {
      const Point lever{random.uniform(-0.04, 0.04), random.uniform(-0.04, 0.04),
                        random.uniform(-0.04, 0.04)};
      for (int copy = 0; copy < family.copies; ++copy) {
        const Point n = family.tilt_rad > 0 ? tilted(random, normal, family.tilt_rad) : normal;
        if (family.friction > 0) {
          add_pyramid(rows, n, lever, gap_m, way_m, family.friction);
        } else {
          rows.push_back(qp_row(n, lever, gap_m, way_m));
        }
      }
    }
  }
  return rows;
}

}  // namespace haptic::test
