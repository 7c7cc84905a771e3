// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The dual active set search of Goldfarb and Idnani (Mathematical Programming 27, 1983) with the
/// identity as Hessian: the closest point to the origin of a polyhedron g_i.z >= h_i. Written once
/// for the program of one body, of fixed size, and for that of several, whose size is known at run
/// time.

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "rt_core/base/scalar.hpp"

namespace haptic {

/// A set of row numbers below kRows.
template <std::uint32_t kRows>
class RowSet {
 public:
  [[nodiscard]] bool contains(std::uint32_t row) const noexcept {
    return ((word_[row / 64] >> (row % 64)) & 1u) != 0;
  }
  void insert(std::uint32_t row) noexcept { word_[row / 64] |= std::uint64_t{1} << (row % 64); }
  void erase(std::uint32_t row) noexcept { word_[row / 64] &= ~(std::uint64_t{1} << (row % 64)); }

 private:
  std::array<std::uint64_t, (kRows + 63) / 64> word_{};
};

/// The search: z is the closest point of the active rows alone, which all hold it, z = sum
/// multiplier_j g_j with multipliers >= 0. Rows are orthogonalised in the order of their entry
/// without roots: g_j = sum_(i <= j) factor_ij orthogonal_i, factor_jj = 1.
///
/// Space has the rows and the memory:
///
/// - kMostUnknowns, kMostRows: bounds; dimension(), most_steps(): those of this program;
/// - normal(row), height(row): g and h; dot(l, r): of two vectors, or of a normal with itself;
/// - RowNumber: the type of a row's number;
/// - Split(space): rest, rest2, part, coefficient; part is 0;
/// - Scratch(space): coefficients, one at a time; Zeros<0>, Zeros<1>(space): two of zeros;
/// - Mark(space, count): z, multiplier, row, count, of the first `count` active rows;
/// - z_, count_, iterations_, skipped_, closed_: at first 0 and empty; they come before the arrays,
///   or the compiler reads the count again after each store into one of them;
/// - row_, multiplier_, length2_, inverse_length2_, orthogonal_, factor_: the active rows.
template <class Space>
class DualSearch : public Space {
 public:
  using Space::Space;

  /// Makes row p, violated by `violation`, hold, or skips it, or runs out of iterations.
  void enter(std::uint32_t p, Real violation) noexcept;
  [[nodiscard]] bool exhausted() const noexcept { return iterations_ >= Space::most_steps(); }
  [[nodiscard]] const auto& z() const noexcept { return z_; }
  /// Rows that are not candidates: the active and the skipped ones.
  [[nodiscard]] const RowSet<Space::kMostRows>& closed() const noexcept { return closed_; }
  /// Active rows, in the order of their entry. Some may touch z and not hold it.
  [[nodiscard]] std::uint32_t count() const noexcept { return count_; }
  [[nodiscard]] auto row(std::uint32_t position) const noexcept { return row_[position]; }
  [[nodiscard]] Real multiplier(std::uint32_t position) const noexcept {
    return multiplier_[position];
  }
  [[nodiscard]] std::uint32_t iterations() const noexcept { return iterations_; }
  [[nodiscard]] std::uint32_t skipped() const noexcept { return skipped_; }

 private:
  using Space::orthogonal_, Space::factor_;
  using Space::row_, Space::multiplier_, Space::length2_, Space::inverse_length2_;
  using Space::z_, Space::count_, Space::iterations_, Space::skipped_, Space::closed_;
  using typename Space::Mark, typename Space::RowNumber, typename Space::Split;

  /// A row of which no larger share than this stands out of the active ones depends on them. In
  /// single precision the root of the rounding: a larger share would bend z by that share, a
  /// smaller one would multiply the rounding of z by its inverse, and there both errors are equal.
  /// In double precision it is wider, because normals of one face that come from several pieces
  /// differ by more than their rounding.
  static constexpr Real kDependence2 = HAPTIC_REAL_IS_FLOAT ? kRealEpsilon : 1.0e-12_r;
  /// Coefficients of a dependent row, squared, that rounding can have made: they are known to the
  /// rounding times the condition that kDependence2 leaves to the active rows.
  static constexpr Real kRounding2 = kRealEpsilon * kRealEpsilon / kDependence2;

  /// How far the multiplier of the entering row grows, as a fraction; below 0 is 1 / 0: for ever.
  struct Step {
    Real numerator = 1, denominator = 0;
    std::uint32_t blocking = Space::kMostUnknowns;  ///< position whose multiplier ends at zero
  };

