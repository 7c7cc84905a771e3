// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/shapes/shape.hpp"

#include <algorithm>
#include <cmath>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/shapes/shape_builder.hpp"

namespace haptic::tools {
namespace {

template <typename... T>
struct Overloaded : T... {
  using T::operator()...;
};
template <typename... T>
Overloaded(T...) -> Overloaded<T...>;

constexpr double kLargest_m = 1e4;

std::optional<ShapeDefect> length_defect(const char* key, double length_m) {
  if (std::isfinite(length_m) && length_m > 0.0 && length_m <= kLargest_m) return std::nullopt;
  return ShapeDefect{key, "is " + short_number(length_m, 9) + "; give a length above 0 m"};
}

std::optional<ShapeDefect> count_defect(const char* key, std::uint32_t count, std::uint32_t least,
                                        std::uint32_t step) {
  if (count >= least && count <= kMaxSegments && count % step == 0) return std::nullopt;
  return ShapeDefect{
      key, formatted("is %u; give %s from %u to %u", count,
                     step == 1 ? "a whole number" : "a multiple of 4", least, kMaxSegments)};
}

using Defects = std::initializer_list<std::optional<ShapeDefect>>;
std::optional<ShapeDefect> first_of(const Defects& defects) {
  for (const auto& defect : defects) {
    if (defect) return defect;
  }
  return std::nullopt;
}

constexpr std::uint32_t kLeastThreadSegments = 8;
constexpr double kMostTurns = 200.0;

/// Diameter, pitch, clearance and segments of a thread; `room_m`: what stands around an internal
/// one, from the axis.
std::optional<ShapeDefect> profile_defect(double diameter_m, double pitch_m, double clearance_m,
                                          std::uint32_t segments, std::optional<double> room_m,
                                          const char* room_key) {
  if (const auto defect =
          first_of({length_defect("diameter_m", diameter_m), length_defect("pitch_m", pitch_m),
                    count_defect("segments", segments, kLeastThreadSegments, 1)})) {
    return defect;
  }
  if (!std::isfinite(clearance_m) || clearance_m < 0.0 || clearance_m >= thread_depth_m(pitch_m)) {
    return ShapeDefect{"clearance_m",
                       "is " + short_number(clearance_m, 9) +
                           "; give a length from 0 to below the depth of the thread, " +
                           short_number(thread_depth_m(pitch_m), 4) + " m"};
  }
  const double least_m = 0.5 * diameter_m - thread_depth_m(pitch_m) - clearance_m;
  if (!(least_m > 0.1 * diameter_m)) {
    return ShapeDefect{"pitch_m", "leaves no core of the thread; give a smaller pitch than " +
                                      short_number(pitch_m, 9) + " m"};
  }
  const double largest_m = (0.5 * diameter_m + clearance_m) / facet_share(segments);
  if (room_m && !(*room_m > 1.0001 * largest_m)) {
    return ShapeDefect{room_key, "leaves no wall around the thread, whose facets reach " +
                                     short_number(largest_m, 4) +
                                     " m from the axis; give more, or more segments"};
  }
  return std::nullopt;
}

std::optional<ShapeDefect> turns_defect(const char* key, double turns) {
  if (turns >= 1.0 && turns <= kMostTurns) return std::nullopt;
  return ShapeDefect{
      key, "makes " + short_number(turns, 4) + " turns of the thread; give 1 to 200 of them"};
}

std::optional<ShapeDefect> find_defect(const BoxShape& s) {
  for (const double x : s.size_m) {
    if (const auto defect = length_defect("size_m", x)) return defect;
  }
  return std::nullopt;
}
std::optional<ShapeDefect> find_defect(const PrismShape& s) {
  return first_of({length_defect("radius_m", s.radius_m), length_defect("height_m", s.height_m),
                   count_defect("sides", s.sides, 3, 1)});
}
std::optional<ShapeDefect> find_defect(const CylinderShape& s) {
  return first_of({length_defect("radius_m", s.radius_m), length_defect("height_m", s.height_m),
                   count_defect("segments", s.segments, 3, 1)});
}
std::optional<ShapeDefect> find_defect(const ConeShape& s) {
  return first_of({length_defect("radius_m", s.radius_m), length_defect("height_m", s.height_m),
                   count_defect("segments", s.segments, 3, 1)});
}
std::optional<ShapeDefect> find_defect(const SphereShape& s) {
  return first_of(
      {length_defect("radius_m", s.radius_m), count_defect("segments", s.segments, 4, 4)});
}
std::optional<ShapeDefect> find_defect(const CapsuleShape& s) {
  if (const auto defect =
          first_of({length_defect("radius_m", s.radius_m), length_defect("height_m", s.height_m),
                    count_defect("segments", s.segments, 4, 4)})) {
    return defect;
  }
  if (s.height_m > 2.0 * s.radius_m) return std::nullopt;
  return ShapeDefect{"height_m",
                     "is the height of the whole capsule; give more than twice radius_m"};
}
std::optional<ShapeDefect> find_defect(const TubeShape& s) {
  if (const auto defect = first_of({length_defect("inner_radius_m", s.inner_radius_m),
                                    length_defect("outer_radius_m", s.outer_radius_m),
                                    length_defect("height_m", s.height_m),
                                    count_defect("segments", s.segments, 3, 1)})) {
    return defect;
  }
  const double corner_m = s.inner_radius_m / facet_share(s.segments);
  if (s.outer_radius_m > 1.0001 * corner_m) return std::nullopt;
  return ShapeDefect{"inner_radius_m", "leaves no wall: the corners of the hole lie at " +
                                           short_number(corner_m, 4) + " m, outer_radius_m is " +
                                           short_number(s.outer_radius_m, 4) +
                                           "; give a smaller hole, or more segments"};
}
std::optional<ShapeDefect> find_defect(const ThreadShape& s) {
  if (s.internal) {
    if (const auto defect = length_defect("outer_radius_m", s.outer_radius_m)) return defect;
  }
  if (const auto defect = profile_defect(
          s.diameter_m, s.pitch_m, s.clearance_m, s.segments,
          s.internal ? std::optional(s.outer_radius_m * facet_share(s.segments)) : std::nullopt,
          "outer_radius_m")) {
    return defect;
  }
  return turns_defect("turns", s.turns);
}
std::optional<ShapeDefect> find_defect(const NutShape& s) {
  if (const auto defect =
          first_of({length_defect("width_across_flats_m", s.width_across_flats_m),
                    length_defect("height_m", s.height_m),
                    profile_defect(s.diameter_m, s.pitch_m, s.clearance_m, s.segments,
                                   0.5 * s.width_across_flats_m, "width_across_flats_m")})) {
    return defect;
  }
  return turns_defect("height_m", s.height_m / s.pitch_m);
}
std::optional<ShapeDefect> find_defect(const BoltShape& s) {
  if (const auto defect = first_of(
          {length_defect("width_across_flats_m", s.width_across_flats_m),
           length_defect("head_height_m", s.head_height_m), length_defect("length_m", s.length_m),
           profile_defect(s.diameter_m, s.pitch_m, s.clearance_m, s.segments,
                          0.5 * s.width_across_flats_m, "width_across_flats_m")})) {
    return defect;
  }
  return turns_defect("length_m", s.length_m / s.pitch_m);
}

/// Straight walls between two equal rings, both ends closed.
RawMesh straight(double radius_m, double height_m, std::uint32_t corners, const std::string& name) {
  ShapeBuilder b;
  const Loop low = b.ring(radius_m, -0.5 * height_m, corners);
  const Loop high = b.ring(radius_m, 0.5 * height_m, corners);
  b.strip(low, high);
  b.flat(low, false);
  b.flat(high, true);
  return b.finish(name);
}

RawMesh build(const BoxShape& s, const std::string& name) {
  ShapeBuilder b;
  for (unsigned i = 0; i < 8; ++i) {
    Point3 p;
    for (unsigned k = 0; k < 3; ++k) p[k] = ((i >> k & 1U) != 0 ? 0.5 : -0.5) * s.size_m[k];
    b.vertex(p);
  }
  for (const Loop& loop : {Loop{0, 2, 3, 1}, Loop{4, 5, 7, 6}, Loop{0, 1, 5, 4}, Loop{2, 6, 7, 3},
                           Loop{0, 4, 6, 2}, Loop{1, 3, 7, 5}}) {
    b.face(loop);
  }
  return b.finish(name);
}
RawMesh build(const PrismShape& s, const std::string& name) {
  return straight(s.radius_m, s.height_m, s.sides, name);
}
RawMesh build(const CylinderShape& s, const std::string& name) {
  return straight(s.radius_m, s.height_m, s.segments, name);
}
RawMesh build(const ConeShape& s, const std::string& name) {
  ShapeBuilder b;
  const Loop base = b.ring(s.radius_m, -0.5 * s.height_m, s.segments);
  b.fan(base, b.vertex({0, 0, 0.5 * s.height_m}), true);
  b.flat(base, false);
  return b.finish(name);
}

/// The triangles between two parallels of a half sphere, of 4 (i - 1) and 4 i corners (the first is
/// the pole), as on a subdivided octahedron. All lie in planes of their own.
void add_zone(ShapeBuilder& b, const Loop& inner, const Loop& outer, bool up) {
  const std::size_t steps = outer.size() / 4;
  const auto add = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r) {
    b.face(up ? Loop{p, q, r} : Loop{p, r, q});
  };
  for (std::size_t quarter = 0; quarter < 4; ++quarter) {
    for (std::size_t k = 0; k < steps; ++k) {
      const std::uint32_t at = inner[(quarter * (steps - 1) + k) % inner.size()];
      const std::uint32_t from = outer[quarter * steps + k];
      const std::uint32_t to = outer[(quarter * steps + k + 1) % outer.size()];
      add(at, from, to);
      if (k + 1 < steps) add(at, to, inner[(quarter * (steps - 1) + k + 1) % inner.size()]);
    }
  }
}

/// Rings of a half sphere from the pole to the equator, which is `equator`.
void add_half_sphere(ShapeBuilder& b, double radius_m, double centre_m, const Loop& equator,
                     bool up) {
  const auto segments = static_cast<std::uint32_t>(equator.size());
  const double side = up ? 1.0 : -1.0;
  Loop inner{b.vertex({0, 0, centre_m + side * radius_m})};
  for (std::uint32_t k = 1; k <= segments / 4; ++k) {
    const auto [c, s] = turn_direction(k, segments);
    Loop outer =
        k == segments / 4 ? equator : b.ring(radius_m * s, centre_m + side * (radius_m * c), 4 * k);
    add_zone(b, inner, outer, up);
    inner = std::move(outer);
  }
}

/// Two half spheres whose equators are `gap_m` apart; one ring for both where it is 0.
RawMesh rounded(double radius_m, double gap_m, std::uint32_t segments, const std::string& name) {
  ShapeBuilder b;
  const Loop low = b.ring(radius_m, -0.5 * gap_m, segments);
  const Loop high = gap_m > 0.0 ? b.ring(radius_m, 0.5 * gap_m, segments) : low;
  if (gap_m > 0.0) b.strip(low, high);
  add_half_sphere(b, radius_m, -0.5 * gap_m, low, false);
  add_half_sphere(b, radius_m, 0.5 * gap_m, high, true);
  return b.finish(name);
}
RawMesh build(const SphereShape& s, const std::string& name) {
  return rounded(s.radius_m, 0.0, s.segments, name);
}
RawMesh build(const CapsuleShape& s, const std::string& name) {
  return rounded(s.radius_m, s.height_m - 2.0 * s.radius_m, s.segments, name);
}
RawMesh build(const TubeShape& s, const std::string& name) {
  ShapeBuilder b;
  const double hole_m = s.inner_radius_m / facet_share(s.segments), z = 0.5 * s.height_m;
  const Loop out_low = b.ring(s.outer_radius_m, -z, s.segments);
  const Loop out_high = b.ring(s.outer_radius_m, z, s.segments);
  const Loop in_low = b.ring(hole_m, -z, s.segments);
  const Loop in_high = b.ring(hole_m, z, s.segments);
  b.strip(out_low, out_high);
  b.strip(out_high, in_high);
  b.strip(in_high, in_low);
  b.strip(in_low, out_low);
  return b.finish(name);
}
RawMesh build(const ThreadShape& s, const std::string& name) { return thread_mesh(s, name); }
RawMesh build(const NutShape& s, const std::string& name) { return nut_mesh(s, name); }
RawMesh build(const BoltShape& s, const std::string& name) { return bolt_mesh(s, name); }

double outer_error(double radius_m, std::uint32_t segments) {
  return radius_m * (1.0 - facet_share(segments));
}
double hole_error(double radius_m, std::uint32_t segments) {
  return radius_m * (1.0 / facet_share(segments) - 1.0);
}

/// Largest error of a sphere: at the triangle that comes nearest to the centre, inside of it or in
/// the middle of an edge.
double sphere_error(double radius_m, std::uint32_t segments) {
  const RawMesh unit = rounded(1.0, 0.0, segments, "");
  double nearest = 1.0;
  for (const RawFace& face : unit.faces) {
    Point3 normal{0, 0, 0};
    bool inside = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const Point3 &p = unit.vertices[face.vertices[k]],
                   &q = unit.vertices[face.vertices[(k + 1) % 3]];
      normal = vec::add(normal, vec::cross(p, q));
      nearest = std::min(nearest, 0.5 * vec::norm(vec::add(p, q)));
    }
    normal = vec::unit(normal);
    for (std::size_t k = 0; k < 3; ++k) {
      const Point3 &p = unit.vertices[face.vertices[k]],
                   &q = unit.vertices[face.vertices[(k + 1) % 3]];
      inside = inside && vec::dot(vec::cross(p, q), normal) >= 0.0;
    }
    if (inside) nearest = std::min(nearest, vec::dot(normal, unit.vertices[face.vertices[0]]));
  }
  return radius_m * (1.0 - nearest);
}

