// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/surface/neighbourhood.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/graph_compiler/mesh/box_tree.hpp"
#include "tools/graph_compiler/mesh/edge_table.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

/// A gap between open edges up to this many weld radii is called a crack.
constexpr double kWidestCrackInWelds = 100.0;
/// Edges that are turned by more than 25 degrees do not run along one crack.
constexpr double kAlongCosine = 0.9;

struct FacetSide {
  std::uint64_t key = 0;    ///< smaller end in the upper half
  std::uint32_t place = 0;  ///< index in edge_of
  std::uint32_t facet = 0;
  bool forward = false;
};

/// A direction that belongs to a vertex or an edge, before the lists are made.
struct OwnedDirection {
  std::uint32_t owner = 0;
  Point3 direction{0, 0, 0};
};

/// Sorts by owner, keeping the order within one, drops repetitions, and lists.
void make_lists(std::vector<OwnedDirection>& entries, std::size_t owners,
                std::vector<std::uint32_t>& begin, std::vector<Point3>& list) {
  std::stable_sort(
      entries.begin(), entries.end(),
      [](const OwnedDirection& a, const OwnedDirection& b) { return a.owner < b.owner; });
  begin.assign(owners + 1, 0);
  list.clear();
  std::size_t first = 0;
  std::uint32_t owner = 0;
  for (const OwnedDirection& entry : entries) {
    if (list.empty() || entry.owner != owner) first = list.size();
    owner = entry.owner;
    const auto at = list.begin() + static_cast<std::ptrdiff_t>(first);
    if (std::find(at, list.end(), entry.direction) != list.end()) continue;
    list.push_back(entry.direction);
    ++begin[owner + 1];
  }
  for (std::size_t i = 0; i < owners; ++i) begin[i + 1] += begin[i];
}

/// Where two open edges run along each other.
struct Overlap {
  std::uint32_t edge = 0;
  double from_m = 0.0, to_m = 0.0;  ///< along the edge
};

class Neighbourhood {
 public:
  Neighbourhood(SurfacePart& part, double weld_radius_m, SurfaceAccount& account)
      : part_(part), weld_m_(weld_radius_m), account_(account) {}

  void run() {
    number_edges();
    for (std::uint32_t e = 0; e < part_.edges.size(); ++e) {
      const auto [a, b] = part_.edges[e];
      const Point3 along = direction_of(e);
      ring_.push_back({a, along});
      ring_.push_back({b, vec::scaled(along, -1.0)});
    }
    find_overlaps();
    make_lists(ring_, part_.vertices_m.size(), part_.ring_begin, part_.ring);
    make_lists(inward_, part_.edges.size(), part_.inward_begin, part_.inward);
  }

 private:
  [[nodiscard]] const Point3& end_of(std::uint32_t e, std::size_t k) const {
    return part_.vertices_m[part_.edges[e][k]];
  }
  [[nodiscard]] Point3 direction_of(std::uint32_t e) const {
    return vec::unit(vec::sub(end_of(e, 1), end_of(e, 0)));
  }

  void number_edges();
  void find_overlaps();
  void overlap(std::uint32_t e, std::uint32_t other, std::vector<Overlap>& overlaps);
  [[nodiscard]] bool covered(std::uint32_t e, std::vector<Overlap>::const_iterator begin,
                             std::vector<Overlap>::const_iterator end) const;
  void measure_cracks(const std::vector<std::uint32_t>& open);

  SurfacePart& part_;
  double weld_m_;
  SurfaceAccount& account_;
  std::vector<OwnedDirection> ring_, inward_;
  std::vector<std::uint32_t> open_;  ///< edges with one facet
  std::vector<Point3> open_inward_;  ///< of each
  std::vector<double> open_sense_;   ///< of each: 1 where its facet runs from the smaller vertex
  bool senses_agree_ = true;         ///< at edges with two facets and at T-junction seams
};

