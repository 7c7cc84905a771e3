// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Parts that are given by dimensions and not by a file: boxes, round parts, ISO metric threads,
/// nuts and bolts. The mesh is closed, oriented outwards, and of the type that the file readers
/// give.
///
/// Frame: the axis of every shape is z and its middle is the origin; only the bolt has the bearing
/// face of its head at z = 0, the head above. All lengths in metres.
///
/// Round surfaces become facets, and always on the side of the part's own material: the corners of
/// an outer surface lie on the nominal radius, the middles of the facets of a hole do (its corners
/// lie at radius / cos(pi / segments)). So no facet leaves the material of the nominal part, and
/// the nominal clearance between two shapes is a lower bound of the clearance between their facets.

#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

inline constexpr std::uint32_t kDefaultSegments = 32;
/// Finer facets lie within the tolerance that joins faces of one plane.
inline constexpr std::uint32_t kMaxSegments = 512;

struct BoxShape {
  Point3 size_m{0, 0, 0};
  friend bool operator==(const BoxShape&, const BoxShape&) = default;
};
/// Straight prism over a regular polygon; corners on the radius, the first on +x.
struct PrismShape {
  double radius_m = 0.0, height_m = 0.0;
  std::uint32_t sides = 0;
  friend bool operator==(const PrismShape&, const PrismShape&) = default;
};
struct CylinderShape {
  double radius_m = 0.0, height_m = 0.0;
  std::uint32_t segments = kDefaultSegments;
  friend bool operator==(const CylinderShape&, const CylinderShape&) = default;
};
/// Base at z = -height / 2, apex at +height / 2.
struct ConeShape {
  double radius_m = 0.0, height_m = 0.0;
  std::uint32_t segments = kDefaultSegments;
  friend bool operator==(const ConeShape&, const ConeShape&) = default;
};
/// Triangles as on a subdivided octahedron, corners on the radius; `segments` around the equator, a
/// multiple of 4.
struct SphereShape {
  double radius_m = 0.0;
  std::uint32_t segments = kDefaultSegments;
  friend bool operator==(const SphereShape&, const SphereShape&) = default;
};
/// A cylinder with two half spheres; the height is that of the whole.
struct CapsuleShape {
  double radius_m = 0.0, height_m = 0.0;
  std::uint32_t segments = kDefaultSegments;
  friend bool operator==(const CapsuleShape&, const CapsuleShape&) = default;
};
/// A cylinder with a through hole along its axis.
struct TubeShape {
  double inner_radius_m = 0.0, outer_radius_m = 0.0, height_m = 0.0;
  std::uint32_t segments = kDefaultSegments;
  friend bool operator==(const TubeShape&, const TubeShape&) = default;
};
/// Right-hand thread of the basic profile of ISO 68-1: flanks at 60 degrees, crest P/8 and root P/4
/// wide (of the bolt). External: a rod; internal: a tube. The whole profile stands back from the
/// basic one by `clearance_m`, radially. A crest of the rod and a groove of the tube have their
/// middle on +x at z = 0, so a rod and a tube of one size at one pose mesh.
struct ThreadShape {
  double diameter_m = 0.0, pitch_m = 0.0, turns = 0.0;
  bool internal = false;
  double outer_radius_m = 0.0;  ///< of an internal thread: the tube's outer cylinder
  double clearance_m = 0.0;
  std::uint32_t segments = kDefaultSegments;
  friend bool operator==(const ThreadShape&, const ThreadShape&) = default;
};
/// Hexagon nut of ISO 4032 without chamfers; two of its corners lie on the x axis.
struct NutShape {
  double diameter_m = 0.0, pitch_m = 0.0, width_across_flats_m = 0.0, height_m = 0.0;
  double clearance_m = 0.0;
  std::uint32_t segments = kDefaultSegments;
  friend bool operator==(const NutShape&, const NutShape&) = default;
};
/// Hexagon screw with the head of ISO 4014 and thread up to the head (ISO 4017), without chamfers.
/// Head: 0 <= z <= head height; thread: -length <= z <= 0.
struct BoltShape {
  double diameter_m = 0.0, pitch_m = 0.0, width_across_flats_m = 0.0, head_height_m = 0.0;
  double length_m = 0.0, clearance_m = 0.0;
  std::uint32_t segments = kDefaultSegments;
  friend bool operator==(const BoltShape&, const BoltShape&) = default;
};

using Shape = std::variant<BoxShape, PrismShape, CylinderShape, ConeShape, SphereShape,
                           CapsuleShape, TubeShape, ThreadShape, NutShape, BoltShape>;

/// "box", "tube", ...: the words of the scene file, in the order of Shape.
const std::vector<std::string_view>& shape_words();
std::string_view shape_word(const Shape& shape);

/// A dimension that makes no solid.
struct ShapeDefect {
  std::string key;   ///< of the scene file
  std::string text;  ///< defect and fix
};
/// The first defect, absent when shape_mesh can build the shape.
std::optional<ShapeDefect> defect_of(const Shape& shape);

/// The mesh; vertices are not repeated, coordinates in metres. Bits depend on the arguments alone.
/// @param name  for messages, the `file` of the result.
/// @throws InputError where defect_of has one.
/// Cost: linear in the number of faces, O(n log n) for threads.
RawMesh shape_mesh(const Shape& shape, const std::string& name);

/// Largest distance between a facet and the round surface that it stands for [m]; 0 for flat
/// shapes. Of a thread: an upper bound, at most twice the largest distance.
double chord_error_m(const Shape& shape);
/// Facets around; 0 for flat shapes.
std::uint32_t segments_of(const Shape& shape);

// ISO 68-1, basic profile.

/// Height of the profile between the crests of bolt and nut: 5/8 of the sharp triangle's.
constexpr double thread_depth_m(double pitch_m) {
  return 0.625 * (0.5 * std::numbers::sqrt3) * pitch_m;
}

}  // namespace haptic::tools
