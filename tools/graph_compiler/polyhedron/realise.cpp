// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/realise.hpp"

#include <algorithm>
#include <cmath>

#include "tools/graph_compiler/polyhedron/peeling.hpp"

namespace haptic::tools {
namespace {

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
