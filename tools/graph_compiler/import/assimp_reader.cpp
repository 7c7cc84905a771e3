// SPDX-License-Identifier: Apache-2.0
/// The part that assimp does: one importer of its many, memory and the buffers of a .gltf in place
/// of files, and all meshes of the scene at the places of their nodes.
#include <assimp/BaseImporter.h>
#include <assimp/config.h>
#include <assimp/importerdesc.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <vector>

#include "tools/common/files.hpp"
#include "tools/graph_compiler/import/amf_reader.hpp"
#include "tools/graph_compiler/import/gltf_check.hpp"
#include "tools/graph_compiler/import/guarded_import.hpp"
#include "tools/graph_compiler/import/import_readers.hpp"
#include "tools/graph_compiler/import/xml_unit.hpp"
#include "tools/graph_compiler/import/zip_entry.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

constexpr int kDeepestNode = 200;

/// Bytes as a file that can only be read.
class MemoryStream final : public Assimp::IOStream {
 public:
  explicit MemoryStream(std::span<const char> bytes) : bytes_(bytes) {}
  explicit MemoryStream(std::string own) : own_(std::move(own)), bytes_(own_) {}

  std::size_t Read(void* to, std::size_t size, std::size_t count) override {
    if (size == 0) return 0;
    const std::size_t whole = std::min(count, (bytes_.size() - at_) / size);
    if (whole > 0) std::memcpy(to, bytes_.data() + at_, whole * size);
    at_ += whole * size;
    return whole;
  }
  std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
  aiReturn Seek(std::size_t offset, aiOrigin origin) override {
    const std::size_t base = origin == aiOrigin_SET   ? 0
                             : origin == aiOrigin_CUR ? at_
                                                      : bytes_.size();
    // Backwards offsets come as huge numbers and wrap around.
    const std::size_t to = base + offset;
    if (to > bytes_.size()) return aiReturn_FAILURE;
    at_ = to;
    return aiReturn_SUCCESS;
  }
  [[nodiscard]] std::size_t Tell() const override { return at_; }
  [[nodiscard]] std::size_t FileSize() const override { return bytes_.size(); }
  void Flush() override {}

 private:
  std::string own_;
  std::span<const char> bytes_;
  std::size_t at_ = 0;
};

/// The one file in memory; below a folder the buffers of a .gltf.
class MemoryFiles final : public Assimp::IOSystem {
 public:
  MemoryFiles(std::span<const char> bytes, std::string name, std::filesystem::path folder)
      : bytes_(bytes), name_(std::move(name)), folder_(std::move(folder)) {}

  bool Exists(const char* path) const override { return path == name_ || is_buffer(path); }
  [[nodiscard]] char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* path, const char*) override {
    if (path == name_) return new MemoryStream(bytes_);
    if (!is_buffer(path)) return nullptr;
    return new MemoryStream(read_text_file(folder_ / path, kMaxMeshBytes, "a buffer of the mesh"));
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

 private:
  [[nodiscard]] bool is_buffer(const char* path) const { return is_gltf_buffer(folder_, path); }

  std::span<const char> bytes_;
  std::string name_;
  std::filesystem::path folder_;
};

struct Reader {
  std::string_view name;       ///< for messages
  std::string_view importer;   ///< assimp's
  std::string_view extension;  ///< by which assimp chooses it
};

const Reader& reader_of(ImportFormat format) {
  static const std::array<Reader, 4> kReaders{{
      {"3MF", "3mf Importer", "3mf"},
      {"glTF", "glTF2 Importer", "gltf"},
      {"GLB", "glTF2 Importer", "glb"},
      {"COLLADA", "Collada Importer", "dae"},
  }};
  return kReaders[static_cast<std::size_t>(format)];
}

/// Takes every importer but one out of the library.
void keep_one(Assimp::Importer& importer, const Reader& reader, const std::string& file) {
  bool found = false;
  for (std::size_t k = importer.GetImporterCount(); k-- > 0;) {
    if (reader.importer == importer.GetImporterInfo(k)->mName) {
      found = true;
      continue;
    }
    Assimp::BaseImporter* other = importer.GetImporter(k);
    if (importer.UnregisterLoader(other) == aiReturn_SUCCESS) delete other;
  }
  if (!found) {
    refuse_file(file, "this build of assimp reads no " + std::string(reader.name),
                "convert the part to STL, OBJ or OFF");
  }
}

