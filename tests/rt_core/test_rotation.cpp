// SPDX-License-Identifier: Apache-2.0
// Reference: long double libm, 11 (40 for float) bits more than Real. An error is given in ulp of
// the reference rounded to Real; for vectors and quaternions it is the norm of the error in ulp of
// the norm. On machines whose long double is computed in software a reference costs microseconds:
// the cases spread few arguments evenly, the long ones take millions.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <cstdint>
#include <limits>

#include "rt_core/base/rotation.hpp"
#include "tests/support/random.hpp"

namespace {

using haptic::Quat;
using haptic::Real;
using haptic::Vec3;
using haptic::operator""_r;
using Wide = long double;

static_assert(LDBL_MANT_DIG >= 64, "the reference needs more bits than double");
constexpr int kDigits = std::numeric_limits<Real>::digits;
constexpr Wide kPi = 3.14159265358979323846264338327950288L;
constexpr Real kInfinity = std::numeric_limits<Real>::infinity();
constexpr Real kNotANumber = std::numeric_limits<Real>::quiet_NaN();
constexpr Wide kAllowed_ulp = 2.0L;

/// Draws whose bounds are as wide as the reference.
class WideRandom {
 public:
  explicit WideRandom(std::uint64_t seed) : random_(seed) {}
  std::uint64_t bits() { return random_.next(); }
  Wide uniform(Wide low, Wide high) {
    return low + (high - low) * static_cast<Wide>(bits() >> 11U) * 0x1.0p-53L;
  }
  Real real(Wide low, Wide high) { return static_cast<Real>(uniform(low, high)); }

 private:
  haptic::test::Random random_;
};

/// Draws in the i-th of `count` equal parts of a range: as many draws as parts leave no gap wider
/// than two of them.
class Spread {
 public:
  Spread(WideRandom& random, int i, int count) : random_(random), part_(i), count_(count) {}
  Wide uniform(Wide low, Wide high) {
    return low + (high - low) * (part_ + random_.uniform(0.0L, 1.0L)) / count_;
  }
  Real real(Wide low, Wide high) { return static_cast<Real>(uniform(low, high)); }
  Real signed_magnitude(int low_exponent, int high_exponent) {
    const Wide size = std::exp2(uniform(low_exponent, high_exponent));
    return static_cast<Real>((random_.bits() & 1U) != 0U ? -size : size);
  }

