// SPDX-License-Identifier: Apache-2.0
/// Wavefront OBJ: vertices, faces, groups. Texture coordinates, normals, materials and lines carry
/// no shape.
#include <algorithm>
#include <map>
#include <utility>

#include "tools/graph_compiler/mesh/mesh_nodes.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

/// Keywords of OBJ that carry no shape; those of free-form surfaces are refused with the surface.
constexpr std::string_view kShapeless[] = {
    "vt",     "vn",     "vp",       "l",         "p",          "s",     "mg",    "usemtl",
    "mtllib", "usemap", "maplib",   "bevel",     "c_interp",   "lod",   "deg",   "bmat",
    "step",   "parm",   "d_interp", "trace_obj", "shadow_obj", "ctech", "stech", "end",
    "con",    "trim",   "hole",     "scrv",      "sp",         "curv2"};

/// Group of faces before the first `g`.
constexpr std::string_view kDefaultGroup = "default";

/// So many unknown keywords are named in the note.
constexpr std::size_t kMostNamed = 5;

class ObjParser {
 public:
  ObjParser(std::string_view text, const std::string& file)
      : lines_(text, {.comments = true, .continuation = true}), file_(file) {
    mesh_.file = file;
    mesh_.indexed = true;
  }

  RawMesh parse() {
    while (lines_.next(words_)) {
      const std::string_view keyword = words_.front();
      if (keyword == "v") {
        read_vertex();
      } else if (keyword == "f" || keyword == "fo") {
        read_face();
      } else if (keyword == "o") {
        object_ = name_of_rest();
        group_.clear();
        is_named_ = true;
        choose_group();
      } else if (keyword == "g") {
        group_ = name_of_rest();
        is_named_ = true;
        choose_group();
      } else if (keyword == "surf" || keyword == "curv" || keyword == "cstype") {
        refuse("free-form surfaces are not polygons", "export the part as a polygon mesh");
      } else if (keyword.find_first_of("0123456789+-.") == 0) {
        refuse("the line starts with " + shown_word(keyword) + " instead of a keyword",
               "start it with v or f, or end the line before with a backslash");
      } else if (std::ranges::find(kShapeless, keyword) == std::end(kShapeless)) {
        note_unknown(keyword);
      }
    }
    add_note();
    check_forward_references();
    if (is_named_) name_groups();
    mesh_.print_resolution = printed_.resolution();
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void refuse(const std::string& defect, const std::string& fix) const {
    refuse_line(file_, lines_.line(), defect, fix);
  }

  void note_unknown(std::string_view keyword) {
    ++unknown_lines_;
    const bool told =
        std::ranges::any_of(unknown_, [&](const auto& named) { return named.first == keyword; });
    if (told) return;
    if (unknown_.size() < kMostNamed) {
      unknown_.emplace_back(keyword, lines_.line());
    } else {
      more_unknown_ = true;
    }
  }

  void add_note() {
    if (unknown_.empty()) return;
    std::string names;
    for (const auto& [keyword, line] : unknown_) {
      names +=
          (names.empty() ? "" : ", ") + shown_word(keyword) + " in line " + std::to_string(line);
    }
    mesh_.notes.push_back(file_ + ": " + std::to_string(unknown_lines_) +
                          (unknown_lines_ == 1 ? " line with a keyword" : " lines with keywords") +
                          " that OBJ does not have left out: " + names +
                          (more_unknown_ ? " and others" : ""));
  }

  std::string name_of_rest() const {
    std::string name;
    for (std::size_t i = 1; i < words_.size(); ++i) {
      name += (i > 1 ? " " : "") + std::string(words_[i]);
    }
    return name;
  }

  /// A group that is entered again under its name is the same group.
  void choose_group() {
    const auto next = static_cast<std::uint32_t>(groups_.size() + 1);
    current_group_ = groups_.try_emplace({object_, group_}, next).first->second;
  }

  /// An object with groups is a node above them, of which faces before the first `g` are the group
  /// "default", as OBJ has it; one without is a node by itself. Parts are the objects, or the
  /// groups where there are fewer than two objects.
  void name_groups() {
    std::vector<bool> has_faces(groups_.size() + 1, false);
    for (const RawFace& face : mesh_.faces) has_faces[face.group] = true;
    std::vector<std::pair<std::string, std::string>> by_group(groups_.size() + 1);
    std::map<std::string, bool> objects;  // whether it has groups
    for (const auto& [names, group] : groups_) by_group[group] = names;
    for (std::size_t k = 0; k < by_group.size(); ++k) {
      if (has_faces[k]) objects[by_group[k].first] |= !by_group[k].second.empty();
    }
    const auto node = [&](const std::string& name, std::uint32_t parent, bool is_part) {
      mesh_.nodes.push_back({name, parent, is_part});
      return static_cast<std::uint32_t>(mesh_.nodes.size() - 1);
    };
    const bool objects_are_parts = objects.size() > 1;
    std::map<std::string, std::uint32_t> object_nodes;
    mesh_.group_nodes.resize(by_group.size(), 0);
    for (std::size_t k = 0; k < by_group.size(); ++k) {
      const auto& [object, group] = by_group[k];
      if (!has_faces[k]) {
        // An object without faces, or such a group of no object.
        const bool is_object = !object.empty() && group.empty() && !objects.contains(object);
        const bool is_group = object.empty() && !group.empty() && group != kDefaultGroup;
        if (is_object) node(tidy_name(object, "object"), MeshNode::kNone, false);
        if (is_group) node(tidy_name(group, kDefaultGroup), MeshNode::kNone, false);
        continue;
      }
      const bool has_groups = objects[object];
      std::uint32_t above = MeshNode::kNone;
      if (!object.empty() || !has_groups) {
        const auto [found, is_new] = object_nodes.try_emplace(object, 0);
        if (is_new) {
          found->second =
              node(tidy_name(object, "object"), MeshNode::kNone, objects_are_parts || !has_groups);
        }
        above = found->second;
      }
      mesh_.group_nodes[k] = has_groups ? node(tidy_name(group, kDefaultGroup), above,
                                               !objects_are_parts || object.empty())
                                        : above;
    }
  }

  void read_vertex() {
    const std::size_t values = words_.size() - 1;
    // x y z, then nothing, a weight, a colour, or both.
    if (values != 3 && values != 4 && values != 6 && values != 7) {
      refuse("a vertex has " + std::to_string(values) + " numbers", "give x, y and z");
    }
    if (mesh_.vertices.size() >= kMaxMeshVertices) {
      refuse("more than " + std::to_string(kMaxMeshVertices) + " vertices", "simplify the part");
    }
    Point3 point{};
    for (std::size_t i = 0; i < 3; ++i) {
      point[i] = parse_number(words_[i + 1], file_, lines_.line(), "coordinate", &printed_);
    }
    for (std::size_t i = 4; i <= values; ++i) {
      const double extra = parse_number(words_[i], file_, lines_.line(), "value", nullptr);
      const bool is_weight = i == 4 && values != 6;
      if (is_weight && extra != 1.0) {
        refuse("a vertex has the weight " + shown_word(words_[i]),
               "export a polygon mesh (weight 1)");
      }
    }
    mesh_.vertices.push_back(point);
    mesh_.vertex_places.push_back(lines_.line());
  }

  /// Index of the vertex of one corner `v`, `v/vt`, `v//vn` or `v/vt/vn`.
  std::uint32_t read_corner(std::string_view word) const {
    const std::size_t slash = word.find('/');
    check_attribute_indices(word, slash);
    const std::int64_t index =
        parse_integer(word.substr(0, slash), file_, lines_.line(), "vertex index");
    const auto count = static_cast<std::int64_t>(mesh_.vertices.size());
    if (index == 0) {
      refuse("vertex index 0", "OBJ counts from 1");
    }
    if (index < -count) {
      refuse("vertex index " + std::to_string(index) + " reaches before the first of " +
                 std::to_string(count) + " vertices",
             "correct the index");
    }
    if (index > static_cast<std::int64_t>(kMaxMeshVertices)) {
      refuse("vertex index " + std::to_string(index) + " is out of range", "correct the index");
    }
    return static_cast<std::uint32_t>(index > 0 ? index - 1 : count + index);
  }

  /// Texture and normal indices are skipped, but what stands there must be an index; `1/`, `1//`
  /// and `1/2/` have none, as some exporters write them.
  void check_attribute_indices(std::string_view word, std::size_t slash) const {
    std::size_t fields = 0;
    while (slash != std::string_view::npos) {
      const std::size_t next = word.find('/', slash + 1);
      const std::string_view field =
          word.substr(slash + 1, next == std::string_view::npos ? next : next - slash - 1);
      if (!field.empty() &&
          parse_integer(field, file_, lines_.line(), "texture or normal index") == 0) {
        refuse("texture or normal index 0", "OBJ counts from 1");
      }
      slash = next;
      if (++fields > 2) {
        refuse("corner " + shown_word(word) + " has more than three indices", "write v/vt/vn");
      }
    }
  }

  void read_face() {
    if (words_.size() < 4) {
      refuse("a face with " + std::to_string(words_.size() - 1) + " corners",
             "a face needs three; delete it or complete the file");
    }
    if (mesh_.faces.size() >= kMaxMeshFaces) {
      refuse("more than " + std::to_string(kMaxMeshFaces) + " faces", "simplify the part");
    }
    RawFace face;
    face.source_place = lines_.line();
    face.group = current_group_;
    face.vertices.reserve(words_.size() - 1);
    for (std::size_t i = 1; i < words_.size(); ++i) {
      face.vertices.push_back(read_corner(words_[i]));
    }
    mesh_.faces.push_back(std::move(face));
  }

  /// A positive index may name a vertex that follows later in the file.
  void check_forward_references() const {
    for (const RawFace& face : mesh_.faces) {
      for (const std::uint32_t vertex : face.vertices) {
        if (vertex >= mesh_.vertices.size()) {
          refuse_line(file_, face.source_place,
                      "vertex index " + std::to_string(std::uint64_t{vertex} + 1) +
                          " but the file has " + std::to_string(mesh_.vertices.size()) +
                          " vertices",
                      "correct the index or complete the file");
        }
      }
    }
  }

  LineScanner lines_;
  std::string file_;
  RawMesh mesh_;
  PrintedDigits printed_;
  std::vector<std::string_view> words_;
  std::string object_;
  std::string group_;
  std::map<std::pair<std::string, std::string>, std::uint32_t> groups_;
  bool is_named_ = false;  ///< there is an `o` or a `g`
  std::uint32_t current_group_ = 0;
  std::vector<std::pair<std::string_view, std::size_t>> unknown_;  ///< keyword and first line
  std::size_t unknown_lines_ = 0;
  bool more_unknown_ = false;
};

}  // namespace

RawMesh parse_obj(std::string_view text, const std::string& file) {
  return ObjParser(text, file).parse();
}

}  // namespace haptic::tools
