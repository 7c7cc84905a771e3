// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/proxy_qp.hpp"

#include <algorithm>

#include "rt_core/contact/lanes.hpp"
#include "rt_core/proxy/dual_search.hpp"

namespace haptic {
namespace {

/// The rows of one program and the memory of its search (proxy/dual_search.hpp).
class QpSpace {
 public:
  static constexpr std::uint32_t kMostUnknowns = kQpSize;
  static constexpr std::uint32_t kMostRows = kMaxQpRows;
  explicit QpSpace(std::span<const QpRow> rows) noexcept : rows_(rows) {}

  /// The products in one fixed order, as a tree: short chains, the same bits in every build.
  [[nodiscard]] static Real dot(const QpVector& l, const QpVector& r) noexcept {
    const Real plane = l[0] * r[0] + l[1] * r[1];
    if constexpr (kQpSize == 3) {
      return plane + l[2] * r[2];
    } else {
      return (plane + (l[2] * r[2] + l[3] * r[3])) + (l[4] * r[4] + l[5] * r[5]);
    }
  }

 protected:
  using RowNumber = std::uint8_t;
  using Coefficients = std::array<Real, kMostUnknowns>;
  struct Split {
    explicit Split(const QpSpace&) noexcept {}
    QpVector rest;
    Real rest2 = 0;
    Coefficients part{}, coefficient{};
  };
  struct Scratch : Coefficients {
    explicit Scratch(const QpSpace&) noexcept {}
  };
  template <int>
  struct Zeros : Coefficients {
    explicit Zeros(const QpSpace&) noexcept : Coefficients{} {}
  };
  struct Mark {
    Mark(const QpSpace& s, std::uint32_t active) noexcept
        : z(s.z_), multiplier(s.multiplier_), row(s.row_), count(active) {}
    QpVector z;
    Coefficients multiplier;
    std::array<RowNumber, kMostUnknowns> row;
    std::uint32_t count;
  };

  [[nodiscard]] static constexpr std::uint32_t dimension() noexcept { return kMostUnknowns; }
  [[nodiscard]] static constexpr std::uint32_t most_steps() noexcept { return kMaxQpIterations; }
  [[nodiscard]] const QpVector& normal(std::uint32_t row) const noexcept { return rows_[row].g; }
  [[nodiscard]] Real height(std::uint32_t row) const noexcept { return rows_[row].h; }

  std::span<const QpRow> rows_;
  QpVector z_ = QpVector::Zero();
  std::uint32_t count_ = 0;
  std::uint32_t iterations_ = 0;
  std::uint32_t skipped_ = 0;
  RowSet<kMostRows> closed_;
  std::array<RowNumber, kMostUnknowns> row_{};
  Coefficients multiplier_{};
  Coefficients length2_{};          ///< of the rows
  Coefficients inverse_length2_{};  ///< of the orthogonal vectors
  std::array<QpVector, kMostUnknowns> orthogonal_;
  std::array<Coefficients, kMostUnknowns> factor_;  ///< [j][i], i < j
};

QpResult result_of(const DualSearch<QpSpace>& search, bool capped) noexcept {
  QpResult result;
  result.z = search.z();
  result.iterations = search.iterations();
  result.skipped = search.skipped();
  result.capped = capped;
  for (std::uint32_t j = 0; j < search.count(); ++j) {
    // Rows that touch z but do not hold it are none of the active.
    if (!(search.multiplier(j) > 0)) continue;
    result.active[result.active_count] = search.row(j);
    result.multiplier[result.active_count++] = search.multiplier(j);
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
                        const RowSet<kMaxQpRows>& closed) noexcept {
  Violation found = most_violated(rows, z, tolerance);
  if (found.row == kMaxQpRows || !closed.contains(found.row)) return found;
  // Rare: a skipped row, or an active one that rounding violates by more than the tolerance.
  found = {tolerance, kMaxQpRows};
  for (std::uint32_t i = 0; i < rows.size(); ++i) {
    const Real violation = rows[i].h - QpSpace::dot(rows[i].g, z);
    if (violation > found.amount && !closed.contains(i)) found = {violation, i};
  }
  return found;
}

}  // namespace

QpResult closest_point(std::span<const QpRow> rows, Real tolerance,
                       std::span<const std::uint8_t> first) noexcept {
  rows = rows.first(std::min<std::size_t>(rows.size(), kMaxQpRows));
  DualSearch<QpSpace> search(rows);
  for (const std::uint8_t row : first.first(std::min<std::size_t>(first.size(), kQpSize))) {
    if (row >= rows.size() || search.closed().contains(row)) continue;
    const Real violation = rows[row].h - QpSpace::dot(rows[row].g, search.z());
    if (violation > tolerance) search.enter(row, violation);
  }
  for (;;) {
    const Violation worst = most_violated(rows, search.z(), tolerance, search.closed());
    const bool met = worst.row == kMaxQpRows;
    if (met || search.exhausted()) return result_of(search, !met);
    search.enter(worst.row, worst.amount);
  }
}

}  // namespace haptic
