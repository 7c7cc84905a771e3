// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/amf_reader.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <vector>

#include "tools/graph_compiler/import/fixed_axes.hpp"
#include "tools/graph_compiler/import/xml_file.hpp"
#include "tools/graph_compiler/import/xml_unit.hpp"
#include "tools/graph_compiler/import/zip_entry.hpp"
#include "tools/graph_compiler/mesh/mesh_nodes.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

constexpr NamedUnit kAmfUnits[] = {{"micron", 1e-6}, {"micrometer", 1e-6}, {"millimeter", 1e-3},
                                   {"inch", 0.0254}, {"feet", 0.3048},     {"foot", 0.3048},
                                   {"meter", 1.0}};
constexpr int kDeepestConstellation = 32;
/// Objects and constellations placed in all: a few nested ones could multiply without end.
constexpr std::size_t kMostPlaces = 1'000'000;

/// Turn, then shift [units of the file].
struct AmfPlace {
  Turn turn{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Point3 shift{0, 0, 0};

  [[nodiscard]] Point3 of(const Point3& p) const {
    Point3 to{};
    for (std::size_t i = 0; i < 3; ++i) {
      to[i] = turn[i][0] * p[0] + turn[i][1] * p[1] + turn[i][2] * p[2] + shift[i];
    }
    return to;
  }
  /// First `inner`, then this.
  [[nodiscard]] AmfPlace after(const AmfPlace& inner) const {
    AmfPlace both{{}, of(inner.shift)};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        for (std::size_t k = 0; k < 3; ++k) both.turn[i][j] += turn[i][k] * inner.turn[k][j];
      }
    }
    return both;
  }
};

/// An object or a constellation.
struct AmfItem {
  const tinyxml2::XMLElement* element = nullptr;
  bool is_object = false;
  bool is_named = false;    ///< by an instance
  bool is_placing = false;  ///< its instances are being placed
  bool is_placed = false;
  std::optional<RawMesh> mesh;  ///< of an object that was read [units of the file]
};

class AmfReader {
 public:
  AmfReader(const tinyxml2::XMLElement& root, const std::string& file, ImportedMesh& imported)
      : file_(file), unit_m_(imported.unit_m), mesh_(imported.mesh) {
    collect(root);
    for (std::size_t k = 0; k < items_.size(); ++k) {
      if (!items_[k].is_named) place(k, AmfPlace{}, MeshNode::kNone, 0);
    }
    // Constellations that no other names place all that is named, unless they run in a circle.
    for (const AmfItem& item : items_) {
      if (!item.is_placed && !item.is_object) refuse_circle(*item.element);
    }
  }

 private:
  [[noreturn]] void refuse(const tinyxml2::XMLElement& at, const std::string& defect,
                           const std::string& fix) const {
    refuse_line(file_, line_of(at), defect, fix);
  }
  [[noreturn]] void refuse_circle(const tinyxml2::XMLElement& at) const {
    refuse(at, "constellation " + shown_word(attribute(at, "id")) + " places itself",
           "correct the objectid of its instances");
  }

  void collect(const tinyxml2::XMLElement& root) {
    for (const auto* e = root.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string_view name = e->Name();
      if (name != "object" && name != "constellation") continue;
      const std::string id = attribute(*e, "id");
      const auto [other, is_new] = by_id_.try_emplace(id, items_.size());
      if (!is_new && !id.empty()) {
        refuse(*e,
               "id " + shown_word(id) + " is that of line " +
                   std::to_string(line_of(*items_[other->second].element)) + " too",
               "give every object and constellation an id of its own");
      }
      AmfItem& item = items_.emplace_back();
      item.element = e;
      item.is_object = name == "object";
    }
    for (std::size_t k = 0; k < items_.size(); ++k) {
      if (items_[k].is_object) continue;
      for (const auto* i = items_[k].element->FirstChildElement("instance"); i != nullptr;
           i = i->NextSiblingElement("instance")) {
        items_[named_by(*i)].is_named = true;
      }
    }
  }

