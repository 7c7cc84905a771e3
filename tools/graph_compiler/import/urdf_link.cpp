// SPDX-License-Identifier: Apache-2.0
/// Collision models of robot descriptions.
#include <algorithm>
#include <array>
#include <cmath>

#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"
#include "tools/common/named_file.hpp"
#include "tools/common/toml_table.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/import/urdf_files.hpp"
#include "tools/graph_compiler/import/urdf_tree.hpp"
#include "tools/graph_compiler/import/xml_file.hpp"
#include "tools/graph_compiler/mesh/mesh_nodes.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/packed_file.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"
#include "tools/graph_compiler/shapes/shape.hpp"

namespace haptic::tools {
namespace {

using tinyxml2::XMLElement;

/// The tree of the XML takes some thirty times as much.
constexpr std::size_t kMaxUrdfBytes = std::size_t{16} << 20;

/// So many links are named in a message.
constexpr std::size_t kMostNamed = 100;

/// Blanks around it do not belong to the name.
std::string link_name(const XMLElement& link) { return without_blanks(attribute(link, "name")); }

std::vector<std::string> names_with_collision(const XMLElement& robot) {
  std::vector<std::string> names;
  for (const XMLElement* l = robot.FirstChildElement("link"); l != nullptr;
       l = l->NextSiblingElement("link")) {
    if (l->FirstChildElement("collision") != nullptr) names.push_back(link_name(*l));
  }
  return names;
}

/// "its links with a collision model: 'a', 'b'".
std::string listed(const std::vector<std::string>& names) {
  if (names.empty()) return "no link of it has a <collision>";
  std::string text = "its links with a collision model: ";
  for (std::size_t k = 0; k < std::min(names.size(), kMostNamed); ++k) {
    text += (k == 0 ? "" : ", ") + shown_name(names[k]);
  }
  if (names.size() > kMostNamed) {
    text += " and " + std::to_string(names.size() - kMostNamed) + " more";
  }
  return text;
}

[[noreturn]] void refuse_no_link(const std::string& file) {
  refuse_file(file, "the robot has no <link>", "expand xacro files first: xacro FILE > robot.urdf");
}

class LinkReader {
 public:
  LinkReader(const std::string& file, const std::filesystem::path& folder)
      : file_(file), folder_(folder) {
    mesh_.file = file;
    mesh_.indexed = true;
    mesh_.places_are_lines = false;
  }

  /// Mesh of one link, in the frame that `frame` maps the link's to.
  RawMesh read(const XMLElement& link, const Placing& frame) {
    add_link(link, frame);
    if (mesh_.faces.empty()) {
      refuse(
          link, "link " + shown_name(link_name(link)) + " has no <collision>",
          "name a link that has one; " + listed(names_with_collision(*link.Parent()->ToElement())));
    }
    return std::move(mesh_);
  }

  /// Mesh of all links, each a node.
  RawMesh read(const std::vector<PlacedLink>& links) {
    for (const PlacedLink& link : links) {
      const auto node = static_cast<std::uint32_t>(mesh_.nodes.size());
      if (link.name.empty() || tidy_name(link.name, "") != link.name) {
        refuse(*link.element, "the name of the link is " + shown_word(link.name),
               "give it a name in one line, of at most 200 bytes");
      }
      mesh_.nodes.push_back({link.name, MeshNode::kNone, true});
      add_link(*link.element, link.in_root);
      mesh_.group_nodes.resize(group_, node);
    }
    return std::move(mesh_);
  }

 private:
  void add_link(const XMLElement& link, const Placing& frame) {
    frame_ = frame;
    for (const XMLElement* c = link.FirstChildElement("collision"); c != nullptr;
         c = c->NextSiblingElement("collision")) {
      add_collision(*c);
    }
  }

  [[noreturn]] void refuse(const XMLElement& at, const std::string& defect,
                           const std::string& fix) const {
    refuse_line(file_, line_of(at), defect, fix);
  }

