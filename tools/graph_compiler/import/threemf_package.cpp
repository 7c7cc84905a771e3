// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/threemf_package.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

int digit_of(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// A name as all writers would write it: no '/' before it, lower case, without %20 and the like.
std::string key_of(std::string_view name) {
  while (name.starts_with('/') || name.starts_with('\\')) name.remove_prefix(1);
  if (name.starts_with("./")) name.remove_prefix(2);
  std::string key;
  for (std::size_t k = 0; k < name.size(); ++k) {
    char c = name[k];
    if (c == '%' && k + 2 < name.size() && digit_of(name[k + 1]) >= 0 &&
        digit_of(name[k + 2]) >= 0) {
      c = static_cast<char>(16 * digit_of(name[k + 1]) + digit_of(name[k + 2]));
      k += 2;
    }
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    key += c == '\\' ? '/' : c;
  }
  return key;
}

void collect_objects(ThreemfModel& model) {
  const tinyxml2::XMLElement* resources = model.child(*model.root, "resources");
  const auto* o = resources != nullptr ? model.child(*resources, "object") : nullptr;
  for (; o != nullptr; o = ThreemfModel::next(*o)) {
    const std::string id = attribute(*o, "id");
    if (id.empty()) {
      refuse_line(model.file, line_of(*o), "an object has no id", "export the file again");
    }
    const auto [other, is_new] = model.objects.try_emplace(id, o);
    if (is_new) continue;
    refuse_line(model.file, line_of(*o),
                "object " + shown_word(id) + " is in line " +
                    std::to_string(line_of(*other->second)) + " too",
                "give every object an id of its own");
  }
}

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

/// Extensions that the model cannot do without: those of materials, of production (parts in further
/// models) and of triangle sets change no geometry, or are read.
/// @throws InputError "file:line: defect; fix": another one is required.
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

}  // namespace

const tinyxml2::XMLElement* ThreemfModel::child(const tinyxml2::XMLElement& parent,
                                                const char* name) const {
  return parent.FirstChildElement(prefix.empty() ? name : (prefix + name).c_str());
}

const tinyxml2::XMLElement* ThreemfModel::next(const tinyxml2::XMLElement& element) {
  return element.NextSiblingElement(element.Name());
}

ThreemfPackage::ThreemfPackage(std::span<const char> bytes, const std::string& file)
    : file_(file), archive_(bytes, file), bytes_left_(2 * kMaxMeshBytes) {
  for (const ZipEntry& entry : archive_.entries()) entries_.emplace(key_of(entry.name), &entry);
}

std::optional<std::string> ThreemfPackage::part(const std::string& name) {
  const auto [begin, end] = entries_.equal_range(key_of(name));
  if (begin == end) return std::nullopt;
  if (std::next(begin) != end) {
    refuse_file(file_, "the archive holds two files " + shown_word(name),
                "delete the one that is out of date");
  }
  std::string text =
      archive_.unpacked(*begin->second, std::min<std::size_t>(kMaxMeshBytes, bytes_left_));
  bytes_left_ -= text.size();
  return text;
}

std::string ThreemfPackage::name_of_first() {
  constexpr const char* kRelations = "_rels/.rels";
  constexpr const char* kUsual = "3D/3dmodel.model";
  if (const auto text = part(kRelations)) {
    const std::string file = file_ + ": " + kRelations;
    tinyxml2::XMLDocument document;
    const tinyxml2::XMLElement& root = parse_xml(document, *text, "Relationships", file);
    std::optional<std::string> named;
    for (const auto* r = root.FirstChildElement(); r != nullptr; r = r->NextSiblingElement()) {
      if (!attribute(*r, "Type").ends_with("/3dmodel")) continue;
      const std::string target = attribute(*r, "Target");
      if (named && key_of(*named) != key_of(target)) {
        refuse_line(file, line_of(*r),
                    "two models are named as the root of the archive, " + shown_word(*named) +
                        " and " + shown_word(target),
                    "leave the line of one of them, or export the file again");
      }
      if (!named) named = target;
    }
    if (named) return *named;
  }
  if (entries_.contains(key_of(kUsual))) return kUsual;
  refuse_file(file_,
              std::string("it holds no 3MF model: neither does ") + kRelations +
                  " name one, nor is there a " + kUsual,
              "export the file again");
}

const ThreemfModel& ThreemfPackage::first() {
  if (first_.empty()) first_ = name_of_first();
  return model(first_);
}

const ThreemfModel* ThreemfPackage::known(const std::string& name) const {
  const auto found = models_.find(key_of(name));
  return found != models_.end() ? &found->second : nullptr;
}

const ThreemfModel& ThreemfPackage::model(const std::string& name) {
  const std::string key = key_of(name);
  if (const auto found = models_.find(key); found != models_.end()) return found->second;
  const std::optional<std::string> text = part(name);
  if (!text) {
    refuse_file(file_, "the archive holds no model " + shown_word(name) + ", which it names",
                "export the file again");
  }
  ThreemfModel model;
  model.file = models_.empty() ? file_ : file_ + ": " + shown_word(name);
  model.document = std::make_unique<tinyxml2::XMLDocument>();
  model.root = &parse_xml(*model.document, *text, "model", model.file);
  const std::string_view root = model.root->Name();
  model.prefix = root.substr(0, root.find(':') == std::string_view::npos ? 0 : root.find(':') + 1);
  check_extensions(*model.root, model.file);
  collect_objects(model);
  return models_.emplace(key, std::move(model)).first->second;
}

}  // namespace haptic::tools
