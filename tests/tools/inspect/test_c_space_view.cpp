// SPDX-License-Identifier: Apache-2.0
// C-space at one pose: closed polyhedra whose faces are those of an independent sum of the pieces,
// faces that are hidden where a part goes on, facets of surfaces, and the files.
#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <sstream>

#include "tests/support/program_run.hpp"
#include "tests/support/pruned_scenes.hpp"
#include "tests/support/text_search.hpp"
#include "tools/c_space/pose_text.hpp"
#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/scene_inspect/c_space_view.hpp"

using namespace haptic;
using namespace haptic::test;
using namespace haptic::tools;
using haptic::sim::test::ScratchFolder;

namespace {

Pose turned(double x, double y, double z, double angle) {
  Pose pose;
  pose.p_wa = Vec3(static_cast<Real>(x), static_cast<Real>(y), static_cast<Real>(z));
  pose.q_wa = Quat(
      Eigen::AngleAxis<Real>(static_cast<Real>(angle), Vec3(0.3_r, -0.5_r, 0.8_r).normalized()));
  return pose;
}

/// Largest n . (b - R a) over all vertices of the two pieces: where a plane of the sum must lie.
double support_of(const SceneView& view, PairIndex index, const PlacedMoving& moving,
                  const Vector& n) {
  const PairView pair = view.pair(index);
  const double* reference = view.bodies()[pair.b.record->body].reference_m;
  double of_b = -HUGE_VAL, of_a = -HUGE_VAL;
  for (std::uint32_t v = 0; v < pair.b.vertex_count; ++v) {
    const Vector b = pair.b.vertex(v).cast<double>();
    of_b = std::max(of_b, n.dot(b + Vector(reference[0], reference[1], reference[2])));
  }
  for (std::uint32_t v = 0; v < pair.a.vertex_count; ++v) {
    const Vector a = pair.a.vertex(v).cast<double>();
    double value = 0;
    for (std::size_t k = 0; k < 3; ++k)
      value += n[static_cast<int>(k)] * vector_of(moving.r_wa[k]).dot(a);
    of_a = std::max(of_a, -value);
  }
  return of_b + of_a;
}

/// Every plane supports the sum of the pieces, and every edge has its other side.
void require_closed(const SceneView& view, const DrawnObstacle& drawn, const Pose& pose) {
  const PlacedMoving moving = place_moving(view, pose);
  std::map<std::array<long, 6>, int> edges;
  const auto key = [](const Vector& v, std::size_t k) {
    return std::lround(v[static_cast<int>(k)] * 1e6);
  };
  for (const CFace& face : drawn.obstacle.faces) {
    CHECK(std::abs(face.offset_m - support_of(view, drawn.pair, moving, face.normal)) < 1e-6);
    for (std::size_t k = 0; k < face.polygon.size(); ++k) {
      const Vector &from = face.polygon[k], &to = face.polygon[(k + 1) % face.polygon.size()];
      edges[{key(from, 0), key(from, 1), key(from, 2), key(to, 0), key(to, 1), key(to, 2)}] += 1;
    }
  }
  std::size_t without = 0;
  for (const auto& [edge, times] : edges) {
    const std::array<long, 6> back{edge[3], edge[4], edge[5], edge[0], edge[1], edge[2]};
    if (times != 1 || !edges.contains(back)) without += 1;
  }
  CHECK(edges.size() > 12);
  CHECK(without == 0);
}

LoadedScene wedge_over_cut_box() {
  return LoadedScene(
      scene_of(tetrahedron({0, 0, 0}, {0.1, 0, 0.01}, {0.02, 0.1, 0}, {0, 0.03, 0.1}),
               {cut_box({0, 0, 0}, {3, 2, 1}, {1, 2.2}, {{0.5, 1}, {0.7, 1.3}, {0.4, 1}})}));
}

}  // namespace

