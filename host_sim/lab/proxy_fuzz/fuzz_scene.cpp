// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/proxy_fuzz/fuzz_scene.hpp"

#include <algorithm>
#include <cmath>

namespace haptic::sim {
namespace {

constexpr std::uint64_t kShapeSeed = 41;
constexpr double kExactBand_m = 5e-3;
constexpr double kPlateHalf_m = 0.05;

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

/// Upright prism over a convex outline in x and z, counter-clockwise seen from -y.
Solid extruded(const std::string& name, const std::vector<Vector>& outline, double half_y_m) {
  Solid solid;
  solid.name = name;
  const auto count = static_cast<std::uint32_t>(outline.size());
  for (const double y : {-half_y_m, half_y_m}) {
    for (const Vector& v : outline) solid.vertices.emplace_back(v[0], y, v[2]);
  }
  solid.loops.resize(2);
  for (std::uint32_t k = 0; k < count; ++k) {
    const std::uint32_t next = (k + 1) % count;
    solid.loops[0].push_back(k);
    solid.loops[1].push_back(2 * count - 1 - k);
    solid.loops.push_back({k, k + count, next + count, next});
  }
  return solid;
}

/// A wedge that tapers downwards by 1 degree, and the groove that it fits.
FuzzScene groove_scene() {
  const double slope = std::tan(0.5 * 3.14159265358979 / 180.0);
  constexpr double kHalf_m = 0.005, kDeep_m = 0.03, kOut_m = 0.03;
  FuzzScene scene;
  scene.name = "wedge of 1 degree";
  const double top = kHalf_m + kDeep_m * slope;
  scene.part = extruded("wedge",
                        {{-kHalf_m, 0, -kDeep_m / 2},
                         {kHalf_m, 0, -kDeep_m / 2},
                         {top, 0, kDeep_m / 2},
                         {-top, 0, kDeep_m / 2}},
                        0.01);
  const double low = kHalf_m - kDeep_m / 2 * slope, high = kHalf_m + kDeep_m / 2 * slope;
  scene.pieces = {extruded("right",
                           {{low, 0, -kDeep_m / 2},
                            {kOut_m, 0, -kDeep_m / 2},
                            {kOut_m, 0, kDeep_m / 2},
                            {high, 0, kDeep_m / 2}},
                           0.02),
                  extruded("left",
                           {{-kOut_m, 0, -kDeep_m / 2},
                            {-low, 0, -kDeep_m / 2},
                            {-high, 0, kDeep_m / 2},
                            {-kOut_m, 0, kDeep_m / 2}},
                           0.02)};
  scene.home = Vector(0, 0, 0.008);
  scene.range = Vector(0.003, 0.01, 0.02);
  scene.tilt_rad = 0.15;
  scene.start = Vector(0, 0, 0.04);
  return scene;
}

/// A box on a floor under a ceiling that comes down by 1 degree.
FuzzScene ceiling_scene() {
  const double slope = std::tan(3.14159265358979 / 180.0);
  constexpr double kHalf_m = 0.01, kLong_m = 0.08, kThick_m = 0.01;
  FuzzScene scene;
  scene.name = "ceiling of 1 degree";
  scene.part = centred_box("box", 0.02, 0.015, kHalf_m);
  const double low = kHalf_m - kLong_m * slope, high = kHalf_m + kLong_m * slope;
  scene.pieces = {
      box_solid("floor", {-kLong_m, -0.05, -kHalf_m - kThick_m}, {kLong_m, 0.05, -kHalf_m}),
      extruded("ceiling",
               {{-kLong_m, 0, high},
                {kLong_m, 0, low},
                {kLong_m, 0, high + kThick_m},
                {-kLong_m, 0, high + kThick_m}},
               0.05)};
  scene.home = Vector(0, 0, 0);
  scene.range = Vector(0.03, 0.02, 0.004);
  scene.tilt_rad = 0.1;
  scene.start = Vector(-0.13, 0, 0);
  return scene;
}

}  // namespace

Solid placed(Solid solid, const Rotation& q, const Vector& p) {
  for (Vector& v : solid.vertices) v = q * v + p;
  return solid;
}

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

std::vector<FuzzScene> hold_scenes() {
  std::vector<FuzzScene> scenes = fuzz_scenes();
  const auto smaller = [](FuzzScene scene) {
    constexpr double kShare = 1.0 / 500;
    const auto shrink = [&](Solid& solid) {
      for (Vector& v : solid.vertices) v *= kShare;
    };
    shrink(scene.part);
    std::ranges::for_each(scene.pieces, shrink);
    scene.home *= kShare;
    scene.range *= kShare;
    scene.start *= kShare;
    scene.plate.reset();
    scene.name += ", 1:500";
    return scene;
  };
  const FuzzScene small[] = {smaller(scenes[0]), smaller(scenes[1]), smaller(scenes[7])};
  scenes.push_back(peg_scene("peg, clearance 1 um", 1e-6));
  scenes.push_back(groove_scene());
  scenes.push_back(ceiling_scene());
  scenes.insert(scenes.end(), std::begin(small), std::end(small));
  return scenes;
}

std::vector<std::byte> compiled(const FuzzScene& scene, double friction, std::uint32_t passes,
                                std::uint32_t work_units) {
  tools::SceneDescription description;
  description.name = scene.name;
  description.moving.body = united_body({&scene.part, 1});
  tools::PlacedBody obstacle;
  obstacle.body = united_body(scene.pieces);
  obstacle.friction = friction;
  description.statics.push_back(obstacle);
  SceneParameters& parameters = description.parameters;
  parameters.law = LawId::kProxy;
  parameters.k_f_n_per_m = kFuzzStiffness_n_per_m;
  parameters.exact_band_m = kExactBand_m;
  if (scene.device) {
    parameters.device.given = 1;
    parameters.device.mass_kg = 0.1;
    parameters.device.damping_ns_per_m = 1.0;
    parameters.coupling.damping_ns_per_m = 0.5;  // what such a device can hold
    parameters.coupling.passivity = 1;
  }
  parameters.coupling.passes = passes;
  parameters.work_units = work_units;
  return tools::write_scene(description);
}

}  // namespace haptic::sim
