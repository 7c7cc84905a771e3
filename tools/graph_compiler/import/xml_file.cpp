// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/xml_file.hpp"

#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {

const tinyxml2::XMLElement& parse_xml(tinyxml2::XMLDocument& document, std::string_view text,
                                      std::string_view root, const std::string& file) {
  text = checked_text({text.data(), text.size()}, file);
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
    const int line = document.ErrorLineNum();
    refuse_line(file, line > 0 ? static_cast<std::size_t>(line) : 1,
                std::string("the text is no XML (") + document.ErrorName() + ")",
                "export the file again");
  }
  const tinyxml2::XMLElement* element = document.RootElement();
  std::string_view name = element != nullptr ? element->Name() : "";
  if (const std::size_t colon = name.find(':'); colon != std::string_view::npos) {
    name.remove_prefix(colon + 1);
  }
  if (name != root) {
    refuse_line(file, element != nullptr ? line_of(*element) : 1,
                "the root element is " + shown_word(name),
                "it must be <" + std::string(root) + ">; check the extension of the file");
  }
  // XML has one root; the parser takes more, and all behind the first would be left out.
  if (const tinyxml2::XMLElement* second = element->NextSiblingElement()) {
    refuse_line(file, line_of(*second),
                "a second root element <" + std::string(second->Name()).substr(0, 40) +
                    "> stands behind the first",
                "delete one of them, or export the file again");
  }
  return *element;
}

std::size_t line_of(const tinyxml2::XMLElement& element) {
  return static_cast<std::size_t>(element.GetLineNum());
}

std::string attribute(const tinyxml2::XMLElement& element, const char* name) {
  const char* value = element.Attribute(name);
  return value != nullptr ? value : "";
}

}  // namespace haptic::tools
