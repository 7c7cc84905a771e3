// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/stability/extreme_scene.hpp"

#include <algorithm>
#include <cmath>

namespace haptic::sim {
namespace {

std::vector<double> powers(int low, int high, int step) {
  std::vector<double> list;
  for (int k = low; k <= high; k += step) list.push_back(std::pow(10.0, k));
  return list;
}

ExtremeScene sized_pair(double size_m) {
  ExtremeScene scene;
  scene.family = "size";
  scene.parameter = scene.size_m = size_m;
  scene.unit = "m";
  scene.a = scaled(paper_tetrahedron(), 10 * size_m);  // drawn at 0.1 m
  scene.b = scaled(paper_box(), 10 * size_m);
  return scene;
}

/// Small turns about one axis, which leave faces and edges the angle away from parallel.
ExtremeScene nearly_parallel(const char* family, double angle_rad, const Vector& axis) {
  ExtremeScene scene;
  scene.family = family;
  scene.parameter = angle_rad;
  scene.unit = "rad";
  scene.a = centred_box("cube", 0.03, 0.03, 0.03);
  scene.b = centred_box("block", 0.05, 0.04, 0.03);
  scene.rotation = [angle_rad, axis](Seeded& random) {
    // One of the quarter turns first: a different pair of faces each time.
    const Vector about = Vector::Unit(static_cast<int>(random.below(3)));
    const double turn = static_cast<double>(random.below(4)) * 0.5 * std::acos(-1.0);
    const Vector half = std::sin(0.5 * angle_rad) * axis.normalized();
    const Rotation small(std::cos(0.5 * angle_rad), half[0], half[1], half[2]);
    return Rotation(small * Rotation(Eigen::AngleAxisd(turn, about))).normalized();
  };
  return scene;
}

void add_slender(std::vector<ExtremeScene>& scenes, bool quick) {
  for (const double aspect : powers(1, 6, quick ? 5 : 1)) {
    ExtremeScene needle;
    needle.family = "needle";
    needle.parameter = aspect;
    needle.unit = "length / width";
    needle.a = centred_box("needle", 0.05 / aspect, 0.05 / aspect, 0.05);
    needle.b = centred_box("box", 0.05, 0.04, 0.03);
    scenes.push_back(needle);
    ExtremeScene plate = needle;
    plate.family = "plate";
    plate.unit = "width / thickness";
    plate.a = scaled(paper_tetrahedron(), 1);
    plate.b = centred_box("plate", 0.05, 0.05, 0.05 / aspect);
    scenes.push_back(plate);
  }
  ExtremeScene crossed;
  crossed.family = "needle_on_plate";
  crossed.parameter = 1e6;
  crossed.unit = "both aspects";
  crossed.a = centred_box("needle", 5e-8, 5e-8, 0.05);
  crossed.b = centred_box("plate", 0.05, 0.05, 5e-8);
  scenes.push_back(crossed);
}

void add_round(std::vector<ExtremeScene>& scenes, bool quick) {
  for (std::uint32_t sides = 8; sides <= 64; sides *= quick ? 8 : 2) {
    ExtremeScene scene;
    scene.family = "prisms";
    scene.parameter = sides;
    scene.unit = "vertices of a face";
    scene.a = prism_solid(sides, 0.04, 0.05);
    scene.b = prism_solid(sides, 0.05, 0.06);
    scenes.push_back(scene);
    // Face on face, one a seeded yaw against the other: all side edges nearly vertical.
    scene.family = "prisms_upright";
    scene.rotation = [](Seeded& random) {
      return Rotation(Eigen::AngleAxisd(random.uniform(-3.1, 3.1), Vector::UnitZ()));
    };
    scenes.push_back(scene);
  }
}

}  // namespace

Solid scaled(const Solid& solid, double factor) { return scaled(solid, Vector::Constant(factor)); }

Solid scaled(const Solid& solid, const Vector& factors) {
  Solid result = solid;
  for (Vector& v : result.vertices) v = v.cwiseProduct(factors);
  return result;
}

std::vector<ExtremeScene> extreme_scenes(bool quick) {
  std::vector<ExtremeScene> scenes;
  for (const double size_m : powers(-6, 3, quick ? 9 : 1)) scenes.push_back(sized_pair(size_m));
  for (const double offset_m : powers(0, 4, quick ? 4 : 1)) {
    ExtremeScene scene = sized_pair(0.1);
    scene.family = "offset";
    scene.parameter = offset_m;
    scene.place_w = Vector(1, -0.7, 0.6).normalized() * offset_m;
    scenes.push_back(scene);
  }
  add_slender(scenes, quick);
  for (const double angle_rad : powers(-16, -2, quick ? 7 : 1)) {
    scenes.push_back(nearly_parallel("parallel_faces", angle_rad, Vector(1, 0.3, 0)));
    scenes.push_back(nearly_parallel("parallel_edges", angle_rad, Vector(0, 0, 1)));
    scenes.push_back(nearly_parallel("parallel_all", angle_rad, Vector(1, -0.8, 0.6)));
  }
  add_round(scenes, quick);
  for (const double size_m : {1e-10, 1e8}) {
    scenes.push_back(sized_pair(size_m));
    scenes.back().family = "refused_size";
    scenes.back().refused = true;
  }
  ExtremeScene far = sized_pair(0.1);
  far.family = "refused_offset";
  far.parameter = 1e8;
  far.place_w = Vector(far.parameter, 0, 0);
  far.refused = true;
  scenes.push_back(far);
  return scenes;
}

std::vector<std::byte> compiled(const ExtremeScene& scene, LawId law) {
  tools::SceneDescription description;
  description.name = scene.a.name + " on " + scene.b.name;
  description.moving.body = united_body({&scene.a, 1});
  tools::PlacedBody obstacle;
  obstacle.body = united_body({&scene.b, 1});
  const Rotation& q = scene.turn_w;
  obstacle.quaternion_wxyz = {q.w(), q.x(), q.y(), q.z()};
  obstacle.position_m = {scene.place_w[0], scene.place_w[1], scene.place_w[2]};
  description.statics.push_back(obstacle);
  description.parameters.law = law;
  description.parameters.k_f_n_per_m = kExtremeStiffness_n_per_m;
  description.parameters.epsilon_m = 1e-3 * std::min(scene.size_m, 1e3);
  double radius_m = 0;
  for (const Vector& v : scene.a.vertices) radius_m = std::max(radius_m, v.norm());
  // Soft enough in rotation for a tilted face to come to lie flat.
  const double length_m = 0.75 * radius_m;
  description.parameters.coupling.k_r_nm_per_rad = kExtremeStiffness_n_per_m * length_m * length_m;
  description.parameters.exact_band_m = kMaxSceneLength_m;
  return tools::write_scene(description);
}

}  // namespace haptic::sim
