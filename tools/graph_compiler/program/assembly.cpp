// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/assembly.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/import/node_mesh.hpp"
#include "tools/graph_compiler/mesh/mesh_nodes.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/program/odd_sizes.hpp"

namespace haptic::tools {
namespace {

/// So many nodes are listed.
constexpr std::size_t kMostListed = 100;

/// Instances of one mesh are of the same size but for rounding: of these the first.
constexpr double kSmaller = 1.0 - 1e-6;

/// Corners this near to each other are one, as a share of the size of the part.
constexpr double kSameCorner = 1e-6;
constexpr double kFarthest = 1e18;

/// Twice, in units of the mesh.
double area_of(const RawMesh& mesh) {
  double area = 0.0;
  for (const RawFace& face : mesh.faces) {
    area += vec::norm(vec::twice_area(mesh.vertices, face.vertices));
  }
  return area;
}

/// Every edge has an even number of faces. Cost: n log n in the corners.
bool has_no_open_edge(const RawMesh& mesh, double diagonal) {
  std::map<std::array<std::int64_t, 3>, std::uint32_t> places;
  std::vector<std::uint32_t> corner(mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    std::array<std::int64_t, 3> place{};
    for (std::size_t i = 0; i < 3; ++i) {
      place[i] = std::llround(
          std::clamp(mesh.vertices[v][i] / (kSameCorner * diagonal), -kFarthest, kFarthest));
    }
    corner[v] = places.try_emplace(place, static_cast<std::uint32_t>(v)).first->second;
  }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const RawFace& face : mesh.faces) {
    for (std::size_t k = 0; k < face.vertices.size(); ++k) {
      const std::uint32_t a = corner[face.vertices[k]];
      const std::uint32_t b = corner[face.vertices[(k + 1) % face.vertices.size()]];
      if (a != b) edges.push_back(std::minmax(a, b));
    }
  }
  std::ranges::sort(edges);
  for (std::size_t k = 0; k < edges.size();) {
    const auto end = std::ranges::upper_bound(edges, edges[k]);
    const auto next = static_cast<std::size_t>(end - edges.begin());
    if ((next - k) % 2 != 0) return false;
    k = next;
  }
  return true;
}

bool has_any(const std::vector<bool>& faces) {
  return std::ranges::find(faces, true) != faces.end();
}

/// "'a', 'b' and 5 more".
std::string listed_names(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t k = 0; k < std::min(names.size(), kMostListed); ++k) {
    text += (k == 0 ? "" : ", ") + shown_name(names[k]);
  }
  if (names.size() > kMostListed) {
    text += " and " + std::to_string(names.size() - kMostListed) + " more";
  }
  return text;
}

class AssemblyReader {
 public:
  explicit AssemblyReader(const AssemblyRequest& request) : source_(draft_source(request.given)) {
    file_.path = source_.file;
    file_.name = file_.path.string();
    is_robot_ = is_description(file_.path) || (source_.node && !is_mesh_file(file_.path));
    if (is_robot_) {
      file_.has_unit = true;  // metres
      file_.mesh = std::make_shared<const RawMesh>(robot_mesh(file_.path));
    } else if (import_format_of(file_.path)) {
      file_.has_unit = true;
      file_.mesh = std::make_shared<const RawMesh>(import_mesh(file_.path).mesh);
    } else {
      file_.mesh = std::make_shared<const RawMesh>(read_mesh(file_.path));
    }
    nodes_ = named_nodes(*file_.mesh);
  }

  Assembly read(const AssemblyRequest& request) {
    std::vector<DraftMesh> parts;
    for (const NamedNode& node : nodes_) {
      if (node.is_part) parts.push_back(drafted(node.name, faces_of(node)));
    }
    std::erase_if(parts, [&](const DraftMesh& part) { return is_flat(part); });
    const std::optional<std::string> asked = asked_hand(request);
    if (parts.size() < 2 && !asked) refuse_single(parts);
    assembly_.unit = unit_of_file(parts);
    const double scale =
        file_.has_unit ? 1.0 : request.scale_to_m.value_or(assembly_.unit.scale_to_m);
    std::string hand, why;
    if (asked) {
      hand = named(node_named(*file_.mesh, *asked)).name;
      why = "as asked for";
    } else {
      hand = *chosen_hand(parts, scale, why).node;
      why += is_robot_ ? "; --hand LINK chooses another" : "; --hand NODE chooses another";
    }
    split(hand, std::move(parts));
    if (assembly_.parts.size() < 2) refuse_single(assembly_.parts);
    list(request, scale);
    assembly_.remarks.push_back("in the hand: " + shown_name(hand) + ", " + why);
    tell_open();
    tell_left_out();
    return std::move(assembly_);
  }

