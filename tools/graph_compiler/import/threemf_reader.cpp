// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/threemf_reader.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "tools/graph_compiler/import/affine_map.hpp"
#include "tools/graph_compiler/import/left_out.hpp"
#include "tools/graph_compiler/import/slicer_marks.hpp"
#include "tools/graph_compiler/import/threemf_mesh.hpp"
#include "tools/graph_compiler/import/threemf_package.hpp"
#include "tools/graph_compiler/import/xml_unit.hpp"
#include "tools/graph_compiler/mesh/mesh_nodes.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

using tinyxml2::XMLElement;

constexpr NamedUnit k3mfUnits[] = {{"micron", 1e-6}, {"millimeter", 1e-3}, {"centimeter", 1e-2},
                                   {"inch", 0.0254}, {"foot", 0.3048},     {"meter", 1.0}};
constexpr int kDeepestComponent = 64;
/// Objects placed in all: a few nested ones could multiply without end.
constexpr std::size_t kMostPlaced = 1'000'000;

/// An attribute of an extension, `name` with its colon, under any prefix.
std::string extension_attribute(const XMLElement& element, std::string_view name) {
  for (const auto* a = element.FirstAttribute(); a != nullptr; a = a->Next()) {
    if (std::string_view(a->Name()).ends_with(name)) return a->Value();
  }
  return {};
}

/// Production extension: path of the model that the object is in.
std::string path_of(const XMLElement& element) { return extension_attribute(element, ":path"); }

/// An object, and the model that it is in.
struct Placed {
  const ThreemfModel* model = nullptr;
  const XMLElement* object = nullptr;
};

class ThreemfReader {
 public:
  ThreemfReader(std::span<const char> bytes, const std::string& file, ImportedMesh& imported)
      : file_(file), package_(bytes, file), mesh_(imported.mesh) {
    const ThreemfModel& first = package_.first();
    unit_m_ = imported.unit_m = named_unit(*first.root, k3mfUnits, file);
    marks_ = read_slicer_marks(package_, file);
    const XMLElement* build = first.child(*first.root, "build");
    const XMLElement* item = build != nullptr ? first.child(*build, "item") : nullptr;
    if (item == nullptr) {
      refuse_file(file, "its <build> has no <item>, so none of its objects is placed",
                  "export the file again with the parts on the plate");
    }
    for (; item != nullptr; item = ThreemfModel::next(*item)) {
      const Placed placed = named_by(*item, first);
      const std::string printable = attribute(*item, "printable");
      if (printable == "0" || printable == "false") {
        leave_out(placed, "since its item is marked as not to be printed");
        continue;
      }
      place(placed, transform_of(*item, first.file), {}, MeshNode::kNone, 0);
    }
    mark_parts();
    tell_of_unnamed();
    mesh_.warnings = left_out_.sentences();
    if (mesh_.faces.empty()) {
      refuse_file(file,
                  left_out_.empty() ? "its objects have no triangles"
                                    : "nothing of it is material (" + mesh_.warnings.front() + ")",
                  "mark the part as a model that is to be printed, or export it as STL");
    }
  }

 private:
  [[noreturn]] static void refuse(const Placed& at, const std::string& defect,
                                  const std::string& fix) {
    refuse_line(at.model->file, line_of(*at.object), defect, fix);
  }
  void leave_out(const Placed& placed, const std::string& why) {
    named_.insert(placed.object);
    left_out_.add(why, object_text(*placed.model, *placed.object, file_));
  }

  /// The object that an item or a component of `model` names.
  Placed named_by(const XMLElement& element, const ThreemfModel& model) {
    const std::string path = path_of(element), id = attribute(element, "objectid");
    const ThreemfModel& in = path.empty() ? model : model_of(path);
    const auto found = in.objects.find(id);
    if (found == in.objects.end()) {
      refuse_line(model.file, line_of(element),
                  "<" + std::string(element.Name()).substr(0, 40) + "> names object " +
                      shown_word(id) + ", which is not in the model" +
                      (path.empty() ? "" : " " + shown_word(path)),
                  "export the file again");
    }
    return {&in, found->second};
  }
  const ThreemfModel& model_of(const std::string& path) {
    const ThreemfModel& model = package_.model(path);
    if (named_unit(*model.root, k3mfUnits, model.file) != unit_m_) {
      refuse_line(model.file, line_of(*model.root),
                  "its unit is not that of the first model of the archive",
                  "export all in one unit");
    }
    return model;
  }

