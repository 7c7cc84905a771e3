// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/shapes/mating.hpp"

#include <algorithm>
#include <cmath>

#include "tools/common/formatted.hpp"

namespace haptic::tools {
namespace {

/// A cylinder, a sphere or the crests of a thread, at the shape's nominal radius.
struct RoundSurface {
  bool is_hole = false;
  double radius_m = 0.0;
  double pitch_m = 0.0;  ///< 0: no thread
  Shape shape;           ///< one whose chord error is that of this surface alone
};

void add_surfaces(const CylinderShape& s, std::vector<RoundSurface>& to) {
  to.push_back({false, s.radius_m, 0.0, s});
}
void add_surfaces(const SphereShape& s, std::vector<RoundSurface>& to) {
  to.push_back({false, s.radius_m, 0.0, s});
}
void add_surfaces(const CapsuleShape& s, std::vector<RoundSurface>& to) {
  to.push_back({false, s.radius_m, 0.0, s});
}
void add_surfaces(const TubeShape& s, std::vector<RoundSurface>& to) {
  to.push_back({false, s.outer_radius_m, 0.0, CylinderShape{s.outer_radius_m, 1.0, s.segments}});
  to.push_back({true, s.inner_radius_m, 0.0, TubeShape{s.inner_radius_m, 0.0, 1.0, s.segments}});
}
void add_thread(double diameter_m, double pitch_m, double clearance_m, std::uint32_t segments,
                bool internal, std::vector<RoundSurface>& to) {
  ThreadShape thread{diameter_m, pitch_m, 1.0, internal, 0.0, clearance_m, segments};
  to.push_back(
      {internal, 0.5 * diameter_m + (internal ? clearance_m : -clearance_m), pitch_m, thread});
}
void add_surfaces(const ThreadShape& s, std::vector<RoundSurface>& to) {
  add_thread(s.diameter_m, s.pitch_m, s.clearance_m, s.segments, s.internal, to);
  if (s.internal) {
    to.push_back({false, s.outer_radius_m, 0.0, CylinderShape{s.outer_radius_m, 1.0, s.segments}});
  }
}
void add_surfaces(const NutShape& s, std::vector<RoundSurface>& to) {
  add_thread(s.diameter_m, s.pitch_m, s.clearance_m, s.segments, true, to);
}
void add_surfaces(const BoltShape& s, std::vector<RoundSurface>& to) {
  add_thread(s.diameter_m, s.pitch_m, s.clearance_m, s.segments, false, to);
}
void add_surfaces(const BoxShape&, std::vector<RoundSurface>&) {}
void add_surfaces(const PrismShape&, std::vector<RoundSurface>&) {}
void add_surfaces(const ConeShape&, std::vector<RoundSurface>&) {}

std::vector<RoundSurface> surfaces_of(const Shape& shape) {
  std::vector<RoundSurface> surfaces;
  std::visit([&](const auto& s) { add_surfaces(s, surfaces); }, shape);
  return surfaces;
}

double error_with(const RoundSurface& surface, std::uint32_t segments) {
  Shape shape = surface.shape;
  std::visit(
      [&](auto& s) {
        if constexpr (requires { s.segments; }) s.segments = segments;
      },
      shape);
  return chord_error_m(shape);
}

/// Radii of one nominal size differ by the rounding of their sums.
constexpr double kSameSize = 1e-9;

/// Between a surface and a hole that it fits into, along the radius.
std::optional<double> radial_gap_m(const RoundSurface& a, const RoundSurface& b) {
  if (a.is_hole == b.is_hole) return std::nullopt;
  if (std::abs(a.pitch_m - b.pitch_m) > kSameSize * a.pitch_m) return std::nullopt;
  const double gap_m = (a.is_hole ? 1.0 : -1.0) * (a.radius_m - b.radius_m);
  if (gap_m < -kSameSize * a.radius_m) return std::nullopt;
  return std::max(gap_m, 0.0);
}

std::string fix_text(const RoundSurface& a, const RoundSurface& b, double clearance_m) {
  for (std::uint32_t n = 8; n <= kMaxSegments; n += 4) {
    if (error_with(a, n) + error_with(b, n) <= clearance_m) {
      return formatted("give both segments = %u or more, or a larger clearance", n);
    }
  }
  return "give a larger clearance";
}

}  // namespace

std::vector<std::string> fit_warnings(const Shape& a, const Shape& b, const std::string& name_a,
                                      const std::string& name_b) {
  std::vector<std::string> warnings;
  for (const RoundSurface& of_a : surfaces_of(a)) {
    for (const RoundSurface& of_b : surfaces_of(b)) {
      const std::optional<double> gap_m = radial_gap_m(of_a, of_b);
      if (!gap_m) continue;
      const double clearance_m = *gap_m;
      const double error_m = error_with(of_a, segments_of(a)) + error_with(of_b, segments_of(b));
      if (error_m <= clearance_m) continue;
      warnings.push_back(formatted(
          "%s in %s: the facets of both lie up to %.3g m off their round surfaces, more than the "
          "clearance of %.3g m between them, so the play depends on how the facets stand; %s",
          (of_a.is_hole ? name_b : name_a).c_str(), (of_a.is_hole ? name_a : name_b).c_str(),
          error_m, clearance_m, fix_text(of_a, of_b, clearance_m).c_str()));
    }
  }
  return warnings;
}

std::optional<double> least_clearance_m(const Shape& a, const Shape& b) {
  // Flanks stand at 30 degrees to the radius.
  constexpr double kFlank = 0.5;
  std::optional<double> least;
  for (const RoundSurface& of_a : surfaces_of(a)) {
    for (const RoundSurface& of_b : surfaces_of(b)) {
      const std::optional<double> gap_m = radial_gap_m(of_a, of_b);
      if (!gap_m) continue;
      const double clearance_m = (of_a.pitch_m > 0.0 ? kFlank : 1.0) * *gap_m;
      if (!least || clearance_m < *least) least = clearance_m;
    }
  }
  return least;
}

}  // namespace haptic::tools
