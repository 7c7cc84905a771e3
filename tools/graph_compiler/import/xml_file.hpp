// SPDX-License-Identifier: Apache-2.0
#pragma once
/// XML text as a tree, with the line of every element.

#include <tinyxml2.h>

#include <string>
#include <string_view>

namespace haptic::tools {

/// Parses into `document`; the root must be `root`, with or without a prefix, and the only one.
/// @throws InputError "file:line: the text is no XML ..."; the text is UTF-16, or binary.
const tinyxml2::XMLElement& parse_xml(tinyxml2::XMLDocument& document, std::string_view text,
                                      std::string_view root, const std::string& file);

/// Where an element begins: the number of its line.
std::size_t line_of(const tinyxml2::XMLElement& element);

/// An attribute, empty where it is absent.
std::string attribute(const tinyxml2::XMLElement& element, const char* name);

}  // namespace haptic::tools
