// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Scenes of facets alone whose near pairs are screened in bulk (proxy/facet_screen.hpp), and the
/// room that takes.

#include <algorithm>
#include <cstdint>
#include <span>

#include "rt_core/scene/scene_format.hpp"

namespace haptic {

/// Pairs of pieces up to which a list of those near does as well.
inline constexpr std::uint64_t kFewFacetPairs = 1024;
/// Pairs that a screened scene follows one by one, where it does not say, and at least.
inline constexpr std::uint32_t kScreenedSlots = 1024, kLeastScreenedSlots = 256;
/// `asked`: by the scene, 0: nothing.
[[nodiscard]] constexpr std::uint32_t screened_slots(std::uint32_t asked) noexcept {
  return asked == 0 ? kScreenedSlots : std::max(asked, kLeastScreenedSlots);
}
/// Work of the screen that counts as one unit of the budget.
inline constexpr std::uint32_t kScreenOfUnit = 4;
/// Such work: of a row and a block that are swept; of a row that is looked up, a node and a leaf of
/// the tree, a facet that stays in its list and one that comes to it; of a pair whose faces are
/// tried among eight, of a direction alone, and of the closest points of two facets; of all planes
/// of one pair at the most.
inline constexpr std::uint32_t kSweptWork = 2, kBlockWork = 1;
inline constexpr std::uint32_t kRowWork = 4, kNodeWork = 1, kLeafWork = 3, kKeptWork = 1;
inline constexpr std::uint32_t kNewWork = 1;
inline constexpr std::uint32_t kBatchWork = 2, kDirectionWork = 2, kClosestWork = 6;
inline constexpr std::uint32_t kMostPlaneWork = kBatchWork + 3 * kDirectionWork + 2 * kClosestWork;
/// Facets that come to the list of one row at once, and work on lists and on planes that a tick may
/// do although the units are spent.
inline constexpr std::uint32_t kMostNewFacets = 256, kGrantedScreenWork = 2048;

/// Triangles of A, facets of the obstacles and their corners, blocks of eight facets in the lists.
struct ScreenSize {
  std::uint64_t rows = 0, facets = 0, corners = 0;
  /// Each row has up to two that are not full, and each facet is in a few lists.
  [[nodiscard]] constexpr std::uint64_t blocks() const noexcept {
    return 2 * rows + facets / 2 + 64;
  }
  /// Units that it takes to sweep all of it.
  [[nodiscard]] constexpr std::uint64_t sweep_units() const noexcept {
    return (rows * kSweptWork + blocks() * kBlockWork) / kScreenOfUnit + 1;
  }
  /// Units that a tick may spend on the screen beyond its budget: a sweep that it has begun, of
  /// which one is always due, a row that is looked up, far lists that are given back where blocks
  /// run short, and what is granted to lists and planes.
  [[nodiscard]] constexpr std::uint64_t begun_units() const noexcept {
    const std::uint64_t row = kRowWork + facets * (kKeptWork + kNewWork) +
                              (facets / 8 + 16) * (kNodeWork + kLeafWork) + blocks() * kBlockWork +
                              kMostNewFacets * kMostPlaneWork;
    return sweep_units() + (row + 2 * kGrantedScreenWork) / kScreenOfUnit + 2;
  }
};
constexpr ScreenSize screen_size(std::span<const PieceRecord> pieces,
                                 std::uint32_t pieces_a) noexcept {
  ScreenSize size;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (i < pieces_a) {
      size.rows += pieces[i].vertex_count - std::uint64_t{2};
    } else {
      size.facets += 1;
      size.corners += pieces[i].vertex_count;
    }
  }
  return size;
}

constexpr bool is_screened(std::span<const PieceRecord> pieces, std::uint32_t pieces_a) noexcept {
  return std::uint64_t{pieces_a} * (pieces.size() - pieces_a) > kFewFacetPairs &&
         std::all_of(pieces.begin(), pieces.end(), is_flat);
}

}  // namespace haptic
