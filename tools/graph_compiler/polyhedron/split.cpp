// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/split.hpp"

#include <algorithm>
#include <cmath>

#include "tools/graph_compiler/polyhedron/components.hpp"

namespace haptic::tools {

namespace {

// A point farther from a plane than this (local units, part about one unit wide) is off it without
// an exact test; far above the 1e-15 to which rounded coordinates meet rounded planes, far below
// any feature.
constexpr double kSurelyOff = 1.0e-9;

double approximate_distance(const ExactWorld& world, std::uint32_t v, std::uint32_t p) {
  const ExactPlane& plane = world.planes[p];
  const std::array<double, 3>& x = world.vertices[v].x_approx;
  return plane.unit_normal[0] * x[0] + plane.unit_normal[1] * x[1] + plane.unit_normal[2] * x[2] -
         plane.unit_offset;
}

bool on_plane(ExactWorld& world, std::uint32_t v, std::uint32_t p) {
  return std::abs(approximate_distance(world, v, p)) < kSurelyOff && world.side(v, p) == 0;
}

}  // namespace

bool Splitter::classify(const Solid& solid, std::uint32_t h) {
  constexpr std::int8_t kUnknown = 2;
  sides_.resize(world_.vertices.size(), kUnknown);
  on_plane_.clear();
  for (const ExactFace& face : solid.faces) {
    for (const ChainEdge& e : face.edges) sides_[e.first] = kUnknown;
  }
  bool below = false;
  bool above = false;
  for (const ExactFace& face : solid.faces) {
    for (const ChainEdge& e : face.edges) {
      std::int8_t& side = sides_[e.first];
      if (side != kUnknown) continue;
      side = static_cast<std::int8_t>(world_.side(e.first, h));
      if (side == 0) on_plane_.push_back(e.first);
      below = below || side < 0;
      above = above || side > 0;
    }
  }
  return below && above;
}

void Splitter::distribute(const ExactFace& face, std::uint32_t h, FaceHalf& below,
                          FaceHalf& above) {
  for (const auto& [u, v] : face.edges) {
    const int su = side_of(u);
    const int sv = side_of(v);
    if (su == 0 && sv == 0) {
      // The interior is to the left, at N x e: its side of h is the sign of (N x e).n_h = -(N x
      // n_h).e.
      const int interior = -face.sign * world_.turn(face.plane, h, u, v);
      (interior < 0 ? below : above).on_plane.emplace_back(u, v);
    } else if (su <= 0 && sv <= 0) {
      below.chain.emplace_back(u, v);
    } else if (su >= 0 && sv >= 0) {
      above.chain.emplace_back(u, v);
    } else {
      const std::uint32_t c = world_.cut_edge(u, v, h);
      if (sides_.size() <= c) sides_.resize(world_.vertices.size(), 2);
      sides_[c] = 0;
      on_plane_.push_back(c);
      (su < 0 ? below : above).chain.emplace_back(u, c);
      (sv < 0 ? below : above).chain.emplace_back(c, v);
    }
  }
}

void Splitter::close(FaceHalf& half, std::uint32_t plane, std::uint32_t h) {
  balance_.clear();
  for (const Chain* chain : {&half.chain, &half.on_plane}) {
    for (const auto& [u, v] : *chain) {
      if (side_of(u) == 0) balance_.emplace_back(u, -1);
      if (side_of(v) == 0) balance_.emplace_back(v, 1);
    }
  }
  std::sort(balance_.begin(), balance_.end());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < balance_.size();) {
    auto sum = balance_[i];
    for (++i; i < balance_.size() && balance_[i].first == sum.first; ++i) {
      sum.second += balance_[i].second;
    }
    if (sum.second != 0) balance_[kept++] = sum;
  }
  balance_.resize(kept);
  std::sort(balance_.begin(), balance_.end(), [&](const auto& a, const auto& b) {
    return a.first != b.first && world_.turn(plane, h, a.first, b.first) > 0;
  });
  int run = 0;
  for (std::size_t i = 0; i + 1 < balance_.size(); ++i) {
    run += balance_[i].second;
    const ChainEdge forward{balance_[i].first, balance_[i + 1].first};
    for (int k = run; k > 0; --k) half.on_plane.push_back(forward);
    for (int k = run; k < 0; ++k) half.on_plane.emplace_back(forward.second, forward.first);
  }
  if (!balance_.empty() && run + balance_.back().second != 0) {
    throw BrokenChain("a face does not close along a cut");
  }
}