  template <std::size_t kCount>
  std::array<double, kCount> numbers(const XMLElement& at, const char* name) const {
    return attribute_numbers<kCount>(file_, at, name);
  }

  void add_collision(const XMLElement& collision) {
    const XMLElement* geometry = collision.FirstChildElement("geometry");
    const XMLElement* form = geometry != nullptr ? geometry->FirstChildElement() : nullptr;
    if (form == nullptr) {
      refuse(collision, "a <collision> has no <geometry> with a form", "give it one");
    }
    const XMLElement* second = form->NextSiblingElement();
    if (second == nullptr) second = geometry->NextSiblingElement("geometry");
    if (second != nullptr) {
      refuse(*second, "a <collision> has a second form, <" + shown_word(second->Name()) + ">",
             "give every form a <collision> of its own");
    }
    append(form_of(*form), frame_.of(origin_below(collision, file_)), collision);
  }

  RawMesh form_of(const XMLElement& form) {
    const std::string name = form.Name();
    if (name == "mesh") return mesh_form(form);
    Shape shape;
    if (name == "box") {
      shape = BoxShape{numbers<3>(form, "size")};
    } else if (name == "cylinder") {
      shape = CylinderShape{numbers<1>(form, "radius")[0], numbers<1>(form, "length")[0]};
    } else if (name == "sphere") {
      shape = SphereShape{numbers<1>(form, "radius")[0]};
    } else {
      refuse(form, "the form <" + shown_word(name) + "> is not known",
             "the forms are box, cylinder, sphere and mesh");
    }
    if (const auto defect = defect_of(shape)) {
      refuse(
          form,
          "<" + name + ">: " + defect->key + " " + defect->text.substr(0, defect->text.find(';')),
          "correct the dimension");
    }
    return shape_mesh(shape, file_);
  }

  RawMesh mesh_form(const XMLElement& form) {
    const std::filesystem::path path =
        urdf_mesh_file(attribute(form, "filename"), {file_, line_of(form), folder_}, mesh_.notes);
    note_input(path, "a mesh of the scene");
    RawMesh part = import_format_of(path) ? import_mesh(path).mesh : read_mesh(path);
    add_notes(part.notes);
    if (form.Attribute("scale") == nullptr) return part;
    const auto scale = numbers<3>(form, "scale");
    bool mirrored = false;
    for (const double x : scale) {
      if (x == 0.0) {
        refuse(form, "the scale is " + shown_word(attribute(form, "scale")),
               "give three numbers other than 0; a minus sign mirrors");
      }
      mirrored ^= x < 0.0;
    }
    for (Point3& p : part.vertices) {
      for (std::size_t k = 0; k < 3; ++k) p[k] *= scale[k];
    }
    // Counter-clockwise from outside becomes clockwise in a mirror; two mirrors are a turn.
    if (mirrored) {
      for (RawFace& face : part.faces) std::ranges::reverse(face.vertices);
    }
    return part;
  }

  /// Meshes that are used several times have the same to say.
  void add_notes(const std::vector<std::string>& notes) {
    for (const std::string& note : notes) {
      if (std::ranges::find(mesh_.notes, note) == mesh_.notes.end()) mesh_.notes.push_back(note);
    }
  }

  void append(const RawMesh& part, const Placing& placing, const XMLElement& at) {
    if (mesh_.vertices.size() + part.vertices.size() > kMaxMeshVertices ||
        mesh_.faces.size() + part.faces.size() > kMaxMeshFaces) {
      refuse(at, "the collision model has more than " + std::to_string(kMaxMeshFaces) + " faces",
             "simplify its meshes");
    }
    const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
    for (const Point3& p : part.vertices) {
      const Point3 to = placing.of(p);
      for (const double x : to) {
        if (!std::isfinite(x)) refuse(at, "a corner is not finite", "correct the origin");
      }
      mesh_.vertices.push_back(to);
      mesh_.vertex_places.push_back(0);
    }
    std::uint32_t last_group = 0;
    for (const RawFace& face : part.faces) {
      RawFace moved;
      moved.group = group_ + face.group;
      last_group = std::max(last_group, moved.group);
      for (const std::uint32_t v : face.vertices) moved.vertices.push_back(first + v);
      mesh_.faces.push_back(std::move(moved));
    }
    group_ = std::max(group_, last_group + 1);
    for (const std::string& warning : part.warnings) {
      mesh_.warnings.push_back(std::filesystem::path(part.file).filename().string() + ": " +
                               warning);
    }
  }

