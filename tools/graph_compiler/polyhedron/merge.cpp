// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/merge.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <tuple>

namespace haptic::tools {

namespace {

struct Convex {
  Solid solid;
  std::vector<std::uint32_t> vertices;
  bool alive = true;

  explicit Convex(Solid s) : solid(std::move(s)), vertices(vertices_of(solid)) {}
};

// Pairs that can unite, best first: number of common oriented planes (falling), then the two
// positions.
struct Pair {
  std::size_t common;
  std::size_t a;
  std::size_t b;
  std::uint32_t plane;

  bool operator<(const Pair& other) const {
    return std::tuple(other.common, a, b, plane) <
           std::tuple(common, other.a, other.b, other.plane);
  }
};

bool inside_except(ExactWorld& world, const std::vector<std::uint32_t>& vertices,
                   const Solid& solid, std::uint32_t except) {
  for (const ExactFace& face : solid.faces) {
    if (face.plane == except) continue;
    for (const std::uint32_t v : vertices) {
      if (face.sign * world.side(v, face.plane) > 0) return false;
    }
  }
  return true;
}

// Faces of both are sorted by (plane, sign).
std::size_t compare_planes(const Solid& a, const Solid& b, std::vector<std::uint32_t>& opposite) {
  std::size_t common = 0;
  opposite.clear();
  for (std::size_t i = 0, k = 0; i < a.faces.size() && k < b.faces.size();) {
    if (a.faces[i].plane < b.faces[k].plane) {
      ++i;
    } else if (b.faces[k].plane < a.faces[i].plane) {
      ++k;
    } else {
      if (a.faces[i].sign == b.faces[k].sign) {
        ++common;
      } else {
        opposite.push_back(a.faces[i].plane);
      }
      ++i;
      ++k;
    }
  }
  return common;
}

std::optional<Solid> unite(const Solid& a, const Solid& b, std::uint32_t seam) {
  Solid sum;
  Chain at_seam;
  for (const Solid* solid : {&a, &b}) {
    for (const ExactFace& face : solid->faces) {
      if (face.plane == seam) {
        at_seam.insert(at_seam.end(), face.edges.begin(), face.edges.end());
      } else {
        sum.faces.push_back(face);
      }
    }
  }
  cancel(at_seam);
  if (!at_seam.empty()) return std::nullopt;
  normalise(sum);
  drop_straight_vertices(sum);
  return sum;
}

class Merger {
 public:
  Merger(ExactWorld& world, std::vector<Solid> pieces) : world_(world) {
    for (Solid& piece : pieces) {
      pieces_.emplace_back(std::move(piece));
      pair_with_earlier(pieces_.size() - 1);
    }
  }

  std::vector<Solid> run() {
    while (!pairs_.empty()) {
      const Pair pair = *pairs_.begin();
      pairs_.erase(pairs_.begin());
      if (!pieces_[pair.a].alive || !pieces_[pair.b].alive) continue;
      std::optional<Solid> united = unite(pieces_[pair.a].solid, pieces_[pair.b].solid, pair.plane);
      if (!united) continue;
      pieces_[pair.a].alive = false;
      pieces_[pair.b].alive = false;
      pieces_.emplace_back(std::move(*united));
      pair_with_earlier(pieces_.size() - 1);
    }
    std::vector<Solid> result;
    for (Convex& piece : pieces_) {
      if (piece.alive) result.push_back(std::move(piece.solid));
    }
    return result;
  }

 private:
  void pair_with_earlier(std::size_t b) {
    std::vector<std::uint32_t> opposite;
    for (std::size_t a = 0; a < b; ++a) {
      if (!pieces_[a].alive) continue;
      world_.charge(1.0);
      const std::size_t common = compare_planes(pieces_[a].solid, pieces_[b].solid, opposite);
      for (const std::uint32_t plane : opposite) {
        if (inside_except(world_, pieces_[a].vertices, pieces_[b].solid, plane) &&
            inside_except(world_, pieces_[b].vertices, pieces_[a].solid, plane)) {
          pairs_.insert({common, a, b, plane});
        }
      }
    }
  }

  ExactWorld& world_;
  std::vector<Convex> pieces_;
  std::set<Pair> pairs_;
};

}  // namespace

std::vector<Solid> merge_pieces(ExactWorld& world, std::vector<Solid> pieces) {
  return Merger(world, std::move(pieces)).run();
}

}  // namespace haptic::tools
