// SPDX-License-Identifier: Apache-2.0
// The opponents of the default law: fields and points against closed forms, each method on a box
// that is pressed on a block, and the rows of a short run.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "host_sim/lab/pareto/opponents.hpp"
#include "host_sim/lab/pareto/pareto_report.hpp"
#include "host_sim/lab/peers/peer_catalog.hpp"
#include "host_sim/lab/peers/voxel_peer.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

constexpr double kHalf_m = 0.01;  ///< of a cube

PeerSolid cube() { return peer_solid(centred_box("cube", kHalf_m, kHalf_m, kHalf_m)); }

double area_of(const std::vector<SurfaceTriangle>& surface) {
  double area = 0;
  for (const SurfaceTriangle& t : surface) area += 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm();
  return area;
}

double volume_of(const std::vector<SurfaceTriangle>& surface) {
  double volume = 0;
  for (const SurfaceTriangle& t : surface) volume += t[0].dot(t[1].cross(t[2])) / 6;
  return volume;
}

SpaceBox around(double half_m) {
  SpaceBox box;
  box.include(Vector::Constant(-half_m));
  box.include(Vector::Constant(half_m));
  return box;
}

PenaltyBodies cube_on_block() {
  return {{cube()},
          {peer_solid(box_solid("block", Vector(-0.03, -0.03, -0.02), Vector(0.03, 0.03, 0)))}};
}

constexpr CouplingGains kGains{1000, 1};

/// Pressed down slowly by 0.5 mm and held: the force of the coupling's spring at the end.
Vector pressed_force_n(CoupledPeer& peer) {
  constexpr int kTicks = 600, kPressing = 200;
  const Rotation upright = Rotation::Identity();
  double z = 0;
  for (int k = 0; k < kTicks; ++k) {
    z = kHalf_m + 1e-4 - 6e-4 * std::min(1.0, static_cast<double>(k) / kPressing);
    const PeerPose goal = peer_pose(Vector(0.001, -0.002, z), upright);
    if (k == 0) peer.begin(goal);
    peer.tick(goal);
  }
  const PeerPose at = peer.place();
  return kGains.k_t_n_per_m * Vector(at.p_wa[0] - 0.001, at.p_wa[1] + 0.002, at.p_wa[2] - z);
}

OpponentPlan short_plan() {
  OpponentPlan plan;
  plan.quick = true;
  plan.repeats = 1;
  plan.voxels_m = {8e-4};
  plan.spacing_m = 2e-3;
  plan.depth_stride = 16;
  plan.mesh_depth_stride = 64;
  return plan;
}

}  // namespace

TEST_SUITE_BEGIN("host_sim.opponents");

TEST_CASE("boundary: a block of five pieces with a hole has no seams") {
  std::vector<PeerSolid> pieces;
  for (const Solid& solid : five_piece_hole(0.0101)) pieces.push_back(peer_solid(solid));
  const auto surface = boundary_of(pieces);
  const double side = 0.0202, depth = 0.04, block = 0.05;
  CHECK(area_of(surface) == doctest::Approx(6 * block * block + 4 * side * depth).epsilon(1e-6));
  CHECK(volume_of(surface) ==
        doctest::Approx(block * block * block - side * side * depth).epsilon(1e-6));
}

TEST_CASE("distance field: of a cube, exact on its grid, and between its points beside a face") {
  const auto surface = boundary_of(std::vector<PeerSolid>{cube()});
  const DistanceField field(surface, around(0.013), 5e-4);
  std::size_t wrong = 0;
  for (std::size_t k = 0; k < field.samples(); ++k) {
    const Vector beyond = field.place(k).cwiseAbs() - Vector::Constant(kHalf_m);
    const double outside = beyond.cwiseMax(0).norm();
    const double truth = outside > 0 ? outside : beyond.maxCoeff();
    const double held = std::clamp(truth, -field.band_m(), field.band_m());
    wrong += std::abs(static_cast<double>(field.value(k)) - held) > 1e-8 ? 1u : 0u;
  }
  CHECK(wrong == 0);
  Vector gradient;
  CHECK(field.between({0.0012, 0.0023, kHalf_m - 3.1e-4}, gradient) ==
        doctest::Approx(-3.1e-4).epsilon(1e-3));
  CHECK((gradient - Vector::UnitZ()).norm() < 1e-3);
  CHECK(field.between({0.5, 0, 0}, gradient) == field.band_m());
}

TEST_CASE("points: no farther apart than asked, all of them found near a surface") {
  const auto surface = boundary_of(std::vector<PeerSolid>{cube()});
  const PointTree tree(point_shell(surface, 1e-3));
  CHECK(tree.size() > 6 * 20 * 20);
  const auto standing = boundary_of(cube_on_block().fixed);
  const std::vector<DistanceField> fields{{standing, around(0.03), 5e-4},
                                          {standing, around(0.03), 4e-3}};
  // On the block, turned: the points below z = 0 are those that push.
  const Rotation q(Eigen::AngleAxisd(0.3, Vector(1, 2, 3).normalized()));
  const Vector p(0, 0, kHalf_m);
  std::size_t inside = 0, found = 0;
  for (const ShellPoint& point : point_shell(surface, 1e-3))
    inside += (p + q * point.p.cast<double>()).z() < 0 ? 1u : 0u;
  tree.near(p, q.toRotationMatrix(), fields, 0,
            [&](const Vector& arm, const ShellPoint&) { found += (p + arm).z() < 0 ? 1u : 0u; });
  CHECK(inside > 10);
  CHECK(found == inside);
}

