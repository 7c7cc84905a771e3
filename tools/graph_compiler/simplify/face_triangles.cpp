// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/simplify/face_triangles.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/common/error.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/polyhedron/chain.hpp"
#include "tools/graph_compiler/simplify/face_view.hpp"

namespace haptic::tools {
namespace {

// Relative difference between the area of a face and the sum of its triangles.
constexpr double kAreaRounding = 1.0e-9;

struct Corner : ViewPoint {
  std::uint32_t point = 0;
};

using Polygon = std::vector<Corner>;

bool same_place(const Corner& a, const Corner& b) { return a.x == b.x && a.y == b.y; }

double twice_area(const Polygon& polygon) {
  double sum = 0.0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    sum += turn(polygon[0], polygon[i], polygon[i + 1]);
  }
  return sum;
}

/// True if the ray from polygon[at] to `target` starts inside: tells apart the two copies of a
/// corner where a hole has been joined.
bool starts_inside(const Polygon& polygon, std::size_t at, const Corner& target) {
  const std::size_t n = polygon.size();
  const Corner& before = polygon[(at + n - 1) % n];
  const Corner& here = polygon[at];
  const Corner& after = polygon[(at + 1) % n];
  const bool left_of_in = turn(before, here, target) > 0.0;
  const bool left_of_out = turn(here, after, target) > 0.0;
  return turn(before, here, after) > 0.0 ? left_of_in && left_of_out : left_of_in || left_of_out;
}

/// The polygons of one face while holes are joined to them and ears are cut off.
class FaceCutter {
 public:
  FaceCutter(const std::vector<std::vector<Point3>>& loops, const Point3& normal) {
    const FaceView view(normal);
    for (const std::vector<Point3>& loop : loops) {
      Polygon polygon;
      for (const Point3& p : loop) {
        polygon.push_back({view.of(p), static_cast<std::uint32_t>(points_.size())});
        points_.push_back(p);
      }
      if (polygon.size() < 3) continue;
      const double area = twice_area(polygon);
      area_ += area;
      (area > 0.0 ? outer_ : holes_).push_back(std::move(polygon));
    }
  }

  bool run(std::vector<FaceTriangle>& out) {
    const std::size_t before = out.size();
    double sum = 0.0;
    bool good = join_holes();
    for (std::size_t k = 0; k < outer_.size() && good; ++k) good = clip(outer_[k], sum, out);
    good = good && area_ > 0.0 && std::abs(sum - area_) <= kAreaRounding * area_;
    if (!good) out.resize(before);
    return good;
  }

 private:
  bool join_holes();
  bool join(const Polygon& hole);
  bool is_free(const Corner& a, const Corner& b, const Polygon& hole) const;
  bool clip(Polygon& polygon, double& sum, std::vector<FaceTriangle>& out) const;

  std::vector<Point3> points_;
  std::vector<Polygon> outer_, holes_;
  double area_ = 0.0;
};

bool FaceCutter::is_free(const Corner& a, const Corner& b, const Polygon& hole) const {
  const auto meets = [&](const Polygon& polygon) {
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      if (segments_cross(a, b, polygon[i], polygon[(i + 1) % polygon.size()])) return true;
    }
    return false;
  };
  return !meets(hole) && std::none_of(outer_.begin(), outer_.end(), meets) &&
         std::none_of(holes_.begin(), holes_.end(), meets);
}

/// Joins a hole to the nearest corner of an outer polygon that it sees.
bool FaceCutter::join(const Polygon& hole) {
  struct Bridge {
    double square;
    std::size_t h, k, p;
  };
  std::vector<Bridge> bridges;
  for (std::size_t h = 0; h < hole.size(); ++h) {
    for (std::size_t k = 0; k < outer_.size(); ++k) {
      for (std::size_t p = 0; p < outer_[k].size(); ++p) {
        const double dx = outer_[k][p].x - hole[h].x, dy = outer_[k][p].y - hole[h].y;
        bridges.push_back({dx * dx + dy * dy, h, k, p});
      }
    }
  }
  std::stable_sort(bridges.begin(), bridges.end(),
                   [](const Bridge& a, const Bridge& b) { return a.square < b.square; });
  for (const Bridge& bridge : bridges) {
    Polygon& polygon = outer_[bridge.k];
    if (bridge.square > 0.0 && (!starts_inside(polygon, bridge.p, hole[bridge.h]) ||
                                !starts_inside(hole, bridge.h, polygon[bridge.p]) ||
                                !is_free(hole[bridge.h], polygon[bridge.p], hole))) {
      continue;
    }
    Polygon joined(polygon.begin(), polygon.begin() + static_cast<std::ptrdiff_t>(bridge.p) + 1);
    for (std::size_t i = 0; i <= hole.size(); ++i) {
      joined.push_back(hole[(bridge.h + i) % hole.size()]);
    }
    joined.insert(joined.end(), polygon.begin() + static_cast<std::ptrdiff_t>(bridge.p),
                  polygon.end());
    polygon = std::move(joined);
    return true;
  }
  return false;
}

