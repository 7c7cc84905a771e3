// SPDX-License-Identifier: Apache-2.0
#include "host_sim/oracle/mesh_pair.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace haptic::sim {
namespace {

constexpr std::uint32_t kLeaf = 4;
constexpr int kMostHalvings = 24;
/// Boxes are in double; this much of a coordinate covers their rounding.
constexpr double kBoxRounding = 1e-15;
constexpr Wide kGapRounding = 64 * std::numeric_limits<Wide>::epsilon();

Triangle placed(const Triangle& t, const OraclePose& pose) {
  return {pose.x + pose.r * t[0], pose.x + pose.r * t[1], pose.x + pose.r * t[2]};
}

WideRotation product(const WideRotation& a, const WideRotation& b) {
  WideRotation c;
  for (int i = 0; i < 3; ++i) {
    const WideVec& r = a.row[i];
    c.row[i] = r.x * b.row[0] + r.y * b.row[1] + r.z * b.row[2];
  }
  return c;
}

double of(const WideVec& v, std::size_t axis) {
  return static_cast<double>(axis == 0 ? v.x : axis == 1 ? v.y : v.z);
}

}  // namespace

OraclePose StraightWay::at(Wide share) const {
  const Wide full = norm(turn_rad), half = share * full / 2;
  OraclePose pose{from.r, from.x + share * move_m};
  if (!(half > 0)) return pose;
  const WideVec v = (std::sin(half) / full) * turn_rad;
  pose.r = product(rotation_of(std::cos(half), v.x, v.y, v.z), from.r);
  return pose;
}

void MeshPair::Box::include(const Triangle& t, Wide margin_m) {
  for (std::size_t k = 0; k < 3; ++k) {
    for (const WideVec& v : t) {
      const double x = of(v, k);
      const double more =
          static_cast<double>(margin_m) * (1 + kBoxRounding) + kBoxRounding * std::abs(x);
      low[k] = std::min(low[k], x - more);
      high[k] = std::max(high[k], x + more);
    }
  }
}

void MeshPair::Box::include(const Box& other) {
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = std::min(low[k], other.low[k]);
    high[k] = std::max(high[k], other.high[k]);
  }
}

bool MeshPair::Box::meets(const Box& other) const {
  for (std::size_t k = 0; k < 3; ++k) {
    if (low[k] > other.high[k] || high[k] < other.low[k]) return false;
  }
  return true;
}

double MeshPair::Box::distance(const Box& other) const {
  double square = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double apart = std::max({low[k] - other.high[k], other.low[k] - high[k], 0.0});
    square += apart * apart;
  }
  return std::sqrt(square) * (1 - kBoxRounding);
}

MeshPair::MeshPair(const std::vector<Triangle>& moving, const std::vector<Triangle>& fixed) {
  for (std::size_t k = 0; k < moving.size(); ++k) {
    if (has_no_area(moving[k])) {
      ++left_out_;
      continue;
    }
    moving_.push_back(moving[k]);
    moving_number_.push_back(static_cast<std::uint32_t>(k));
    Wide lever = 0;
    for (const WideVec& v : moving[k]) lever = std::max(lever, norm(v));
    lever_m_.push_back(lever);
    radius_m_ = std::max(radius_m_, lever);
  }
  for (std::size_t k = 0; k < fixed.size(); ++k) {
    if (has_no_area(fixed[k])) {
      ++left_out_;
      continue;
    }
    fixed_.push_back(fixed[k]);
    fixed_number_.push_back(static_cast<std::uint32_t>(k));
    for (const WideVec& v : fixed[k]) extent_m_ = std::max(extent_m_, norm(v));
    Box box;
    box.include(fixed[k], 0);
    fixed_box_.push_back(box);
  }
  order_.resize(fixed_.size());
  std::iota(order_.begin(), order_.end(), 0u);
  if (fixed_.empty()) return;
  nodes_.push_back({{}, 0, static_cast<std::uint32_t>(fixed_.size()), 0});
  for (std::uint32_t node = 0; node < nodes_.size(); ++node) build(node);
}

