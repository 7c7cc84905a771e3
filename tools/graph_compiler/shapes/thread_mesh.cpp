// SPDX-License-Identifier: Apache-2.0
/// Threads: four helices of corners (both edges of the crest, both of the root), a step of them at
/// each of the segments' angles, cut off by two planes across the axis.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <tuple>

#include "tools/graph_compiler/shapes/shape_builder.hpp"

namespace haptic::tools {
namespace {

/// Distance of the four helices from the middle of the crest, in 1/32 of the pitch, and whether
/// they lie on the crest: crest P/8, flank 5P/16, root P/4, flank 5P/16.
constexpr std::array<std::int64_t, 4> kHelix{-2, 2, 12, 20};
constexpr std::array<bool, 4> kOnCrest{true, true, false, false};
/// Corners nearer to a cutting plane than this are moved onto it, in pitches.
constexpr double kSnap = 1e-6;
/// Segments that an internal thread has more than it is asked for: of as many as those of its bolt
/// all facets would come from one to the next at the same moments.
constexpr std::uint32_t kMoreOfNut = 2;

struct ThreadProfile {
  double crest_m = 0.0, root_m = 0.0;  ///< radii of the corners
  double pitch_m = 0.0;
  std::uint32_t segments = 0;
  bool internal = false;
};

ThreadProfile profile_of(double diameter_m, double pitch_m, double clearance_m,
                         std::uint32_t segments, bool internal) {
  if (internal) segments += kMoreOfNut;
  const double crest_m = 0.5 * diameter_m + (internal ? clearance_m : -clearance_m);
  const double share = internal ? facet_share(segments) : 1.0;
  return {crest_m / share, (crest_m - thread_depth_m(pitch_m)) / share, pitch_m, segments,
          internal};
}

/// The thread's surface between two planes, added to a builder; its two rims are left open.
class CutThread {
 public:
  CutThread(ShapeBuilder& builder, const ThreadProfile& profile, double low_m, double high_m)
      : builder_(builder), profile_(profile), planes_{low_m, high_m} {
    const auto n = static_cast<std::int64_t>(profile_.segments);
    const double steps_per_m = static_cast<double>(n) / profile_.pitch_m;
    const auto first = static_cast<std::int64_t>(low_m * steps_per_m) - n - 2;
    const auto last = static_cast<std::int64_t>(high_m * steps_per_m) + n / 16 + 2;
    for (std::int64_t step = first; step <= last; ++step) {
      for (std::size_t helix = 0; helix < 4; ++helix) add_strip(helix, step);
    }
  }

  /// The rim in a plane (0: lower, 1: upper), counter-clockwise seen from +z.
  Loop rim(std::size_t plane) const {
    std::map<std::uint32_t, std::uint32_t> next;
    for (const auto& [from, to] : rim_edges_[plane]) next[from] = to;
    Loop loop;
    std::uint32_t at = next.begin()->first;
    do {
      loop.push_back(at);
      at = next.at(at);
    } while (at != loop.front() && loop.size() <= next.size());
    const bool clockwise = (plane == 1) != profile_.internal;
    if (clockwise) std::reverse(loop.begin(), loop.end());
    return loop;
  }

 private:
  using Polygon = std::vector<std::size_t>;  // indices into points_

  std::size_t corner(std::size_t helix, std::int64_t step) {
    const auto n = static_cast<std::int64_t>(profile_.segments);
    if (helix == kHelix.size()) return corner(0, step + n);
    const auto [place, is_new] = corners_.try_emplace({helix, step}, points_.size());
    if (is_new) {
      const double radius_m = kOnCrest[helix] ? profile_.crest_m : profile_.root_m;
      const auto [c, s] =
          turn_direction(static_cast<std::uint64_t>((step % n + n) % n), profile_.segments);
      double z = profile_.pitch_m * static_cast<double>(32 * step + n * kHelix[helix]) /
                 static_cast<double>(32 * n);
      for (const double plane : planes_) {
        if (std::abs(z - plane) <= kSnap * profile_.pitch_m) z = plane;
      }
      add_point({radius_m * c, radius_m * s, z});
    }
    return place->second;
  }

