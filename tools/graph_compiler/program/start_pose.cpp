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

namespace haptic::tools {
namespace {

/// Of the diagonal: points nearer to a shell are on it, neither inside nor outside.
constexpr double kOnShell = 1.0e-9;
/// Of the diagonal: how well the bisection finds the end of the collision.
constexpr double kMoveShare = 1.0e-4;

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

TriangleCorners shifted(const TriangleCorners& t, const Point3& by) {
  return {vec::add(t[0], by), vec::add(t[1], by), vec::add(t[2], by)};
}

/// One static part, ready for questions at many places of the moving one.
struct Obstacle {
  explicit Obstacle(const StartShape& fixed)
      : shape(&fixed),
        tree(boxes_of(fixed.triangles)),
        box(box_of(fixed.triangles)),
        interior(fixed.shells, kOnShell * box.diagonal()) {}
  const StartShape* shape;
  BoxTree tree;
  vec::Box box;
  ShellInterior interior;
};

class StartSearch {
 public:
  StartSearch(const StartShape& moving, const std::vector<StartShape>& fixed)
      : moving_(moving),
        box_(box_of(moving.triangles)),
        interior_(moving.shells, kOnShell * box_.diagonal()) {
    for (const StartShape& shape : fixed) obstacles_.emplace_back(shape);
  }

  std::optional<StartCollision> run() {
    std::optional<StartCollision> found;
    for (const bool of_surfaces : {true, false}) {
      for (std::size_t i = 0; i < obstacles_.size() && !found; ++i) {
        if (has_surface(obstacles_[i]) == of_surfaces) found = collision({0, 0, 0}, i);
      }
    }
    if (found && has_surface(obstacles_[found->fixed])) found->free_move_m = shortest_free_move();
    return found;
  }

 private:
  [[nodiscard]] bool has_surface(const Obstacle& o) const {
    return moving_.is_surface || o.shape->is_surface;
  }

  [[nodiscard]] std::optional<StartCollision> collision(const Point3& by, std::size_t index) const;
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
  ShellInterior interior_;
  std::vector<Obstacle> obstacles_;
};

/// With the moving part shifted by `by`.
std::optional<StartCollision> StartSearch::collision(const Point3& by, std::size_t index) const {
  const Obstacle& o = obstacles_[index];
  vec::Box all = box_;
  all.low = vec::add(all.low, by);
  all.high = vec::add(all.high, by);
  if (!all.meets(o.box)) return std::nullopt;
  const bool touching_counts = has_surface(o);
  std::vector<std::uint32_t> near;
  for (std::size_t i = 0; i < moving_.triangles.size(); ++i) {
    const TriangleCorners t = shifted(moving_.triangles[i], by);
    vec::Box box;
    for (const Point3& p : t) box.include(p);
    if (!box.meets(o.box)) continue;
    o.tree.find(box, near);
    for (const std::uint32_t k : near) {
      const TriangleCorners& other = o.shape->triangles[k];
      if (!(touching_counts ? triangles_meet(t, other) : triangles_cross(t, other))) continue;
      vec::Box theirs;
      for (const Point3& p : other) theirs.include(p);
      StartCollision found;
      found.fixed = index;
      found.face = moving_.source_face[i];
      found.fixed_face = o.shape->source_face[k];
      for (std::size_t c = 0; c < 3; ++c) {
        found.place_m[c] =
            0.5 * (std::max(box.low[c], theirs.low[c]) + std::min(box.high[c], theirs.high[c]));
      }
      return found;
    }
  }
  const auto inside = [&](const Point3& place) {
    StartCollision found;
    found.fixed = index;
    found.inside = true;
    found.place_m = place;
    return found;
  };
  for (const Point3& p : moving_.probes) {
    const Point3 at = vec::add(p, by);
    if (o.interior.place_of(at) == PointPlace::kInside) return inside(at);
  }
  for (const Point3& p : o.shape->probes) {
    if (interior_.place_of(vec::sub(p, by)) == PointPlace::kInside) return inside(p);
  }
  return std::nullopt;
}

/// A distance along `direction` after which the box of the moving part is beyond all others.
double StartSearch::clear_distance(const Point3& direction) const {
  vec::Box others;
  for (const Obstacle& o : obstacles_) {
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
  for (const Obstacle& o : obstacles_) {
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
      if (encloses[f] != 0) shape.shells.push_back(t);
    });
  }
  for (std::uint32_t v = 0; v < points.size(); ++v) {
    if (sets.root_of(v) == v) shape.probes.push_back(points[v]);
  }
  return shape;
}

StartShape start_shape(const Body& body, const std::array<double, 3>& origin_m,
                       const StartPose& pose) {
  StartShape shape;
  for (const ConvexPiece& piece : body.pieces) {
    std::vector<Point3> points;
    Point3 middle{0, 0, 0};
    for (const Point3& v : piece.vertices) {
      points.push_back(placed(pose, vec::add(v, origin_m)));
      middle = vec::add(middle, points.back());
    }
    shape.probes.push_back(vec::scaled(middle, 1.0 / static_cast<double>(points.size())));
    for (const PieceFace& face : piece.faces) {
      for_fan(points, face.loop, [&](const TriangleCorners& t) {
        shape.triangles.push_back(t);
        shape.source_face.push_back(face.source_face);
      });
    }
  }
  shape.shells = shape.triangles;
  return shape;
}

std::optional<StartCollision> start_collision(const StartShape& moving,
                                              const std::vector<StartShape>& fixed) {
  return StartSearch(moving, fixed).run();
}

std::string start_collision_text(const StartCollision& c, const StartShape& fixed,
                                 const std::array<double, 3>& position_m) {
  const std::string what = c.inside ? "lies inside " + fixed.mesh + ", or that inside it,"
                                    : "meets " + face_of(c.fixed_face) + " of " + fixed.mesh +
                                          " with its own " + face_of(c.face);
  const std::string text = "the start pose " + what + " near " + place_of(c.place_m) + " in W; ";
  if (!c.free_move_m) return text + "the part is pushed out at the first tick, or give another";
  const Point3 free = vec::add(position_m, *c.free_move_m);
  return text + formatted("position_m = [%.9g, %.9g, %.9g] is free, %.3g m away", free[0] + 0.0,
                          free[1] + 0.0, free[2] + 0.0, vec::norm(*c.free_move_m));
}

}  // namespace haptic::tools
