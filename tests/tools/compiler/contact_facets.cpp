// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/compiler/contact_facets.hpp"

#include <algorithm>
#include <cmath>

#include "tests/support/point_algebra.hpp"

namespace haptic::test {
namespace {

Point unit(const Point& a) {
  const double length = std::sqrt(dot(a, a));
  return {a[0] / length, a[1] / length, a[2] / length};
}

Point rotate(const std::array<double, 4>& q, const Point& v) {
  const Point u{q[1], q[2], q[3]};
  const Point t = cross(u, v);
  const Point s = cross(u, t);
  return {v[0] + 2 * (q[0] * t[0] + s[0]), v[1] + 2 * (q[0] * t[1] + s[1]),
          v[2] + 2 * (q[0] * t[2] + s[2])};
}

bool share(const std::set<std::uint32_t>& a, const std::set<std::uint32_t>& b) {
  return std::any_of(a.begin(), a.end(), [&](std::uint32_t x) { return b.contains(x); });
}

std::set<std::uint32_t> ends(const Pair& edge) { return {edge.first, edge.second}; }

}  // namespace

Incidence::Incidence(const tools::ConvexPiece& piece) : vertices(piece.vertices) {
  std::set<Pair> all;
  for (const tools::PieceFace& face : piece.faces) {
    faces.push_back(face.loop);
    for (std::size_t k = 0; k < face.loop.size(); ++k) {
      all.insert(std::minmax(face.loop[k], face.loop[(k + 1) % face.loop.size()]));
    }
  }
  edges.assign(all.begin(), all.end());
  face_vertices.resize(faces.size());
  face_edges.resize(faces.size());
  vertex_faces.resize(vertices.size());
  vertex_edges.resize(vertices.size());
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    for (std::size_t k = 0; k < faces[f].size(); ++k) {
      const Pair ends_k = std::minmax(faces[f][k], faces[f][(k + 1) % faces[f].size()]);
      face_vertices[f].insert(faces[f][k]);
      vertex_faces[faces[f][k]].insert(f);
      const auto e = static_cast<std::uint32_t>(
          std::lower_bound(edges.begin(), edges.end(), ends_k) - edges.begin());
      face_edges[f].insert(e);
      vertex_edges[ends_k.first].insert(e);
      vertex_edges[ends_k.second].insert(e);
    }
  }
}

void ReferenceGraph::add(std::uint32_t u, std::uint32_t v) {
  arcs.insert({u, v});
  arcs.insert({v, u});
}

ReferenceGraph::ReferenceGraph(const Incidence& a, const Incidence& b) {
  const auto nfa = static_cast<std::uint32_t>(a.faces.size());
  const auto nva = static_cast<std::uint32_t>(a.vertices.size());
  const auto nea = static_cast<std::uint32_t>(a.edges.size());
  const auto nfb = static_cast<std::uint32_t>(b.faces.size());
  const auto nvb = static_cast<std::uint32_t>(b.vertices.size());
  const auto neb = static_cast<std::uint32_t>(b.edges.size());
  count_a = nfa * nvb;
  count_b = nva * nfb;
  node_count = count_a + count_b + nea * neb;
  const auto type_a = [&](std::uint32_t f, std::uint32_t v) { return f * nvb + v; };
  const auto type_b = [&](std::uint32_t v, std::uint32_t f) { return count_a + v * nfb + f; };
  const auto type_c = [&](std::uint32_t e, std::uint32_t g) {
    return count_a + count_b + e * neb + g;
  };
  for (std::uint32_t f = 0; f < nfa; ++f) {  // step 1
    for (std::uint32_t v = 0; v < nvb; ++v) {
      for (std::uint32_t other = 0; other < nfa; ++other) {
        if (other != f && share(a.face_edges[f], a.face_edges[other])) {
          add(type_a(f, v), type_a(other, v));
        }
      }
      for (std::uint32_t other = 0; other < nvb; ++other) {
        if (other != v && share(b.vertex_edges[v], b.vertex_edges[other])) {
          add(type_a(f, v), type_a(f, other));
        }
      }
      for (const std::uint32_t va : a.face_vertices[f]) {
        for (const std::uint32_t fb : b.vertex_faces[v]) add(type_a(f, v), type_b(va, fb));
      }
      for (const std::uint32_t ea : a.face_edges[f]) {
        for (const std::uint32_t eb : b.vertex_edges[v]) add(type_a(f, v), type_c(ea, eb));
      }
    }
  }
  for (std::uint32_t v = 0; v < nva; ++v) {  // step 2
    for (std::uint32_t f = 0; f < nfb; ++f) {
      for (std::uint32_t other = 0; other < nva; ++other) {
        if (other != v && share(a.vertex_edges[v], a.vertex_edges[other])) {
          add(type_b(v, f), type_b(other, f));
        }
      }
      for (std::uint32_t other = 0; other < nfb; ++other) {
        if (other != f && share(b.face_edges[f], b.face_edges[other])) {
          add(type_b(v, f), type_b(v, other));
        }
      }
      for (const std::uint32_t ea : a.vertex_edges[v]) {
        for (const std::uint32_t eb : b.face_edges[f]) add(type_b(v, f), type_c(ea, eb));
      }
    }
  }
  for (std::uint32_t e = 0; e < nea; ++e) {  // step 3
    for (std::uint32_t g = 0; g < neb; ++g) {
      for (std::uint32_t other = 0; other < neb; ++other) {
        if (other != g && share(ends(b.edges[g]), ends(b.edges[other]))) {
          add(type_c(e, g), type_c(e, other));
        }
      }
      for (std::uint32_t other = 0; other < nea; ++other) {
        if (other != e && share(ends(a.edges[e]), ends(a.edges[other]))) {
          add(type_c(e, g), type_c(other, g));
        }
      }
    }
  }
}

