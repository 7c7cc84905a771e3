// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/start_pose.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/mesh/box_tree.hpp"
#include "tools/graph_compiler/mesh/edge_table.hpp"
#include "tools/graph_compiler/mesh/shell_interior.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/surface/triangle_gap.hpp"

namespace haptic::tools {
namespace {

/// Share of the diagonal: points nearer to a shell are on it, neither inside nor outside.
constexpr double kOnShell = 1.0e-9;
/// How far from a whole number the winding number of an open shell is that encloses a point.
constexpr double kNearWhole = 0.1;
/// And in the middle of an opening that nothing closes, at least.
constexpr double kOpenMiddle = 0.25;
/// Openings that a part passes; a shell with more has a mouth.
constexpr std::size_t kMostMouths = 64;
/// Share of the diagonal: accuracy with which the bisection finds the end of the collision.
constexpr double kMoveShare = 1.0e-4;
/// First reach as a share of the largest distance that is asked for, and the factor from one reach
/// to the next.
constexpr double kFirstReach = 1.0e-4, kWiderReach = 8.0;

Point3 turned(const std::array<double, 4>& q, const Point3& x) {
  const double length2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  const Point3 u{q[1], q[2], q[3]};
  const Point3 t = vec::scaled(vec::cross(u, x), 2.0 / length2);
  return vec::add(vec::add(x, vec::scaled(t, q[0])), vec::cross(u, t));
}

Point3 placed(const StartPose& pose, const Point3& x) {
  return vec::add(turned(pose.quaternion_wxyz, x), pose.position_m);
}

/// A convex polygon as a fan; triangles without area add nothing to the union of the others.
template <class Add>
void for_fan(const std::vector<Point3>& points, const std::vector<std::uint32_t>& loop,
             const Add& add) {
  for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
    const TriangleCorners t{points[loop[0]], points[loop[k]], points[loop[k + 1]]};
    if (vec::norm(exact_twice_area(t.data(), 3)) > 0.0) add(t);
  }
}

/// Facets of the sets, connected by edges, whose every edge has two facets of opposite sense.
std::vector<std::uint8_t> enclosing_facets(const SurfacePart& part, const SurfaceAccount& account) {
  if (account.tight) return std::vector<std::uint8_t>(part.facets.size(), 1);
  struct Use {
    std::uint32_t count = 0, first = 0;
    int sense = 0;
  };
  std::vector<Use> uses(part.edges.size());
  ParitySets sets(part.facets.size());
  for (std::uint32_t f = 0; f < part.facets.size(); ++f) {
    const std::vector<std::uint32_t>& loop = part.facets[f].loop;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      Use& use = uses[part.edge_of[part.side_begin[f] + k]];
      if (use.count == 0) use.first = f;
      sets.unite(use.first, f, false);
      ++use.count;
      use.sense += loop[k] < loop[k + 1 == loop.size() ? 0 : k + 1] ? 1 : -1;
    }
  }
  std::vector<std::uint8_t> open(part.facets.size(), 0);  // by root
  for (const Use& use : uses) {
    if (use.count != 2 || use.sense != 0) open[sets.root_of(use.first)] = 1;
  }
  std::vector<std::uint8_t> encloses(part.facets.size());
  for (std::uint32_t f = 0; f < part.facets.size(); ++f) {
    encloses[f] = open[sets.root_of(f)] == 0 ? 1 : 0;
  }
  return encloses;
}

/// A side of a facet that no other facet takes back.
struct OpenSide {
  std::uint32_t from = 0, to = 0;
  int times = 0;
};

/// Those of the facets that enclose nothing; a seam with a T-junction has some on either side.
std::vector<OpenSide> open_sides(const SurfacePart& part,
                                 const std::vector<std::uint8_t>& encloses) {
  std::vector<int> sum(part.edges.size(), 0);
  for (std::uint32_t f = 0; f < part.facets.size(); ++f) {
    if (encloses[f] != 0) continue;
    const std::vector<std::uint32_t>& loop = part.facets[f].loop;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      sum[part.edge_of[part.side_begin[f] + k]] +=
          loop[k] < loop[k + 1 == loop.size() ? 0 : k + 1] ? 1 : -1;
    }
  }
  std::vector<OpenSide> sides;
  for (std::size_t e = 0; e < sum.size(); ++e) {
    const auto [low, high] = part.edges[e];
    if (sum[e] > 0) sides.push_back({low, high, sum[e]});
    if (sum[e] < 0) sides.push_back({high, low, -sum[e]});
  }
  return sides;
}

