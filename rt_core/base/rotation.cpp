// SPDX-License-Identifier: Apache-2.0
// How the results stay within 2 ulp without libm:
// - The argument of sine and cosine is reduced by a multiple k of pi/2 (Cody and Waite). pi/2 is
//   cut into four parts of few enough bits that k times a part is exact for k <= 6367 (13 bits),
//   and a rounded tail; what the differences round off is kept by two_sum. That leaves the reduced
//   angle as an unevaluated sum hi + lo, accurate relative to itself even next to a multiple of
//   pi/2.
// - The polynomials are minimax in the relative error, found by a Remez exchange in 60-digit
//   arithmetic, one set per scalar, then rounded to it.
// - Where the rounding of an intermediate result would be seen (norm and angle of a large
//   rotation), it is carried as hi + lo too. Products are split after Veltkamp and Dekker: a fused
//   multiply-add is not on every target and would not give the same bits.
// This file relies on -ffp-contract=off and on the absence of -ffast-math.
// Worst errors seen over 9 to 30 million seeded arguments, in ulp, both scalars: sin 0.81, cos
// 0.82, atan2 1.48, exp 0.81 of one and 1.61 of its vector part, log 1.61.

#include "rt_core/base/rotation.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace haptic {
namespace {

template <typename S>
struct Constants;

// maybe_unused: one of the two sets serves a build.
// Ranges: sine and cosine |x| <= pi/4, arc tangent |u| <= tan(pi/8); z is the argument squared.
template <>
struct Constants<double> {
  // Four parts of pi/2 of 33 bits each, then the rounded rest.
  [[maybe_unused]] static constexpr double kHalfPi[5] = {0x1.921fb544p+0, 0x1.0b4611a6p-34,
                                                         0x1.3198a2ep-69, 0x1.b839a252p-104,
                                                         0x1.27044533e63a0p-142};
  // sin(x) = x + x z P(z), relative error 2^-57.9.
  [[maybe_unused]] static constexpr double kSin[6] = {
      -0.16666666666666630709,  0.0083333333333221132127,  -0.00019841269829585004938,
      2.7557313619743304191e-6, -2.5050747495807584799e-8, 1.5896214146227063533e-10};
  // cos(x) = 1 - z/2 + z^2 P(z), relative error 2^-63.9.
  [[maybe_unused]] static constexpr double kCos[6] = {
      0.041666666666666592876,   -0.0013888888888873048272, 0.00002480158728884649469,
      -2.7557314177755898612e-7, 2.0875700627757279565e-9,  -1.1358525187216695279e-11};
  // atan(u) = u + u z P(z), relative error 2^-59.4.
  [[maybe_unused]] static constexpr double kAtan[11] = {
      -0.33333333333333196041,  0.19999999999953206507,   -0.14285714280162129505,
      0.11111110781921686549,   -0.090908977182664785662, 0.076920595889293998466,
      -0.066630976999690994036, 0.058478480454645536366,  -0.050391386467338609928,
      0.038060796226136873308,  -0.017903539155760579344};
  // Multiples 0 to 4 of pi/4, rounded, and what the rounding lost.
  [[maybe_unused]] static constexpr double kQuarterPiHigh[5] = {
      0.0, 0x1.921fb54442d18p-1, 0x1.921fb54442d18p+0, 0x1.2d97c7f3321d2p+1, 0x1.921fb54442d18p+1};
  [[maybe_unused]] static constexpr double kQuarterPiLow[5] = {
      0.0, 0x1.1a62633145c07p-55, 0x1.1a62633145c07p-54, 0x1.a79394c9e8a0ap-54,
      0x1.1a62633145c07p-53};
  [[maybe_unused]] static constexpr double kSplitter =
      0x1.0p27 + 1.0;                                          // Veltkamp: 2^ceil(53 / 2) + 1
  [[maybe_unused]] static constexpr double kTiny = 0x1.0p-27;  // below it sin(x) rounds to x
};

template <>
struct Constants<float> {
  // Four parts of pi/2 of 11 bits each, then the rounded rest.
  [[maybe_unused]] static constexpr float kHalfPi[5] = {0x1.92p+0F, 0x1.fb4p-12F, 0x1.444p-24F,
                                                        0x1.68cp-39F, 0x1.1a6264p-54F};
  // Relative errors 2^-37.4, 2^-33.0, 2^-30.4.
  [[maybe_unused]] static constexpr float kSin[4] = {
      -0.16666666640786789653F, 0.0083333293036486708537F, -0.00019839311882809105968F,
      2.7181179158152969082e-6F};
  [[maybe_unused]] static constexpr float kCos[3] = {
      0.04166664567644768027F, -0.0013887315930036362185F, 0.000024433119293802512425F};
  [[maybe_unused]] static constexpr float kAtan[5] = {
      -0.33333315180565688616F, 0.19998470981732075804F, -0.14243522551868727235F,
      0.1059372915327054794F, -0.060779959381402727005F};
  [[maybe_unused]] static constexpr float kQuarterPiHigh[5] = {0.0F, 0x1.921fb6p-1F, 0x1.921fb6p+0F,
                                                               0x1.2d97c8p+1F, 0x1.921fb6p+1F};
  [[maybe_unused]] static constexpr float kQuarterPiLow[5] = {
      0.0F, -0x1.777a5cp-26F, -0x1.777a5cp-25F, -0x1.99bc5cp-28F, -0x1.777a5cp-24F};
  [[maybe_unused]] static constexpr float kSplitter = 0x1.0p12F + 1.0F;
  [[maybe_unused]] static constexpr float kTiny = 0x1.0p-12F;
};

// An unevaluated sum; |lo| is at most about half an ulp of hi.
template <typename S>
struct Sum {
  S hi;
  S lo;
};

// Exact: hi + lo = a + b.
template <typename S>
Sum<S> two_sum(S a, S b) {
  const S sum = a + b;
  const S b_part = sum - a;
  return {sum, (a - (sum - b_part)) + (b - b_part)};
}

// Exact where |a| >= |b| or a = 0.
template <typename S>
Sum<S> fast_two_sum(S a, S b) {
  const S sum = a + b;
  return {sum, b - (sum - a)};
}

// Exact: hi + lo = a b, barring overflow and underflow.
template <typename S>
Sum<S> two_product(S a, S b) {
  const S a_scaled = Constants<S>::kSplitter * a;
  const S a_high = a_scaled - (a_scaled - a);
  const S a_low = a - a_high;
  const S b_scaled = Constants<S>::kSplitter * b;
  const S b_high = b_scaled - (b_scaled - b);
  const S b_low = b - b_high;
  const S product = a * b;
  const S rest = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
  return {product, rest};
}

// a / b with the rest of the division.
template <typename S>
Sum<S> divide(Sum<S> a, Sum<S> b) {
  const S quotient = a.hi / b.hi;
  const Sum<S> back = two_product(quotient, b.hi);
  const S rest = ((a.hi - back.hi) - back.lo) + a.lo - quotient * b.lo;
  return fast_two_sum(quotient, rest / b.hi);
}

// c[0] + c[1] z + ..., unrolled by the compiler.
template <typename S, std::size_t kSize, std::size_t kIndex = 0>
S polynomial(const S (&c)[kSize], S z) {
  if constexpr (kIndex + 1 == kSize) {
    return c[kIndex];
  } else {
    return c[kIndex] + z * polynomial<S, kSize, kIndex + 1>(c, z);
  }
}

// sin(x)/x = 1 + sine_factor(x^2) for |x| <= pi/4.
template <typename S>
S sine_factor(S z) {
  return z * polynomial(Constants<S>::kSin, z);
}

// The sum's high part is the rounded sine.
template <typename S>
Sum<S> sine_kernel(Sum<S> x) {
  const S z = x.hi * x.hi;
  // d sin = cos(x) lo, and 1 - z/2 is enough of the cosine there.
  return fast_two_sum(x.hi, x.hi * sine_factor(z) + x.lo * (S(1) - S(0.5) * z));
}

template <typename S>
Sum<S> cosine_kernel(Sum<S> x) {
  const S z = x.hi * x.hi;
  const S half_z = S(0.5) * z;
  const S head = S(1) - half_z;
  // The rounding error of `head` joins the small terms; d cos = -x lo.
  return fast_two_sum(
      head, ((S(1) - head) - half_z) + (z * z * polynomial(Constants<S>::kCos, z) - x.hi * x.lo));
}

template <typename S>
struct ReducedAngle {
  Sum<S> rest;            // |rest| <= pi/4 up to rounding
  std::uint32_t quarter;  // angle = rest + quarter pi/2 (mod 2 pi), 0 to 3
};

// Needs |angle| <= kMaxTrigArgument_rad. The first difference is exact (Sterbenz); those after it
// may round when little cancelled, and two_sum keeps what they lose.
template <typename S>
ReducedAngle<S> reduce(Sum<S> angle) {
  using C = Constants<S>;
  constexpr S kTwoOverPi = S(0.63661977236758134308L);
  const S turns = angle.hi * kTwoOverPi;
  const auto count = static_cast<std::int32_t>(turns + (turns < S(0) ? S(-0.5) : S(0.5)));
  const S k = static_cast<S>(count);
  const S first = angle.hi - k * C::kHalfPi[0];
  const Sum<S> second = two_sum(first, -(k * C::kHalfPi[1]));
  const Sum<S> third = two_sum(second.hi, -(k * C::kHalfPi[2]));
  const Sum<S> fourth = two_sum(third.hi, -(k * C::kHalfPi[3]));
  const S low = ((second.lo + angle.lo) + third.lo) + (fourth.lo - k * C::kHalfPi[4]);
  const Sum<S> rest = two_sum(fourth.hi, low);
  return {rest, static_cast<std::uint32_t>(count) & 3U};
}

// sin(angle + shift pi/2); `shift` 1 gives the cosine.
template <typename S>
Sum<S> shifted_sine(const ReducedAngle<S>& angle, std::uint32_t shift) {
  const std::uint32_t quarter = (angle.quarter + shift) & 3U;
  const Sum<S> value = (quarter & 1U) != 0U ? cosine_kernel(angle.rest) : sine_kernel(angle.rest);
  return (quarter & 2U) != 0U ? Sum<S>{-value.hi, -value.lo} : value;
}

// multiple pi/4 + sign atan(u) for |u| <= tan(pi/8), as hi + lo.
template <typename S>
Sum<S> angle_from(std::uint32_t multiple, S sign, Sum<S> u) {
  using C = Constants<S>;
  const S z = u.hi * u.hi;
  const S curve = u.hi * (z * polynomial(C::kAtan, z)) + u.lo * (S(1) - z);
  const Sum<S> head = fast_two_sum(C::kQuarterPiHigh[multiple], sign * u.hi);
  return fast_two_sum(head.hi, head.lo + (C::kQuarterPiLow[multiple] + sign * curve));
}

constexpr std::uint32_t kEighthTurn = 1;  // in units of pi/4
constexpr std::uint32_t kQuarterTurn = 2;
constexpr std::uint32_t kHalfTurn = 4;
template <typename S>
constexpr S kTanEighthPi = S(0.41421356237309504880L);

template <typename S>
S arc_tangent(S y, S x) {
  S large = std::abs(x);
  S small = std::abs(y);
  const bool steep = small > large;
  if (steep) {
    const S other = large;
    large = small;
    small = other;
  }
  if (large == S(0)) {
    large = S(1);  // both zero: the angle is 0 or pi by the sign of x
  } else if (small > std::numeric_limits<S>::max() && large == small) {
    large = S(1);  // both infinite: on the diagonal
    small = S(1);
  }
  const bool backward = std::signbit(x);
  const bool diagonal = small > kTanEighthPi<S> * large;
  Sum<S> u = {small / large, S(0)};
  if (diagonal) {
    const S scale = large > S(1) ? S(0.5) : S(1);  // keeps the sum finite
    const Sum<S> difference = two_sum(scale * large, -scale * small);
    const Sum<S> total = two_sum(scale * large, scale * small);
    u.hi = difference.hi / total.hi;
    u.lo = (difference.lo - u.hi * total.lo) / total.hi;
  }
  // On the axes side atan(u) leads away from the nearest multiple of pi/2, on the diagonal from
  // that of pi/4; `steep`, `backward` and `diagonal` each mirror the direction once.
  std::uint32_t multiple = steep ? kQuarterTurn : (backward ? kHalfTurn : 0U);
  if (diagonal) {
    multiple = backward ? kHalfTurn - kEighthTurn : kEighthTurn;
  }
  const S sign = (steep != backward) != diagonal ? S(-1) : S(1);
  const S angle = angle_from(multiple, sign, u).hi;
  return std::copysign(angle, y);
}

// |(a, b, c)| as hi + lo.
template <typename S>
Sum<S> norm(S a, S b, S c) {
  const Sum<S> aa = two_product(a, a);
  const Sum<S> bb = two_product(b, b);
  const Sum<S> cc = two_product(c, c);
  const Sum<S> ab = two_sum(aa.hi, bb.hi);
  const Sum<S> abc = two_sum(ab.hi, cc.hi);
  const Sum<S> square = fast_two_sum(abc.hi, (ab.lo + abc.lo) + ((aa.lo + bb.lo) + cc.lo));
  const S root = std::sqrt(square.hi);
  const Sum<S> back = two_product(root, root);
  const S rest = ((square.hi - back.hi) - back.lo) + square.lo;
  return fast_two_sum(root, rest / (root + root));
}

// atan2(y, x) for y > 0, x >= 0 and y >= tan(pi/8) x: the half angle of a rotation beyond pi/4.
template <typename S>
Sum<S> half_angle(Sum<S> y, S x) {
  if (kTanEighthPi<S> * y.hi > x) {
    return angle_from(kQuarterTurn, S(-1), divide(Sum<S>{x, S(0)}, y));
  }
  Sum<S> difference = two_sum(y.hi, -x);
  difference.lo += y.lo;
  Sum<S> total = two_sum(y.hi, x);
  total.lo += y.lo;
  return angle_from(kEighthTurn, S(1), divide(difference, total));
}

// In a stated order of addition, which Eigen does not promise.
Real squared_norm(const Vec3& v) { return (v.x() * v.x() + v.y() * v.y()) + v.z() * v.z(); }

// True where w, or the first non-zero component of the vector part when w is zero, asks for -q.
bool is_lower_half(const Quat& q) {
  if (q.w() != 0.0_r) return q.w() < 0.0_r;
  if (q.x() != 0.0_r) return q.x() < 0.0_r;
  if (q.y() != 0.0_r) return q.y() < 0.0_r;
  return q.z() < 0.0_r;
}

// Also false for NaN.
bool is_in_trig_range(Real angle_rad) { return std::abs(angle_rad) <= kMaxTrigArgument_rad; }

constexpr Real kNotANumber = std::numeric_limits<Real>::quiet_NaN();

}  // namespace