  void add_point(const Point3& p) {
    points_.push_back(p);
    built_.push_back(kNotBuilt);
  }

  /// Between a helix and the next one above, from one step to the next.
  void add_strip(std::size_t helix, std::int64_t step) {
    const std::size_t a = corner(helix, step), b = corner(helix, step + 1),
                      c = corner(helix + 1, step + 1), d = corner(helix + 1, step);
    const bool is_flank = helix % 2 == 1;
    if (!is_flank) {
      add_cut({a, b, c, d});
    } else if (profile_.internal) {
      // The diagonal that lies in the material: the other one would stand out of it.
      add_cut({a, b, c});
      add_cut({a, c, d});
    } else {
      add_cut({a, b, d});
      add_cut({b, c, d});
    }
  }

  /// Adds the part of the polygon that lies between the planes.
  void add_cut(Polygon polygon) {
    for (std::size_t plane = 0; plane < 2; ++plane) {
      Polygon kept;
      for (std::size_t k = 0; k < polygon.size(); ++k) {
        const std::size_t from = polygon[k], to = polygon[(k + 1) % polygon.size()];
        const double here = inside(from, plane), there = inside(to, plane);
        if (here >= 0.0) kept.push_back(from);
        if ((here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0)) {
          kept.push_back(cut_point(from, to, plane));
        }
      }
      polygon = std::move(kept);
      if (polygon.size() < 3) return;
    }
    if (profile_.internal) std::reverse(polygon.begin(), polygon.end());
    Loop loop;
    for (const std::size_t p : polygon) loop.push_back(built(p));
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const std::size_t next = (k + 1) % polygon.size();
      for (std::size_t plane = 0; plane < 2; ++plane) {
        if (points_[polygon[k]][2] == planes_[plane] && points_[polygon[next]][2] == planes_[plane])
          rim_edges_[plane].emplace_back(loop[k], loop[next]);
      }
    }
    builder_.face(std::move(loop));
  }

  [[nodiscard]] double inside(std::size_t p, std::size_t plane) const {
    const double above = points_[p][2] - planes_[plane];
    return plane == 0 ? above : -above;
  }

  /// Where an edge crosses a plane: equal bits from both sides of the edge.
  std::size_t cut_point(std::size_t from, std::size_t to, std::size_t plane) {
    const auto [place, is_new] =
        cuts_.try_emplace({std::min(from, to), std::max(from, to), plane}, points_.size());
    if (is_new) {
      const Point3 &a = points_[from], &b = points_[to];
      const double wa = std::abs(b[2] - planes_[plane]), wb = std::abs(a[2] - planes_[plane]);
      const double sum = wa + wb;
      add_point({(wa * a[0] + wb * b[0]) / sum, (wa * a[1] + wb * b[1]) / sum, planes_[plane]});
    }
    return place->second;
  }

  std::uint32_t built(std::size_t p) {
    if (built_[p] == kNotBuilt) built_[p] = builder_.vertex(points_[p]);
    return built_[p];
  }

