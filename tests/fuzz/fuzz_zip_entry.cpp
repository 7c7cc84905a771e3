// SPDX-License-Identifier: Apache-2.0
/// Any bytes as the archive of a 3MF file, in this process: its model unpacked within a limit, and
/// the root of its XML, or refused with InputError.
#include <span>
#include <string>

#include "tests/fuzz/mesh_judge.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/xml_file.hpp"
#include "tools/graph_compiler/import/zip_entry.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using haptic::fuzz::require;
  constexpr std::size_t kLimit = 65536;
  try {
    const std::string text = haptic::tools::zip_entry({reinterpret_cast<const char*>(data), size},
                                                      ".model", kLimit, "fuzz");
    require(text.size() <= kLimit, "no more is unpacked than allowed");
    tinyxml2::XMLDocument document;
    const tinyxml2::XMLElement& root = haptic::tools::parse_xml(document, text, "model", "fuzz");
    require(root.GetLineNum() > 0, "the root has a line");
  } catch (const haptic::tools::InputError& error) {
    haptic::fuzz::check_refusal(error.what());
  }
  return 0;
}
