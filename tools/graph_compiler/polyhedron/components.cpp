// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/components.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "tools/graph_compiler/polyhedron/measure.hpp"

namespace haptic::tools {

namespace {

class UnionFind {
 public:
  explicit UnionFind(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }
  std::size_t find(std::size_t i) {
    while (parent_[i] != i) {
      parent_[i] = parent_[parent_[i]];
      i = parent_[i];
    }
    return i;
  }
  // The smaller index stays the root: classes come out in the order of their first member.
  void join(std::size_t a, std::size_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::size_t> parent_;
};

struct FaceLoop {
  std::size_t face;
  Loop vertices;
};

struct HalfEdge {
  std::uint32_t low, high;
  std::size_t loop;
  bool forward;
};

Chain chain_of(const Loop& loop) {
  Chain chain;
  chain.reserve(loop.size());
  for (std::size_t i = 0; i < loop.size(); ++i) {
    chain.emplace_back(loop[i], loop[(i + 1) % loop.size()]);
  }
  return chain;
}

Rational3 midpoint(const ExactWorld& world, const ChainEdge& e) {
  Rational3 m;
  for (std::size_t i = 0; i < 3; ++i) {
    m[i] = (world.vertices[e.first].x[i] + world.vertices[e.second].x[i]) / 2;
  }
  return m;
}

// Is the hole inside the outer loop? Points of the hole are tried until one is not on the loop
// itself.
bool hole_inside(const ExactWorld& world, const ExactFace& face, const Loop& hole,
                 const Chain& outer) {
  for (const std::uint32_t v : hole) {
    const int where = locate_in_chain(world, face, outer, world.vertices[v].x);
    if (where != 0) return where > 0;
  }
  for (const ChainEdge& e : chain_of(hole)) {
    const int where = locate_in_chain(world, face, outer, midpoint(world, e));
    if (where != 0) return where > 0;
  }
  return false;
}

Rational loop_area_weight(const ExactWorld& world, const ExactFace& face, const Loop& loop) {
  Rational3 area{0, 0, 0};
  for (const ChainEdge& e : chain_of(loop)) {
    const Rational3 c = cross(world.vertices[e.first].x, world.vertices[e.second].x);
    for (std::size_t i = 0; i < 3; ++i) area[i] += c[i];
  }
  return dot(area, world.planes[face.plane].n) * face.sign;
}

// Loops first..last belong to one face: joins each hole to the smallest outer loop around it.
void join_holes(ExactWorld& world, const ExactFace& face, const std::vector<FaceLoop>& loops,
                std::size_t first, std::size_t last, UnionFind& classes) {
  if (last - first < 2) return;
  std::vector<std::size_t> outer;
  std::vector<std::size_t> holes;
  for (std::size_t i = first; i < last; ++i) {
    (is_outer(world, face, loops[i].vertices) ? outer : holes).push_back(i);
  }
  for (const std::size_t hole : holes) {
    std::size_t best = last;
    Rational best_area = 0;
    for (const std::size_t candidate : outer) {
      world.charge(20.0 * static_cast<double>(loops[candidate].vertices.size()));
      const Chain chain = chain_of(loops[candidate].vertices);
      if (outer.size() > 1 && !hole_inside(world, face, loops[hole].vertices, chain)) continue;
      const Rational area = loop_area_weight(world, face, loops[candidate].vertices);
      if (best == last || area < best_area) {
        best = candidate;
        best_area = area;
      }
    }
    if (best == last) throw BrokenChain("a hole lies in no face");
    classes.join(hole, best);
  }
}

// Joins loops across edges. With `manifold_only`, not across edges that more than two loops share:
// parts that touch along an edge come apart.
void join_edges(const std::vector<HalfEdge>& edges, bool manifold_only, UnionFind& classes) {
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i;
    while (end < edges.size() && edges[end].low == edges[i].low &&
           edges[end].high == edges[i].high) {
      ++end;
    }
    if (!manifold_only || end - i == 2) {
      for (std::size_t k = i + 1; k < end; ++k) classes.join(edges[i].loop, edges[k].loop);
    }
    i = end;
  }
}

std::vector<Solid> collect(const Solid& boundary, const std::vector<FaceLoop>& loops,
                           UnionFind& classes) {
  std::vector<std::size_t> index(loops.size(), loops.size());
  std::vector<Solid> parts;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const std::size_t root = classes.find(i);
    if (index[root] == loops.size()) {
      index[root] = parts.size();
      parts.emplace_back();
    }
    Solid& part = parts[index[root]];
    const ExactFace& face = boundary.faces[loops[i].face];
    const Chain chain = chain_of(loops[i].vertices);
    if (part.faces.empty() || part.faces.back().plane != face.plane ||
        part.faces.back().sign != face.sign) {
      part.faces.push_back({face.plane, face.sign, {}, -1});
    }
    Chain& edges = part.faces.back().edges;
    edges.insert(edges.end(), chain.begin(), chain.end());
  }
  for (Solid& part : parts) normalise(part);
  return parts;
}

// Where `point` lies: +1 inside the solid, 0 undecided for this direction (a face edge or the
// surface met), -1 outside.
int locate_along(const ExactWorld& world, const Solid& solid, const Rational3& point,
                 const Rational3& direction) {
  int winding = 0;
  for (const ExactFace& face : solid.faces) {
    const ExactPlane& plane = world.planes[face.plane];
    const Rational slope = dot(plane.n, direction);
    const Rational height = plane.d - dot(plane.n, point);
    if (slope == 0) {
      if (height == 0) return 0;
      continue;
    }
    const Rational t = height / slope;
    if (t < 0) continue;
    Rational3 hit;
    for (std::size_t i = 0; i < 3; ++i) hit[i] = point[i] + t * direction[i];
    const int where = locate_in_chain(world, face, face.edges, hit);
    if (where == 0 || (where > 0 && t == 0)) return 0;
    if (where > 0) winding += (slope > 0) == (face.sign > 0) ? 1 : -1;
  }
  return winding != 0 ? 1 : -1;
}

bool shell_inside(ExactWorld& world, const Solid& shell, const Solid& around) {
  // A few directions without any relation to the axes; one of them misses all edges.
  static constexpr std::array<std::array<int, 3>, 4> kDirections{
      {{9973, 6131, 3571}, {-4211, 9901, 5023}, {2339, -7919, 8887}, {-8431, -3257, 7001}}};
  for (const ExactFace& face : shell.faces) {
    for (const ChainEdge& e : face.edges) {
      for (const std::array<int, 3>& d : kDirections) {
        world.charge(100.0 * static_cast<double>(around.faces.size()));
        const Rational3 direction{Rational(d[0]), Rational(d[1]), Rational(d[2])};
        for (const Rational3& point : {world.vertices[e.first].x, midpoint(world, e)}) {
          const int where = locate_along(world, around, point, direction);
          if (where != 0) return where > 0;
        }
      }
    }
  }
  return false;
}

void give_voids_to_solids(ExactWorld& world, std::vector<Solid>& parts) {
  if (parts.size() < 2) return;
  std::vector<Solid> solids;
  std::vector<Solid> voids;
  for (Solid& part : parts) {
    (volume_sign(world, part) > 0 ? solids : voids).push_back(std::move(part));
  }
  std::vector<Rational> volumes;
  if (!voids.empty()) {
    for (const Solid& solid : solids) volumes.push_back(volume(world, solid));
  }
  std::vector<std::size_t> owner;
  for (const Solid& inner : voids) {
    std::size_t best = solids.size();
    for (std::size_t i = 0; i < solids.size(); ++i) {
      if (best != solids.size() && volumes[i] >= volumes[best]) continue;
      if (solids.size() == 1 || shell_inside(world, inner, solids[i])) best = i;
    }
    if (best == solids.size()) throw BrokenChain("an inner shell lies outside every solid");
    owner.push_back(best);
  }
  for (std::size_t i = 0; i < voids.size(); ++i) {
    Solid& solid = solids[owner[i]];
    for (ExactFace& face : voids[i].faces) solid.faces.push_back(std::move(face));
  }
  for (const std::size_t i : owner) normalise(solids[i]);
  parts = std::move(solids);
}

}  // namespace

