// SPDX-License-Identifier: Apache-2.0
#include "host_sim/oracle/triangle_pair.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace haptic::sim {
namespace {

constexpr Wide kRoundoff = std::numeric_limits<Wide>::epsilon();
/// Share of the sum of the products' sizes, which is more than the determinants below can be off.
constexpr Wide kFilter = 16 * kRoundoff;
/// Edges whose angle has a smaller sine give no direction that the faces do not give.
constexpr Wide kLeastSine = 1e-14L;

/// A sum held as parts that do not overlap, the largest last: adding loses nothing (Shewchuk,
/// Adaptive precision floating-point arithmetic, 1997).
class ExactSum {
 public:
  void add(Wide term) {
    std::size_t kept = 0;
    for (const Wide part : parts_) {
      const Wide sum = term + part, back = sum - term;
      const Wide lost = (term - (sum - back)) + (part - back);
      if (lost != 0) parts_[kept++] = lost;
      term = sum;
    }
    parts_.resize(kept);
    if (term != 0) parts_.push_back(term);
  }
  void add_product(Wide a, Wide b, Wide sign) {
    const Wide high = a * b, low = std::fma(a, b, -high);
    add(sign * high);
    add(sign * low);
  }
  void add_product(Wide a, Wide b, Wide c, Wide sign) {
    const Wide high = a * b, low = std::fma(a, b, -high);
    add_product(high, c, sign);
    add_product(low, c, sign);
  }
  [[nodiscard]] int sign() const {
    if (parts_.empty()) return 0;
    return parts_.back() > 0 ? 1 : -1;
  }

 private:
  std::vector<Wide> parts_;
};

void add_determinant(ExactSum& sum, const WideVec& a, const WideVec& b, const WideVec& c,
                     Wide sign) {
  sum.add_product(a.x, b.y, c.z, sign);
  sum.add_product(a.y, b.z, c.x, sign);
  sum.add_product(a.z, b.x, c.y, sign);
  sum.add_product(a.z, b.y, c.x, -sign);
  sum.add_product(a.x, b.z, c.y, -sign);
  sum.add_product(a.y, b.x, c.z, -sign);
}

int sign_of(Wide value) { return value > 0 ? 1 : value < 0 ? -1 : 0; }

/// The two coordinates that are left when axis `drop` is not looked at.
std::array<Wide, 2> flat(const WideVec& v, int drop) {
  if (drop == 0) return {v.y, v.z};
  if (drop == 1) return {v.z, v.x};
  return {v.x, v.y};
}

/// Exact sign of the turn a, b, c seen along an axis.
int turn_sign(const WideVec& a, const WideVec& b, const WideVec& c, int drop) {
  const auto [ax, ay] = flat(a, drop);
  const auto [bx, by] = flat(b, drop);
  const auto [cx, cy] = flat(c, drop);
  const Wide left = (bx - ax) * (cy - ay), right = (by - ay) * (cx - ax);
  if (std::abs(left - right) > kFilter * (std::abs(left) + std::abs(right))) {
    return sign_of(left - right);
  }
  ExactSum sum;
  sum.add_product(bx, cy, 1);
  sum.add_product(bx, ay, -1);
  sum.add_product(ax, cy, -1);
  sum.add_product(by, cx, -1);
  sum.add_product(by, ax, 1);
  sum.add_product(ay, cx, 1);
  return sum.sign();
}

/// An axis along which the triangle has an area; none: -1.
int clear_axis(const Triangle& t) {
  for (int drop = 0; drop < 3; ++drop) {
    if (turn_sign(t[0], t[1], t[2], drop) != 0) return drop;
  }
  return -1;
}

bool within(const WideVec& p, const Triangle& t, int drop) {
  const int s0 = turn_sign(t[0], t[1], p, drop), s1 = turn_sign(t[1], t[2], p, drop),
            s2 = turn_sign(t[2], t[0], p, drop);
  return (s0 >= 0 && s1 >= 0 && s2 >= 0) || (s0 <= 0 && s1 <= 0 && s2 <= 0);
}

/// p, q, r on a line: whether r lies between p and q.
bool between(const WideVec& p, const WideVec& q, const WideVec& r, int drop) {
  const auto a = flat(p, drop), b = flat(q, drop), c = flat(r, drop);
  for (std::size_t k = 0; k < 2; ++k) {
    if (c[k] < std::min(a[k], b[k]) || c[k] > std::max(a[k], b[k])) return false;
  }
  return true;
}

bool flat_segments_meet(const WideVec& p, const WideVec& q, const WideVec& r, const WideVec& s,
                        int drop) {
  const int pr = turn_sign(p, q, r, drop), ps = turn_sign(p, q, s, drop);
  const int rp = turn_sign(r, s, p, drop), rq = turn_sign(r, s, q, drop);
  if (pr * ps < 0 && rp * rq < 0) return true;
  return (pr == 0 && between(p, q, r, drop)) || (ps == 0 && between(p, q, s, drop)) ||
         (rp == 0 && between(r, s, p, drop)) || (rq == 0 && between(r, s, q, drop));
}

bool segment_meets(const WideVec& p, const WideVec& q, const Triangle& t) {
  const int sp = volume_sign(t[0], t[1], t[2], p), sq = volume_sign(t[0], t[1], t[2], q);
  if (sp * sq > 0) return false;
  if (sp == 0 && sq == 0) {
    const int drop = clear_axis(t);
    if (within(p, t, drop) || within(q, t, drop)) return true;
    for (std::size_t k = 0; k < 3; ++k) {
      if (flat_segments_meet(p, q, t[k], t[(k + 1) % 3], drop)) return true;
    }
    return false;
  }
  const int s0 = volume_sign(p, q, t[0], t[1]), s1 = volume_sign(p, q, t[1], t[2]),
            s2 = volume_sign(p, q, t[2], t[0]);
  return (s0 >= 0 && s1 >= 0 && s2 >= 0) || (s0 <= 0 && s1 <= 0 && s2 <= 0);
}

WideVec normal_of(const Triangle& t) { return cross(t[1] - t[0], t[2] - t[0]); }
WideVec edge_of(const Triangle& t, std::size_t k) { return t[(k + 1) % 3] - t[k]; }

/// The range of a triangle along a direction.
struct Range {
  Wide low, high;
};
Range range_of(const Triangle& t, const WideVec& n) {
  const Wide h0 = dot(n, t[0]), h1 = dot(n, t[1]), h2 = dot(n, t[2]);
  return {std::min({h0, h1, h2}), std::max({h0, h1, h2})};
}

Wide segment_distance(const WideVec& p, const WideVec& u, const WideVec& q, const WideVec& v) {
  // Smallest |p + s u - q - t v| with s and t in [0, 1]: the inside of the square, else its sides.
  const WideVec w = p - q;
  const Wide uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
  const auto at = [&](Wide s, Wide t) { return norm(w + s * u - t * v); };
  const auto bounded = [](Wide x) { return std::clamp(x, Wide{0}, Wide{1}); };
  Wide best = std::min({at(0, bounded(vw / vv)), at(1, bounded((vw + uv) / vv)),
                        at(bounded(-uw / uu), 0), at(bounded((uv - uw) / uu), 1)});
  const Wide square = uu * vv - uv * uv;
  if (square > kLeastSine * kLeastSine * uu * vv) {
    const Wide s = (uv * vw - vv * uw) / square, t = (uu * vw - uv * uw) / square;
    if (s > 0 && s < 1 && t > 0 && t < 1) best = std::min(best, at(s, t));
  }
  return best;
}

/// Distance to the inside of the triangle's plane region; infinite where the foot lies outside.
Wide foot_distance(const WideVec& p, const Triangle& t) {
  const WideVec n = normal_of(t);
  for (std::size_t k = 0; k < 3; ++k) {
    if (dot(cross(n, edge_of(t, k)), p - t[k]) < 0) return std::numeric_limits<Wide>::infinity();
  }
  return std::abs(dot(n, p - t[0])) / norm(n);
}

}  // namespace