// Units, which assimp leaves out (3MF) or applies without saying it (COLLADA).

constexpr NamedUnit k3mfUnits[] = {{"micron", 1e-6}, {"millimeter", 1e-3}, {"centimeter", 1e-2},
                                   {"inch", 0.0254}, {"foot", 0.3048},     {"meter", 1.0}};

/// The text of the model that the package names, as assimp finds it.
std::string model_text_of_3mf(std::span<const char> bytes, const std::string& file) {
  constexpr const char* kRelations = "_rels/.rels";
  const std::string text = zip_entry(bytes, kRelations, kMaxMeshBytes, file);
  tinyxml2::XMLDocument document;
  const tinyxml2::XMLElement& root = parse_xml(document, text, "Relationships", file);
  for (const auto* r = root.FirstChildElement("Relationship"); r != nullptr;
       r = r->NextSiblingElement("Relationship")) {
    if (attribute(*r, "Type") != "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel") {
      continue;
    }
    const std::string target = attribute(*r, "Target");
    return zip_entry(bytes, target.starts_with('/') ? target.substr(1) : target, kMaxMeshBytes,
                     file);
  }
  refuse_file(file, std::string("its ") + kRelations + " names no model", "export the file again");
}

/// Refuses components that place each other in a circle, which assimp follows without end.
void check_components_of_3mf(
    const std::map<std::string, std::vector<const tinyxml2::XMLElement*>>& components,
    const std::string& file) {
  // Takes away object after object whose components are all taken away; a circle stays.
  std::map<std::string, std::vector<std::string>> users;
  std::map<std::string, std::size_t> left;
  std::vector<std::string> taken;
  for (const auto& [id, parts] : components) {
    left[id] = parts.size();
    if (parts.empty()) taken.push_back(id);
    for (const auto* part : parts) users[attribute(*part, "objectid")].push_back(id);
  }
  for (std::size_t k = 0; k < taken.size(); ++k) {
    for (const std::string& user : users[std::string(taken[k])]) {
      if (--left[user] == 0) taken.push_back(user);
    }
  }
  for (const auto& [id, parts] : components) {
    if (left[id] == 0) continue;
    refuse_line(file, line_of(*parts.front()),
                "the components of object " + shown_word(id) + " run in a circle",
                "correct their objectid");
  }
}

/// Refuses what assimp drops in silence or dies of.
void check_build_of_3mf(const tinyxml2::XMLElement& root, const std::string& file) {
  std::map<std::string, std::vector<const tinyxml2::XMLElement*>> components;
  const tinyxml2::XMLElement* resources = root.FirstChildElement("resources");
  const auto* o = resources != nullptr ? resources->FirstChildElement("object") : nullptr;
  for (; o != nullptr; o = o->NextSiblingElement("object")) {
    auto& of_object = components[attribute(*o, "id")];
    const tinyxml2::XMLElement* parts = o->FirstChildElement("components");
    const auto* part = parts != nullptr ? parts->FirstChildElement("component") : nullptr;
    for (; part != nullptr; part = part->NextSiblingElement("component")) {
      of_object.push_back(part);
    }
  }
  const auto check_id = [&](const tinyxml2::XMLElement& at) {
    const std::string id = attribute(at, "objectid");
    if (components.contains(id)) return;
    refuse_line(file, line_of(at),
                std::string("<") + at.Name() + "> names object " + shown_word(id) +
                    ", which is not in the model",
                "export the file again");
  };
  for (const auto& [id, parts] : components) {
    for (const auto* part : parts) check_id(*part);
  }
  check_components_of_3mf(components, file);
  const tinyxml2::XMLElement* build = root.FirstChildElement("build");
  const auto* item = build != nullptr ? build->FirstChildElement("item") : nullptr;
  if (item == nullptr) {
    refuse_file(file, "its <build> has no <item>, so none of its objects is placed",
                "export the file again with the parts on the plate");
  }
  for (; item != nullptr; item = item->NextSiblingElement("item")) check_id(*item);
}

