// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/mesh/cleaning.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/mesh/face_repair.hpp"
#include "tools/graph_compiler/mesh/nesting.hpp"
#include "tools/graph_compiler/mesh/shells.hpp"
#include "tools/graph_compiler/mesh/stitch.hpp"
#include "tools/graph_compiler/mesh/thin_walls.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/mesh/weld.hpp"
#include "tools/graph_compiler/mesh/work_mesh.hpp"

namespace haptic::tools {
namespace {

/// Refuses a size that no other treatment of the mesh would cure.
[[noreturn]] void refuse_size(const WorkMesh& mesh, const std::string& defect,
                              const std::string& fix) {
  throw SizeError(mesh.file + ": " + defect + "; " + fix);
}

constexpr double kToleranceOfDiagonal = 5.0e-6;
constexpr double kCoarsestPrint = 2.0e-4;     // of the diagonal
constexpr double kLargestTolerance = 1.0e-2;  // of the diagonal
/// Share of the last printed place: a corner that was rounded lies farther off its plane, except by
/// chance.
constexpr double kExactOfPrint = 1.0e-2;

void check_scale(const WorkMesh& mesh, const std::array<double, 3>& scale) {
  for (const double s : scale) {
    if (!std::isfinite(s) || s <= 0.0) {
      refuse_size(mesh,
                  formatted("the scale (%g, %g, %g) is not three positive numbers", scale[0],
                            scale[1], scale[2]),
                  "give metres per unit of the file; mirror parts in the CAD program");
    }
  }
}

/// Vertices that faces use, scaled; the others as they are, never looked at.
vec::Box scale_points(const WorkMesh& mesh, const std::array<double, 3>& scale,
                      std::vector<Point3>& points) {
  vec::Box box;
  points = mesh.raw->vertices;
  for (Point3& p : points) {
    for (std::size_t i = 0; i < 3; ++i) {
      p[i] *= scale[i];
    }
  }
  for (const RawFace& face : mesh.raw->faces) {
    for (const std::uint32_t v : face.vertices) {
      if (v >= points.size()) {
        refuse_size(
            mesh,
            "a face uses vertex " + std::to_string(v) + " of " + std::to_string(points.size()),
            "correct the index");
      }
      for (const double x : points[v]) {
        if (!std::isfinite(x)) {
          refuse_size(mesh, "vertex " + std::to_string(v + 1) + " is not finite after scaling",
                      "check the unit of the export");
        }
      }
      box.include(points[v]);
    }
  }
  return box;
}

void check_diagonal(const WorkMesh& mesh) {
  if (mesh.diagonal_m >= kSmallestDiagonal_m && mesh.diagonal_m <= kLargestDiagonal_m) {
    return;
  }
  const bool small = mesh.diagonal_m < kSmallestDiagonal_m;
  refuse_size(mesh,
              "the part is " + length_text(mesh.diagonal_m) + " across, " +
                  (small ? "smallest " : "largest ") +
                  length_text(small ? kSmallestDiagonal_m : kLargestDiagonal_m),
              "check the scale: metres per unit of the file");
}

/// Middle of the box, rounded to a power of two near the diagonal; zero where the part is near the
/// origin anyway. So the subtraction is exact for coordinates of the size of the part and for parts
/// far away.
Point3 coarse_centre(const vec::Box& box, double diagonal) {
  Point3 centre{0, 0, 0};
  const double grid = std::ldexp(1.0, std::ilogb(diagonal) - 1);
  for (std::size_t i = 0; i < 3; ++i) {
    const double middle = 0.5 * box.low[i] + 0.5 * box.high[i];
    if (std::abs(middle) > diagonal) {
      centre[i] = std::round(middle / grid) * grid;
    }
  }
  return centre;
}

/// "10.0" is as whole as "10": a design, not a rounding.
bool has_whole_numbers(const RawMesh& raw) {
  return std::ranges::all_of(raw.vertices, [](const Point3& v) {
    return std::ranges::all_of(v, [](double x) { return x == std::round(x); });
  });
}

void choose_tolerance(WorkMesh& mesh, const CleaningOptions& options, const vec::Box& box) {
  if (options.plane_tolerance_m) {
    const double tolerance = *options.plane_tolerance_m;
    const double largest = kLargestTolerance * mesh.diagonal_m;
    if (!std::isfinite(tolerance) || tolerance <= 0.0 || tolerance > largest) {
      refuse_size(
          mesh, "the plane tolerance " + length_text(tolerance) + " is out of range",
          "give a positive length up to " + length_text(largest) + " (a hundredth of the part)");
    }
    mesh.tolerance_m = tolerance;
    return;
  }
  double largest = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    largest = std::max({largest, std::abs(box.low[i]), std::abs(box.high[i])});
  }
  const double resolution = coordinate_resolution(*mesh.raw, options.scale_to_m, largest);
  mesh.tolerance_m = plane_tolerance(mesh.diagonal_m, resolution);
  const double of_size = kToleranceOfDiagonal * mesh.diagonal_m;
  if (mesh.tolerance_m > of_size) mesh.printed = PrintedPlanes{kExactOfPrint * resolution, of_size};
  const bool coarse = resolution > kCoarsestPrint * mesh.diagonal_m;
  if (coarse && !has_whole_numbers(*mesh.raw)) mesh.taken_as_exact_m = resolution;
}

/// A shell without thickness survived the removal of faces; its planes would all fall into one.
void refuse_flat_shells(const WorkMesh& mesh, const std::vector<WorkShell>& shells) {
  for (const WorkShell& shell : shells) {
    double area = 0.0;
    for (const std::uint32_t f : shell.faces) {
      area += 0.5 * vec::norm(vec::twice_area(mesh.points, mesh.faces[f].loop));
    }
    if (std::abs(shell.volume) <= 0.5 * mesh.tolerance_m * area) {
      refuse_mesh(mesh,
                  "thinner than the plane tolerance " + length_text(mesh.tolerance_m) + " at " +
                      place_text(mesh, mesh.points[mesh.faces[shell.faces[0]].loop[0]]),
                  "give --plane-tolerance below a tenth of the thickness; flat sheets are no "
                  "solids");
    }
  }
}

void drop_unused_points(WorkMesh& mesh) {
  constexpr std::uint32_t kUnused = 0xFFFFFFFFU;
  std::vector<std::uint32_t> renumbered(mesh.points.size(), kUnused);
  for (const WorkFace& face : mesh.faces) {
    for (const std::uint32_t v : face.loop) {
      renumbered[v] = 0;
    }
  }
  std::uint32_t used = 0;
  for (std::size_t v = 0; v < renumbered.size(); ++v) {
    if (renumbered[v] != kUnused) {
      mesh.points[used] = mesh.points[v];
      mesh.source_vertex[used] = mesh.source_vertex[v];
      renumbered[v] = used++;
    }
  }
  mesh.points.resize(used);
  mesh.source_vertex.resize(used);
  for (WorkFace& face : mesh.faces) {
    for (std::uint32_t& v : face.loop) {
      v = renumbered[v];
    }
  }
}

Surface to_surface(WorkMesh& mesh, std::vector<Shell> shells, std::size_t solid_count) {
  Surface surface;
  surface.file = mesh.file;
  surface.centre_m = mesh.centre_m;
  surface.diagonal_m = mesh.diagonal_m;
  surface.plane_tolerance_m = mesh.tolerance_m;
  surface.printed = mesh.printed;
  surface.taken_as_exact_m = mesh.taken_as_exact_m;
  surface.vertices = std::move(mesh.points);
  surface.source_vertex = std::move(mesh.source_vertex);
  surface.faces.resize(mesh.faces.size());
  for (std::uint32_t s = 0; s < shells.size(); ++s) {
    for (const std::uint32_t f : shells[s].faces) {
      surface.faces[f] = {std::move(mesh.faces[f].loop), s, mesh.faces[f].source_face};
    }
  }
  surface.shells = std::move(shells);
  surface.solid_count = solid_count;
  surface.steps = std::move(mesh.steps);
  surface.warnings = std::move(mesh.warnings);
  surface.close_faces = std::move(mesh.close_faces);
  return surface;
}

}  // namespace