TEST_SUITE("tools.c_space_view") {
  TEST_CASE("the nearest pairs, each a closed polyhedron whose planes support the sum") {
    const LoadedScene scene = wedge_over_cut_box();
    const Pose pose = turned(1.4, 0.9, 1.3, 0.7);
    const CSpaceView space = c_space_view(scene.view, pose);
    CHECK(space.pairs == 9);
    REQUIRE(space.obstacles.size() == kMostObstacles);
    for (std::size_t k = 0; k < space.obstacles.size(); ++k) {
      if (k > 0) CHECK(space.obstacles[k - 1].distance_m <= space.obstacles[k].distance_m);
      require_closed(scene.view, space.obstacles[k], pose);
    }
  }

  TEST_CASE("a face is hidden where another piece of the part goes on, and nowhere else") {
    const LoadedScene scene = wedge_over_cut_box();
    const CSpaceView space = c_space_view(scene.view, turned(1.4, 0.9, 1.3, 0.7));
    std::size_t hidden = 0;
    for (const DrawnObstacle& drawn : space.obstacles) {
      for (const CFace& face : drawn.obstacle.faces) {
        bool all = true;
        for (const std::uint32_t node : face.nodes) {
          CHECK(drawn.contacts[node].applicable);
          all = all && drawn.contacts[node].hidden;
        }
        CHECK(face.hidden == all);
        // The top of the box is open wherever a vertex of the part meets it.
        if (std::abs(face.normal[2] - 1) < 1e-9) CHECK_FALSE(face.hidden);
        hidden += face.hidden ? 1 : 0;
      }
    }
    // The scene has no marks, so that nothing is hidden; the compiled peg and hole below has.
    CHECK(hidden == 0);
  }

  TEST_CASE("facets of a surface: closed polyhedra; inside of a flat sheet their rims are hidden") {
    const ScratchFolder folder("c_space_facets");
    // Two coplanar triangles that share a diagonal.
    std::ofstream(folder.file("sheet.obj"))
        << "v 0 0 0\nv 1 0 0\nv 1 1 0.3\nv 0 1 0\nf 1 2 4\nf 2 3 4\n";
    std::ofstream(folder.file("scene.toml"))
        << "format = 1\nname = \"sheet\"\n[moving]\nshape = \"box\"\nsize_m = [0.01, 0.01, 0.01]\n"
           "as = \"surface\"\nposition_m = [0.01, 0.01, 0.05]\n[[static]]\nmesh = \"sheet.obj\"\n"
           "scale_to_m = 0.02\n[rendering]\nk_f_n_per_m = 800\n";
    const CompiledScene compiled =
        compile_scene(read_scene_file(folder.file("scene.toml")), CompileOptions{});
    SceneBytes bytes{compiled.bytes};
    SceneView view;
    REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
    REQUIRE(view.has_facets());
    // Straight, where box and sheet have parallel edges and the sums of flat facets are flat, and
    // turned.
    for (const double angle : {0.0, 0.4}) {
      const Pose pose = turned(0.006, 0.005, 0.012, angle);
      const CSpaceView space = c_space_view(view, pose);
      REQUIRE_FALSE(space.obstacles.empty());
      std::size_t hidden = 0;
      for (const DrawnObstacle& drawn : space.obstacles) {
        if (angle > 0) require_closed(view, drawn, pose);
        hidden += drawn.hidden_faces;
      }
      CHECK(hidden > 0);
      CHECK(c_space_svg(space).find("</svg>") != std::string::npos);
    }
  }

  TEST_CASE(
      "files: a line for each basic contact, a group for each pair, the sheet within bounds") {
    const LoadedScene scene = wedge_over_cut_box();
    const CSpaceView space = c_space_view(scene.view, turned(1.4, 0.9, 1.3, 0.7));
    std::size_t contacts = 0, faces = 0;
    for (const DrawnObstacle& drawn : space.obstacles) {
      contacts += drawn.contacts.size();
      faces += drawn.obstacle.faces.size();
    }
    CHECK(times(c_space_csv(space), "\n") == 1 + contacts);
    const std::string obj = c_space_obj(space, "cspace.mtl"), mtl = c_space_mtl();
    CHECK(times(obj, "\ng ") == space.obstacles.size());
    CHECK(times(obj, "\nf ") == faces);
    std::istringstream lines(obj);
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("usemtl "))
        CHECK(mtl.find("newmtl " + line.substr(7) + "\n") != std::string::npos);
    }
    const std::string svg = c_space_svg(space);
    CHECK(svg == c_space_svg(space));
    CHECK(times(svg, "class=\"c-face") > space.obstacles.size());
    double width = 0, height = 0;
    REQUIRE(std::sscanf(svg.c_str() + svg.find("viewBox=\"0 0 "), "viewBox=\"0 0 %lf %lf", &width,
                        &height) == 2);
    for (std::size_t at = svg.find("points=\""); at != std::string::npos;
         at = svg.find("points=\"", at + 1)) {
      std::istringstream points(svg.substr(at + 8, svg.find('"', at + 8) - at - 8));
      char comma = 0;
      for (double x = 0, y = 0; points >> x >> comma >> y;)
        CHECK((x >= 0 && x <= width && y >= 0 && y <= height));
    }
  }

  TEST_CASE("a pose as a person writes it; what is none is named") {
    const LoadedScene scene = wedge_over_cut_box();
    CHECK(pose_from_text(scene.view, "--cspace", "0.1, 5mm, -20um")
              .p_wa.isApprox(Vec3(0.1_r, 0.005_r, -2e-5_r)));
    CHECK(pose_from_text(scene.view, "--cspace", "0,0,0,0,0,0,2").q_wa.z() == 1.0_r);
    const double* start = scene.view.parameters().start_p_wa_m;
    CHECK(pose_from_text(scene.view, "--cspace", "start").p_wa[2] == static_cast<Real>(start[2]));
    for (const char* text : {"", "1,2", "1,2,x", "1,2,3in", "1,2,nan", "1,2,3,1mm,0,0,0",
                             "0,0,0,0,0,0,0", "1,2,3,4"}) {
      CAPTURE(text);
      CHECK_THROWS_AS((void)pose_from_text(scene.view, "--cspace", text), UsageError);
    }
  }

  TEST_CASE("scene_inspect --cspace: the peg in its hole, with the seams of the hole hidden") {
    const ScratchFolder folder("c_space_program");
    const std::string scene = folder.file("peg.rtscene");
    REQUIRE(sim::test::run_program(HAPTIC_GRAPH_COMPILER, std::string("'") + HAPTIC_SCENES +
                                                              "/square_peg_five/scene.toml' -o '" +
                                                              scene + "' --quiet")
                .exit_code == 0);
    const auto inspect = [&](const std::string& options) {
      return sim::test::run_program(HAPTIC_SCENE_INSPECT, "'" + scene + "' " + options);
    };
    const std::string out = " --cspace-dir '" + folder.file("view") + "'";
    const auto run = inspect("--cspace 0,0,-10mm" + out);
    CHECK(run.exit_code == 0);
    CHECK(run.out.find("5 of 5 pairs drawn") != std::string::npos);
    for (const char* name : {"cspace.svg", "cspace.obj", "cspace.mtl", "cspace.csv"})
      CHECK(std::filesystem::file_size(folder.file(std::string("view/") + name)) > 100);
    std::ifstream obj(folder.file("view/cspace.obj"));
    std::stringstream text;
    text << obj.rdbuf();
    CHECK(times(text.str(), "_hidden\n") > 20);
    CHECK(times(text.str(), "usemtl type_B\n") > 5);
    CHECK(inspect("--cspace 0,0" + out).exit_code == 2);
    CHECK(inspect("--cspace start").exit_code == 2);
    CHECK(inspect("--cspace start --json" + out).exit_code == 2);
  }
}
