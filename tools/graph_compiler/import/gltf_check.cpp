// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/gltf_check.hpp"

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <vector>

#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

using Json = nlohmann::json;

constexpr const char* kExportGltf = "export the part again, or as STL";

[[noreturn]] void refuse_version(const std::string& version, const std::string& file) {
  refuse_file(file, "it is glTF of version " + version + ", and version 2 is read",
              "export the part as glTF 2, or as STL");
}

/// The text of a .gltf, or the first chunk of a .glb.
std::string_view gltf_json(std::span<const char> bytes, bool is_glb, const std::string& file) {
  const std::string_view text(bytes.data(), bytes.size());
  if (!is_glb) return text;
  constexpr std::size_t kHeader = 12, kChunk = 8;
  const auto number_at = [&](std::size_t byte) {
    std::uint32_t number = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      number |= static_cast<std::uint32_t>(static_cast<unsigned char>(text[byte + k])) << (8 * k);
    }
    return number;
  };
  const bool is_cut = text.size() < kHeader + kChunk || !text.starts_with("glTF");
  if (!is_cut && number_at(4) == 1) refuse_version("1", file);
  if (is_cut || text.substr(kHeader + 4, 4) != "JSON") {
    refuse_file(file, "it is no GLB file: its header is damaged", kExportGltf);
  }
  const std::uint32_t size = number_at(kHeader);
  if (size > text.size() - kHeader - kChunk) {
    refuse_file(file, "it is no GLB file: it ends early", kExportGltf);
  }
  return text.substr(kHeader + kChunk, size);
}

/// A member of an object; null where there is none.
const Json& member(const Json& of, const char* name) {
  static const Json kNull;
  if (!of.is_object()) return kNull;
  const auto found = of.find(name);
  return found == of.end() ? kNull : *found;
}

/// Extensions of the looks alone.
bool is_of_looks(std::string_view name) {
  constexpr std::string_view kStarts[] = {"KHR_materials_", "KHR_texture_", "EXT_texture_"};
  return std::ranges::any_of(kStarts, [&](auto start) { return name.starts_with(start); });
}

void check_version(const Json& root, const std::string& file) {
  const Json& version = member(member(root, "asset"), "version");
  if (version.is_string() && !version.get_ref<const std::string&>().starts_with("2.")) {
    refuse_version(shown_word(version.get_ref<const std::string&>()), file);
  }
  if (version.is_number() && !(version >= 2)) refuse_version(version.dump(), file);
}

void check_extensions(const Json& root, const std::string& file) {
  for (const Json& entry : member(root, "extensionsRequired")) {
    const std::string name = entry.is_string() ? entry.get<std::string>() : "";
    if (is_of_looks(name)) continue;
    refuse_file(file, "the file requires extension " + shown_word(name) + ", which is not read",
                "export it without this extension, or as STL");
  }
}

/// Without an extension corners are floats; of other numbers assimp makes other corners.
void check_corners(const Json& root, const std::string& file) {
  constexpr int kFloat = 5126;
  const Json& accessors = member(root, "accessors");
  if (!accessors.is_array()) return;
  for (const Json& mesh : member(root, "meshes")) {
    for (const Json& primitive : member(mesh, "primitives")) {
      const Json& at = member(member(primitive, "attributes"), "POSITION");
      if (!at.is_number_unsigned() || at.get<std::uint64_t>() >= accessors.size()) continue;
      const Json& kind = member(accessors[at.get<std::size_t>()], "componentType");
      if (kind != kFloat) {
        refuse_file(file,
                    "accessor " + std::to_string(at.get<std::uint64_t>()) +
                        " holds corners that are no floats",
                    "export the part without quantization, or as STL");
      }
    }
  }
}

/// assimp places a mesh by its node alone: no joints, no morphs, and one instance.
void check_shapes(const Json& root, const std::string& file) {
  const auto refuse = [&](const std::string& what, std::size_t index, const char* how) {
    refuse_file(file, what + " " + std::to_string(index) + how,
                "apply it in the program that made the file and export again, or as STL");
  };
  const auto is_morphed = [](const Json& of) {
    const Json& weights = member(of, "weights");
    return std::ranges::any_of(weights, [](const Json& w) { return w.is_number() && w != 0; });
  };
  std::size_t node_index = 0, mesh_index = 0;
  for (const Json& node : member(root, "nodes")) {
    if (!member(node, "skin").is_null()) {
      refuse("node", node_index, " bends its mesh by a skin, which is not read");
    }
    if (!member(member(node, "extensions"), "EXT_mesh_gpu_instancing").is_null()) {
      refuse("node", node_index,
             " places its mesh many times (EXT_mesh_gpu_instancing), which is not read");
    }
    if (is_morphed(node)) refuse("node", node_index, " morphs its mesh, which is not read");
    ++node_index;
  }
  for (const Json& mesh : member(root, "meshes")) {
    if (is_morphed(mesh)) refuse("mesh", mesh_index, " is morphed, which is not read");
    ++mesh_index;
  }
}