TEST_CASE("coupled: pressed on a block, the spring's force") {
  const PenaltyBodies bodies = cube_on_block();
  const auto part = boundary_of(bodies.moving), standing = boundary_of(bodies.fixed);
  constexpr double kVoxel_m = 2e-4;
  const VoxelScene voxels(part, standing, around(0.015), kVoxel_m, 1e-3);
  const auto planes =
      make_voxel_peer(voxels, kGains, {VoxelForm::kTangentPlanes, PushAlong::kPointNormal, 2e4});
  // Contact begins anywhere in the surface voxel, and gives way by F / k.
  CHECK(pressed_force_n(*planes).z() == doctest::Approx(0.5).epsilon(0.25));
  for (const PushAlong along : {PushAlong::kPointNormal, PushAlong::kGradient}) {
    const auto field = make_voxel_peer(voxels, kGains, {VoxelForm::kDistanceField, along, 1e4});
    const Vector force = pressed_force_n(*field);
    CHECK(force.z() == doctest::Approx(0.5).epsilon(0.01));
    CHECK(force.head<2>().norm() < 0.02);  // the gradient of a cell leans beside the rim
  }
#if HAPTIC_PEER_MUJOCO
  for (const double friction : {0.0, 0.2}) {
    const auto mujoco = make_mujoco_coupled(bodies, kGains, 0.05, friction);
    const Vector force = pressed_force_n(*mujoco);
    CHECK(force.z() == doctest::Approx(0.5).epsilon(0.05));
    CHECK(force.head<2>().norm() < 0.01);
  }
#endif
}

#if HAPTIC_PEER_MUJOCO
TEST_CASE("turn limit: of an implicit damper at a step a tick") {
  // x'' = -w^2 x - 2 w v, the damper implicit: stable while w h < 2 + sqrt 8, by Jury's conditions.
  const PenaltyBodies bodies = cube_on_block();
  const double mass_kg = 0.05, inertia = mass_kg * 4 * kHalf_m * kHalf_m / 6;
  const double most = std::pow(2 + std::sqrt(8.0), 2) / (kGains.tick_s * kGains.tick_s);
  const TurnLimit limit = mujoco_turn_limit(bodies, kGains, mass_kg);
  CHECK(limit.own_inertia_kgm2 == doctest::Approx(inertia).epsilon(1e-6));
  CHECK(limit.most_k_r_nm_per_rad == doctest::Approx(most * inertia).epsilon(0.05));
  CHECK(limit.least_inertia_kgm2 == doctest::Approx(kGains.k_r_nm_per_rad / most).epsilon(0.05));
  CHECK(limit.used_inertia_kgm2 >= limit.own_inertia_kgm2);
}
#endif

TEST_CASE("opponents: the rows of a short run, and what was skipped") {
  const OpponentPlan plan = short_plan();
  const TickClock clock;
  ParetoResult result;
  for (const OpponentScene& scene : opponent_scenes(plan)) {
    OpponentPlan of_scene = plan;
    if (scene.pieces.moving.empty())
      of_scene.ticks = 1250;  // of the nut, to some way into its contact
    result.opponents.push_back(measure_opponents(scene, of_scene, clock, false));
  }
  REQUIRE(result.opponents.size() == 4);
  const std::string csv = opponent_table(result.opponents).csv();
  const std::string page = opponent_markdown(result.opponents);
  for (const OpponentMeasure& m : result.opponents) {
    CAPTURE(m.scene.name);
    REQUIRE(m.row(kDefaultMethod) != nullptr);
    const OpponentRow& own = *m.row(kDefaultMethod);
    const bool pieces = !m.scene.pieces.moving.empty();
    const bool voxels = m.scene.name == "square_peg" || m.scene.name == "nut_on_bolt";
    CHECK(m.reference.in_contact.size() > 20);
    CHECK(own.depth_m.largest < 1e-6);
    CHECK(own.method.force_n.median < 1e-3);
    CHECK((m.row("voxels_800_um") != nullptr) == voxels);
    CHECK((m.row("field_800_um") != nullptr) == voxels);
    CHECK((m.row("mujoco_50_g") != nullptr) == (HAPTIC_PEER_MUJOCO != 0 && pieces));
    CHECK((m.row("mujoco_10_g") != nullptr) == (HAPTIC_PEER_MUJOCO != 0 && pieces));
    CHECK(m.rows.size() + m.skipped.size() == (voxels ? 5 : 4));
    for (const std::string& words : m.skipped)
      CHECK(page.find("- skipped: " + words) != std::string::npos);
    for (const OpponentRow& row : m.rows) {
      CAPTURE(row.method.name);
      CHECK(csv.find(m.scene.name + ",") != std::string::npos);
      CHECK(page.find("| " + row.method.title) != std::string::npos);
      CHECK(row.method.flawed_ticks == 0);
      CHECK(row.method.force_n.median <= row.method.force_n.p99);
      CHECK(row.depth_m.median <= row.depth_m.largest);
      if (&row == &own) continue;
      // Worse than the default law, and still a rendering of the same contact: a few mm of the
      // spring.
      CHECK(row.method.force_n.p99 > own.method.force_n.p99);
      CHECK(row.method.force_n.median < 3);
      CHECK(row.depth_m.median < 2e-3);
    }
  }
  CHECK(pareto_json(result).find("\"opponents\"") != std::string::npos);
  CHECK(pareto_markdown(result).find("## Opponents") != std::string::npos);
  CHECK(csv.find("nan") == std::string::npos);
}

TEST_SUITE_END();
