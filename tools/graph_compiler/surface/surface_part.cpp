// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/surface/surface_part.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/common/split_mix.hpp"
#include "tools/graph_compiler/mesh/box_tree.hpp"
#include "tools/graph_compiler/mesh/cleaning.hpp"
#include "tools/graph_compiler/mesh/edge_table.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/mesh/weld.hpp"
#include "tools/graph_compiler/surface/facet_merge.hpp"
#include "tools/graph_compiler/surface/neighbourhood.hpp"
#include "tools/graph_compiler/surface/polygon_triangles.hpp"
#include "tools/graph_compiler/surface/triangle_crossing.hpp"

namespace haptic::tools {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;
/// Share of the part's diagonal: heights below are rounding of the coordinates, not geometry.
constexpr double kFlatShare = 1.0e-14;
/// Sides that a part may have: indices have 32 bits.
constexpr std::size_t kMostSides = 0x7FFFFFFFU;
/// Above so many triangles or so many pairs of boxes, crossings are not counted.
constexpr std::size_t kMostTrianglesForCrossings = 200'000;
constexpr std::size_t kMostPairsForCrossings = 4'000'000;

using Triangle = std::array<std::uint32_t, 3>;

struct SourceTriangle {
  Triangle v{};
  std::uint32_t source = 0;
};

struct TriangleSide {
  std::uint64_t key = 0;  ///< smaller end in the upper half
  std::uint32_t triangle = 0;
  bool forward = false;
};

std::uint64_t key_of(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

std::string length_of(double x_m) { return formatted("%.3g m", x_m); }

/// Equal points get one index. Open addressing: millions of points.
class PointNumbers {
 public:
  explicit PointNumbers(std::size_t most) : slots_(std::bit_ceil(2 * most + 2), kNone) {}

  std::uint32_t number_of(const Point3& p, std::vector<Point3>& points) {
    std::uint64_t h = 0;
    for (const double x : p) h = hashed(h ^ std::bit_cast<std::uint64_t>(x));
    for (std::size_t at = static_cast<std::size_t>(h);; ++at) {
      std::uint32_t& slot = slots_[at & (slots_.size() - 1)];
      if (slot == kNone) {
        slot = static_cast<std::uint32_t>(points.size());
        points.push_back(p);
      }
      if (points[slot] == p) return slot;
    }
  }

 private:
  std::vector<std::uint32_t> slots_;
};

class PartMaker {
 public:
  PartMaker(const RawMesh& raw, const SurfaceOptions& options) : raw_(raw), options_(options) {}

  SurfacePart run(SurfaceAccount& account) {
    number_points();
    cut_faces();
    drop_duplicates();
    weld_open_edges();
    absorb_flat_triangles();
    if (triangles_.empty()) {
      refuse("no triangle has an area", "export the part again; lines and points are no surface");
    }
    orient();
    count_crossings();
    SurfacePart part = facets();
    find_neighbourhood(part, account_.weld_radius_m, account_);
    account_.facets = part.facets.size();
    account = account_;
    return part;
  }

 private:
  [[noreturn]] void refuse(const std::string& defect, const std::string& fix) const {
    throw InputError(raw_.file + ": " + defect + "; " + fix);
  }

  void number_points();
  void cut_faces();
  void drop_duplicates();
  void weld_open_edges();
  void absorb_flat_triangles();
  void orient();
  void count_crossings();
  SurfacePart facets();

  [[nodiscard]] std::vector<TriangleSide> sides() const;
  [[nodiscard]] TriangleCorners corners(const Triangle& t) const {
    return {points_[t[0]], points_[t[1]], points_[t[2]]};
  }

  const RawMesh& raw_;
  const SurfaceOptions& options_;
  SurfaceAccount account_;
  std::vector<Point3> points_;
  std::vector<std::uint32_t> point_of_;  ///< of each vertex of the file
  std::vector<SourceTriangle> triangles_;
};

void PartMaker::number_points() {
  if (raw_.faces.empty()) refuse("the mesh has no face", "export the part again");
  for (const double s : options_.scale_to_m) {
    if (!std::isfinite(s) || s <= 0.0) {
      refuse("the scale is not three positive numbers", "give metres per unit of the file");
    }
  }
  std::size_t sides = 0;
  std::vector<std::uint8_t> used(raw_.vertices.size(), 0);
  for (std::size_t f = 0; f < raw_.faces.size(); ++f) {
    for (const std::uint32_t v : raw_.faces[f].vertices) {
      if (v >= used.size()) {
        refuse("a face uses vertex " + std::to_string(v) + " of " + std::to_string(used.size()),
               "correct the index");
      }
      used[v] = 1;
    }
    sides += raw_.faces[f].vertices.size();
  }
  if (sides > kMostSides) {
    refuse(std::to_string(sides) + " sides of faces, limit " + std::to_string(kMostSides),
           "simplify the part");
  }
  PointNumbers numbers(raw_.vertices.size());
  point_of_.assign(raw_.vertices.size(), kNone);
  vec::Box box;
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (used[v] == 0) continue;
    Point3 p = raw_.vertices[v];
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = p[k] * options_.scale_to_m[k] + 0.0;  // no negative zero
      if (!std::isfinite(p[k])) {
        refuse("vertex " + std::to_string(v + 1) + " is not finite after scaling",
               "check the unit of the export");
      }
    }
    box.include(p);
    const std::size_t before = points_.size();
    point_of_[v] = numbers.number_of(p, points_);
    if (points_.size() == before) ++account_.welded_vertices;
  }
  account_.faces_read = raw_.faces.size();
  account_.diagonal_m = box.diagonal();
  if (!std::isfinite(account_.diagonal_m)) {
    refuse("the part is " + length_of(account_.diagonal_m) + " across", "check the scale");
  }
  double largest = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    largest = std::max({largest, std::abs(box.low[k]), std::abs(box.high[k])});
  }
  const double resolution = coordinate_resolution(raw_, options_.scale_to_m, largest);
  account_.weld_radius_m =
      options_.weld_radius_m.value_or(0.5 * plane_tolerance(account_.diagonal_m, resolution));
}