int volume_sign(const WideVec& a, const WideVec& b, const WideVec& c, const WideVec& d) {
  const WideVec u = a - d, v = b - d, w = c - d;
  const Wide t[6] = {u.x * v.y * w.z, u.y * v.z * w.x, u.z * v.x * w.y,
                     u.z * v.y * w.x, u.x * v.z * w.y, u.y * v.x * w.z};
  const Wide volume = (t[0] - t[3]) + (t[1] - t[4]) + (t[2] - t[5]);
  Wide size = 0;
  for (const Wide term : t) size += std::abs(term);
  if (std::abs(volume) > kFilter * size) return sign_of(volume);
  ExactSum sum;
  add_determinant(sum, a, b, c, 1);
  add_determinant(sum, d, b, c, -1);
  add_determinant(sum, a, d, c, -1);
  add_determinant(sum, a, b, d, -1);
  return sum.sign();
}

bool has_no_area(const Triangle& t) { return clear_axis(t) < 0; }

bool triangles_meet(const Triangle& a, const Triangle& b) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (segment_meets(a[k], a[(k + 1) % 3], b) || segment_meets(b[k], b[(k + 1) % 3], a)) {
      return true;
    }
  }
  return false;
}

Wide triangle_distance(const Triangle& a, const Triangle& b) {
  if (triangles_meet(a, b)) return 0;
  Wide best = std::numeric_limits<Wide>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    best = std::min({best, foot_distance(a[i], b), foot_distance(b[i], a)});
    for (std::size_t j = 0; j < 3; ++j) {
      best = std::min(best, segment_distance(a[i], edge_of(a, i), b[j], edge_of(b, j)));
    }
  }
  return best;
}

std::optional<WideVec> triangle_direction(const Triangle& a, const Triangle& b, int direction) {
  if (direction == 0) return unit(normal_of(a));
  if (direction == 1) return unit(normal_of(b));
  const auto number = static_cast<std::size_t>(direction) - 2;
  WideVec u, v;
  if (number < 9) {
    u = edge_of(a, number / 3);
    v = edge_of(b, number % 3);
  } else {
    const Triangle& t = number < 12 ? a : b;
    u = normal_of(t);
    v = edge_of(t, number % 3);
  }
  const WideVec n = cross(u, v);
  const Wide length = norm(n);
  if (!(length > kLeastSine * norm(u) * norm(v))) return std::nullopt;
  return (1 / length) * n;
}

Wide gap_along(const Triangle& a, const Triangle& b, const WideVec& normal) {
  return range_of(a, normal).low - range_of(b, normal).high;
}

TriangleGap triangle_gap(const Triangle& a, const Triangle& b, Wide enough_m, int first) {
  TriangleGap best;
  for (int k = 0; k < kTriangleDirections; ++k) {
    const int direction = (first + k) % kTriangleDirections;
    const std::optional<WideVec> n = triangle_direction(a, b, direction);
    if (!n) continue;
    const Range of_a = range_of(a, *n), of_b = range_of(b, *n);
    const Wide forth = of_a.low - of_b.high, back = of_b.low - of_a.high;
    const Wide gap = std::max(forth, back);
    if (!(gap > best.gap_m)) continue;
    best = {gap, direction, forth >= back ? 1.0L : -1.0L};
    if (gap >= enough_m) break;
  }
  return best;
}

}  // namespace haptic::sim
