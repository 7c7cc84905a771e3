// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/golden/golden_tolerance.hpp"

#include "rt_core/base/scalar.hpp"

namespace haptic::sim {
namespace {

struct FamilyRow {
  const char* family;
  double depth, force, torque;
};

/// Single precision, both laws. The worst errors measured are behind each row in the same order,
/// "-" where the near set of every case is closer than the rounding and nothing is compared. Where
/// an error is far below half a rounding (6e-8) the floor is 5e-8 for depth and force, 1e-8 for
/// torque: such luck depends on the order of additions.
constexpr FamilyRow kSingleRows[] = {
    {"box_box_edge_edge", 1.0e-7, 1.0e-7, 2.0e-8},      // 2.4e-8, 2.4e-8, 4.3e-9
    {"box_box_edge_face", 6.0e-8, 5.0e-8, 1.0e-8},      // 1.5e-8, 7.8e-9, 8.1e-10
    {"box_box_face_face", 1.0e-7, 1.0e-7, 6.0e-8},      // 2.5e-8, 2.5e-8, 1.4e-8 (weighted)
    {"box_box_generic", 2.8e-7, 1.0e-7, 2.0e-8},        // 6.7e-8, 2.3e-8, 4.2e-9
    {"box_box_weighted", 5.0e-8, 5.0e-8, 1.4e-8},       // 8.2e-9, 8.2e-9, 3.3e-9 (weighted)
    {"containment", 1.2e-7, 1.2e-7, 1.0e-8},            // 1.8e-8, 2.9e-8, 1.4e-9
    {"large_offset", 1.4e-2, 1.4e-2, 1.4e-2},           // 3.5e-3, 3.5e-3, -: 1e4 m from the origin
    {"medial_tie", 6.0e-8, 2.0e-7, 1.0e-8},             // 1.3e-8, 5.1e-8 (weighted), -
    {"needle6_box", 1.0e-7, 5.0e-8, 1.0e-8},            // 2.5e-8, 1.1e-8, -
    {"needle_box", 8.0e-8, 5.0e-8, 1.0e-8},             // 1.9e-8, 1.2e-8, 4.7e-11
    {"path_tetra_box", 2.4e-7, 1.0e-7, 2.0e-8},         // 5.9e-8, -, -
    {"plate_box", 1.6e-7, 1.6e-7, 1.0e-8},              // 3.9e-8, 3.9e-8, -
    {"prism_box_face_face", 1.2e-7, 5.0e-8, 1.0e-8},    // 3.0e-8, 0, 0
    {"prism_box_generic", 1.2e-7, 1.2e-7, 2.2e-8},      // 2.9e-8, 2.8e-8, 5.4e-9
    {"scale_1e-6", 4.4e-7, 1.2e-7, 3.4e-8},             // 1.1e-7, 2.8e-8, 8.5e-9
    {"scale_1e3", 1.0e-7, 8.0e-8, 1.6e-8},              // 2.2e-8, 1.8e-8, 4.0e-9
    {"tetra_box_face_face", 5.0e-8, 5.0e-8, 1.0e-8},    // 1.2e-8, 1.2e-8, 1.0e-9
    {"tetra_box_generic", 2.0e-7, 2.0e-7, 4.2e-8},      // 4.7e-8, 4.8e-8, 1.0e-8
    {"tetra_box_touch", 1.2e-7, 5.0e-8, 1.0e-8},        // 2.8e-8, 0, 0
    {"tetra_right_box_touch", 5.0e-8, 5.0e-8, 1.0e-8},  // 0, 0, 0
};

}  // namespace

GoldenTolerance golden_tolerance(const std::string& family, bool far_away) {
  if (sizeof(Real) == sizeof(double)) {
    const Wide share = far_away ? 1e-10L : 1e-12L;
    return {share, share, share, 1e-9L, far_away ? 1e-5L : 1e-9L};
  }
  for (const FamilyRow& row : kSingleRows) {
    if (family == row.family) return {widen(row.depth), widen(row.force), widen(row.torque), 0, 0};
  }
  const Wide share = far_away ? 2e-2L : 1e-6L;
  return {share, share, share, 0, 0};
}

}  // namespace haptic::sim