/// Near the middle and on no line through it that a symmetric lid would have an edge on: there the
/// solid angle of a triangle is not defined.
Point3 about_middle(const Point3& middle, const Point3& a, const Point3& b) {
  return vec::add(middle, vec::add(vec::scaled(vec::sub(a, middle), 0.137),
                                   vec::scaled(vec::sub(b, middle), 0.071)));
}

/// Cones over the open sides, a middle for all that hang together: they close the open facets. And
/// what fits through each: its area over its length bounds the width of a crack.
void close_open_sides(const std::vector<OpenSide>& sides, const std::vector<Point3>& points,
                      StartShape& shape) {
  struct Hole {
    vec::Box box;
    Point3 middle{0, 0, 0}, twice_area{0, 0, 0};
    double count = 0.0;
    OpenSide first;
  };
  ParitySets sets(points.size());
  for (const OpenSide& side : sides) sets.unite(side.from, side.to, false);
  std::map<std::uint32_t, Hole> holes;  // by root
  for (const OpenSide& side : sides) {
    Hole& hole = holes[sets.root_of(side.from)];
    if (!(hole.count > 0.0)) hole.first = side;
    for (const std::uint32_t v : {side.from, side.to}) {
      hole.box.include(points[v]);
      hole.middle = vec::add(hole.middle, points[v]);
      hole.count += 1.0;
    }
  }
  for (auto& [root, hole] : holes) hole.middle = vec::scaled(hole.middle, 1.0 / hole.count);
  for (const OpenSide& side : sides) {
    Hole& hole = holes[sets.root_of(side.from)];
    const Point3 &from = points[side.from], &to = points[side.to];
    for (int k = 0; k < side.times; ++k) {
      shape.rim.push_back({hole.middle, to, from});
      hole.twice_area = vec::add(
          hole.twice_area, vec::cross(vec::sub(to, hole.middle), vec::sub(from, hole.middle)));
    }
  }
  for (const auto& [root, hole] : holes) {
    const double length = hole.box.diagonal();
    if (!(length > 0.0)) continue;
    shape.openings.push_back(
        {vec::norm(hole.twice_area) / length, length,
         about_middle(hole.middle, points[hole.first.from], points[hole.first.to])});
  }
}

std::array<double, 3> extent_of(const std::vector<Point3>& points) {
  vec::Box box;
  for (const Point3& p : points) box.include(p);
  std::array<double, 3> extent = vec::sub(box.high, box.low);
  std::sort(extent.begin(), extent.end());
  return extent;
}

/// Evenly spread over the points of every set.
std::vector<std::vector<Point3>> samples_of(const std::vector<Point3>& points, ParitySets& sets) {
  std::map<std::uint32_t, std::vector<std::uint32_t>> parts;  // by root
  for (std::uint32_t v = 0; v < points.size(); ++v) parts[sets.root_of(v)].push_back(v);
  std::vector<std::vector<std::uint32_t>> members;
  for (auto& [root, part] : parts) members.push_back(std::move(part));
  std::stable_sort(members.begin(), members.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  if (members.size() > kMostSampledParts) members.resize(kMostSampledParts);
  std::vector<std::vector<Point3>> samples;
  for (const std::vector<std::uint32_t>& part : members) {
    const std::size_t count = std::min(part.size(), kMostPartSamples);
    std::vector<Point3>& taken = samples.emplace_back();
    for (std::size_t k = 0; k < count; ++k) taken.push_back(points[part[k * part.size() / count]]);
  }
  return samples;
}

vec::Box box_of(const std::vector<TriangleCorners>& triangles) {
  vec::Box box;
  for (const TriangleCorners& t : triangles) {
    for (const Point3& p : t) box.include(p);
  }
  return box;
}

std::vector<vec::Box> boxes_of(const std::vector<TriangleCorners>& triangles) {
  std::vector<vec::Box> boxes(triangles.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (const Point3& p : triangles[i]) boxes[i].include(p);
  }
  return boxes;
}

/// Never above that of what is in them.
double distance_of(const vec::Box& a, const vec::Box& b) {
  double square = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double gap = std::max({0.0, a.low[k] - b.high[k], b.low[k] - a.high[k]});
    square += gap * gap;
  }
  return std::sqrt(square);
}

