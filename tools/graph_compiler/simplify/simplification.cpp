// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/simplify/simplification.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>
#include <vector>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/polyhedron/flatten.hpp"
#include "tools/graph_compiler/polyhedron/flatten_merge.hpp"
#include "tools/graph_compiler/simplify/corner_split.hpp"
#include "tools/graph_compiler/simplify/face_view.hpp"
#include "tools/graph_compiler/simplify/region_merge.hpp"

namespace haptic::tools {
namespace {

// Where faces of a surface with moved vertices no longer have a proper border.

/// A side of a face as seen along its normal; `u`, `v`: its ends in the caller's numbering.
struct Border {
  ViewPoint a, b;
  double low = 0.0, high = 0.0;
  std::uint32_t u = 0, v = 0;
};

Border border_of(const FaceView& view, const Point3& a, const Point3& b, std::uint32_t u,
                 std::uint32_t v) {
  const ViewPoint p = view.of(a), q = view.of(b);
  return {p, q, std::min(p.x, q.x), std::max(p.x, q.x), u, v};
}

/// Appends the ends of sides that cross another side.
void add_crossed(std::vector<Border>& borders, std::vector<std::uint32_t>& out) {
  std::stable_sort(borders.begin(), borders.end(),
                   [](const Border& p, const Border& q) { return p.low < q.low; });
  for (std::size_t i = 0; i < borders.size(); ++i) {
    const Border& p = borders[i];
    for (std::size_t k = i + 1; k < borders.size() && borders[k].low <= p.high; ++k) {
      const Border& q = borders[k];
      if (segments_cross(p.a, p.b, q.a, q.b)) out.insert(out.end(), {p.u, p.v, q.u, q.v});
    }
  }
}

void sort_once(std::vector<std::uint32_t>& ids) {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

/// Ends of edges of `merged` that run against their direction before the move, or that cross
/// another edge of the same face; ascending. A guess in double that spares attempts: the
/// certificate of the pieces decides.
/// @param before, after  the same faces; vertices before and after the move
/// Cost: quadratic in the edges of a face, sorted along one axis.
std::vector<std::uint32_t> crossing_vertices(const Surface& before, const Surface& after,
                                             const PlaneFit& fit, const MergedSurface& merged) {
  std::vector<std::uint32_t> out;
  std::vector<std::vector<const MergedEdge*>> of_face(merged.faces.size());
  for (const MergedEdge& e : merged.edges) {
    const Point3 now = vec::sub(after.vertices[e.v], after.vertices[e.u]);
    if (vec::norm(now) == 0.0) continue;
    const Point3 old = vec::sub(before.vertices[e.v], before.vertices[e.u]);
    if (vec::norm(old) > 0.0 && !(vec::dot(old, now) > 0.0)) out.insert(out.end(), {e.u, e.v});
    of_face[e.left].push_back(&e);
    of_face[e.right].push_back(&e);
  }
  for (std::size_t f = 0; f < merged.faces.size(); ++f) {
    const MergedFace& face = merged.faces[f];
    const FaceView view(vec::scaled(fit.planes[face.plane].normal, face.sign));
    std::vector<Border> borders;
    for (const MergedEdge* e : of_face[f]) {
      borders.push_back(border_of(view, after.vertices[e->u], after.vertices[e->v], e->u, e->v));
    }
    add_crossed(borders, out);
  }
  sort_once(out);
  return out;
}

/// Corners of a body, local frame [m], at whose edges faces cross themselves although the guess
/// above found none: corners move onto their exact planes. In double, as above.
std::vector<Point3> crossing_places(const FlatBody& body) {
  const ExactWorld& world = body.world;
  std::vector<std::uint32_t> bad;
  for (const FlatSolid& flat : body.solids) {
    for (const ExactFace& face : flat.solid.faces) {
      const FaceView view(vec::scaled(world.planes[face.plane].unit_normal, face.sign));
      std::vector<Border> borders;
      for (const auto& [u, v] : face.edges) {
        borders.push_back(
            border_of(view, world.vertices[u].x_approx, world.vertices[v].x_approx, u, v));
      }
      add_crossed(borders, bad);
    }
  }
  sort_once(bad);
  std::vector<Point3> out;
  for (const std::uint32_t v : bad) {
    out.push_back(vec::scaled(world.vertices[v].x_approx, 1.0 / world.scale));
  }
  return out;
}

// Rounds of merging, each with less allowed where edges of the round before crossed.
constexpr int kMaxRounds = 30;
constexpr double kTighter = 0.25;
constexpr double kSplitMove = 2.0;    // of the distance: how far corners taken apart may lie
constexpr double kSettleMove = 0.25;  // of the distance: movement onto the exact planes
// While steps are tried, distances are bounded to this part of the limit; the one that is reported
// to this part of itself, or of the plane tolerance, below which the surface itself is not known.
constexpr double kDistanceGrain = 1.0e-3;
constexpr double kAnywhere = -1.0;  // no point of a surface is this near to another

double volume_of(const std::vector<FaceTriangle>& triangles, const Point3& apex) {
  double six = 0.0;
  for (const FaceTriangle& t : triangles) {
    six += vec::dot(vec::sub(t[0], apex), vec::cross(vec::sub(t[1], apex), vec::sub(t[2], apex)));
  }
  return six / 6.0;
}

/// Reduces the allowance at and next to vertices whose edges run backwards or cross an edge of the
/// same face after the merging. Returns false where there are none.
bool tighten(const Surface& surface, const std::vector<std::uint32_t>& bad,
             std::vector<double>& allowance_m) {
  std::vector<bool> hit(surface.vertices.size(), false);
  for (const std::uint32_t v : bad) hit[v] = true;
  std::vector<bool> near = hit;
  for (const SurfaceFace& face : surface.faces) {
    if (!std::any_of(face.vertices.begin(), face.vertices.end(),
                     [&](std::uint32_t v) { return hit[v]; })) {
      continue;
    }
    for (const std::uint32_t v : face.vertices) near[v] = true;
  }
  for (std::size_t v = 0; v < near.size(); ++v) {
    if (near[v]) allowance_m[v] *= kTighter;
  }
  return !bad.empty();
}

/// Corners whose planes miss them: neither three planes nor taken apart.
void add_loose_corners(const Surface& changed, const PlaneFit& fit, const MergedSurface& merged,
                       std::vector<std::uint32_t>& bad) {
  for (const MergedEdge& e : merged.edges) {
    for (const std::uint32_t v : {e.u, e.v}) {
      for (const std::uint32_t p : merged.vertex_planes[v]) {
        const FittedPlane& plane = fit.planes[p];
        const double miss = std::abs(vec::dot(plane.normal, changed.vertices[v]) - plane.offset_m);
        if (miss > changed.plane_tolerance_m) bad.push_back(v);
      }
    }
  }
}

/// A corner that was taken apart is no vertex of the file any more.
void forget_split_corners(ExactWorld& world) {
  std::map<std::int64_t, std::size_t> corners;
  for (const std::int64_t source : world.source_vertex) ++corners[source];
  for (std::int64_t& source : world.source_vertex) {
    if (corners[source] > 1) source = -1;
  }
}

/// Corners of the triangle of the original that is nearest to a point of the result.
void add_nearest(const Surface& surface, const SurfaceMeasure& original, const Point3& p,
                 double unless_within_m, std::vector<std::uint32_t>& bad) {
  std::uint32_t nearest = 0;
  if (original.distance(p, &nearest) <= unless_within_m) return;
  const FaceTriangle& there = original.triangles()[nearest];
  for (std::uint32_t v = 0; v < surface.vertices.size(); ++v) {
    if (std::find(there.begin(), there.end(), surface.vertices[v]) != there.end()) {
      bad.push_back(v);
    }
  }
}

/// Vertices of either surface that are farther than allowed from the other one; for those of the
/// result, the corners of the faces of the original that they are nearest to.
std::vector<std::uint32_t> far_vertices(const Surface& surface, const SurfaceMeasure& original,
                                        const std::vector<FaceTriangle>& result,
                                        double distance_m) {
  std::vector<std::uint32_t> bad;
  const SurfaceMeasure to_result(result, distance_m);
  for (std::uint32_t v = 0; v < surface.vertices.size(); ++v) {
    if (to_result.distance(surface.vertices[v]) > distance_m) bad.push_back(v);
  }
  for (const FaceTriangle& t : result) {
    for (const Point3& p : t) add_nearest(surface, original, p, distance_m, bad);
  }
  return bad;
}

[[noreturn]] void refuse_reflex(const Surface& surface, const SimplifyAccount& account,
                                std::size_t limit, std::size_t planes) {
  throw ReflexLimitError(
      surface.file + ": " + std::to_string(account.reflex_after) + " reflex edges are left of " +
          std::to_string(account.reflex_before) + " by --simplify " +
          formatted("%.9g", account.limit_m) + ", limit " + std::to_string(limit) +
          ": give a larger distance, or raise --max-reflex (time grows about with its square)",
      account.reflex_after, planes);
}

/// One round: regions merged, corners taken apart, and the vertices where that went wrong.
struct Attempt {
  Surface surface;  ///< moved vertices, and those of corners taken apart
  PlaneFit fit;
  MergedSurface merged;
  std::size_t merges = 0;
  std::vector<std::uint32_t> bad;
};

Attempt merge_and_split(const Surface& surface, const FaceNeighbors& neighbors, const PlaneFit& fit,
                        const SimplifyOptions& options, const std::vector<double>& allowance_m) {
  Attempt out;
  MergedRegions regions =
      merge_regions(surface, neighbors, fit, options.distance_m * options.share, allowance_m);
  out.merges = regions.merges;
  out.fit = std::move(regions.fit);
  out.surface = surface;
  out.surface.vertices = std::move(regions.vertices);
  out.merged = merge_faces(out.surface, neighbors, out.fit);
  const std::vector<std::uint32_t> parents = split_corners(
      out.surface, out.fit, out.merged, surface.plane_tolerance_m, kSplitMove * options.distance_m);
  Surface before = surface;
  for (const std::uint32_t v : parents) before.vertices.push_back(surface.vertices[v]);
  out.bad = crossing_vertices(before, out.surface, out.fit, out.merged);
  add_loose_corners(out.surface, out.fit, out.merged, out.bad);
  for (std::uint32_t& v : out.bad) {
    if (v >= surface.vertices.size()) v = parents[v - surface.vertices.size()];
  }
  return out;
}

/// Rounds of merging, each with less allowed where the one before went wrong: vertices first, then
/// the exact body, then the distance.
class Simplifier {
 public:
  Simplifier(const Surface& surface, const SimplifyOptions& options, const FlattenLimits& limits)
      : surface_(surface),
        options_(options),
        limits_(limits),
        neighbors_(surface),
        fit_(fit_planes(surface, neighbors_)),
        original_(triangles_of(surface)),
        to_original_(original_, options.distance_m),
        allowance_m_(surface.vertices.size(), options.distance_m * options.share) {
    SimplifyAccount& account = out_.account;
    account.limit_m = options.distance_m;
    account.share = options.share;
    account.planes_before = fit_.planes.size();
    account.reflex_before = count_reflex(surface, fit_, merge_faces(surface, neighbors_, fit_));
  }

  Simplified run() {
    for (int round = 0; !done(round + 1 == kMaxRounds); ++round) {
    }
    narrow_distance();
    SimplifyAccount& account = out_.account;
    account.hausdorff_m = distance_.at_most_m;
    account.hausdorff_at_least_m = distance_.at_least_m;
    const Point3 apex = surface_.vertices[surface_.faces[0].vertices[0]];
    account.volume_before_m3 = volume_of(original_, apex);
    account.volume_after_m3 = volume_of(result_, apex);
    if (!(distance_.at_most_m <= options_.distance_m)) refuse_distance();
    return std::move(out_);
  }

 private:
  /// One round. False: the allowances were tightened, another round may do better.
  bool done(bool last) {
    Attempt attempt = merge_and_split(surface_, neighbors_, fit_, options_, allowance_m_);
    SimplifyAccount& account = out_.account;
    account.changed = attempt.merges > 0;
    account.planes_after = attempt.fit.planes.size();
    account.reflex_after = count_reflex(attempt.surface, attempt.fit, attempt.merged);
    // Less allowed leaves more of them.
    if (account.reflex_after > limits_.max_reflex_edges) {
      refuse_reflex(surface_, account, limits_.max_reflex_edges,
                    planes_through_reflex(attempt.surface, attempt.fit, attempt.merged));
    }
    if (tighten(surface_, attempt.bad, allowance_m_) && !last) return false;
    out_.body = account.changed ? flatten(attempt.surface, std::move(attempt.fit),
                                          std::move(attempt.merged), wider_moves())
                                : flatten(surface_, limits_);
    if (account.changed) forget_split_corners(out_.body.world);
    last = last || !account.changed;
    std::vector<std::uint32_t> bad;
    for (const Point3& p : crossing_places(out_.body)) {
      add_nearest(surface_, to_original_, p, kAnywhere, bad);
    }
    if (!last && tighten(surface_, bad, allowance_m_)) return false;
    result_ = triangles_of(out_.body, surface_.file);
    bad = far_vertices(surface_, to_original_, result_, options_.distance_m);
    if (!last && tighten(surface_, bad, allowance_m_)) return false;
    DistanceLimits precision;
    precision.absolute_m = kDistanceGrain * options_.distance_m;
    distance_ = hausdorff_distance(original_, result_, precision);
    if (last || distance_.at_most_m <= options_.distance_m) return true;
    add_nearest(surface_, to_original_, distance_.farthest, kAnywhere, bad);
    return !tighten(surface_, bad, allowance_m_);
  }

  void narrow_distance() {
    DistanceLimits precision;
    precision.relative = kDistanceGrain;
    precision.absolute_m = kDistanceGrain * surface_.plane_tolerance_m;
    if (distance_.at_most_m - distance_.at_least_m <=
        std::max(precision.relative * distance_.at_most_m, precision.absolute_m)) {
      return;
    }
    const SurfaceDistance narrow = hausdorff_distance(original_, result_, precision);
    distance_.at_most_m = std::min(distance_.at_most_m, narrow.at_most_m);
    if (narrow.at_least_m > distance_.at_least_m) {
      distance_.at_least_m = narrow.at_least_m;
      distance_.farthest = narrow.farthest;
    }
  }

  /// Corners of nearly dependent planes have room to settle; the distance is measured afterwards.
  [[nodiscard]] FlattenLimits wider_moves() const {
    FlattenLimits moves = limits_;
    moves.max_move_m = std::max(kSettleMove * options_.distance_m * options_.share,
                                kMoveTolerances * surface_.plane_tolerance_m);
    return moves;
  }

  [[noreturn]] void refuse_distance() const {
    throw InputError(surface_.file + ": --simplify " + formatted("%.9g", options_.distance_m) +
                     ": the simplified surface is " +
                     formatted("%.3g to %.3g m", distance_.at_least_m, distance_.at_most_m) +
                     " from the original near " + place_text(surface_, distance_.farthest) +
                     "; give another distance");
  }

  const Surface& surface_;
  const SimplifyOptions& options_;
  const FlattenLimits& limits_;
  FaceNeighbors neighbors_;
  PlaneFit fit_;
  std::vector<FaceTriangle> original_, result_;
  SurfaceMeasure to_original_;
  std::vector<double> allowance_m_;  // per vertex
  SurfaceDistance distance_;
  Simplified out_;
};

}  // namespace

Simplified simplify(const Surface& surface, const SimplifyOptions& options,
                    const FlattenLimits& limits) {
  if (surface.faces.empty()) throw InputError(surface.file + ": no faces; give a closed mesh");
  return Simplifier(surface, options, limits).run();
}

std::string simplify_text(const SimplifyAccount& a) {
  if (!a.changed) {
    return formatted("simplified within %.3g m: nothing to remove (planes %zu, reflex edges %zu)",
                     a.limit_m, a.planes_after, a.reflex_after);
  }
  return formatted(
      "simplified within %.3g m: planes %zu to %zu, reflex edges %zu to %zu, Hausdorff distance of "
      "the surfaces %.6g m (proved, at least %.6g), volume %+.3g %% (%.6g to %.6g m3)",
      a.limit_m, a.planes_before, a.planes_after, a.reflex_before, a.reflex_after, a.hausdorff_m,
      a.hausdorff_at_least_m, 100.0 * (a.volume_after_m3 / a.volume_before_m3 - 1.0),
      a.volume_before_m3, a.volume_after_m3);
}

}  // namespace haptic::tools
