// SPDX-License-Identifier: Apache-2.0
// The quadratic program of the proxy: closed forms, an enumeration of all active sets, and a second
// solver that shares nothing with it, on problems as the proxy makes them and on hostile ones.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "tests/rt_core/qp_oracles.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr bool kFloat = HAPTIC_REAL_IS_FLOAT != 0;
constexpr Real kTolerance = kFloat ? 2.0e-7_r : 1.0e-11_r;  // m
constexpr double kViolation_m = kFloat ? 4e-7 : 1e-10;
constexpr double kSecondOpinion_m = kFloat ? 5e-5 : 1e-6;
constexpr double kOracle_m = kFloat ? 1e-5 : 1e-9;
constexpr double kRounding = kFloat ? 1e-5 : 1e-13;  // of sums of multipliers and rows

QpRow row(std::initializer_list<double> g, double h) {
  QpRow made;
  Eigen::Index i = 0;
  for (const double x : g) made.g[i++] = static_cast<Real>(x);
  made.h = static_cast<Real>(h);
  return made;
}

double violation(const QpRow& r, const QpVector& z) {
  double v = static_cast<double>(r.h);
  for (Eigen::Index i = 0; i < 6; ++i) v -= static_cast<double>(r.g[i]) * static_cast<double>(z[i]);
  return v;
}

/// What rounding leaves of a row at z: rows that contradict each other drive z far off.
double slack_m(const QpVector& z) {
  return kViolation_m * std::max(1.0, static_cast<double>(z.norm()) / 0.02);
}

double largest_violation(const std::vector<QpRow>& rows, const QpVector& z) {
  double worst = 0;
  for (const QpRow& r : rows) worst = std::max(worst, violation(r, z));
  return worst;
}

template <typename Scalar>
double distance(const QpVector& z, const std::array<Scalar, 6>& other) {
  double sum = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto d =
        static_cast<double>(static_cast<Scalar>(z[static_cast<Eigen::Index>(i)]) - other[i]);
    sum += d * d;
  }
  return std::sqrt(sum);
}

bool same_bits(const QpResult& l, const QpResult& r) {
  return std::memcmp(l.z.data(), r.z.data(), sizeof(l.z)) == 0 && l.active == r.active &&
         std::memcmp(l.multiplier.data(), r.multiplier.data(), sizeof(l.multiplier)) == 0 &&
         l.active_count == r.active_count && l.iterations == r.iterations &&
         l.skipped == r.skipped && l.capped == r.capped;
}

/// What every result has to be, for any problem: the closest point of its active rows, which
/// push and hold.
void check_held(const std::vector<QpRow>& rows, const QpResult& result) {
  REQUIRE(result.active_count <= 6);
  REQUIRE(result.iterations <= kMaxQpIterations);
  std::array<double, 6> sum{};
  double size = 0, worst = 0;
  bool pushing = true, known = true;
  for (std::uint32_t k = 0; k < result.active_count; ++k) {
    known = known && result.active[k] < rows.size();
    if (!known) break;
    const QpRow& r = rows[result.active[k]];
    const double u = static_cast<double>(result.multiplier[k]);
    pushing = pushing && u > 0;
    size += u;
    worst = std::max(worst, std::abs(violation(r, result.z)));
    for (std::size_t i = 0; i < 6; ++i)
      sum[i] += u * static_cast<double>(r.g[static_cast<Eigen::Index>(i)]);
    for (std::uint32_t j = 0; j < k; ++j) known = known && result.active[j] != result.active[k];
  }
  CHECK(known);
  CHECK(pushing);
  CHECK(worst <= slack_m(result.z));
  CHECK(distance(result.z, sum) <= kRounding * (1e-2 + size));  // false for what is not a number
}

/// What a solved problem has to be.
QpResult check_solved(const std::vector<QpRow>& rows) {
  const QpResult result = closest_point(rows, kTolerance);
  check_held(rows, result);
  CHECK(largest_violation(rows, result.z) <= kViolation_m);
  CHECK(result.skipped == 0);
  CHECK_FALSE(result.capped);
  return result;
}

