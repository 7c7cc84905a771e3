// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/proxy_qp.hpp"

#include <algorithm>
#include <limits>

#include "rt_core/contact/lanes.hpp"

namespace haptic {
namespace {

constexpr std::uint32_t kDimension = kQpSize;
/// A row of which no larger share than this stands out of the active ones depends on them. In
/// single precision the root of the rounding: a larger share would bend z by that share, a smaller
/// one would multiply the rounding of z by its inverse, and there both errors are equal. In double
/// precision it is wider, because normals of one face that come from several pieces differ by more
/// than their rounding.
constexpr Real kDependence2 = HAPTIC_REAL_IS_FLOAT ? kRealEpsilon : 1.0e-12_r;
/// Coefficients of a dependent row, squared, that rounding can have made: they are known to the
/// rounding times the condition that kDependence2 leaves to the active rows.
constexpr Real kRounding2 = kRealEpsilon * kRealEpsilon / kDependence2;

using Coefficients = std::array<Real, kDimension>;

/// The products in one fixed order, as a tree: short chains, the same bits in every build.
inline Real dot(const QpVector& l, const QpVector& r) noexcept {
  const Real plane = l[0] * r[0] + l[1] * r[1];
  if constexpr (kQpSize == 3) {
    return plane + l[2] * r[2];
  } else {
    return (plane + (l[2] * r[2] + l[3] * r[3])) + (l[4] * r[4] + l[5] * r[5]);
  }
}

/// Rows that are not candidates: the active and the skipped ones.
class ClosedRows {
 public:
  [[nodiscard]] bool contains(std::uint32_t row) const noexcept {
    return ((word_[row / 64] >> (row % 64)) & 1u) != 0;
  }
  void insert(std::uint32_t row) noexcept { word_[row / 64] |= std::uint64_t{1} << (row % 64); }
  void erase(std::uint32_t row) noexcept { word_[row / 64] &= ~(std::uint64_t{1} << (row % 64)); }

 private:
  std::array<std::uint64_t, (kMaxQpRows + 63) / 64> word_{};
};

/// A vector split by the active rows: g = sum coefficient_j g_j + rest, rest square to all of them.
struct Split {
  QpVector rest;
  Real rest2 = 0;
  Coefficients part{};         ///< of the orthogonal vectors
  Coefficients coefficient{};  ///< of the rows
};

/// The search: z is the closest point of the active rows alone, which all hold it, z = sum
/// multiplier_j g_j with multipliers >= 0. Rows are orthogonalised in the order of their entry
/// without roots: g_j = sum_(i <= j) factor_ij orthogonal_i, factor_jj = 1.
class DualSearch {
 public:
  explicit DualSearch(std::span<const QpRow> rows) noexcept : rows_(rows) {}

  /// Makes row p, violated by `violation`, hold, or skips it, or runs out of iterations.
  void enter(std::uint32_t p, Real violation) noexcept;
  [[nodiscard]] bool exhausted() const noexcept { return iterations_ >= kMaxQpIterations; }
  [[nodiscard]] const QpVector& z() const noexcept { return z_; }
  [[nodiscard]] const ClosedRows& closed() const noexcept { return closed_; }
  [[nodiscard]] QpResult result(bool capped) const noexcept;

 private:
  /// What a row that cannot enter after all is taken back to.
  struct Mark {
    QpVector z;
    Coefficients multiplier;
    std::array<std::uint8_t, kDimension> row;
    std::uint32_t count;
  };
  /// How far the multiplier of the entering row grows, as a fraction; below 0 is 1 / 0: for ever.
  struct Step {
    Real numerator = 1, denominator = 0;
    std::uint32_t blocking = kDimension;  ///< position whose multiplier ends at zero
  };

  [[nodiscard]] Split split(const QpVector& g, std::uint32_t count) const noexcept;
  [[nodiscard]] Step longest_step(const Split& s, Real violation, Real length2,
                                  bool dependent) const noexcept;
  void append(std::uint32_t row, const Split& s, Real multiplier, Real length2) noexcept;
  void drop(std::uint32_t position) noexcept;
  void orthogonalise_from(std::uint32_t position) noexcept;
  void restore(const Mark& mark) noexcept;
  void settle() noexcept;
  void solve() noexcept;