/// Gives a node its box and, where it is large, two halves along its longest side.
void MeshPair::build(std::uint32_t number) {
  Node node = nodes_[number];
  for (std::uint32_t k = node.begin; k < node.end; ++k) node.box.include(fixed_box_[order_[k]]);
  if (node.end - node.begin > kLeaf) {
    std::size_t axis = 0;
    const auto length = [&](std::size_t k) { return node.box.high[k] - node.box.low[k]; };
    for (std::size_t k = 1; k < 3; ++k) axis = length(k) > length(axis) ? k : axis;
    const std::uint32_t middle = node.begin + (node.end - node.begin) / 2;
    std::nth_element(order_.begin() + node.begin, order_.begin() + middle,
                     order_.begin() + node.end, [&](std::uint32_t a, std::uint32_t b) {
                       const Box &left = fixed_box_[a], &right = fixed_box_[b];
                       return left.low[axis] + left.high[axis] < right.low[axis] + right.high[axis];
                     });
    node.child = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back({{}, node.begin, middle, 0});
    nodes_.push_back({{}, middle, node.end, 0});
  }
  nodes_[number] = node;
}

template <typename Visit>
void MeshPair::near(const Box& box, const Visit& visit) const {
  if (nodes_.empty()) return;
  std::array<std::uint32_t, 128> open;  // depth is the logarithm of 32-bit counts: at most 33
  std::size_t count = 0;
  open[count++] = 0;
  while (count > 0) {
    const Node& node = nodes_[open[--count]];
    if (!node.box.meets(box)) continue;
    if (node.child != 0) {
      open[count++] = node.child;
      open[count++] = node.child + 1;
      continue;
    }
    for (std::uint32_t k = node.begin; k < node.end; ++k) {
      if (fixed_box_[order_[k]].meets(box)) visit(order_[k]);
    }
  }
}

MeshCrossing MeshPair::crossing(const OraclePose& pose) const {
  MeshCrossing found;
  // Where they only touch, the gap is zero but for its rounding.
  const Wide touching = kGapRounding * (radius_m_ + extent_m_ + norm(pose.x));
  for (std::uint32_t i = 0; i < moving_.size(); ++i) {
    const Triangle a = placed(moving_[i], pose);
    Box box;
    box.include(a, 0);
    near(box, [&](std::uint32_t j) {
      const TriangleGap gap = triangle_gap(a, fixed_[j], touching);
      if (gap.gap_m >= touching) return;
      if (triangles_meet(a, fixed_[j])) ++found.meeting;
      if (-gap.gap_m <= found.depth_m) return;
      found.depth_m = -gap.gap_m;
      found.moving = moving_number_[i];
      found.fixed = fixed_number_[j];
    });
  }
  return found;
}

Wide MeshPair::distance_m(const OraclePose& pose, Wide within_m) const {
  Wide smallest = within_m;
  if (nodes_.empty()) return smallest;
  std::vector<std::uint32_t> open;
  for (const Triangle& t : moving_) {
    const Triangle a = placed(t, pose);
    Box box;
    box.include(a, 0);
    const auto too_far = [&](const Box& other) { return box.distance(other) > smallest; };
    open.assign(1, 0);
    while (!open.empty()) {
      const Node& node = nodes_[open.back()];
      open.pop_back();
      if (too_far(node.box)) continue;
      if (node.child != 0) {
        // The nearer one is looked at first.
        const bool first =
            box.distance(nodes_[node.child].box) < box.distance(nodes_[node.child + 1].box);
        open.push_back(node.child + (first ? 1 : 0));
        open.push_back(node.child + (first ? 0 : 1));
        continue;
      }
      for (std::uint32_t k = node.begin; k < node.end; ++k) {
        const std::uint32_t j = order_[k];
        if (too_far(fixed_box_[j])) continue;
        if (triangle_gap(a, fixed_[j], smallest).gap_m >= smallest) continue;
        smallest = std::min(smallest, triangle_distance(a, fixed_[j]));
      }
    }
  }
  return smallest;
}

MeshPair::Sample MeshPair::sampled(const StraightWay& way, std::uint32_t moving, const Triangle& b,
                                   Wide at, int first) const {
  Sample sample;
  sample.at = at;
  sample.pose = way.at(at);
  sample.a = placed(moving_[moving], sample.pose);
  sample.gap = triangle_gap(sample.a, b, 0, first);
  return sample;
}

