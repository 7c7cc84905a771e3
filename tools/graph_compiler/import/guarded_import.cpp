// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/guarded_import.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tools/common/error.hpp"
#include "tools/common/limited_child.hpp"
#include "tools/graph_compiler/mesh/mesh_nodes.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

constexpr char kMesh = 'm', kRefusal = 'r';
constexpr std::size_t kMostWarnings = 100, kLongestWarning = 1000;
/// Bytes of a node without its name.
constexpr std::size_t kNodeBytes = 2 * sizeof(std::uint32_t) + 1;
constexpr std::size_t kDeflectionBytes = 2 * sizeof(double);
/// Bytes of the largest mesh of triangles that a reader gives, with names of 200 bytes.
constexpr std::size_t kMostMessageBytes = 1024 + kMostWarnings * kLongestWarning +
                                          kMaxMeshVertices * sizeof(Point3) +
                                          kMaxMeshFaces * 5 * sizeof(std::uint32_t) +
                                          kMaxMeshNodes * (kNodeBytes + 200 + kDeflectionBytes);
constexpr ChildLimits kChildLimits{120, std::uint64_t{4} << 30, kMostMessageBytes};
constexpr const char* kExportAgain = "export the part again, or as STL";
constexpr const char* kMakeSmaller = "simplify the part, or export it as STL";

void append_bytes(std::string& to, const void* from, std::size_t size) {
  to.append(static_cast<const char*>(from), size);
}
template <typename T>
void append_number(std::string& to, T value) {
  append_bytes(to, &value, sizeof value);
}

/// Reads the message of a child that may have written anything.
class Message {
 public:
  Message(const std::string& text, const std::string& file) : text_(text), file_(file) {}

  template <typename T>
  T number() {
    T value{};
    take(&value, sizeof value);
    return value;
  }
  void take(void* to, std::size_t size) {
    if (size > text_.size() - at_) refuse();
    if (size == 0) return;  // `to` may be null
    std::memcpy(to, text_.data() + at_, size);
    at_ += size;
  }
  /// A count of items of at least `least` bytes each that are still to come.
  std::size_t count(std::uint64_t announced, std::size_t least) const {
    if (announced > (text_.size() - at_) / least) refuse();
    return static_cast<std::size_t>(announced);
  }
  [[nodiscard]] bool at_end() const { return at_ == text_.size(); }
  [[noreturn]] void refuse() const {
    refuse_file(file_, "the importer gave no mesh", kExportAgain);
  }

 private:
  const std::string& text_;
  const std::string& file_;
  std::size_t at_ = 0;
};

/// Libraries print what they find, before the one message that this program gives.
void be_quiet() {
  const int nothing = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nothing < 0) return;
  ::dup2(nothing, STDOUT_FILENO);
  ::dup2(nothing, STDERR_FILENO);
}

/// The end of a child that gave no answer.
[[noreturn]] void refuse_end(const std::string& file, const ChildResult& child) {
  switch (child.end) {
    case ChildEnd::kOutOfTime:
      refuse_file(file,
                  "the importer needs more than " + std::to_string(kChildLimits.seconds) +
                      " s of processor time",
                  kMakeSmaller);
    case ChildEnd::kOutOfMemory:
      refuse_file(file,
                  "the importer needs more than " +
                      std::to_string(kChildLimits.memory_bytes >> 30) + " GiB of memory",
                  kMakeSmaller);
    case ChildEnd::kTooLong:
      refuse_file(file, "its mesh is larger than " + std::to_string(kMaxMeshFaces) + " triangles",
                  kMakeSmaller);
    case ChildEnd::kSignal:
      refuse_file(file,
                  std::string("the importer crashed on it (") + ::strsignal(child.number) + ")",
                  kExportAgain);
    case ChildEnd::kThrew:
      refuse_file(file, "the importer failed on it (" + shown_word(child.text) + ")", kExportAgain);
    default:
      refuse_file(file, "the importer failed on it", kExportAgain);
  }
}

Deflection taken_deflection(Message& message) {
  const auto asked_m = message.number<double>(), found_m = message.number<double>();
  if (!(std::isfinite(asked_m) && asked_m >= 0.0 && std::isfinite(found_m) && found_m >= 0.0)) {
    message.refuse();
  }
  return {asked_m, found_m};
}

/// One for each node, or none.
void take_deflections(Message& message, ImportedMesh& imported) {
  const auto count = message.count(message.number<std::uint32_t>(), kDeflectionBytes);
  if (count != 0 && count != imported.mesh.nodes.size()) message.refuse();
  for (std::size_t k = 0; k < count; ++k) {
    imported.node_deflections.push_back(taken_deflection(message));
  }
}

/// The nodes, and of which the groups are: each group of a face where there are nodes.
void take_nodes(Message& message, RawMesh& mesh) {
  const auto nodes = message.count(message.number<std::uint32_t>(), kNodeBytes);
  if (nodes > kMaxMeshNodes) message.refuse();
  mesh.nodes.resize(nodes);
  for (std::size_t k = 0; k < nodes; ++k) {
    MeshNode& node = mesh.nodes[k];
    node.parent = message.number<std::uint32_t>();
    const auto is_part = message.number<std::uint8_t>();
    node.name.resize(message.count(message.number<std::uint32_t>(), 1));
    message.take(node.name.data(), node.name.size());
    const bool is_above = node.parent == MeshNode::kNone || node.parent < k;
    if (!is_above || is_part > 1 || node.name.empty() || tidy_name(node.name, "") != node.name) {
      message.refuse();
    }
    node.is_part = is_part == 1;
  }
  mesh.group_nodes.resize(message.count(message.number<std::uint32_t>(), sizeof(std::uint32_t)));
  message.take(mesh.group_nodes.data(), mesh.group_nodes.size() * sizeof(std::uint32_t));
  for (const std::uint32_t node : mesh.group_nodes) {
    if (node >= nodes) message.refuse();
  }
  for (const RawFace& face : mesh.faces) {
    if (nodes > 0 && face.group >= mesh.group_nodes.size()) message.refuse();
  }
}

}  // namespace