  std::span<const QpRow> rows_;
  QpVector z_ = QpVector::Zero();
  std::uint32_t count_ = 0;
  std::uint32_t iterations_ = 0;
  std::uint32_t skipped_ = 0;
  ClosedRows closed_;
  std::array<std::uint8_t, kDimension> row_{};
  Coefficients multiplier_{};
  Coefficients length2_{};          ///< of the rows
  Coefficients inverse_length2_{};  ///< of the orthogonal vectors
  std::array<QpVector, kDimension> orthogonal_;
  std::array<Coefficients, kDimension> factor_;  ///< [j][i], i < j
};

Split DualSearch::split(const QpVector& g, std::uint32_t count) const noexcept {
  Split s;
  s.rest = g;
  // Gram-Schmidt, twice: once leaves in the rest what the rounding of g projects on the others.
  for (std::uint32_t pass = 0; pass < 2; ++pass) {
    Coefficients part;
    for (std::uint32_t i = 0; i < count; ++i)
      part[i] = dot(orthogonal_[i], s.rest) * inverse_length2_[i];
    for (std::uint32_t i = 0; i < count; ++i) {
      s.rest -= part[i] * orthogonal_[i];
      s.part[i] += part[i];
    }
  }
  s.rest2 = dot(s.rest, s.rest);
  return s;
}

DualSearch::Step DualSearch::longest_step(const Split& s, Real violation, Real length2,
                                          bool dependent) const noexcept {
  Step step;
  if (!dependent) {
    step.numerator = violation;
    step.denominator = s.rest2;
  }
  for (std::uint32_t j = 0; j < count_; ++j) {
    const Real c = s.coefficient[j];
    if (c <= 0) continue;
    // Nothing else limits the step along a dependent row: what is only rounding must not.
    if (dependent && c * c * length2_[j] <= kRounding2 * length2) continue;
    if (multiplier_[j] * step.denominator < step.numerator * c) {
      step.numerator = multiplier_[j];
      step.denominator = c;
      step.blocking = j;
    }
  }
  return step;
}

void DualSearch::append(std::uint32_t row, const Split& s, Real multiplier, Real length2) noexcept {
  row_[count_] = static_cast<std::uint8_t>(row);
  closed_.insert(row);
  multiplier_[count_] = multiplier;
  length2_[count_] = length2;
  orthogonal_[count_] = s.rest;
  inverse_length2_[count_] = 1 / s.rest2;
  factor_[count_] = s.part;
  ++count_;
}

void DualSearch::orthogonalise_from(std::uint32_t position) noexcept {
  for (std::uint32_t j = position; j < count_; ++j) {
    const Split s = split(rows_[row_[j]].g, j);
    orthogonal_[j] = s.rest;
    inverse_length2_[j] = 1 / s.rest2;
    factor_[j] = s.part;
  }
}

void DualSearch::drop(std::uint32_t position) noexcept {
  closed_.erase(row_[position]);
  --count_;
  for (std::uint32_t j = position; j < count_; ++j) {
    row_[j] = row_[j + 1];
    multiplier_[j] = multiplier_[j + 1];
    length2_[j] = length2_[j + 1];
  }
  orthogonalise_from(position);
}

void DualSearch::restore(const Mark& mark) noexcept {
  for (std::uint32_t j = 0; j < count_; ++j) closed_.erase(row_[j]);
  z_ = mark.z;
  multiplier_ = mark.multiplier;
  row_ = mark.row;
  count_ = mark.count;
  for (std::uint32_t j = 0; j < count_; ++j) {
    closed_.insert(row_[j]);
    length2_[j] = dot(rows_[row_[j]].g, rows_[row_[j]].g);
  }
  orthogonalise_from(0);
}

/// z and the multipliers of the active rows afresh from their right sides.
void DualSearch::solve() noexcept {
  Coefficients weight{}, height{};
  z_.setZero();
  for (std::uint32_t j = 0; j < count_; ++j) {
    height[j] = rows_[row_[j]].h;
    for (std::uint32_t i = 0; i < j; ++i) height[j] -= factor_[j][i] * height[i];
    weight[j] = height[j] * inverse_length2_[j];
    z_ += weight[j] * orthogonal_[j];
  }
  for (std::uint32_t j = count_; j-- > 0;) {
    multiplier_[j] = weight[j];
    for (std::uint32_t i = 0; i < j; ++i) weight[i] -= factor_[j][i] * weight[j];
  }
}

/// After a step along a dependent row, which is only nearly one: the exact point of the rows that
/// are active now, without those that would pull.
void DualSearch::settle() noexcept {
  for (std::uint32_t pass = 0; pass < kDimension && count_ > 0; ++pass) {
    solve();
    std::uint32_t least = 0;
    for (std::uint32_t j = 1; j < count_; ++j)
      if (multiplier_[j] < multiplier_[least]) least = j;
    if (multiplier_[least] > 0) return;
    drop(least);
  }
}

void DualSearch::enter(std::uint32_t p, Real violation) noexcept {
  const QpVector& g = rows_[p].g;
  const Real length2 = dot(g, g);
  Real multiplier = 0;
  bool partial = false, unsettled = false;
  const Mark mark{z_, multiplier_, row_, count_};
  while (!exhausted()) {
    ++iterations_;
    Split s = split(g, count_);
    s.coefficient = s.part;
    for (std::uint32_t j = count_; j-- > 0;)
      for (std::uint32_t i = 0; i < j; ++i) s.coefficient[i] -= factor_[j][i] * s.coefficient[j];
    const bool dependent = count_ == kDimension || !(s.rest2 > kDependence2 * length2);
    const Step step = longest_step(s, violation, length2, dependent);
    const Real length = step.numerator / step.denominator;
    if (!(length <= std::numeric_limits<Real>::max())) {
      closed_.insert(p);
      ++skipped_;
      break;
    }
    if (step.blocking == kDimension) {
      z_ += length * s.rest;
      for (std::uint32_t j = 0; j < count_; ++j)
        multiplier_[j] = std::max<Real>(0, multiplier_[j] - length * s.coefficient[j]);
      append(p, s, multiplier + length, length2);
      if (unsettled) settle();
      return;
    }
    partial = true;
    unsettled |= dependent;
    if (!dependent) {
      z_ += length * s.rest;
      violation -= length * s.rest2;
    }
    multiplier += length;
    for (std::uint32_t j = 0; j < count_; ++j)
      multiplier_[j] = std::max<Real>(0, multiplier_[j] - length * s.coefficient[j]);
    drop(step.blocking);
  }
  if (partial) restore(mark);
}

QpResult DualSearch::result(bool capped) const noexcept {
  QpResult result;
  result.z = z_;
  result.iterations = iterations_;
  result.skipped = skipped_;
  result.capped = capped;
  for (std::uint32_t j = 0; j < count_; ++j) {
    // Rows that touch z but do not hold it are none of the active.
    if (!(multiplier_[j] > 0)) continue;
    result.active[result.active_count] = row_[j];
    result.multiplier[result.active_count++] = multiplier_[j];
  }
  return result;
}

/// A row and by how much z violates it.
struct Violation {
  Real amount = 0;
  std::uint32_t row = kMaxQpRows;  ///< kMaxQpRows: none
};

/// The row that z violates most, by more than `tolerance`; the lowest index at ties. Rows are the
/// lanes, and nothing branches on what they hold: which row is the worst nobody can foretell.
Violation most_violated(std::span<const QpRow> rows, const QpVector& z, Real tolerance) noexcept {
  RealLanes worst{}, at{}, here{};
  for (std::uint32_t k = 0; k < kLanes; ++k) {
    worst[k] = tolerance;
    at[k] = static_cast<Real>(kMaxQpRows);
    here[k] = static_cast<Real>(k);
  }
  const std::size_t count = rows.size();
  for (std::size_t i = 0; i < count; i += kLanes) {
    std::array<const QpRow*, kLanes> row;
    // Behind the last row it comes again under higher indices, which lose the tie.
    for (std::size_t k = 0; k < kLanes; ++k) row[k] = &rows[std::min(i + k, count - 1)];
    const auto height_along = [&](int c, RealLanes& height) {
      RealLanes g{};
      for (std::uint32_t k = 0; k < kLanes; ++k) g[k] = row[k]->g[c];
      height = g * z[c];
    };
    RealLanes h{}, h0, h1, h2, height;
    for (std::uint32_t k = 0; k < kLanes; ++k) h[k] = row[k]->h;
    height_along(0, h0);
    height_along(1, h1);
    height_along(2, h2);
    if constexpr (kQpSize == 3) {
      height = (h0 + h1) + h2;
    } else {
      RealLanes h3, h4, h5;
      height_along(3, h3);
      height_along(4, h4);
      height_along(5, h5);
      height = ((h0 + h1) + (h2 + h3)) + (h4 + h5);
    }
    const RealLanes violation = h - height;
    const LaneMask more = violation > worst;
    worst = more ? violation : worst;
    at = more ? here : at;
    here += static_cast<Real>(kLanes);
  }
  Violation found{worst[0], static_cast<std::uint32_t>(at[0])};
  for (std::uint32_t k = 1; k < kLanes; ++k) {
    const auto row = static_cast<std::uint32_t>(at[k]);
    if (worst[k] > found.amount || (worst[k] == found.amount && row < found.row))
      found = {worst[k], row};
  }
  return found;
}

/// The same among the rows that are not closed.
Violation most_violated(std::span<const QpRow> rows, const QpVector& z, Real tolerance,
                        const ClosedRows& closed) noexcept {
  Violation found = most_violated(rows, z, tolerance);
  if (found.row == kMaxQpRows || !closed.contains(found.row)) return found;
  // Rare: a skipped row, or an active one that rounding violates by more than the tolerance.
  found = {tolerance, kMaxQpRows};
  for (std::uint32_t i = 0; i < rows.size(); ++i) {
    const Real violation = rows[i].h - dot(rows[i].g, z);
    if (violation > found.amount && !closed.contains(i)) found = {violation, i};
  }
  return found;
}

}  // namespace

QpResult closest_point(std::span<const QpRow> rows, Real tolerance,
                       std::span<const std::uint8_t> first) noexcept {
  rows = rows.first(std::min<std::size_t>(rows.size(), kMaxQpRows));
  DualSearch search(rows);
  for (const std::uint8_t row : first.first(std::min<std::size_t>(first.size(), kDimension))) {
    if (row >= rows.size() || search.closed().contains(row)) continue;
    const Real violation = rows[row].h - dot(rows[row].g, search.z());
    if (violation > tolerance) search.enter(row, violation);
  }
  for (;;) {
    const Violation worst = most_violated(rows, search.z(), tolerance, search.closed());
    const bool met = worst.row == kMaxQpRows;
    if (met || search.exhausted()) return search.result(!met);
    search.enter(worst.row, worst.amount);
  }
}

}  // namespace haptic
