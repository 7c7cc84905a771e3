// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/collada_text.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "tools/graph_compiler/import/xml_file.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

using tinyxml2::XMLElement;

constexpr const char* kConvex = "convex_mesh";

/// The element after this one in the order of the text.
XMLElement* following(XMLElement* element) {
  if (XMLElement* child = element->FirstChildElement()) return child;
  while (element != nullptr) {
    if (XMLElement* next = element->NextSiblingElement()) return next;
    tinyxml2::XMLNode* parent = element->Parent();
    element = parent != nullptr ? parent->ToElement() : nullptr;
  }
  return nullptr;
}

/// True where the translations and rotations in the element move something.
bool moves(const XMLElement& element, const std::string& file) {
  bool found = false;
  for (const auto* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    const std::string_view name = e->Name();
    if (name != "translate" && name != "rotate") continue;
    LineScanner scanner(e->GetText() != nullptr ? e->GetText() : "", {.comments = false});
    std::vector<std::string_view> words, all;
    while (scanner.next(words)) all.insert(all.end(), words.begin(), words.end());
    // In a rotation the angle stands behind its axis.
    const std::size_t first = name == "rotate" ? 3 : 0;
    for (std::size_t k = first; k < all.size(); ++k) {
      found = found || parse_number(all[k], file, line_of(*e), e->Name(), nullptr) != 0.0;
    }
  }
  return found;
}

/// The id that a reference such as "#g" names; empty where it leads out of the file.
std::string id_of(const std::string& reference) {
  return reference.starts_with('#') ? reference.substr(1) : "";
}

class ColladaRewrite {
 public:
  ColladaRewrite(XMLElement& root, const std::string& file, ColladaText& result)
      : file_(file), result_(result) {
    for (XMLElement* e = &root; e != nullptr; e = following(e)) collect(*e);
    leave_out_looks(root);
    if (instances_.empty()) take_rigid_bodies();
    for (XMLElement* instance : instances_) resolve(*instance);
    for (auto& [id, geometry] : geometries_) rename(*geometry);
  }
  [[nodiscard]] bool is_changed() const { return is_changed_; }

 private:
  void collect(XMLElement& element) {
    const std::string_view name = element.Name();
    // assimp reads the mesh of a controller but neither its bind shape nor its joints and morphs.
    if (name == "instance_controller") {
      refuse_line(file_, line_of(element),
                  "a node bends its mesh by controller " + shown_word(attribute(element, "url")) +
                      " (skin or morph), which is not read",
                  "apply it to the mesh in the program that made the file, and export again");
    }
    if (name == "bind_material") bound_.push_back(&element);
    if (name == "node") nodes_.try_emplace(attribute(element, "id"), &element);
    if (name == "rigid_body") bodies_.try_emplace(attribute(element, "sid"), &element);
    if (name == "instance_rigid_body") moved_bodies_.push_back(&element);
    if (name == "geometry") geometries_.try_emplace(attribute(element, "id"), &element);
    const tinyxml2::XMLNode* parent = element.Parent();
    const XMLElement* above = parent != nullptr ? parent->ToElement() : nullptr;
    // Physics has instances too, which are no part of a scene that has its own.
    if (name == "instance_geometry" && above != nullptr &&
        above->Name() == std::string_view("node")) {
      instances_.push_back(&element);
    }
  }

  /// assimp refuses a mesh for a picture that is not there.
  void leave_out_looks(XMLElement& root) {
    for (XMLElement* bound : bound_) {
      bound->Parent()->DeleteChild(bound);
      is_changed_ = true;
    }
    for (const char* name : {"library_images", "library_effects", "library_materials"}) {
      while (XMLElement* looks = root.FirstChildElement(name)) {
        root.DeleteChild(looks);
        is_changed_ = true;
      }
    }
  }

  /// For a file whose nodes have no meshes: takes the shapes of the rigid bodies that move them.
  void take_rigid_bodies() {
    for (const XMLElement* at : moved_bodies_) {
      const std::string target = attribute(*at, "target"), sid = attribute(*at, "body");
      const auto node = nodes_.find(id_of(target));
      const auto body = bodies_.find(sid);
      if (node == nodes_.end() || body == bodies_.end()) {
        refuse_line(file_, line_of(*at),
                    "<instance_rigid_body> names node " + shown_word(target) + " and body " +
                        shown_word(sid) + ", and one of them is not in the file",
                    "export the part with its mesh at a node");
      }
      const XMLElement* common = body->second->FirstChildElement("technique_common");
      const XMLElement* shape = common != nullptr ? common->FirstChildElement("shape") : nullptr;
      for (; shape != nullptr; shape = shape->NextSiblingElement("shape")) {
        take_shape(*shape, *node->second);
      }
    }
    if (instances_.empty()) return;
    is_changed_ = true;
    result_.warnings.emplace_back(
        "no node has a mesh of its own; the shapes of the rigid bodies are taken");
  }
  void take_shape(const XMLElement& shape, XMLElement& node) {
    const XMLElement* named = shape.FirstChildElement("instance_geometry");
    if (named == nullptr) {
      refuse_line(file_, line_of(shape), "a shape of a rigid body is no mesh, which is not read",
                  "export the part with its mesh at a node");
    }
    std::string reference = attribute(*named, "url");
    if (!reference.starts_with('#')) reference.insert(0, "#");
    static_cast<void>(geometry_of(*named, reference));
    tinyxml2::XMLDocument& document = *node.GetDocument();
    XMLElement* to = &node;
    if (moves(shape, file_)) {
      to = document.NewElement("node");
      node.InsertEndChild(to);
      for (const auto* e = shape.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
        const std::string_view name = e->Name();
        if (name == "translate" || name == "rotate") to->InsertEndChild(e->DeepClone(&document));
      }
    }
    XMLElement* instance = document.NewElement("instance_geometry");
    instance->SetAttribute("url", reference.c_str());
    to->InsertEndChild(instance);
    instances_.push_back(instance);
  }

