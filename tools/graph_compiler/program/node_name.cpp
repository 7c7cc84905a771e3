// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/node_name.hpp"

#include "tools/common/error.hpp"
#include "tools/common/named_file.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

/// Where the name of the file ends: at a #.
std::size_t end_of_file_name(const std::filesystem::path& folder, const std::string& given) {
  for (std::size_t at = given.find('#'); at != std::string::npos; at = given.find('#', at + 1)) {
    if (file_as_named(folder, given.substr(0, at))) return at;
  }
  for (std::size_t at = given.find('#'); at != std::string::npos; at = given.find('#', at + 1)) {
    const std::filesystem::path file = plain_name(given.substr(0, at));
    if (is_mesh_file(file) || is_description(file)) return at;
  }
  return given.rfind('#');
}

}  // namespace

NodeName split_node(const std::filesystem::path& folder, const std::string& given) {
  if (given.find('#') == std::string::npos || file_as_named(folder, given)) {
    return {given, std::nullopt};
  }
  const std::size_t hash = end_of_file_name(folder, given);
  const std::string node = without_blanks(given.substr(hash + 1));
  if (node.empty()) return {given.substr(0, hash), std::nullopt};
  return {given.substr(0, hash), node};
}

bool is_mesh_file(const std::filesystem::path& path) {
  return import_format_of(path).has_value() || mesh_format_named(path).has_value();
}

bool is_description(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  return equals_lower(extension, ".urdf") || equals_lower(extension, ".xacro");
}

std::string links_told(const std::filesystem::path& description) {
  try {
    return "; " + collision_links(description);
  } catch (const InputError&) {
    return {};  // what is wrong with the file is said once a link of it is named
  }
}

}  // namespace haptic::tools
