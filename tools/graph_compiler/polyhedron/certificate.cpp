// SPDX-License-Identifier: Apache-2.0
/// The proof that pieces and solid are the same set (METHOD section 7). It takes nothing
/// from the search: only the exact planes and vertices of the pieces and of the cleaned solid.
#include <algorithm>
#include <bit>
#include <limits>
#include <map>
#include <tuple>

#include "tools/graph_compiler/polyhedron/components.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"
#include "tools/graph_compiler/polyhedron/measure.hpp"
#include "tools/graph_compiler/polyhedron/separation.hpp"

namespace haptic::tools {

namespace {

// Checks must not end at a limit that the search has reached.
class UnlimitedWork {
 public:
  explicit UnlimitedWork(ExactWorld& world) : world_(world), limit_(world.work_limit) {
    world_.work_limit = std::numeric_limits<double>::infinity();
  }
  ~UnlimitedWork() { world_.work_limit = limit_; }
  UnlimitedWork(const UnlimitedWork&) = delete;
  UnlimitedWork& operator=(const UnlimitedWork&) = delete;

 private:
  ExactWorld& world_;
  double limit_;
};

// Lines by exact normal form: direction over its first non-zero component, and the point where that
// coordinate is 0.
class LineTable {
 public:
  explicit LineTable(const ExactWorld& world) : world_(world) {}

  std::uint32_t line_through(std::uint32_t u, std::uint32_t v) {
    const std::uint64_t key = std::uint64_t{std::min(u, v)} << 32U | std::max(u, v);
    if (const auto known = by_edge_.find(key); known != by_edge_.end()) return known->second;
    const std::uint32_t line = find_or_add(u, v);
    by_edge_.emplace(key, line);
    return line;
  }

 private:
  using Form = std::array<Rational, 6>;

  std::uint32_t find_or_add(std::uint32_t u, std::uint32_t v) {
    const Rational3& a = world_.vertices[u].x;
    Rational3 e = subtract(world_.vertices[v].x, a);
    std::size_t k = 0;
    while (k < 2 && e[k] == 0) ++k;
    const Rational lead = e[k];
    for (Rational& x : e) x /= lead;
    Form form{e[0], e[1], e[2], a[0] - a[k] * e[0], a[1] - a[k] * e[1], a[2] - a[k] * e[2]};
    std::size_t hash = k;
    for (const Rational& x : form) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(to_double(x))) * 0x9e3779b97f4a7c15ULL;
      hash ^= hash >> 29U;
    }
    const auto [first, last] = lookup_.equal_range(hash);
    for (auto it = first; it != last; ++it) {
      if (forms_[it->second] == form) return it->second;
    }
    const auto index = static_cast<std::uint32_t>(forms_.size());
    forms_.push_back(std::move(form));
    lookup_.emplace(hash, index);
    return index;
  }

  const ExactWorld& world_;
  std::vector<Form> forms_;
  // Looked up, never iterated.
  std::unordered_map<std::uint64_t, std::uint32_t> by_edge_;
  std::unordered_multimap<std::size_t, std::uint32_t> lookup_;
};

bool is_convex(ExactWorld& world, const Solid& piece) {
  if (piece.faces.size() < 4 || !is_closed(piece)) return false;
  const std::vector<std::uint32_t> vertices = vertices_of(piece);
  for (const ExactFace& face : piece.faces) {
    bool interior = false;
    for (const std::uint32_t v : vertices) {
      const int side = face.sign * world.side(v, face.plane);
      if (side > 0) return false;
      interior = interior || side < 0;
    }
    if (!interior) return false;
    for (const ChainEdge& e : face.edges) {
      if (world.side(e.first, face.plane) != 0 || world.side(e.second, face.plane) != 0)
        return false;
    }
  }
  return true;
}

struct Count {
  std::uint32_t plane, line, vertex;
  int sum;
};

void add_counts(LineTable& lines, const Solid& solid, int factor, std::vector<Count>& counts) {
  for (const ExactFace& face : solid.faces) {
    for (const auto& [u, v] : face.edges) {
      const std::uint32_t line = lines.line_through(u, v);
      counts.push_back({face.plane, line, v, factor});
      counts.push_back({face.plane, line, u, -factor});
    }
  }
}

std::size_t nonzero(std::vector<Count>& counts) {
  std::sort(counts.begin(), counts.end(), [](const Count& a, const Count& b) {
    return std::tie(a.plane, a.line, a.vertex) < std::tie(b.plane, b.line, b.vertex);
  });
  std::size_t result = 0;
  for (std::size_t i = 0; i < counts.size();) {
    int sum = 0;
    std::size_t end = i;
    for (; end < counts.size() && counts[end].plane == counts[i].plane &&
           counts[end].line == counts[i].line && counts[end].vertex == counts[i].vertex;
         ++end) {
      sum += counts[end].sum;
    }
    if (sum != 0) ++result;
    i = end;
  }
  return result;
}

