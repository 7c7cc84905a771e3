// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The quadratic program of several bodies: the point closest to the origin of a polyhedron whose
/// unknowns are a block of six for each body, and whose rows touch one block or two. It is the
/// program of proxy/proxy_qp.hpp with a size known at run time, and takes the same steps
/// (proxy/dual_search.hpp). Bodies that no row joins, directly or through others, are separate
/// islands, which are solved one by one.

#include <array>
#include <cstdint>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/bounded_list.hpp"
#include "rt_core/base/scalar.hpp"
#include "rt_core/scene/proxy_limits.hpp"

namespace haptic {

inline constexpr std::uint32_t kMostBlocks = 8;
inline constexpr std::uint32_t kBlockSize = 6;  ///< unknowns of a block
inline constexpr std::uint8_t kNoBlock = 0xff;
/// Rows that one program may have.
inline constexpr std::uint32_t kMostBlockRows = 1024;
/// Units of work of a step of the dual, by the blocks of its island: measured up to four, with
/// n^1.6 beyond.
inline constexpr std::array<std::uint8_t, kMostBlocks> kBlockStepUnits = {3,  7,  13, 23,
                                                                          39, 53, 68, 84};
static_assert(kBlockStepUnits[0] == kQpStepUnits);
/// Steps of the dual for each block of an island.
inline constexpr std::uint32_t kMaxBlockIterations = kMaxQpIterations;

/// g.z >= h over one block of six unknowns or two. Finite; a row that is not a number never counts
/// as violated. Two blocks that are the same one add up.
struct BlockRow {
  std::array<Real, kBlockSize> g_a{}, g_b{};  ///< g_b counts where b is a block
  Real h = 0;
  std::uint8_t a = 0, b = kNoBlock;
};

/// min 1/2 |z|^2 over g_i.z >= h_i. Owner: the servo thread. Memory: all of it from place(); no
/// heap. Deterministic, the same bits in every build of one Real; an island's bits do not depend on
/// the rows of other islands.
class BlockProgram {
 public:
  /// Takes the memory of a program of up to kMostBlocks blocks and kMostBlockRows rows; more are
  /// taken for as many. With an arena that only counts, nothing can be pushed.
  void place(Arena& arena, std::uint32_t blocks, std::uint32_t most_rows) noexcept;

  /// No rows. Results of the last solve() stay.
  void clear() noexcept { rows_.clear(); }
  /// Appends a row; false and unchanged if there is no room, or if row.a is no block.
  [[nodiscard]] bool push(const BlockRow& row) noexcept;
  [[nodiscard]] std::uint32_t rows() const noexcept { return rows_.size(); }

  /// Solves the islands one by one: in each the most violated row first, the lowest number at ties.
  /// Duplicates and dependent rows are welcome; a row without length, or one that only pulls
  /// against the active rows, is skipped. However the search ended, z is the closest point of the
  /// rows in active().
  /// @param tolerance  h - g.z up to which a row counts as met, in the unit of h; above the
  ///                   rounding of g.z. Rows of lengths about 1, as in closest_point().
  /// @param first  row numbers that are looked at before the others, in this order, such as the
  ///               active ones of the last program; those that are no row are ignored.
  /// Cost: for an island of n unknowns at most kMaxBlockIterations n / 6 times (its rows once and
  /// an orthogonalisation of n vectors of length n); typically twice as often as rows are active.
  void solve(Real tolerance, std::span<const std::uint16_t> first = {}) noexcept;

  // The last solve() found:
  [[nodiscard]] const std::array<Real, kBlockSize>& z(std::uint32_t block) const noexcept {
    return z_[block];
  }
  /// Rows that hold z, of all islands: those with a multiplier > 0.
  [[nodiscard]] std::span<const std::uint16_t> active() const noexcept { return active_.view(); }
  /// Multipliers of active(): z = sum multiplier g.
  [[nodiscard]] std::span<const Real> multipliers() const noexcept { return multipliers_.view(); }
  /// The lowest block of the block's island.
  [[nodiscard]] std::uint32_t island_of(std::uint32_t block) const noexcept {
    return island_[block];
  }
  /// Steps of the dual, each an entering row or one that leaves.
  [[nodiscard]] std::uint32_t steps() const noexcept { return steps_; }
  /// Units of work that they are beyond those of steps of one block (kBlockStepUnits).
  [[nodiscard]] std::uint32_t more_units() const noexcept { return more_units_; }
  /// Rows found inconsistent with the active ones and left out.
  [[nodiscard]] std::uint32_t skipped() const noexcept { return skipped_; }
  /// Islands with a row.
  [[nodiscard]] std::uint32_t programs() const noexcept { return programs_; }
  /// True if an island used up its steps: its rows may be violated still.
  [[nodiscard]] bool capped() const noexcept { return capped_; }

 private:
  void find_islands() noexcept;
  void sort_rows() noexcept;
  void solve_island(std::uint32_t island, Real tolerance,
                    std::span<const std::uint16_t> first) noexcept;

  BoundedList<BlockRow> rows_;
  std::span<std::uint16_t> sorted_;  ///< row numbers, by island and number
  std::span<std::array<Real, kBlockSize>> z_;
  BoundedList<std::uint16_t> active_;
  BoundedList<Real> multipliers_;
  std::span<Real> search_reals_;  ///< what the search of one island keeps
  std::span<std::uint16_t> search_numbers_;
  std::array<std::uint8_t, kMostBlocks> island_{};  ///< of a block: the island's lowest block
  std::array<std::uint8_t, kMostBlocks> place_{};   ///< of a block in its island
  std::array<std::uint16_t, kMostBlocks> begin_{};  ///< of an island's rows in sorted_
  std::array<std::uint16_t, kMostBlocks> count_{};  ///< of an island's rows
  std::array<std::uint8_t, kMostBlocks> size_{};    ///< of an island: its blocks
  std::uint32_t more_units_ = 0;
  std::uint32_t steps_ = 0;
  std::uint32_t skipped_ = 0;
  std::uint32_t programs_ = 0;
  bool capped_ = false;
};

}  // namespace haptic