TriangleCorners shifted(const TriangleCorners& t, const Point3& by) {
  return {vec::add(t[0], by), vec::add(t[1], by), vec::add(t[2], by)};
}

}  // namespace

/// One static part, ready for questions at many places of the moving one.
struct StartObstacle {
  explicit StartObstacle(const StartShape& fixed)
      : shape(&fixed),
        boxes(boxes_of(fixed.triangles)),
        tree(boxes),
        box(box_of(fixed.triangles)),
        interior(fixed.shells, kOnShell * box.diagonal()),
        open_interior(fixed.open_facets, fixed.rim, kOnShell * box.diagonal()) {}
  const StartShape* shape;
  std::vector<vec::Box> boxes;  ///< of the triangles
  BoxTree tree;
  vec::Box box;
  ShellInterior interior;
  OpenShellInterior open_interior;
  bool has_mouth = false;       ///< for the moving part
  bool part_has_mouth = false;  ///< the moving part has one for this
};

namespace {

bool passes(const StartShape& part, const StartShape::Opening& opening) {
  return part.extent_m[0] <= opening.wide_m && part.extent_m[1] <= opening.long_m;
}

/// An opening of the shell lets the part through. One that something else closes, such as a lid
/// with a crack round it, has a whole winding number in its middle.
bool has_mouth(const StartShape& shell, const OpenShellInterior& interior, const StartShape& part) {
  std::size_t looked_at = 0;
  for (const StartShape::Opening& opening : shell.openings) {
    if (!passes(part, opening)) continue;
    if (++looked_at > kMostMouths) return true;
    const double winding = interior.winding_of(opening.middle_m);
    if (std::abs(winding - std::round(winding)) > kOpenMiddle) return true;
  }
  return false;
}

bool all_inside(const std::vector<Point3>& points, const Point3& by, const ShellInterior& shell) {
  return std::ranges::all_of(points, [&](const Point3& p) {
    return shell.place_of(vec::add(p, by)) == PointPlace::kInside;
  });
}

/// The open facets of `shell` enclose most of the points, and the part that these belong to cannot
/// have come in through an opening.
bool lies_in_open_shell(const std::vector<Point3>& points, const Point3& by,
                        const OpenShellInterior& shell) {
  std::size_t enclosed = 0;
  for (const Point3& p : points) {
    const double winding = shell.winding_of(vec::add(p, by));
    const double whole = std::round(winding);
    if (std::abs(whole) > 0.5 && std::abs(winding - whole) <= kNearWhole) ++enclosed;
  }
  return 2 * enclosed > points.size();
}

}  // namespace

class StartSearch {
 public:
  StartSearch(const StartShape& moving, const std::vector<StartShape>& fixed)
      : moving_(moving),
        box_(box_of(moving.triangles)),
        tree_(boxes_of(moving.triangles)),
        interior_(moving.shells, kOnShell * box_.diagonal()),
        open_interior_(moving.open_facets, moving.rim, kOnShell * box_.diagonal()) {
    for (const StartShape& shape : fixed) {
      StartObstacle& o = obstacles_.emplace_back(shape);
      o.has_mouth = has_mouth(shape, o.open_interior, moving);
      o.part_has_mouth = has_mouth(moving, open_interior_, shape);
    }
  }

  std::optional<StartCollision> run() {
    std::optional<StartCollision> found = at({0, 0, 0});
    if (found && has_surface(obstacles_[found->fixed])) found->free_move_m = shortest_free_move();
    return found;
  }

  /// With the moving part shifted by `by`: one that involves a surface first.
  [[nodiscard]] std::optional<StartCollision> at(const Point3& by, double touching_m = 0.0) const {
    std::optional<StartCollision> found;
    for (const bool of_surfaces : {true, false}) {
      for (std::size_t i = 0; i < obstacles_.size() && !found; ++i) {
        if (has_surface(obstacles_[i]) == of_surfaces) found = collision(by, i, touching_m);
      }
    }
    return found;
  }

  [[nodiscard]] double distance_m(const Point3& by, double most_m) const;

