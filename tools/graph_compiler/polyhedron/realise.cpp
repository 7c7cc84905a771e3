// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/realise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

// Order in which corners and planes can be placed such that each meets at most three earlier ones,
// in good condition (METHOD section 3, "Corners on more than three planes").

/// One element to be placed: a plane or a corner, and the neighbours that stand by then.
struct PlacementStep {
  bool is_plane = false;
  std::uint32_t index = 0;
  std::array<std::uint32_t, 3> earlier{};  ///< neighbours placed before it
  std::size_t earlier_count = 0;
};

/// Order in which the nodes of the graph can be removed with at most three well-conditioned
/// neighbours left.
class Peeling {
 public:
  Peeling(const CornerPlaneGraph& graph, const RealiseRules& rules);
  /// False when stuck; `left` then counts and names what remains.
  bool run();
  [[nodiscard]] const std::vector<PlacementStep>& steps() const { return steps_; }
  [[nodiscard]] std::size_t wishes_kept() const;
  [[nodiscard]] std::size_t left() const { return left_; }
  [[nodiscard]] std::vector<std::uint32_t> corners_left() const;

 private:
  struct Arc {
    std::uint32_t corner = 0;
    std::uint32_t plane = 0;
    bool wish = false;
    double distance = 0.0;  // of a wish
    bool dropped = false;
  };

  [[nodiscard]] PlacementStep neighbours(bool is_plane, std::uint32_t index) const;
  [[nodiscard]] double corner_condition(const PlacementStep& step) const;
  [[nodiscard]] double plane_condition(const PlacementStep& step) const;
  bool remove_corners(double threshold);
  bool remove_plane(double threshold);
  bool remove_layer(double threshold);
  bool remove_planes(double threshold) {
    return order_ == PeelOrder::kLayers ? remove_layer(threshold) : remove_plane(threshold);
  }
  bool drop_wish();
  void remove(const PlacementStep& step);
  void queue_all_corners();

  const CornerPlaneGraph& graph_;
  PeelOrder order_;
  std::vector<Arc> arcs_;
  std::vector<std::vector<std::uint32_t>> corner_arcs_, plane_arcs_;
  std::vector<std::size_t> corner_degree_, plane_degree_;
  std::vector<bool> corner_gone_, plane_gone_;
  std::vector<double> extent_;     // per plane: size of the polygon that its corners span
  std::vector<double> condition_;  // per plane, cached; negative: stale
  std::deque<std::uint32_t> queue_;
  std::vector<PlacementStep> steps_;
  std::size_t left_ = 0;
};

// Least determinant of the unit normals at a corner, and least height over extent of the three
// corners that carry a plane: tried in turn, since the inverse amplifies the movement of what is
// placed later.
constexpr std::array<double, 3> kThresholds{0.1, 0.02, 1e-3};
constexpr std::size_t kMaxNamedCorners = 4;
constexpr double kFree = 1.0;  // condition of an element with at most one earlier neighbour

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

constexpr int kOffsetBits = 4;  // offsets are finer than normals: 2^-36 against 2^-32

std::size_t largest_component(const Point3& v) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (std::abs(v[i]) > std::abs(v[best])) best = i;
  }
  return best;
}

/// Nearest multiple of 2^-bits, halves upwards.
Rational to_grid(const Rational& value, int bits) {
  const Integer grid = Integer(1) << static_cast<unsigned>(bits);
  const Integer top = Integer(2) * Integer(numerator(value)) * grid + Integer(denominator(value));
  const Integer below = Integer(2) * Integer(denominator(value));
  Integer whole = top / below;  // truncated
  if (top < 0 && whole * below != top) whole -= 1;
  return Rational(whole, grid);
}

/// Coordinates and offsets; bits = 0 keeps the double.
Rational free_coordinate(double x, int bits) {
  return bits == 0 ? Rational(x) : to_grid(Rational(x), bits);
}

/// Placement in the reverse order of the peeling: each element meets at most three earlier ones.
class Placement {
 public:
  Placement(const CornerPlaneGraph& graph, const RealiseRules& rules, Realisation& out)
      : graph_(graph), rules_(rules), out_(out) {
    out.corners.resize(graph.corners.size());
    out.normals.resize(graph.planes.size());
    out.offsets.resize(graph.planes.size());
  }
  /// kStuck where earlier elements have drifted into a degenerate position.
  RealiseOutcome place(const PlacementStep& step) {
    if (!(step.is_plane ? place_plane(step) : place_corner(step))) return RealiseOutcome::kStuck;
    std::size_t bits = 0;
    const Rational3& coordinates =
        step.is_plane ? out_.normals[step.index] : out_.corners[step.index];
    for (const Rational& q : coordinates) bits = std::max(bits, bit_size(q));
    if (step.is_plane) bits = std::max(bits, bit_size(out_.offsets[step.index]));
    out_.largest_bits = std::max(out_.largest_bits, bits);
    return bits <= rules_.max_bits ? RealiseOutcome::kDone : RealiseOutcome::kTooManyBits;
  }