std::string length_text(double length_m) { return formatted("%.3g m", length_m); }

std::string place_text(const WorkMesh& mesh, const Point3& local) {
  const Point3 p = vec::add(local, mesh.centre_m);
  return formatted("(%.9g, %.9g, %.9g) m", p[0] + 0.0, p[1] + 0.0, p[2] + 0.0);
}

std::string face_text(const WorkMesh& mesh, std::uint32_t source_face) {
  const std::size_t place = mesh.raw->faces[source_face].source_place;
  const std::string text = "face " + std::to_string(source_face + 1);
  if (place == 0) return text;
  return text + (mesh.raw->places_are_lines ? " (line " : " (byte ") + std::to_string(place) + ")";
}

void refuse_mesh(const WorkMesh& mesh, const std::string& defect, const std::string& fix) {
  throw InputError(mesh.file + ": " + defect + "; " + fix);
}

double coordinate_resolution(const RawMesh& raw, const std::array<double, 3>& scale_to_m,
                             double largest_coordinate_m) {
  if (!raw.places_are_lines) return largest_coordinate_m * 0x1p-23;
  return raw.print_resolution * std::max({scale_to_m[0], scale_to_m[1], scale_to_m[2]});
}

double plane_tolerance(double diagonal_m, double resolution_m) {
  const double print = resolution_m > kCoarsestPrint * diagonal_m ? 0.0 : resolution_m;
  return std::max(kToleranceOfDiagonal * diagonal_m, kTolerancesOfPrint * print);
}

