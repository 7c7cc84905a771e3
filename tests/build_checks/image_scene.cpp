// SPDX-License-Identifier: Apache-2.0
// Writes the scene that the linker's checks embed: a cube of 20 mm above the edge of a slab. Usage:
// image_scene OUT

#include <array>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <vector>

#include "tools/graph_compiler/graph/scene_writer.hpp"

namespace {

using haptic::tools::Body;

/// An axis-aligned box about the origin of its body.
Body box(const char* name, double half_x_m, double half_y_m, double half_z_m) {
  const std::array<double, 3> half{half_x_m, half_y_m, half_z_m};
  Body body;
  body.name = name;
  body.volume_m3 = 8.0 * half_x_m * half_y_m * half_z_m;
  haptic::tools::ConvexPiece piece;
  piece.volume_m3 = body.volume_m3;
  for (int corner = 0; corner < 8; ++corner) {
    piece.vertices.push_back({(corner & 1) != 0 ? half[0] : -half[0],
                              (corner & 2) != 0 ? half[1] : -half[1],
                              (corner & 4) != 0 ? half[2] : -half[2]});
    piece.source_vertex.push_back(corner);
  }
  // Corners counter-clockwise seen from outside; bit k of a corner is its side along axis k.
  const std::array<std::array<std::uint32_t, 4>, 6> loops{
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (std::uint32_t face = 0; face < 6; ++face) {
    const std::size_t axis = face / 2;
    haptic::tools::BodyPlane plane;
    plane.normal = {0, 0, 0};
    plane.normal[axis] = face % 2 == 0 ? -1.0 : 1.0;
    plane.offset_m = half[axis];
    body.planes.push_back(plane);
    haptic::tools::PieceFace record;
    record.plane = face;
    record.loop.assign(loops[face].begin(), loops[face].end());
    record.source_face = face;
    piece.faces.push_back(record);
  }
  body.pieces.push_back(piece);
  return body;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: image_scene OUT\n", stderr);
    return 2;
  }
  try {
    haptic::tools::SceneDescription scene;
    scene.name = "image check";
    scene.moving.body = box("cube", 0.01, 0.01, 0.01);
    scene.moving.position_m = {0.028, 0.003, 0.022};
    haptic::tools::PlacedBody slab;
    slab.body = box("slab", 0.03, 0.03, 0.005);
    scene.statics.push_back(slab);
    scene.parameters.law = haptic::LawId::kPaper;
    scene.parameters.k_f_n_per_m = 1000.0;
    scene.parameters.epsilon_m = 1.0e-4;
    scene.parameters.rate_hz = 1000.0;
    const std::vector<std::byte> blob = haptic::tools::write_scene(scene);
    std::FILE* file = std::fopen(argv[1], "wb");
    if (file == nullptr) return 3;
    const bool written = std::fwrite(blob.data(), 1, blob.size(), file) == blob.size();
    return std::fclose(file) == 0 && written ? 0 : 3;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 3;
  }
}