 private:
  [[nodiscard]] std::vector<bool> faces_of(const NamedNode& node) const {
    return faces_of_node(*file_.mesh, node.node);
  }
  [[nodiscard]] const NamedNode& named(std::uint32_t index) const {
    return *std::ranges::find(nodes_, index, &NamedNode::node);
  }

  DraftMesh drafted(const std::string& node, const std::vector<bool>& faces) const {
    DraftMesh part = file_;
    part.node = node;
    if (is_robot_) part.link = node;
    part.in_robot = is_robot_;
    part.name += "#" + node;
    part.mesh = std::make_shared<const RawMesh>(mesh_of_faces(*file_.mesh, faces, node));
    return part;
  }

  bool is_closed(const DraftMesh& part) {
    const auto [found, is_new] = closed_.try_emplace(*part.node, false);
    if (is_new) found->second = has_no_open_edge(*part.mesh, part.diagonal());
    return found->second;
  }

  /// A part that cannot be compiled as anything.
  bool is_flat(const DraftMesh& part) {
    if (area_of(*part.mesh) > 0.0) return false;
    flat_.push_back(*part.node);
    return true;
  }

  std::optional<std::string> asked_hand(const AssemblyRequest& request) const {
    if (!request.hand || !source_.node || *request.hand == *source_.node) {
      return request.hand ? request.hand : source_.node;
    }
    throw UsageError("--hand " + shown_name(*request.hand) + " and " + request.given.string() +
                     " name two nodes for the hand; keep one");
  }

  [[noreturn]] void refuse_single(const std::vector<DraftMesh>& parts) const {
    throw UsageError(file_.name + ": " +
                     (parts.empty() ? "the file names no parts"
                                    : shown_name(*parts[0].node) + " is its only part") +
                     "; give the meshes of the fixed parts too, or a file with several nodes");
  }

  /// All parts are in one unit; those that are tiny beside the largest say little of it.
  [[nodiscard]] FileUnit unit_of_file(const std::vector<DraftMesh>& parts) const {
    if (file_.has_unit || parts.empty()) return {"", 1.0};
    std::vector<double> diagonals;
    for (const DraftMesh& part : parts) diagonals.push_back(part.diagonal());
    const double most = std::ranges::max(diagonals);
    std::erase_if(diagonals, [&](double diagonal) { return diagonal * kOddRatio < most; });
    return guessed_unit(diagonals);
  }

  /// Open parts may be the faces of one body: they are taken where there are no others.
  const DraftMesh& chosen_hand(const std::vector<DraftMesh>& parts, double scale,
                               std::string& why) {
    const auto closed = [&](const DraftMesh& part) { return is_closed(part); };
    const bool any_closed = std::ranges::any_of(parts, closed);
    const DraftMesh *smallest = nullptr, *largest = nullptr;
    double least_m = std::numeric_limits<double>::infinity(), most_m = -1.0;
    for (const DraftMesh& part : parts) {
      if (any_closed && !is_closed(part)) continue;
      const double size_m = part.diagonal() * scale;
      if (size_m >= kLeastHeld_m && size_m < kSmaller * least_m) {
        smallest = &part;
        least_m = size_m;
      }
      if (size_m > most_m) {
        largest = &part;
        most_m = size_m;
      }
    }
    const std::string held = spoken_length(kLeastHeld_m);
    const char* of = any_closed && !std::ranges::all_of(parts, closed) ? " closed part" : " part";
    why = smallest != nullptr
              ? std::string("the smallest") + of + " that a hand can hold (" + held + " and more)"
              : std::string("the largest") + of + ", since none is " + held + " across";
    return smallest != nullptr ? *smallest : *largest;
  }

  /// The hand, and all parts without what is in it.
  void split(const std::string& hand, std::vector<DraftMesh> parts) {
    const auto at = std::ranges::find(nodes_, hand, &NamedNode::name);
    const std::vector<bool> held = faces_of(*at);
    assembly_.parts.push_back(drafted(hand, held));
    for (DraftMesh& part : parts) {
      const std::vector<bool> faces =
          faces_of(*std::ranges::find(nodes_, *part.node, &NamedNode::name));
      std::vector<bool> rest = faces;
      bool is_met = false;
      for (std::size_t f = 0; f < faces.size(); ++f) {
        is_met |= faces[f] && held[f];
        rest[f] = faces[f] && !held[f];
      }
      if (!is_met) {
        assembly_.parts.push_back(std::move(part));
      } else if (has_any(rest)) {
        take_apart(rest);
      }
    }
  }

