// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/urdf_files.hpp"

#include <tinyxml2.h>

#include <functional>
#include <optional>
#include <string_view>
#include <system_error>

#include "tools/common/files.hpp"
#include "tools/common/named_file.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

constexpr std::size_t kMaxPackageBytes = std::size_t{1} << 20;

/// A name of a mesh, taken apart.
struct MeshName {
  std::string package;  ///< empty: the path counts from the folder of the description
  std::string path;
};

/// Removes `start` from the front of `text`, in any case; true if it stood there.
bool take(std::string& text, std::string_view start) {
  if (!equals_lower(std::string_view(text).substr(0, start.size()), start)) return false;
  text.erase(0, start.size());
  return true;
}

/// "NAME/PATH" to its two sides; slashes before it do not count.
MeshName package_name(std::string text) {
  text.erase(0, std::min(text.find_first_not_of('/'), text.size()));
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos) return {text, {}};
  return {text.substr(0, slash), text.substr(slash + 1)};
}

MeshName taken_apart(const std::string& name) {
  std::string text = plain_name(name);
  if (take(text, "package://") || take(text, "model://")) return package_name(text);
  if (take(text, "file://localhost/")) {
    text.insert(0, "/");
  } else if (!take(text, "file://")) {
    take(text, "file:");
  }
  if (!text.starts_with("$(find ")) return {{}, text};
  text.erase(0, std::string_view("$(find ").size());
  const std::size_t close = text.find(')');
  if (close == std::string::npos) return {{}, name};
  const std::string rest = text.substr(close + 1);
  return {plain_name(text.substr(0, close)),
          rest.substr(std::min(rest.find_first_not_of('/'), rest.size()))};
}

/// With the bytes that stand as % and two hexadecimal digits.
std::string without_escapes(const std::string& text) {
  const auto digit = [](char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
  };
  std::string plain;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const int high = text[k] == '%' && k + 2 < text.size() ? digit(text[k + 1]) : -1;
    const int low = high >= 0 ? digit(text[k + 2]) : -1;
    if (low < 0 || high + low == 0) {
      plain += text[k];
      continue;
    }
    plain += static_cast<char>(16 * high + low);
    k += 2;
  }
  return plain;
}

/// True where `folder` holds the package.xml of the package `name`.
bool is_package(const std::filesystem::path& folder, const std::string& name) {
  const std::filesystem::path file = folder / "package.xml";
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return false;
  std::string text;
  try {
    text = read_text_file(file, kMaxPackageBytes, "a package of the robot description");
  } catch (const InputError&) {
    return false;  // the mesh is looked for elsewhere, and refused where it is not there
  }
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) return false;
  const tinyxml2::XMLElement* root = document.RootElement();
  const tinyxml2::XMLElement* said = root != nullptr ? root->FirstChildElement("name") : nullptr;
  return said != nullptr && said->GetText() != nullptr && plain_name(said->GetText()) == name;
}

using Finder = std::function<std::optional<std::filesystem::path>(
    const std::filesystem::path& folder, const std::string& path)>;

std::optional<std::filesystem::path> found_by(const Finder& find, const MeshName& name,
                                              const std::filesystem::path& folder) {
  if (name.package.empty()) return find(folder, name.path);
  if (name.path.empty()) return std::nullopt;
  std::error_code error;
  for (std::filesystem::path above = std::filesystem::absolute(folder, error).lexically_normal();;
       above = above.parent_path()) {
    if (const auto path = find(above, name.package + "/" + name.path)) return path;
    if (is_package(above, name.package)) {
      if (const auto path = find(above, name.path)) return path;
    }
    if (above == above.parent_path()) return std::nullopt;
  }
}

std::string fix_of(const MeshName& name, const std::string& written) {
  if (written.find("://") != std::string::npos && name.package.empty() &&
      !equals_lower(std::string_view(written).substr(0, 7), "file://")) {
    return "meshes are files here: save it, and give its path";
  }
  if (written.find("${") != std::string::npos || written.find("$(") != std::string::npos) {
    if (name.package.empty()) return "expand xacro files first: xacro FILE > robot.urdf";
  }
  if (name.package.empty()) return "the path counts from the folder of the URDF";
  return "package://NAME/PATH is looked for as NAME/PATH in the folder of the URDF and above, and "
         "as PATH in a folder there whose package.xml has the name";
}

}  // namespace

std::filesystem::path urdf_mesh_file(const std::string& name, const UrdfPlace& at,
                                     std::vector<std::string>& notes) {
  const MeshName written = taken_apart(name);
  const MeshName unescaped{without_escapes(written.package), without_escapes(written.path)};
  std::string note;
  const Finder in_any_case = [&](const std::filesystem::path& folder,
                                 const std::string& path) -> std::optional<std::filesystem::path> {
    const auto found = named_file(folder, path);
    if (!found) return std::nullopt;
    note = found->note;
    return found->path;
  };
  try {
    for (const Finder& find : {Finder(file_as_named), in_any_case}) {
      for (const MeshName& tried : {written, unescaped}) {
        if (const auto path = found_by(find, tried, at.folder)) {
          if (!note.empty()) {
            notes.push_back(at.file + ":" + std::to_string(at.line) + ": " + note);
          }
          return *path;
        }
      }
    }
  } catch (const InputError& several) {
    throw InputError(at.file + ":" + std::to_string(at.line) + ": " + several.what());
  }
  refuse_line(at.file, at.line, "no mesh " + shown_name(name), fix_of(written, name));
}

}  // namespace haptic::tools
