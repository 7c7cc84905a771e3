// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <functional>
#include <string>

#include "tests/support/shapes.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/graph/piece_topology.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

struct Defect {
  const char* name;
  const char* expected;  ///< part of the message
  std::function<void(tools::Body&)> apply;
};

std::string message_of(const tools::SceneDescription& description) {
  try {
    tools::write_scene(description);
  } catch (const tools::InputError& error) {
    return error.what();
  }
  return "accepted";
}

tools::SceneDescription scene_with(const Defect& defect) {
  tools::Body moving = box({-0.01, -0.02, -0.03}, {0.01, 0.02, 0.03});
  defect.apply(moving);
  return scene_of(moving, {box({0, 0, 0}, {1, 1, 1})});
}

}  // namespace

TEST_SUITE("tools.piece_topology") {
  TEST_CASE("edges are sorted, face[0] walks v0 to v1, the apex is the farthest vertex") {
    const tools::Body body = prism(5, 1.0, 3.0);
    const tools::PieceTopology t = tools::build_topology(body, body.pieces[0], "prism");
    REQUIRE(t.edges.size() == 15);
    for (std::size_t e = 0; e < t.edges.size(); ++e) {
      const EdgeRecord& edge = t.edges[e];
      CHECK(edge.vertex[0] < edge.vertex[1]);
      if (e > 0) {
        const EdgeRecord& before = t.edges[e - 1];
        CHECK(std::pair(before.vertex[0], before.vertex[1]) <
              std::pair(edge.vertex[0], edge.vertex[1]));
      }
      for (std::size_t k = 0; k < 2; ++k) {
        const auto& loop = body.pieces[0].faces[edge.face[k]].loop;
        bool walked = false;
        for (std::size_t i = 0; i < loop.size(); ++i) {
          walked = walked ||
                   (loop[i] == edge.vertex[k] && loop[(i + 1) % loop.size()] == edge.vertex[1 - k]);
        }
        CHECK(walked);
        // On a pentagon the farthest vertex is the opposite one, on the mantle's rectangles any of
        // the other edge.
        CHECK(edge.apex[k] != edge.vertex[0]);
        CHECK(edge.apex[k] != edge.vertex[1]);
        if (loop.size() == 5) {
          const auto at = std::find(loop.begin(), loop.end(), edge.vertex[k]) - loop.begin();
          CHECK(edge.apex[k] == loop[static_cast<std::size_t>(at + 3) % 5]);
        }
      }
    }
  }

  TEST_CASE("pieces that are no closed convex polyhedra are refused with piece and element") {
    const Defect defects[] = {
        {"face missing", "is not walked once in each direction",
         [](tools::Body& b) { b.pieces[0].faces.pop_back(); }},
        {"face doubled", "is not walked once in each direction",
         [](tools::Body& b) { b.pieces[0].faces.push_back(b.pieces[0].faces[0]); }},
        {"loop turned round", "is not walked once in each direction",
         [](tools::Body& b) {
           auto& loop = b.pieces[0].faces[2].loop;
           std::reverse(loop.begin(), loop.end());
         }},
        {"all loops turned round", "is not counter-clockwise",
         [](tools::Body& b) {
           for (auto& face : b.pieces[0].faces) std::reverse(face.loop.begin(), face.loop.end());
         }},
        {"vertex index", "names vertex 8 of 8",
         [](tools::Body& b) { b.pieces[0].faces[1].loop[2] = 8; }},
        {"plane index", "names plane 6 of 6",
         [](tools::Body& b) { b.pieces[0].faces[1].plane = 6; }},
        {"sign", "face 4 has a sign", [](tools::Body& b) { b.pieces[0].faces[4].sign = 0; }},
        {"wrong sign", "is outside face 3", [](tools::Body& b) { b.pieces[0].faces[3].sign = -1; }},
        {"vertex twice in a loop", "face 5 visits a vertex twice",
         [](tools::Body& b) { b.pieces[0].faces[5].loop.push_back(b.pieces[0].faces[5].loop[0]); }},
        {"two vertices", "face 0 has fewer than three",
         [](tools::Body& b) { b.pieces[0].faces[0].loop.resize(2); }},
        {"unused vertex", "vertex 8 has 0 edges",
         [](tools::Body& b) {
           b.pieces[0].vertices.push_back({0, 0, 0});
           b.pieces[0].source_vertex.push_back(-1);
         }},
        {"dented", "face", [](tools::Body& b) { b.pieces[0].vertices[7][0] += 1e-6; }},
        {"not finite", "is not finite",
         [](tools::Body& b) { b.pieces[0].vertices[0][1] = 1.0 / 0.0; }},
        {"normal too long", "not of unit length",
         [](tools::Body& b) {
           b.planes[0].normal[0] *= 1.001;
           b.planes[0].normal[1] *= 1.001;
           b.planes[0].normal[2] *= 1.001;
         }},
        {"volume", "its pieces sum to", [](tools::Body& b) { b.volume_m3 *= 1.01; }},
        {"no piece", "no convex piece", [](tools::Body& b) { b.pieces.clear(); }},
    };
    CHECK(message_of(scene_with({"", "", [](tools::Body&) {}})) == "accepted");
    for (const Defect& defect : defects) {
      CAPTURE(defect.name);
      const std::string message = message_of(scene_with(defect));
      CAPTURE(message);
      CHECK(message.find(defect.expected) != std::string::npos);
      CHECK(message.find("test body") == 0);
    }
  }

  TEST_CASE("two spheres in one piece are refused although every edge is paired") {
    tools::Body body = box({0, 0, 0}, {1, 1, 1});
    const tools::Body other = box({5, 5, 5}, {6, 6, 6});
    tools::ConvexPiece& piece = body.pieces[0];
    for (tools::PieceFace face : other.pieces[0].faces) {
      for (std::uint32_t& v : face.loop) v += 8;
      face.plane += 6;
      piece.faces.push_back(face);
    }
    piece.vertices.insert(piece.vertices.end(), other.pieces[0].vertices.begin(),
                          other.pieces[0].vertices.end());
    piece.source_vertex.resize(16, -1);
    body.planes.insert(body.planes.end(), other.planes.begin(), other.planes.end());
    CHECK_THROWS_WITH_AS(tools::build_topology(body, piece, "twins"),
                         doctest::Contains("V - E + F = 2"), tools::InputError);
  }
}