Real bounded_sin(Real angle_rad) noexcept {
  if (!is_in_trig_range(angle_rad)) return kNotANumber;
  if (std::abs(angle_rad) < Constants<Real>::kTiny) return angle_rad;  // keeps -0
  return shifted_sine(reduce(Sum<Real>{angle_rad, 0.0_r}), 0U).hi;
}

Real bounded_cos(Real angle_rad) noexcept {
  if (!is_in_trig_range(angle_rad)) return kNotANumber;
  return shifted_sine(reduce(Sum<Real>{angle_rad, 0.0_r}), 1U).hi;
}

Real bounded_atan2(Real y, Real x) noexcept { return arc_tangent(y, x); }

Quat so3_exp(const Vec3& rotation_rad) noexcept {
  constexpr Real kHalfPi = 1.57079632679489661923_r;
  const Real square = squared_norm(rotation_rad);
  if (square <= kHalfPi * kHalfPi) {
    // sin(h)/(2h) is a polynomial of h^2, h half the angle: no root and nothing to divide by.
    const Real z = 0.25_r * square;
    const Real factor = 0.5_r + 0.5_r * sine_factor(z);
    const Real half_z = 0.5_r * z;
    const Real head = 1.0_r - half_z;
    const Real w =
        head + (((1.0_r - head) - half_z) + z * z * polynomial(Constants<Real>::kCos, z));
    return Quat(w, factor * rotation_rad.x(), factor * rotation_rad.y(), factor * rotation_rad.z());
  }
  const Sum<Real> angle = norm(rotation_rad.x(), rotation_rad.y(), rotation_rad.z());
  if (!is_in_trig_range(angle.hi)) return Quat(kNotANumber, kNotANumber, kNotANumber, kNotANumber);
  const ReducedAngle<Real> half = reduce(Sum<Real>{0.5_r * angle.hi, 0.5_r * angle.lo});
  const Real factor = divide(shifted_sine(half, 0U), angle).hi;
  return Quat(shifted_sine(half, 1U).hi, factor * rotation_rad.x(), factor * rotation_rad.y(),
              factor * rotation_rad.z());
}

Vec3 so3_log(const Quat& q) noexcept {
  const Real sign = is_lower_half(q) ? -1.0_r : 1.0_r;
  const Real w = sign * q.w();
  const Vec3 v = sign * q.vec();
  const Real square = squared_norm(v);
  const Real limit = kTanEighthPi<Real> * w;
  if (square <= limit * limit) {
    // 2 atan(|v| / w) v / |v| without the norm, so that it keeps its relative accuracy down to the
    // identity.
    const Real z = square / (w * w);
    const Real curve = z * polynomial(Constants<Real>::kAtan, z);
    const Vec3 slope = (2.0_r * v) / w;
    return slope + curve * slope;
  }
  const Sum<Real> length = norm(v.x(), v.y(), v.z());
  const Sum<Real> half = half_angle(length, w);
  const Sum<Real> factor = divide(half, length);
  return (2.0_r * factor.hi) * v + (2.0_r * factor.lo) * v;
}

}  // namespace haptic