bool FaceCutter::join_holes() {
  while (!holes_.empty()) {
    bool joined = false;
    for (std::size_t k = 0; k < holes_.size() && !joined; ++k) {
      const Polygon hole = holes_[k];
      joined = join(hole);
      if (joined) holes_.erase(holes_.begin() + static_cast<std::ptrdiff_t>(k));
    }
    if (!joined) return false;
  }
  return true;
}

bool FaceCutter::clip(Polygon& polygon, double& sum, std::vector<FaceTriangle>& out) const {
  const auto is_ear = [&](std::size_t i) {
    const std::size_t n = polygon.size();
    const Corner& a = polygon[(i + n - 1) % n];
    const Corner& b = polygon[i];
    const Corner& c = polygon[(i + 1) % n];
    if (!(turn(a, b, c) > 0.0)) return false;
    for (const Corner& p : polygon) {
      if (same_place(p, a) || same_place(p, b) || same_place(p, c)) continue;
      if (turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0) return false;
    }
    return true;
  };
  std::size_t next = 0;
  while (polygon.size() >= 3) {
    const std::size_t n = polygon.size();
    std::size_t ear = n;
    bool flat = false;
    for (std::size_t k = 0; k < n && ear == n; ++k) {
      const std::size_t i = (next + k) % n;
      // Corners inside an edge, and both ends of a bridge, enclose nothing.
      flat = turn(polygon[(i + n - 1) % n], polygon[i], polygon[(i + 1) % n]) == 0.0;
      if (flat || is_ear(i)) ear = i;
    }
    if (ear == n) return false;
    const Corner& a = polygon[(ear + n - 1) % n];
    const Corner& b = polygon[ear];
    const Corner& c = polygon[(ear + 1) % n];
    if (!flat) {
      sum += turn(a, b, c);
      out.push_back({points_[a.point], points_[b.point], points_[c.point]});
    }
    polygon.erase(polygon.begin() + static_cast<std::ptrdiff_t>(ear));
    next = ear % (n - 1);
  }
  return true;
}

}  // namespace

bool triangulate_face(const std::vector<std::vector<Point3>>& loops, const Point3& normal,
                      std::vector<FaceTriangle>& out) {
  return FaceCutter(loops, normal).run(out);
}

std::vector<FaceTriangle> triangles_of(const Surface& surface) {
  std::vector<FaceTriangle> out;
  for (const SurfaceFace& face : surface.faces) {
    std::vector<Point3> loop;
    for (const std::uint32_t v : face.vertices) loop.push_back(surface.vertices[v]);
    const Point3 normal = vec::twice_area(surface.vertices, face.vertices);
    if (loop.size() > 3 && triangulate_face({loop}, normal, out)) continue;
    for (std::size_t i = 1; i + 1 < loop.size(); ++i) {
      out.push_back({loop[0], loop[i], loop[i + 1]});
    }
  }
  return out;
}

std::vector<FaceTriangle> triangles_of(FlatBody& body, const std::string& file) {
  ExactWorld& world = body.world;
  std::vector<FaceTriangle> out;
  for (const FlatSolid& flat : body.solids) {
    for (const ExactFace& face : flat.solid.faces) {
      std::vector<std::vector<Point3>> loops;
      try {
        for (const Loop& loop : trace_loops(world, face)) {
          std::vector<Point3> points;
          for (const std::uint32_t v : loop) {
            points.push_back(vec::scaled(world.vertices[v].x_approx, 1.0 / world.scale));
          }
          loops.push_back(std::move(points));
        }
      } catch (const BrokenChain&) {
        loops.clear();
      }
      const Point3 normal = vec::scaled(world.planes[face.plane].unit_normal, face.sign);
      if (triangulate_face(loops, normal, out)) continue;
      throw InputError(file + ": the border of the face at face " +
                       std::to_string(face.source_face + 1) +
                       " of the file crosses itself; give a smaller --simplify distance");
    }
  }
  return out;
}

}  // namespace haptic::tools