void PartMaker::cut_faces() {
  std::vector<std::uint32_t> loop;
  std::vector<Triangle> cut;
  for (std::size_t f = 0; f < raw_.faces.size(); ++f) {
    loop.clear();
    for (const std::uint32_t v : raw_.faces[f].vertices) {
      if (loop.empty() || loop.back() != point_of_[v]) loop.push_back(point_of_[v]);
    }
    while (loop.size() > 1 && loop.back() == loop.front()) loop.pop_back();
    const auto source = static_cast<std::uint32_t>(f);
    if (loop.size() < 3) {
      ++account_.triangles_read;
      // A side there and back: kept until it is known what covers it.
      triangles_.push_back({{loop.front(), loop.back(), loop.back()}, source});
      continue;
    }
    cut.clear();
    if (loop.size() == 3) {
      cut.push_back({loop[0], loop[1], loop[2]});
    } else {
      triangulate_loop(points_, loop, cut);
    }
    account_.triangles_read += cut.size();
    for (const Triangle& t : cut) triangles_.push_back({t, source});
  }
}

void PartMaker::drop_duplicates() {
  std::vector<std::pair<Triangle, std::uint32_t>> sorted(triangles_.size());
  for (std::uint32_t i = 0; i < sorted.size(); ++i) {
    sorted[i] = {triangles_[i].v, i};
    std::sort(sorted[i].first.begin(), sorted[i].first.end());
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<std::uint8_t> repeated(triangles_.size(), 0);
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i].first == sorted[i - 1].first) repeated[sorted[i].second] = 1;
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    if (repeated[i] == 0) triangles_[kept++] = triangles_[i];
  }
  account_.duplicate_facets += triangles_.size() - kept;
  triangles_.resize(kept);
}

std::vector<TriangleSide> PartMaker::sides() const {
  std::vector<TriangleSide> sides;
  sides.reserve(3 * triangles_.size());
  for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles_[i].v[k], b = triangles_[i].v[(k + 1) % 3];
      if (a != b) sides.push_back({key_of(a, b), i, a < b});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const TriangleSide& a, const TriangleSide& b) {
    return a.key != b.key ? a.key < b.key : a.triangle < b.triangle;
  });
  return sides;
}