/// Crests and roots lie on cylinders. A flank is a saddle: half of the sag of its chords, and what
/// the diagonals add.
double thread_error(double diameter_m, double pitch_m, double clearance_m, std::uint32_t segments,
                    bool internal) {
  const double sign = internal ? 1.0 : -1.0;
  const double crest_m = 0.5 * diameter_m + sign * clearance_m;
  const double root_m = crest_m - thread_depth_m(pitch_m);
  const double sag_m = internal ? hole_error(crest_m, segments) : outer_error(crest_m, segments);
  const double lean_m = pitch_m / (2.0 * segments) * (crest_m - root_m) / (crest_m + root_m);
  return std::max(sag_m, 0.5 * sag_m + 0.5 * std::numbers::sqrt3 * lean_m);
}

}  // namespace

const std::vector<std::string_view>& shape_words() {
  static const std::vector<std::string_view> kWords{
      "box", "prism", "cylinder", "cone", "sphere", "capsule", "tube", "thread", "nut", "bolt"};
  return kWords;
}

std::string_view shape_word(const Shape& shape) { return shape_words()[shape.index()]; }

std::optional<ShapeDefect> defect_of(const Shape& shape) {
  return std::visit([](const auto& s) { return find_defect(s); }, shape);
}

RawMesh shape_mesh(const Shape& shape, const std::string& name) {
  if (const auto defect = defect_of(shape)) {
    throw InputError(name + ": " + defect->key + " " + defect->text);
  }
  return std::visit([&](const auto& s) { return build(s, name); }, shape);
}