 private:
  [[nodiscard]] bool has_surface(const StartObstacle& o) const {
    return moving_.is_surface || o.shape->is_surface;
  }

  [[nodiscard]] std::optional<StartCollision> collision(const Point3& by, std::size_t index,
                                                        double touching_m = 0.0) const;
  [[nodiscard]] std::optional<StartCollision> crossing(const Point3& by, std::size_t index,
                                                       double touching_m) const;
  [[nodiscard]] bool is_free(const Point3& by) const {
    for (std::size_t i = 0; i < obstacles_.size(); ++i) {
      if (collision(by, i)) return false;
    }
    return true;
  }
  [[nodiscard]] double clear_distance(const Point3& direction) const;
  [[nodiscard]] Point3 shortest_free_move() const;

  const StartShape& moving_;
  vec::Box box_;
  BoxTree tree_;
  ShellInterior interior_;
  OpenShellInterior open_interior_;
  std::vector<StartObstacle> obstacles_;
};

/// With the moving part shifted by `by`.
std::optional<StartCollision> StartSearch::collision(const Point3& by, std::size_t index,
                                                     double touching_m) const {
  const StartObstacle& o = obstacles_[index];
  vec::Box all = box_;
  all.low = vec::add(all.low, by);
  all.high = vec::add(all.high, by);
  if (!all.meets(o.box)) return std::nullopt;
  if (const auto crossed = crossing(by, index, touching_m)) return crossed;
  const auto inside = [&](const Point3& place) {
    StartCollision found;
    found.fixed = index;
    found.inside = true;
    found.place_m = place;
    return found;
  };
  const Point3 back = vec::scaled(by, -1.0);
  if (touching_m > 0.0) {
    // Nothing crosses: what hangs together lies on one side, but for corners that touch.
    for (const std::vector<Point3>& points : moving_.samples) {
      if (all_inside(points, by, o.interior)) return inside(vec::add(points[0], by));
    }
    for (const std::vector<Point3>& points : o.shape->samples) {
      if (all_inside(points, back, interior_)) return inside(points[0]);
    }
  } else {
    for (const Point3& p : moving_.probes) {
      const Point3 at = vec::add(p, by);
      if (o.interior.place_of(at) == PointPlace::kInside) return inside(at);
    }
    for (const Point3& p : o.shape->probes) {
      if (interior_.place_of(vec::add(p, back)) == PointPlace::kInside) return inside(p);
    }
  }
  if (!o.shape->open_facets.empty() && !o.has_mouth) {
    for (const std::vector<Point3>& points : moving_.samples) {
      if (lies_in_open_shell(points, by, o.open_interior)) return inside(vec::add(points[0], by));
    }
  }
  if (!moving_.open_facets.empty() && !o.part_has_mouth) {
    for (const std::vector<Point3>& points : o.shape->samples) {
      if (lies_in_open_shell(points, back, open_interior_)) return inside(points[0]);
    }
  }
  return std::nullopt;
}

/// A pair of facets that meet, or of solids that cross.
std::optional<StartCollision> StartSearch::crossing(const Point3& by, std::size_t index,
                                                    double touching_m) const {
  const StartObstacle& o = obstacles_[index];
  const bool touching_counts = has_surface(o);
  std::vector<std::uint32_t> near;
  const auto meet = [&](std::size_t i, std::size_t k) -> std::optional<StartCollision> {
    const TriangleCorners t = shifted(moving_.triangles[i], by);
    const TriangleCorners& other = o.shape->triangles[k];
    if (!(touching_counts ? triangles_meet(t, other) : triangles_cross(t, other))) {
      return std::nullopt;
    }
    if (touching_m > 0.0 && triangle_overlap_m(t, other) <= touching_m) return std::nullopt;
    vec::Box ours, theirs;
    for (const Point3& p : t) ours.include(p);
    for (const Point3& p : other) theirs.include(p);
    StartCollision found;
    found.fixed = index;
    found.face = moving_.source_face[i];
    found.fixed_face = o.shape->source_face[k];
    for (std::size_t c = 0; c < 3; ++c) {
      found.place_m[c] =
          0.5 * (std::max(ours.low[c], theirs.low[c]) + std::min(ours.high[c], theirs.high[c]));
    }
    return found;
  };
  // The tree of the part with more triangles is asked.
  if (moving_.triangles.size() <= o.shape->triangles.size()) {
    for (std::size_t i = 0; i < moving_.triangles.size(); ++i) {
      vec::Box box;
      for (const Point3& p : shifted(moving_.triangles[i], by)) box.include(p);
      if (!box.meets(o.box)) continue;
      o.tree.find(box, near);
      for (const std::uint32_t k : near) {
        if (const auto found = meet(i, k)) return found;
      }
    }
    return std::nullopt;
  }
  const Point3 back = vec::scaled(by, -1.0);
  const double rounding = kOnShell * (box_.diagonal() + vec::norm(by));
  for (std::size_t k = 0; k < o.shape->triangles.size(); ++k) {
    vec::Box box;
    for (const Point3& p : shifted(o.shape->triangles[k], back)) box.include(p);
    box = box.grown(rounding);
    if (!box.meets(box_)) continue;
    tree_.find(box, near);
    for (const std::uint32_t i : near) {
      if (const auto found = meet(i, k)) return found;
    }
  }
  return std::nullopt;
}

