// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/link_name.hpp"

#include "tools/common/error.hpp"
#include "tools/common/named_file.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {

LinkName split_link(const std::string& given) {
  const std::size_t hash = given.rfind('#');
  if (hash == std::string::npos) return {given, std::nullopt};
  const std::string link = without_blanks(given.substr(hash + 1));
  if (link.empty()) return {given.substr(0, hash), std::nullopt};
  return {given.substr(0, hash), link};
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
