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
#include <memory>
#include <set>
#include <vector>

#include "tools/common/files.hpp"
#include "tools/graph_compiler/import/affine_map.hpp"
#include "tools/graph_compiler/import/amf_reader.hpp"
#include "tools/graph_compiler/import/collada_text.hpp"
#include "tools/graph_compiler/import/gltf_check.hpp"
#include "tools/graph_compiler/import/guarded_import.hpp"
#include "tools/graph_compiler/import/import_readers.hpp"
#include "tools/graph_compiler/import/threemf_reader.hpp"
#include "tools/graph_compiler/mesh/mesh_nodes.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

constexpr int kDeepestNode = 200;
/// Begin of the names that assimp makes for COLLADA's nodes without one.
constexpr std::string_view kMadeName = "$ColladaAutoName$";

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
  static constexpr Reader kGltf{"glTF", "glTF2 Importer", "gltf"};
  static constexpr Reader kGlb{"GLB", "glTF2 Importer", "glb"};
  static constexpr Reader kCollada{"COLLADA", "Collada Importer", "dae"};
  if (format == ImportFormat::kDae) return kCollada;
  return format == ImportFormat::kGltf ? kGltf : kGlb;
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

/// Affine map of a node, in double.
AffineMap map_of(const aiMatrix4x4& m) {
  return {{{double(m.a1), double(m.a2), double(m.a3), double(m.a4)},
           {double(m.b1), double(m.b2), double(m.b3), double(m.b4)},
           {double(m.c1), double(m.c2), double(m.c3), double(m.c4)}}};
}

/// All meshes of a scene of assimp's, with every index and count checked.
class Merge {
 public:
  /// @param made_root  assimp's node above several roots of the file, which has none itself.
  Merge(const aiScene& scene, std::string_view made_root, RawMesh& mesh)
      : scene_(scene), mesh_(mesh) {
    const aiNode* root = scene.mRootNode;
    if (root == nullptr) return;
    if (root->mName.C_Str() == made_root && root->mNumMeshes == 0 && root->mNumChildren > 1) {
      add_children(*root, map_of(root->mTransformation), MeshNode::kNone, 0);
    } else {
      add_node(*root, kNoMove, MeshNode::kNone, 0);
    }
  }

  /// Faces of the meshes that nodes use, each mesh once.
  [[nodiscard]] std::size_t read_faces() const { return read_faces_; }

 private:
  [[noreturn]] void refuse(const std::string& defect) const {
    refuse_file(mesh_.file, defect, "export the part again, or as STL");
  }

  void add_node(const aiNode& node, const AffineMap& above, std::uint32_t parent, int depth) {
    if (depth > kDeepestNode) refuse("its nodes are nested too deeply");
    if (mesh_.nodes.size() == kMaxMeshNodes) {
      refuse("it has more than " + std::to_string(kMaxMeshNodes) + " nodes");
    }
    const auto own = static_cast<std::uint32_t>(mesh_.nodes.size());
    std::string_view name(node.mName.data, node.mName.length);
    if (name.starts_with(kMadeName)) name = {};
    mesh_.nodes.push_back({tidy_name(name, "node"), parent, node.mNumMeshes > 0});
    const AffineMap map = product(above, map_of(node.mTransformation));
    for (unsigned k = 0; k < node.mNumMeshes; ++k) {
      const unsigned index = node.mMeshes[k];
      if (index >= scene_.mNumMeshes) refuse("a node uses a mesh that is not there");
      mesh_.group_nodes.push_back(own);
      const std::size_t before = mesh_.faces.size();
      add_mesh(*scene_.mMeshes[index], map);
      if (used_.insert(index).second) read_faces_ += mesh_.faces.size() - before;
    }
    add_children(node, map, own, depth);
  }

  void add_children(const aiNode& node, const AffineMap& map, std::uint32_t own, int depth) {
    for (unsigned k = 0; k < node.mNumChildren; ++k) {
      if (node.mChildren[k] != nullptr) add_node(*node.mChildren[k], map, own, depth + 1);
    }
  }

  void add_mesh(const aiMesh& part, const AffineMap& map) {
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
      mesh_.vertices.push_back(mapped(map, {double(from.x), double(from.y), double(from.z)}));
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
  std::set<unsigned> used_;
  std::size_t read_faces_ = 0;
  std::uint32_t group_ = 0;
};

ImportedMesh read(std::span<const char> bytes, ImportFormat format, const std::string& file,
                  const std::filesystem::path& folder) {
  const Reader& reader = reader_of(format);
  // Where the buffers of a .gltf are.
  const std::filesystem::path below =
      format == ImportFormat::kGltf ? folder : std::filesystem::path();
  std::uint64_t stated = 0;
  if (format == ImportFormat::kGltf || format == ImportFormat::kGlb) {
    stated = check_gltf(bytes, format == ImportFormat::kGlb, file, below);
  }
  ImportedMesh imported;
  // glTF is in metres.
  ColladaText collada;
  if (format == ImportFormat::kDae) {
    collada = collada_text({bytes.data(), bytes.size()}, file);
    imported.unit_m = collada.unit_m;
    imported.mesh.warnings = std::move(collada.warnings);
    if (!collada.changed.empty()) bytes = collada.changed;
  }
  Assimp::Importer importer;
  keep_one(importer, reader, file);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  // Nodes by their names, not by their ids.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_USE_COLLADA_NAMES, true);
  const std::string name = "part." + std::string(reader.extension);
  // The importer owns it.
  importer.SetIOHandler(new MemoryFiles(bytes, name, below));
  const aiScene* scene = importer.ReadFile(name, 0);
  if (scene == nullptr || (scene->mFlags & AI_SCENE_FLAGS_INCOMPLETE) != 0) {
    // A scene that it calls incomplete has no mesh; it may make one from the nodes.
    if (scene != nullptr) {
      refuse_file(file, "no node of it has a mesh with faces", "export the part with its mesh");
    }
    const std::string reason = importer.GetErrorString();
    refuse_file(file,
                "it is no " + std::string(reader.name) + " file that assimp reads" +
                    (reason.empty() ? "" : " (" + shown_name(reason.substr(0, 200)) + ")"),
                "export the part again, or as STL");
  }
  RawMesh& mesh = imported.mesh;
  mesh.file = file;
  // COLLADA comes in metres, as glTF is.
  const Merge merge(*scene, format == ImportFormat::kDae ? "" : "ROOT", mesh);
  if (merge.read_faces() < stated) {
    refuse_file(file,
                std::to_string(stated - merge.read_faces()) + " of its " + std::to_string(stated) +
                    " triangles use vertices that are not there",
                "export the part again, or as STL");
  }
  return imported;
}

}  // namespace

bool can_import() { return true; }

ImportedMesh import_by_assimp(std::span<const char> bytes, ImportFormat format,
                              const std::string& file, const std::filesystem::path& folder) {
  check_mesh_bytes(bytes.size(), file);
  if (format == ImportFormat::kAmf) return guarded(file, [&] { return read_amf(bytes, file); });
  if (format == ImportFormat::k3mf) return guarded(file, [&] { return read_3mf(bytes, file); });
  return guarded(file, [&] { return read(bytes, format, file, folder); });
}

}  // namespace haptic::tools
