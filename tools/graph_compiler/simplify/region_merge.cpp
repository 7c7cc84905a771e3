// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/simplify/region_merge.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <queue>

#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/simplify/plane_corner.hpp"
#include "tools/graph_compiler/simplify/surface_regions.hpp"
#include "tools/graph_compiler/simplify/union_cost.hpp"

namespace haptic::tools {
namespace {

class RegionMerger {
 public:
  RegionMerger(const Surface& surface, const FaceNeighbors& neighbors, const PlaneFit& fit,
               double distance_m, const std::vector<double>& allowance_m)
      : s_(surface),
        fit_(fit),
        distance_(distance_m),
        map_(surface, neighbors, fit),
        stamp_(map_.count(), 0),
        position_(surface.vertices),
        judge_(surface, map_, planes_, position_, distance_m, allowance_m) {
    for (const FittedPlane& p : fit.planes) planes_.push_back({p.normal, p.offset_m});
  }

  MergedRegions run();

 private:
  [[nodiscard]] Union judged_now(std::uint32_t a, std::uint32_t b) {
    Union u = judge_.judged(a, b);
    u.stamp_larger = stamp_[u.larger];
    u.stamp_smaller = stamp_[u.smaller];
    return u;
  }
  void unite(const Union& u);
  void place(std::uint32_t v);
  void queue_neighbors(std::uint32_t region);
  void straighten_borders();
  MergedRegions result();
  void set_vertices(MergedRegions& out) const;