std::vector<Facet> facets_of(const tools::ConvexPiece& piece_a, const tools::ConvexPiece& piece_b,
                             const std::array<double, 4>& q_wxyz) {
  Incidence a(piece_a), b(piece_b);
  for (Point& v : a.vertices) v = rotate(q_wxyz, v);
  std::vector<Facet> facets;
  // Adds the node when no vertex of P(R) = B - R A lies beyond its plane.
  const auto consider = [&](std::uint32_t node, const Point& n, const std::set<std::uint32_t>& va,
                            const std::set<std::uint32_t>& vb) {
    double high = -1e300, low = 1e300;
    for (const Point& v : b.vertices) high = std::max(high, dot(n, v));
    for (const Point& v : a.vertices) low = std::min(low, dot(n, v));
    const double own = dot(n, b.vertices[*vb.begin()]) - dot(n, a.vertices[*va.begin()]);
    if (own < high - low - 1e-12) return;
    Facet facet;
    facet.node = node;
    for (const std::uint32_t i : va) {
      for (const std::uint32_t j : vb) facet.corners.insert({i, j});
    }
    facets.push_back(facet);
  };
  const auto normal = [](const Incidence& p, std::uint32_t f) {
    const Point& o = p.vertices[p.faces[f][0]];
    return unit(cross(minus(p.vertices[p.faces[f][1]], o), minus(p.vertices[p.faces[f][2]], o)));
  };
  const ReferenceGraph numbers(a, b);
  std::uint32_t node = 0;
  for (std::uint32_t f = 0; f < a.faces.size(); ++f) {
    const Point n = normal(a, f);
    for (std::uint32_t v = 0; v < b.vertices.size(); ++v, ++node) {
      consider(node, {-n[0], -n[1], -n[2]}, a.face_vertices[f], {v});
    }
  }
  for (std::uint32_t v = 0; v < a.vertices.size(); ++v) {
    for (std::uint32_t f = 0; f < b.faces.size(); ++f, ++node) {
      consider(node, normal(b, f), {v}, b.face_vertices[f]);
    }
  }
  for (const Pair& e : a.edges) {
    for (const Pair& g : b.edges) {
      const Point n = unit(cross(minus(a.vertices[e.second], a.vertices[e.first]),
                                 minus(b.vertices[g.second], b.vertices[g.first])));
      consider(node, n, ends(e), ends(g));
      consider(node, {-n[0], -n[1], -n[2]}, ends(e), ends(g));
      ++node;
    }
  }
  return facets;
}

}  // namespace haptic::test
