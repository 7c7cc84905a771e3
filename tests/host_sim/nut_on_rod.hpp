// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Scenes of many facets, and how far these are apart by their corners alone.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/oracle/triangle_pair.hpp"
#include "rt_core/base/pose.hpp"
#include "rt_core/scene/scene_view.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

namespace haptic::sim {

/// A nut of one turn on a threaded rod, both as surfaces.
inline std::vector<std::byte> nut_on_rod() {
  const std::string thread =
      "shape = \"thread\"\nsize = \"M16\"\nsegments = 12\nclearance_m = 2e-4\nas = \"surface\"\n";
  const std::string toml = "format = 1\nname = \"nut_on_rod\"\n[moving]\n" + thread +
                           "internal = true\nouter_radius_m = 0.012\nturns = 1\n[[static]]\n" +
                           thread + "turns = 3\n[rendering]\nk_f_n_per_m = 1000.0\n";
  return tools::compile_scene(tools::parse_scene_file(toml, "scene.toml", "."), {}).bytes;
}

/// How the plate below lies.
inline Quat plate_turn() { return Quat(0.9_r, 0.3_r, 0.2_r, std::sqrt(Real{1} - 0.94_r)); }

/// A ball of small facets, 5 mm of radius about its grip, and a plate 0.2 m wide and 10 mm thick
/// about the origin, askew: its corners are far from the ball along every axis.
inline std::vector<std::byte> ball_on_plate() {
  const std::string toml =
      "format = 1\nname = \"ball_on_plate\"\n[moving]\nshape = \"sphere\"\nradius_m = 0.005\n"
      "segments = 32\nas = \"surface\"\nposition_m = [0.0, 0.0, 0.2]\n[[static]]\n"
      "shape = \"box\"\nsize_m = [0.2, 0.2, 0.01]\nas = \"surface\"\n"
      "quaternion = { w = 0.9, x = 0.3, y = 0.2, z = 0.24494897427831781 }\n"
      "[rendering]\nk_f_n_per_m = 1000.0\n";
  return tools::compile_scene(tools::parse_scene_file(toml, "scene.toml", "."), {}).bytes;
}

/// Distance of two flat facets from their corners.
inline double facet_distance(const PieceView& a, const GripPose& p, const PieceView& b) {
  const auto triangle = [](const PieceView& piece, std::uint32_t k, const auto& placed) {
    Triangle t;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t at = c == 0 ? 0 : k + c;
      const Vec3 v = placed(piece.vertex(piece.face_vertices(0)[at]));
      t[c] = WideVec{widen(v[0]), widen(v[1]), widen(v[2])};
    }
    return t;
  };
  const auto of_a = [&](const Vec3& v) { return Vec3(p.r_wa * v + p.x0_w); };
  const auto of_b = [](const Vec3& v) { return v; };
  Wide least = std::numeric_limits<Wide>::max();
  for (std::uint32_t i = 0; i + 2 < a.faces[0].loop_count; ++i) {
    for (std::uint32_t j = 0; j + 2 < b.faces[0].loop_count; ++j) {
      least = std::min(least, triangle_distance(triangle(a, i, of_a), triangle(b, j, of_b)));
    }
  }
  return static_cast<double>(least);
}

/// The same between balls round them, a lower bound of it.
inline double ball_distance(const PieceView& a, const GripPose& p, const PieceView& b) {
  const auto ball = [](const PieceView& piece) {
    Vec3 middle = Vec3::Zero();
    for (std::uint32_t v = 0; v < piece.vertex_count; ++v) middle += piece.vertex(v);
    middle /= static_cast<Real>(piece.vertex_count);
    Real radius = 0;
    for (std::uint32_t v = 0; v < piece.vertex_count; ++v)
      radius = std::max(radius, (piece.vertex(v) - middle).norm());
    return std::pair{middle, radius};
  };
  const auto [of_a, reach_a] = ball(a);
  const auto [of_b, reach_b] = ball(b);
  return static_cast<double>((p.r_wa * of_a + p.x0_w - of_b).norm() - reach_a - reach_b);
}

}  // namespace haptic::sim
