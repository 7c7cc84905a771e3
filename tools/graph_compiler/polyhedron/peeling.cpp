// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/peeling.hpp"

#include <algorithm>
#include <cmath>

#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

// Least determinant of the unit normals at a corner, and least height over extent of the three
// corners that carry a plane: tried in turn, since the inverse amplifies the movement of what is
// placed later.
constexpr std::array<double, 3> kThresholds{0.1, 0.02, 1e-3};
constexpr std::size_t kMaxNamedCorners = 4;
constexpr double kFree = 1.0;  // condition of an element with at most one earlier neighbour

}  // namespace

Peeling::Peeling(const CornerPlaneGraph& graph, const RealiseRules& rules)
    : graph_(graph),
      order_(rules.order),
      corner_arcs_(graph.corners.size()),
      plane_arcs_(graph.planes.size()),
      corner_degree_(graph.corners.size(), 0),
      plane_degree_(graph.planes.size(), 0),
      corner_gone_(graph.corners.size(), false),
      plane_gone_(graph.planes.size(), false),
      condition_(graph.planes.size(), -1.0),
      left_(graph.corners.size() + graph.planes.size()) {
  const auto add = [&](const Arc& arc) {
    const auto id = static_cast<std::uint32_t>(arcs_.size());
    arcs_.push_back(arc);
    corner_arcs_[arc.corner].push_back(id);
    plane_arcs_[arc.plane].push_back(id);
    ++corner_degree_[arc.corner];
    ++plane_degree_[arc.plane];
  };
  std::vector<vec::Box> boxes(graph.planes.size());
  for (std::uint32_t c = 0; c < graph.corners.size(); ++c) {
    for (const std::uint32_t p : graph.corner_planes[c]) {
      add({c, p, false, 0.0, false});
      boxes[p].include(graph.corners[c]);
    }
  }
  for (const vec::Box& box : boxes)
    extent_.push_back(box.low[0] <= box.high[0] ? box.diagonal() : 0.0);
  if (rules.wishes) {
    for (const WishedIncidence& w : graph.wishes) add({w.corner, w.plane, true, w.distance, false});
  }
}

PlacementStep Peeling::neighbours(bool is_plane, std::uint32_t index) const {
  PlacementStep step;
  step.is_plane = is_plane;
  step.index = index;
  for (const std::uint32_t id : is_plane ? plane_arcs_[index] : corner_arcs_[index]) {
    const Arc& arc = arcs_[id];
    if (arc.dropped || (is_plane ? corner_gone_[arc.corner] : plane_gone_[arc.plane])) continue;
    step.earlier[step.earlier_count++] = is_plane ? arc.corner : arc.plane;
  }
  return step;
}

double Peeling::corner_condition(const PlacementStep& step) const {
  if (step.earlier_count <= 1) return kFree;
  const Point3& a = graph_.planes[step.earlier[0]].normal;
  const Point3& b = graph_.planes[step.earlier[1]].normal;
  const Point3 line = vec::cross(a, b);
  if (step.earlier_count == 2) return vec::norm(line);
  return std::abs(vec::dot(line, graph_.planes[step.earlier[2]].normal));
}

double Peeling::plane_condition(const PlacementStep& step) const {
  if (step.earlier_count <= 1) return kFree;
  const double extent = extent_[step.index];
  if (!(extent > 0.0)) return kFree;
  const Point3& a = graph_.corners[step.earlier[0]];
  const Point3& b = graph_.corners[step.earlier[1]];
  const double ab = vec::distance(a, b);
  if (step.earlier_count == 2) return ab / extent;
  const Point3& c = graph_.corners[step.earlier[2]];
  const double longest = std::max({ab, vec::distance(a, c), vec::distance(b, c)});
  if (!(longest > 0.0)) return 0.0;
  return vec::norm(vec::cross(vec::sub(b, a), vec::sub(c, a))) / longest / extent;
}

void Peeling::remove(const PlacementStep& step) {
  steps_.push_back(step);
  --left_;
  if (step.is_plane) {
    plane_gone_[step.index] = true;
    for (std::size_t k = 0; k < step.earlier_count; ++k) {
      --corner_degree_[step.earlier[k]];
      queue_.push_back(step.earlier[k]);
    }
  } else {
    corner_gone_[step.index] = true;
    for (std::size_t k = 0; k < step.earlier_count; ++k) {
      --plane_degree_[step.earlier[k]];
      condition_[step.earlier[k]] = -1.0;
    }
  }
}

void Peeling::queue_all_corners() {
  queue_.clear();
  for (std::uint32_t c = 0; c < corner_gone_.size(); ++c) {
    if (!corner_gone_[c]) queue_.push_back(c);
  }
}

bool Peeling::remove_corners(double threshold) {
  bool removed = false;
  while (!queue_.empty()) {
    const std::uint32_t c = queue_.front();
    queue_.pop_front();
    if (corner_gone_[c] || corner_degree_[c] > 3) continue;
    const PlacementStep step = neighbours(false, c);
    if (corner_condition(step) <= threshold) continue;
    remove(step);
    removed = true;
  }
  return removed;
}

bool Peeling::remove_plane(double threshold) {
  double best = threshold;
  std::size_t found = plane_gone_.size();
  for (std::uint32_t p = 0; p < plane_gone_.size(); ++p) {
    if (plane_gone_[p] || plane_degree_[p] > 3) continue;
    if (condition_[p] < 0.0) condition_[p] = plane_condition(neighbours(true, p));
    if (condition_[p] > best) {
      best = condition_[p];
      found = p;
    }
  }
  if (found == plane_gone_.size()) return false;
  remove(neighbours(true, static_cast<std::uint32_t>(found)));
  return true;
}

/// All planes that can go: they share no arcs, so none waits for another.
bool Peeling::remove_layer(double threshold) {
  bool removed = false;
  for (std::uint32_t p = 0; p < plane_gone_.size(); ++p) {
    if (plane_gone_[p] || plane_degree_[p] > 3) continue;
    const PlacementStep step = neighbours(true, p);
    if (plane_condition(step) <= threshold) continue;
    remove(step);
    removed = true;
  }
  return removed;
}

bool Peeling::drop_wish() {
  Arc* worst = nullptr;
  for (Arc& arc : arcs_) {
    if (!arc.wish || arc.dropped || corner_gone_[arc.corner] || plane_gone_[arc.plane]) continue;
    if (worst == nullptr || arc.distance > worst->distance) worst = &arc;
  }
  if (worst == nullptr) return false;
  worst->dropped = true;
  --corner_degree_[worst->corner];
  --plane_degree_[worst->plane];
  condition_[worst->plane] = -1.0;
  return true;
}

bool Peeling::run() {
  std::size_t level = 0;
  queue_all_corners();
  while (left_ > 0) {
    if (remove_corners(kThresholds[level]) || remove_planes(kThresholds[level])) {
      if (level > 0) queue_all_corners();
      level = 0;
      continue;
    }
    if (++level == kThresholds.size()) {
      if (!drop_wish()) return false;
      level = 0;
    }
    queue_all_corners();
  }
  return true;
}

std::size_t Peeling::wishes_kept() const {
  return static_cast<std::size_t>(std::count_if(
      arcs_.begin(), arcs_.end(), [](const Arc& arc) { return arc.wish && !arc.dropped; }));
}

std::vector<std::uint32_t> Peeling::corners_left() const {
  std::vector<std::uint32_t> left;
  for (std::uint32_t c = 0; c < corner_gone_.size() && left.size() < kMaxNamedCorners; ++c) {
    if (!corner_gone_[c]) left.push_back(c);
  }
  return left;
}

}  // namespace haptic::tools