double unit_of_3mf(std::span<const char> bytes, const std::string& file) {
  const std::string text = model_text_of_3mf(bytes, file);
  tinyxml2::XMLDocument document;
  const tinyxml2::XMLElement& root = parse_xml(document, text, "model", file);
  const std::string extensions = attribute(root, "requiredextensions");
  if (!extensions.empty()) {
    refuse_file(file,
                "the file needs extensions of 3MF that are not read: " + shown_word(extensions),
                "export it with the core of 3MF alone, or as STL");
  }
  check_build_of_3mf(root, file);
  return named_unit(root, k3mfUnits, file);
}

/// assimp reads the mesh of a controller but neither its bind shape nor its joints and morphs.
class ControllerSearch final : public tinyxml2::XMLVisitor {
 public:
  explicit ControllerSearch(const std::string& file) : file_(file) {}
  bool VisitEnter(const tinyxml2::XMLElement& element, const tinyxml2::XMLAttribute*) override {
    if (element.Name() == std::string_view("instance_controller")) {
      refuse_line(file_, line_of(element),
                  "a node bends its mesh by controller " + shown_word(attribute(element, "url")) +
                      " (skin or morph), which is not read",
                  "apply it to the mesh in the program that made the file, and export again");
    }
    return true;
  }

 private:
  const std::string& file_;
};

double unit_of_dae(std::string_view text, const std::string& file) {
  tinyxml2::XMLDocument document;
  const tinyxml2::XMLElement& root = parse_xml(document, text, "COLLADA", file);
  ControllerSearch controllers(file);
  root.Accept(&controllers);
  const tinyxml2::XMLElement* asset = root.FirstChildElement("asset");
  const tinyxml2::XMLElement* unit = asset != nullptr ? asset->FirstChildElement("unit") : nullptr;
  const std::string meter = unit != nullptr ? attribute(*unit, "meter") : "";
  if (meter.empty()) return 1.0;
  const auto line = line_of(*unit);
  const double unit_m = parse_number(meter, file, line, "unit", nullptr);
  if (!(unit_m > 0.0)) refuse_line(file, line, "the unit is " + shown_word(meter), "correct it");
  return unit_m;
}

double unit_of(std::span<const char> bytes, ImportFormat format, const std::string& file) {
  const std::string_view text(bytes.data(), bytes.size());
  switch (format) {
    case ImportFormat::k3mf:
      return unit_of_3mf(bytes, file);
    case ImportFormat::kDae:
      return unit_of_dae(text, file);
    default:
      return 1.0;  // glTF is in metres
  }
}

/// Affine map of a node, in double.
using Map = std::array<std::array<double, 4>, 3>;

Map product(const Map& a, const aiMatrix4x4& b) {
  const double m[4][4] = {{double(b.a1), double(b.a2), double(b.a3), double(b.a4)},
                          {double(b.b1), double(b.b2), double(b.b3), double(b.b4)},
                          {double(b.c1), double(b.c2), double(b.c3), double(b.c4)},
                          {0, 0, 0, 1}};
  Map result{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      for (std::size_t k = 0; k < 3; ++k) result[i][j] += a[i][k] * m[k][j];
      if (j == 3) result[i][j] += a[i][3];
    }
  }
  return result;
}

double determinant(const Map& m) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
         m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

/// All meshes of a scene of assimp's, with every index and count checked.
class Merge {
 public:
  Merge(const aiScene& scene, RawMesh& mesh, double scale) : scene_(scene), mesh_(mesh) {
    const Map unit{{{scale, 0, 0, 0}, {0, scale, 0, 0}, {0, 0, scale, 0}}};
    if (scene.mRootNode != nullptr) add_node(*scene.mRootNode, unit, 0);
  }

 private:
  [[noreturn]] void refuse(const std::string& defect) const {
    refuse_file(mesh_.file, defect, "export the part again, or as STL");
  }