  /// A vector split by the active rows: g = sum coefficient_j g_j + rest, rest square to all of
  /// them; part: of the orthogonal vectors.
  template <class Normal>
  [[nodiscard]] Split split(const Normal& g, std::uint32_t count) const noexcept;
  [[nodiscard]] Step longest_step(const Split& s, Real violation, Real length2,
                                  bool dependent) const noexcept;
  void append(std::uint32_t row, const Split& s, Real multiplier, Real length2) noexcept;
  void drop(std::uint32_t position) noexcept;
  void orthogonalise_from(std::uint32_t position) noexcept;
  void restore(const Mark& mark) noexcept;
  void settle() noexcept;
  void solve() noexcept;
};

template <class Space>
template <class Normal>
auto DualSearch<Space>::split(const Normal& g, std::uint32_t count) const noexcept -> Split {
  Split s(*this);
  s.rest = g;
  // Gram-Schmidt, twice: once leaves in the rest what the rounding of g projects on the others.
  for (std::uint32_t pass = 0; pass < 2; ++pass) {
    typename Space::Scratch part(*this);
    for (std::uint32_t i = 0; i < count; ++i)
      part[i] = Space::dot(orthogonal_[i], s.rest) * inverse_length2_[i];
    for (std::uint32_t i = 0; i < count; ++i) {
      s.rest -= part[i] * orthogonal_[i];
      s.part[i] += part[i];
    }
  }
  s.rest2 = Space::dot(s.rest, s.rest);
  return s;
}

template <class Space>
auto DualSearch<Space>::longest_step(const Split& s, Real violation, Real length2,
                                     bool dependent) const noexcept -> Step {
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

template <class Space>
void DualSearch<Space>::append(std::uint32_t row, const Split& s, Real multiplier,
                               Real length2) noexcept {
  row_[count_] = static_cast<RowNumber>(row);
  closed_.insert(row);
  multiplier_[count_] = multiplier;
  length2_[count_] = length2;
  orthogonal_[count_] = s.rest;
  inverse_length2_[count_] = 1 / s.rest2;
  factor_[count_] = s.part;
  ++count_;
}

template <class Space>
void DualSearch<Space>::orthogonalise_from(std::uint32_t position) noexcept {
  for (std::uint32_t j = position; j < count_; ++j) {
    const Split s = split(Space::normal(row_[j]), j);
    orthogonal_[j] = s.rest;
    inverse_length2_[j] = 1 / s.rest2;
    factor_[j] = s.part;
  }
}

template <class Space>
void DualSearch<Space>::drop(std::uint32_t position) noexcept {
  closed_.erase(row_[position]);
  --count_;
  for (std::uint32_t j = position; j < count_; ++j) {
    row_[j] = row_[j + 1];
    multiplier_[j] = multiplier_[j + 1];
    length2_[j] = length2_[j + 1];
  }
  orthogonalise_from(position);
}

template <class Space>
void DualSearch<Space>::restore(const Mark& mark) noexcept {
  for (std::uint32_t j = 0; j < count_; ++j) closed_.erase(row_[j]);
  z_ = mark.z;
  multiplier_ = mark.multiplier;
  row_ = mark.row;
  count_ = mark.count;
  for (std::uint32_t j = 0; j < count_; ++j) {
    closed_.insert(row_[j]);
    const auto& g = Space::normal(row_[j]);
    length2_[j] = Space::dot(g, g);
  }
  orthogonalise_from(0);
}

/// z and the multipliers of the active rows afresh from their right sides.
template <class Space>
void DualSearch<Space>::solve() noexcept {
  typename Space::template Zeros<0> weight(*this);
  typename Space::template Zeros<1> height(*this);
  z_.fill(0);
  for (std::uint32_t j = 0; j < count_; ++j) {
    height[j] = Space::height(row_[j]);
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
template <class Space>
void DualSearch<Space>::settle() noexcept {
  for (std::uint32_t pass = 0; pass < Space::dimension() && count_ > 0; ++pass) {
    solve();
    std::uint32_t least = 0;
    for (std::uint32_t j = 1; j < count_; ++j)
      if (multiplier_[j] < multiplier_[least]) least = j;
    if (multiplier_[least] > 0) return;
    drop(least);
  }
}

template <class Space>
void DualSearch<Space>::enter(std::uint32_t p, Real violation) noexcept {
  const auto& g = Space::normal(p);
  const Real length2 = Space::dot(g, g);
  Real multiplier = 0;
  bool partial = false, unsettled = false;
  const Mark mark(*this, count_);
  while (!exhausted()) {
    ++iterations_;
    Split s = split(g, count_);
    s.coefficient = s.part;
    for (std::uint32_t j = count_; j-- > 0;)
      for (std::uint32_t i = 0; i < j; ++i) s.coefficient[i] -= factor_[j][i] * s.coefficient[j];
    const bool dependent = count_ == Space::dimension() || !(s.rest2 > kDependence2 * length2);
    const Step step = longest_step(s, violation, length2, dependent);
    const Real length = step.numerator / step.denominator;
    if (!(length <= std::numeric_limits<Real>::max())) {
      closed_.insert(p);
      ++skipped_;
      break;
    }
    if (step.blocking == Space::kMostUnknowns) {
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

}  // namespace haptic
