// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Planes of a cleaned surface, found by the distance of vertices to the plane and never by the
/// angle between normals alone: rounding tilts narrow faces by degrees on one and the same plane
/// (METHOD section 3, step 4).

#include <cstdint>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

class FaceNeighbors;

/// A plane normal . x = offset_m in the local frame of the surface [m], shared by all faces of a
/// body that lie in it, on either side. `normal_tail` and `offset_tail_m` extend both beyond double
/// precision, so that the corners of a mesh that is already clean can be met to a fraction of their
/// last digit.
struct FittedPlane {
  Point3 normal{0, 0, 0};  ///< unit length to rounding
  double offset_m = 0.0;
  Point3 normal_tail{0, 0, 0};
  double offset_tail_m = 0.0;
  int axis = -1;            ///< 0..2: exactly x_axis = offset_m, normal = +e_axis; -1: general
  double residual_m = 0.0;  ///< largest distance of its vertices
  std::uint32_t widest_face = 0;        ///< index into Surface::faces of its largest face
  std::vector<std::uint32_t> vertices;  ///< of its faces, ascending
};

struct PlaneFit {
  std::vector<FittedPlane> planes;
  std::vector<std::uint32_t> face_plane;  ///< per face of the surface: index into `planes`
  std::vector<int> face_sign;  ///< per face: outward normal = sign * plane normal (+1 or -1)
  double largest_residual_m = 0.0;
};

/// Flat regions of neighbouring faces beyond which no planes are fitted: uniting them would take
/// minutes, and more planes make no solid that could be rendered.
inline constexpr std::size_t kMostFlatRegions = 30'000;

/// Fits planes over the whole body with the tolerance surface.plane_tolerance_m.
/// @throws InputError for an n-gon that is further than four tolerances from flat; LimitError
/// beyond kMostFlatRegions. Cost: near linear in faces; uniting is quadratic in the number of
/// planes with a tiny constant (5000 planes: 30 ms).
PlaneFit fit_planes(const Surface& surface, const FaceNeighbors& neighbors);

}  // namespace haptic::tools
