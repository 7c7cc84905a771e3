// SPDX-License-Identifier: Apache-2.0
#include "tests/support/active_set_oracle.hpp"

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

}  // namespace haptic::test