 private:
  bool place_plane(const PlacementStep& step);
  bool place_corner(const PlacementStep& step);
  void wanted_normal(const WantedPlane& wanted, Rational3& n, Rational& divisor) const;

  const CornerPlaneGraph& graph_;
  const RealiseRules& rules_;
  Realisation& out_;
};

/// The wanted normal over its largest component, on the grid; divisor: that component.
void Placement::wanted_normal(const WantedPlane& wanted, Rational3& n, Rational& divisor) const {
  const std::size_t main = largest_component(wanted.normal);
  divisor = Rational(wanted.normal[main]) + Rational(wanted.normal_tail[main]);
  for (std::size_t i = 0; i < 3; ++i) {
    if (i == main) {
      n[i] = Rational(1);
    } else {
      n[i] = to_grid((Rational(wanted.normal[i]) + Rational(wanted.normal_tail[i])) / divisor,
                     rules_.normal_bits);
    }
  }
}

bool Placement::place_plane(const PlacementStep& step) {
  const WantedPlane& wanted = graph_.planes[step.index];
  Rational3& n = out_.normals[step.index];
  Rational& d = out_.offsets[step.index];
  const auto corner = [&](std::size_t k) -> const Rational3& {
    return out_.corners[step.earlier[k]];
  };
  if (step.earlier_count == 3) {
    return plane_through(corner(0), corner(1), corner(2), n, d);
  }
  Rational divisor;
  wanted_normal(wanted, n, divisor);
  if (step.earlier_count == 0) {
    d = Rational(wanted.offset);
    if (wanted.axis < 0) {
      d = to_grid((d + Rational(wanted.offset_tail)) / divisor, rules_.normal_bits + kOffsetBits);
    }
    return true;
  }
  if (step.earlier_count == 2) {
    const Rational3 e = subtract(corner(1), corner(0));
    const std::size_t i = largest_component({to_double(e[0]), to_double(e[1]), to_double(e[2])});
    if (e[i] == 0) return false;
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    n[i] = -(n[j] * e[j] + n[k] * e[k]) / e[i];
  }
  d = dot(n, corner(0));
  return true;
}

bool Placement::place_corner(const PlacementStep& step) {
  const Point3& wanted = graph_.corners[step.index];
  Rational3& x = out_.corners[step.index];
  const auto n = [&](std::size_t k) -> const Rational3& { return out_.normals[step.earlier[k]]; };
  const auto d = [&](std::size_t k) -> const Rational& { return out_.offsets[step.earlier[k]]; };
  if (step.earlier_count < 3) {
    for (std::size_t i = 0; i < 3; ++i) x[i] = free_coordinate(wanted[i], rules_.position_bits);
  }
  if (step.earlier_count == 0) return true;
  if (step.earlier_count == 1) {
    const std::size_t i = largest_component(graph_.planes[step.earlier[0]].normal);
    if (n(0)[i] == 0) return false;
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    x[i] = (d(0) - n(0)[j] * x[j] - n(0)[k] * x[k]) / n(0)[i];
    return true;
  }
  const Rational3 line = cross(n(0), n(1));
  if (step.earlier_count == 2) {
    // The coordinate along the line is kept, the two others follow from the planes.
    const std::size_t i =
        largest_component({to_double(line[0]), to_double(line[1]), to_double(line[2])});
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    if (line[i] == 0) return false;
    const Rational r0 = d(0) - n(0)[i] * x[i];
    const Rational r1 = d(1) - n(1)[i] * x[i];
    x[j] = (r0 * n(1)[k] - r1 * n(0)[k]) / line[i];
    x[k] = (n(0)[j] * r1 - n(1)[j] * r0) / line[i];
    return true;
  }
  const Rational det = dot(line, n(2));
  if (det == 0) return false;
  const Rational3 a = cross(n(1), n(2)), b = cross(n(2), n(0));
  for (std::size_t i = 0; i < 3; ++i) x[i] = (d(0) * a[i] + d(1) * b[i] + d(2) * line[i]) / det;
  return true;
}

}  // namespace

Realisation realise(const CornerPlaneGraph& graph, const RealiseRules& rules) {
  Realisation out;
  Peeling peeling(graph, rules);
  if (!peeling.run()) {
    out.outcome = RealiseOutcome::kStuck;
    out.stuck_count = peeling.left();
    out.failed_corners = peeling.corners_left();
    return out;
  }
  out.wishes_kept = peeling.wishes_kept();
  Placement placement(graph, rules, out);
  for (auto step = peeling.steps().rbegin(); step != peeling.steps().rend(); ++step) {
    out.outcome = placement.place(*step);
    if (out.outcome == RealiseOutcome::kDone) continue;
    out.stuck_count = 1;
    if (!step->is_plane) {
      out.failed_corners.push_back(step->index);
    } else if (step->earlier_count > 0) {
      out.failed_corners.push_back(step->earlier[0]);
    }
    return out;
  }
  return out;
}

}  // namespace haptic::tools
