// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Triangle meshes of the kinds that real parts come in: closed and convex, closed with reflex
/// edges, open, torn, through themselves, without any order. All made here; lengths in m, about the
/// origin.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/oracle/triangle_pair.hpp"
#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

struct FuzzMesh {
  std::string name;
  std::vector<Vector> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< of closed ones: seen from outside
                                                        ///< counter-clockwise
  bool closed = false;                                  ///< the boundary of a solid
};

/// The mesh as an OBJ file that reads back as itself.
[[nodiscard]] std::string obj_text(const FuzzMesh& mesh);
[[nodiscard]] std::vector<Triangle> triangles_of(const FuzzMesh& mesh);
/// The mesh as a surface that the scene writer takes.
[[nodiscard]] tools::Body facets_of(const FuzzMesh& mesh);

[[nodiscard]] FuzzMesh box_mesh_of(const Vector& half);
[[nodiscard]] FuzzMesh cylinder_mesh(std::uint32_t sides, double radius, double half_height);
[[nodiscard]] FuzzMesh tube_mesh(std::uint32_t sides, double inner, double outer,
                                 double half_height);
/// Two arms along +x and +y of a square of `arm`, `thick` wide.
[[nodiscard]] FuzzMesh ell_mesh(double arm, double thick, double half_height);
/// An icosahedron cut `times` into four.
[[nodiscard]] FuzzMesh sphere_mesh(double radius, std::uint32_t times);
/// A box open at +z, walls `thick`.
[[nodiscard]] FuzzMesh drawer_mesh(const Vector& half, double thick);
/// A plate with a slot along x in its middle; `thick` 0: one layer of triangles, open.
[[nodiscard]] FuzzMesh slotted_mesh(double half, double slot_x, double slot_y, double thick);
/// Five sheets: the box without its top, no thickness.
[[nodiscard]] FuzzMesh tray_mesh(const Vector& half);
/// A sheet over a grid of `cells` by `cells`, z = `height` sin sin with `waves` along each side.
[[nodiscard]] FuzzMesh wavy_mesh(double half, std::uint32_t cells, double height, double waves);
/// A flat sheet torn along a jagged line: both lips bent up and down, some corners pulled apart.
[[nodiscard]] FuzzMesh torn_mesh(double half, std::uint32_t cells, std::uint64_t seed);
/// Triangles at random in a ball, through one another, without neighbours.
[[nodiscard]] FuzzMesh soup_mesh(std::uint32_t count, double radius, double size,
                                 std::uint64_t seed);
/// Two sheets that cross in a line which neither has as an edge.
[[nodiscard]] FuzzMesh crossed_mesh(double half);

}  // namespace haptic::sim