  /// @param settled  what the settings of a slicer call it as a component; empty: nothing.
  std::string name_of(const Placed& placed, std::string settled) {
    const std::string id = attribute(*placed.object, "id");
    if (const auto named = marks_.names.find(id);
        settled.empty() && named != marks_.names.end() && placed.model == &package_.first()) {
      settled = named->second;
    }
    for (const std::string& name :
         {attribute(*placed.object, "name"), settled, attribute(*placed.object, "partnumber")}) {
      if (const std::string tidy = tidy_name(name, ""); !tidy.empty()) return tidy;
    }
    return tidy_name("object " + id, "object");
  }

  /// The items of the build, or where there is one alone the objects with meshes that it is made
  /// of.
  void mark_parts() {
    std::set<std::uint32_t> tops;
    for (std::uint32_t node : mesh_.group_nodes) {
      while (mesh_.nodes[node].parent != MeshNode::kNone) node = mesh_.nodes[node].parent;
      tops.insert(node);
    }
    for (const std::uint32_t node : mesh_.group_nodes) {
      if (tops.size() < 2) mesh_.nodes[node].is_part = true;
    }
    for (const std::uint32_t node : tops) {
      if (tops.size() > 1) mesh_.nodes[node].is_part = true;
    }
  }

  void place(const Placed& placed, const AffineMap& map, const std::string& settled,
             std::uint32_t parent, int depth) {
    if (++places_ > kMostPlaced) {
      refuse(placed, "its components place more than " + std::to_string(kMostPlaced) + " objects",
             "simplify the part");
    }
    const auto& [model, object] = placed;
    const std::string type = attribute(*object, "type");
    if (type == "support" || type == "solidsupport" || type == "other") {
      return leave_out(placed, "since its type is '" + type + "'");
    }
    if (!type.empty() && type != "model" && type != "surface") {
      refuse(placed, "the type of the object is " + shown_word(type),
             "the types are model, surface, solidsupport, support and other");
    }
    if (const auto mark = mark_of_cura(*object)) {
      return leave_out(placed, "since it is " + mark->kind);
    }
    named_.insert(object);
    const bool has_mesh = model->child(*object, "mesh") != nullptr;
    const XMLElement* components = model->child(*object, "components");
    if (!has_mesh && components == nullptr) return refuse_form(placed);
    // Required or not: that it is a rough one is said here alone.
    if (has_mesh && extension_attribute(*object, ":meshresolution") == "lowres") {
      refuse(placed, "the mesh is a rough one, in place of which slices are printed (lowres)",
             "export the part with its full mesh, or as STL");
    }
    const auto node = static_cast<std::uint32_t>(mesh_.nodes.size());
    mesh_.nodes.push_back({name_of(placed, settled), parent, false});
    if (has_mesh) append(mesh_at(placed), map, placed);
    mesh_.group_nodes.resize(group_, node);
    if (components != nullptr) place_components(placed, *components, map, node, depth);
  }

  /// Refuses an object that has neither a mesh nor components.
  void refuse_form(const Placed& placed) {
    for (const auto* e = placed.object->FirstChildElement(); e != nullptr;
         e = e->NextSiblingElement()) {
      const std::string_view name = e->Name();
      if (name.ends_with("metadatagroup") || name.ends_with("settings")) continue;
      refuse_line(placed.model->file, line_of(*e),
                  "the object is given by <" + std::string(name.substr(0, 40)) +
                      "> and no mesh, which is not read",
                  "export the part as a plain mesh, or as STL");
    }
    leave_out(placed, "since it has no mesh");
  }

  void place_components(const Placed& placed, const XMLElement& components, const AffineMap& map,
                        std::uint32_t node, int depth) {
    const auto& [model, object] = placed;
    if (!open_.insert(object).second) {
      refuse(
          placed,
          "the components of object " + shown_word(attribute(*object, "id")) + " run in a circle",
          "correct their objectid");
    }
    if (depth > kDeepestComponent) {
      refuse(placed, "components are nested too deeply", "export the part as STL");
    }
    for (const auto* c = model->child(components, "component"); c != nullptr;
         c = ThreemfModel::next(*c)) {
      const Placed part = named_by(*c, *model);
      const auto mark =
          marks_.components.find({attribute(*object, "id"), attribute(*c, "objectid")});
      if (mark != marks_.components.end() && model == &package_.first()) {
        if (mark->second.is_hole) {
          refuse_line(model->file, line_of(*c),
                      "the component is " + mark->second.kind +
                          ", which is to be cut out of the others; that is not done here",
                      "cut it in a CAD program, or export the part as STL");
        }
        leave_out(part, "since it is " + mark->second.kind);
        continue;
      }
      const auto settled =
          marks_.component_names.find({attribute(*object, "id"), attribute(*c, "objectid")});
      const bool is_settled = settled != marks_.component_names.end() && model == &package_.first();
      place(part, product(map, transform_of(*c, model->file)),
            is_settled ? settled->second : std::string(), node, depth + 1);
    }
    open_.erase(object);
  }