  std::size_t named_by(const tinyxml2::XMLElement& instance) const {
    const std::string id = attribute(instance, "objectid");
    const auto found = by_id_.find(id);
    if (id.empty() || found == by_id_.end()) {
      refuse(instance, "an instance names object " + shown_word(id) + ", which is not in the file",
             "correct its objectid");
    }
    return found->second;
  }

  /// The text of its <metadata type="name">.
  static std::string name_of(const AmfItem& item) {
    std::string_view name;
    for (const auto* m = item.element->FirstChildElement("metadata"); m != nullptr;
         m = m->NextSiblingElement("metadata")) {
      if (attribute(*m, "type") == "name") name = word_in(*m);
    }
    return tidy_name(name, (item.is_object ? "object " : "constellation ") +
                               tidy_name(attribute(*item.element, "id"), ""));
  }

  void place(std::size_t index, const AmfPlace& at, std::uint32_t parent, int depth) {
    AmfItem& item = items_[index];
    const tinyxml2::XMLElement& element = *item.element;
    if (++places_ > kMostPlaces) {
      refuse(element,
             "its constellations place more than " + std::to_string(kMostPlaces) + " parts",
             "simplify the part");
    }
    item.is_placed = true;
    const auto node = static_cast<std::uint32_t>(mesh_.nodes.size());
    mesh_.nodes.push_back({name_of(item), parent, item.is_object});
    if (item.is_object) {
      if (!item.mesh) item.mesh = read_object(element);
      append(*item.mesh, at, element);
      mesh_.group_nodes.resize(group_, node);
      return;
    }
    if (item.is_placing) refuse_circle(element);
    if (depth > kDeepestConstellation) {
      refuse(element, "constellations are nested too deeply", "export the part as STL");
    }
    item.is_placing = true;
    for (const auto* i = element.FirstChildElement("instance"); i != nullptr;
         i = i->NextSiblingElement("instance")) {
      place(named_by(*i), at.after(place_of(*i)), node, depth + 1);
    }
    item.is_placing = false;
  }

  AmfPlace place_of(const tinyxml2::XMLElement& instance) const {
    const auto value = [&](const char* name) {
      return instance.FirstChildElement(name) != nullptr ? number_in(instance, name) : 0.0;
    };
    constexpr double kDegree = std::numbers::pi / 180;
    return {turn_about_fixed_axes(
                {value("rx") * kDegree, value("ry") * kDegree, value("rz") * kDegree}),
            {value("deltax"), value("deltay"), value("deltaz")}};
  }

  /// The one child of this name.
  const tinyxml2::XMLElement& child(const tinyxml2::XMLElement& parent, const char* name) const {
    const tinyxml2::XMLElement* found = parent.FirstChildElement(name);
    if (found == nullptr || found->NextSiblingElement(name) != nullptr) {
      refuse(parent,
             std::string("<") + parent.Name() + "> has " + (found == nullptr ? "no" : "two") +
                 " <" + name + ">",
             "it needs one; export the part again");
    }
    return *found;
  }
  static std::string_view word_in(const tinyxml2::XMLElement& element) {
    constexpr const char* kBlank = " \t\r\n";
    const char* text = element.GetText();
    std::string_view word = text != nullptr ? text : "";
    word.remove_prefix(std::min(word.find_first_not_of(kBlank), word.size()));
    return word.substr(0, word.find_last_not_of(kBlank) + 1);
  }
  double number_in(const tinyxml2::XMLElement& parent, const char* name) const {
    const tinyxml2::XMLElement& element = child(parent, name);
    return parse_number(word_in(element), file_, line_of(element), name, nullptr);
  }

