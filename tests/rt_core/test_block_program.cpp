// SPDX-License-Identifier: Apache-2.0
// The quadratic program of several bodies: the conditions of its optimum on random programs, the
// program of one body to the bit, islands, and rows that contradict each other.
#include "rt_core/bodies/block_program.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "tests/rt_core/qp_oracles.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr bool kFloat = HAPTIC_REAL_IS_FLOAT != 0;
constexpr Real kTolerance = kFloat ? 2.0e-7_r : 1.0e-11_r;  // m
constexpr double kViolation_m = kFloat ? 1e-6 : 1e-10;
constexpr double kRounding = kFloat ? 1e-5 : 1e-13;  // of sums of multipliers and rows
constexpr double kSamePoint_m = kFloat ? 5e-5 : 1e-9;

using Unknowns = std::vector<std::array<double, 6>>;  // of every block

/// A program in memory of its own.
class PlacedProgram {
 public:
  PlacedProgram(std::uint32_t blocks, std::uint32_t most_rows) {
    Arena count;
    BlockProgram().place(count, blocks, most_rows);
    memory_.resize(count.used() / sizeof(std::uint64_t) + 1);
    Arena arena(reinterpret_cast<std::byte*>(memory_.data()));
    program.place(arena, blocks, most_rows);
    CHECK(arena.used() == count.used());
  }
  PlacedProgram(const PlacedProgram&) = delete;
  PlacedProgram& operator=(const PlacedProgram&) = delete;

  void solve(const std::vector<BlockRow>& rows, std::span<const std::uint16_t> first = {}) {
    program.clear();
    for (const BlockRow& row : rows) REQUIRE(program.push(row));
    program.solve(kTolerance, first);
  }
  Unknowns z(std::uint32_t blocks) const {
    Unknowns z(blocks);
    for (std::uint32_t k = 0; k < blocks; ++k)
      for (std::size_t i = 0; i < 6; ++i) z[k][i] = static_cast<double>(program.z(k)[i]);
    return z;
  }

  BlockProgram program;

 private:
  std::vector<std::uint64_t> memory_;
};

double height(const BlockRow& row, const Unknowns& z) {
  double sum = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    sum += static_cast<double>(row.g_a[i]) * z[row.a][i];
    if (row.b != kNoBlock) sum += static_cast<double>(row.g_b[i]) * z[row.b][i];
  }
  return sum;
}

double violation(const BlockRow& row, const Unknowns& z) {
  return static_cast<double>(row.h) - height(row, z);
}

double distance(const Unknowns& l, const Unknowns& r) {
  double sum = 0;
  for (std::size_t k = 0; k < l.size(); ++k)
    for (std::size_t i = 0; i < 6; ++i) sum += (l[k][i] - r[k][i]) * (l[k][i] - r[k][i]);
  return std::sqrt(sum);
}

/// By how much a point misses the conditions of Karush, Kuhn and Tucker, which only the closest
/// point of the rows meets.
struct Miss {
  double feasible = 0;       // largest h - g.z
  double complementary = 0;  // largest |h - g.z| of a row with a multiplier
  double stationary = 0;     // |z - sum multiplier g|
  double pushing = 0;        // 1: a multiplier is not above 0, or not of a row of its own
  double multipliers = 0;    // their sum: no miss, but the scale of `stationary`

  bool met() const {
    return feasible <= kViolation_m && complementary <= kViolation_m &&
           stationary <= kRounding * (1e-2 + multipliers) && pushing == 0;
  }
};

Miss miss_of(const std::vector<BlockRow>& rows, const Unknowns& z,
             std::span<const std::uint16_t> active, std::span<const Real> multipliers) {
  Miss miss;
  for (const BlockRow& row : rows) miss.feasible = std::max(miss.feasible, violation(row, z));
  Unknowns sum(z.size());
  std::vector<bool> seen(rows.size(), false);
  if (active.size() != multipliers.size()) miss.pushing = 1;
  for (std::size_t k = 0; k < active.size() && miss.pushing == 0; ++k) {
    if (active[k] >= rows.size() || seen[active[k]] || !(multipliers[k] > 0)) {
      miss.pushing = 1;
      break;
    }
    seen[active[k]] = true;
    const BlockRow& row = rows[active[k]];
    const auto u = static_cast<double>(multipliers[k]);
    miss.multipliers += u;
    miss.complementary = std::max(miss.complementary, std::abs(violation(row, z)));
    for (std::size_t i = 0; i < 6; ++i) {
      sum[row.a][i] += u * static_cast<double>(row.g_a[i]);
      if (row.b != kNoBlock) sum[row.b][i] += u * static_cast<double>(row.g_b[i]);
    }
  }
  miss.stationary = distance(z, sum);
  return miss;
}