 private:
  WideRandom& random_;
  Wide part_, count_;
};

Wide ulp_of(Wide value) {
  int exponent = 0;
  std::frexp(std::abs(value), &exponent);
  const int lowest = std::numeric_limits<Real>::min_exponent;
  return std::ldexp(1.0L, std::max(exponent, lowest) - kDigits);
}

Wide error_ulp(Real got, Wide want) {
  return std::abs(static_cast<Wide>(got) - want) / ulp_of(want);
}

struct WideQuat {
  Wide w, x, y, z;
};

WideQuat widen(const Quat& q) {
  return {static_cast<Wide>(q.w()), static_cast<Wide>(q.x()), static_cast<Wide>(q.y()),
          static_cast<Wide>(q.z())};
}

std::array<Wide, 3> widen(const Vec3& v) {
  return {static_cast<Wide>(v.x()), static_cast<Wide>(v.y()), static_cast<Wide>(v.z())};
}

Wide norm(const std::array<Wide, 3>& v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

WideQuat reference_exp(const Vec3& v, Wide angle) {
  const std::array<Wide, 3> r = widen(v);
  const Wide factor = angle == 0.0L ? 0.5L : std::sin(0.5L * angle) / angle;
  return {std::cos(0.5L * angle), factor * r[0], factor * r[1], factor * r[2]};
}

std::array<Wide, 3> reference_log(const Quat& q) {
  WideQuat r = widen(q);
  if (r.w < 0.0L) r = {-r.w, -r.x, -r.y, -r.z};
  const Wide length = norm({r.x, r.y, r.z});
  const Wide factor = length == 0.0L ? 2.0L / r.w : 2.0L * std::atan2(length, r.w) / length;
  return {factor * r.x, factor * r.y, factor * r.z};
}

// Error of the vector part in ulp of its norm, and of the whole in ulp of one.
std::array<Wide, 2> exp_error_ulp(const Quat& got, const WideQuat& want) {
  const WideQuat q = widen(got);
  const Wide vector = norm({q.x - want.x, q.y - want.y, q.z - want.z});
  const Wide whole = std::hypot(vector, q.w - want.w);
  return {vector / ulp_of(norm({want.x, want.y, want.z})), whole / ulp_of(1.0L)};
}

Wide log_error_ulp(const Vec3& got, const std::array<Wide, 3>& want) {
  const std::array<Wide, 3> v = widen(got);
  return norm({v[0] - want[0], v[1] - want[1], v[2] - want[2]}) / ulp_of(norm(want));
}

// A random direction with a given length; components may be zero.
Vec3 random_vector(WideRandom& random, Wide length) {
  std::array<Wide, 3> v{};
  Wide size = 0.0L;
  while (size < 0.1L || size > 1.0L) {
    for (Wide& c : v) c = random.bits() % 16U == 0U ? 0.0L : random.uniform(-1.0L, 1.0L);
    size = norm(v);
  }
  const Wide scale = length / size;
  return Vec3(static_cast<Real>(scale * v[0]), static_cast<Real>(scale * v[1]),
              static_cast<Real>(scale * v[2]));
}

struct WorstTrig {
  Wide sine = 0.0L;
  Wide cosine = 0.0L;
  void add(Real x) {
    sine = std::max(sine, error_ulp(haptic::bounded_sin(x), std::sin(static_cast<Wide>(x))));
    cosine = std::max(cosine, error_ulp(haptic::bounded_cos(x), std::cos(static_cast<Wide>(x))));
  }
};

void measure_sine_and_cosine(int count) {
  WideRandom random(0x51E7);
  WorstTrig worst;
  for (int i = 0; i < count; ++i) {
    Spread spread(random, i, count);
    worst.add(spread.real(-3.2L, 3.2L));
    worst.add(spread.real(-1.0e4L, 1.0e4L));
    worst.add(spread.signed_magnitude(-40, 13));
  }
  MESSAGE("worst error: sin " << static_cast<double>(worst.sine) << " ulp, cos "
                              << static_cast<double>(worst.cosine) << " ulp over " << 3 * count);
  CHECK(worst.sine <= kAllowed_ulp);
  CHECK(worst.cosine <= kAllowed_ulp);
}

void measure_arc_tangent(int count) {
  WideRandom random(0xA7A2);
  Wide worst = 0.0L;
  const auto add = [&worst](Real y, Real x) {
    const Wide want = std::atan2(static_cast<Wide>(y), static_cast<Wide>(x));
    worst = std::max(worst, error_ulp(haptic::bounded_atan2(y, x), want));
  };
  for (int i = 0; i < count; ++i) {
    Spread spread(random, i, count);
    const Wide angle = spread.uniform(-kPi, kPi);
    const Wide size = std::exp2(random.uniform(-30.0L, 30.0L));
    add(static_cast<Real>(size * std::sin(angle)), static_cast<Real>(size * std::cos(angle)));
    add(spread.real(-1.0L, 1.0L), random.real(-1.0L, 1.0L));
    add(spread.signed_magnitude(-60, 60), Spread(random, 0, 1).signed_magnitude(-60, 60));
  }
  MESSAGE("worst error: atan2 " << static_cast<double>(worst) << " ulp over " << 3 * count);
  CHECK(worst <= kAllowed_ulp);
}

void measure_exp(int count) {
  WideRandom random(0xE4B);
  std::array<Wide, 2> worst{};
  const auto add = [&worst](const Vec3& v) {
    const std::array<Wide, 2> error =
        exp_error_ulp(haptic::so3_exp(v), reference_exp(v, norm(widen(v))));
    worst = {std::max(worst[0], error[0]), std::max(worst[1], error[1])};
  };
  for (int i = 0; i < count; ++i) {
    Spread spread(random, i, count);
    // Up to 6 rad: nearer to a full turn the rounding of the reference's norm would be measured.
    add(random_vector(random, spread.uniform(0.0L, 6.0L)));
    add(random_vector(random, spread.uniform(1.55L, 1.6L)));  // around the change of formula
    add(random_vector(random, std::exp2(spread.uniform(-60.0L, 1.0L))));
  }
  MESSAGE("worst error: exp " << static_cast<double>(worst[0]) << " ulp of the vector part, "
                              << static_cast<double>(worst[1]) << " ulp of one, over "
                              << 3 * count);
  CHECK(worst[0] <= kAllowed_ulp);
  CHECK(worst[1] <= kAllowed_ulp);
}

void measure_log(int count) {
  WideRandom random(0x106);
  Wide worst = 0.0L;
  const auto add = [&worst](const Vec3& rotation, bool negate) {
    const WideQuat q = reference_exp(rotation, norm(widen(rotation)));
    const Wide sign = negate ? -1.0L : 1.0L;
    const Quat rounded(static_cast<Real>(sign * q.w), static_cast<Real>(sign * q.x),
                       static_cast<Real>(sign * q.y), static_cast<Real>(sign * q.z));
    worst = std::max(worst, log_error_ulp(haptic::so3_log(rounded), reference_log(rounded)));
  };
  for (int i = 0; i < count; ++i) {
    Spread spread(random, i, count);
    const bool negate = (i & 1) != 0;
    add(random_vector(random, spread.uniform(0.0L, kPi)), negate);
    const Wide near_half_turn = kPi - std::exp2(spread.uniform(-60.0L, 0.0L));
    add(random_vector(random, near_half_turn), negate);
    const Wide near_identity = std::exp2(spread.uniform(-60.0L, 0.0L));
    add(random_vector(random, near_identity), negate);
  }
  MESSAGE("worst error: log " << static_cast<double>(worst) << " ulp over " << 3 * count);
  CHECK(worst <= kAllowed_ulp);
}

}  // namespace

TEST_SUITE("rt_core.rotation") {
  TEST_CASE("sin and cos: within 2 ulp over the whole range") { measure_sine_and_cosine(20000); }
  TEST_CASE("atan2: within 2 ulp in every octant") { measure_arc_tangent(20000); }
  TEST_CASE("exp: within 2 ulp of its norm") { measure_exp(10000); }
  TEST_CASE("log: within 2 ulp of its norm") { measure_log(10000); }

  TEST_CASE("sin and cos: within 2 ulp, millions of arguments [long]") {
    measure_sine_and_cosine(10000000);
  }
  TEST_CASE("atan2: within 2 ulp, millions of arguments [long]") { measure_arc_tangent(5000000); }
  TEST_CASE("exp: within 2 ulp, millions of arguments [long]") { measure_exp(3000000); }
  TEST_CASE("log: within 2 ulp, millions of arguments [long]") { measure_log(3000000); }

  TEST_CASE("sin and cos: relative accuracy holds next to every multiple of pi/2") {
    WorstTrig worst;
    for (int k = 0; k <= 6366; ++k) {
      const Real centre = static_cast<Real>(static_cast<Wide>(k) * (kPi / 2.0L));
      Real above = centre;
      Real below = centre;
      for (int step = 0; step < 4; ++step) {
        for (const Real x : {above, below, -above, -below}) {
          if (x != 0.0_r && std::abs(x) <= haptic::kMaxTrigArgument_rad) worst.add(x);
        }
        above = std::nextafter(above, kInfinity);
        below = std::nextafter(below, -kInfinity);
      }
    }
    CHECK(worst.sine <= kAllowed_ulp);
    CHECK(worst.cosine <= kAllowed_ulp);
  }

  TEST_CASE("sin and cos: signs of zero, symmetry, limits and refusals") {
    CHECK(haptic::bounded_sin(0.0_r) == 0.0_r);
    CHECK_FALSE(std::signbit(haptic::bounded_sin(0.0_r)));
    CHECK(std::signbit(haptic::bounded_sin(-0.0_r)));
    CHECK(haptic::bounded_cos(0.0_r) == 1.0_r);
    const Real smallest = std::numeric_limits<Real>::denorm_min();
    CHECK(haptic::bounded_sin(smallest) == smallest);
    WideRandom random(7);
    for (int i = 0; i < 20000; ++i) {
      const Real x = random.real(0.0L, 1.0e4L);
      REQUIRE(haptic::bounded_sin(-x) == -haptic::bounded_sin(x));
      REQUIRE(haptic::bounded_cos(-x) == haptic::bounded_cos(x));
    }
    const Real limit = haptic::kMaxTrigArgument_rad;
    CHECK(std::isfinite(haptic::bounded_sin(limit)));
    const Real beyond = std::nextafter(limit, kInfinity);
    for (const Real bad : {beyond, -beyond, kInfinity, -kInfinity, kNotANumber}) {
      CHECK(std::isnan(haptic::bounded_sin(bad)));
      CHECK(std::isnan(haptic::bounded_cos(bad)));
    }
  }

  TEST_CASE("atan2: zeros, infinities and extremes follow C") {
    const Real huge = std::numeric_limits<Real>::max();
    const Real tiny = std::numeric_limits<Real>::denorm_min();
    const Real small = std::numeric_limits<Real>::min();
    const Real values[] = {0.0_r,     -0.0_r,     1.0_r,        -1.0_r,      tiny,
                           -tiny,     small,      -small,       huge,        -huge,
                           kInfinity, -kInfinity, 0.5_r * huge, 3.0_r * tiny};
    for (const Real y : values) {
      for (const Real x : values) {
        CAPTURE(y);
        CAPTURE(x);
        const Wide want = std::atan2(static_cast<Wide>(y), static_cast<Wide>(x));
        const Real got = haptic::bounded_atan2(y, x);
        CHECK(error_ulp(got, want) <= kAllowed_ulp);
        CHECK(std::signbit(got) == std::signbit(want));
      }
      CHECK(std::isnan(haptic::bounded_atan2(y, kNotANumber)));
      CHECK(std::isnan(haptic::bounded_atan2(kNotANumber, y)));
    }
  }

  TEST_CASE("exp: large rotations keep their accuracy") {
    // Directions with a whole norm, so that the reference angle is exact.
    constexpr int kTriples[4][4] = {{2, 3, 6, 7}, {1, 4, 8, 9}, {2, 10, 11, 15}, {3, 4, 0, 5}};
    WideRandom random(0xB16);
    std::array<Wide, 2> worst{};
    for (int i = 0; i < 40000; ++i) {
      const int(&t)[4] = kTriples[i % 4];
      const Real scale =
          static_cast<Real>(std::floor(random.uniform(0.0L, 1.0e4L * 64.0L / t[3]))) / 64.0_r;
      const Vec3 v(scale * static_cast<Real>(t[0]), -scale * static_cast<Real>(t[1]),
                   scale * static_cast<Real>(t[2]));
      const WideQuat want = reference_exp(v, static_cast<Wide>(scale) * t[3]);
      if (scale == 0.0_r) continue;
      const std::array<Wide, 2> error = exp_error_ulp(haptic::so3_exp(v), want);
      worst = {std::max(worst[0], error[0]), std::max(worst[1], error[1])};
    }
    MESSAGE("worst error: exp up to 1e4 rad " << static_cast<double>(worst[0])
                                              << " ulp of the vector part, "
                                              << static_cast<double>(worst[1]) << " ulp of one");
    CHECK(worst[0] <= kAllowed_ulp);
    CHECK(worst[1] <= kAllowed_ulp);
    CHECK(std::isnan(haptic::so3_exp(Vec3(2.0e4_r, 0.0_r, 0.0_r)).w()));
    CHECK(std::isnan(haptic::so3_exp(Vec3(0.0_r, kNotANumber, 0.0_r)).w()));
  }

  TEST_CASE("exp and log: inverse of each other") {
    WideRandom random(0x1417);
    for (int i = 0; i < 100000; ++i) {
      const Vec3 v = random_vector(random, random.uniform(0.0L, 3.1L));
      const Quat q = haptic::so3_exp(v);
      // The log of a rounded quaternion moves by up to an ulp of one, not of the vector.
      const Real tolerance = 8.0_r * haptic::kRealEpsilon * std::max(1.0_r, v.norm());
      REQUIRE((haptic::so3_log(q) - v).norm() <= tolerance);
      const Quat again = haptic::so3_exp(haptic::so3_log(q));
      REQUIRE((again.coeffs() - q.coeffs()).norm() <= 4.0_r * haptic::kRealEpsilon);
      REQUIRE(std::abs(q.norm() - 1.0_r) <= 2.0_r * haptic::kRealEpsilon);
    }
    CHECK(haptic::so3_exp(Vec3::Zero()).coeffs() == Quat::Identity().coeffs());
    CHECK(haptic::so3_log(Quat::Identity()) == Vec3::Zero());
  }

  TEST_CASE("log: q and -q agree bit for bit, also at the half turn") {
    WideRandom random(0xDD);
    for (int i = 0; i < 50000; ++i) {
      const Quat q = haptic::so3_exp(random_vector(random, random.uniform(0.0L, 6.2L)));
      const Quat minus(-q.w(), -q.x(), -q.y(), -q.z());
      REQUIRE(haptic::so3_log(q) == haptic::so3_log(minus));
      REQUIRE(haptic::so3_log(q).norm() <=
              static_cast<Real>(kPi) * (1.0_r + 4.0_r * haptic::kRealEpsilon));
    }
    const Real pi = static_cast<Real>(kPi);
    for (const Real w : {0.0_r, -0.0_r}) {
      CHECK(haptic::so3_log(Quat(w, -1.0_r, 0.0_r, 0.0_r)) == Vec3(pi, 0.0_r, 0.0_r));
      CHECK(haptic::so3_log(Quat(w, 0.0_r, -1.0_r, 0.0_r)) == Vec3(0.0_r, pi, 0.0_r));
      CHECK(haptic::so3_log(Quat(w, 0.0_r, 0.0_r, 1.0_r)) == Vec3(0.0_r, 0.0_r, pi));
      const Vec3 slanted = haptic::so3_log(Quat(w, -0.6_r, 0.8_r, 0.0_r));
      CHECK(slanted.x() > 0.0_r);
      CHECK(slanted.y() < 0.0_r);
    }
  }

  TEST_CASE("results: the same bits with every compiler") {
    WideRandom random(0xB175);
    std::uint64_t hash = 0xCBF29CE484222325ULL;  // FNV-1a over mantissas and exponents
    const auto add = [&hash](Real value) {
      int exponent = 0;
      const Real mantissa = std::frexp(value, &exponent);
      const auto whole = static_cast<std::int64_t>(std::ldexp(mantissa, kDigits));
      for (const std::int64_t part : {whole, static_cast<std::int64_t>(exponent)}) {
        hash = (hash ^ static_cast<std::uint64_t>(part)) * 0x100000001B3ULL;
      }
    };
    for (int i = 0; i < 100000; ++i) {
      // Inputs without libm: integers scaled by powers of two.
      const auto pick = [&random](Real scale) {
        const auto whole = static_cast<std::int32_t>(random.bits() % 2000001U) - 1000000;
        return static_cast<Real>(whole) * scale;
      };
      const Real x = pick(0x1.0p-8_r);
      add(haptic::bounded_sin(x));
      add(haptic::bounded_cos(x));
      const Real y = pick(1.0_r);
      add(haptic::bounded_atan2(y, pick(1.0_r)));
      Vec3 v;
      for (int axis = 0; axis < 3; ++axis) v[axis] = pick(0x1.0p-18_r);
      const Quat q = haptic::so3_exp(v);
      const Vec3 l = haptic::so3_log(q);
      for (const Real value : {q.w(), q.x(), q.y(), q.z(), l.x(), l.y(), l.z()}) add(value);
    }
    // To renew after a wanted change of rotation.cpp: copy the number that both compilers print.
    constexpr std::uint64_t kExpected =
        sizeof(Real) == sizeof(double) ? 18159225311796194656ULL : 11777212802219081166ULL;
    MESSAGE("hash of the results: " << hash);
    CHECK(hash == kExpected);
  }
}
