// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/mesh/thin_walls.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "tools/graph_compiler/mesh/box_tree.hpp"

namespace haptic::tools {
namespace {

constexpr double kOpposite = -0.8;  // cosine between the normals of the two sides of a wall
constexpr double kWideInTolerances = 20.0;
constexpr double kTouchInTolerances = 0.05;  // nearer than this: they touch, nothing lies between
constexpr std::size_t kMostComparisons = 20'000'000;
constexpr std::size_t kMostCloseFaces = 100'000;

struct FacePlane {
  Point3 normal{0, 0, 0};
  bool wide = false;
};

/// True if the point, projected along the largest component of the normal, is in the polygon or
/// within `margin`.
bool over_polygon(const std::vector<Point3>& points, const std::vector<std::uint32_t>& loop,
                  const Point3& normal, const Point3& p, double margin) {
  std::size_t axis = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (std::abs(normal[i]) > std::abs(normal[axis])) {
      axis = i;
    }
  }
  const std::size_t u = (axis + 1) % 3;
  const std::size_t v = (axis + 2) % 3;
  bool inside = false;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Point3& a = points[loop[i]];
    const Point3& b = points[loop[i + 1 == loop.size() ? 0 : i + 1]];
    if ((a[v] > p[v]) != (b[v] > p[v]) &&
        p[u] < a[u] + (b[u] - a[u]) * (p[v] - a[v]) / (b[v] - a[v])) {
      inside = !inside;
    }
    const double du = b[u] - a[u];
    const double dv = b[v] - a[v];
    const double square = du * du + dv * dv;
    const double t = square > 0.0
                         ? std::clamp(((p[u] - a[u]) * du + (p[v] - a[v]) * dv) / square, 0.0, 1.0)
                         : 0.0;
    if (std::hypot(p[u] - a[u] - t * du, p[v] - a[v] - t * dv) <= margin) {
      return true;
    }
  }
  return inside;
}

class ThinWallSearch {
 public:
  ThinWallSearch(WorkMesh& mesh, const std::vector<std::uint32_t>& shell_of_face)
      : mesh_(mesh),
        shell_of_face_(shell_of_face),
        planes_(mesh.faces.size()),
        faces_of_point_(mesh.points.size()),
        reach_(kThinnestWallInTolerances * mesh.tolerance_m),
        tree_(prepare()) {}

  void run() {
    std::size_t comparisons = 0;
    std::vector<std::uint32_t> near;
    for (std::uint32_t v = 0; v < mesh_.points.size() && comparisons <= kMostComparisons; ++v) {
      vec::Box box;
      box.include(mesh_.points[v]);
      tree_.find(box.grown(reach_), near);
      for (const std::uint32_t f : near) {
        comparisons += mesh_.faces[f].loop.size();
        compare(v, f);
      }
    }
    if (comparisons > kMostComparisons) {
      mesh_.warnings.push_back("the search for thin walls stopped at its limit of comparisons");
    }
    if (gaps_ > 0) {
      mesh_.warnings.push_back("gap of only " + length_text(narrowest_gap_) + " at " +
                               place_text(mesh_, gap_place_));
    }
  }

 private:
  std::vector<vec::Box> prepare() {
    std::vector<vec::Box> boxes(mesh_.faces.size());
    for (std::uint32_t f = 0; f < mesh_.faces.size(); ++f) {
      const std::vector<std::uint32_t>& loop = mesh_.faces[f].loop;
      const Point3 area = vec::twice_area(mesh_.points, loop);
      const double extent = vec::extent(mesh_.points, loop);
      planes_[f].normal = vec::unit(area);
      planes_[f].wide = vec::norm(area) > kWideInTolerances * mesh_.tolerance_m * extent;
      for (const std::uint32_t v : loop) {
        boxes[f].include(mesh_.points[v]);
        faces_of_point_[v].push_back(f);
      }
    }
    return boxes;
  }

  void compare(std::uint32_t v, std::uint32_t f) {
    const WorkFace& face = mesh_.faces[f];
    const FacePlane& plane = planes_[f];
    const Point3& p = mesh_.points[v];
    if (!plane.wide || faces_of_point_[v].empty() ||
        std::find(face.loop.begin(), face.loop.end(), v) != face.loop.end()) {
      return;
    }
    const double height = vec::dot(plane.normal, vec::sub(p, mesh_.points[face.loop[0]]));
    if (std::abs(height) > reach_ || std::abs(height) < kTouchInTolerances * mesh_.tolerance_m) {
      return;
    }
    const bool same_shell = shell_of_face_[faces_of_point_[v][0]] == shell_of_face_[f];
    bool opposite = false;
    std::optional<std::uint32_t> parallel;
    for (const std::uint32_t own : faces_of_point_[v]) {
      const double cosine = vec::dot(planes_[own].normal, plane.normal);
      opposite = opposite || (planes_[own].wide && cosine < kOpposite);
      if (planes_[own].wide && std::abs(cosine) > 1.0 - 1.0e-6) parallel = own;
    }
    if (!(same_shell ? opposite : parallel.has_value()) ||
        !over_polygon(mesh_.points, face.loop, plane.normal, p, mesh_.tolerance_m)) {
      return;
    }
    if (!same_shell) {
      note_close(v, *parallel, f, std::abs(height));
    } else if (height < 0.0) {
      refuse_mesh(mesh_,
                  "thinner than the plane tolerance " + length_text(mesh_.tolerance_m) +
                      " allows at " + place_text(mesh_, p) + ": a wall of " + length_text(-height) +
                      " at " + face_text(mesh_, face.source_face) + ", least " +
                      length_text(reach_),
                  "give --plane-tolerance below a tenth of the thickness; flat sheets are no "
                  "solids");
    } else if (gaps_++ == 0 || height < narrowest_gap_) {
      narrowest_gap_ = height;
      gap_place_ = p;
    }
  }

  void note_close(std::uint32_t v, std::uint32_t own, std::uint32_t f, double distance) {
    if (mesh_.close_faces.size() >= kMostCloseFaces) return;
    mesh_.close_faces.push_back({shell_of_face_[own], shell_of_face_[f],
                                 mesh_.faces[own].source_face, mesh_.faces[f].source_face, distance,
                                 mesh_.points[v]});
  }

  WorkMesh& mesh_;
  const std::vector<std::uint32_t>& shell_of_face_;
  std::vector<FacePlane> planes_;
  std::vector<std::vector<std::uint32_t>> faces_of_point_;
  double reach_;
  BoxTree tree_;
  std::size_t gaps_ = 0;
  double narrowest_gap_ = 0.0;
  Point3 gap_place_{0, 0, 0};
};

}  // namespace

void check_thin_walls(WorkMesh& mesh, const std::vector<std::uint32_t>& shell_of_face) {
  ThinWallSearch(mesh, shell_of_face).run();
}

}  // namespace haptic::tools
