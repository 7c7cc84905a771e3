// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/mesh_input.hpp"

#include <cmath>
#include <span>
#include <string_view>

#include "tests/fuzz/fuzz_target.hpp"
#include "tools/common/error.hpp"

namespace haptic::fuzz {
namespace {

void check_raw_mesh(const tools::RawMesh& mesh) {
  require(!mesh.faces.empty(), "an accepted mesh has a face");
  require(mesh.vertex_places.size() == mesh.vertices.size(), "each vertex has a place");
  require(std::isfinite(mesh.print_resolution) && mesh.print_resolution >= 0.0,
          "the print resolution is a length");
  for (const tools::Point3& p : mesh.vertices) {
    require(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]),
            "coordinates are finite");
  }
  for (const tools::RawFace& face : mesh.faces) {
    require(face.vertices.size() >= 3, "a face has three corners");
    for (const std::uint32_t v : face.vertices) {
      require(v < mesh.vertices.size(), "corners refer to vertices");
    }
  }
}

}  // namespace

std::optional<tools::RawMesh> parse_input(const std::uint8_t* data, std::size_t size) {
  if (size == 0) {
    return std::nullopt;
  }
  constexpr tools::MeshFormat kFormats[] = {tools::MeshFormat::kObj, tools::MeshFormat::kStl,
                                            tools::MeshFormat::kOff, tools::MeshFormat::kPly};
  const std::span<const char> bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    tools::RawMesh mesh = tools::parse_mesh(bytes, kFormats[data[0] % 4], "fuzz");
    check_raw_mesh(mesh);
    return mesh;
  } catch (const tools::InputError& error) {
    const std::string_view text = error.what();
    require(text.starts_with("fuzz:"), "a refusal begins with the file");
    require(text.find("; ") != std::string_view::npos, "a refusal names the fix");
    require(text.size() < 1000, "a refusal is readable");
    return std::nullopt;
  }
}

}  // namespace haptic::fuzz
