// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/threemf_extensions.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

struct Extension {
  std::string_view in_namespace;  ///< what its namespace holds, of any year
  std::string_view prefix;        ///< that its specification uses
  const char* refused;  ///< what it makes of a part; null: it is read, is of the looks, or
                        ///< is refused where a part that is placed uses it
};

// The more special ones first.
constexpr Extension kExtensions[] = {
    {"3dmanufacturing/production/alternatives/", "pa", "other models in place of the parts"},
    {"3dmanufacturing/production/", "p", nullptr},
    {"3dmanufacturing/material/", "m", nullptr},
    {"3dmanufacturing/trianglesets/", "t", nullptr},
    {"3dmanufacturing/beamlattice/", "b", nullptr},
    {"3dmanufacturing/slice/", "s", nullptr},
    {"3dmanufacturing/booleanoperations/", "bo", "parts cut by each other"},
    {"3dmanufacturing/volumetric/", "v", "fields in place of meshes"},
    {"3dmanufacturing/implicit/", "i", "functions in place of meshes"},
    {"3dmanufacturing/displacement/", "d", "triangles that a texture displaces"},
    {"3dmanufacturing/securecontent/", "sc", "parts that are encrypted"}};

const Extension* known(std::string_view prefix, std::string_view name) {
  for (const Extension& extension : kExtensions) {
    const bool is_it = name.empty() ? prefix == extension.prefix
                                    : name.find(extension.in_namespace) != std::string_view::npos;
    if (is_it) return &extension;
  }
  return nullptr;
}

}  // namespace

void check_extensions(const tinyxml2::XMLElement& model, const std::string& file) {
  const std::string required = attribute(model, "requiredextensions");
  LineScanner scanner(required, {.comments = false});
  std::vector<std::string_view> prefixes;
  while (scanner.next(prefixes)) {
    for (const std::string_view prefix : prefixes) {
      const std::string name = attribute(model, ("xmlns:" + std::string(prefix)).c_str());
      const Extension* extension = known(prefix, name);
      if (extension != nullptr && extension->refused == nullptr) continue;
      refuse_line(
          file, line_of(model),
          "the file requires extension " + shown_word(prefix) + " of 3MF (" +
              (extension != nullptr ? std::string(extension->refused)
               : name.empty()       ? "without a namespace, so that it is unknown"
                              : shown_word(name) + ", which is unknown and may change parts") +
              "), which is not read",
          "export the part as a plain mesh without this extension, or as STL");
    }
  }
}

}  // namespace haptic::tools
