// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/facet_tree.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace haptic {
namespace {

constexpr float kFar = 1.0e30f;
/// Roundings of a distance in the tree, in those of the size of all.
constexpr Real kTreeRounding = 8 * 6.0e-8_r;

struct Range {
  std::uint32_t begin = 0, end = 0;
  [[nodiscard]] std::uint32_t size() const noexcept { return end - begin; }
};

}  // namespace

void FacetTree::place(Arena& arena, std::uint32_t facets) noexcept {
  const auto nodes = static_cast<std::size_t>(facet_tree_nodes(facets));
  nodes_ = arena.take<Node>(nodes);
  order_ = arena.take<std::uint32_t>(facets);
  begin_ = arena.take<std::uint32_t>(2 * nodes);
}

/// The facets of a tree while it is built.
struct FacetSet {
  std::span<const StaticFacet> facets;
  std::span<const Vec3> corners_w;

  [[nodiscard]] std::span<const Vec3> corners_of(std::uint32_t f) const noexcept {
    return corners_w.subspan(facets[f].begin, facets[f].count);
  }
  /// Twice the middle of a facet along an axis [m].
  [[nodiscard]] Real centre(std::uint32_t f, int axis) const noexcept {
    Real least = std::numeric_limits<Real>::max(), most = -least;
    for (const Vec3& corner : corners_of(f)) {
      least = std::min(least, corner[axis]);
      most = std::max(most, corner[axis]);
    }
    return least + most;
  }
};

namespace {

/// The axis along which the middles of some facets lie farthest apart.
int longest_axis(const FacetSet& set, std::span<const std::uint32_t> facets) noexcept {
  Vec3 least = Vec3::Constant(std::numeric_limits<Real>::max()), most = -least;
  for (const std::uint32_t f : facets) {
    for (int axis = 0; axis < 3; ++axis) {
      const Real c = set.centre(f, axis);
      least[axis] = std::min(least[axis], c);
      most[axis] = std::max(most[axis], c);
    }
  }
  const Vec3 side = most - least;
  return side[0] >= side[1] && side[0] >= side[2] ? 0 : side[1] >= side[2] ? 1 : 2;
}

/// Cuts the first of `parts` into at most kFloatLanes: children of one size, a power of eight, but
/// for the last of them. @return how many.
std::uint32_t split(const FacetSet& set, std::span<std::uint32_t> order,
                    Range (&parts)[kFloatLanes]) noexcept {
  std::uint32_t count = 1;
  std::uint32_t unit = 1;
  while (unit * kFloatLanes < parts[0].size()) unit *= kFloatLanes;
  for (std::uint32_t k = 0; k < count;) {
    const Range part = parts[k];
    if (part.size() <= unit || count == kFloatLanes) {
      ++k;
      continue;
    }
    const int axis = longest_axis(set, order.subspan(part.begin, part.size()));
    const std::uint32_t units = (part.size() + unit - 1) / unit;
    const std::uint32_t middle = part.begin + (units / 2) * unit;
    std::nth_element(order.data() + part.begin, order.data() + middle, order.data() + part.end,
                     [&](std::uint32_t l, std::uint32_t r) {
                       const Real at_l = set.centre(l, axis), at_r = set.centre(r, axis);
                       return at_l < at_r || (at_l == at_r && l < r);
                     });
    parts[k] = {part.begin, middle};
    parts[count++] = {middle, part.end};
  }
  return count;
}

}  // namespace

/// Fills the box of a child, or the facet that it is; a child without facets is far from all.
void FacetTree::fill(Node& node, std::uint32_t k, std::span<const std::uint32_t> in,
                     const FacetSet& set) const noexcept {
  for (int x = 0; x < 3; ++x) {
    node.low[x][k] = kFar;
    node.high[x][k] = -kFar;
    node.normal[x][k] = 0;
  }
  node.offset[k] = 0;
  node.child[k] = 0;
  for (const std::uint32_t f : in) {
    for (const Vec3& corner : set.corners_of(f)) {
      for (int x = 0; x < 3; ++x) {
        const Real from = corner[x] - middle_w_[x];
        node.low[x][k] = std::min(node.low[x][k], rounded_down(from));
        node.high[x][k] = std::max(node.high[x][k], rounded_up(from));
      }
    }
  }
  if (in.size() != 1) return;
  const StaticFacet& facet = set.facets[in[0]];
  for (int x = 0; x < 3; ++x) node.normal[x][k] = static_cast<float>(facet.normal[x]);
  node.offset[k] = static_cast<float>(facet.offset_m - facet.normal.dot(middle_w_));
  node.child[k] = kFacet | in[0];
}

