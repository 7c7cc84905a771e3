// SPDX-License-Identifier: Apache-2.0
// The judge of what the compiler says of meshes; and a short run over our own, whole and damaged.
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>

#include "host_sim/lab/acceptance/acceptance.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/shapes/shape.hpp"

using namespace haptic::sim;
using haptic::sim::test::run_program;
using haptic::sim::test::ScratchFolder;

namespace {

haptic::tools::RawMesh box() {
  return haptic::tools::shape_mesh(haptic::tools::BoxShape{{1, 2, 3}}, "box");
}

bool has(const std::string& text, const char* words) {
  return text.find(words) != std::string::npos;
}

}  // namespace

TEST_SUITE("host_sim.acceptance") {
  TEST_CASE("facts of a mesh are counted from its corners alone") {
    haptic::tools::RawMesh mesh = box();
    const MeshFacts whole = facts_of(mesh);
    CHECK(whole.triangles == 12);
    CHECK(whole.with_area == 12);
    CHECK(whole.open_edges == 0);
    CHECK(whole.volume == doctest::Approx(6.0));
    mesh.faces.push_back(mesh.faces[0]);
    CHECK(facts_of(mesh).open_edges == 0);
    mesh.faces.pop_back();
    mesh.faces.pop_back();
    CHECK(facts_of(mesh).open_edges == 4);
    mesh.vertices[0][1] = HUGE_VAL;
    CHECK(facts_of(mesh).not_finite == 1);
  }

  TEST_CASE("damage changes the mesh, is the same for the same seed, and leaves a face") {
    const auto differs = [](const haptic::tools::RawMesh& a, const haptic::tools::RawMesh& b) {
      if (a.vertices != b.vertices || a.faces.size() != b.faces.size()) return true;
      for (std::size_t f = 0; f < a.faces.size(); ++f) {
        if (a.faces[f].vertices != b.faces[f].vertices) return true;
      }
      return false;
    };
    for (const haptic::tools::RawMesh& good : good_meshes()) {
      CAPTURE(good.file);
      CHECK(facts_of(good).open_edges == 0);
      for (std::uint32_t kind = 0; kind < kMeshDamages; ++kind) {
        const auto damage = static_cast<MeshDamage>(kind);
        CAPTURE(to_text(damage));
        const haptic::tools::RawMesh bad = damaged(good, damage, 7);
        CHECK(differs(bad, good) == (damage != MeshDamage::kNone));
        CHECK_FALSE(differs(bad, damaged(good, damage, 7)));
        CHECK_FALSE(bad.faces.empty());
        if (damage == MeshDamage::kHoles) CHECK(facts_of(bad).open_edges > 0);
      }
    }
  }

  TEST_CASE("what is not true of a mesh is found") {
    const MeshFacts good = facts_of(box());
    MeshFacts open = good;
    open.open_edges = 4;
    const Statement solid{.outcome = Outcome::kSolid, .said = "closed", .volume_m3 = 6.0};
    CHECK(defect_of(solid, MeshDamage::kFlips, good, good) == "");
    CHECK(has(defect_of(solid, MeshDamage::kHoles, open, good), "faces were taken out"));
    Statement other = solid;
    other.volume_m3 = 5.0;
    CHECK(has(defect_of(other, MeshDamage::kFlips, good, good), "its volume is 5"));
    other = solid;
    other.proven = false;
    CHECK(has(defect_of(other, MeshDamage::kNone, good, good), "certificate"));
    const Statement surface{.outcome = Outcome::kSurface, .said = "4 open edges", .open_edges = 4};
    CHECK(defect_of(surface, MeshDamage::kHoles, open, good) == "");
    CHECK(has(defect_of(surface, MeshDamage::kCracks, good, good), "but there are none"));
    other = surface;
    other.open_edges = 3;
    CHECK(has(defect_of(other, MeshDamage::kHoles, open, good), "but there are 4"));
    const auto refused = [&](const char* said, const MeshFacts& given) {
      return defect_of({.outcome = Outcome::kRefused, .said = said}, MeshDamage::kNone, given,
                       good);
    };
    CHECK(has(refused("box: bad", good), "without a way to fix it"));
    CHECK(has(refused("box: face 3 is green; paint it", good), "not known here"));
    CHECK(has(refused("box: the mesh has no face; export", good), "there are faces"));
    CHECK(refused("box: the mesh has no face; export", MeshFacts{}) == "");
    CHECK(has(refused("box: no triangle has an area; export", good), "there is an area"));
    CHECK(has(refused("box: vertex 3 is not finite; check", good), "all numbers are finite"));
  }

  TEST_CASE("our own meshes are accepted, damaged ones too, and what is said is true") {
    AcceptanceSize size;
    size.damaged = 42;
    const AcceptanceResult result = run_acceptance(size);
    CAPTURE(acceptance_page(result));
    CHECK(result.failures() == 0);
    CHECK(result.whole.size() == good_meshes().size());
    for (const Acceptance& a : result.whole) {
      CHECK(a.accepted());
      CHECK(a.felt.touched);
      CHECK(a.felt.air_force_n == 0);
      CHECK(a.felt.press_force_n > 0.05);
    }
    CHECK(result.felt() == result.accepted());
    CHECK(result.damaged.size() == 42);
  }

  TEST_CASE("a pair that pulls in free air, and one that cannot be touched, fail and are named") {
    // The other box: in the way of the part that moves down, or out of reach by the limits.
    const auto pressed = [](double box_z_m, const std::string& rest) {
      const std::string text = haptic::tools::formatted(
          "format = 1\nname = \"pair\"\n[moving]\nshape = \"box\"\nsize_m = [0.01, 0.01, 0.01]\n"
          "[[static]]\nshape = \"box\"\nsize_m = [0.02, 0.02, 0.01]\nposition_m = [0, 0, %g]\n"
          "[rendering]\nk_f_n_per_m = 800\n",
          box_z_m);
      const haptic::tools::SceneBytes aligned{
          haptic::tools::compile_scene(
              haptic::tools::parse_scene_file(text + rest, "pair.toml", "."), {})
              .bytes};
      return press_pair(aligned.span(), "pair");
    };
    const PressedPair right = pressed(0.02, "");
    CHECK(right.fault == "");
    CHECK(right.touched);
    CHECK(right.press_force_n == doctest::Approx(2.4).epsilon(0.1));
    const PressedPair pulls = pressed(-0.03, "");
    CHECK(has(pulls.fault, "50 mm through free air and back: up to "));
    CHECK(pulls.air_force_n > 1);
    const PressedPair shut = pressed(
        0.02, "[motion_limits]\nworkspace = { min_m = [-1, -1, -1], max_m = [1, 1, 0.0098] }\n");
    CHECK(has(shut.fault, "cannot be touched: on "));
    CHECK_FALSE(shut.touched);
  }

  TEST_CASE("a mesh that takes too long is not ended, and ends nothing") {
    haptic::tools::ChildLimits limits = kAcceptanceLimits;
    limits.seconds = 1;
    const haptic::tools::RawMesh fine = haptic::tools::shape_mesh(
        haptic::tools::ThreadShape{0.016, 0.002, 40, false, 0, 5e-5, 128}, "long thread");
    const Acceptance result = accept_damaged(fine, MeshDamage::kNone, 0, limits);
    CHECK(result.outcome == Outcome::kUnended);
    CHECK(result.failed());
  }

  TEST_CASE("the program: a folder of files, the extension in any case, refusals that are true") {
    const ScratchFolder folder("acceptance");
    std::filesystem::create_directories(folder.file("in"));
    std::ofstream(folder.file("in/a.OBJ")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    std::ofstream(folder.file("in/b.obj")) << "v 0 0 0\n";
    std::ofstream(folder.file("in/c.txt")) << "no mesh\n";
    const std::string out = folder.file("out");
    const auto run = run_program(
        HAPTIC_HOST_SIM, "accept --damaged 0 --parts " + folder.file("in") + " --out " + out);
    CAPTURE(run.out);
    CHECK(run.exit_code == 0);
    CHECK(has(run.out, "1 of 2 meshes accepted"));
    CHECK(has(run.out, "1 of 1 accepted pairs: no force over 50 mm of free air, and a force on"));
    CHECK(has(run.out, "| a.OBJ | surface |"));
    CHECK(has(run.out, "| b.obj | refused |"));
    for (const char* name : {"/accept.csv", "/accept.json", "/accept.md"}) {
      CHECK(std::filesystem::exists(out + name));
    }
    CHECK(has(run.err, "meshes: 2 / 2"));
    CHECK(run_program(HAPTIC_HOST_SIM, "accept --parts " + folder.file("absent")).exit_code == 3);
    CHECK(run_program(HAPTIC_HOST_SIM, "accept --damaged -1").exit_code == 2);
  }
}
