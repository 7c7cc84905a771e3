// SPDX-License-Identifier: Apache-2.0
// The exploded view: pieces keep their shape, seams are seams, the files hold what they should.
#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <sstream>

#include "tests/support/pruned_scenes.hpp"
#include "tools/scene_facts/scene_facts.hpp"
#include "tools/scene_inspect/exploded_view.hpp"
#include "tools/scene_inspect/piece_exposure.hpp"

using namespace haptic;
using namespace haptic::test;
using namespace haptic::tools;

namespace {

/// A box of nine pieces under a tetrahedron.
struct CutScene {
  CutScene()
      : scene(
            scene_of(tetrahedron({0, 0, 0}, {0.1, 0, 0.01}, {0.02, 0.1, 0}, {0, 0.03, 0.1}),
                     {cut_box({0, 0, 0}, {3, 2, 1}, {1, 2.2}, {{0.5, 1}, {0.7, 1.3}, {0.4, 1}})})) {
    for (std::uint32_t b = 0; b < 2; ++b) {
      for (PieceExposure& e : exposure_of_body(scene.view, b, body_tolerance(scene.view, b))) {
        exposure.push_back(std::move(e));
      }
    }
  }
  LoadedScene scene;
  std::vector<PieceExposure> exposure;
};

double area_of(const std::vector<Point3>& loop) {
  Point3 sum{0, 0, 0};
  for (std::size_t i = 1; i + 1 < loop.size(); ++i) {
    sum = vec::add(sum, vec::cross(vec::sub(loop[i], loop[0]), vec::sub(loop[i + 1], loop[0])));
  }
  return vec::norm(sum) / 2;
}

}  // namespace

TEST_SUITE("tools.exploded_view") {
  TEST_CASE("what is drawn as surface has the area of the uncut box, seams the rest") {
    const CutScene cut;
    const auto bodies = exploded_bodies(cut.scene.view, cut.exposure, 0.7);
    REQUIRE(bodies[1].pieces.size() == 9);
    double open = 0.0, all = 0.0;
    for (const ExplodedPiece& piece : bodies[1].pieces) {
      for (const ExplodedFace& face : piece.faces) {
        all += area_of(face.loop);
        if (face.kind == FaceKind::kOpen) open += area_of(face.loop);
        for (const auto& part : face.open) open += area_of(part);
      }
    }
    CHECK(open == doctest::Approx(2 * (3 * 2 + 2 * 1 + 3 * 1)));
    // Two cuts across, two along in each of three slabs; every seam has two sides.
    CHECK(all == doctest::Approx(open + 2 * (2 * 2 + 2 * 3)));
    for (const ExplodedFace& face : bodies[0].pieces[0].faces) CHECK(face.kind == FaceKind::kOpen);
  }

  TEST_CASE("factor 0 leaves every piece in its place, a larger one pulls them apart") {
    const CutScene cut;
    const auto still = exploded_bodies(cut.scene.view, cut.exposure, 0.0);
    const auto apart = exploded_bodies(cut.scene.view, cut.exposure, 1.0);
    for (std::size_t i = 0; i < 9; ++i) {
      const PieceView piece = cut.scene.view.piece(1 + static_cast<std::uint32_t>(i));
      const ExplodedFace& face = still[1].pieces[i].faces[0];
      const auto first = piece.vertex(piece.face_vertices(0)[0]);
      for (int k = 0; k < 3; ++k) {
        CHECK(face.loop[0][static_cast<std::size_t>(k)] == static_cast<double>(first[k]));
      }
      for (std::size_t j = 0; j < i; ++j) {
        CHECK(!apart[1].pieces[i].box.grown(-1e-9).meets(apart[1].pieces[j].box));
      }
    }
  }

  TEST_CASE("OBJ: a group per piece, each closed and of its volume; only named materials") {
    const CutScene cut;
    const auto bodies = exploded_bodies(cut.scene.view, cut.exposure, 0.6);
    std::istringstream lines(exploded_obj(bodies, "exploded.mtl"));
    const std::string mtl = exploded_mtl(bodies);
    std::vector<Point3> points;
    std::vector<double> volumes;
    std::map<std::pair<std::size_t, std::size_t>, int> edges;
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::string key, name;
      words >> key;
      if (key == "g") volumes.push_back(0.0);
      if (key == "usemtl") {
        words >> name;
        CHECK(mtl.find("newmtl " + name + "\n") != std::string::npos);
      }
      if (key == "v") {
        Point3& p = points.emplace_back();
        words >> p[0] >> p[1] >> p[2];
      }
      if (key != "f") continue;
      std::vector<std::size_t> loop;
      for (std::size_t i = 0; words >> i;) loop.push_back(i - 1);
      REQUIRE(loop.size() >= 3);
      for (std::size_t k = 0; k < loop.size(); ++k) {
        REQUIRE(loop[k] < points.size());
        edges[{loop[k], loop[(k + 1) % loop.size()]}] += 1;
        if (k < 2) continue;
        volumes.back() +=
            vec::dot(points[loop[0]], vec::cross(points[loop[k - 1]], points[loop[k]])) / 6;
      }
    }
    REQUIRE(volumes.size() == 10);
    for (std::size_t i = 0; i < volumes.size(); ++i) {
      CHECK(volumes[i] == doctest::Approx(cut.scene.view.pieces()[i].volume_m3).epsilon(1e-6));
    }
    for (const auto& [edge, times] : edges) {
      CHECK(times == 1);
      CHECK(edges.count({edge.second, edge.first}) == 1);
    }
  }
}
