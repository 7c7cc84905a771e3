// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/exact.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "tools/common/split_mix.hpp"

namespace haptic::tools {

namespace {

// Filter of `side`: six roundings of 2^-53 relative to the sum of magnitudes bound the error of the
// double sum; 1.2e-15 is almost twice that. The absolute term covers products that underflow.
constexpr double kFilterRelative = 1.2e-15;
// Filter of `turn`: ten roundings at most, by the same reasoning.
constexpr double kTurnRelative = 2.0e-15;
constexpr double kFilterAbsolute = 1.0e-280;

// Work units of METHOD section 2.
constexpr double kFilteredSignWork = 1.0;
constexpr double kExactSignWork = 20.0;
constexpr double kNewPointWork = 200.0;

std::size_t integer_bits(const Integer& value) {
  if (value == 0) return 0;
  const Integer magnitude = abs(value);
  return static_cast<std::size_t>(msb(magnitude)) + 1;
}

std::size_t mix(std::size_t seed, std::uint64_t value) {
  return static_cast<std::size_t>(
      mixed(static_cast<std::uint64_t>(seed) ^ (value + kSplitMixStep)));
}

std::size_t mix(std::size_t seed, double value) {
  return mix(seed, std::bit_cast<std::uint64_t>(value == 0.0 ? 0.0 : value));
}

Integer shifted(const Integer& value, long shift) {
  if (shift >= 0) return value << static_cast<unsigned>(shift);
  return value >> static_cast<unsigned>(-shift);
}

// (mantissa + something in (0, 1) if sticky) * 2^exponent to the nearest double. `mantissa` has 55
// bits or more.
double round_mantissa(Integer mantissa, bool sticky, long exponent) {
  const long extra = static_cast<long>(integer_bits(mantissa)) - 54;
  const Integer kept = shifted(mantissa, -extra);
  sticky = sticky || shifted(kept, extra) != mantissa;
  auto bits = static_cast<std::uint64_t>(kept);
  // 54 bits: the last is the half; ties go to the even neighbour.
  const bool half = (bits & 1U) != 0;
  bits >>= 1U;
  if (half && (sticky || (bits & 1U) != 0)) ++bits;
  const long power = exponent + extra + 1;
  if (power > 2000) return std::numeric_limits<double>::infinity();
  if (power < -2000) return 0.0;
  return std::ldexp(static_cast<double>(bits), static_cast<int>(power));
}

// Over one common denominator; fourth receives what plays the role of the homogeneous coordinate.
Integer common_denominator(const Rational* values, std::size_t count) {
  Integer common = 1;
  for (std::size_t i = 0; i < count; ++i) {
    const Integer d = denominator(values[i]);
    if (d != 1 && common % d != 0) common = lcm(common, d);
  }
  return common;
}

Integer scaled_to(const Rational& value, const Integer& common) {
  return numerator(value) * (common / denominator(value));
}

bool same_plane(const ExactPlane& plane, const Rational3& n, const Rational& d, int& sign) {
  std::size_t k = 0;
  while (plane.n[k] == 0) ++k;
  if (n[k] == 0) return false;
  const Rational ratio = n[k] / plane.n[k];
  for (std::size_t i = 0; i < 3; ++i) {
    if (n[i] != ratio * plane.n[i]) return false;
  }
  if (d != ratio * plane.d) return false;
  sign = ratio > 0 ? 1 : -1;
  return true;
}

// Hash of a plane that does not depend on the scale or sign of its coefficients.
std::size_t plane_hash(const Rational3& n, const Rational& d) {
  std::size_t k = 0;
  while (k < 2 && n[k] == 0) ++k;
  std::size_t hash = k;
  for (std::size_t i = 0; i < 3; ++i) hash = mix(hash, to_double(n[i] / n[k]));
  return mix(hash, to_double(d / n[k]));
}

}  // namespace

std::size_t bit_size(const Rational& q) {
  return integer_bits(numerator(q)) + integer_bits(denominator(q));
}

double to_double(const Rational& q) {
  if (q == 0) return 0.0;
  const Integer n = abs(Integer(numerator(q)));
  const Integer d = denominator(q);
  // A quotient of 63 to 65 bits, remainder as the sticky bit.
  const long shift = 64 - static_cast<long>(integer_bits(n)) + static_cast<long>(integer_bits(d));
  const Integer scaled_n = shift > 0 ? shifted(n, shift) : n;
  const Integer scaled_d = shift < 0 ? shifted(d, -shift) : d;
  const Integer quotient = scaled_n / scaled_d;
  const bool sticky = quotient * scaled_d != scaled_n;
  const double magnitude = round_mantissa(quotient, sticky, -shift);
  return q < 0 ? -magnitude : magnitude;
}

double over_root(const Rational& v, const Rational& square) {
  if (v == 0) return 0.0;
  // sqrt(v^2 / square) by the integer root of a 128-bit quotient.
  const Rational ratio = v * v / square;
  const Integer n = numerator(ratio);
  const Integer d = denominator(ratio);
  long shift = 128 - static_cast<long>(integer_bits(n)) + static_cast<long>(integer_bits(d));
  if (shift % 2 != 0) ++shift;
  const Integer scaled_n = shift > 0 ? shifted(n, shift) : n;
  const Integer scaled_d = shift < 0 ? shifted(d, -shift) : d;
  const Integer quotient = scaled_n / scaled_d;
  const Integer root = sqrt(quotient);
  const bool sticky = root * root != quotient || quotient * scaled_d != scaled_n;
  const double magnitude = round_mantissa(root, sticky, -shift / 2);
  return v < 0 ? -magnitude : magnitude;
}

Rational dot(const Rational3& a, const Rational3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Rational3 cross(const Rational3& a, const Rational3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Rational3 subtract(const Rational3& a, const Rational3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

std::size_t ExactWorld::CutKeyHash::operator()(const CutKey& key) const {
  return mix(mix(key.plane, std::uint64_t{key.u} << 32U | key.v), std::uint64_t{key.plane});
}

void ExactWorld::charge(double units) {
  work += units;
  if (work > work_limit) {
    throw WorkLimitReached("the work limit of " +
                           std::to_string(static_cast<std::uint64_t>(work_limit)) +
                           " units was reached");
  }
}

std::uint32_t ExactWorld::add_plane(const Rational3& n, const Rational& d) {
  const Rational square = dot(n, n);
  if (square == 0) throw std::logic_error("ExactWorld::add_plane: zero normal");
  ExactPlane plane;
  plane.n = n;
  plane.d = d;
  for (std::size_t i = 0; i < 3; ++i) {
    plane.n_approx[i] = to_double(n[i]);
    plane.unit_normal[i] = over_root(n[i], square);
  }
  plane.d_approx = to_double(d);
  plane.unit_offset = over_root(d, square);
  const auto index = static_cast<std::uint32_t>(planes.size());
  planes.push_back(std::move(plane));
  plane_lookup_.emplace(plane_hash(n, d), index);
  return index;
}

std::uint32_t ExactWorld::find_or_add_plane(const Rational3& n, const Rational& d, int& sign) {
  if (n[0] == 0 && n[1] == 0 && n[2] == 0) {
    throw std::logic_error("ExactWorld::find_or_add_plane: zero normal");
  }
  const auto [first, last] = plane_lookup_.equal_range(plane_hash(n, d));
  for (auto it = first; it != last; ++it) {
    if (same_plane(planes[it->second], n, d, sign)) return it->second;
  }
  sign = 1;
  return add_plane(n, d);
}

std::uint32_t ExactWorld::find_or_add_vertex(const Rational3& x) {
  ExactVertex vertex;
  std::size_t hash = 3;
  for (std::size_t i = 0; i < 3; ++i) {
    vertex.x_approx[i] = to_double(x[i]);
    hash = mix(hash, vertex.x_approx[i]);
  }
  const auto [first, last] = vertex_lookup_.equal_range(hash);
  for (auto it = first; it != last; ++it) {
    if (vertices[it->second].x == x) return it->second;
  }
  std::size_t bits = 0;
  for (const Rational& coordinate : x) bits = std::max(bits, bit_size(coordinate));
  if (bits > max_coordinate_bits) {
    throw WorkLimitReached("a coordinate needs " + std::to_string(bits) + " bits, limit " +
                           std::to_string(max_coordinate_bits));
  }
  charge(kNewPointWork + static_cast<double>(bits));
  vertex.x = x;
  const auto index = static_cast<std::uint32_t>(vertices.size());
  vertices.push_back(std::move(vertex));
  source_vertex.push_back(-1);
  vertex_lookup_.emplace(hash, index);
  return index;
}

void ExactWorld::extend_homogeneous() {
  for (std::size_t p = plane_forms_.size(); p < planes.size(); ++p) {
    const ExactPlane& plane = planes[p];
    const std::array<Rational, 4> all{plane.n[0], plane.n[1], plane.n[2], plane.d};
    const Integer common = common_denominator(all.data(), 4);
    Homogeneous form;
    for (std::size_t i = 0; i < 3; ++i) form.x[i] = scaled_to(plane.n[i], common);
    form.w = scaled_to(plane.d, common);
    Integer divisor = gcd(gcd(form.x[0], form.x[1]), gcd(form.x[2], form.w));
    for (Integer& x : form.x) x /= divisor;
    form.w /= divisor;
    form.bits = integer_bits(form.w);
    for (const Integer& x : form.x) form.bits = std::max(form.bits, integer_bits(x));
    plane_forms_.push_back(std::move(form));
  }
  for (std::size_t v = vertex_forms_.size(); v < vertices.size(); ++v) {
    const Rational3& x = vertices[v].x;
    Homogeneous form;
    form.w = common_denominator(x.data(), 3);
    for (std::size_t i = 0; i < 3; ++i) form.x[i] = scaled_to(x[i], form.w);
    form.bits = integer_bits(form.w);
    for (const Integer& c : form.x) form.bits = std::max(form.bits, integer_bits(c));
    vertex_forms_.push_back(std::move(form));
  }
}

Integer ExactWorld::homogeneous_side(std::uint32_t v, std::uint32_t p) const {
  const Homogeneous& plane = plane_forms_[p];
  const Homogeneous& vertex = vertex_forms_[v];
  return plane.x[0] * vertex.x[0] + plane.x[1] * vertex.x[1] + plane.x[2] * vertex.x[2] -
         plane.w * vertex.w;
}

int ExactWorld::side(std::uint32_t v, std::uint32_t p) {
  const ExactPlane& plane = planes[p];
  const std::array<double, 3>& x = vertices[v].x_approx;
  const double a = plane.n_approx[0] * x[0];
  const double b = plane.n_approx[1] * x[1];
  const double c = plane.n_approx[2] * x[2];
  const double s = a + b + c - plane.d_approx;
  const double bound = std::abs(a) + std::abs(b) + std::abs(c) + std::abs(plane.d_approx);
  charge(kFilteredSignWork);
  if (std::abs(s) > kFilterRelative * bound + kFilterAbsolute && std::isfinite(s)) {
    return s > 0.0 ? 1 : -1;
  }
  const std::uint64_t key = std::uint64_t{v} << 32U | p;
  if (const auto known = exact_sides_.find(key); known != exact_sides_.end()) return known->second;
  if (vertex_forms_.size() <= v || plane_forms_.size() <= p) extend_homogeneous();
  charge(kExactSignWork + static_cast<double>(vertex_forms_[v].bits + plane_forms_[p].bits) / 8.0);
  const Integer exact = homogeneous_side(v, p);
  const int sign = exact > 0 ? 1 : (exact < 0 ? -1 : 0);
  exact_sides_.emplace(key, static_cast<std::int8_t>(sign));
  return sign;
}

int ExactWorld::turn(std::uint32_t p, std::uint32_t q, std::uint32_t u, std::uint32_t v) {
  if (p == q || u == v) return 0;
  charge(kFilteredSignWork);
  const std::array<double, 3>& n = planes[p].n_approx;
  const std::array<double, 3>& m = planes[q].n_approx;
  const std::array<double, 3>& a = vertices[u].x_approx;
  const std::array<double, 3>& b = vertices[v].x_approx;
  double sum = 0.0;
  double bound = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const std::size_t k = (i + 2) % 3;
    const double first = n[j] * m[k];
    const double second = n[k] * m[j];
    sum += (first - second) * (b[i] - a[i]);
    bound += (std::abs(first) + std::abs(second)) * (std::abs(a[i]) + std::abs(b[i]));
  }
  if (std::abs(sum) > kTurnRelative * bound + kFilterAbsolute && std::isfinite(sum)) {
    return sum > 0.0 ? 1 : -1;
  }
  extend_homogeneous();
  const Homogeneous& hp = plane_forms_[p];
  const Homogeneous& hq = plane_forms_[q];
  const Homogeneous& hu = vertex_forms_[u];
  const Homogeneous& hv = vertex_forms_[v];
  charge(kExactSignWork + static_cast<double>(hp.bits + hq.bits + hu.bits + hv.bits) / 4.0);
  Integer exact = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const std::size_t k = (i + 2) % 3;
    exact += (hp.x[j] * hq.x[k] - hp.x[k] * hq.x[j]) * (hv.x[i] * hu.w - hu.x[i] * hv.w);
  }
  return exact > 0 ? 1 : (exact < 0 ? -1 : 0);
}

std::uint32_t ExactWorld::cut_edge(std::uint32_t u, std::uint32_t v, std::uint32_t p) {
  if (u > v) std::swap(u, v);
  const CutKey key{u, v, p};
  if (const auto known = cut_cache_.find(key); known != cut_cache_.end()) return known->second;
  extend_homogeneous();
  // The point of the line U, V on the plane N: (N.V) U - (N.U) V, projectively.
  const Integer at_u = homogeneous_side(u, p);
  const Integer at_v = homogeneous_side(v, p);
  const Homogeneous& form_u = vertex_forms_[u];
  const Homogeneous& form_v = vertex_forms_[v];
  // Positive denominators only: boost::rational refuses negative ones of an unbounded integer type.
  const Integer at = at_u < 0 ? at_v : Integer(-at_v);
  const Integer other = at_u < 0 ? at_u : Integer(-at_u);
  const Integer w = at * form_u.w - other * form_v.w;
  if (w <= 0) throw std::logic_error("ExactWorld::cut_edge: the edge does not cross the plane");
  Rational3 x;
  for (std::size_t i = 0; i < 3; ++i) {
    x[i] = Rational(Integer(at * form_u.x[i] - other * form_v.x[i]), w);
  }
  const std::uint32_t index = find_or_add_vertex(x);
  cut_cache_.emplace(key, index);
  return index;
}

}  // namespace haptic::tools