void Neighbourhood::number_edges() {
  std::vector<FacetSide> sides;
  part_.side_begin.assign(1, 0);
  for (std::uint32_t f = 0; f < part_.facets.size(); ++f) {
    const std::vector<std::uint32_t>& loop = part_.facets[f].loop;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const std::uint32_t a = loop[k], b = loop[k + 1 == loop.size() ? 0 : k + 1];
      sides.push_back({std::uint64_t{std::min(a, b)} << 32 | std::max(a, b),
                       static_cast<std::uint32_t>(sides.size()), f, a < b});
    }
    part_.side_begin.push_back(static_cast<std::uint32_t>(sides.size()));
  }
  part_.edge_of.resize(sides.size());
  std::sort(sides.begin(), sides.end(), [](const FacetSide& a, const FacetSide& b) {
    return a.key != b.key ? a.key < b.key : a.place < b.place;
  });
  ParitySets shells(part_.facets.size());
  std::vector<std::uint32_t> of_open;  // facets at edges that are not those of a closed shell
  for (std::size_t i = 0; i < sides.size();) {
    const auto e = static_cast<std::uint32_t>(part_.edges.size());
    part_.edges.push_back(
        {static_cast<std::uint32_t>(sides[i].key >> 32), static_cast<std::uint32_t>(sides[i].key)});
    const Point3 along = direction_of(e);
    std::size_t end = i;
    for (; end < sides.size() && sides[end].key == sides[i].key; ++end) {
      part_.edge_of[sides[end].place] = e;
      const Point3& normal = part_.facets[sides[end].facet].normal;
      const Point3 left = vec::unit(vec::cross(normal, along));
      inward_.push_back({e, sides[end].forward ? left : vec::scaled(left, -1.0)});
    }
    const std::size_t count = end - i;
    for (std::size_t k = i + 1; k < end; ++k) shells.unite(sides[i].facet, sides[k].facet, false);
    if (count != 2 || sides[i].forward == sides[i + 1].forward) of_open.push_back(sides[i].facet);
    if (count == 1) {
      open_.push_back(e);
      open_inward_.push_back(inward_.back().direction);
      open_sense_.push_back(sides[i].forward ? 1.0 : -1.0);
    }
    if (count == 2 && sides[i].forward == sides[i + 1].forward) senses_agree_ = false;
    if (count > 2) ++account_.nonmanifold_edges;
    i = end;
  }
  part_.closed = of_open.empty();
  std::vector<std::uint8_t> open(part_.facets.size(), 0);  // by root
  for (const std::uint32_t f : of_open) open[shells.root_of(f)] = 1;
  for (std::uint32_t f = 0; f < part_.facets.size(); ++f) {
    if (shells.root_of(f) != f) continue;
    ++account_.shells;
    if (open[f] == 0) ++account_.closed_shells;
  }
}

/// Both edges are open; `overlaps` receives an entry for each of them.
void Neighbourhood::overlap(std::uint32_t i, std::uint32_t k, std::vector<Overlap>& overlaps) {
  const std::array<std::uint32_t, 2> which{i, k};
  // The ends of the second edge, seen from the first.
  const std::uint32_t e = open_[i], other = open_[k];
  const Point3 along = direction_of(e);
  const double length = vec::distance(end_of(e, 0), end_of(e, 1));
  std::array<double, 2> at{};
  for (std::size_t j = 0; j < 2; ++j) {
    at[j] = vec::dot(vec::sub(end_of(other, j), end_of(e, 0)), along);
  }
  const double low = std::max(0.0, std::min(at[0], at[1]));
  const double high = std::min(length, std::max(at[0], at[1]));
  const double shorter = std::min(length, std::abs(at[1] - at[0]));
  if (!(high - low > std::min(weld_m_, 0.5 * shorter))) return;
  std::array<double, 2> on_other{};
  for (std::size_t j = 0; j < 2; ++j) {
    const double s = j == 0 ? low : high;
    const double t = (s - at[0]) / (at[1] - at[0]);
    const Point3 here = vec::add(end_of(e, 0), vec::scaled(along, s));
    const Point3 step = vec::sub(end_of(other, 1), end_of(other, 0));
    const Point3 there = vec::add(end_of(other, 0), vec::scaled(step, t));
    if (!(vec::distance(here, there) <= weld_m_)) return;
    on_other[j] = t * vec::norm(step);
  }
  const double turned = vec::dot(along, direction_of(other)) * open_sense_[i] * open_sense_[k];
  if (turned > 0.0) senses_agree_ = false;
  overlaps.push_back({i, low, high});
  overlaps.push_back({k, std::min(on_other[0], on_other[1]), std::max(on_other[0], on_other[1])});
  for (std::size_t j = 0; j < 2; ++j) {
    const std::uint32_t mine = which[j], its = which[1 - j];
    inward_.push_back({open_[mine], open_inward_[its]});
    // Ends of the other edge inside this one: there this one's facet is a half disc.
    const Point3 direction = direction_of(open_[mine]);
    const double reach = vec::distance(end_of(open_[mine], 0), end_of(open_[mine], 1));
    for (std::size_t v = 0; v < 2; ++v) {
      const Point3& p = end_of(open_[its], v);
      const Point3 from = vec::sub(p, end_of(open_[mine], 0));
      const double s = vec::dot(from, direction);
      if (!(s > weld_m_ && s < reach - weld_m_)) continue;
      if (vec::norm(vec::sub(from, vec::scaled(direction, s))) > weld_m_) continue;
      const std::uint32_t vertex = part_.edges[open_[its]][v];
      ring_.push_back({vertex, direction});
      ring_.push_back({vertex, vec::scaled(direction, -1.0)});
      ring_.push_back({vertex, open_inward_[mine]});
    }
  }
}

