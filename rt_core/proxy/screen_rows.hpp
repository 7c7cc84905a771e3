// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Rows of the screen and their blocks of planes, and eight pairs whose planes are looked for.

#include <cstdint>

#include "rt_core/base/bounded_list.hpp"
#include "rt_core/base/float_lanes.hpp"
#include "rt_core/base/pose.hpp"

namespace haptic {

inline constexpr std::uint32_t kNoFacet = ~0u;

/// Eight facets of one row, each with the plane n.w = d + n.o that lies against it on the side of
/// A.
struct alignas(64) ScreenBlock {
  float normal[3][kFloatLanes];
  float height_m[kFloatLanes];  ///< of the nearest corner of the facet over the row's origin
};
/// Which they are: seldom looked at.
struct ScreenLanes {
  std::uint32_t facet[kFloatLanes];  ///< by its number in the tree, or kNoFacet
};

/// A triangle of A, along its axes, and what its planes are measured from. Its first block has its
/// own number, and is of facets near; blocks beyond the number of rows are anyone's.
struct alignas(64) ScreenRow {
  Real corner[3][4] = {};  ///< by axis; the last one twice
  Vec3 origin_w = Vec3::Zero();
  float rounding_m = 0;          ///< of a gap of its blocks
  std::uint32_t far = kNoFacet;  ///< first block of the other facets
};
/// The corners of a row at a pose, from its origin, by axis.
struct alignas(16) RowCorners {
  float at[3][4];
};

/// A pair whose plane does not do.
struct ScreenLost {
  float gap_m = 0;
  std::uint32_t row = 0, block = 0;
  std::uint16_t lane = 0;
  bool is_found = false;  ///< it has another plane
};

/// A row whose blocks are judged at q, and at p where that is given.
struct RowSweep {
  const ScreenRow* row = nullptr;
  const ScreenBlock* blocks = nullptr;  ///< of all rows
  const std::uint32_t* next = nullptr;  ///< by block
  const GripPose* q = nullptr;
  const GripPose* p = nullptr;
  std::uint32_t number = 0;
  float need_m = 0;  ///< pairs with a smaller gap are lost
};
struct RowSwept {
  float least_m = 0;         ///< gap at q
  float worst_m = 0;         ///< least gap of those lost, or what was asked for
  std::uint32_t blocks = 0;  ///< that were judged
  bool overflowed = false;   ///< there was no place for one that is lost
};

/// Planes between a triangle and a facet for eight pairs at a time, from the origins of the rows:
/// of their faces the one whose smaller gap of both ends is larger.
struct PlaneBatch {
  /// Corners of a facet; one with more is looked at alone.
  static constexpr std::uint32_t kMostCorners = 4;
  /// The faces of the facet, of the triangle at p, and of the triangle at q.
  static constexpr std::uint32_t kDirections = 3;
  alignas(32) float a_p[3][3][kFloatLanes];  ///< corner, axis
  float a_q[3][3][kFloatLanes];
  float b[kMostCorners][3][kFloatLanes];
  float direction[kDirections][3][kFloatLanes];
  /// Filled by choose_planes(): a direction from the facet to the triangle, the height of the facet
  /// along it, and the gap at both ends.
  float normal[3][kFloatLanes];
  float height_m[kFloatLanes], gap_p_m[kFloatLanes], gap_q_m[kFloatLanes];
  std::uint32_t count = 0;
};

}  // namespace haptic
