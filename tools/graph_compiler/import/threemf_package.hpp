// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The ZIP archive of a 3MF file (an OPC package) and the models in it.

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "tools/graph_compiler/import/xml_file.hpp"
#include "tools/graph_compiler/import/zip_entry.hpp"

namespace haptic::tools {

/// One .model of the archive.
struct ThreemfModel {
  std::string file;    ///< for messages: the file, and the model where it is not the first
  std::string prefix;  ///< of the names of 3MF's core in this model: "" or such as "c:"
  std::unique_ptr<tinyxml2::XMLDocument> document;
  const tinyxml2::XMLElement* root = nullptr;
  std::map<std::string, const tinyxml2::XMLElement*> objects;  ///< by their ids

  /// The first child with a name of the core; null where there is none.
  [[nodiscard]] const tinyxml2::XMLElement* child(const tinyxml2::XMLElement& parent,
                                                  const char* name) const;
  /// The next element beside it with the same name.
  [[nodiscard]] static const tinyxml2::XMLElement* next(const tinyxml2::XMLElement& element);
};

/// Models are read when they are asked for, and kept. Names count from the top of the archive, in
/// any case, with or without a '/' before them.
class ThreemfPackage {
 public:
  /// @param bytes, file  must outlive the package.
  ThreemfPackage(std::span<const char> bytes, const std::string& file);

  /// The model that _rels/.rels names, or 3D/3dmodel.model.
  /// @throws InputError: there is none, or what `model` refuses.
  const ThreemfModel& first();
  /// @throws InputError: no such model; no XML; two objects with one id; an extension is required
  /// that changes geometry or is unknown; it has more than `kMaxMeshBytes`, or all twice as many.
  const ThreemfModel& model(const std::string& name);
  /// The text of any part; nothing where the archive has none of this name.
  std::optional<std::string> part(const std::string& name);
  /// A model that was read; null for another.
  [[nodiscard]] const ThreemfModel* known(const std::string& name) const;
  /// Those that were read, by their names.
  [[nodiscard]] const std::map<std::string, ThreemfModel>& read() const { return models_; }

 private:
  std::string name_of_first();

  const std::string& file_;
  ZipArchive archive_;
  std::multimap<std::string, const ZipEntry*> entries_;
  std::map<std::string, ThreemfModel> models_;
  std::string first_;
  std::size_t bytes_left_;
};

}  // namespace haptic::tools
