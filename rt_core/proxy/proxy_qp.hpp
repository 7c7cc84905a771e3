// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The one optimisation problem of the proxy: the point of a polyhedron in R^6 that is closest to
/// the origin (Goldfarb and Idnani, Mathematical Programming 27, 1983: dual active set, here with
/// the identity as Hessian).

#include <array>
#include <cstdint>
#include <span>

#include "rt_core/base/scalar.hpp"
#include "rt_core/scene/scene_traits.hpp"

namespace haptic {

/// Three components of place, then three of rotation; of a part that never turns the former alone,
/// which gives the same bits as zeros behind them.
inline constexpr int kQpSize = kSceneTraits.free_orientation ? 6 : 3;
using QpVector = Eigen::Matrix<Real, kQpSize, 1, Eigen::DontAlign>;

/// A half space g.z >= h. Finite; a row that is not a number never counts as violated.
struct QpRow {
  QpVector g = QpVector::Zero();
  Real h = 0;
};

/// Rows that one problem may have.
inline constexpr std::uint32_t kMaxQpRows = kSceneTraits.qp_rows;

/// Whatever ended the search, z is the closest point of the rows in `active`.
struct QpResult {
  QpVector z = QpVector::Zero();
  std::array<std::uint8_t, kQpSize> active{};  ///< rows that hold z
  std::array<Real, kQpSize> multiplier{};      ///< of them, > 0: z = sum multiplier g
  std::uint32_t active_count = 0;
  std::uint32_t iterations = 0;  ///< steps of the dual, each an entering row or one that leaves
  std::uint32_t skipped = 0;     ///< rows found inconsistent with the active ones and left out
  bool capped = false;           ///< ended by kMaxQpIterations: rows may be violated still
};

/// min 1/2 |z|^2 over g_i.z >= h_i. `tolerance`: h - g.z up to which a row counts as met, in the
/// unit of h; above the rounding of g.z. Rows of lengths about 1: the most violated one is that of
/// the largest h - g.z, of any length. At most kMaxQpRows rows, further ones are not looked
/// at; duplicates and dependent rows welcome. A row without length, or one that only pulls against
/// the active rows, is skipped.
/// Deterministic, the same bits in every build of one Real: the most violated row first, the lowest
/// index at ties. Cost: at most kMaxQpIterations times (all rows once and a 6x6 orthogonalisation);
/// typically 4.
/// `first`: rows that are looked at before, in this order, such as those that hold the closest
/// point of most of the rows; the first kQpSize of them count.
[[nodiscard]] QpResult closest_point(std::span<const QpRow> rows, Real tolerance,
                                     std::span<const std::uint8_t> first = {}) noexcept;

}  // namespace haptic
