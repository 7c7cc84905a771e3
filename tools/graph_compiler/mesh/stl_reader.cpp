// SPDX-License-Identifier: Apache-2.0
/// STL, text and binary. The stored normals are ignored: the order of the corners is the
/// orientation.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>

#include "tools/graph_compiler/mesh/mesh_nodes.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

constexpr std::size_t kBinaryHeader = 84;    // 80 bytes of text, then the count
constexpr std::size_t kBinaryTriangle = 50;  // normal, three corners (float), two bytes

std::uint32_t little_endian_word(std::span<const char> bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t i = 4; i-- > 0;) {
    word = (word << 8) | static_cast<unsigned char>(bytes[at + i]);
  }
  return word;
}

/// Every solid is a part.
void add_solid(std::string_view name, RawMesh& mesh) {
  mesh.group_nodes.push_back(static_cast<std::uint32_t>(mesh.nodes.size()));
  mesh.nodes.push_back({tidy_name(name, "solid"), MeshNode::kNone, true});
}

class StlTextParser {
 public:
  StlTextParser(std::string_view text, const std::string& file)
      : lines_(text, {.comments = false, .continuation = false}), file_(file) {
    mesh_.file = file;
  }

  RawMesh parse() {
    std::uint32_t solid = 0;
    while (lines_.next(words_)) {
      at_ = 0;
      if (!equals_lower(words_.front(), "solid")) {
        refuse(
            "found " + shown_word(words_.front()) + " where 'solid' or the end of the file must be",
            "delete what does not belong to the mesh");
      }
      std::string name;
      for (std::size_t k = 1; k < words_.size(); ++k) name += std::string(words_[k]) + ' ';
      add_solid(name, mesh_);
      words_.clear();  // the rest of the line is a name
      read_solid(solid++);
    }
    mesh_.print_resolution = printed_.resolution();
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void refuse(const std::string& defect, const std::string& fix) const {
    refuse_line(file_, lines_.line(), defect, fix);
  }

  std::string_view next_word() {
    while (at_ >= words_.size()) {
      at_ = 0;
      if (!lines_.next(words_)) {
        refuse("the file ends inside a solid", "complete the file: 'endsolid' is missing");
      }
    }
    return words_[at_++];
  }

  void expect(std::string_view keyword) {
    const std::string_view word = next_word();
    if (!equals_lower(word, keyword)) {
      refuse("found " + shown_word(word) + " where '" + std::string(keyword) + "' must be",
             "export the part again");
    }
  }

  void read_solid(std::uint32_t group) {
    for (;;) {
      const std::string_view word = next_word();
      if (equals_lower(word, "endsolid")) {
        words_.clear();
        return;
      }
      if (!equals_lower(word, "facet")) {
        refuse("found " + shown_word(word) + " where 'facet' or 'endsolid' must be",
               "export the part again");
      }
      read_facet(group);
    }
  }

  void read_facet(std::uint32_t group) {
    if (mesh_.faces.size() >= kMaxMeshFaces) {
      refuse("more than " + std::to_string(kMaxMeshFaces) + " faces", "simplify the part");
    }
    RawFace face;
    face.source_place = lines_.line();
    face.group = group;
    expect("normal");
    for (int i = 0; i < 3; ++i) {
      next_word();  // often wrong, sometimes NaN
    }
    expect("outer");
    expect("loop");
    for (int i = 0; i < 3; ++i) {
      expect("vertex");
      Point3 point{};
      for (double& value : point) {
        const std::string_view word = next_word();
        value = parse_number(word, file_, lines_.line(), "coordinate", &printed_);
      }
      face.vertices.push_back(static_cast<std::uint32_t>(mesh_.vertices.size()));
      mesh_.vertices.push_back(point);
      mesh_.vertex_places.push_back(lines_.line());
    }
    expect("endloop");
    expect("endfacet");
    mesh_.faces.push_back(std::move(face));
  }

  LineScanner lines_;
  std::string file_;
  RawMesh mesh_;
  PrintedDigits printed_;
  std::vector<std::string_view> words_;
  std::size_t at_ = 0;
};

/// Size of a binary STL that begins at `begin`, or 0 where its header or a triangle of it would be
/// behind the end.
std::size_t block_bytes(std::span<const char> bytes, std::size_t begin) {
  if (bytes.size() - begin < kBinaryHeader) return 0;
  const std::size_t count = little_endian_word(bytes, begin + kBinaryHeader - 4);
  const std::size_t size = kBinaryHeader + kBinaryTriangle * count;
  return size <= bytes.size() - begin ? size : 0;
}

/// Where the binary STL files in `bytes` begin, one behind the other to the end of all; the first
/// alone where what follows it is something else. `end`: behind the last.
std::vector<std::size_t> block_starts(std::span<const char> bytes, std::size_t& end) {
  end = block_bytes(bytes, 0);
  std::vector<std::size_t> starts{0};
  for (std::size_t at = end; at < bytes.size();) {
    const std::size_t size = block_bytes(bytes, at);
    if (size <= kBinaryHeader) return {0};
    starts.push_back(at);
    at += size;
    if (at == bytes.size()) end = at;
  }
  return starts;
}

/// Adds the triangles of the binary STL that begins at `start`.
void add_block(std::span<const char> bytes, std::size_t start, std::uint32_t group, RawMesh& mesh) {
  const std::size_t count = little_endian_word(bytes, start + kBinaryHeader - 4);
  if (count > kMaxMeshFaces - mesh.faces.size()) {
    refuse_byte(mesh.file, start + kBinaryHeader - 4,
                std::to_string(mesh.faces.size() + count) + " triangles, limit " +
                    std::to_string(kMaxMeshFaces),
                "simplify the part");
  }
  if (mesh.faces.empty()) {
    mesh.vertices.reserve(3 * count);
    mesh.vertex_places.reserve(3 * count);
    mesh.faces.reserve(count);
  }
  for (std::size_t t = 0; t < count; ++t) {
    const std::size_t begin = start + kBinaryHeader + kBinaryTriangle * t;
    RawFace face;
    face.source_place = begin;
    face.group = group;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::size_t at = begin + 12 * (corner + 1);
      Point3 point{};
      for (std::size_t i = 0; i < 3; ++i) {
        const float value = std::bit_cast<float>(little_endian_word(bytes, at + 4 * i));
        if (!std::isfinite(value)) {
          refuse_byte(mesh.file, at + 4 * i,
                      "a coordinate of triangle " + std::to_string(t) + " is not finite",
                      "export the part again or delete the triangle");
        }
        point[i] = static_cast<double>(value);
      }
      face.vertices.push_back(static_cast<std::uint32_t>(mesh.vertices.size()));
      mesh.vertices.push_back(point);
      mesh.vertex_places.push_back(at);
    }
    mesh.faces.push_back(std::move(face));
  }
}