  /// Keeps the rest of a part that holds the hand, as the largest nodes that are whole in it.
  void take_apart(std::vector<bool> rest) {
    for (const NamedNode& node : nodes_) {
      const std::vector<bool> faces = faces_of(node);
      bool is_within = has_any(faces);
      for (std::size_t f = 0; f < faces.size() && is_within; ++f) is_within = !faces[f] || rest[f];
      if (!is_within) continue;
      DraftMesh piece = drafted(node.name, faces);
      for (std::size_t f = 0; f < faces.size(); ++f) rest[f] = rest[f] && !faces[f];
      if (!is_flat(piece)) assembly_.parts.push_back(std::move(piece));
    }
    if (has_any(rest)) throw std::logic_error("nodes of an assembly do not hold all its faces");
  }

  void list(const AssemblyRequest& request, double scale) {
    const std::string scaled = is_robot_        ? "all joints at 0"
                               : file_.has_unit ? "as the file states"
                               : request.scale_to_m
                                   ? "--scale " + short_number(scale, 6)
                                   : std::string("unit guessed: ") + assembly_.unit.name;
    std::vector<std::string>& remarks = assembly_.remarks;
    remarks.push_back(file_.name + ": " + std::to_string(assembly_.parts.size()) +
                      (is_robot_ ? " links" : " nodes") +
                      " are the parts of the scene (x, y, z in m; " + scaled + ")");
    for (std::size_t k = 0; k < std::min(assembly_.parts.size(), kMostListed); ++k) {
      const DraftMesh& part = assembly_.parts[k];
      const DraftBox box = part.box();
      std::string line = "  " + shown_name(*part.node) + ":";
      for (std::size_t i = 0; i < 3; ++i) {
        line += (i == 0 ? " " : " x ") + short_number((box.high[i] - box.low[i]) * scale, 3);
      }
      remarks.push_back(line + (k == 0 ? ", in the hand" : ", fixed"));
    }
    if (assembly_.parts.size() > kMostListed) {
      remarks.push_back("  and " + std::to_string(assembly_.parts.size() - kMostListed) + " more");
    }
    const bool are_numbered = std::ranges::any_of(nodes_, [&](const NamedNode& node) {
      return node.name != file_.mesh->nodes[node.node].name;
    });
    if (are_numbered) {
      remarks.push_back(
          "nodes that share a name are numbered in the order of the file, NAME:1, ..");
    }
    std::vector<std::string> others;
    for (const NamedNode& node : nodes_) {
      const bool is_listed = std::ranges::any_of(
          assembly_.parts, [&](const DraftMesh& part) { return *part.node == node.name; });
      if (!is_listed && std::ranges::find(flat_, node.name) == flat_.end()) {
        others.push_back(node.name);
      }
    }
    if (!others.empty()) {
      remarks.push_back("other nodes, which hold these or are pieces of them: " +
                        listed_names(others));
    }
  }

  void tell_open() {
    std::vector<std::string> open;
    for (const DraftMesh& part : assembly_.parts) {
      if (!is_closed(part)) open.push_back(*part.node);
    }
    if (open.empty()) return;
    assembly_.remarks.push_back(std::to_string(open.size()) +
                                " of the parts have open edges: " + listed_names(open) +
                                "; where they are faces of one body, name the file without #");
  }

  void tell_left_out() {
    for (const std::string& node : flat_) {
      assembly_.remarks.push_back("left out: " + shown_name(node) + ", which has no area");
    }
    std::vector<bool> has_faces(file_.mesh->nodes.size(), false);
    for (const RawFace& face : file_.mesh->faces) {
      std::uint32_t node = file_.mesh->group_nodes[face.group];
      for (; node != MeshNode::kNone && !has_faces[node]; node = file_.mesh->nodes[node].parent) {
        has_faces[node] = true;
      }
    }
    std::vector<std::string> empty;
    for (std::size_t k = 0; k < has_faces.size(); ++k) {
      if (!has_faces[k]) empty.push_back(file_.mesh->nodes[k].name);
    }
    if (!empty.empty()) {
      assembly_.remarks.push_back("left out, since they have no faces: " + listed_names(empty));
    }
  }

  NodeName source_;
  bool is_robot_ = false;  ///< the nodes are links
  DraftMesh file_;         ///< the whole
  std::vector<NamedNode> nodes_;
  std::vector<std::string> flat_;
  std::map<std::string, bool> closed_;  ///< parts that were asked about
  Assembly assembly_;
};

}  // namespace

Assembly read_assembly(const AssemblyRequest& request) {
  return AssemblyReader(request).read(request);
}

}  // namespace haptic::tools