/// The conditions of an optimum, and that nothing was left out.
Miss check_solved(const PlacedProgram& placed, const std::vector<BlockRow>& rows,
                  std::uint32_t blocks) {
  const BlockProgram& p = placed.program;
  const Miss miss = miss_of(rows, placed.z(blocks), p.active(), p.multipliers());
  INFO(blocks << " blocks, " << rows.size() << " rows, " << p.active().size() << " active; "
              << miss.feasible << " " << miss.complementary << " " << miss.stationary << " of "
              << miss.multipliers);
  CHECK(miss.met());
  CHECK(p.skipped() == 0);
  CHECK_FALSE(p.capped());
  return miss;
}

bool same_bits(const BlockProgram& l, const BlockProgram& r, std::uint32_t blocks) {
  bool same = l.steps() == r.steps() && l.skipped() == r.skipped() && l.capped() == r.capped() &&
              l.programs() == r.programs() && std::ranges::equal(l.active(), r.active()) &&
              std::ranges::equal(l.multipliers(), r.multipliers());
  for (std::uint32_t k = 0; k < blocks; ++k)
    same = same && std::memcmp(l.z(k).data(), r.z(k).data(), sizeof(l.z(k))) == 0 &&
           l.island_of(k) == r.island_of(k);
  return same;
}

/// The six numbers of a contact on one body.
std::array<Real, 6> contact(Random& random, const Point& normal) {
  const Point lever_m{random.uniform(-0.04, 0.04), random.uniform(-0.04, 0.04),
                      random.uniform(-0.04, 0.04)};
  const QpRow row = qp_row(normal, lever_m, 0, {});
  std::array<Real, 6> g;
  for (std::size_t i = 0; i < 6; ++i) g[i] = row.g[static_cast<Eigen::Index>(i)];
  return g;
}

std::uint8_t any_block(Random& random, std::uint32_t blocks) {
  return static_cast<std::uint8_t>(random.next() % blocks);
}

/// A point that all rows of a program meet. [m]
Unknowns any_point(Random& random, std::uint32_t blocks) {
  Unknowns x(blocks);
  for (std::array<double, 6>& block : x)
    for (double& v : block) v = random.uniform(-5e-3, 5e-3);
  return x;
}

/// The row met at x with `gap_m` to spare.
BlockRow with_gap(BlockRow row, const Unknowns& x, double gap_m) {
  row.h = static_cast<Real>(height(row, x) - gap_m);
  return row;
}

/// A contact of a body with a fixed one or, in `joined` of all cases, of two bodies.
BlockRow any_row(Random& random, std::uint32_t blocks, double joined) {
  const Point n = random_direction(random);
  BlockRow row;
  row.a = any_block(random, blocks);
  row.g_a = contact(random, n);
  if (blocks > 1 && random.uniform(0, 1) < joined) {
    row.b = any_block(random, blocks);
    if (row.b == row.a) row.b = static_cast<std::uint8_t>((row.a + 1) % blocks);
    row.g_b = contact(random, {-n[0], -n[1], -n[2]});
  }
  return row;
}

void add(std::array<Real, 6>& to, const std::array<Real, 6>& g, double factor) {
  for (std::size_t i = 0; i < 6; ++i) to[i] += static_cast<Real>(factor) * g[i];
}