double chord_error_m(const Shape& shape) {
  return std::visit(
      Overloaded{[](const BoxShape&) { return 0.0; }, [](const PrismShape&) { return 0.0; },
                 [](const CylinderShape& s) { return outer_error(s.radius_m, s.segments); },
                 [](const ConeShape& s) {
                   // Perpendicular to the cone, at its base.
                   return outer_error(s.radius_m, s.segments) * s.height_m /
                          std::hypot(s.height_m, s.radius_m);
                 },
                 [](const SphereShape& s) { return sphere_error(s.radius_m, s.segments); },
                 [](const CapsuleShape& s) { return sphere_error(s.radius_m, s.segments); },
                 [](const TubeShape& s) {
                   return std::max(outer_error(s.outer_radius_m, s.segments),
                                   hole_error(s.inner_radius_m, s.segments));
                 },
                 [](const ThreadShape& s) {
                   const double error_m =
                       thread_error(s.diameter_m, s.pitch_m, s.clearance_m, s.segments, s.internal);
                   return s.internal ? std::max(error_m, outer_error(s.outer_radius_m, s.segments))
                                     : error_m;
                 },
                 [](const NutShape& s) {
                   return thread_error(s.diameter_m, s.pitch_m, s.clearance_m, s.segments, true);
                 },
                 [](const BoltShape& s) {
                   return thread_error(s.diameter_m, s.pitch_m, s.clearance_m, s.segments, false);
                 }},
      shape);
}

std::uint32_t segments_of(const Shape& shape) {
  return std::visit(
      Overloaded{[](const BoxShape&) { return 0U; }, [](const PrismShape&) { return 0U; },
                 [](const auto& s) { return s.segments; }},
      shape);
}

}  // namespace haptic::tools
