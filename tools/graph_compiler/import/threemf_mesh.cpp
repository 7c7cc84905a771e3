// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/threemf_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

using tinyxml2::XMLElement;

constexpr const char* kExport3mf = "export the file again";

/// An attribute without the blanks around it.
std::string_view word_of(const XMLElement& element, const char* name, const std::string& file) {
  constexpr const char* kBlank = " \t\r\n";
  const char* const text = element.Attribute(name);
  if (text == nullptr) {
    refuse_line(file, line_of(element),
                "<" + std::string(element.Name()).substr(0, 40) + "> has no " + name, kExport3mf);
  }
  std::string_view word = text;
  word.remove_prefix(std::min(word.find_first_not_of(kBlank), word.size()));
  return word.substr(0, word.find_last_not_of(kBlank) + 1);
}

std::vector<Point3> corners_of(const ThreemfModel& model, const XMLElement& mesh) {
  std::vector<Point3> corners;
  const XMLElement* vertices = model.child(mesh, "vertices");
  const auto* v = vertices != nullptr ? model.child(*vertices, "vertex") : nullptr;
  for (; v != nullptr; v = ThreemfModel::next(*v)) {
    Point3& p = corners.emplace_back();
    constexpr const char* kNames[] = {"x", "y", "z"};
    for (std::size_t i = 0; i < 3; ++i) {
      p[i] = parse_number(word_of(*v, kNames[i], model.file), model.file, line_of(*v), kNames[i],
                          nullptr);
    }
  }
  return corners;
}

/// Lattices of beams stand beside the triangles, also where they are not required.
void refuse_beams(const ThreemfModel& model, const XMLElement& mesh) {
  for (const auto* e = mesh.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    const std::string_view name = e->Name();
    if (!name.ends_with("beamlattice") || e->FirstChildElement() == nullptr) continue;
    refuse_line(model.file, line_of(*e), "the mesh holds beams, which are not read",
                "export the part as a plain mesh, or as STL");
  }
}

/// Takes the triangles of an object that the slicer marks, one after the other.
class MarkedSearch {
 public:
  MarkedSearch(std::span<const MarkedTriangles> marked) : marked_(marked) {}

  /// The mark of a triangle; indices must grow from call to call.
  const MarkedTriangles* of(std::size_t triangle) {
    while (!marked_.empty() && marked_.front().last < triangle) marked_ = marked_.subspan(1);
    if (marked_.empty() || triangle < marked_.front().first) return nullptr;
    return &marked_.front();
  }

 private:
  std::span<const MarkedTriangles> marked_;
};

}  // namespace

AffineMap transform_of(const XMLElement& element, const std::string& file) {
  const std::string text = attribute(element, "transform");
  if (text.empty()) return kNoMove;
  LineScanner scanner(text, {.comments = false});
  std::vector<std::string_view> words, all;
  while (scanner.next(words)) all.insert(all.end(), words.begin(), words.end());
  if (all.size() != 12) {
    refuse_line(file, line_of(element), "the transform is " + shown_word(text),
                "give twelve numbers");
  }
  // The file has points as rows, so each three numbers are a column here.
  AffineMap map{};
  for (std::size_t k = 0; k < 12; ++k) {
    map[k % 3][k / 3] = parse_number(all[k], file, line_of(element), "transform", nullptr);
  }
  const double turn = determinant(map);
  if (!std::isfinite(turn) || turn == 0.0) {
    refuse_line(file, line_of(element), "the transform flattens the part, or is not finite",
                "correct the transform");
  }
  return map;
}

std::string object_text(const ThreemfModel& model, const XMLElement& object,
                        const std::string& file) {
  const std::string name = attribute(object, "name");
  std::string text = "object " + shown_word(attribute(object, "id"));
  if (!name.empty()) text += " named " + shown_word(name);
  text += " (";
  // In a further model of the archive.
  if (model.file.size() > file.size() + 2) text += model.file.substr(file.size() + 2) + ", ";
  return text + "line " + std::to_string(line_of(object)) + ")";
}

RawMesh mesh_of_3mf(const ThreemfModel& model, const XMLElement& object,
                    std::span<const MarkedTriangles> marked, LeftOut& left_out) {
  const XMLElement& mesh = *model.child(object, "mesh");
  refuse_beams(model, mesh);
  const std::vector<Point3> corners = corners_of(model, mesh);
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> own(corners.size(), kUnused);
  RawMesh read;
  MarkedSearch search(marked);
  const MarkedTriangles* told = nullptr;
  std::size_t count = 0;
  const XMLElement* triangles = model.child(mesh, "triangles");
  const auto* t = triangles != nullptr ? model.child(*triangles, "triangle") : nullptr;
  for (; t != nullptr; t = ThreemfModel::next(*t), ++count) {
    if (const MarkedTriangles* mark = search.of(count)) {
      if (mark->mark.is_hole) {
        refuse_line(model.file, line_of(*t),
                    "object " + shown_word(attribute(object, "id")) + " has " + mark->mark.kind +
                        ", which is to be cut out of it; that is not done here",
                    "cut it in a CAD program, or export the part as STL");
      }
      if (mark != told) {
        left_out.add("since it is " + mark->mark.kind, "triangles " + std::to_string(mark->first) +
                                                           " to " + std::to_string(mark->last) +
                                                           " of object " +
                                                           shown_word(attribute(object, "id")));
      }
      told = mark;
      continue;
    }
    RawFace face;
    for (const char* name : {"v1", "v2", "v3"}) {
      const std::int64_t index =
          parse_integer(word_of(*t, name, model.file), model.file, line_of(*t), name);
      if (index < 0 || static_cast<std::uint64_t>(index) >= corners.size()) {
        refuse_line(model.file, line_of(*t),
                    "a triangle uses vertex " + std::to_string(index) + " of " +
                        std::to_string(corners.size()),
                    "correct the index; the first is 0");
      }
      std::uint32_t& to = own[static_cast<std::size_t>(index)];
      if (to == kUnused) {
        to = static_cast<std::uint32_t>(read.vertices.size());
        read.vertices.push_back(corners[static_cast<std::size_t>(index)]);
      }
      face.vertices.push_back(to);
    }
    read.faces.push_back(std::move(face));
  }
  for (const MarkedTriangles& mark : marked) {
    if (mark.last >= mark.first && mark.last < count) continue;
    refuse_line(model.file, line_of(object),
                "the settings of the slicer name triangles " + std::to_string(mark.first) + " to " +
                    std::to_string(mark.last) + " of object " +
                    shown_word(attribute(object, "id")) + ", which has " + std::to_string(count),
                "save the project again in the slicer, or export the part as STL");
  }
  return read;
}

}  // namespace haptic::tools
