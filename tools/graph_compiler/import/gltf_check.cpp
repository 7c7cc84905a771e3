// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/gltf_check.hpp"

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>

#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

using Json = nlohmann::json;

constexpr const char* kExportGltf = "export the part again, or as STL";

/// The text of a .gltf, or the first chunk of a .glb.
std::string_view gltf_json(std::span<const char> bytes, bool is_glb, const std::string& file) {
  const std::string_view text(bytes.data(), bytes.size());
  if (!is_glb) return text;
  constexpr std::size_t kHeader = 12, kChunk = 8;
  if (text.size() < kHeader + kChunk || !text.starts_with("glTF") ||
      text.substr(kHeader + 4, 4) != "JSON") {
    refuse_file(file, "it is no GLB file: its header is damaged", kExportGltf);
  }
  std::uint32_t size = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    size |= static_cast<std::uint32_t>(static_cast<unsigned char>(text[kHeader + k])) << (8 * k);
  }
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

void check_gltf(std::span<const char> bytes, bool is_glb, const std::string& file,
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
  check_extensions(root, file);
  check_corners(root, file);
  check_shapes(root, file);
  check_buffers(root, file, folder);
}

}  // namespace haptic::tools
