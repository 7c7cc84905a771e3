// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/proxy_fuzz/fuzz_scene.hpp"

#include <cmath>

namespace haptic::sim {
namespace {

constexpr std::uint64_t kShapeSeed = 41;
constexpr double kExactBand_m = 5e-3;
constexpr double kPlateHalf_m = 0.05;

/// The solid turned and then moved.
Solid placed(Solid solid, const Rotation& q, const Vector& p) {
  for (Vector& v : solid.vertices) v = q * v + p;
  return solid;
}

FuzzScene over(const std::string& name, Solid part, Solid obstacle, const Vector& range,
               double share) {
  FuzzScene scene;
  scene.name = name;
  scene.part = std::move(part);
  scene.pieces.push_back(std::move(obstacle));
  scene.range = range;
  scene.share = share;
  return scene;
}

FuzzScene plate_scene(const std::string& name, double thickness_m, Solid part) {
  FuzzScene scene =
      over(name, std::move(part), centred_box("plate", kPlateHalf_m, kPlateHalf_m, thickness_m / 2),
           {0.05, 0.05, 0.04}, 1);
  scene.plate = FuzzPlate{kPlateHalf_m, kPlateHalf_m};
  return scene;
}

FuzzScene peg_scene(const std::string& name, double clearance_m) {
  FuzzScene scene;
  scene.name = name;
  scene.part = square_peg();
  scene.pieces = five_piece_hole(0.010 + clearance_m);
  scene.home = Vector(0, 0, 0.01);
  scene.range = Vector(0.004, 0.004, 0.025);
  scene.tilt_rad = 0.15;
  scene.start = Vector(0, 0, 0.032);
  scene.share = 0.7;
  return scene;
}

/// Three slabs that meet in a corner at the origin; the part comes from the first octant.
FuzzScene corner_scene() {
  constexpr double kSide_m = 0.1, kThick_m = 0.02;
  FuzzScene scene;
  scene.name = "three-plane corner";
  scene.part = centred_box("box", 0.03, 0.025, 0.02);
  scene.pieces = {box_solid("slab z", {-kThick_m, -kThick_m, -kThick_m}, {kSide_m, kSide_m, 0}),
                  box_solid("slab x", {-kThick_m, -kThick_m, 0}, {0, kSide_m, kSide_m}),
                  box_solid("slab y", {0, -kThick_m, 0}, {kSide_m, 0, kSide_m})};
  scene.home = Vector(0.03, 0.025, 0.02);
  scene.range = Vector(0.02, 0.02, 0.02);
  scene.tilt_rad = 0.6;
  scene.start = Vector(0.06, 0.06, 0.06);
  return scene;
}

/// Eight cubes at random, some of them overlapping.
FuzzScene cube_scene() {
  Seeded random(kShapeSeed);
  FuzzScene scene;
  scene.name = "eight cubes";
  scene.part = centred_box("box", 0.02, 0.015, 0.01);
  for (int k = 0; k < 8; ++k) {
    const double half = random.uniform(0.008, 0.02);
    const Vector at = 0.045 * random.direction();
    scene.pieces.push_back(placed(centred_box("cube", half, half, half), random.rotation(), at));
  }
  scene.range = Vector(0.05, 0.05, 0.05);
  scene.share = 0.6;
  return scene;
}

/// A plate cut into five by planes along y: seams without a step.
FuzzScene seam_scene() {
  FuzzScene scene;
  scene.name = "five-piece plate";
  scene.part = centred_box("box", 0.02, 0.015, 0.01);
  constexpr double kCuts_m[] = {-0.05, -0.031, -0.013, 0.008, 0.027, 0.05};
  for (int k = 0; k < 5; ++k) {
    scene.pieces.push_back(
        box_solid("piece", {kCuts_m[k], -0.05, -0.005}, {kCuts_m[k + 1], 0.05, 0.005}));
  }
  scene.range = Vector(0.055, 0.04, 0.02);
  scene.tilt_rad = 0.5;
  scene.share = 0.8;
  return scene;
}

}  // namespace

std::vector<FuzzScene> fuzz_scenes() {
  const Solid box = centred_box("box", 0.03, 0.025, 0.02);
  const Solid needle = centred_box("needle", 0.05, 0.0005, 0.0005);
  const Vector round(0.06, 0.06, 0.06);
  const Vector axes(0.05, 0.04, 0.03);
  std::vector<FuzzScene> scenes;
  scenes.push_back(over("box, box", box, paper_box(), round, 1));
  scenes.push_back(over("tetrahedron, box", paper_tetrahedron(), paper_box(), round, 1));
  scenes.push_back(over("12-prism, 12-prism", prism_solid(12, 0.03, 0.06),
                        prism_solid(12, 0.04, 0.05), {0.05, 0.05, 0.05}, 0.7));
  scenes.push_back(plate_scene("plate 0.5 mm, box", 0.5e-3, box));
  scenes.push_back(plate_scene("plate 1 mm, tetrahedron", 1e-3, paper_tetrahedron()));
  scenes.push_back(
      plate_scene("plate 0.5 mm, plate 1 mm", 0.5e-3, centred_box("plate", 0.03, 0.02, 0.5e-3)));
  scenes.push_back(peg_scene("peg, clearance 1 mm", 1e-3));
  scenes.push_back(peg_scene("peg, clearance 0.1 mm", 1e-4));
  scenes.push_back(peg_scene("peg, clearance 0.01 mm", 1e-5));
  scenes.push_back(corner_scene());
  scenes.push_back(cube_scene());
  scenes.push_back(over("hull 30, hull 30", ellipsoid_hull(30, axes, kShapeSeed),
                        ellipsoid_hull(30, axes, kShapeSeed + 1), {0.05, 0.05, 0.05}, 0.4));
  scenes.push_back(seam_scene());
  scenes.push_back(over("64-prism, 64-prism", prism_solid(64, 0.03, 0.06),
                        prism_solid(64, 0.04, 0.05), {0.05, 0.05, 0.05}, 0.2));
  scenes.push_back(over("needle, needle", needle,
                        placed(needle, Rotation(0.6, 0, 0, 0.8), {0, 0, 0}), {0.03, 0.03, 0.004},
                        0.8));
  scenes.push_back(over("needle, box", needle, paper_box(), round, 0.8));
  return scenes;
}

std::vector<std::byte> compiled(const FuzzScene& scene, double friction) {
  tools::SceneDescription description;
  description.name = scene.name;
  description.moving.body = united_body({&scene.part, 1});
  tools::PlacedBody obstacle;
  obstacle.body = united_body(scene.pieces);
  obstacle.friction = friction;
  description.statics.push_back(obstacle);
  description.parameters.law = LawId::kProxy;
  description.parameters.k_f_n_per_m = kFuzzStiffness_n_per_m;
  description.parameters.exact_band_m = kExactBand_m;
  return tools::write_scene(description);
}

}  // namespace haptic::sim