/// Corners move along their chords but for `bend_m`. With normals n0, n1 at the ends the plane of
/// normal (1-t) n0 + t n1 has, per pair of corners, a height that is quadratic in t: its three
/// Bernstein coefficients bound it. Unit normals that differ little: the length in between is at
/// least |n0 + n1| / 2.
bool MeshPair::proven(const Sample& from, const Sample& to, const Triangle& b,
                      const TriangleGap& by, Wide bend_m, Wide allowed_m) const {
  const std::optional<WideVec> d0 = triangle_direction(from.a, b, by.direction);
  const std::optional<WideVec> d1 = triangle_direction(to.a, b, by.direction);
  if (!d0 || !d1) return false;
  const WideVec n0 = by.sign * *d0, n1 = by.sign * *d1;
  const Wide shortest = norm(n0 + n1) / 2;
  if (shortest < 0.5L) return false;
  const Wide least = bend_m - allowed_m * shortest;
  if (gap_along(from.a, b, n0) < least || gap_along(to.a, b, n1) < least) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      if ((dot(n0, to.a[i] - b[j]) + dot(n1, from.a[i] - b[j])) / 2 < least) return false;
    }
  }
  return true;
}

void MeshPair::pass(const StraightWay& way, std::uint32_t moving, std::uint32_t fixed,
                    Wide allowed_m, Wide resolution_m, MeshPassage& passage) const {
  const Triangle& b = fixed_[fixed];
  const Wide turn = norm(way.turn_rad), lever = lever_m_[moving];
  const Wide speed = norm(way.move_m) + lever * turn;
  const auto note = [&](const Sample& sample) {
    if (sample.gap.gap_m >= passage.gap_m) return;
    passage.gap_m = sample.gap.gap_m;
    passage.moving = moving_number_[moving];
    passage.fixed = fixed_number_[fixed];
  };
  struct Part {
    Sample from, to;
    int halvings;
  };
  std::vector<Part> parts;
  const Sample start = sampled(way, moving, b, 0, 0);
  note(start);
  parts.push_back({start, sampled(way, moving, b, 1, start.gap.direction), 0});
  note(parts.back().to);
  while (!parts.empty()) {
    const Part part = parts.back();
    parts.pop_back();
    const Sample &from = part.from, &to = part.to;
    if (std::min(from.gap.gap_m, to.gap.gap_m) < -allowed_m) return;
    const Wide share = to.at - from.at, length = speed * share;
    if ((from.gap.gap_m + to.gap.gap_m - length) / 2 >= -allowed_m) continue;
    const Wide bend = turn * share * turn * share * lever / 8;
    bool done = proven(from, to, b, from.gap, bend, allowed_m) ||
                proven(from, to, b, to.gap, bend, allowed_m);
    for (int k = 0; k < kTriangleDirections && !done; ++k) {
      done = proven(from, to, b, {0, k, 1}, bend, allowed_m) ||
             proven(from, to, b, {0, k, -1}, bend, allowed_m);
    }
    if (done) continue;
    if (length <= resolution_m || part.halvings >= kMostHalvings) {
      ++passage.unproven;
      continue;
    }
    const Sample middle = sampled(way, moving, b, (from.at + to.at) / 2, from.gap.direction);
    note(middle);
    parts.push_back({middle, to, part.halvings + 1});
    parts.push_back({from, middle, part.halvings + 1});
  }
}

MeshPassage MeshPair::passage(const StraightWay& way, Wide allowed_m, Wide resolution_m) const {
  MeshPassage passage;
  const OraclePose end = way.at(1);
  const Wide turn = norm(way.turn_rad);
  for (std::uint32_t i = 0; i < moving_.size(); ++i) {
    const Wide bend = turn * turn * lever_m_[i] / 8;
    Box box;
    box.include(placed(moving_[i], way.from), bend);
    box.include(placed(moving_[i], end), bend);
    near(box, [&](std::uint32_t j) { pass(way, i, j, allowed_m, resolution_m, passage); });
  }
  return passage;
}

}  // namespace haptic::sim