double StartSearch::distance_m(const Point3& by, double most_m) const {
  std::vector<std::uint32_t> near;
  // Wider and wider, so that little is looked at where the parts are close.
  for (double reach_m = kFirstReach * most_m;; reach_m = std::min(kWiderReach * reach_m, most_m)) {
    double least = reach_m;
    for (const StartObstacle& o : obstacles_) {
      for (const TriangleCorners& triangle : moving_.triangles) {
        const TriangleCorners t = shifted(triangle, by);
        vec::Box box;
        for (const Point3& p : t) box.include(p);
        o.tree.find(box.grown(least), near);
        for (const std::uint32_t k : near) {
          if (distance_of(box, o.boxes[k]) < least)
            least = std::min(least, triangle_distance_m(t, o.shape->triangles[k]));
        }
      }
    }
    if (least < reach_m || reach_m >= most_m) return least;
  }
}

/// A distance along `direction` after which the box of the moving part is beyond all others.
double StartSearch::clear_distance(const Point3& direction) const {
  vec::Box others;
  for (const StartObstacle& o : obstacles_) {
    others.include(o.box.low);
    others.include(o.box.high);
  }
  double least = HUGE_VAL;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(std::abs(direction[k]) > 0.0)) continue;
    const double gap =
        direction[k] > 0.0 ? others.high[k] - box_.low[k] : others.low[k] - box_.high[k];
    least = std::min(least, std::max(0.0, gap / direction[k]));
  }
  return least + 0.01 * box_.diagonal();
}

Point3 StartSearch::shortest_free_move() const {
  std::vector<Point3> directions;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const Point3 d{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
        if (vec::norm(d) > 0.0) directions.push_back(vec::unit(d));
      }
    }
  }
  vec::Box others;
  for (const StartObstacle& o : obstacles_) {
    others.include(o.box.low);
    others.include(o.box.high);
  }
  const Point3 apart = vec::sub(vec::add(box_.low, box_.high), vec::add(others.low, others.high));
  if (vec::norm(apart) > kOnShell * others.diagonal()) directions.push_back(vec::unit(apart));
  // Straight moves first: of equal ones they are easier to read.
  std::stable_sort(directions.begin(), directions.end(), [](const Point3& a, const Point3& b) {
    const auto along = [](const Point3& d) {
      return std::max({std::abs(d[0]), std::abs(d[1]), std::abs(d[2])});
    };
    return along(a) > along(b);
  });
  const double step = kMoveShare * box_.diagonal();
  double best = HUGE_VAL;
  Point3 move{0, 0, 0};
  for (const Point3& d : directions) {
    double blocked = 0.0, free = clear_distance(d);
    if (free > best) {
      free = best - step;
      if (!(free > 0.0) || !is_free(vec::scaled(d, free))) continue;
    }
    while (free - blocked > step) {
      const double middle = 0.5 * (blocked + free);
      (is_free(vec::scaled(d, middle)) ? free : blocked) = middle;
    }
    // Room for the digits of a message.
    if (is_free(vec::scaled(d, free + step))) free += step;
    if (free >= best) continue;
    best = free;
    move = vec::scaled(d, free);
  }
  return move;
}

