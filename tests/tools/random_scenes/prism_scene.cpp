// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/random_scenes/prism_scene.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <set>

namespace haptic::tools::test {

namespace {

constexpr int kColumns = 5, kLayers = 3;
using Cells = std::set<std::array<int, 3>>;

/// Cells that touch in an edge or a corner alone have no unique surface.
bool touches_badly(const Cells& cells) {
  for (int x = 0; x <= kColumns; ++x) {
    for (int y = 0; y <= kColumns; ++y) {
      for (int z = 0; z <= kLayers; ++z) {
        std::vector<std::array<int, 3>> full, empty;
        for (int k = 0; k < 8; ++k) {
          const std::array<int, 3> c{x - (k & 1), y - (k >> 1 & 1), z - (k >> 2)};
          (cells.contains(c) ? full : empty).push_back(c);
        }
        for (const auto* group : {&full, &empty}) {
          if (group->empty()) continue;
          std::vector<std::array<int, 3>> open{group->front()};
          std::set<std::array<int, 3>> seen{group->front()};
          while (!open.empty()) {
            const std::array<int, 3> c = open.back();
            open.pop_back();
            for (const std::array<int, 3>& d : *group) {
              const int steps =
                  std::abs(c[0] - d[0]) + std::abs(c[1] - d[1]) + std::abs(c[2] - d[2]);
              if (steps == 1 && seen.insert(d).second) open.push_back(d);
            }
          }
          if (seen.size() != group->size()) return true;
        }
      }
    }
  }
  return false;
}

Cells random_cells(SceneRandom& random) {
  while (true) {
    Cells cells;
    for (int b = random.between(2, 4); b > 0; --b) {
      std::array<int, 3> low{}, high{};
      for (std::size_t i = 0; i < 3; ++i) {
        const int n = i < 2 ? kColumns : kLayers;
        low[i] = random.between(0, n - 2);
        high[i] = random.between(low[i] + 1, n - 1);
      }
      for (int x = low[0]; x <= high[0]; ++x) {
        for (int y = low[1]; y <= high[1]; ++y) {
          for (int z = low[2]; z <= high[2]; ++z) cells.insert({x, y, z});
        }
      }
    }
    for (int h = random.between(1, 3); h > 0; --h) {  // holes through, along any axis
      const auto axis = static_cast<std::size_t>(random.between(0, 2));
      std::array<int, 3> at{random.between(1, kColumns - 2), random.between(1, kColumns - 2), 1};
      for (int k = 0; k < kColumns; ++k) {
        at[axis] = k;
        cells.erase(at);
      }
    }
    if (cells.size() > 8 && !touches_badly(cells)) return cells;
  }
}

}  // namespace

double SceneRandom::unit() {
  state_ ^= state_ >> 12U;
  state_ ^= state_ << 25U;
  state_ ^= state_ >> 27U;
  return static_cast<double>((state_ * 0x2545f4914f6cdd1dULL) >> 11U) * 0x1.0p-53;
}

int SceneRandom::between(int low, int high) {
  return low + static_cast<int>(unit() * (high - low + 1));
}

OraclePoint moved(const OraclePoint& p, const std::array<double, 4>& q,
                  const OraclePoint& position) {
  const double w = q[0], x = q[1], y = q[2], z = q[3], n = w * w + x * x + y * y + z * z;
  return {((w * w + x * x - y * y - z * z) * p[0] + 2 * (x * y - w * z) * p[1] +
           2 * (x * z + w * y) * p[2]) /
                  n +
              position[0],
          (2 * (x * y + w * z) * p[0] + (w * w - x * x + y * y - z * z) * p[1] +
           2 * (y * z - w * x) * p[2]) /
                  n +
              position[1],
          (2 * (x * z - w * y) * p[0] + 2 * (y * z + w * x) * p[1] +
           (w * w - x * x - y * y + z * z) * p[2]) /
                  n +
              position[2]};
}

PrismScene prism_scene(std::uint64_t seed) {
  SceneRandom random(seed);
  const Cells cells = random_cells(random);
  // Grid points of the plane, pushed by up to a quarter of a cell, on a grid of 2^-20 m.
  std::array<std::array<std::array<double, 2>, kColumns + 1>, kColumns + 1> column{};
  std::array<double, kLayers + 1> height{};
  const auto on_grid = [](double x) { return std::round(x * 0x1p20) * 0x1p-20; };
  for (int x = 0; x <= kColumns; ++x) {
    for (int y = 0; y <= kColumns; ++y) {
      auto& c = column[static_cast<std::size_t>(x)][static_cast<std::size_t>(y)];
      c[0] = on_grid(0.02 * (x + 0.5 * (random.unit() - 0.5)));
      c[1] = on_grid(0.02 * (y + 0.5 * (random.unit() - 0.5)));
    }
  }
  for (std::size_t z = 1; z <= kLayers; ++z) {
    height[z] = on_grid(height[z - 1] + 0.01 + 0.02 * random.unit());
  }
  const bool turned = seed % 2 == 1;
  const std::array<double, 4> q{1.0, random.unit(), random.unit() - 0.5, random.unit() - 0.5};
  PrismScene scene;
  scene.mesh.file = "scene " + std::to_string(seed);
  scene.mesh.indexed = true;
  scene.mesh.print_resolution = 1.0e-9;
  std::map<std::array<int, 3>, std::uint32_t> index;
  const auto vertex = [&](const std::array<int, 3>& g) {
    const auto [it, fresh] =
        index.emplace(g, static_cast<std::uint32_t>(scene.mesh.vertices.size()));
    if (fresh) {
      const auto& c = column[static_cast<std::size_t>(g[0])][static_cast<std::size_t>(g[1])];
      const OraclePoint p{c[0], c[1], height[static_cast<std::size_t>(g[2])]};
      scene.mesh.vertices.push_back(turned ? moved(p, q, {0, 0, 0}) : p);
    }
    return it->second;
  };
  for (const std::array<int, 3>& cell : cells) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        std::array<int, 3> next = cell;
        next[axis] += step;
        if (cells.contains(next)) continue;
        std::vector<std::uint32_t> loop;
        for (const std::array<int, 2>& corner : {std::array{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
          std::array<int, 3> g = cell;
          g[axis] += step > 0 ? 1 : 0;
          g[(axis + 1) % 3] += corner[0];
          g[(axis + 2) % 3] += corner[1];
          loop.push_back(vertex(g));
        }
        if (step < 0) std::reverse(loop.begin(), loop.end());
        scene.oracle.triangles.push_back({loop[0], loop[1], loop[2]});
        scene.oracle.triangles.push_back({loop[0], loop[2], loop[3]});
        scene.mesh.faces.push_back({std::move(loop), scene.mesh.faces.size() + 1, 0});
      }
    }
  }
  scene.mesh.vertex_places.assign(scene.mesh.vertices.size(), 0);
  scene.oracle.points = scene.mesh.vertices;
  // Quads: E = 2 F; the number of shells follows from a walk over the vertices of faces.
  std::vector<std::uint32_t> root(scene.mesh.vertices.size());
  for (std::uint32_t v = 0; v < root.size(); ++v) root[v] = v;
  const auto find = [&](std::uint32_t v) {
    while (root[v] != v) v = root[v];
    return v;
  };
  for (const RawFace& face : scene.mesh.faces) {
    for (const std::uint32_t v : face.vertices) root[find(v)] = find(face.vertices[0]);
  }
  int shells = 0;
  for (std::uint32_t v = 0; v < root.size(); ++v) shells += root[v] == v ? 1 : 0;
  const int euler = static_cast<int>(root.size()) - static_cast<int>(scene.mesh.faces.size());
  scene.genus = shells - euler / 2;
  return scene;
}

}  // namespace haptic::tools::test