  static constexpr std::uint32_t kNotBuilt = 0xFFFFFFFFU;
  ShapeBuilder& builder_;
  ThreadProfile profile_;
  std::array<double, 2> planes_;
  std::vector<Point3> points_;
  std::vector<std::uint32_t> built_;  // vertex of the builder of each point
  std::map<std::pair<std::size_t, std::int64_t>, std::size_t> corners_;
  std::map<std::tuple<std::size_t, std::size_t, std::size_t>, std::size_t> cuts_;
  std::array<std::vector<std::pair<std::uint32_t, std::uint32_t>>, 2> rim_edges_;
};

/// Angles of a loop around the axis, rising from the one nearest to 0; the loop is turned to start
/// there.
std::vector<double> angles_from_x(const ShapeBuilder& builder, Loop& loop) {
  const auto angle = [&](std::uint32_t v) {
    const double a = std::atan2(builder.at(v)[1], builder.at(v)[0]);
    return a < -1e-9 ? a + 2.0 * std::numbers::pi : a;
  };
  std::rotate(
      loop.begin(),
      std::min_element(loop.begin(), loop.end(),
                       [&](std::uint32_t a, std::uint32_t b) { return angle(a) < angle(b); }),
      loop.end());
  std::vector<double> angles;
  for (const std::uint32_t v : loop) angles.push_back(angle(v));
  angles.push_back(angles.front() + 2.0 * std::numbers::pi);
  return angles;
}

/// Triangles of the plane between two loops around the axis, both counter-clockwise from +z.
void close_between(ShapeBuilder& builder, Loop inner, Loop outer, bool up) {
  const std::vector<double> in = angles_from_x(builder, inner), out = angles_from_x(builder, outer);
  std::size_t i = 0, j = 0;
  while (i < inner.size() || j < outer.size()) {
    const std::uint32_t a = inner[i % inner.size()], b = outer[j % outer.size()];
    // From the corner outside that is nearest: a farther one may lie behind the inner loop's side.
    const bool inner_next =
        j == outer.size() || (i < inner.size() && in[i + 1] <= 0.5 * (out[j] + out[j + 1]) + 1e-9);
    const std::uint32_t c = inner_next ? inner[++i % inner.size()] : outer[++j % outer.size()];
    builder.face(up ? Loop{a, b, c} : Loop{a, c, b});
  }
}

/// A rod's end: a fan around the axis.
void close_end(ShapeBuilder& builder, const Loop& rim, bool up) {
  builder.fan(rim, builder.vertex({0, 0, builder.at(rim.front())[2]}), up);
}

/// A straight outer wall around an internal thread, and the two rings between them.
void wrap(ShapeBuilder& builder, const CutThread& thread, double radius_m, std::uint32_t corners,
          double half_height_m) {
  const Loop low = builder.ring(radius_m, -half_height_m, corners);
  const Loop high = builder.ring(radius_m, half_height_m, corners);
  builder.strip(low, high);
  close_between(builder, thread.rim(0), low, false);
  close_between(builder, thread.rim(1), high, true);
}

/// Corners of a hexagon by its width across flats.
double hexagon_radius_m(double width_m) { return width_m / std::numbers::sqrt3; }

}  // namespace

RawMesh thread_mesh(const ThreadShape& s, const std::string& name) {
  ShapeBuilder builder;
  const double half_m = 0.5 * s.turns * s.pitch_m;
  const CutThread thread(builder,
                         profile_of(s.diameter_m, s.pitch_m, s.clearance_m, s.segments, s.internal),
                         -half_m, half_m);
  if (s.internal) {
    wrap(builder, thread, s.outer_radius_m, s.segments, half_m);
  } else {
    close_end(builder, thread.rim(0), false);
    close_end(builder, thread.rim(1), true);
  }
  return builder.finish(name);
}

RawMesh nut_mesh(const NutShape& s, const std::string& name) {
  ShapeBuilder builder;
  const double half_m = 0.5 * s.height_m;
  const CutThread thread(builder,
                         profile_of(s.diameter_m, s.pitch_m, s.clearance_m, s.segments, true),
                         -half_m, half_m);
  wrap(builder, thread, hexagon_radius_m(s.width_across_flats_m), 6, half_m);
  return builder.finish(name);
}

RawMesh bolt_mesh(const BoltShape& s, const std::string& name) {
  ShapeBuilder builder;
  const CutThread thread(builder,
                         profile_of(s.diameter_m, s.pitch_m, s.clearance_m, s.segments, false),
                         -s.length_m, 0.0);
  close_end(builder, thread.rim(0), false);
  const double radius_m = hexagon_radius_m(s.width_across_flats_m);
  const Loop bearing = builder.ring(radius_m, 0.0, 6);
  const Loop top = builder.ring(radius_m, s.head_height_m, 6);
  close_between(builder, thread.rim(1), bearing, false);
  builder.strip(bearing, top);
  builder.flat(top, true);
  return builder.finish(name);
}

}  // namespace haptic::tools
