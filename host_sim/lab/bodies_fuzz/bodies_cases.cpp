// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/bodies_fuzz/bodies_cases.hpp"

#include <algorithm>
#include <utility>

namespace haptic::sim {
namespace {

/// Clearance of the peg in its hole and in its ring.
constexpr double kBodyClearance_m = 1e-4;
constexpr double kPegHalf_m = 0.010;
/// Height over the table of what lies on it at the start.
constexpr double kLying_m = 1e-4;

FuzzBody solid_body(const std::string& name, std::vector<Solid> pieces, BodyRole role) {
  FuzzBody body;
  body.name = name;
  body.role = role;
  body.pieces = std::move(pieces);
  return body;
}

FuzzBody surface_part(const std::string& name, FuzzMesh mesh, BodyRole role) {
  FuzzBody body;
  body.name = name;
  body.role = role;
  body.surface = std::move(mesh);
  return body;
}

/// Its goal goes all over the middle of the table, into it and into what else is there.
FuzzBody over_table(FuzzBody body, const Vector& start) {
  body.start = start;
  body.range = {Vector(0, 0, 0.03), Vector(0.05, 0.05, 0.04), 1.2, kNoCarrier};
  return body;
}

FuzzBody ranging(FuzzBody body, const Vector& start, const BodyRange& range) {
  body.start = start;
  body.range = range;
  return body;
}

Solid about_middle(Solid solid, double share) {
  Vector low = solid.vertices[0], high = low;
  for (const Vector& v : solid.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  for (Vector& v : solid.vertices) v = share * (v - (low + high) / 2);
  return solid;
}

FuzzBody box_body(BodyRole role) {
  return solid_body("box", {centred_box("box", 0.015, 0.012, 0.010)}, role);
}
FuzzBody tetrahedron_body(BodyRole role) {
  return solid_body("tetrahedron", {about_middle(paper_tetrahedron(), 0.35)}, role);
}
FuzzBody prism_body(BodyRole role) {
  return solid_body("prism", {prism_solid(6, 0.018, 0.036)}, role);
}
FuzzBody wedge_body(BodyRole role) {
  return solid_body("wedge", {about_middle(wedge_solid(), 0.4)}, role);
}
FuzzBody peg_body(BodyRole role) { return solid_body("peg", {square_peg()}, role); }
FuzzBody hole_body(BodyRole role) {
  return solid_body("hole", five_piece_hole(kPegHalf_m + kBodyClearance_m), role);
}

/// Four walls about the peg.
FuzzBody ring_body(BodyRole role) {
  constexpr double kOut = 0.018, kHalfHeight = 0.006;
  const double in = kPegHalf_m + kBodyClearance_m;
  return solid_body("ring",
                    {box_solid("ring -x", {-kOut, -kOut, -kHalfHeight}, {-in, kOut, kHalfHeight}),
                     box_solid("ring +x", {in, -kOut, -kHalfHeight}, {kOut, kOut, kHalfHeight}),
                     box_solid("ring -y", {-in, -kOut, -kHalfHeight}, {in, -in, kHalfHeight}),
                     box_solid("ring +y", {-in, in, -kHalfHeight}, {in, kOut, kHalfHeight})},
                    role);
}
FuzzBody ring_surface(BodyRole role) {
  const double in = kPegHalf_m + kBodyClearance_m;
  return surface_part("ring of facets", slotted_mesh(0.018, in, in, 0.012), role);
}

/// The peg in the hole that carries it, half of it deep, and up to out of it.
BodyRange in_hole(std::size_t hole) {
  return {Vector(0, 0, 0.010), Vector(0.003, 0.003, 0.025), 0.1, hole};
}
BodyRange on_hole(std::size_t hole) {
  return {Vector(0, 0, 0.010), Vector(0.002, 0.002, 0.012), 0.1, hole};
}

Solid table_solid() { return box_solid("table", {-0.15, -0.15, -0.02}, {0.15, 0.15, 0}); }

BodiesScene scene_named(const std::string& of_case, std::vector<FuzzBody> bodies, bool has_table,
                        double share = 1) {
  BodiesScene scene;
  scene.of_case = of_case;
  for (const FuzzBody& body : bodies) {
    if (!scene.name.empty()) scene.name += ", ";
    scene.name += std::string(to_text(body.role)) + " " + body.name;
  }
  scene.bodies = std::move(bodies);
  if (has_table) scene.standing = {table_solid()};
  scene.share = share;
  return scene;
}

constexpr BodyRole kHand = BodyRole::kHand, kDriver = BodyRole::kDriver, kLoose = BodyRole::kLoose;
const Vector kLeft_m(-0.08, 0, 0.08), kRight_m(0.08, 0, 0.08), kBehind_m(0, 0.1, 0.08);

std::vector<BodiesScene> driver_scenes() {
  const BodyRange flight{Vector(0, 0, 0.12), Vector(0.08, 0.08, 0.05), 0.8, kNoCarrier};
  const char* const name = "driver";
  return {
      scene_named(name,
                  {over_table(box_body(kHand), kLeft_m), over_table(prism_body(kDriver), kRight_m)},
                  true),
      scene_named(
          name,
          {over_table(tetrahedron_body(kHand), kLeft_m), over_table(wedge_body(kDriver), kRight_m)},
          true),
      scene_named(name,
                  {ranging(hole_body(kDriver), flight.home, flight),
                   ranging(peg_body(kHand), Vector::Zero(), in_hole(0))},
                  true),
      scene_named(
          name,
          {over_table(box_body(kHand), kLeft_m),
           over_table(surface_part("tray of facets", tray_mesh({0.03, 0.025, 0.015}), kDriver),
                      kRight_m)},
          true, 0.6),
      scene_named(
          name,
          {over_table(surface_part("L of facets", ell_mesh(0.04, 0.012, 0.01), kHand), kLeft_m),
           over_table(prism_body(kDriver), kRight_m)},
          true, 0.6)};
}

std::vector<BodiesScene> hands_scenes() {
  const BodyRange flight{Vector::Zero(), Vector(0.05, 0.05, 0.05), 0.6, kNoCarrier};
  const char* const name = "hands";
  return {
      scene_named(
          name,
          {over_table(box_body(kHand), kLeft_m), over_table(tetrahedron_body(kHand), kRight_m)},
          true),
      scene_named(name,
                  {over_table(prism_body(kHand), kLeft_m), over_table(wedge_body(kHand), kRight_m)},
                  true),
      scene_named(name,
                  {ranging(hole_body(kHand), Vector::Zero(), flight),
                   ranging(peg_body(kHand), Vector::Zero(), in_hole(0))},
                  false),
      scene_named(name,
                  {over_table(box_body(kHand), kLeft_m),
                   over_table(surface_part("drawer of facets",
                                           drawer_mesh({0.04, 0.03, 0.02}, 0.003), kHand),
                              kRight_m)},
                  true, 0.6),
      scene_named(
          name,
          {over_table(surface_part("tray of facets", tray_mesh({0.03, 0.025, 0.015}), kHand),
                      kLeft_m),
           over_table(surface_part("L of facets", ell_mesh(0.04, 0.012, 0.01), kHand), kRight_m)},
          false, 0.4)};
}

std::vector<BodiesScene> three_scenes() {
  const Vector lying(0, 0, kLying_m);
  const char* const name = "three";
  return {scene_named(
              name,
              {over_table(box_body(kHand), kLeft_m), over_table(prism_body(kDriver), kRight_m),
               over_table(solid_body("block", {centred_box("block", 0.014, 0.014, 0.008)}, kLoose),
                          Vector(0, 0, 0.008) + lying)},
              true),
          scene_named(
              name,
              {over_table(box_body(kHand), kLeft_m), over_table(tetrahedron_body(kHand), kBehind_m),
               over_table(wedge_body(kDriver), kRight_m)},
              true),
          scene_named(
              name,
              {over_table(box_body(kHand), kLeft_m),
               over_table(surface_part("tray of facets", tray_mesh({0.03, 0.025, 0.015}), kDriver),
                          kRight_m),
               over_table(prism_body(kLoose), Vector(0, 0, 0.018) + lying)},
              true, 0.6)};
}

std::vector<BodiesScene> assembly_scenes() {
  const BodyRange flight{Vector::Zero(), Vector(0.04, 0.04, 0.04), 0.4, kNoCarrier};
  const Vector on_rim(0, 0, 0.006 + kLying_m);
  const char* const name = "assembly";
  const auto set_of = [&](FuzzBody hole, FuzzBody ring, double share) {
    return scene_named(name,
                       {ranging(std::move(hole), Vector::Zero(), flight),
                        ranging(peg_body(kHand), Vector::Zero(), in_hole(0)),
                        ranging(std::move(ring), on_rim, on_hole(0))},
                       false, share);
  };
  return {set_of(hole_body(kDriver), ring_body(kLoose), 0.5),
          set_of(hole_body(kDriver), ring_body(kHand), 0.5),
          set_of(hole_body(kHand), ring_body(kLoose), 0.5),
          set_of(hole_body(kDriver), ring_surface(kLoose), 0.3)};
}

}  // namespace

const std::vector<std::string>& bodies_case_names() {
  static const std::vector<std::string> names{"driver", "hands", "three", "assembly"};
  return names;
}

std::vector<BodiesScene> bodies_scenes(const std::vector<std::string>& names) {
  std::vector<BodiesScene> scenes;
  for (std::vector<BodiesScene>& of_case : std::vector<std::vector<BodiesScene>>{
           driver_scenes(), hands_scenes(), three_scenes(), assembly_scenes()}) {
    const bool wanted =
        names.empty() || std::ranges::find(names, of_case.front().of_case) != names.end();
    if (wanted) std::ranges::move(of_case, std::back_inserter(scenes));
  }
  return scenes;
}

}  // namespace haptic::sim
