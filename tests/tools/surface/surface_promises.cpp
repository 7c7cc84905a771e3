// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/surface/surface_promises.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "tests/support/random.hpp"
#include "tools/graph_compiler/mesh/shell_interior.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools::test {
namespace {

using Triangle = ShellInterior::Triangle;

constexpr double kRounding = 4.0e-12;  // of the part's size

bool is_unit(const Point3& x) { return std::abs(vec::norm(x) - 1.0) <= 1.0e-12; }

std::string facet_promise(const SurfacePart& part, std::size_t f, double size_m) {
  const SurfacePart::Facet& facet = part.facets[f];
  const std::size_t n = facet.loop.size();
  if (n < 3) return "a facet has fewer than three corners";
  if (!is_unit(facet.normal)) return "a normal is not unit";
  if (std::set<std::uint32_t>(facet.loop.begin(), facet.loop.end()).size() != n) {
    return "a loop repeats a vertex";
  }
  for (std::size_t k = 0; k < n; ++k) {
    if (facet.loop[k] >= part.vertices_m.size()) return "a loop names no vertex";
  }
  double turned = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    const Point3& a = part.vertices_m[facet.loop[k]];
    const Point3& b = part.vertices_m[facet.loop[(k + 1) % n]];
    const Point3& c = part.vertices_m[facet.loop[(k + 2) % n]];
    if (std::abs(vec::dot(facet.normal, vec::sub(b, a))) > kRounding * size_m) {
      return "a facet is not flat";
    }
    const Point3 in = vec::unit(vec::cross(facet.normal, vec::sub(b, a)));
    for (const std::uint32_t v : facet.loop) {
      if (vec::dot(in, vec::sub(part.vertices_m[v], a)) < -kRounding * size_m) {
        return "a facet is not convex";
      }
    }
    const Point3 u = vec::unit(vec::sub(b, a)), w = vec::unit(vec::sub(c, b));
    turned += std::atan2(vec::dot(facet.normal, vec::cross(u, w)), vec::dot(u, w));
  }
  return std::abs(turned - 6.283185307179586) < 1.0e-6 ? "" : "a loop does not wind once";
}

std::string edge_promise(const SurfacePart& part) {
  std::vector<std::vector<int>> senses(part.edges.size());
  if (part.side_begin.size() != part.facets.size() + 1) return "side_begin has a wrong size";
  for (std::size_t f = 0; f < part.facets.size(); ++f) {
    const SurfacePart::Facet& facet = part.facets[f];
    const std::size_t n = facet.loop.size();
    if (part.side_begin[f + 1] - part.side_begin[f] != n) return "side_begin does not fit";
    for (std::size_t k = 0; k < n; ++k) {
      const std::uint32_t a = facet.loop[k], b = facet.loop[(k + 1) % n];
      const std::uint32_t e = part.edge_of[part.side_begin[f] + k];
      if (part.edges[e] != std::array<std::uint32_t, 2>{std::min(a, b), std::max(a, b)}) {
        return "edge_of names another edge";
      }
      senses[e].push_back(a < b ? 1 : -1);
      const Point3 along = vec::sub(part.vertices_m[b], part.vertices_m[a]);
      const Point3 in = vec::unit(vec::cross(facet.normal, along));
      bool listed = false;
      for (std::uint32_t i = part.inward_begin[e]; i < part.inward_begin[e + 1]; ++i) {
        listed = listed || vec::distance(part.inward[i], in) < 1.0e-9;
      }
      if (!listed) return "an edge lacks the inward direction of a facet";
      for (const std::uint32_t v : {a, b}) {
        const Point3 out = vec::unit(vec::scaled(along, v == a ? 1.0 : -1.0));
        listed = false;
        for (std::uint32_t i = part.ring_begin[v]; i < part.ring_begin[v + 1]; ++i) {
          listed = listed || vec::distance(part.ring[i], out) < 1.0e-9;
        }
        if (!listed) return "a ring lacks the direction of an edge";
      }
    }
  }
  bool closed = true;
  for (const std::vector<int>& sense : senses) {
    if (sense.empty()) return "an edge has no facet";
    closed = closed && sense.size() == 2 && sense[0] + sense[1] == 0;
  }
  return closed == part.closed ? "" : "closed is not what the edges say";
}

double distance_to(const Point3& p, const std::vector<Triangle>& triangles) {
  double nearest = HUGE_VAL;
  for (const Triangle& t : triangles) nearest = std::min(nearest, triangle_distance(p, t));
  return nearest;
}

double farthest(const std::vector<Triangle>& from, const std::vector<Triangle>& to,
                haptic::test::Random& random) {
  double worst = 0.0;
  for (const Triangle& t : from) {
    for (int i = 0; i < 8; ++i) {
      std::array<double, 3> weight{0, 0, 0};
      if (i < 3) {
        weight[static_cast<std::size_t>(i)] = 1.0;
      } else if (i < 6) {
        weight[static_cast<std::size_t>(i - 3)] = weight[static_cast<std::size_t>((i - 2) % 3)] =
            0.5;
      } else {
        const double u = random.uniform(0, 1), v = random.uniform(0, 1 - u);
        weight = {u, v, 1 - u - v};
      }
      Point3 p{0, 0, 0};
      for (std::size_t k = 0; k < 3; ++k) p = vec::add(p, vec::scaled(t[k], weight[k]));
      worst = std::max(worst, distance_to(p, to));
    }
  }
  return worst;
}

}  // namespace

std::string broken_promise(const SurfacePart& part, double size_m) {
  if (part.facets.empty()) return "no facet";
  if (part.source_face.size() != part.facets.size()) return "source_face has a wrong size";
  if (part.ring_begin.size() != part.vertices_m.size() + 1) return "ring_begin has a wrong size";
  if (part.inward_begin.size() != part.edges.size() + 1) return "inward_begin has a wrong size";
  if (std::set<Point3>(part.vertices_m.begin(), part.vertices_m.end()).size() !=
      part.vertices_m.size()) {
    return "two vertices are equal";
  }
  for (const std::vector<Point3>* list : {&part.ring, &part.inward}) {
    if (!std::all_of(list->begin(), list->end(), is_unit)) return "a direction is not unit";
  }
  std::vector<bool> used(part.vertices_m.size(), false);
  for (std::size_t f = 0; f < part.facets.size(); ++f) {
    const std::string broken = facet_promise(part, f, size_m);
    if (!broken.empty()) return broken;
    for (const std::uint32_t v : part.facets[f].loop) used[v] = true;
  }
  if (std::find(used.begin(), used.end(), false) != used.end()) return "a vertex is in no facet";
  return edge_promise(part);
}

double set_distance(const SurfacePart& part, const RawMesh& raw, double scale_to_m,
                    std::uint64_t seed) {
  std::vector<Triangle> of_file, of_part;
  for (const RawFace& face : raw.faces) {
    const auto at = [&](std::size_t k) {
      return vec::scaled(raw.vertices[face.vertices[k]], scale_to_m);
    };
    for (std::size_t k = 1; k + 1 < face.vertices.size(); ++k) {
      of_file.push_back({at(0), at(k), at(k + 1)});
    }
  }
  for (const SurfacePart::Facet& facet : part.facets) {
    const auto at = [&](std::size_t k) { return part.vertices_m[facet.loop[k]]; };
    for (std::size_t k = 1; k + 1 < facet.loop.size(); ++k)
      of_part.push_back({at(0), at(k), at(k + 1)});
  }
  haptic::test::Random random(seed);
  return std::max(farthest(of_file, of_part, random), farthest(of_part, of_file, random));
}

}  // namespace haptic::tools::test