namespace {

std::string place_of(const Point3& p) {
  return formatted("(%.6g, %.6g, %.6g) m", p[0] + 0.0, p[1] + 0.0, p[2] + 0.0);
}

std::string face_of(std::int64_t face) {
  return face < 0 ? "a cut" : "face " + std::to_string(face + 1);
}

}  // namespace

StartShape start_shape(const SurfacePart& part, const SurfaceAccount& account,
                       const StartPose& pose) {
  StartShape shape;
  shape.is_surface = true;
  std::vector<Point3> points;
  for (const Point3& p : part.vertices_m) points.push_back(placed(pose, p));
  const std::vector<std::uint8_t> encloses = enclosing_facets(part, account);
  ParitySets sets(points.size());
  for (std::size_t f = 0; f < part.facets.size(); ++f) {
    const std::vector<std::uint32_t>& loop = part.facets[f].loop;
    for (const std::uint32_t v : loop) sets.unite(loop[0], v, false);
    for_fan(points, loop, [&](const TriangleCorners& t) {
      shape.triangles.push_back(t);
      shape.source_face.push_back(part.source_face[f]);
      (encloses[f] != 0 ? shape.shells : shape.open_facets).push_back(t);
    });
  }
  close_open_sides(open_sides(part, encloses), points, shape);
  shape.extent_m = extent_of(part.vertices_m);
  shape.samples = samples_of(points, sets);
  for (std::uint32_t v = 0; v < points.size(); ++v) {
    if (sets.root_of(v) == v) shape.probes.push_back(points[v]);
  }
  return shape;
}

StartShape start_shape(const Body& body, const std::array<double, 3>& origin_m,
                       const StartPose& pose) {
  StartShape shape;
  std::vector<Point3> corners;
  for (const ConvexPiece& piece : body.pieces) {
    corners.insert(corners.end(), piece.vertices.begin(), piece.vertices.end());
    std::vector<Point3> points;
    Point3 middle{0, 0, 0};
    for (const Point3& v : piece.vertices) {
      points.push_back(placed(pose, vec::add(v, origin_m)));
      middle = vec::add(middle, points.back());
    }
    shape.probes.push_back(vec::scaled(middle, 1.0 / static_cast<double>(points.size())));
    if (shape.samples.size() < kMostSampledParts) shape.samples.push_back({shape.probes.back()});
    for (const PieceFace& face : piece.faces) {
      for_fan(points, face.loop, [&](const TriangleCorners& t) {
        shape.triangles.push_back(t);
        shape.source_face.push_back(face.source_face);
      });
    }
  }
  shape.shells = shape.triangles;
  shape.extent_m = extent_of(corners);
  return shape;
}

std::optional<StartCollision> start_collision(const StartShape& moving,
                                              const std::vector<StartShape>& fixed) {
  return StartSearch(moving, fixed).run();
}

StartPlaces::StartPlaces(const StartShape& moving, const std::vector<StartShape>& fixed)
    : search_(std::make_unique<StartSearch>(moving, fixed)) {}
StartPlaces::~StartPlaces() = default;

std::optional<StartCollision> StartPlaces::collision(const Point3& by, double touching_m) const {
  return search_->at(by, touching_m);
}

double StartPlaces::distance_m(const Point3& by, double most_m) const {
  return search_->distance_m(by, most_m);
}

std::string collision_place_text(const StartCollision& c, const StartShape& fixed) {
  return (c.inside ? "lies inside " + fixed.mesh + ", or that inside it,"
                   : "meets " + face_of(c.fixed_face) + " of " + fixed.mesh + " with its own " +
                         face_of(c.face)) +
         " near " + place_of(c.place_m);
}

std::string start_collision_text(const StartCollision& c, const StartShape& fixed,
                                 const std::array<double, 3>& position_m) {
  const std::string text = "the start pose " + collision_place_text(c, fixed) + " in W; ";
  if (!c.free_move_m) return text + "the part is pushed out at the first tick, or give another";
  const Point3 free = vec::add(position_m, *c.free_move_m);
  return text + formatted("position_m = [%.9g, %.9g, %.9g] is free, %.3g m away", free[0] + 0.0,
                          free[1] + 0.0, free[2] + 0.0, vec::norm(*c.free_move_m));
}

}  // namespace haptic::tools
