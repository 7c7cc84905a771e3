// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/reproduction/solid_union.hpp"

#include <utility>

namespace haptic::sim {
namespace {

constexpr double kOnPlane_m = 1e-9;

/// The parts of a convex polygon in front of and behind a plane n.x = d.
std::pair<std::vector<Vector>, std::vector<Vector>> split(const std::vector<Vector>& polygon,
                                                          const Vector& n, double d) {
  std::pair<std::vector<Vector>, std::vector<Vector>> parts;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vector &from = polygon[k], &to = polygon[(k + 1) % polygon.size()];
    const double side = n.dot(from) - d, next = n.dot(to) - d;
    if (side > -kOnPlane_m) parts.first.push_back(from);
    if (side < kOnPlane_m) parts.second.push_back(from);
    if ((side > kOnPlane_m && next < -kOnPlane_m) || (side < -kOnPlane_m && next > kOnPlane_m)) {
      const Vector cut = from + side / (side - next) * (to - from);
      parts.first.push_back(cut);
      parts.second.push_back(cut);
    }
  }
  return parts;
}

bool beyond(const std::vector<Vector>& polygon, const Vector& n, double d, double sign) {
  for (const Vector& p : polygon) {
    if (sign * (n.dot(p) - d) > kOnPlane_m) return true;
  }
  return false;
}

/// Fragments of `facet` outside the convex body of `other`.
std::vector<Facet> outside(const Facet& facet, const std::vector<Facet>& other) {
  std::vector<Facet> fragments;
  Facet rest = facet;
  for (const Facet& wall : other) {
    const double d = wall.normal.dot(wall.polygon.front());
    if (!beyond(rest.polygon, wall.normal, d, -1)) return {facet};  // all in front: nothing hidden
  }
  for (const Facet& wall : other) {
    const double d = wall.normal.dot(wall.polygon.front());
    if (!beyond(rest.polygon, wall.normal, d, 1)) continue;
    auto [front, behind] = split(rest.polygon, wall.normal, d);
    fragments.push_back({std::move(front), facet.normal, facet.lit});
    rest.polygon = std::move(behind);
  }
  return fragments;
}

}  // namespace

void cut_to_union(std::span<PaintedBody> bodies) {
  std::vector<std::vector<Facet>> whole;
  for (const PaintedBody& body : bodies) whole.push_back(body.facets);
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    for (std::size_t other = 0; other < bodies.size(); ++other) {
      if (other == k) continue;
      std::vector<Facet> kept;
      for (const Facet& facet : bodies[k].facets) {
        for (Facet& fragment : outside(facet, whole[other])) kept.push_back(std::move(fragment));
      }
      bodies[k].facets = std::move(kept);
    }
  }
}

}  // namespace haptic::sim
