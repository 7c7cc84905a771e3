// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/mesh_table/mesh_text.hpp"

#include <bit>
#include <cstdio>

namespace haptic::tools::test {
namespace {

/// Shortest of up to 15 digits: design values stay as short as a person would write them.
std::string number(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%.15g", x);
  return text;
}

std::string point(const Point3& p) {
  return number(p[0]) + " " + number(p[1]) + " " + number(p[2]);
}

}  // namespace

std::string obj_text(const MeshBuilder& mesh) {
  std::string text;
  for (const Point3& p : mesh.vertices) {
    text += "v " + point(p) + "\n";
  }
  std::uint32_t group = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (mesh.groups[f] != group) {
      group = mesh.groups[f];
      text += "g part" + std::to_string(group) + "\n";
    }
    text += "f";
    for (const std::uint32_t v : mesh.faces[f]) {
      text += " " + std::to_string(v + 1);
    }
    text += "\n";
  }
  return text;
}

std::string off_text(const MeshBuilder& mesh) {
  std::string text = "OFF\n" + std::to_string(mesh.vertices.size()) + " " +
                     std::to_string(mesh.faces.size()) + " 0\n";
  for (const Point3& p : mesh.vertices) {
    text += point(p) + "\n";
  }
  for (const auto& face : mesh.faces) {
    text += std::to_string(face.size());
    for (const std::uint32_t v : face) {
      text += " " + std::to_string(v);
    }
    text += "\n";
  }
  return text;
}

std::vector<std::array<Point3, 3>> fans_of(const MeshBuilder& mesh) {
  std::vector<std::array<Point3, 3>> triangles;
  for (const auto& face : mesh.faces) {
    for (std::size_t i = 1; i + 1 < face.size(); ++i) {
      triangles.push_back(
          {mesh.vertices[face[0]], mesh.vertices[face[i]], mesh.vertices[face[i + 1]]});
    }
  }
  return triangles;
}

std::string stl_text(const MeshBuilder& mesh) {
  std::string text = "solid part\n";
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (f > 0 && mesh.groups[f] != mesh.groups[f - 1]) {
      text += "endsolid part\nsolid part\n";
    }
    const auto& face = mesh.faces[f];
    for (std::size_t i = 1; i + 1 < face.size(); ++i) {
      text += "facet normal 0 0 0\nouter loop\n";
      for (const std::uint32_t v : {face[0], face[i], face[i + 1]}) {
        text += "vertex " + point(mesh.vertices[v]) + "\n";
      }
      text += "endloop\nendfacet\n";
    }
  }
  return text + "endsolid part\n";
}

std::string stl_bytes(const std::string& header, std::uint32_t announced,
                      const std::vector<std::array<Point3, 3>>& triangles) {
  std::string bytes = header;
  bytes.resize(80, '\0');
  const auto append = [&](std::uint32_t word) {
    for (unsigned i = 0; i < 4; ++i) {
      bytes += static_cast<char>((word >> (8 * i)) & 0xFFU);
    }
  };
  append(announced);
  for (const auto& triangle : triangles) {
    for (int i = 0; i < 3; ++i) {
      append(0);
    }
    for (const Point3& p : triangle) {
      for (const double x : p) {
        append(std::bit_cast<std::uint32_t>(static_cast<float>(x)));
      }
    }
    bytes += std::string(2, '\0');
  }
  return bytes;
}

std::string stl_binary(const MeshBuilder& mesh) {
  const auto triangles = fans_of(mesh);
  return stl_bytes("", static_cast<std::uint32_t>(triangles.size()), triangles);
}

std::string written(const MeshBuilder& mesh, Written form) {
  switch (form) {
    case Written::kObj:
      return obj_text(mesh);
    case Written::kOff:
      return off_text(mesh);
    case Written::kStlText:
      return stl_text(mesh);
    default:
      return stl_binary(mesh);
  }
}

const char* form_name(Written form) {
  switch (form) {
    case Written::kObj:
      return "obj";
    case Written::kOff:
      return "off";
    case Written::kStlText:
      return "text stl";
    default:
      return "binary stl";
  }
}

const char* form_extension(Written form) {
  switch (form) {
    case Written::kObj:
      return ".obj";
    case Written::kOff:
      return ".off";
    default:
      return ".stl";
  }
}

}  // namespace haptic::tools::test