/// An entry of an array of the root; null where there is none.
const Json& entry_of(const Json& root, const char* array, const Json& index) {
  static const Json kNull;
  const Json& entries = member(root, array);
  if (!entries.is_array() || !index.is_number_unsigned()) return kNull;
  const auto at = index.get<std::uint64_t>();
  return at < entries.size() ? entries[static_cast<std::size_t>(at)] : kNull;
}

std::uint64_t triangles_of(const Json& root, const Json& mesh) {
  constexpr int kTriangles = 4, kStrip = 5, kFan = 6;
  std::uint64_t triangles = 0;
  for (const Json& primitive : member(mesh, "primitives")) {
    const Json& indices = member(primitive, "indices");
    const Json& corners = member(member(primitive, "attributes"), "POSITION");
    const Json& count =
        member(entry_of(root, "accessors", indices.is_null() ? corners : indices), "count");
    if (!count.is_number_unsigned()) continue;
    const auto n = count.get<std::uint64_t>();
    const Json& mode = member(primitive, "mode");
    if (mode.is_null() || mode == kTriangles) triangles += n / 3;
    if (mode == kStrip || mode == kFan) triangles += n < 3 ? 0 : n - 2;
  }
  return triangles;
}

/// Triangles of the meshes that the nodes of the scene name, each mesh once.
std::uint64_t triangles_of_scene(const Json& root) {
  const Json& asked = member(root, "scene");
  std::vector<const Json*> open{&entry_of(root, "scenes", asked.is_null() ? Json(0u) : asked)};
  std::set<const Json*> nodes, meshes;
  while (!open.empty()) {
    const Json& at = *open.back();
    open.pop_back();
    for (const char* below : {"nodes", "children"}) {
      for (const Json& index : member(at, below)) {
        const Json& node = entry_of(root, "nodes", index);
        if (nodes.insert(&node).second) open.push_back(&node);
      }
    }
    if (const Json& mesh = member(at, "mesh"); !mesh.is_null()) {
      meshes.insert(&entry_of(root, "meshes", mesh));
    }
  }
  std::uint64_t triangles = 0;
  for (const Json* mesh : meshes) triangles += triangles_of(root, *mesh);
  return triangles;
}

void check_buffers(const Json& root, const std::string& file, const std::filesystem::path& folder) {
  std::size_t index = 0;
  for (const Json& buffer : member(root, "buffers")) {
    const std::string what = "buffer " + std::to_string(index++);
    const Json& uri = member(buffer, "uri");
    if (!uri.is_string()) continue;
    const std::string& name = uri.get_ref<const std::string&>();
    if (name.starts_with("data:") || is_gltf_buffer(folder, name)) continue;
    refuse_file(file, what + " is " + shown_word(name) + ", and no such file may be read",
                folder.empty()
                    ? "export the part as one .glb with its buffer in it"
                    : "a buffer is a file *.bin in the folder of the .gltf or below it; put it "
                      "there, or export the part as .glb");
  }
}

}  // namespace

bool is_gltf_buffer(const std::filesystem::path& folder, const std::filesystem::path& name) {
  std::error_code error;
  if (folder.empty() || name.is_absolute() || !equals_lower(name.extension().string(), ".bin")) {
    return false;
  }
  if (std::ranges::find(name, "..") != name.end()) return false;
  return std::filesystem::is_regular_file(folder / name, error);
}

std::uint64_t check_gltf(std::span<const char> bytes, bool is_glb, const std::string& file,
                         const std::filesystem::path& folder) {
  Json root;
  try {
    root = Json::parse(gltf_json(bytes, is_glb, file));
  } catch (const Json::parse_error& error) {
    refuse_file(file,
                "it is no glTF file: its text is no JSON in UTF-8 from byte " +
                    std::to_string(error.byte) + " on",
                kExportGltf);
  }
  check_version(root, file);
  check_extensions(root, file);
  check_corners(root, file);
  check_shapes(root, file);
  check_buffers(root, file, folder);
  return triangles_of_scene(root);
}

}  // namespace haptic::tools