std::string trailing_text(std::size_t bytes, const RawMesh& mesh) {
  const std::string triangles = std::to_string(mesh.faces.size());
  std::string text = mesh.file + ": " + std::to_string(bytes) + (bytes == 1 ? " byte" : " bytes") +
                     " behind the last of the " + triangles +
                     " triangles that the header announces left out";
  if (bytes % kBinaryTriangle == 0) {
    text += "; " + std::to_string(bytes / kBinaryTriangle) +
            " more triangles would take as many: if the part lacks faces, export it again";
  }
  return text;
}

}  // namespace

RawMesh parse_stl_text(std::string_view text, const std::string& file) {
  return StlTextParser(text, file).parse();
}

RawMesh parse_stl_binary(std::span<const char> bytes, const std::string& file) {
  RawMesh mesh;
  mesh.file = file;
  mesh.places_are_lines = false;
  std::size_t end = 0;
  const std::vector<std::size_t> starts = block_starts(bytes, end);
  for (std::size_t block = 0; block < starts.size(); ++block) {
    add_solid("", mesh);
    add_block(bytes, starts[block], static_cast<std::uint32_t>(block), mesh);
  }
  if (starts.size() > 1) {
    mesh.notes.push_back(file + ": " + std::to_string(starts.size()) +
                         " binary STL files one behind the other; all are read");
  }
  if (end < bytes.size()) mesh.notes.push_back(trailing_text(bytes.size() - end, mesh));
  return mesh;
}

RawMesh parse_stl(std::span<const char> bytes, const std::string& file) {
  const std::size_t size = bytes.size();
  const bool has_count = size >= kBinaryHeader;
  const std::size_t count = has_count ? little_endian_word(bytes, kBinaryHeader - 4) : 0;
  if (has_count && size == kBinaryHeader + kBinaryTriangle * count) {
    return parse_stl_binary(bytes, file);
  }
  const std::string_view all(bytes.data(), size);
  const std::string_view head = all.substr(0, 512);
  const bool wide = all.starts_with("\xFF\xFE") || all.starts_with("\xFE\xFF");
  std::string_view word = head;
  if (word.starts_with("\xEF\xBB\xBF")) {
    word.remove_prefix(3);
  }
  word.remove_prefix(std::min(word.find_first_not_of(" \t\r\n"), word.size()));
  const bool says_solid = equals_lower(word.substr(0, 5), "solid");
  if (wide || (says_solid && head.find('\0') == std::string_view::npos)) {
    return parse_stl_text(checked_text(bytes, file), file);
  }
  if (head.find('\0') == std::string_view::npos) {
    refuse_byte(file, 0, "neither text STL (it starts with 'solid') nor binary STL",
                "check that the extension names the true format, or export the part again");
  }
  if (!has_count) {
    refuse_byte(
        file, size,
        "the file ends inside the header of a binary STL (" + std::to_string(size) + " bytes)",
        "export the part again");
  }
  if (count > 0 && size > kBinaryHeader + kBinaryTriangle * count) {
    return parse_stl_binary(bytes, file);
  }
  refuse_byte(file, kBinaryHeader - 4,
              "the header announces " + std::to_string(count) + " triangles, " +
                  std::to_string(kBinaryHeader + kBinaryTriangle * count) +
                  " bytes, but the file has " + std::to_string(size),
              "export the part again");
}

}  // namespace haptic::tools