void check_against_oracle(const std::vector<QpRow>& rows, double& largest_error_m) {
  const EnumeratedPoint truth = enumerate_active_sets(rows);
  REQUIRE(static_cast<double>(truth.violation) <= 1e-12);
  const double error_m = distance(check_solved(rows).z, truth.z);
  largest_error_m = std::max(largest_error_m, error_m);
  CHECK(error_m <= kOracle_m);
}

}  // namespace

TEST_SUITE("rt_core.proxy_qp") {
  TEST_CASE("no row, or only rows that the origin meets: the origin, nothing active") {
    for (const std::vector<QpRow>& rows :
         {std::vector<QpRow>{}, {row({0, 0, 1, 0, 0, 0}, -0.001)}, {row({1, 0, 0, 0, 0, 0}, 0)}}) {
      const QpResult result = check_solved(rows);
      CHECK(result.z == QpVector::Zero());
      CHECK(result.active_count == 0);
      CHECK(result.iterations == 0);
    }
  }

  TEST_CASE("one violated row: the foot of its plane") {
    const std::vector<QpRow> rows = {row({0, 0, 1, 0, 0, 0}, -0.5), row({0, 3, 0, 0, 4, 0}, 0.5)};
    const QpResult result = check_solved(rows);
    CHECK(distance(result.z, std::array<double, 6>{0, 0.06, 0, 0, 0.08, 0}) <= kRounding);
    CHECK(result.iterations == 1);
    REQUIRE(result.active_count == 1);
    CHECK(result.active[0] == 1);
    CHECK(static_cast<double>(result.multiplier[0]) == doctest::Approx(0.02));
  }

  TEST_CASE("six planes: their common point; the first row of equals is taken") {
    std::vector<QpRow> rows;
    for (int copy = 0; copy < 2; ++copy) {
      for (Eigen::Index i = 0; i < 6; ++i) {
        QpRow r;
        r.g[i] = 1;
        r.h = static_cast<Real>(i + 1) * 0.001_r;
        rows.push_back(r);
      }
      // An odd number between the copies, so that equals do not meet in one lane only.
      rows.push_back(row({1, 0, 0, 0, 0, 0}, -1));
    }
    const QpResult result = check_solved(rows);
    CHECK(distance(result.z, std::array<double, 6>{1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3}) <= 1e-9);
    CHECK(result.iterations == 6);
    REQUIRE(result.active_count == 6);
    for (std::uint32_t k = 0; k < 6; ++k) CHECK(result.active[k] == 5 - k);  // deepest first
  }

  TEST_CASE("families of the proxy: both solvers agree, every row is met, active rows push") {
    for (const QpFamily& family : kQpFamilies) {
      constexpr std::uint64_t kSeed = 11;
      INFO(family.name << ", seed " << kSeed);
      Random random(kSeed);
      double largest_m = 0;
      std::uint32_t most = 0;
      for (int k = 0; k < 600; ++k) {
        INFO("problem " << k);
        const std::vector<QpRow> rows = make_qp(random, family);
        const QpResult result = check_solved(rows);
        const NnlsResult second = dual_nnls(rows);
        REQUIRE(second.converged);
        largest_m = std::max(largest_m, distance(result.z, second.z));
        most = std::max(most, result.iterations);
        CHECK(distance(result.z, second.z) <= kSecondOpinion_m);
        CHECK(same_bits(result, closest_point(rows, kTolerance)));
      }
      MESSAGE(std::string(family.name)
              << ": largest difference " << largest_m << " m, most iterations " << most);
    }
  }

  TEST_CASE("small problems: the point that the enumeration of active sets finds") {
    double largest_m = 0;
    for (const QpFamily& family :
         {QpFamily{"1 plane", 1, 4, 1, 0, false, 5e-4, 0},
          QpFamily{"3 planes", 3, 4, 1, 0, false, 5e-4, 0},
          QpFamily{"12 planes", 12, 1, 1, 0, false, 5e-4, 0},
          QpFamily{"seam", 3, 2, 2, 0, false, 5e-4, 0}, QpFamily{"slot", 4, 3, 1, 0, true, 1e-5, 0},
          QpFamily{"friction", 1, 3, 1, 0, false, 5e-4, 0.5}}) {
      INFO(family.name << ", seed 12");
      Random random(12);
      for (int k = 0; k < 150; ++k) check_against_oracle(make_qp(random, family), largest_m);
    }
    MESSAGE("largest error " << largest_m << " m");
  }

  TEST_CASE("rows stretched by factors up to 4: the same point") {
    Random random(13);
    for (int k = 0; k < 300; ++k) {
      std::vector<QpRow> rows = make_qp(random, kQpFamilies[1]);
      const QpVector z = check_solved(rows).z;
      for (QpRow& r : rows) {
        const Real stretch = static_cast<Real>(random.uniform(1, 4));
        r.g *= stretch;
        r.h *= stretch;
      }
      CHECK(static_cast<double>((check_solved(rows).z - z).norm()) <= kOracle_m);
    }
  }

  TEST_CASE("normals apart by about what counts as dependent: met, and both solvers agree") {
    Random random(14);
    const double threshold = kFloat ? 3.4e-4 : 1e-6;
    for (const double share : {0.1, 0.3, 0.6, 1.0, 2.0, 10.0}) {
      INFO("seed 14, " << share << " of the threshold");
      for (int k = 0; k < 300; ++k) {
        const QpFamily family{"seam", 2 + k % 3, 4, 4, share * threshold, false, 5e-4, 0};
        const std::vector<QpRow> rows = make_qp(random, family);
        const NnlsResult second = dual_nnls(rows);
        REQUIRE(second.converged);
        CHECK(distance(check_solved(rows).z, second.z) <= kSecondOpinion_m);
      }
    }
  }

  TEST_CASE("problems bred for many iterations stay below the cap") {
    std::uint32_t most = 0;
    for (const std::uint64_t seed : {15u, 16u, 17u}) {
      INFO("seed " << seed);
      Random random(seed);
      std::array<double, 6> way_m{};
      for (double& x : way_m) x = random.uniform(-5e-3, 5e-3);
      const auto any_row = [&] {
        const Point lever_m{random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05),
                            random.uniform(-0.05, 0.05)};
        return qp_row(random_direction(random), lever_m, random.uniform(0, 1e-3), way_m);
      };
      std::vector<QpRow> rows;
      for (int k = 0; k < 32; ++k) rows.push_back(any_row());
      std::uint32_t best = closest_point(rows, kTolerance).iterations;
      for (int trial = 0; trial < 6000; ++trial) {
        const std::size_t k = random.next() % rows.size();
        const QpRow before = rows[k];
        rows[k] = any_row();
        const std::uint32_t count = closest_point(rows, kTolerance).iterations;
        if (count < best) rows[k] = before;
        best = std::max(best, count);
      }
      check_solved(rows);
      CHECK(best > 20);  // breeding has done something
      CHECK(best < kMaxQpIterations);
      most = std::max(most, best);
    }
    MESSAGE("most iterations " << most);
  }

  TEST_CASE("rows without length: met, or skipped and counted; the others as without them") {
    Random random(18);
    std::vector<QpRow> rows = make_qp(random, kQpFamilies[1]);
    const QpResult alone = check_solved(rows);
    REQUIRE(alone.active_count > 0);
    rows.push_back(row({0, 0, 0, 0, 0, 0}, -1));
    CHECK(same_bits(check_solved(rows), alone));
    rows.push_back(row({0, 0, 0, 0, 0, 0}, 1e-3));
    rows.push_back(row({0, 0, 0, 0, 0, 0}, 1e-3));
    const QpResult result = closest_point(rows, kTolerance);
    check_held(rows, result);
    CHECK(result.skipped == 2);
    CHECK(result.z == alone.z);
  }

  TEST_CASE("walls that leave no room: one holds, the other is skipped") {
    const std::vector<QpRow> rows = {row({1, 0, 0, 0, 0, 0}, 2e-3), row({-1, 0, 0, 0, 0, 0}, 1e-3),
                                     row({0, 1, 0, 0, 0, 0}, 1e-3)};
    const QpResult result = closest_point(rows, kTolerance);
    check_held(rows, result);
    CHECK(result.skipped == 1);
    CHECK(distance(result.z, std::array<double, 6>{2e-3, 1e-3, 0, 0, 0, 0}) <= 1e-9);
  }

  TEST_CASE("a wall against one of several active rows is skipped: rounding lets none of them go") {
    Random random(23);
    int walls = 0;
    for (int k = 0; k < 1000; ++k) {
      INFO("seed 23, problem " << k);
      std::vector<QpRow> rows = make_qp(random, kQpFamilies[2]);
      const QpResult alone = check_solved(rows);
      if (alone.active_count < 3) continue;
      ++walls;
      QpRow wall = rows[alone.active[alone.active_count - 1]];
      wall.g = -wall.g;
      wall.h = 1.0e-3_r - wall.h;
      rows.push_back(wall);
      const QpResult result = closest_point(rows, kTolerance);
      check_held(rows, result);
      CHECK(result.skipped > 0);
      int violated = 0;
      for (const QpRow& r : rows) violated += violation(r, result.z) > slack_m(result.z) ? 1 : 0;
      CHECK(violated <= static_cast<int>(result.skipped));
    }
    CHECK(walls > 100);
  }

  TEST_CASE("problems without a feasible point: the closest point of all rows but the skipped") {
    int skipped = 0, compared = 0;
    double largest_m = 0;
    for (const std::uint64_t seed : {19u, 20u}) {
      INFO("seed " << seed);
      Random random(seed);
      for (int k = 0; k < 400; ++k) {
        INFO("problem " << k);
        std::vector<QpRow> rows = make_qp(random, kQpFamilies[seed == 19 ? 1 : 3]);
        for (QpRow& r : rows) r.h = static_cast<Real>(random.uniform(-5e-3, 5e-3));
        const QpResult result = closest_point(rows, kTolerance);
        check_held(rows, result);
        CHECK_FALSE(result.capped);
        std::vector<QpRow> met;
        for (const QpRow& r : rows)
          if (violation(r, result.z) <= slack_m(result.z)) met.push_back(r);
        CHECK(rows.size() - met.size() <= result.skipped);
        REQUIRE_FALSE(met.empty());
        skipped += static_cast<int>(result.skipped);
        // A point that rows at war have driven far off is known only to its condition; that the
        // active rows hold it is proof enough.
        if (result.z.norm() > 0.1_r) continue;
        const double error_m = distance(result.z, dual_nnls(met).z);
        largest_m = std::max(largest_m, error_m);
        CHECK(error_m <= kSecondOpinion_m);
        ++compared;
      }
    }
    CHECK(skipped > 400);
    CHECK(compared > 300);
    MESSAGE(skipped << " rows skipped, " << compared << " problems compared, largest difference "
                    << largest_m << " m");
  }

  TEST_CASE("values that are no finite numbers do not reach z") {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinite = std::numeric_limits<double>::infinity();
    Random random(21);
    std::vector<QpRow> rows = make_qp(random, kQpFamilies[1]);
    const QpResult alone = check_solved(rows);
    rows.push_back(row({nan, 0, 0, 0, 0, 0}, 1));
    rows.push_back(row({1, 0, 0, 0, 0, 0}, nan));
    rows.push_back(row({infinite, 0, 0, 0, 0, 0}, 1));
    const QpResult unheard = closest_point(rows, kTolerance);
    CHECK(unheard.z == alone.z);
    rows.push_back(row({1, 0, 0, 0, 0, 0}, infinite));
    const QpResult result = closest_point(rows, kTolerance);
    CHECK(result.z == alone.z);
    CHECK(result.skipped == 1);
  }

  TEST_CASE("the most rows there may be; what comes behind them is not looked at") {
    Random random(22);
    const QpFamily many{"48 planes", 48, 4, 1, 0, false, 5e-4, 0};
    std::vector<QpRow> rows = make_qp(random, many);
    REQUIRE(rows.size() == kMaxQpRows);
    const QpResult full = check_solved(rows);
    CHECK(full.active_count > 0);
    CHECK(distance(full.z, dual_nnls(rows).z) <= kSecondOpinion_m);
    rows.push_back(row({1, 0, 0, 0, 0, 0}, 1));
    CHECK(same_bits(closest_point(rows, kTolerance), full));
  }
}