bool is_closed(const Solid& solid) {
  Chain all;
  for (const ExactFace& face : solid.faces) {
    all.insert(all.end(), face.edges.begin(), face.edges.end());
  }
  cancel(all);
  return all.empty();
}

std::vector<Solid> components(ExactWorld& world, const Solid& boundary) {
  std::vector<FaceLoop> loops;
  std::vector<std::size_t> first_loop;
  for (std::size_t f = 0; f < boundary.faces.size(); ++f) {
    first_loop.push_back(loops.size());
    for (Loop& loop : trace_loops(world, boundary.faces[f])) loops.push_back({f, std::move(loop)});
  }
  first_loop.push_back(loops.size());
  std::vector<HalfEdge> edges;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    for (const auto& [u, v] : chain_of(loops[i].vertices)) {
      edges.push_back({std::min(u, v), std::max(u, v), i, u < v});
    }
  }
  world.charge(static_cast<double>(edges.size()));
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.low, a.high, a.loop, a.forward) < std::tie(b.low, b.high, b.loop, b.forward);
  });
  UnionFind classes(loops.size());
  for (std::size_t f = 0; f < boundary.faces.size(); ++f) {
    join_holes(world, boundary.faces[f], loops, first_loop[f], first_loop[f + 1], classes);
  }
  join_edges(edges, true, classes);
  std::vector<Solid> parts = collect(boundary, loops, classes);
  // A class that is closed only together with others across a shared edge: take those edges as
  // joints after all.
  if (parts.size() > 1 && !std::all_of(parts.begin(), parts.end(), is_closed)) {
    join_edges(edges, false, classes);
    parts = collect(boundary, loops, classes);
  }
  if (!std::all_of(parts.begin(), parts.end(), is_closed)) throw BrokenChain("an open boundary");
  for (Solid& part : parts) drop_straight_vertices(part);
  give_voids_to_solids(world, parts);
  return parts;
}

}  // namespace haptic::tools