std::string message_of(const ImportedMesh& imported) {
  std::string text(1, kMesh);
  append_number(text, imported.unit_m);
  const Deflection deflection = imported.deflection.value_or(Deflection{});
  append_number(text, deflection.asked_m);  // 0: none
  append_number(text, deflection.found_m);
  append_number(text, std::uint64_t{imported.mesh.vertices.size()});
  append_number(text, std::uint64_t{imported.mesh.faces.size()});
  append_bytes(text, imported.mesh.vertices.data(), imported.mesh.vertices.size() * sizeof(Point3));
  for (const RawFace& face : imported.mesh.faces) {
    append_number(text, face.group);
    append_number(text, static_cast<std::uint32_t>(face.vertices.size()));
    append_bytes(text, face.vertices.data(), face.vertices.size() * sizeof(std::uint32_t));
  }
  append_number(text, static_cast<std::uint32_t>(imported.mesh.nodes.size()));
  for (const MeshNode& node : imported.mesh.nodes) {
    append_number(text, node.parent);
    append_number(text, static_cast<std::uint8_t>(node.is_part ? 1 : 0));
    append_number(text, static_cast<std::uint32_t>(node.name.size()));
    text += node.name;
  }
  append_number(text, static_cast<std::uint32_t>(imported.mesh.group_nodes.size()));
  append_bytes(text, imported.mesh.group_nodes.data(),
               imported.mesh.group_nodes.size() * sizeof(std::uint32_t));
  append_number(text, static_cast<std::uint32_t>(imported.node_deflections.size()));
  for (const auto& [node_asked_m, node_found_m] : imported.node_deflections) {
    append_number(text, node_asked_m);
    append_number(text, node_found_m);
  }
  for (const std::string& warning : imported.mesh.warnings) {
    append_number(text, static_cast<std::uint32_t>(warning.size()));
    text += warning;
  }
  return text;
}

ImportedMesh mesh_of_message(const std::string& text, const std::string& file) {
  Message message(text, file);
  if (message.number<char>() != kMesh) message.refuse();
  ImportedMesh imported;
  imported.unit_m = message.number<double>();
  if (!(std::isfinite(imported.unit_m) && imported.unit_m > 0.0)) message.refuse();
  const Deflection deflection = taken_deflection(message);
  if (deflection.asked_m > 0.0) imported.deflection = deflection;
  RawMesh& mesh = imported.mesh;
  mesh.file = file;
  mesh.indexed = true;
  mesh.places_are_lines = false;
  const auto vertices = message.number<std::uint64_t>(), faces = message.number<std::uint64_t>();
  mesh.vertices.resize(message.count(vertices, sizeof(Point3)));
  mesh.vertex_places.resize(mesh.vertices.size(), 0);
  message.take(mesh.vertices.data(), mesh.vertices.size() * sizeof(Point3));
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!std::ranges::all_of(mesh.vertices[v], [](double x) { return std::isfinite(x); })) {
      refuse_file(file, "vertex " + std::to_string(v + 1) + " is not finite",
                  "export the part again");
    }
  }
  mesh.faces.resize(message.count(faces, 5 * sizeof(std::uint32_t)));
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    RawFace& face = mesh.faces[f];
    face.group = message.number<std::uint32_t>();
    face.vertices.resize(message.count(message.number<std::uint32_t>(), sizeof(std::uint32_t)));
    message.take(face.vertices.data(), face.vertices.size() * sizeof(std::uint32_t));
    for (const std::uint32_t v : face.vertices) {
      if (v >= mesh.vertices.size()) {
        refuse_file(file,
                    "face " + std::to_string(f + 1) + " uses vertex " + std::to_string(v) + " of " +
                        std::to_string(mesh.vertices.size()),
                    "correct the index");
      }
    }
    if (face.vertices.size() < 3) message.refuse();
  }
  take_nodes(message, mesh);
  take_deflections(message, imported);
  while (!message.at_end()) {
    std::string warning(message.count(message.number<std::uint32_t>(), 1), '\0');
    message.take(warning.data(), warning.size());
    const bool is_text = std::ranges::all_of(warning, [](char c) { return c >= ' ' && c <= '~'; });
    if (!is_text || warning.empty() || warning.size() > kLongestWarning ||
        mesh.warnings.size() == kMostWarnings) {
      message.refuse();
    }
    mesh.warnings.push_back(std::move(warning));
  }
  if (mesh.faces.empty()) {
    refuse_file(file, "the file holds no face", "export the part as a polygon mesh");
  }
  return imported;
}

ImportedMesh guarded(const std::string& file, const std::function<ImportedMesh()>& work) {
  const ChildResult child = run_in_child(file, kChildLimits, [&]() -> std::string {
    be_quiet();
    try {
      return message_of(work());
    } catch (const InputError& error) {
      return kRefusal + std::string(error.what());
    }
  });
  if (child.end != ChildEnd::kAnswered) refuse_end(file, child);
  if (child.text.starts_with(kRefusal)) throw InputError(child.text.substr(1));
  return mesh_of_message(child.text, file);
}

}  // namespace haptic::tools