  const Surface& s_;
  const PlaneFit& fit_;
  double distance_;
  SurfaceRegions map_;
  std::vector<std::uint32_t> stamp_;  // per region, counts its changes
  std::vector<HessePlane> planes_;
  std::vector<Point3> position_;  // per vertex, with the planes as they are
  UnionJudge judge_;
  std::priority_queue<Union, std::vector<Union>, std::greater<>> queue_;
  std::size_t merges_ = 0;
  std::vector<std::uint32_t> around_, ends_;
};

void RegionMerger::queue_neighbors(std::uint32_t region) {
  for (const std::uint32_t other : map_.region(region).neighbors) {
    const Union u = judged_now(region, other);
    if (u.cost_m <= distance_) queue_.push(u);
  }
}

void RegionMerger::place(std::uint32_t v) {
  around_.clear();
  std::vector<HessePlane> own;
  for (const std::uint32_t f : map_.faces_at(v)) {
    const std::uint32_t p = map_.region(map_.region_at(f)).plane;
    if (std::find(around_.begin(), around_.end(), p) != around_.end()) continue;
    around_.push_back(p);
    own.push_back(planes_[p]);
  }
  const PlaneCorner corner = nearest_corner(own, s_.vertices[v]);
  if (corner.found) position_[v] = corner.point;
}

void RegionMerger::unite(const Union& u) {
  const std::vector<std::uint32_t> moved_by_smaller = map_.region(u.smaller).vertices;
  const std::vector<std::uint32_t> moved_by_larger =
      u.new_plane ? map_.region(u.larger).vertices : std::vector<std::uint32_t>{};
  if (u.new_plane) {
    const HessePlane both = plane_of_both(s_, map_.region(u.larger), map_.region(u.smaller));
    map_.region(u.larger).plane = static_cast<std::uint32_t>(planes_.size());
    planes_.push_back(both);
  }
  map_.unite(u.larger, u.smaller);
  ++stamp_[u.larger];
  ++merges_;
  for (const std::uint32_t v : moved_by_smaller) place(v);
  for (const std::uint32_t v : moved_by_larger) place(v);
  queue_neighbors(u.larger);
}

MergedRegions RegionMerger::run() {
  for (std::uint32_t r = 0; r < map_.count(); ++r) {
    for (const std::uint32_t other : map_.region(r).neighbors) {
      if (other < r) continue;
      const Union u = judged_now(r, other);
      if (u.cost_m <= distance_) queue_.push(u);
    }
  }
  while (!queue_.empty()) {
    const Union u = queue_.top();
    queue_.pop();
    if (!map_.region(u.larger).alive || !map_.region(u.smaller).alive) continue;
    if (u.stamp_larger != stamp_[u.larger] || u.stamp_smaller != stamp_[u.smaller]) continue;
    // The neighbours of the two may have changed: judged again, and back in the queue if more
    // expensive.
    const Union now = judged_now(u.larger, u.smaller);
    if (!(now.cost_m <= distance_)) continue;
    if (now.cost_m > u.cost_m * (1.0 + 1.0e-9) + 1.0e-9 * distance_) {
      queue_.push(now);
      continue;
    }
    unite(now);
  }
  return result();
}

/// Vertices inside a border have no say any more: they are spread along the line between its two
/// corners, so that none lies beyond them.
void RegionMerger::straighten_borders() {
  std::vector<std::uint32_t> chain;
  for (std::uint32_t v = 0; v < s_.vertices.size(); ++v) {
    if (map_.faces_at(v).empty() || !map_.is_corner(v)) continue;
    map_.border_ends(v, ends_);
    for (const std::uint32_t w : ends_) {
      map_.border_chain(v, w, chain);
      if (chain.back() == v || chain.back() < v) continue;  // done from the other end
      double whole = 0.0;
      for (std::size_t k = 1; k < chain.size(); ++k) {
        whole += vec::distance(s_.vertices[chain[k]], s_.vertices[chain[k - 1]]);
      }
      const Point3& from = position_[v];
      const Point3 along = vec::sub(position_[chain.back()], from);
      double length = 0.0;
      for (std::size_t k = 1; k + 1 < chain.size(); ++k) {
        length += vec::distance(s_.vertices[chain[k]], s_.vertices[chain[k - 1]]);
        position_[chain[k]] = vec::add(from, vec::scaled(along, length / whole));
      }
    }
  }
}

/// Each vertex at its place; corners of the same planes that differ by a rounding are one.
void RegionMerger::set_vertices(MergedRegions& out) const {
  std::map<std::vector<std::uint32_t>, std::vector<Point3>> corners;
  for (std::uint32_t v = 0; v < s_.vertices.size(); ++v) {
    std::vector<std::uint32_t> own;
    for (const std::uint32_t f : map_.faces_at(v)) own.push_back(out.fit.face_plane[f]);
    std::sort(own.begin(), own.end());
    own.erase(std::unique(own.begin(), own.end()), own.end());
    Point3 x = position_[v];
    if (own.size() >= 3) {
      std::vector<Point3>& known = corners[own];
      const auto same = std::find_if(known.begin(), known.end(), [&](const Point3& k) {
        return vec::distance(k, x) <= kSamePlace * s_.diagonal_m;
      });
      if (same != known.end()) {
        x = *same;
      } else {
        known.push_back(x);
      }
    }
    out.vertices.push_back(x);
  }
}

void set_residuals(MergedRegions& out) {
  for (FittedPlane& plane : out.fit.planes) {
    std::sort(plane.vertices.begin(), plane.vertices.end());
    plane.vertices.erase(std::unique(plane.vertices.begin(), plane.vertices.end()),
                         plane.vertices.end());
    plane.residual_m = 0.0;
    for (const std::uint32_t v : plane.vertices) {
      const double d = std::abs(vec::dot(plane.normal, out.vertices[v]) - plane.offset_m);
      plane.residual_m = std::max(plane.residual_m, d);
    }
    out.fit.largest_residual_m = std::max(out.fit.largest_residual_m, plane.residual_m);
  }
}

MergedRegions RegionMerger::result() {
  straighten_borders();
  MergedRegions out;
  out.merges = merges_;
  out.fit.face_plane.resize(s_.faces.size());
  out.fit.face_sign.resize(s_.faces.size());
  std::map<std::uint32_t, std::uint32_t> index;  // of planes still used
  std::vector<double> widest;
  for (std::uint32_t r = 0; r < map_.count(); ++r) {
    const Region& region = map_.region(r);
    if (!region.alive) continue;
    const auto [it, fresh] =
        index.emplace(region.plane, static_cast<std::uint32_t>(out.fit.planes.size()));
    if (fresh) {
      FittedPlane plane;
      if (region.plane < fit_.planes.size()) {
        plane = fit_.planes[region.plane];
        plane.vertices.clear();
      } else {
        plane.normal = planes_[region.plane].normal;
        plane.offset_m = planes_[region.plane].offset;
      }
      out.fit.planes.push_back(std::move(plane));
      widest.push_back(-1.0);
    }
    FittedPlane& plane = out.fit.planes[it->second];
    plane.vertices.insert(plane.vertices.end(), region.vertices.begin(), region.vertices.end());
    const int sign = vec::dot(plane.normal, region.area) < 0.0 ? -1 : 1;
    for (const std::uint32_t f : region.faces) {
      out.fit.face_plane[f] = it->second;
      out.fit.face_sign[f] = sign;
      const double size = vec::norm(vec::twice_area(s_.vertices, s_.faces[f].vertices));
      if (size > widest[it->second]) widest[it->second] = size, plane.widest_face = f;
    }
  }
  set_vertices(out);
  set_residuals(out);
  return out;
}

}  // namespace

MergedRegions merge_regions(const Surface& surface, const FaceNeighbors& neighbors,
                            const PlaneFit& fit, double distance_m,
                            const std::vector<double>& allowance_m) {
  return RegionMerger(surface, neighbors, fit, distance_m, allowance_m).run();
}

}  // namespace haptic::tools