  XMLElement& geometry_of(const XMLElement& at, const std::string& reference) const {
    const auto found = geometries_.find(id_of(reference));
    if (found == geometries_.end() || id_of(reference).empty()) {
      refuse_line(file_, line_of(at),
                  "<" + std::string(at.Name()) + "> names geometry " + shown_word(reference) +
                      ", which is not in the file",
                  "export the part with all its meshes in one file");
    }
    return *found->second;
  }

  /// Leads a node to a geometry that has a mesh.
  void resolve(XMLElement& instance) {
    const std::string asked = attribute(instance, "url");
    std::string reference = asked;
    std::set<std::string> passed;
    const XMLElement* at = &instance;
    for (;;) {
      const XMLElement& geometry = geometry_of(*at, reference);
      if (const auto* brep = geometry.FirstChildElement("brep")) {
        refuse_line(file_, line_of(*brep), "a geometry is given by <brep>, which is not read",
                    "export the part as a mesh");
      }
      check_one_mesh(geometry);
      const XMLElement* convex = geometry.FirstChildElement(kConvex);
      if (convex == nullptr) break;
      const std::string hull_of = attribute(*convex, "convex_hull_of");
      if (hull_of.empty()) {
        check_faces(*convex, geometry);
        break;
      }
      if (!passed.insert(reference).second) {
        refuse_line(file_, line_of(*convex),
                    "geometry " + shown_word(reference) + " is the convex hull of itself",
                    "correct convex_hull_of");
      }
      at = convex;
      reference = hull_of;
    }
    if (reference == asked) return;
    instance.SetAttribute("url", reference.c_str());
    is_changed_ = true;
    if (!told_.insert(asked).second) return;
    // A child may say only so much.
    constexpr std::size_t kMostTold = 20;
    if (result_.warnings.size() == kMostTold) return;
    result_.warnings.push_back("geometry " + shown_word(asked) +
                               " is to be the convex hull of geometry " + shown_word(reference) +
                               "; the mesh of that is taken as it is");
    if (result_.warnings.size() == kMostTold) result_.warnings.back() += ", and so for more";
  }

  void check_faces(const XMLElement& convex, const XMLElement& geometry) const {
    for (const char* name : {"triangles", "polylist", "polygons", "tristrips", "trifans"}) {
      if (convex.FirstChildElement(name) != nullptr) return;
    }
    refuse_line(file_, line_of(convex),
                "geometry " + shown_word(attribute(geometry, "id")) +
                    " is to be the convex hull of its points, and has no faces",
                "make the hull in the program that made the file, and export its triangles");
  }

  /// COLLADA has one, and which one of several assimp takes it does not say.
  void check_one_mesh(const XMLElement& geometry) const {
    const XMLElement* found = nullptr;
    for (const auto* e = geometry.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (e->Name() != std::string_view("mesh") && e->Name() != std::string_view(kConvex)) continue;
      if (found != nullptr) {
        refuse_line(file_, line_of(*e),
                    "geometry " + shown_word(attribute(geometry, "id")) + " has several meshes",
                    "export each in a geometry of its own");
      }
      found = e;
    }
  }

  void rename(XMLElement& geometry) {
    for (XMLElement* e = geometry.FirstChildElement(kConvex); e != nullptr;) {
      XMLElement* const next = e->NextSiblingElement(kConvex);
      if (e->Attribute("convex_hull_of") == nullptr) {
        e->SetName("mesh");
        is_changed_ = true;
      }
      e = next;
    }
  }

  const std::string& file_;
  ColladaText& result_;
  std::map<std::string, XMLElement*> geometries_;
  std::map<std::string, XMLElement*> nodes_;
  std::map<std::string, const XMLElement*> bodies_;
  std::vector<const XMLElement*> moved_bodies_;
  std::vector<XMLElement*> instances_;
  std::vector<XMLElement*> bound_;  ///< to their materials
  std::set<std::string> told_;
  bool is_changed_ = false;
};

double unit_of_collada(const XMLElement& root, const std::string& file) {
  const XMLElement* asset = root.FirstChildElement("asset");
  const XMLElement* unit = asset != nullptr ? asset->FirstChildElement("unit") : nullptr;
  const std::string meter = unit != nullptr ? attribute(*unit, "meter") : "";
  if (meter.empty()) return 1.0;
  const auto line = line_of(*unit);
  const double unit_m = parse_number(meter, file, line, "unit", nullptr);
  if (!(unit_m > 0.0)) refuse_line(file, line, "the unit is " + shown_word(meter), "correct it");
  return unit_m;
}

}  // namespace

ColladaText collada_text(std::string_view text, const std::string& file) {
  tinyxml2::XMLDocument document;
  parse_xml(document, text, "COLLADA", file);
  ColladaText result;
  result.unit_m = unit_of_collada(*document.RootElement(), file);
  const ColladaRewrite rewrite(*document.RootElement(), file, result);
  if (!rewrite.is_changed()) return result;
  tinyxml2::XMLPrinter printer(nullptr, true);
  // Text behind the root, which the parser takes, would be no XML when it is written.
  const tinyxml2::XMLNode* first = document.FirstChild();
  if (first != nullptr && first->ToDeclaration() != nullptr) first->Accept(&printer);
  document.RootElement()->Accept(&printer);
  result.changed = printer.CStr();
  return result;
}

}  // namespace haptic::tools