// Volume of the pieces minus the volume of the solid is zero, in rationals. Terms that are equal
// number by number (both sides of a seam, whole faces) are left out first: a sum of all of them
// would need a common denominator of millions of bits on curved parts.
bool same_volume(const ExactWorld& world, const Solid& solid,
                 const std::vector<const Solid*>& pieces) {
  std::map<std::uint32_t, Chain> by_plane;
  std::map<std::uint32_t, std::uint32_t>
      origin;  // any point of the plane, the same for all its faces
  const auto add = [&](const Solid& part, bool reversed) {
    for (const ExactFace& face : part.faces) {
      for (const auto& [u, v] : face.edges) {
        origin.emplace(face.plane, u);
        by_plane[face.plane].push_back(reversed ? ChainEdge{v, u} : ChainEdge{u, v});
      }
    }
  };
  for (const Solid* piece : pieces) add(*piece, false);
  add(solid, true);
  Rational difference = 0;
  for (auto& [plane, chain] : by_plane) {
    cancel(chain);
    Rational3 area{0, 0, 0};
    for (const ChainEdge& e : chain) {
      const Rational3 c = cross(world.vertices[e.first].x, world.vertices[e.second].x);
      for (std::size_t i = 0; i < 3; ++i) area[i] += c[i];
    }
    difference += dot(world.vertices[origin[plane]].x, area);
  }
  return difference == 0;
}

// Every removed part is convex and inside of all planes of one of the pieces.
bool covered(ExactWorld& world, const std::vector<Solid>& removed,
             const std::vector<Solid>& pieces) {
  return std::all_of(removed.begin(), removed.end(), [&](const Solid& part) {
    if (!is_convex(world, part)) return false;
    const std::vector<std::uint32_t> vertices = vertices_of(part);
    const auto holds_it = [&](const Solid& piece) {
      return std::all_of(piece.faces.begin(), piece.faces.end(), [&](const ExactFace& face) {
        return std::all_of(vertices.begin(), vertices.end(), [&](std::uint32_t v) {
          return face.sign * world.side(v, face.plane) <= 0;
        });
      });
    };
    return std::any_of(pieces.begin(), pieces.end(), holds_it);
  });
}

}  // namespace

Certificate certify(ExactWorld& world, const std::vector<FlatSolid>& solids,
                    const std::vector<Solid>& pieces, const std::vector<std::uint32_t>& piece_solid,
                    const DisjointPieces* apart) {
  const UnlimitedWork unlimited(world);
  Certificate result;
  result.convex = !pieces.empty();
  for (const Solid& piece : pieces) result.convex = result.convex && is_convex(world, piece);

  std::vector<PieceHull> hulls(pieces.begin(), pieces.end());
  result.disjoint = true;
  for (std::size_t i = 0; i < pieces.size() && result.convex; ++i) {
    for (std::size_t k = i + 1; k < pieces.size(); ++k) {
      const bool same = piece_solid[i] == piece_solid[k];
      if (same ? !result.disjoint : result.cover) continue;
      if (separated(world, pieces[i], hulls[i], pieces[k], hulls[k])) continue;
      (same ? result.disjoint : result.cover) = same ? false : true;
    }
  }
  if (!result.convex || (apart != nullptr && result.cover)) result.disjoint = false;

  LineTable lines(world);
  result.volume_equal = true;
  Rational total = 0;
  for (std::uint32_t s = 0; s < solids.size(); ++s) {
    std::vector<Count> counts;
    std::vector<const Solid*> own;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (piece_solid[i] != s) continue;
      own.push_back(&pieces[i]);
      add_counts(lines, pieces[i], 1, counts);
    }
    for (std::size_t i = 0; apart != nullptr && i < apart->removed.size(); ++i) {
      if (apart->removed_solid[i] != s) continue;
      own.push_back(&apart->removed[i]);
      add_counts(lines, apart->removed[i], 1, counts);
      total -= measure(world, apart->removed[i]).volume;
    }
    add_counts(lines, solids[s].solid, -1, counts);
    result.nonzero_counts += nonzero(counts);
    result.volume_equal = result.volume_equal && same_volume(world, solids[s].solid, own);
    total += measure(world, solids[s].solid).volume;
  }
  result.partition = result.nonzero_counts == 0;
  if (apart != nullptr) {
    result.removed = apart->removed.size();
    result.partition = result.partition && covered(world, apart->removed, pieces);
  }
  const Rational unit(world.scale);
  result.volume_m3 = to_double(total / (unit * unit * unit));
  return result;
}

}  // namespace haptic::tools
