// SPDX-License-Identifier: Apache-2.0
// The scene of a golden file: bodies as convex pieces, numbered as in the file.
#include <algorithm>

#include "host_sim/lab/golden/golden_check.hpp"
#include "host_sim/oracle/oracle_piece.hpp"
#include "rt_core/base/scalar.hpp"

namespace haptic::sim {
namespace {

std::array<double, 3> rounded(const WideVec& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

/// Planes in long double from the vertices as they stand in the file, rounded once.
tools::Body body_of(const GoldenBody& golden) {
  tools::Body body;
  body.name = golden.name;
  tools::ConvexPiece piece;
  for (std::size_t v = 0; v < golden.vertices.size(); ++v) {
    piece.vertices.push_back(rounded(golden.vertices[v]));
    piece.source_vertex.push_back(static_cast<std::int64_t>(v));
  }
  const WideVec& origin = golden.vertices.front();
  Wide volume = 0;
  WideVec moment;
  for (std::size_t f = 0; f < golden.loops.size(); ++f) {
    const auto& loop = golden.loops[f];
    const WideVec n = polygon_normal(golden.vertices, loop);
    body.planes.push_back({rounded(n), static_cast<double>(dot(n, golden.vertices[loop.front()]))});
    tools::PieceFace face;
    face.plane = static_cast<std::uint32_t>(f);
    face.loop = loop;
    face.source_face = static_cast<std::int64_t>(f);
    piece.faces.push_back(face);
    for (std::size_t k = 1; k + 1 < loop.size();
         ++k) {  // tetrahedra from one vertex: signed volumes
      const WideVec a = golden.vertices[loop.front()] - origin,
                    b = golden.vertices[loop[k]] - origin,
                    c = golden.vertices[loop[k + 1]] - origin;
      const Wide six = dot(a, cross(b, c));
      volume += six / 6;
      moment = moment + (six / 24) * (a + b + c);
    }
  }
  piece.volume_m3 = body.volume_m3 = static_cast<double>(volume);
  body.centre_of_volume_m = rounded(origin + (1.0L / volume) * moment);
  body.pieces.push_back(std::move(piece));
  return body;
}

}  // namespace

tools::SceneDescription golden_scene(const GoldenFile& file, double epsilon_m) {
  tools::SceneDescription scene;
  scene.name = file.family;
  scene.moving.body = body_of(file.a);
  scene.statics.push_back({body_of(file.b), {0, 0, 0}, {1, 0, 0, 0}});
  scene.grip_m = {0, 0, 0};
  scene.parameters.law = LawId::kPaper;
  scene.parameters.k_f_n_per_m = static_cast<double>(file.k_f_n_per_m);
  scene.parameters.epsilon_m = epsilon_m;
  scene.parameters.rate_hz = 1000.0;
  scene.parameters.exact_band_m = kMaxSceneLength_m;  // D_near is compared at any distance
  return scene;
}

double golden_epsilon_m(const GoldenFile& file) {
  const Wide size = std::max(diameter(file.a.vertices), diameter(file.b.vertices));
  Wide epsilon = 1e-9L * size, coordinate = 0;
  for (const GoldenCase& c : file.cases) {
    if (c.gap_to_next_m) epsilon = std::min(epsilon, *c.gap_to_next_m / 4);
    if (c.min_violation_of_rejected_m)
      epsilon = std::min(epsilon, *c.min_violation_of_rejected_m / 4);
    coordinate = std::max(coordinate, norm(c.x));
  }
  for (const WideVec& v : file.b.vertices) coordinate = std::max(coordinate, norm(v));
  return static_cast<double>(
      std::max(epsilon, 64 * widen(kRealEpsilon) * std::max(coordinate, size)));
}

}  // namespace haptic::sim
