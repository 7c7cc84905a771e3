// SPDX-License-Identifier: Apache-2.0
/// Random sets of unit cubes: they touch in edges and corners, enclose cavities and islands, pass
/// through each other's holes. The volume is known exactly.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>

#include "tests/tools/mesh/mesh_builder.hpp"

namespace haptic::tools::test {
namespace {

constexpr int kSize = 4;

struct Voxels {
  std::array<bool, kSize * kSize * kSize> filled{};
  bool at(int x, int y, int z) const {
    const bool in = x >= 0 && y >= 0 && z >= 0 && x < kSize && y < kSize && z < kSize;
    return in && filled[static_cast<std::size_t>((z * kSize + y) * kSize + x)];
  }
};

/// Boundary squares of the cubes, with shared lattice points. `split`: some squares become two
/// triangles.
MeshBuilder boundary(const Voxels& voxels, std::mt19937& random, bool split) {
  MeshBuilder mesh;
  std::map<std::array<int, 3>, std::uint32_t> lattice;
  const auto corner = [&](const std::array<int, 3>& p) {
    const auto [it, fresh] = lattice.try_emplace(p, 0U);
    if (fresh) {
      it->second = mesh.vertex(
          {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
    }
    return it->second;
  };
  for (int i = 0; i < kSize * kSize * kSize; ++i) {
    const std::array<int, 3> cell = {i % kSize, i / kSize % kSize, i / kSize / kSize};
    if (!voxels.at(cell[0], cell[1], cell[2])) {
      continue;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const int side : {0, 1}) {
        std::array<int, 3> other = cell;
        other[axis] += side == 1 ? 1 : -1;
        if (voxels.at(other[0], other[1], other[2])) {
          continue;
        }
        std::vector<std::uint32_t> loop;
        const std::array<std::array<int, 2>, 4> around = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
        for (std::size_t k = 0; k < 4; ++k) {
          const auto& step = around[side == 1 ? k : 3 - k];
          std::array<int, 3> p = cell;
          p[axis] += side;
          p[(axis + 1) % 3] += step[0];
          p[(axis + 2) % 3] += step[1];
          loop.push_back(corner(p));
        }
        if (split && random() % 2 == 0) {
          mesh.face({loop[0], loop[1], loop[2]});
          mesh.face({loop[0], loop[2], loop[3]});
        } else {
          mesh.face(loop);
        }
      }
    }
  }
  return mesh;
}

void check_random_solids(unsigned first_seed, unsigned count) {
  for (unsigned seed = first_seed; seed < first_seed + count; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    Voxels voxels;
    int cubes = 0;
    const unsigned density = 2 + seed % 7;
    for (bool& cell : voxels.filled) {
      cell = random() % 10 < density;
      cubes += cell ? 1 : 0;
    }
    if (cubes == 0) {
      continue;
    }
    MeshBuilder mesh = boundary(voxels, random, seed % 2 == 0);
    if (seed % 3 == 0) {
      for (std::vector<std::uint32_t>& loop : mesh.faces) {
        // Few enough that most faces of each shell, cavities of six faces too, keep their side.
        if (random() % 64 == 0) {
          std::reverse(loop.begin(), loop.end());
        }
      }
    }
    if (seed % 5 == 0) {
      mesh.unshare();
      for (Point3& p : mesh.vertices) {
        for (double& x : p) {
          // Pairs stay within the weld radius, half of 5e-6 of a diagonal of at least sqrt(3).
          x += 1.0e-6 * (static_cast<double>(random() % 1000) / 1000.0 - 0.5);
        }
      }
    }
    const RawMesh raw = mesh.raw();
    REQUIRE_MESSAGE(refusal(raw).empty(), refusal(raw));
    const Surface surface = clean(raw);
    CHECK(violation(surface) == "");
    CHECK(volume(surface) == doctest::Approx(cubes).epsilon(1e-4));
  }
}

/// Drops, repeats, turns and bends faces at random: the result is refused or it keeps every
/// promise.
void check_damaged_solids(unsigned first_seed, unsigned count) {
  unsigned accepted = 0;
  unsigned refused = 0;
  for (unsigned seed = first_seed; seed < first_seed + count; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    Voxels voxels;
    for (bool& cell : voxels.filled) {
      cell = random() % 10 < 4;
    }
    MeshBuilder mesh = boundary(voxels, random, true);
    const auto any = [&](std::size_t size) { return static_cast<std::size_t>(random() % size); };
    for (unsigned damages = 1 + random() % 4; damages-- > 0;) {
      std::vector<std::uint32_t>& loop = mesh.faces[any(mesh.faces.size())];
      switch (random() % 6) {
        case 0:
          loop = mesh.faces[any(mesh.faces.size())];
          break;
        case 1:
          mesh.face(std::vector<std::uint32_t>(loop.rbegin(), loop.rend()));
          break;
        case 2:
          std::swap(loop[0], loop[1 + any(loop.size() - 1)]);
          break;
        case 3:
          loop[any(loop.size())] = static_cast<std::uint32_t>(any(mesh.vertices.size()));
          break;
        case 4:
          mesh.vertices[any(mesh.vertices.size())] = mesh.vertices[any(mesh.vertices.size())];
          break;
        default:
          mesh.vertices[any(mesh.vertices.size())][any(3)] += 0.25;
      }
    }
    if (random() % 2 == 0) {
      mesh.unshare();
    }
    const RawMesh raw = mesh.raw();
    if (refusal(raw).empty()) {
      CHECK(violation(clean(raw)) == "");
      ++accepted;
    } else {
      ++refused;
    }
  }
  CHECK(accepted > count / 20);
  CHECK(refused > count / 20);
}

}  // namespace

TEST_SUITE("tools.mesh_cleaning") {
  TEST_CASE("voxel solids: closed, oriented, exact volume") { check_random_solids(1, 400); }
  TEST_CASE("damaged voxel solids: refused or valid") { check_damaged_solids(1, 600); }
  TEST_CASE("damaged voxel solids: many of them [long]") { check_damaged_solids(1000, 30000); }
  TEST_CASE("voxel solids: many of them [long]") { check_random_solids(1000, 20000); }
}

}  // namespace haptic::tools::test