Surface clean_surface(const RawMesh& raw, const CleaningOptions& options) {
  WorkMesh mesh;
  mesh.file = raw.file;
  mesh.raw = &raw;
  if (raw.faces.empty()) {
    refuse_mesh(mesh, "the mesh has no face", "export the part again");
  }
  check_scale(mesh, options.scale_to_m);
  std::vector<Point3> points;
  const vec::Box box = scale_points(mesh, options.scale_to_m, points);
  mesh.diagonal_m = box.diagonal();
  check_diagonal(mesh);
  choose_tolerance(mesh, options, box);

  CleaningStep recentre{"recentre", 0, 0.0};
  mesh.centre_m = coarse_centre(box, mesh.diagonal_m);
  for (Point3& p : points) {
    const Point3 local = vec::sub(p, mesh.centre_m);
    const double rounded = vec::distance(vec::add(local, mesh.centre_m), p);
    recentre.count += rounded > 0.0 ? 1U : 0U;
    recentre.largest_move_m = std::max(recentre.largest_move_m, rounded);
    p = local;
  }
  mesh.steps.push_back(recentre);

  weld_parts(mesh, points);
  split_touching_loops(mesh);
  refuse_crossing_loops(mesh);
  drop_degenerate_faces(mesh);
  drop_duplicate_faces(mesh);
  if (mesh.faces.empty()) {
    refuse_mesh(mesh,
                "thinner than the plane tolerance " + length_text(mesh.tolerance_m) + " at " +
                    place_text(mesh, points[raw.faces[0].vertices[0]]) + ": no face is left",
                "give a smaller --plane-tolerance; flat sheets are no solids");
  }
  stitch_t_junctions(mesh);
  refuse_open_edges(mesh);

  std::vector<std::uint8_t> flipped;
  std::vector<WorkShell> work_shells = build_shells(mesh, flipped);
  refuse_flat_shells(mesh, work_shells);
  std::size_t solid_count = 0;
  std::vector<Shell> shells = nest_shells(mesh, work_shells, flipped, solid_count);
  const auto turned = std::count(flipped.begin(), flipped.end(), std::uint8_t{1});
  mesh.steps.push_back({"turned faces", static_cast<std::size_t>(turned), 0.0});

  drop_unused_points(mesh);
  std::vector<std::uint32_t> shell_of_face(mesh.faces.size(), 0);
  for (std::uint32_t s = 0; s < shells.size(); ++s) {
    for (const std::uint32_t f : shells[s].faces) {
      shell_of_face[f] = s;
    }
  }
  check_thin_walls(mesh, shell_of_face);
  return to_surface(mesh, std::move(shells), solid_count);
}

}  // namespace haptic::tools
