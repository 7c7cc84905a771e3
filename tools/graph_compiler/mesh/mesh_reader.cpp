// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/mesh/mesh_reader.hpp"

#include <algorithm>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "tools/common/error.hpp"
#include "tools/graph_compiler/mesh/packed_file.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

/// Name of the format that the first word of the text announces; empty if it announces none.
std::string_view announced_format(std::string_view text) {
  LineScanner lines(text.substr(0, 4096), {.comments = true, .continuation = false});
  std::vector<std::string_view> words;
  if (!lines.next(words)) {
    return {};
  }
  const std::string_view first = words.front();
  if (first == "ply") {
    return "PLY";
  }
  if (first.ends_with("OFF")) {
    return "OFF";
  }
  if (equals_lower(first, "solid") || equals_lower(first, "facet")) {
    return "STL";
  }
  if (first == "v" || first == "mtllib" || first == "vn") {
    return "OBJ";
  }
  if (first.starts_with("glTF")) {
    return "binary glTF (.glb)";
  }
  if (first.starts_with("<?xml")) {
    return "XML (as COLLADA and AMF are)";
  }
  return first.starts_with("{") ? "JSON (as glTF is)" : std::string_view{};
}

void check_announced(std::string_view text, std::string_view expected, const std::string& file) {
  const std::string_view found = announced_format(text);
  if (!found.empty() && found != expected) {
    refuse_line(file, 1,
                "read as " + std::string(expected) + " but the content is " + std::string(found),
                "rename the file or convert it to OBJ, STL, OFF or PLY");
  }
}

}  // namespace

void check_mesh_bytes(std::uintmax_t bytes, const std::string& file) {
  if (bytes == 0) refuse_file(file, "the file is empty (0 bytes)", "export the part again");
  if (bytes > kMaxMeshBytes) {
    refuse_file(
        file,
        "the file has " + std::to_string(bytes) + " bytes, limit " + std::to_string(kMaxMeshBytes),
        "simplify the part");
  }
}

std::optional<MeshFormat> mesh_format_named(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  constexpr std::pair<std::string_view, MeshFormat> kFormats[] = {{".obj", MeshFormat::kObj},
                                                                  {".stl", MeshFormat::kStl},
                                                                  {".off", MeshFormat::kOff},
                                                                  {".ply", MeshFormat::kPly}};
  for (const auto& [name, format] : kFormats) {
    if (equals_lower(extension, name)) return format;
  }
  return std::nullopt;
}

MeshFormat mesh_format_of(const std::filesystem::path& path) {
  if (const auto format = mesh_format_named(path)) return *format;
  refuse_packed_name(path);
  refuse_file(
      path.string(),
      "the extension " + shown_word(path.extension().string()) + " names no mesh format",
      "give a file named .obj, .stl, .off or .ply, or .3mf, .gltf, .glb, .dae, .amf or .step");
}

RawMesh parse_mesh(std::span<const char> bytes, MeshFormat format, const std::string& file) {
  check_mesh_bytes(bytes.size(), file);
  refuse_packed(bytes, file);
  refuse_archive(bytes, file);
  RawMesh mesh;
  if (format == MeshFormat::kPly) {
    mesh = parse_ply(bytes, file);
  } else if (format == MeshFormat::kStl) {
    const std::string_view head(bytes.data(), std::min<std::size_t>(bytes.size(), 4));
    if (head.starts_with("OFF") || head.starts_with("COFF") || head.starts_with("ply")) {
      check_announced(std::string_view(bytes.data(), bytes.size()), "STL", file);
    }
    mesh = parse_stl(bytes, file);
  } else {
    const std::string_view text = checked_text(bytes, file);
    check_announced(text, format == MeshFormat::kObj ? "OBJ" : "OFF", file);
    mesh = format == MeshFormat::kObj ? parse_obj(text, file) : parse_off(text, file);
  }
  if (mesh.faces.empty()) {
    refuse_file(file, "the file holds no face", "export the part as a polygon mesh");
  }
  return mesh;
}

RawMesh read_mesh(const std::filesystem::path& path) {
  const std::string file = path.string();
  const MeshFormat format = mesh_format_of(path);
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    refuse_file(file, "there is no such file", "check the path");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) {
    refuse_file(file, "the size cannot be read (" + error.message() + ")", "check the permissions");
  }
  check_mesh_bytes(size, file);
  std::vector<char> bytes(static_cast<std::size_t>(size));
  std::ifstream stream(path, std::ios::binary);
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!stream || static_cast<std::uintmax_t>(stream.gcount()) != size) {
    refuse_file(file, "the file cannot be read", "check the permissions");
  }
  return parse_mesh(bytes, format, file);
}

}  // namespace haptic::tools