/// Contacts, among them copies, stretched copies, walls opposite to a row, and mixtures of two rows
/// of the same blocks.
std::vector<BlockRow> any_rows(Random& random, std::uint32_t blocks, std::uint32_t count,
                               const Unknowns& x) {
  const double joined = random.uniform(0, 1);
  std::vector<BlockRow> rows;
  while (rows.size() < count) {
    const std::uint64_t kind = rows.empty() ? 0 : random.next() % 10;
    if (kind < 6) {
      rows.push_back(with_gap(any_row(random, blocks, joined), x, random.uniform(0, 5e-4)));
      continue;
    }
    BlockRow row = rows[random.next() % rows.size()];
    if (kind == 6) {  // the same again
      rows.push_back(row);
      continue;
    }
    const BlockRow& other = rows[random.next() % rows.size()];
    if (kind == 9 && other.a == row.a && other.b == row.b) {
      add(row.g_a, other.g_a, 0.5);
      add(row.g_b, other.g_b, 0.5);
    } else {
      const double factor = kind == 7 ? random.uniform(0.5, 2) - 1 : -2;
      add(row.g_a, row.g_a, factor);
      add(row.g_b, row.g_b, factor);
    }
    rows.push_back(with_gap(row, x, random.uniform(1e-5, 5e-4)));
  }
  return rows;
}

BlockRow single(std::uint8_t a, std::initializer_list<double> g, double h) {
  BlockRow row;
  row.a = a;
  std::size_t i = 0;
  for (const double v : g) row.g_a[i++] = static_cast<Real>(v);
  row.h = static_cast<Real>(h);
  return row;
}

}  // namespace