  /// The mesh of an object, read once.
  const RawMesh& mesh_at(const Placed& placed) {
    const auto [found, is_new] = meshes_.try_emplace(placed.object);
    if (is_new) {
      std::span<const MarkedTriangles> marked;
      const auto marks = marks_.triangles.find(attribute(*placed.object, "id"));
      if (marks != marks_.triangles.end() && placed.model == &package_.first()) {
        marked = marks->second;
      }
      found->second = mesh_of_3mf(*placed.model, *placed.object, marked, left_out_);
    }
    return found->second;
  }

  void append(const RawMesh& part, const AffineMap& map, const Placed& placed) {
    if (part.faces.empty()) return leave_out(placed, "since it has no triangles");
    const double turn = determinant(map);
    if (!std::isfinite(turn) || turn == 0.0) {
      refuse(placed, "its places flatten it, or are not finite", "correct the transforms");
    }
    if (mesh_.vertices.size() + part.vertices.size() > kMaxMeshVertices ||
        mesh_.faces.size() + part.faces.size() > kMaxMeshFaces) {
      refuse(placed, "the file has more than " + std::to_string(kMaxMeshFaces) + " triangles",
             "simplify the part");
    }
    const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
    for (const Point3& p : part.vertices) {
      Point3 to = mapped(map, p);
      for (double& x : to) {
        x *= unit_m_;
        if (!std::isfinite(x)) {
          refuse(placed, "a corner of the object is not finite", "correct its coordinates");
        }
      }
      mesh_.vertices.push_back(to);
    }
    for (const RawFace& face : part.faces) {
      RawFace moved = face;
      moved.group = group_;
      for (std::uint32_t& v : moved.vertices) v += first;
      // A mirrored mesh is turned inside out.
      if (turn < 0.0) std::ranges::reverse(moved.vertices);
      mesh_.faces.push_back(std::move(moved));
    }
    ++group_;
  }

  /// Objects of the models read that neither an item nor a component names.
  void tell_of_unnamed() {
    for (const auto& [name, model] : package_.read()) {
      for (const auto& [id, object] : model.objects) {
        const XMLElement* components = model.child(*object, "components");
        const auto* c = components != nullptr ? model.child(*components, "component") : nullptr;
        for (; c != nullptr; c = ThreemfModel::next(*c)) name_component(*c, model);
      }
    }
    for (const auto& [name, model] : package_.read()) {
      for (const auto& [id, object] : model.objects) {
        if (named_.contains(object)) continue;
        left_out_.add("since no item of the build names it", object_text(model, *object, file_));
      }
    }
  }
  void name_component(const XMLElement& component, const ThreemfModel& model) {
    const std::string path = path_of(component);
    const ThreemfModel* in = path.empty() ? &model : package_.known(path);
    if (in == nullptr) return;
    const auto found = in->objects.find(attribute(component, "objectid"));
    if (found != in->objects.end()) named_.insert(found->second);
  }

  const std::string& file_;
  ThreemfPackage package_;
  RawMesh& mesh_;
  double unit_m_ = 1.0;
  SlicerMarks marks_;
  LeftOut left_out_;
  std::map<const XMLElement*, RawMesh> meshes_;
  std::set<const XMLElement*> named_;  ///< by an item or a component
  std::set<const XMLElement*> open_;   ///< whose components are being placed
  std::size_t places_ = 0;
  std::uint32_t group_ = 0;
};

}  // namespace

ImportedMesh read_3mf(std::span<const char> bytes, const std::string& file) {
  ImportedMesh imported;
  imported.mesh.file = file;
  const ThreemfReader reader(bytes, file, imported);
  return imported;
}

}  // namespace haptic::tools
