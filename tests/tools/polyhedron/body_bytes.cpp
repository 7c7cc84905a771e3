// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/polyhedron/body_bytes.hpp"

#include <cstdio>

namespace haptic::tools::test {

namespace {

std::string hex(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%a ", x);
  return text;
}

template <class Range>
std::string hex_all(const Range& values) {
  std::string text;
  for (const double x : values) text += hex(x);
  return text + "\n";
}

}  // namespace

std::string body_text(const Body& body) {
  std::string text = body.name + "\n" + hex(body.volume_m3) + hex_all(body.centre_of_volume_m);
  for (const BodyPlane& plane : body.planes) text += hex(plane.offset_m) + hex_all(plane.normal);
  for (const ConvexPiece& piece : body.pieces) {
    text += "piece " + hex(piece.volume_m3) + "\n";
    for (std::size_t i = 0; i < piece.vertices.size(); ++i) {
      text += std::to_string(piece.source_vertex[i]) + " " + hex_all(piece.vertices[i]);
    }
    for (const PieceFace& face : piece.faces) {
      text += std::to_string(face.plane) + " " + std::to_string(face.sign) + " " +
              std::to_string(face.source_face) + ":";
      for (const std::uint32_t v : face.loop) text += " " + std::to_string(v);
      text += "\n";
    }
  }
  return text;
}

}  // namespace haptic::tools::test