/// Calls `edge(begin, end)` for every range of sides of one edge.
template <class Edge>
void for_edges(const std::vector<TriangleSide>& sides, const Edge& edge) {
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].key == sides[i].key) ++end;
    edge(i, end);
    i = end;
  }
}

/// Joins ends of open edges that lie within the weld radius, never two corners of one triangle.
/// All other vertices stay where the file has them.
void PartMaker::weld_open_edges() {
  std::vector<std::uint8_t> is_open(points_.size(), 0);
  const std::vector<TriangleSide> all = sides();
  for_edges(all, [&](std::size_t begin, std::size_t end) {
    if (end != begin + 1) return;
    is_open[all[begin].key >> 32] = 1;
    is_open[all[begin].key & 0xFFFFFFFFU] = 1;
  });
  std::vector<std::uint32_t> subset;
  for (std::uint32_t v = 0; v < is_open.size(); ++v) {
    if (is_open[v] != 0) subset.push_back(v);
  }
  if (subset.empty() || !(account_.weld_radius_m > 0.0)) return;
  const std::vector<std::uint32_t> found = weld_points(points_, subset, account_.weld_radius_m);
  std::vector<std::uint32_t> target(points_.size());
  for (std::uint32_t v = 0; v < target.size(); ++v) target[v] = v;
  for (std::size_t i = 0; i < subset.size(); ++i) target[subset[i]] = found[i];
  for (const SourceTriangle& t : triangles_) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t.v[k], b = t.v[(k + 1) % 3];
      if (a == b || target[a] != target[b]) continue;
      target[a] = a;
      target[b] = b;
    }
  }
  std::size_t moved = 0;
  for (std::uint32_t v = 0; v < target.size(); ++v) {
    if (target[v] == v) continue;
    ++moved;
    account_.largest_weld_move_m =
        std::max(account_.largest_weld_move_m, vec::distance(points_[v], points_[target[v]]));
  }
  if (moved == 0) return;
  account_.welded_vertices += moved;
  for (SourceTriangle& t : triangles_) {
    for (std::uint32_t& v : t.v) v = target[v];
  }
  drop_duplicates();
}

/// A triangle without area is its longest side. It is absorbed where that side is a side of another
/// facet, or its two short sides are: then it holds no point that no facet holds, and its middle
/// corner becomes a T-junction. Sides that are covered by absorbed triangles count too.
void PartMaker::absorb_flat_triangles() {
  struct Flat {
    std::array<std::uint64_t, 3> side{};  ///< the longest first
    bool covered = false;
  };
  const double least_m = kFlatShare * account_.diagonal_m;
  std::vector<Flat> flats;
  std::size_t kept = 0;
  for (const SourceTriangle& t : triangles_) {
    std::array<std::size_t, 3> order{0, 1, 2};
    std::array<double, 3> length{};
    for (std::size_t k = 0; k < 3; ++k) {
      length[k] = vec::distance(points_[t.v[k]], points_[t.v[(k + 1) % 3]]);
    }
    const TriangleCorners c = corners(t.v);
    const double longest = std::max({length[0], length[1], length[2]});
    if (vec::norm(exact_twice_area(c.data(), 3)) > least_m * longest) {
      triangles_[kept++] = t;
      continue;
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return length[a] > length[b]; });
    Flat flat;
    for (std::size_t k = 0; k < 3; ++k) {
      flat.side[k] = key_of(t.v[order[k]], t.v[(order[k] + 1) % 3]);
    }
    flats.push_back(flat);
  }
  triangles_.resize(kept);
  if (flats.empty()) return;
  std::vector<std::uint64_t> covered;
  for (const TriangleSide& side : sides()) covered.push_back(side.key);
  covered.erase(std::unique(covered.begin(), covered.end()), covered.end());
  const auto is_covered = [&](std::uint64_t key) {
    return key >> 32 == (key & 0xFFFFFFFFU) ||
           std::binary_search(covered.begin(), covered.end(), key);
  };
  constexpr int kMostRounds = 64;
  bool changed = true;
  for (int round = 0; round < kMostRounds && changed; ++round) {
    changed = false;
    std::vector<std::uint64_t> more;
    for (Flat& flat : flats) {
      if (flat.covered) continue;
      flat.covered =
          is_covered(flat.side[0]) || (is_covered(flat.side[1]) && is_covered(flat.side[2]));
      if (!flat.covered) continue;
      more.insert(more.end(), flat.side.begin(), flat.side.end());
      changed = true;
    }
    covered.insert(covered.end(), more.begin(), more.end());
    std::sort(covered.begin(), covered.end());
  }
  for (const Flat& flat : flats) {
    ++(flat.covered ? account_.degenerate_absorbed : account_.degenerate_loose);
  }
}