bool Neighbourhood::covered(std::uint32_t i, std::vector<Overlap>::const_iterator begin,
                            std::vector<Overlap>::const_iterator end) const {
  const double length = vec::distance(end_of(open_[i], 0), end_of(open_[i], 1));
  double reached = 0.0;
  for (auto o = begin; o != end; ++o) {
    if (o->from_m > reached + 2.0 * weld_m_) return false;
    reached = std::max(reached, o->to_m);
  }
  return reached >= length - 2.0 * weld_m_;
}

void Neighbourhood::find_overlaps() {
  std::vector<vec::Box> boxes(open_.size());
  for (std::size_t i = 0; i < open_.size(); ++i) {
    for (std::size_t k = 0; k < 2; ++k) boxes[i].include(end_of(open_[i], k));
  }
  const BoxTree tree(std::move(boxes));
  std::vector<Overlap> overlaps;
  std::vector<std::uint32_t> near;
  for (std::uint32_t i = 0; i < open_.size(); ++i) {
    tree.find_segment(end_of(open_[i], 0), end_of(open_[i], 1), weld_m_, near);
    for (const std::uint32_t k : near) {
      if (k > i) overlap(i, k, overlaps);
    }
  }
  std::sort(overlaps.begin(), overlaps.end(), [](const Overlap& a, const Overlap& b) {
    if (a.edge != b.edge) return a.edge < b.edge;
    return a.from_m != b.from_m ? a.from_m < b.from_m : a.to_m < b.to_m;
  });
  std::vector<std::uint32_t> uncovered;
  auto at = overlaps.cbegin();
  for (std::uint32_t i = 0; i < open_.size(); ++i) {
    const auto begin = at;
    while (at != overlaps.cend() && at->edge == i) ++at;
    if (begin != at) ++account_.t_junction_edges;
    if (!covered(i, begin, at)) uncovered.push_back(i);
  }
  account_.open_edges = uncovered.size();
  account_.tight = senses_agree_ && uncovered.empty() && account_.nonmanifold_edges == 0;
  measure_cracks(uncovered);
}

/// The widest gap that an open edge has to the nearest one along it.
void Neighbourhood::measure_cracks(const std::vector<std::uint32_t>& open) {
  const double widest = kWidestCrackInWelds * weld_m_;
  std::vector<vec::Box> boxes(open.size());
  for (std::size_t i = 0; i < open.size(); ++i) {
    for (std::size_t k = 0; k < 2; ++k) boxes[i].include(end_of(open_[open[i]], k));
  }
  const BoxTree tree(std::move(boxes));
  std::vector<std::uint32_t> near;
  for (const std::uint32_t i : open) {
    const std::uint32_t e = open_[i];
    const Point3 middle = vec::scaled(vec::add(end_of(e, 0), end_of(e, 1)), 0.5);
    const Point3 along = direction_of(e);
    vec::Box box;
    box.include(middle);
    tree.find(box.grown(widest), near);
    double nearest = HUGE_VAL;
    for (const std::uint32_t n : near) {
      const std::uint32_t other = open_[open[n]];
      if (other == e) continue;
      const Point3 direction = direction_of(other);
      if (std::abs(vec::dot(direction, along)) < kAlongCosine) continue;
      const Point3 from = vec::sub(middle, end_of(other, 0));
      const double s = vec::dot(from, direction);
      if (s < 0.0 || s > vec::distance(end_of(other, 0), end_of(other, 1))) continue;
      nearest = std::min(nearest, vec::norm(vec::sub(from, vec::scaled(direction, s))));
    }
    if (nearest > weld_m_ && nearest <= widest) {
      account_.widest_crack_m = std::max(account_.widest_crack_m, nearest);
    }
  }
}

}  // namespace

void find_neighbourhood(SurfacePart& part, double weld_radius_m, SurfaceAccount& account) {
  Neighbourhood(part, weld_radius_m, account).run();
}

}  // namespace haptic::tools