void Splitter::subdivide(FaceHalf& half, std::uint32_t plane, std::uint32_t h) {
  if (half.on_plane.empty()) return;
  on_line_.clear();
  for (const std::uint32_t v : on_plane_) {
    if (on_plane(world_, v, plane)) on_line_.push_back(v);
  }
  if (on_line_.size() > 2) {
    std::sort(on_line_.begin(), on_line_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return a != b && world_.turn(plane, h, a, b) > 0;
    });
    Chain fine;
    for (const auto& [u, v] : half.on_plane) {
      const auto at_u = std::find(on_line_.begin(), on_line_.end(), u);
      const auto at_v = std::find(on_line_.begin(), on_line_.end(), v);
      if (at_u == on_line_.end() || at_v == on_line_.end()) {
        throw BrokenChain("an edge of a cut is off its line");
      }
      for (auto it = at_u; it != at_v;) {
        const auto next = at_u < at_v ? it + 1 : it - 1;
        fine.emplace_back(*it, *next);
        it = next;
      }
    }
    half.on_plane = std::move(fine);
  }
}

std::optional<Halves> Splitter::split(const Solid& solid, std::uint32_t h) {
  if (!classify(solid, h)) return std::nullopt;
  std::vector<std::array<FaceHalf, 2>> halves(solid.faces.size());
  for (std::size_t f = 0; f < solid.faces.size(); ++f) {
    const ExactFace& face = solid.faces[f];
    world_.charge(static_cast<double>(face.edges.size()));
    // A face in the plane of the cut comes back as part of the cap.
    if (face.plane != h) distribute(face, h, halves[f][0], halves[f][1]);
  }
  std::sort(on_plane_.begin(), on_plane_.end());
  on_plane_.erase(std::unique(on_plane_.begin(), on_plane_.end()), on_plane_.end());

  std::array<Solid, 2> parts;
  std::array<ExactFace, 2> caps;
  for (std::size_t f = 0; f < solid.faces.size(); ++f) {
    const ExactFace& face = solid.faces[f];
    if (face.plane == h) continue;
    for (std::size_t s = 0; s < 2; ++s) {
      FaceHalf& half = halves[f][s];
      close(half, face.plane, h);
      subdivide(half, face.plane, h);
      if (half.chain.empty() && half.on_plane.empty()) continue;
      // The cap is the reverse of what the other faces leave open in the plane.
      for (const auto& [u, v] : half.on_plane) caps[s].edges.emplace_back(v, u);
      half.chain.insert(half.chain.end(), half.on_plane.begin(), half.on_plane.end());
      parts[s].faces.push_back({face.plane, face.sign, std::move(half.chain), -1});
    }
  }
  for (std::size_t s = 0; s < 2; ++s) {
    caps[s].plane = h;
    caps[s].sign = s == 0 ? 1 : -1;
    parts[s].faces.push_back(std::move(caps[s]));
    normalise(parts[s]);
  }
  return Halves{components(world_, parts[0]), components(world_, parts[1])};
}

void Splitter::subdivide_touching_edges(Solid& solid) {
  const std::vector<std::uint32_t> all = vertices_of(solid);
  // Both faces of an edge lie on its line, so the two sides of an edge are divided alike.
  for (ExactFace& face : solid.faces) {
    on_line_.clear();
    for (const std::uint32_t v : all) {
      if (on_plane(world_, v, face.plane)) on_line_.push_back(v);
    }
    Chain fine;
    for (const auto& [u, v] : face.edges) {
      std::vector<std::pair<Rational, std::uint32_t>> between;
      const Rational3& a = world_.vertices[u].x;
      const Rational3 e = subtract(world_.vertices[v].x, a);
      for (const std::uint32_t w : on_line_) {
        if (w == u || w == v || !near_segment(u, v, w)) continue;
        const Rational3 d = subtract(world_.vertices[w].x, a);
        const Rational3 c = cross(e, d);
        if (c[0] != 0 || c[1] != 0 || c[2] != 0) continue;
        const Rational along = dot(e, d);
        if (along > 0 && along < dot(e, e)) between.emplace_back(along, w);
      }
      std::sort(between.begin(), between.end());
      std::uint32_t last = u;
      for (const auto& [along, w] : between) {
        fine.emplace_back(last, w);
        last = w;
      }
      fine.emplace_back(last, v);
    }
    face.edges = std::move(fine);
  }
}

bool Splitter::near_segment(std::uint32_t u, std::uint32_t v, std::uint32_t w) const {
  const std::array<double, 3>& a = world_.vertices[u].x_approx;
  const std::array<double, 3>& b = world_.vertices[v].x_approx;
  const std::array<double, 3>& x = world_.vertices[w].x_approx;
  const double direct = std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
  const double around = std::hypot(x[0] - a[0], x[1] - a[1], x[2] - a[2]) +
                        std::hypot(x[0] - b[0], x[1] - b[1], x[2] - b[2]);
  return around - direct < kSurelyOff;
}

}  // namespace haptic::tools