/// Consistent over edges with two triangles, as most of each set have it in the file.
void PartMaker::orient() {
  const std::vector<TriangleSide> all = sides();
  ParitySets sense(triangles_.size());
  for_edges(all, [&](std::size_t begin, std::size_t end) {
    if (end != begin + 2) return;
    const TriangleSide &a = all[begin], &b = all[begin + 1];
    sense.unite(a.triangle, b.triangle, a.forward == b.forward);
  });
  std::vector<std::array<std::uint32_t, 2>> votes(triangles_.size(), {0, 0});
  for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
    ++votes[sense.root_of(i)][sense.parity_of(i) ? 1 : 0];
  }
  for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
    const auto& vote = votes[sense.root_of(i)];
    const bool minority = sense.parity_of(i) ? vote[1] <= vote[0] : vote[0] < vote[1];
    if (!minority) continue;
    std::swap(triangles_[i].v[1], triangles_[i].v[2]);
    ++account_.flipped;
  }
}

void PartMaker::count_crossings() {
  if (!options_.count_crossings || triangles_.size() > kMostTrianglesForCrossings) return;
  std::vector<vec::Box> boxes(triangles_.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (const Point3& p : corners(triangles_[i].v)) boxes[i].include(p);
  }
  const BoxTree tree(boxes);
  std::vector<std::uint32_t> near;
  std::size_t found = 0, looked_at = 0;
  for (std::uint32_t i = 0; i < boxes.size() && found < kMostCrossingsCounted; ++i) {
    tree.find(boxes[i], near);
    looked_at += near.size();
    if (looked_at > kMostPairsForCrossings) return;
    for (const std::uint32_t k : near) {
      if (k <= i || found >= kMostCrossingsCounted) continue;
      if (triangles_cross(corners(triangles_[i].v), corners(triangles_[k].v))) ++found;
    }
  }
  account_.self_intersections = found;
}

SurfacePart PartMaker::facets() {
  account_.triangles = triangles_.size();
  std::vector<std::vector<std::uint32_t>> loops;
  std::vector<std::uint32_t> source;
  loops.reserve(triangles_.size());
  for (const SourceTriangle& t : triangles_) {
    loops.emplace_back(t.v.begin(), t.v.end());
    source.push_back(t.source);
  }
  if (options_.merge) {
    merge_facets(points_, loops, source,
                 {options_.flat_share * account_.diagonal_m,
                  std::max<std::size_t>(options_.most_corners, 3)});
  }
  SurfacePart part;
  std::vector<std::uint32_t> renumbered(points_.size(), kNone);
  std::vector<Point3> corners;
  for (std::size_t f = 0; f < loops.size(); ++f) {
    if (loops[f].empty()) continue;
    corners.clear();
    SurfacePart::Facet facet;
    for (const std::uint32_t v : loops[f]) {
      corners.push_back(points_[v]);
      if (renumbered[v] == kNone) {
        renumbered[v] = static_cast<std::uint32_t>(part.vertices_m.size());
        part.vertices_m.push_back(points_[v]);
      }
      facet.loop.push_back(renumbered[v]);
    }
    facet.normal = vec::unit(exact_twice_area(corners.data(), corners.size()));
    part.facets.push_back(std::move(facet));
    part.source_face.push_back(source[f]);
  }
  return part;
}

}  // namespace

SurfacePart make_surface_part(const RawMesh& raw, const SurfaceOptions& options,
                              SurfaceAccount* account) {
  SurfaceAccount counted;
  SurfacePart part = PartMaker(raw, options).run(counted);
  if (account != nullptr) *account = counted;
  return part;
}

}  // namespace haptic::tools