  const std::string& file_;
  std::filesystem::path folder_;
  Placing frame_;
  RawMesh mesh_;
  std::uint32_t group_ = 0;
};

}  // namespace

RawMesh link_mesh_of(const std::string& text, const std::string& file,
                     const std::filesystem::path& folder, const std::string& link,
                     LinkFrame frame) {
  refuse_packed(text, file);
  tinyxml2::XMLDocument document;
  const XMLElement& robot = parse_xml(document, text, "robot", file);
  std::vector<std::string> names;
  const std::string wanted = without_blanks(link);
  const XMLElement* found = nullptr;
  for (const XMLElement* l = robot.FirstChildElement("link"); l != nullptr;
       l = l->NextSiblingElement("link")) {
    names.push_back(link_name(*l));
    if (names.back() != wanted) continue;
    if (found != nullptr) {
      refuse_line(
          file, line_of(*l),
          "link " + shown_name(link) + " is in line " + std::to_string(line_of(*found)) + " too",
          "give every link a name of its own");
    }
    found = l;
  }
  if (found != nullptr) {
    Placing placing;
    std::vector<std::string> notes;
    if (frame == LinkFrame::kRobot) {
      const std::vector<PlacedLink> links = links_at_zero(robot, file, notes);
      placing = std::ranges::find(links, found, &PlacedLink::element)->in_root;
    }
    return LinkReader(file, folder).read(*found, placing);
  }
  if (names.empty()) refuse_no_link(file);
  const std::string nearest = nearest_word(wanted, {names.begin(), names.end()});
  refuse_file(file, "no link " + shown_name(link),
              (nearest.empty() ? "" : "did you mean " + shown_name(nearest) + "? ") +
                  listed(names_with_collision(robot)));
}

RawMesh link_mesh(const std::filesystem::path& urdf, const std::string& link, LinkFrame frame) {
  return link_mesh_of(read_text_file(urdf, kMaxUrdfBytes, "a robot description of the scene"),
                      urdf.string(), folder_of(urdf), link, frame);
}

RawMesh robot_mesh_of(const std::string& text, const std::string& file,
                      const std::filesystem::path& folder) {
  refuse_packed(text, file);
  tinyxml2::XMLDocument document;
  const XMLElement& robot = parse_xml(document, text, "robot", file);
  std::vector<std::string> notes;
  const std::vector<PlacedLink> links = links_at_zero(robot, file, notes);
  if (links.empty()) refuse_no_link(file);
  if (names_with_collision(robot).empty()) {
    refuse_file(file, "no link of it has a <collision>", "give the parts collision models");
  }
  RawMesh mesh = LinkReader(file, folder).read(links);
  mesh.notes.insert(mesh.notes.end(), notes.begin(), notes.end());
  return mesh;
}

RawMesh robot_mesh(const std::filesystem::path& urdf) {
  return robot_mesh_of(read_text_file(urdf, kMaxUrdfBytes, "a robot description of the scene"),
                       urdf.string(), folder_of(urdf));
}

std::string collision_links(const std::filesystem::path& urdf) {
  const std::string text = read_text_file(urdf, kMaxUrdfBytes, "a robot description of the scene");
  refuse_packed(text, urdf.string());
  tinyxml2::XMLDocument document;
  return listed(names_with_collision(parse_xml(document, text, "robot", urdf.string())));
}

}  // namespace haptic::tools