void FacetTree::build(std::span<const StaticFacet> facets,
                      std::span<const Vec3> corners_w) noexcept {
  Vec3 low = corners_w[0], high = low;
  for (const Vec3& corner : corners_w) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  middle_w_ = 0.5_r * (low + high);
  rounding_m_ = kTreeRounding * std::sqrt((high - low).squaredNorm()) +
                64 * kRealEpsilon * (std::sqrt(low.squaredNorm()) + std::sqrt(high.squaredNorm()));
  for (std::uint32_t f = 0; f < order_.size(); ++f) order_[f] = f;
  begin_[0] = 0;
  begin_[1] = static_cast<std::uint32_t>(order_.size());
  const FacetSet set{facets, corners_w};
  std::uint32_t made = 1;
  for (std::uint32_t at = 0; at < made; ++at) {
    Range parts[kFloatLanes] = {{begin_[2 * at], begin_[2 * at + 1]}};
    const std::uint32_t count = split(set, order_, parts);
    for (std::uint32_t k = 0; k < kFloatLanes; ++k) {
      const Range part = k < count ? parts[k] : Range{};
      fill(nodes_[at], k, order_.subspan(part.begin, part.size()), set);
      if (part.size() < 2) continue;
      begin_[2 * made] = part.begin;
      begin_[2 * made + 1] = part.end;
      nodes_[at].child[k] = made++;
    }
  }
}

FacetTree::Found FacetTree::find(const Vec3 (&corners_w)[3], Real range_m,
                                 std::span<std::uint32_t> found) const noexcept {
  Found result;
  alignas(16) float at[3][4];
  FloatLanes low[3], high[3];
  for (int x = 0; x < 3; ++x) {
    for (int k = 0; k < 3; ++k) at[k][x] = static_cast<float>(corners_w[k][x] - middle_w_[x]);
    low[x] = all_lanes(std::min({at[0][x], at[1][x], at[2][x]}));
    high[x] = all_lanes(std::max({at[0][x], at[1][x], at[2][x]}));
  }
  Real far_m = 0;
  for (const Vec3& corner : corners_w) {
    far_m = std::max(far_m, (corner - middle_w_).cwiseAbs().sum());
  }
  const Real rounding_m = rounding_m_ + kTreeRounding * far_m;
  const float range = rounded_up(range_m + rounding_m);
  const FloatLanes none = all_lanes(3.0e38f), zero = all_lanes(0.0f);
  const FloatLanes limit = all_lanes(range), limit2 = all_lanes(range * range);
  FloatLanes beyond2 = none, beyond = none;
  std::uint32_t waiting[kMostWaiting];
  std::uint32_t count = 0;
  waiting[count++] = 0;
  while (count > 0) {
    const Node& node = nodes_[waiting[--count]];
    result.visits += 1;
    const auto apart = [&](int x) {
      return larger(larger(load_floats(node.low[x]) - high[x], low[x] - load_floats(node.high[x])),
                    zero);
    };
    const FloatLanes x0 = apart(0), x1 = apart(1), x2 = apart(2);
    const FloatLanes apart2 = (x0 * x0 + x1 * x1) + x2 * x2;
    beyond2 = smaller(beyond2, where_below(limit2, apart2, apart2, none));
    std::uint32_t in = ~lanes_below(limit2, apart2) & 0xffu;
    if (in == 0) continue;
    // The planes of facets; of nodes these are zero.
    const FloatLanes n0 = load_floats(node.normal[0]), n1 = load_floats(node.normal[1]),
                     n2 = load_floats(node.normal[2]), offset = load_floats(node.offset);
    const auto height = [&](const float* corner) {
      return ((n0 * all_lanes(corner[0]) + n1 * all_lanes(corner[1])) + n2 * all_lanes(corner[2])) -
             offset;
    };
    const FloatLanes h0 = height(at[0]), h1 = height(at[1]), h2 = height(at[2]);
    const FloatLanes off = larger(smaller(h0, smaller(h1, h2)), zero - larger(h0, larger(h1, h2)));
    const std::uint32_t far = lanes_below(limit, off) & in;
    if (far != 0) {
      alignas(16) float each[kFloatLanes];
      store_floats(off, each);
      float least = 3.0e38f;
      for (std::uint32_t bits = far; bits != 0; bits &= bits - 1) {
        least = std::min(least, each[std::countr_zero(bits)]);
      }
      beyond = smaller(beyond, all_lanes(least));
      in &= ~far;
    }
    for (; in != 0; in &= in - 1) {
      const std::uint32_t child = node.child[std::countr_zero(in)];
      if ((child & kFacet) != 0) {
        found[result.count++] = child & ~kFacet;
      } else {
        waiting[count++] = child;
      }
    }
  }
  const float least2 = least_lane(beyond2), least = least_lane(beyond);
  const Real by_box_m =
      least2 < kFar ? std::sqrt(static_cast<Real>(least2)) : static_cast<Real>(kFar);
  result.others_m =
      std::max(std::min(by_box_m, static_cast<Real>(least)) * (1 - 1.0e-6_r) - rounding_m, range_m);
  return result;
}

}  // namespace haptic