TEST_SUITE("rt_core.block_program") {
  TEST_CASE("no row, or only rows that the origin meets: the origin, every block an island") {
    PlacedProgram placed(3, 4);
    for (const std::vector<BlockRow>& rows :
         {std::vector<BlockRow>{}, {single(1, {0, 0, 1, 0, 0, 0}, -1e-3)}}) {
      placed.solve(rows);
      CHECK(placed.z(3) == Unknowns(3));
      CHECK(placed.program.active().empty());
      CHECK(placed.program.steps() == 0);
      CHECK(placed.program.programs() == rows.size());
      for (std::uint32_t k = 0; k < 3; ++k) CHECK(placed.program.island_of(k) == k);
    }
  }

  TEST_CASE("a row over two blocks: both move, each by its share") {
    PlacedProgram placed(2, 1);
    BlockRow row = single(1, {0, 0, 1, 0, 0, 0}, 2e-3);
    row.b = 0;
    row.g_b[2] = -1;
    placed.solve({row});
    CHECK(distance(placed.z(2), {{0, 0, -1e-3, 0, 0, 0}, {0, 0, 1e-3, 0, 0, 0}}) <= kRounding);
    CHECK(placed.program.island_of(1) == 0);
    REQUIRE(placed.program.active().size() == 1);
    CHECK(static_cast<double>(placed.program.multipliers()[0]) == doctest::Approx(1e-3));
  }

  TEST_CASE("a row that names one block twice adds its parts up; a block that is none does not") {
    PlacedProgram placed(2, 2);
    BlockRow twice = single(0, {1, 0, 0, 0, 0, 0}, 3e-3);
    twice.b = 0;
    twice.g_b[0] = 0.5_r;
    BlockRow outside = single(1, {0, 1, 0, 0, 0, 0}, 1e-3);
    outside.b = 2;
    outside.g_b[1] = 1;
    placed.solve({twice, outside});
    CHECK(distance(placed.z(2), {{2e-3, 0, 0, 0, 0, 0}, {0, 1e-3, 0, 0, 0, 0}}) <= kRounding);
    outside.a = 2;
    CHECK_FALSE(placed.program.push(outside));
  }

  TEST_CASE("one block: the bits of the program of one body") {
    PlacedProgram placed(1, 192);
    int warm = 0;
    for (const QpFamily& family : kQpFamilies) {
      INFO(family.name << ", seed 31");
      Random random(31);
      for (int k = 0; k < 200; ++k) {
        std::vector<QpRow> rows = make_qp(random, family);
        if (k % 4 == 3)  // rows at war
          for (QpRow& row : rows) row.h = static_cast<Real>(random.uniform(-5e-3, 5e-3));
        std::vector<BlockRow> same;
        for (const QpRow& row : rows) {
          BlockRow one;
          std::copy_n(row.g.data(), 6, one.g_a.begin());
          one.h = row.h;
          same.push_back(one);
        }
        std::vector<std::uint8_t> first;
        for (int j = 0; j < k % 5; ++j)
          first.push_back(static_cast<std::uint8_t>(random.next() % (rows.size() + 1)));
        warm += first.empty() ? 0 : 1;
        const std::vector<std::uint16_t> first16(first.begin(), first.end());
        const QpResult one = closest_point(rows, kTolerance, first);
        placed.solve(same, first16);
        const BlockProgram& p = placed.program;
        CHECK(std::memcmp(p.z(0).data(), one.z.data(), sizeof(one.z)) == 0);
        CHECK(std::ranges::equal(p.active(), std::span(one.active).first(one.active_count)));
        CHECK(
            std::ranges::equal(p.multipliers(), std::span(one.multiplier).first(one.active_count)));
        CHECK(p.steps() == one.iterations);
        CHECK(p.skipped() == one.skipped);
        CHECK(p.capped() == one.capped);
      }
    }
    CHECK(warm > 500);
  }

  TEST_CASE("random programs meet the conditions of their optimum; the same input, the same bits") {
    PlacedProgram placed(kMostBlocks, 200), again(kMostBlocks, 1024);
    Miss largest;
    std::uint32_t most_steps = 0, joint = 0;
    std::size_t most_active = 0;
    for (std::uint32_t blocks = 1; blocks <= kMostBlocks; ++blocks) {
      Random random(40 + blocks);
      for (int k = 0; k < 400; ++k) {
        INFO("seed " << 40 + blocks << ", program " << k);
        const Unknowns x = any_point(random, blocks);
        const auto count = static_cast<std::uint32_t>(1 + random.next() % (k % 4 == 0 ? 200 : 30));
        const std::vector<BlockRow> rows = any_rows(random, blocks, count, x);
        placed.solve(rows);
        const Miss miss = check_solved(placed, rows, blocks);
        again.solve(rows);
        CHECK(same_bits(placed.program, again.program, kMostBlocks));
        largest.feasible = std::max(largest.feasible, miss.feasible);
        largest.complementary = std::max(largest.complementary, miss.complementary);
        most_active = std::max(most_active, placed.program.active().size());
        most_steps = std::max(most_steps, placed.program.steps());
        joint += placed.program.programs() == 1 && blocks > 1 ? 1u : 0u;
      }
    }
    CHECK(most_active > 20);
    CHECK(joint > 500);
    MESSAGE("largest violation " << largest.feasible << " m, of an active row "
                                 << largest.complementary << " m; most steps " << most_steps
                                 << ", most active rows " << most_active);
  }

  TEST_CASE("the check of the optimum refuses what is none") {
    PlacedProgram placed(3, 40);
    Random random(51);
    const Unknowns x = any_point(random, 3);
    const std::vector<BlockRow> rows = any_rows(random, 3, 40, x);
    placed.solve(rows);
    const BlockProgram& p = placed.program;
    const Unknowns z = placed.z(3);
    REQUIRE(miss_of(rows, z, p.active(), p.multipliers()).met());
    REQUIRE(p.active().size() > 2);
    Unknowns moved = z;
    moved[rows[p.active()[0]].a][0] += 1e-4;
    CHECK_FALSE(miss_of(rows, moved, p.active(), p.multipliers()).met());
    // x is feasible, and no row holds it.
    CHECK_FALSE(miss_of(rows, x, p.active(), p.multipliers()).met());
    CHECK_FALSE(miss_of(rows, x, {}, {}).met());
    std::vector<Real> wrong(p.multipliers().begin(), p.multipliers().end());
    wrong[0] *= 1.1_r;
    CHECK_FALSE(miss_of(rows, z, p.active(), wrong).met());
    wrong[0] = -wrong[0];
    CHECK_FALSE(miss_of(rows, z, p.active(), wrong).met());
  }

  TEST_CASE("groups that no row joins give the bits that each gives alone") {
    // Blocks 0, 2, 5 and blocks 1, 3; block 4 has rows of its own and block 6 has none.
    const std::vector<std::vector<std::uint8_t>> groups = {{0, 2, 5}, {1, 3}, {4}};
    Random random(52);
    PlacedProgram all(7, 200), alone(3, 200);
    for (int k = 0; k < 200; ++k) {
      INFO("seed 52, program " << k);
      std::vector<std::vector<BlockRow>> own;  // in the blocks' numbers within their group
      std::vector<BlockRow> rows;
      std::vector<std::size_t> group_of;
      for (const std::vector<std::uint8_t>& group : groups) {
        const auto size = static_cast<std::uint32_t>(group.size());
        const Unknowns x = any_point(random, size);
        std::vector<BlockRow> some = any_rows(random, size, 20, x);
        for (std::uint8_t j = 1; j < size; ++j) {  // joins the group for certain
          BlockRow row = any_row(random, size, 0);
          row.a = j;
          row.b = static_cast<std::uint8_t>(j - 1);
          row.g_b = contact(random, random_direction(random));
          some.push_back(with_gap(row, x, 1e-4));
        }
        own.push_back(some);
      }
      for (std::size_t j = 0; j < 22; ++j) {
        for (std::size_t g = 0; g < groups.size(); ++g) {
          if (j >= own[g].size()) continue;
          BlockRow row = own[g][j];
          row.a = groups[g][row.a];
          if (row.b != kNoBlock) row.b = groups[g][row.b];
          rows.push_back(row);
          group_of.push_back(g);
        }
      }
      all.solve(rows);
      check_solved(all, rows, 7);
      CHECK(all.program.programs() == 3);
      std::uint32_t steps = 0;
      for (std::size_t g = 0; g < groups.size(); ++g) {
        alone.solve(own[g]);
        steps += alone.program.steps();
        std::vector<Real> multipliers;
        for (std::size_t j = 0; j < all.program.active().size(); ++j)
          if (group_of[all.program.active()[j]] == g)
            multipliers.push_back(all.program.multipliers()[j]);
        CHECK(std::ranges::equal(multipliers, alone.program.multipliers()));
        for (std::uint32_t j = 0; j < groups[g].size(); ++j) {
          CHECK(all.program.z(groups[g][j]) == alone.program.z(j));
          CHECK(all.program.island_of(groups[g][j]) == groups[g][0]);
        }
      }
      CHECK(all.program.steps() == steps);
      CHECK(all.program.island_of(6) == 6);
    }
  }

  TEST_CASE("a chain of blocks in any order is one island; without one row it is two") {
    Random random(53);
    std::vector<BlockRow> rows;
    for (const int k : {6, 2, 4, 0, 3, 5, 1}) {
      BlockRow row = any_row(random, kMostBlocks, 0);
      row.a = static_cast<std::uint8_t>(k + 1);
      row.b = static_cast<std::uint8_t>(k);
      rows.push_back(row);
    }
    PlacedProgram placed(kMostBlocks, 8);
    placed.solve(rows);
    for (std::uint32_t k = 0; k < kMostBlocks; ++k) CHECK(placed.program.island_of(k) == 0);
    CHECK(placed.program.programs() == 1);
    rows.erase(rows.begin() + 4);  // of the blocks 3 and 4
    placed.solve(rows);
    for (std::uint32_t k = 0; k < kMostBlocks; ++k)
      CHECK(placed.program.island_of(k) == (k < 4 ? 0 : 4));
    CHECK(placed.program.programs() == 2);
  }

  TEST_CASE("walls that leave no room: one holds, the other is skipped, and the others hold") {
    PlacedProgram placed(2, 8);
    BlockRow joint = single(0, {0, 0, 1, 0, 0, 0}, 1e-3);
    joint.b = 1;
    joint.g_b[2] = -1;
    const std::vector<BlockRow> rows = {
        single(0, {1, 0, 0, 0, 0, 0}, 2e-3), single(0, {-1, 0, 0, 0, 0, 0}, 1e-3),
        single(0, {0, 1, 0, 0, 0, 0}, 1e-3), joint, single(1, {0, 0, 0, 0, 0, 0}, 1e-3)};
    placed.solve(rows);
    CHECK(placed.program.skipped() == 2);
    CHECK_FALSE(placed.program.capped());
    CHECK(distance(placed.z(2), {{2e-3, 1e-3, 5e-4, 0, 0, 0}, {0, 0, -5e-4, 0, 0, 0}}) <=
          kViolation_m);
  }

  TEST_CASE("random programs with rows at war: what is violated was skipped, active rows hold") {
    Random random(54);
    PlacedProgram placed(4, 60);
    std::uint32_t skipped = 0;
    for (int k = 0; k < 400; ++k) {
      INFO("seed 54, program " << k);
      const Unknowns x = any_point(random, 4);
      std::vector<BlockRow> rows = any_rows(random, 4, 30, x);
      placed.solve(rows);
      if (placed.program.active().empty()) continue;
      // Against an active row.
      BlockRow wall = rows[placed.program.active().back()];
      add(wall.g_a, wall.g_a, -2);
      add(wall.g_b, wall.g_b, -2);
      wall.h = 1.0e-3_r - wall.h;
      rows.push_back(wall);
      placed.solve(rows);
      const BlockProgram& p = placed.program;
      const Unknowns z = placed.z(4);
      double norm_m = distance(z, Unknowns(4));
      std::uint32_t violated = 0;
      for (const BlockRow& row : rows)
        violated += violation(row, z) > kViolation_m * std::max(1.0, norm_m / 0.02) ? 1u : 0u;
      CHECK(p.skipped() > 0);
      CHECK(violated <= p.skipped());
      const Miss miss = miss_of(rows, z, p.active(), p.multipliers());
      CHECK(miss.pushing == 0);
      CHECK(miss.complementary <= kViolation_m * std::max(1.0, norm_m / 0.02));
      CHECK(miss.stationary <= kRounding * (1e-2 + miss.multipliers));
      CHECK_FALSE(p.capped());
      skipped += p.skipped();
    }
    CHECK(skipped > 300);
  }

  TEST_CASE(
      "rows that come first: the same point in fewer steps; those that are none are ignored") {
    Random random(55);
    PlacedProgram cold(4, 80), warm(4, 80);
    std::uint32_t cold_steps = 0, warm_steps = 0;
    double largest_m = 0;
    for (int k = 0; k < 300; ++k) {
      INFO("seed 55, program " << k);
      const Unknowns x = any_point(random, 4);
      const std::vector<BlockRow> rows = any_rows(random, 4, 80, x);
      cold.solve(rows);
      std::vector<std::uint16_t> first(cold.program.active().begin(), cold.program.active().end());
      warm.solve(rows, first);
      check_solved(warm, rows, 4);
      largest_m = std::max(largest_m, distance(cold.z(4), warm.z(4)));
      cold_steps += cold.program.steps();
      warm_steps += warm.program.steps();
      first = {80, 3, 0xffff, 3, 79, 0};
      warm.solve(rows, first);
      check_solved(warm, rows, 4);
      largest_m = std::max(largest_m, distance(cold.z(4), warm.z(4)));
    }
    CHECK(largest_m <= kSamePoint_m);
    CHECK(warm_steps < cold_steps);
    MESSAGE("largest difference " << largest_m << " m; " << cold_steps << " steps, warm "
                                  << warm_steps);
  }

  TEST_CASE("a full list refuses a row and keeps the others; an arena that counts has no room") {
    Random random(56);
    PlacedProgram placed(2, 5);
    for (int k = 0; k < 5; ++k) REQUIRE(placed.program.push(any_row(random, 2, 0.5)));
    CHECK_FALSE(placed.program.push(any_row(random, 2, 0.5)));
    CHECK(placed.program.rows() == 5);
    placed.program.clear();
    CHECK(placed.program.rows() == 0);
    CHECK(placed.program.push(any_row(random, 2, 0.5)));
    BlockProgram counted;
    Arena count;
    counted.place(count, 2, 5);
    CHECK_FALSE(counted.push(BlockRow{}));
    counted.solve(kTolerance);
    CHECK(counted.active().empty());
  }

  TEST_CASE("the most blocks and rows there may be") {
    Random random(57);
    PlacedProgram placed(kMostBlocks + 1, kMostBlockRows + 1);
    const Unknowns x = any_point(random, kMostBlocks);
    const std::vector<BlockRow> rows = any_rows(random, kMostBlocks, kMostBlockRows, x);
    placed.solve(rows);
    check_solved(placed, rows, kMostBlocks);
    CHECK_FALSE(placed.program.push(BlockRow{}));
  }

  TEST_CASE("values that are no finite numbers do not reach z") {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinite = std::numeric_limits<double>::infinity();
    Random random(58);
    PlacedProgram alone(3, 30), placed(3, 33);
    const Unknowns x = any_point(random, 3);
    std::vector<BlockRow> rows = any_rows(random, 3, 30, x);
    alone.solve(rows);
    rows.push_back(single(0, {nan, 0, 0, 0, 0, 0}, 1));
    rows.push_back(single(1, {1, 0, 0, 0, 0, 0}, nan));
    rows.push_back(single(2, {1, 0, 0, 0, 0, 0}, infinite));
    placed.solve(rows);
    CHECK(placed.program.skipped() == 1);
    CHECK(placed.z(3) == alone.z(3));
  }
}
