// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Meshes as drawing programs export them: outlines in the plane, carried upwards layer by layer
/// with chamfers, fillets and holes, or turned about an axis; every corner where the drawing has
/// it, rounded to the numbers of an STL file. Lengths in mm, as such files have them.

#include <array>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include "host_sim/oracle/triangle_pair.hpp"
#include "host_sim/shapes/shapes.hpp"
#include "tools/graph_compiler/shapes/shape.hpp"

namespace haptic::sim {

using PlanePoint = std::array<double, 2>;  ///< [mm]
/// A closed line, no corner twice in a row, either way round.
using Outline = std::vector<PlanePoint>;
using Outlines = std::vector<Outline>;

/// Facets of a circle whose chords leave it by `chord_mm` at most: a multiple of 4, at least 8.
[[nodiscard]] std::uint32_t facets_of(double radius_mm, double chord_mm);
/// A regular polygon, first corner at angle `phase_rad`.
[[nodiscard]] Outline circle_outline(double radius_mm, std::uint32_t facets, PlanePoint at = {0, 0},
                                     double phase_rad = 0);
/// By the distance of its flats, the first flat across +x.
[[nodiscard]] Outline flats_outline(std::uint32_t sides, double across_mm);
[[nodiscard]] Outline rectangle_outline(double width_mm, double height_mm, PlanePoint at = {0, 0});
/// A rectangle with round corners of `facets` chords each.
[[nodiscard]] Outline rounded_outline(double width_mm, double height_mm, double radius_mm,
                                      std::uint32_t facets);
/// Appends the corners of an arc, both ends included; a corner that is there already is left out.
void append_arc(Outline& outline, double radius_mm, double from_rad, double to_rad,
                std::uint32_t chords, PlanePoint centre = {0, 0});
/// Teeth of a spur gear with involute flanks at 20 degrees, a tooth on +x. `thinner_mm`: of each
/// tooth along the pitch circle. `chords` of a flank.
[[nodiscard]] Outline gear_outline(std::uint32_t teeth, double module_mm, double thinner_mm,
                                   std::uint32_t chords);
[[nodiscard]] Outline moved_outline(const Outline& outline, PlanePoint by, double turn_rad = 0);
/// x to -x: the other half of a symmetric drawing.
[[nodiscard]] Outline mirrored_outline(const Outline& outline);
/// Every side moved outwards (of a hole: into the material around it) by `by_mm`; corner for
/// corner.
[[nodiscard]] Outline grown_outline(const Outline& outline, double by_mm);

/// Triangles, counter-clockwise seen from outside [mm]; several bodies may be in one file.
struct DrawnMesh {
  std::vector<std::array<Vector, 3>> triangles;
  DrawnMesh& operator+=(const DrawnMesh& other);
  [[nodiscard]] Vector middle_mm() const;  ///< of the bounding box
};
[[nodiscard]] DrawnMesh operator+(DrawnMesh a, const DrawnMesh& b);

/// What lies between two heights: outlines that may hold one another (the material begins inside
/// the outermost), from those `below` to those `above`, corner for corner.
struct Layer {
  double low_mm, high_mm;
  Outlines below, above;
};
/// A layer with the same outlines below and above.
[[nodiscard]] Layer straight(double low_mm, double high_mm, Outlines outlines);

/// The body of layers upon each other. Where one ends and the next begins, outlines must be equal
/// or apart. @throws std::logic_error for outlines that enclose no area.
[[nodiscard]] DrawnMesh layered_mesh(const std::vector<Layer>& layers);
[[nodiscard]] DrawnMesh prism_of(double low_mm, double high_mm, Outlines outlines);
/// From corner to corner.
[[nodiscard]] DrawnMesh block_mesh(const Vector& low_mm, const Vector& high_mm);
/// Layers of one outline with a rounded edge of `fillet_mm` by `chords`, below, above or both.
[[nodiscard]] std::vector<Layer> filleted_layers(const Outline& outline, double low_mm,
                                                 double high_mm, double fillet_mm,
                                                 std::uint32_t chords, bool below, bool above);
/// A half section (distance from the axis, height) turned about z.
[[nodiscard]] DrawnMesh turned_mesh(const Outline& half, std::uint32_t facets);
/// A shape of the scene file, in mm.
[[nodiscard]] DrawnMesh shape_drawn(const tools::Shape& shape);
/// Every triangle cut into four, `times` over.
[[nodiscard]] DrawnMesh finer_mesh(const DrawnMesh& mesh, std::uint32_t times);
/// Every corner moved by up to `noise_mm` along each axis, equal corners alike: a scan.
[[nodiscard]] DrawnMesh noisy_mesh(const DrawnMesh& mesh, double noise_mm, std::uint64_t seed);
[[nodiscard]] DrawnMesh placed_mesh(const DrawnMesh& mesh, const Rotation& turn,
                                    const Vector& move_mm);

/// Sides of triangles that no other triangle has the other way, after rounding to the file's
/// numbers. 0: every body is closed.
[[nodiscard]] std::size_t open_sides(const DrawnMesh& mesh);
/// An STL file, as text with seven digits or binary.
[[nodiscard]] std::string stl_file(const DrawnMesh& mesh, bool as_text);
/// The triangles that the file has [m], those without area left out.
[[nodiscard]] std::vector<Triangle> file_triangles(const DrawnMesh& mesh);

}  // namespace haptic::sim