  RawMesh read_object(const tinyxml2::XMLElement& object) const {
    RawMesh read;
    std::uint32_t group = 0;
    for (const auto* m = object.FirstChildElement("mesh"); m != nullptr;
         m = m->NextSiblingElement("mesh")) {
      const tinyxml2::XMLElement& vertices = child(*m, "vertices");
      std::vector<Point3> corners;
      for (const auto* v = vertices.FirstChildElement("vertex"); v != nullptr;
           v = v->NextSiblingElement("vertex")) {
        const tinyxml2::XMLElement& at = child(*v, "coordinates");
        corners.push_back({number_in(at, "x"), number_in(at, "y"), number_in(at, "z")});
      }
      // The corners of a volume are its own: for each of the mesh the last volume that has it, and
      // its index there.
      std::vector<std::pair<std::uint32_t, std::uint32_t>> owned(corners.size(), {0, 0});
      for (const auto* v = m->FirstChildElement("volume"); v != nullptr;
           v = v->NextSiblingElement("volume")) {
        if (attribute(*v, "type") == "support") {
          refuse(*v, "a volume is a support of the printing and no part",
                 "export the part without supports");
        }
        ++group;
        for (const auto* t = v->FirstChildElement("triangle"); t != nullptr;
             t = t->NextSiblingElement("triangle")) {
          RawFace face;
          face.group = group - 1;
          for (const char* name : {"v1", "v2", "v3"}) {
            const std::size_t corner = index_in(*t, name, corners.size());
            auto& [owner, own] = owned[corner];
            if (owner != group) {
              owner = group;
              own = static_cast<std::uint32_t>(read.vertices.size());
              read.vertices.push_back(corners[corner]);
            }
            face.vertices.push_back(own);
          }
          read.faces.push_back(std::move(face));
        }
      }
    }
    return read;
  }

  std::size_t index_in(const tinyxml2::XMLElement& triangle, const char* name,
                       std::size_t count) const {
    const tinyxml2::XMLElement& element = child(triangle, name);
    const std::int64_t index = parse_integer(word_in(element), file_, line_of(element), name);
    if (index < 0 || static_cast<std::uint64_t>(index) >= count) {
      refuse(element,
             "a triangle uses vertex " + std::to_string(index) + " of " + std::to_string(count),
             "correct the index; the first is 0");
    }
    return static_cast<std::size_t>(index);
  }

  void append(const RawMesh& part, const AmfPlace& at, const tinyxml2::XMLElement& object) {
    if (mesh_.vertices.size() + part.vertices.size() > kMaxMeshVertices ||
        mesh_.faces.size() + part.faces.size() > kMaxMeshFaces) {
      refuse(object, "the file has more than " + std::to_string(kMaxMeshFaces) + " triangles",
             "simplify the part");
    }
    const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
    for (const Point3& p : part.vertices) {
      Point3 to = at.of(p);
      for (double& x : to) {
        x *= unit_m_;
        if (!std::isfinite(x)) {
          refuse(object, "a corner of the object is not finite", "correct its coordinates");
        }
      }
      mesh_.vertices.push_back(to);
    }
    std::uint32_t last_group = group_;
    for (const RawFace& face : part.faces) {
      RawFace placed = face;
      placed.group += group_;
      last_group = std::max(last_group, placed.group);
      for (std::uint32_t& v : placed.vertices) v += first;
      mesh_.faces.push_back(std::move(placed));
    }
    group_ = last_group + 1;
  }

  const std::string& file_;
  double unit_m_;
  RawMesh& mesh_;
  std::vector<AmfItem> items_;
  std::map<std::string, std::size_t> by_id_;
  std::size_t places_ = 0;
  std::uint32_t group_ = 0;
};

}  // namespace

ImportedMesh read_amf(std::span<const char> bytes, const std::string& file) {
  std::string_view text(bytes.data(), bytes.size());
  std::string unpacked;
  if (text.starts_with("PK")) {
    unpacked = zip_entry(bytes, ".amf", kMaxMeshBytes, file);
    text = unpacked;
  }
  tinyxml2::XMLDocument document;
  const tinyxml2::XMLElement& root = parse_xml(document, text, "amf", file);
  ImportedMesh imported;
  imported.unit_m = named_unit(root, kAmfUnits, file);
  imported.mesh.file = file;
  AmfReader(root, file, imported);
  return imported;
}

}  // namespace haptic::tools
