// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Marks that slicers keep beside the meshes of a 3MF project: which meshes are no material
/// (modifiers, blockers, enforcers), which cut something out, and their names.

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/graph_compiler/import/threemf_package.hpp"

namespace haptic::tools {

struct SlicerMark {
  std::string kind;      ///< in words, such as "a modifier of PrusaSlicer"
  bool is_hole = false;  ///< a volume that is cut out of the others
};

/// Triangles of an object that are no part of it.
struct MarkedTriangles {
  std::size_t first = 0, last = 0;  ///< from 0, both included
  std::size_t line = 0;             ///< of the settings
  SlicerMark mark;
};

struct SlicerMarks {
  /// By the id of an object of the first model, sorted by `first`.
  std::map<std::string, std::vector<MarkedTriangles>> triangles;
  /// By the id of an object of the first model, and of the object that is a component of it.
  std::map<std::pair<std::string, std::string>, SlicerMark> components;
  /// Names by the id of an object of the first model, and of its components as above.
  std::map<std::string, std::string> names;
  std::map<std::pair<std::string, std::string>, std::string> component_names;
};

/// Reads the settings of PrusaSlicer, and of Bambu Studio and OrcaSlicer, where the archive has
/// them.
/// @throws InputError "file: settings:line: defect; fix".
SlicerMarks read_slicer_marks(ThreemfPackage& package, const std::string& file);

/// The mark that Cura keeps in the object itself.
std::optional<SlicerMark> mark_of_cura(const tinyxml2::XMLElement& object);

}  // namespace haptic::tools
