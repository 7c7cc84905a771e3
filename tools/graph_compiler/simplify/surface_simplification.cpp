// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/simplify/surface_simplification.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

[[noreturn]] void refuse_passage(const std::string& file, const NarrowPassage& passage,
                                 double tolerance_m) {
  throw InputError(
      file + ": " +
      formatted("tolerance_m %.9g would close a %s of %.3g m near (%.6g, %.6g, %.6g) m: each side "
                "of it may move by that much; give tolerance_m below %.3g, or leave it out",
                tolerance_m, passage.is_wall ? "wall" : "hole or gap", passage.width_m,
                passage.at[0], passage.at[1], passage.at[2], 0.5 * passage.width_m));
}

/// About a corner of the mesh, so that the distance from the origin costs no digits.
double mesh_volume(const TriangleMesh& mesh, const Point3& apex) {
  double six = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto t = mesh.corners(i);
    six += vec::dot(vec::sub(t[0], apex), vec::cross(vec::sub(t[1], apex), vec::sub(t[2], apex)));
  }
  return six / 6.0;
}

/// The part as it is without a tolerance.
SimplifiedPart kept(const RawMesh& raw, const SurfaceOptions& options, SimplifiedPart tried) {
  tried.part = make_surface_part(raw, options, &tried.found);
  CollapseAccount& account = tried.collapsed;
  account.triangles_after = account.triangles_before;
  account.facets_after = account.facets_before;
  account.given_to_result_m = account.result_to_given_m = account.volume_change_m3 = 0.0;
  return tried;
}

}  // namespace

SimplifiedPart simplified_surface(const RawMesh& raw, const SurfaceOptions& options,
                                  double tolerance_m, const std::function<void(double)>& tell) {
  SimplifiedPart out;
  SurfaceOptions as_triangles = options;
  as_triangles.merge = false;
  as_triangles.count_crossings = false;
  TriangleMesh given = triangle_mesh(make_surface_part(raw, as_triangles, &out.found));
  const SurfaceAccount& read = out.found;
  if (const auto passage =
          narrowest_passage(given, read.tight, read.weld_radius_m, 2.0 * tolerance_m)) {
    refuse_passage(raw.file, *passage, tolerance_m);
  }
  const Point3 apex = given.points[0];
  const double volume = read.tight ? mesh_volume(given, apex) : 0.0;

  SurfaceOptions merged = options;
  merged.count_crossings = false;
  const std::size_t facets_before = make_surface_part(raw, merged).facets.size();

  EdgeCollapse collapse(std::move(given));
  collapse.run(tolerance_m, 0, tell);
  out.collapsed = collapse.account();
  out.collapsed.facets_before = facets_before;
  const TriangleMesh result = collapse.result();
  if (read.tight) out.collapsed.volume_change_m3 = mesh_volume(result, apex) - volume;

  if (!out.collapsed.changed()) return kept(raw, options, std::move(out));
  SurfaceOptions again = options;
  again.scale_to_m = {1.0, 1.0, 1.0};
  again.weld_radius_m = read.weld_radius_m;
  SurfaceAccount account;
  out.part = make_surface_part(raw_mesh(result, raw), again, &account);
  // Ends of open edges that have come within the weld radius of each other are joined as ever.
  out.collapsed.given_to_result_m += account.largest_weld_move_m;
  out.collapsed.result_to_given_m += account.largest_weld_move_m;
  if (!(out.collapsed.hausdorff_m() <= tolerance_m)) {
    const double proved_m = out.collapsed.hausdorff_m();
    throw InputError(
        raw.file + ": the simplified surface is " +
        (std::isfinite(proved_m) ? formatted("proved within %.3g m only", proved_m)
                                 : std::string("not proved within any distance")) +
        formatted(", tolerance_m is %.9g; give another tolerance_m, or leave it out", tolerance_m));
  }
  // Triangles that are no longer in one plane with their neighbours may be more facets than before.
  if (account.facets >= facets_before) return kept(raw, options, std::move(out));
  out.collapsed.facets_after = account.facets;
  account.faces_read = read.faces_read;
  account.triangles_read = read.triangles_read;
  account.welded_vertices += read.welded_vertices;
  account.largest_weld_move_m = std::max(account.largest_weld_move_m, read.largest_weld_move_m);
  account.duplicate_facets += read.duplicate_facets;
  account.degenerate_absorbed += read.degenerate_absorbed;
  account.degenerate_loose += read.degenerate_loose;
  account.flipped += read.flipped;
  out.found = account;
  return out;
}

std::string collapse_text(const CollapseAccount& a) {
  if (!a.changed()) {
    return formatted("simplified within %.3g m: nothing to leave out (%zu facets)", a.limit_m,
                     a.facets_after);
  }
  return formatted(
      "simplified within %.3g m: facets %zu to %zu (triangles %zu to %zu); proved: no point of the "
      "given surface is farther than %.4g m from the result, none of the result farther than %.4g "
      "m from the given one",
      a.limit_m, a.facets_before, a.facets_after, a.triangles_before, a.triangles_after,
      a.given_to_result_m, a.result_to_given_m);
}

}  // namespace haptic::tools
