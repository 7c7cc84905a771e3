// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/mesh/box_tree.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace haptic::tools {
namespace {

constexpr std::uint32_t kLeafSize = 8;

bool ray_meets(const vec::Box& box, const Point3& origin, const Point3& direction, double margin) {
  double enter = -margin;
  double leave = HUGE_VAL;
  for (std::size_t i = 0; i < 3; ++i) {
    const double t0 = (box.low[i] - margin - origin[i]) / direction[i];
    const double t1 = (box.high[i] + margin - origin[i]) / direction[i];
    enter = std::max(enter, std::min(t0, t1));
    leave = std::min(leave, std::max(t0, t1));
  }
  return enter <= leave;
}

bool segment_meets(const vec::Box& box, const Point3& a, const Point3& b, double margin) {
  double enter = 0.0;
  double leave = 1.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double low = box.low[i] - margin - a[i];
    const double high = box.high[i] + margin - a[i];
    const double along = b[i] - a[i];
    if (std::abs(along) > 0.0) {
      enter = std::max(enter, std::min(low / along, high / along));
      leave = std::min(leave, std::max(low / along, high / along));
    } else if (low > 0.0 || high < 0.0) {
      return false;
    }
  }
  return enter <= leave;
}

}  // namespace

BoxTree::BoxTree(std::vector<vec::Box> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
  std::iota(order_.begin(), order_.end(), 0U);
  if (!boxes_.empty()) {
    build(0, static_cast<std::uint32_t>(boxes_.size()));
  }
}

// Recursion depth is log2(n / leaf size), since every split halves the range.
std::uint32_t BoxTree::build(std::uint32_t begin, std::uint32_t end) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  vec::Box box;
  vec::Box centres;
  for (std::uint32_t i = begin; i < end; ++i) {
    const vec::Box& b = boxes_[order_[i]];
    box.include(b.low);
    box.include(b.high);
    centres.include(vec::scaled(vec::add(b.low, b.high), 0.5));
  }
  nodes_[index].box = box;
  if (end - begin <= kLeafSize) {
    nodes_[index].begin = begin;
    nodes_[index].count = end - begin;
    return index;
  }
  std::size_t axis = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (centres.high[i] - centres.low[i] > centres.high[axis] - centres.low[axis]) {
      axis = i;
    }
  }
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     const double ca = boxes_[a].low[axis] + boxes_[a].high[axis];
                     const double cb = boxes_[b].low[axis] + boxes_[b].high[axis];
                     return ca != cb ? ca < cb : a < b;
                   });
  build(begin, middle);
  const std::uint32_t right = build(middle, end);
  nodes_[index].right = right;
  return index;
}

template <class Meets>
void BoxTree::visit(const Meets& meets, std::vector<std::uint32_t>& out) const {
  out.clear();
  std::uint32_t stack[64];  // depth is at most 32 for 32-bit counts, two entries per level
  std::size_t size = 0;
  if (!nodes_.empty()) {
    stack[size++] = 0;
  }
  while (size > 0) {
    const std::uint32_t index = stack[--size];
    const Node& node = nodes_[index];
    if (!meets(node.box)) {
      continue;
    }
    if (node.count == 0) {
      stack[size++] = node.right;
      stack[size++] = index + 1;
      continue;
    }
    for (std::uint32_t i = node.begin; i < node.begin + node.count; ++i) {
      if (meets(boxes_[order_[i]])) {
        out.push_back(order_[i]);
      }
    }
  }
  std::sort(out.begin(), out.end());
}

void BoxTree::find(const vec::Box& query, std::vector<std::uint32_t>& out) const {
  visit([&](const vec::Box& box) { return box.meets(query); }, out);
}

void BoxTree::find_ray(const Point3& origin, const Point3& direction, double margin,
                       std::vector<std::uint32_t>& out) const {
  visit([&](const vec::Box& box) { return ray_meets(box, origin, direction, margin); }, out);
}

void BoxTree::find_segment(const Point3& a, const Point3& b, double margin,
                           std::vector<std::uint32_t>& out) const {
  visit([&](const vec::Box& box) { return segment_meets(box, a, b, margin); }, out);
}

}  // namespace haptic::tools
