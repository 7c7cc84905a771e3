// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/simplify/surface_regions.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

/// Area and vertices of the faces.
void measure(const Surface& surface, Region& region) {
  for (const std::uint32_t f : region.faces) {
    const Point3 twice = vec::twice_area(surface.vertices, surface.faces[f].vertices);
    region.area = vec::add(region.area, vec::scaled(twice, 0.5));
    region.size += 0.5 * vec::norm(twice);
    const std::vector<std::uint32_t>& loop = surface.faces[f].vertices;
    region.vertices.insert(region.vertices.end(), loop.begin(), loop.end());
  }
  std::sort(region.vertices.begin(), region.vertices.end());
  region.vertices.erase(std::unique(region.vertices.begin(), region.vertices.end()),
                        region.vertices.end());
}

}  // namespace

SurfaceRegions::SurfaceRegions(const Surface& surface, const FaceNeighbors& neighbors,
                               const PlaneFit& fit)
    : s_(surface), neighbors_(neighbors) {
  face_region_.assign(s_.faces.size(), kNone);
  vertex_faces_.resize(s_.vertices.size());
  for (std::uint32_t f = 0; f < s_.faces.size(); ++f) {
    for (const std::uint32_t v : s_.faces[f].vertices) vertex_faces_[v].push_back(f);
  }
  for (std::uint32_t seed = 0; seed < s_.faces.size(); ++seed) {
    if (face_region_[seed] != kNone) continue;
    const auto id = static_cast<std::uint32_t>(regions_.size());
    Region region;
    region.plane = fit.face_plane[seed];
    region.faces.push_back(seed);
    face_region_[seed] = id;
    for (std::size_t k = 0; k < region.faces.size(); ++k) {
      const std::uint32_t f = region.faces[k];
      for (std::size_t e = 0; e < s_.faces[f].vertices.size(); ++e) {
        const std::uint32_t g = neighbors_.across(f, e);
        if (face_region_[g] != kNone || fit.face_plane[g] != region.plane ||
            fit.face_sign[g] != fit.face_sign[seed]) {
          continue;
        }
        face_region_[g] = id;
        region.faces.push_back(g);
      }
    }
    measure(surface, region);
    regions_.push_back(std::move(region));
  }
  for (std::uint32_t f = 0; f < s_.faces.size(); ++f) {
    for (std::size_t e = 0; e < s_.faces[f].vertices.size(); ++e) {
      const std::uint32_t other = face_region_[neighbors_.across(f, e)];
      if (other != face_region_[f]) regions_[face_region_[f]].neighbors.insert(other);
    }
  }
}

void SurfaceRegions::unite(std::uint32_t larger_id, std::uint32_t smaller_id) {
  Region& larger = regions_[larger_id];
  Region& smaller = regions_[smaller_id];
  for (const std::uint32_t f : smaller.faces) face_region_[f] = larger_id;
  larger.faces.insert(larger.faces.end(), smaller.faces.begin(), smaller.faces.end());
  std::vector<std::uint32_t> all;
  std::set_union(larger.vertices.begin(), larger.vertices.end(), smaller.vertices.begin(),
                 smaller.vertices.end(), std::back_inserter(all));
  larger.vertices = std::move(all);
  for (const std::uint32_t other : smaller.neighbors) {
    regions_[other].neighbors.erase(smaller_id);
    if (other == larger_id) continue;
    regions_[other].neighbors.insert(larger_id);
    larger.neighbors.insert(other);
  }
  larger.area = vec::add(larger.area, smaller.area);
  larger.size += smaller.size;
  smaller = Region{};
  smaller.alive = false;
}

void SurfaceRegions::border_ends(std::uint32_t v, std::vector<std::uint32_t>& ends) const {
  ends.clear();
  for (const std::uint32_t f : vertex_faces_[v]) {
    const std::vector<std::uint32_t>& loop = s_.faces[f].vertices;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      // Each edge runs away from v in one of its two faces.
      if (loop[k] == v && pretended(f) != pretended(neighbors_.across(f, k))) {
        ends.push_back(loop[(k + 1) % loop.size()]);
      }
    }
  }
}

bool SurfaceRegions::is_corner(std::uint32_t v) const {
  std::uint32_t first = kNone, second = kNone;
  for (const std::uint32_t f : vertex_faces_[v]) {
    const std::uint32_t r = pretended(f);
    if (first == kNone || r == first) {
      first = r;
    } else if (second == kNone || r == second) {
      second = r;
    } else {
      return true;
    }
  }
  return false;
}

void SurfaceRegions::border_chain(std::uint32_t from, std::uint32_t to,
                                  std::vector<std::uint32_t>& chain) const {
  chain.assign({from, to});
  std::vector<std::uint32_t> ends;
  while (chain.size() <= s_.vertices.size() && chain.back() != from && !is_corner(chain.back())) {
    border_ends(chain.back(), ends);
    if (ends.size() != 2) break;
    const std::uint32_t before = chain[chain.size() - 2];
    chain.push_back(ends[ends[0] == before ? 1 : 0]);
  }
}

}  // namespace haptic::tools
