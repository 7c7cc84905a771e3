// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The attribute "unit" of 3MF and AMF.

#include <span>
#include <string>
#include <string_view>

#include "tools/graph_compiler/import/xml_file.hpp"

namespace haptic::tools {

struct NamedUnit {
  std::string_view name;
  double unit_m;
};

/// The unit that a root element names [m]; a millimetre where it names none.
/// @throws InputError "file:line: the unit is ...": none of `known`.
double named_unit(const tinyxml2::XMLElement& root, std::span<const NamedUnit> known,
                  const std::string& file);

}  // namespace haptic::tools
