// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/facet_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/base/wide_lanes.hpp"
#include "rt_core/proxy/lane_kernels.hpp"

namespace haptic {
namespace {

constexpr float kFar = 1.0e30f;
/// Roundings of a distance in the tree, in those of the size of all: of two corners, of a
/// direction, and of a product with it for each.
constexpr Real kTreeRounding = 24 * 6.0e-8_r;

struct Range {
  std::uint32_t begin = 0, end = 0;
  [[nodiscard]] std::uint32_t size() const noexcept { return end - begin; }
};

}  // namespace

void FacetTree::place(Arena& arena, std::uint32_t facets) noexcept {
  const auto nodes = static_cast<std::size_t>(facet_tree_nodes(facets));
  nodes_ = arena.take<TreeNode>(nodes);
  leaves_ = arena.take<TreeLeaf>(static_cast<std::size_t>(facet_tree_leaves(facets)));
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

/// Cuts the first of `parts` into at most kFloatLanes: children of one size, a power of eight that
/// is at least a leaf's, but for the last of them. @return how many.
std::uint32_t split(const FacetSet& set, std::span<std::uint32_t> order,
                    Range (&parts)[kFloatLanes]) noexcept {
  std::uint32_t count = 1;
  std::uint32_t unit = kFloatLanes;
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

/// The box of some facets; without any it is far from all.
void FacetTree::fill_box(TreeBoxes& boxes, std::uint32_t k, std::span<const std::uint32_t> in,
                         const FacetSet& set) const noexcept {
  for (int x = 0; x < 3; ++x) {
    boxes.low[x][k] = kFar;
    boxes.high[x][k] = -kFar;
  }
  for (const std::uint32_t f : in) {
    for (const Vec3& corner : set.corners_of(f)) {
      for (int x = 0; x < 3; ++x) {
        const Real from = corner[x] - middle_w_[x];
        boxes.low[x][k] = std::min(boxes.low[x][k], rounded_down(from));
        boxes.high[x][k] = std::max(boxes.high[x][k], rounded_up(from));
      }
    }
  }
}

void FacetTree::fill_leaf(TreeLeaf& leaf, std::span<const std::uint32_t> in,
                          const FacetSet& set) const noexcept {
  for (std::uint32_t k = 0; k < kFloatLanes; ++k) {
    fill_box(leaf.boxes, k, in.subspan(std::min<std::size_t>(k, in.size()), k < in.size() ? 1 : 0),
             set);
    const std::uint32_t f = in[std::min<std::size_t>(k, in.size() - 1)];
    const StaticFacet& facet = set.facets[f];
    const std::span<const Vec3> corners_w = set.corners_of(f);
    for (int x = 0; x < 3; ++x) {
      leaf.normal[x][k] = static_cast<float>(facet.normal[x]);
      for (std::uint32_t c = 0; c < kLeafCorners; ++c) {
        const Vec3& corner = corners_w[std::min<std::size_t>(c, corners_w.size() - 1)];
        leaf.corner[c][x][k] = static_cast<float>(corner[x] - middle_w_[x]);
      }
    }
    leaf.offset[k] = static_cast<float>(facet.offset_m - facet.normal.dot(middle_w_));
    leaf.unknown[k] = corners_w.size() > kLeafCorners ? -kFar : 0.0f;
  }
}

void FacetTree::build(std::span<const StaticFacet> facets,
                      std::span<const Vec3> corners_w) noexcept {
  Vec3 low = corners_w[0], high = low;
  for (const Vec3& corner : corners_w) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  is_wide_ = has_wide_lanes();
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
      const std::span<const std::uint32_t> in = order_.subspan(part.begin, part.size());
      fill_box(nodes_[at].boxes, k, in, set);
      nodes_[at].child[k] = 0;
      if (in.empty()) continue;
      if (in.size() <= kFloatLanes) {  // they begin at a multiple of eight
        // The split says which they are, and the library of C++ in which order.
        std::make_heap(order_.data() + part.begin, order_.data() + part.end);
        std::sort_heap(order_.data() + part.begin, order_.data() + part.end);
        fill_leaf(leaves_[part.begin / kFloatLanes], in, set);
        nodes_[at].child[k] = kTreeLeaf | part.begin / kFloatLanes;
        continue;
      }
      begin_[2 * made] = part.begin;
      begin_[2 * made + 1] = part.end;
      nodes_[at].child[k] = made++;
    }
  }
}

FacetTree::Found FacetTree::find(const TriangleShape& triangle, Real range_m,
                                 std::span<std::uint32_t> found) const noexcept {
  Found result;
  Real far_m = 0;
  for (const Vec3& corner : triangle.corner_w) {
    far_m = std::max(far_m, (corner - middle_w_).cwiseAbs().sum());
  }
  const Real rounding_m = rounding_m_ + kTreeRounding * far_m;
  TreeQuery query;
  query.range_m = rounded_up(range_m + rounding_m);
  for (int k = 0; k < 3; ++k) {
    const Vec3 corner = triangle.corner_w[k] - middle_w_;
    for (int x = 0; x < 3; ++x) {
      query.corner[k][x] = static_cast<float>(corner[x]);
      query.outward[k][x] = static_cast<float>(triangle.outward_w[k][x]);
    }
    query.side[k] = static_cast<float>(triangle.outward_w[k].dot(corner));
  }
  for (int x = 0; x < 3; ++x) {
    const float(&at)[3][3] = query.corner;
    query.low[x] = std::min({at[0][x], at[1][x], at[2][x]});
    query.high[x] = std::max({at[0][x], at[1][x], at[2][x]});
    query.normal[x] = static_cast<float>(triangle.normal_w[x]);
  }
  query.offset = static_cast<float>(triangle.normal_w.dot(triangle.corner_w[0] - middle_w_));
  const TreeFound in_tree = LaneKernels{is_wide_}.find_facets(nodes_, leaves_, query, found);
  result.count = in_tree.count;
  result.nodes = in_tree.nodes;
  result.leaves = in_tree.leaves;
  const Real by_box_m = in_tree.others2_m2 < kFar ? std::sqrt(static_cast<Real>(in_tree.others2_m2))
                                                  : static_cast<Real>(kFar);
  result.others_m = std::max(
      std::min(by_box_m, static_cast<Real>(in_tree.others_m)) * (1 - 1.0e-6_r) - rounding_m,
      range_m);
  return result;
}

}  // namespace haptic