  void add_node(const aiNode& node, const Map& above, int depth) {
    if (depth > kDeepestNode) refuse("its nodes are nested too deeply");
    const Map map = product(above, node.mTransformation);
    for (unsigned k = 0; k < node.mNumMeshes; ++k) {
      const unsigned index = node.mMeshes[k];
      if (index >= scene_.mNumMeshes) refuse("a node uses a mesh that is not there");
      add_mesh(*scene_.mMeshes[index], map);
    }
    for (unsigned k = 0; k < node.mNumChildren; ++k) {
      if (node.mChildren[k] != nullptr) add_node(*node.mChildren[k], map, depth + 1);
    }
  }

  void add_mesh(const aiMesh& part, const Map& map) {
    const double turn = determinant(map);
    if (!(std::abs(turn) > 0.0) || !std::isfinite(turn)) {
      refuse("a node flattens its mesh, or has a matrix that is not finite");
    }
    if (mesh_.vertices.size() + part.mNumVertices > kMaxMeshVertices ||
        mesh_.faces.size() + part.mNumFaces > kMaxMeshFaces) {
      refuse("it has more than " + std::to_string(kMaxMeshFaces) + " faces");
    }
    const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      const aiVector3D& from = part.mVertices[v];
      const double p[3] = {double(from.x), double(from.y), double(from.z)};
      Point3 to;
      for (std::size_t i = 0; i < 3; ++i) {
        to[i] = map[i][0] * p[0] + map[i][1] * p[1] + map[i][2] * p[2] + map[i][3];
      }
      mesh_.vertices.push_back(to);
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& from = part.mFaces[f];
      if (from.mNumIndices < 3) continue;  // a point or a line
      RawFace face;
      face.group = group_;
      for (unsigned k = 0; k < from.mNumIndices; ++k) {
        if (from.mIndices[k] >= part.mNumVertices) {
          refuse("a face uses vertex " + std::to_string(from.mIndices[k]) + " of " +
                 std::to_string(part.mNumVertices));
        }
        face.vertices.push_back(first + from.mIndices[k]);
      }
      // A mirrored mesh is turned inside out.
      if (turn < 0.0) std::ranges::reverse(face.vertices);
      mesh_.faces.push_back(std::move(face));
    }
    ++group_;
  }

  const aiScene& scene_;
  RawMesh& mesh_;
  std::uint32_t group_ = 0;
};

ImportedMesh read(std::span<const char> bytes, ImportFormat format, const std::string& file,
                  const std::filesystem::path& folder) {
  const Reader& reader = reader_of(format);
  // Where the buffers of a .gltf are.
  const std::filesystem::path below =
      format == ImportFormat::kGltf ? folder : std::filesystem::path();
  if (format == ImportFormat::kGltf || format == ImportFormat::kGlb) {
    check_gltf(bytes, format == ImportFormat::kGlb, file, below);
  }
  ImportedMesh imported;
  imported.unit_m = unit_of(bytes, format, file);
  Assimp::Importer importer;
  keep_one(importer, reader, file);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const std::string name = "part." + std::string(reader.extension);
  // The importer owns it.
  importer.SetIOHandler(new MemoryFiles(bytes, name, below));
  const aiScene* scene = importer.ReadFile(name, 0);
  if (scene == nullptr || (scene->mFlags & AI_SCENE_FLAGS_INCOMPLETE) != 0) {
    const std::string reason = importer.GetErrorString();
    refuse_file(file,
                "it is no " + std::string(reader.name) + " file that assimp reads" +
                    (reason.empty() ? "" : " (" + shown_word(reason) + ")"),
                "export the part again, or as STL");
  }
  RawMesh& mesh = imported.mesh;
  mesh.file = file;
  // COLLADA comes in metres.
  const bool is_in_metres = format == ImportFormat::kDae;
  Merge(*scene, mesh, is_in_metres ? 1.0 : imported.unit_m);
  return imported;
}

}  // namespace

bool can_import() { return true; }

ImportedMesh import_by_assimp(std::span<const char> bytes, ImportFormat format,
                              const std::string& file, const std::filesystem::path& folder) {
  check_mesh_bytes(bytes.size(), file);
  if (format == ImportFormat::kAmf) return guarded(file, [&] { return read_amf(bytes, file); });
  return guarded(file, [&] { return read(bytes, format, file, folder); });
}

}  // namespace haptic::tools
