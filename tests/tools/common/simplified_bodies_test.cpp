// SPDX-License-Identifier: Apache-2.0
/// That a body is not that of its mesh: written, checked, and said to people.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

#include "tests/support/shapes.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/common/simplified_bodies.hpp"

namespace haptic::tools {
namespace {

using test::box;
using test::scene_of;

SceneDescription two_statics() {
  return scene_of(box({0, 0, 0}, {1, 1, 1}),
                  {box({0, 0, 0}, {2, 2, 2}), box({0, 0, 0}, {1, 2, 3})});
}

SceneView opened(const SceneBytes& bytes) {
  SceneView view;
  REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
  return view;
}

/// Status of the scene after a change to its simplified bodies, hash recomputed.
template <typename Change>
RtStatus after(const SceneBytes& good, Change change, SceneFault& fault) {
  SceneBytes bytes(good.span());
  for (const SectionEntry& s : opened(good).sections()) {
    if (s.id != SectionId::kSimplified) continue;
    change(reinterpret_cast<SimplifiedBody*>(bytes.span().data() + s.offset));
  }
  auto* const header = reinterpret_cast<SceneHeader*>(bytes.span().data());
  header->content_hash = scene_content_hash(bytes.span());
  SceneView view;
  return SceneView::open(bytes.span(), view, fault);
}

TEST_SUITE("tools.simplified_bodies") {
  TEST_CASE("a scene of the solids of its meshes has no such section and says nothing") {
    const SceneBytes bytes{write_scene(two_statics())};
    const SceneView view = opened(bytes);
    CHECK(view.simplified_bodies().empty());
    CHECK(simplification_texts(view).empty());
    for (const SectionEntry& s : view.sections()) CHECK(s.id != SectionId::kSimplified);
  }

  TEST_CASE("a simplified body is named with distance and change; the state does not grow") {
    SceneDescription scene = two_statics();
    const SceneBytes plain{write_scene(scene)};
    scene.statics[1].body.name = "gear.obj";
    scene.statics[1].simplified = {3.0e-4, -0.06};
    const SceneBytes bytes{write_scene(scene)};
    const SceneView view = opened(bytes);
    REQUIRE(view.simplified_bodies().size() == 1);
    CHECK(view.simplified_bodies()[0].body == 2);
    const std::vector<std::string> texts = simplification_texts(view);
    REQUIRE(texts.size() == 1);
    CHECK(texts[0] ==
          "'gear.obj' was simplified: the surface is up to 0.0003 m from that of the mesh, the "
          "volume changed by -0.99 % (-0.06 m3)");
    CHECK(view.header().capacity.state_bytes == opened(plain).header().capacity.state_bytes);
  }

  TEST_CASE("a surface is named with its distance alone, and has no change of a volume") {
    SceneDescription scene = two_statics();
    scene.parameters.law = LawId::kProxy;
    scene.parameters.goal_contact = 0;
    ConvexPiece facet;
    facet.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    facet.faces = {{0, 1, {0, 1, 2}, 0}, {0, -1, {2, 1, 0}, 0}};
    facet.vertex_cones.resize(3);
    facet.side_cones.resize(3);
    Body sheet;
    sheet.name = "sheet.obj";
    sheet.planes = {{{0, 0, 1}, 0}};
    sheet.pieces = {facet};
    scene.statics[1].body = sheet;
    scene.statics[1].simplified = {3.0e-4, 0.0};
    const SceneBytes good{write_scene(scene)};
    const std::vector<std::string> texts = simplification_texts(opened(good));
    REQUIRE(texts.size() == 1);
    CHECK(texts[0] ==
          "'sheet.obj' was simplified: the surface is up to 0.0003 m from that of the mesh");
    SceneFault fault;
    for (const double change : {1.0e-9, -1.0e-9, std::nan("")}) {
      CHECK(after(
                good, [&](SimplifiedBody* s) { s->volume_change_m3 = change; }, fault) ==
            RtStatus::kBlobBadNumber);
      CHECK(fault.section == SectionId::kSimplified);
    }
  }

  TEST_CASE("the section is checked like every other") {
    SceneDescription scene = two_statics();
    scene.moving.simplified = {1.0e-4, 1.0e-3};
    scene.statics[0].simplified = {2.0e-4, 0.0};
    const SceneBytes good{write_scene(scene)};
    SceneFault fault;
    using S = SimplifiedBody;
    CHECK(after(
              good, [](S*) {}, fault) == RtStatus::kOk);
    CHECK(after(
              good, [](S* s) { s[1].body = 2; }, fault) == RtStatus::kOk);
    CHECK(after(
              good, [](S* s) { s[1].body = 3; }, fault) == RtStatus::kBlobBadIndex);
    CHECK(fault.section == SectionId::kSimplified);
    CHECK(fault.index == 1);
    CHECK(after(
              good, [](S* s) { s[1].body = 0; }, fault) == RtStatus::kBlobBadIndex);
    CHECK(after(
              good, [](S* s) { s[0].body = 1; }, fault) == RtStatus::kBlobBadIndex);
    CHECK(after(
              good, [](S* s) { s[0].reserved = 1; }, fault) == RtStatus::kBlobBadNumber);
    CHECK(fault.index == 0);
    CHECK(after(
              good, [](S* s) { s[0].distance_m = -1e-9; }, fault) == RtStatus::kBlobBadNumber);
    CHECK(after(
              good, [](S* s) { s[0].distance_m = 2e6; }, fault) == RtStatus::kBlobBadNumber);
    CHECK(after(
              good, [](S* s) { s[1].distance_m = std::nan(""); }, fault) ==
          RtStatus::kBlobBadNumber);
    CHECK(after(
              good, [](S* s) { s[1].volume_change_m3 = INFINITY; }, fault) ==
          RtStatus::kBlobBadNumber);
    CHECK(after(  // the mesh would have no volume
              good, [](S* s) { s[1].volume_change_m3 = 1.0e3; }, fault) ==
          RtStatus::kBlobBadNumber);
  }
}

}  // namespace
}  // namespace haptic::tools
