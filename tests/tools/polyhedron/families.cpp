// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/polyhedron/families.hpp"

namespace haptic::tools::test {

namespace {

FlatBody body_of_cells(const std::set<Cell>& occupied, const AffineMap& map) {
  FlatBody body = empty_body();
  add_solid(body, cells(body, occupied, map));
  return body;
}

AffineMap map_for(std::uint64_t seed) {
  return seed % 2 == 1 ? general_map(5) : AffineMap{{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, 5};
}

}  // namespace

AffineMap general_map(long size) { return AffineMap::rotation(7, 2, -3, 5, size); }

FlatBody l_prism(const AffineMap& map) {
  FlatBody body = empty_body();
  add_solid(body,
            prism(body, {{{0, 0}, {60, 0}, {60, 20}, {20, 20}, {20, 60}, {0, 60}}}, 0, 30, map));
  return body;
}

FlatBody plate_with_hole(std::size_t corners, const AffineMap& map) {
  FlatBody body = empty_body();
  add_solid(body, prism(body,
                        {{{-5000, -5000}, {5000, -5000}, {5000, 5000}, {-5000, 5000}},
                         reversed(polygon(corners, 100, 50, 3000))},
                        0, 3000, map));
  return body;
}

FlatBody plate_with_grid(int k, const AffineMap& map) {
  FlatBody body = empty_body();
  const long side = 30 * k + 10;
  std::vector<std::vector<Point2i>> loops{{{0, 0}, {side, 0}, {side, side}, {0, side}}};
  for (int i = 0; i < k; ++i) {
    for (int j = 0; j < k; ++j) {
      const long x = 30 * i + 10;
      const long y = 30 * j + 10;
      loops.push_back(reversed({{x, y}, {x + 20, y}, {x + 20, y + 20}, {x, y + 20}}));
    }
  }
  add_solid(body, prism(body, loops, 0, 30, map));
  return body;
}

FlatBody plate_with_turned_holes(int k, std::uint64_t seed, const AffineMap& map) {
  FlatBody body = empty_body();
  TestRandom random(seed);
  const long side = 1000 * k;
  std::vector<std::vector<Point2i>> loops{{{0, 0}, {side, 0}, {side, side}, {0, side}}};
  for (int i = 0; i < k; ++i) {
    for (int j = 0; j < k; ++j) {
      const long x = 1000 * i + 500;
      const long y = 1000 * j + 500;
      const long c = random.between(100, 300);
      const long d = random.between(100, 300);
      loops.push_back(reversed({{x + c, y + d}, {x - d, y + c}, {x - c, y - d}, {x + d, y - c}}));
    }
  }
  add_solid(body, prism(body, loops, 0, 300, map));
  return body;
}

FlatBody hollow_cube(const AffineMap& map) {
  std::set<Cell> occupied;
  for (int x = 0; x < 3; ++x) {
    for (int y = 0; y < 3; ++y) {
      for (int z = 0; z < 3; ++z) occupied.insert({x, y, z});
    }
  }
  occupied.erase({1, 1, 1});
  return body_of_cells(occupied, map);
}

FlatBody random_boxes(std::uint64_t seed) {
  TestRandom random(seed);
  const long n = random.between(2, 5);
  const long boxes = random.between(1, 6);
  std::set<Cell> occupied;
  for (long b = 0; b < boxes; ++b) {
    std::array<int, 3> low{};
    std::array<int, 3> high{};
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = static_cast<int>(random.between(0, n - 1));
      high[i] = static_cast<int>(random.between(low[i], n - 1));
    }
    for (int x = low[0]; x <= high[0]; ++x) {
      for (int y = low[1]; y <= high[1]; ++y) {
        for (int z = low[2]; z <= high[2]; ++z) occupied.insert({x, y, z});
      }
    }
  }
  return body_of_cells(occupied, map_for(seed));
}

FlatBody random_cells(std::uint64_t seed) {
  TestRandom random(seed);
  const int n = static_cast<int>(random.between(2, 4));
  std::set<Cell> occupied{{0, 0, 0}};
  for (int x = 0; x < n; ++x) {
    for (int y = 0; y < n; ++y) {
      for (int z = 0; z < n; ++z) {
        if (random.between(0, 1) == 1) occupied.insert({x, y, z});
      }
    }
  }
  return body_of_cells(occupied, map_for(seed));
}

}  // namespace haptic::tools::test
