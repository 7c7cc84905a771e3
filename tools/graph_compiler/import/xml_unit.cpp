// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/xml_unit.hpp"

#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {

double named_unit(const tinyxml2::XMLElement& root, std::span<const NamedUnit> known,
                  const std::string& file) {
  const std::string name = attribute(root, "unit");
  if (name.empty()) return 1e-3;
  std::string names;
  for (const NamedUnit& unit : known) {
    if (name == unit.name) return unit.unit_m;
    names += (names.empty() ? "" : ", ") + std::string(unit.name);
  }
  refuse_line(file, line_of(root), "the unit is " + shown_word(name), "the units are " + names);
}

}  // namespace haptic::tools
