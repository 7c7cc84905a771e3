// SPDX-License-Identifier: Apache-2.0
#include "tests/host_sim/sample_scenes.hpp"

#include <cmath>
#include <numbers>

#include "host_sim/lab/golden/golden_check.hpp"

namespace haptic::sim::test {

GoldenBody box(double x, double y, double z) {
  GoldenBody body;
  body.name = "box";
  for (const Wide sx : {-1.0L, 1.0L}) {
    for (const Wide sy : {-1.0L, 1.0L}) {
      for (const Wide sz : {-1.0L, 1.0L}) {
        body.vertices.push_back({sx * widen(x), sy * widen(y), sz * widen(z)});
      }
    }
  }
  body.loops = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
  return body;
}

GoldenBody tetrahedron() {
  GoldenBody body;
  body.name = "tetrahedron";
  body.vertices = {{-0.05L, -0.03L, -0.02L},
                   {0.06L, -0.02L, -0.03L},
                   {0, 0.07L, -0.025L},
                   {0.01L, 0.005L, 0.06L}};
  body.loops = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  return body;
}

GoldenBody prism(std::uint32_t sides, double radius, double half_height) {
  GoldenBody body;
  body.name = "prism";
  std::vector<std::uint32_t> top, bottom;
  for (std::uint32_t k = 0; k < sides; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / sides;
    const Wide x = widen(radius * std::cos(angle)), y = widen(radius * std::sin(angle));
    body.vertices.push_back({x, y, -widen(half_height)});
    body.vertices.push_back({x, y, widen(half_height)});
    top.push_back(2 * k + 1);
    bottom.insert(bottom.begin(), 2 * k);
    const std::uint32_t next = 2 * ((k + 1) % sides);
    body.loops.push_back({2 * k, next, next + 1, 2 * k + 1});
  }
  body.loops.push_back(top);
  body.loops.push_back(bottom);
  return body;
}

std::vector<std::byte> scene_of(const GoldenBody& a, const GoldenBody& b) {
  GoldenFile file;
  file.family = a.name + " on " + b.name;
  file.k_f_n_per_m = 1000;
  file.a = a;
  file.b = b;
  return tools::write_scene(golden_scene(file, 1e-4));
}

OraclePiece piece_of(const GoldenBody& body) {
  return make_oracle_piece(body.vertices, body.loops);
}

std::vector<MotionSample> smooth_path(std::uint64_t seed, std::size_t ticks,
                                      const PathShape& shape) {
  Random random(seed);
  struct Wave {
    double amplitude, frequency, phase;
  };
  Wave waves[6][3];
  for (auto& axis : waves) {
    for (Wave& w : axis)
      w = {0.3 + 0.7 * random.next(), 0.3 + 2.0 * random.next(),
           2.0 * std::numbers::pi * random.next()};
  }
  double start[3];
  for (double& angle : start) angle = shape.aligned ? 0.0 : 2.0 * std::numbers::pi * random.next();
  std::vector<MotionSample> motion(ticks);
  for (std::size_t i = 0; i < ticks; ++i) {
    MotionSample& s = motion[i];
    s.t_s = static_cast<double>(i) * 1e-3;
    double value[6];
    for (std::size_t k = 0; k < 6; ++k) {
      value[k] = 0.0;
      for (const Wave& w : waves[k])
        value[k] += w.amplitude / 3 * std::sin(6.28 * w.frequency * s.t_s + w.phase);
    }
    for (std::size_t k = 0; k < 3; ++k) s.p[k] = shape.centre_m[k] + shape.amplitude_m * value[k];
    // Three half turns about x, y, z one after the other: any smooth curve of orientations will do.
    double q[4] = {1, 0, 0, 0};
    for (std::size_t k = 0; k < 3; ++k) {
      const double half = 0.5 * (start[k] + shape.turn_rad * value[3 + k]);
      double r[4] = {std::cos(half), 0, 0, 0};
      r[1 + k] = std::sin(half);
      const double p[4] = {q[0] * r[0] - q[1] * r[1] - q[2] * r[2] - q[3] * r[3],
                           q[0] * r[1] + q[1] * r[0] + q[2] * r[3] - q[3] * r[2],
                           q[0] * r[2] - q[1] * r[3] + q[2] * r[0] + q[3] * r[1],
                           q[0] * r[3] + q[1] * r[2] - q[2] * r[1] + q[3] * r[0]};
      for (std::size_t j = 0; j < 4; ++j) q[j] = p[j];
    }
    for (std::size_t j = 0; j < 4; ++j) s.q_wxyz[j] = q[j];
  }
  return motion;
}

}  // namespace haptic::sim::test
