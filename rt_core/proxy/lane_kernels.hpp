// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The loops of the screen over eight pairs at a time, once for any processor of its kind and once
/// for those with AVX2. Both have the same bits.

#include <cstdint>
#include <span>

#include "rt_core/proxy/facet_tree.hpp"
#include "rt_core/proxy/screen_rows.hpp"

namespace haptic {

namespace any_processor {
TreeFound find_facets(std::span<const TreeNode> nodes, std::span<const TreeLeaf> leaves,
                      const TreeQuery& query, std::span<std::uint32_t> found) noexcept;
RowSwept sweep_row(const RowSweep& sweep, BoundedList<ScreenLost>& lost) noexcept;
void block_gaps(const ScreenBlock& block, const RowCorners& corners,
                float (&gap_m)[kFloatLanes]) noexcept;
void place_row(const ScreenRow& row, const GripPose& p, RowCorners& corners) noexcept;
void choose_planes(PlaneBatch& batch, bool is_move) noexcept;
}  // namespace any_processor
#if defined(__x86_64__)
namespace with_avx2 {
TreeFound find_facets(std::span<const TreeNode> nodes, std::span<const TreeLeaf> leaves,
                      const TreeQuery& query, std::span<std::uint32_t> found) noexcept;
RowSwept sweep_row(const RowSweep& sweep, BoundedList<ScreenLost>& lost) noexcept;
void block_gaps(const ScreenBlock& block, const RowCorners& corners,
                float (&gap_m)[kFloatLanes]) noexcept;
void place_row(const ScreenRow& row, const GripPose& p, RowCorners& corners) noexcept;
void choose_planes(PlaneBatch& batch, bool is_move) noexcept;
}  // namespace with_avx2
#endif

/// Calls one of the two; `wide` only where has_wide_lanes().
struct LaneKernels {
  bool wide = false;

  /// Facets within range of a triangle; `found`: room for all. Cost: the nodes and leaves in range.
  [[nodiscard]] TreeFound find_facets(std::span<const TreeNode> nodes,
                                      std::span<const TreeLeaf> leaves, const TreeQuery& query,
                                      std::span<std::uint32_t> found) const noexcept {
#if defined(__x86_64__)
    if (wide) return with_avx2::find_facets(nodes, leaves, query, found);
#endif
    return any_processor::find_facets(nodes, leaves, query, found);
  }
  /// Judges the first block of a row and those that follow it. Cost: these.
  [[nodiscard]] RowSwept sweep_row(const RowSweep& sweep,
                                   BoundedList<ScreenLost>& lost) const noexcept {
#if defined(__x86_64__)
    if (wide) return with_avx2::sweep_row(sweep, lost);
#endif
    return any_processor::sweep_row(sweep, lost);
  }
  /// Gaps of a block from corners of its row.
  void block_gaps(const ScreenBlock& block, const RowCorners& corners,
                  float (&gap_m)[kFloatLanes]) const noexcept {
#if defined(__x86_64__)
    if (wide) return with_avx2::block_gaps(block, corners, gap_m);
#endif
    any_processor::block_gaps(block, corners, gap_m);
  }
  /// Corners of a row at a pose.
  void place_row(const ScreenRow& row, const GripPose& p, RowCorners& corners) const noexcept {
#if defined(__x86_64__)
    if (wide) return with_avx2::place_row(row, p, corners);
#endif
    any_processor::place_row(row, p, corners);
  }
  /// Takes a plane for each pair; `is_move`: the ends differ. Cost: ten products a direction.
  void choose_planes(PlaneBatch& batch, bool is_move) const noexcept {
#if defined(__x86_64__)
    if (wide) return with_avx2::choose_planes(batch, is_move);
#endif
    any_processor::choose_planes(batch, is_move);
  }
};

}  // namespace haptic
