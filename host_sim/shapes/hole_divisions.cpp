// SPDX-License-Identifier: Apache-2.0
#include "host_sim/shapes/hole_divisions.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "host_sim/shapes/wander.hpp"

namespace haptic::sim {
namespace {

/// Sizes of the block around the hole, as five_piece_hole has it.
constexpr double kBlock_m = 0.025, kHoleDepth_m = 0.040, kBlockDepth_m = 0.050;
constexpr double kClearance_m = 1e-4;
constexpr double kHoleHalf_m = kPegHalf_m + kClearance_m;
/// The key lies in the hole with room to slide and turn; the cover is wider than the hole.
constexpr double kKeyHalf_m = 0.003, kKeyHalfLength_m = 0.008;
constexpr double kCoverHalf_m = 0.008, kCoverHalfHeight_m = 0.004;
/// How deep the device is pushed into faces: 2 N.
constexpr double kFacePush_m = 0.002;
/// The pocket: half its outer width, where its inner corner lies, depths.
constexpr double kOuter_m = 0.012, kInner_m = -0.004;
constexpr double kPocketDepth_m = 0.016, kPocketBlockDepth_m = 0.024;
/// Origin of the L in the pocket's frame, and half its height.
constexpr double kKnee_m = -0.006, kEllHalfHeight_m = 0.005;
constexpr std::uint64_t kWanderSeed = 20260607;

tools::Body body_of(const Solid& solid) { return united_body({&solid, 1}); }

std::vector<Division> fixed_divisions(const tools::Body& moving,
                                      const std::vector<tools::Body>& fixed) {
  const char* const names[3] = {"strips", "pinwheel", "cut through"};
  std::vector<Division> result;
  for (std::size_t k = 0; k < fixed.size(); ++k) result.push_back({names[k], moving, fixed[k]});
  return result;
}

std::vector<Division> ell_divisions(double clearance_m) {
  const std::vector<tools::Body> fixed = ell_pocket_divisions();
  const std::vector<tools::Body> moving = ell_insert_divisions(clearance_m);
  return {{"slabs across x", moving[0], fixed[0]},
          {"slabs across y", moving[1], fixed[1]},
          {"cut through", moving[1], fixed[2]}};
}

/// Path of the key, the cover or the L from a pose as a function of time.
TimedPath way(double duration_s, const Vector& retreat_w, TimedPose pose) {
  TimedPath path;
  path.pose = std::move(pose);
  path.duration_s = duration_s;
  path.retreat_w = retreat_w;
  path.approach_s = 1;
  return path;
}

DivisionCase hole_case(const char* name, const char* title, DivisionContact contact,
                       const Solid& moving, TimedPath path) {
  DivisionCase result{name, title, contact, {}, {}, std::move(path), {}};
  result.divisions = fixed_divisions(body_of(moving), square_hole_divisions(kHoleHalf_m));
  result.scene.k_r_nm_per_rad = 0.5;
  return result;
}

DivisionCase ell_case(const char* name, const char* title, DivisionContact contact,
                      double clearance_m, TimedPath path) {
  DivisionCase result{name, title, contact, ell_divisions(clearance_m), {}, std::move(path), {}};
  result.scene.k_r_nm_per_rad = 0.5;
  return result;
}

/// A path of the peg cases in the divided hole.
DivisionCase peg_case(ContactCase contact, DivisionContact kind) {
  const tools::Body peg = contact.scene.moving;
  DivisionCase result{contact.name, contact.title, kind, {}, contact.scene, contact.path, {}};
  result.divisions = fixed_divisions(peg, square_hole_divisions(kHoleHalf_m));
  return result;
}

void add_face_cases(std::vector<DivisionCase>& cases) {
  const Solid key = centred_box("key", kKeyHalf_m, kKeyHalf_m, kKeyHalfLength_m);
  const Solid cover = centred_box("cover", kCoverHalf_m, kCoverHalf_m, kCoverHalfHeight_m);
  const double wall = kHoleHalf_m - kKeyHalf_m, floor = kKeyHalfLength_m - kHoleDepth_m;
  const double push = kFacePush_m;
  cases.push_back(hole_case("wall", "key flat on a wall, slid and spun", DivisionContact::kFace,
                            key, way(6, {-wall - push, 0, 0.040}, [=](double t) -> PathPose {
                              return {{wall + push, 0.0008 * std::sin(2.1 * t),
                                       -0.020 + 0.009 * std::sin(1.3 * t)},
                                      turn_about(0.08 * std::sin(1.7 * t), Vector::UnitX())};
                            })));
  cases.push_back(
      hole_case("floor", "key flat on the floor, slid and spun", DivisionContact::kFace, key,
                way(6, {0, 0, 0.050}, [=](double t) -> PathPose {
                  return {{0.001 * std::sin(2.1 * t), 0.001 * std::sin(1.3 * t), floor - push},
                          turn_about(0.2 * std::sin(1.7 * t), Vector::UnitZ())};
                })));
  cases.push_back(hole_case(
      "corner", "key pressed into floor and two walls", DivisionContact::kFace, key,
      way(6, {-wall - push, -wall - push, 0.050}, [=](double t) -> PathPose {
        return {{wall + push + 0.001 * std::sin(2.1 * t), wall + push + 0.001 * std::sin(1.3 * t),
                 floor - push + 0.001 * std::sin(1.7 * t)},
                Rotation::Identity()};
      })));
  cases.push_back(hole_case("groove", "key pressed into the corner of two walls and slid along it",
                            DivisionContact::kFace, key,
                            way(6, {-wall - push, wall + push, 0.040}, [=](double t) -> PathPose {
                              return {
                                  {wall + push, -wall - push, -0.020 + 0.009 * std::sin(1.3 * t)},
                                  Rotation::Identity()};
                            })));
  cases.push_back(hole_case(
      "cover", "box slid flat over the mouth and its seams", DivisionContact::kFace, cover,
      way(6, {0, 0, 0.010}, [=](double t) -> PathPose {
        return {{0.010 * std::sin(2.1 * t), 0.010 * std::sin(1.3 * t), kCoverHalfHeight_m - push},
                turn_about(0.4 * std::sin(0.9 * t), Vector::UnitZ())};
      })));
}

void add_peg_cases(std::vector<DivisionCase>& cases) {
  cases.push_back(peg_case(insertion_case(kClearance_m), DivisionContact::kMixed));
  DivisionCase tilted = peg_case(tilted_peg_case(kClearance_m), DivisionContact::kMixed);
  tilted.other_strength =
      "two points in balance: a torque, where the paper's law adds two forces at unequal depths";
  cases.push_back(std::move(tilted));
  cases.push_back(peg_case(mouth_case(kClearance_m), DivisionContact::kRelease));
  const Solid key = centred_box("key", kKeyHalf_m, kKeyHalf_m, kKeyHalfLength_m);
  Seeded random(kWanderSeed);
  Wander shape;
  shape.centre = {0, 0, -0.024};
  shape.reach_m = {0.006, 0.006, 0.014};
  shape.turn_rad = 0.4;
  cases.push_back(hole_case("wander", "key wandering and turning in the hole",
                            DivisionContact::kMixed, key,
                            way(12, {0, 0, 0.080}, wander(shape, random))));
  shape.centre = {0, 0, -0.002};
  shape.reach_m = {0.010, 0.010, 0.012};
  cases.push_back(hole_case("rim_wander", "key wandering in and out of the mouth, round its rim",
                            DivisionContact::kRelease, key,
                            way(12, {0, 0, 0.060}, wander(shape, random))));
  // Tight, tilted and turned far beyond what the clearance leaves: it stands on the rim, pulled
  // hard.
  shape.centre = {0, 0, 0.005};
  shape.reach_m = {0.002, 0.002, 0.015};
  shape.turn_rad = 0.08;
  DivisionCase jammed = hole_case("peg_wander", "peg of 0.1 mm clearance wandering at its mouth",
                                  DivisionContact::kJammed,
                                  centred_box("peg", kPegHalf_m, kPegHalf_m, kPegHalfLength_m),
                                  way(24, {0, 0, 0.080}, wander(shape, random)));
  jammed.other_strength = "it stands on the rim while the device is in the hole";
  cases.push_back(std::move(jammed));
}

void add_ell_cases(std::vector<DivisionCase>& cases) {
  constexpr double kLoose_m = 1.5e-3, kSnug_m = 2e-4;
  const double floor = kEllHalfHeight_m - kPocketDepth_m, push = kFacePush_m;
  cases.push_back(ell_case("ell_floor", "L flat on the floor of its pocket, slid",
                           DivisionContact::kFace, kLoose_m,
                           way(6, {0, 0, 0.030}, [=](double t) -> PathPose {
                             return {{kKnee_m + 0.001 * std::sin(2.1 * t),
                                      kKnee_m + 0.001 * std::sin(1.3 * t), floor - push},
                                     turn_about(0.02 * std::sin(1.7 * t), Vector::UnitZ())};
                           })));
  cases.push_back(ell_case(
      "ell_notch", "L pressed against the pocket's inner corner and floor", DivisionContact::kFace,
      kLoose_m, way(6, {-kLoose_m - push, -kLoose_m - push, 0.022}, [=](double t) -> PathPose {
        const double aside = kKnee_m + kLoose_m + push;
        return {{aside + 0.001 * std::sin(2.1 * t), aside + 0.001 * std::sin(1.3 * t),
                 floor - push + 0.001 * std::sin(1.7 * t)},
                Rotation::Identity()};
      })));
  DivisionCase insertion = ell_case(
      "ell_insertion", "L wobbling into its pocket", DivisionContact::kMixed, kSnug_m,
      way(5, {0, 0, 0.010}, [=](double t) -> PathPose {
        // 3 mm above the rim at first, 2 mm beyond the floor after 3.5 s; it wobbles once
        // its lower face is in.
        const double height = kEllHalfHeight_m + 0.003;
        const double z = height - (height - floor + push) * std::min(t / 3.5, 1.0);
        const double share = std::clamp(t - 0.7, 0.0, 1.0);
        return {
            {kKnee_m + share * 0.0015 * std::sin(std::numbers::pi * t),
             kKnee_m + share * 0.0015 * std::sin(0.8 * std::numbers::pi * t), z},
            turn_about(share * 0.05 * std::sin(0.9 * std::numbers::pi * t), Vector::UnitZ()) *
                turn_about(share * 0.04 * std::sin(std::numbers::pi * t), Vector::UnitY()) *
                turn_about(share * 0.03 * std::sin(0.7 * std::numbers::pi * t), Vector::UnitX())};
      }));
  Seeded random(kWanderSeed);
  Wander shape;
  shape.centre = {kKnee_m, kKnee_m, -0.009};
  shape.reach_m = {0.003, 0.003, 0.006};
  DivisionCase wandering =
      ell_case("ell_wander", "L wandering in its pocket", DivisionContact::kRelease, kSnug_m,
               way(24, {0, 0, 0.040}, wander(shape, random)));
  insertion.other_strength = wandering.other_strength =
      "two pieces of the L at once, which the paper's law adds";
  cases.push_back(std::move(insertion));
  cases.push_back(std::move(wandering));
}

}  // namespace

CoupledScene DivisionCase::divided(const Division& division) const {
  CoupledScene result = scene;
  result.moving = division.moving;
  result.statics = {division.fixed};
  return result;
}

std::vector<tools::Body> square_hole_divisions(double half_width_m) {
  const double w = half_width_m, b = kBlock_m, h = kHoleDepth_m, d = kBlockDepth_m;
  const std::vector<Solid> strips = five_piece_hole(w);
  const Solid pinwheel[] = {box_solid("wall +x", {w, -w, -h}, {b, b, 0}),
                            box_solid("wall +y", {-b, w, -h}, {w, b, 0}),
                            box_solid("wall -x", {-b, -b, -h}, {-w, w, 0}),
                            box_solid("wall -y", {-w, -b, -h}, {b, -w, 0}),
                            box_solid("floor -", {-b, -b, -d}, {0.001, b, -h}),
                            box_solid("floor +", {0.001, -b, -d}, {b, b, -h})};
  // One across the walls at half their height; the others cross the hole, walls and floor.
  const CutPlane cuts[] = {{Vector::UnitZ(), -0.021},
                           {Vector(0.96, 0.28, 0).normalized(), 0.0004},
                           {Vector(0, 0.8, 0.6).normalized(), -0.0242}};
  const tools::Body whole = united_body(strips);
  return {whole, united_body(pinwheel), cut_body(whole, cuts)};
}

std::vector<tools::Body> ell_pocket_divisions() {
  const double b = kBlock_m, p = kOuter_m, q = kInner_m;
  const double h = kPocketDepth_m, d = kPocketBlockDepth_m;
  const Solid across_x[] = {
      box_solid("slab -x", {-b, -b, -h}, {-p, b, 0}), box_solid("slab +x", {p, -b, -h}, {b, b, 0}),
      box_solid("slab -y", {-p, -b, -h}, {p, -p, 0}), box_solid("slab +y", {-p, p, -h}, {q, b, 0}),
      box_solid("notch", {q, q, -h}, {p, b, 0}),      box_solid("floor", {-b, -b, -d}, {b, b, -h})};
  const Solid across_y[] = {box_solid("slab -y", {-b, -b, -h}, {b, -p, 0}),
                            box_solid("slab +y", {-b, p, -h}, {b, b, 0}),
                            box_solid("slab -x", {-b, -p, -h}, {-p, p, 0}),
                            box_solid("slab +x", {p, -p, -h}, {b, q, 0}),
                            box_solid("notch", {q, q, -h}, {b, p, 0}),
                            box_solid("floor -y", {-b, -b, -d}, {b, q, -h}),
                            box_solid("floor -x", {-b, q, -d}, {q, b, -h}),
                            box_solid("floor +x", {q, q, -d}, {b, b, -h})};
  const CutPlane cuts[] = {{Vector(0.8, 0.6, 0).normalized(), -0.0061},
                           {Vector(0.28, -0.6, 0.8).normalized(), -0.0083}};
  const tools::Body whole = united_body(across_x);
  return {whole, united_body(across_y), cut_body(whole, cuts)};
}

std::vector<tools::Body> ell_insert_divisions(double clearance_m) {
  const double p = kOuter_m - clearance_m, h = kEllHalfHeight_m, k = kKnee_m;
  const double low = -p - k, high = p - k, inner = kInner_m - clearance_m - k;
  const Solid along_x[] = {box_solid("arm x", {low, low, -h}, {high, inner, h}),
                           box_solid("arm y", {low, inner, -h}, {inner, high, h})};
  const Solid along_y[] = {box_solid("arm y", {low, low, -h}, {inner, high, h}),
                           box_solid("arm x", {inner, low, -h}, {high, inner, h})};
  return {united_body(along_x), united_body(along_y)};
}

std::vector<DivisionCase> hole_division_cases() {
  std::vector<DivisionCase> cases;
  add_face_cases(cases);
  add_peg_cases(cases);
  add_ell_cases(cases);
  return cases;
}

}  // namespace haptic::sim
