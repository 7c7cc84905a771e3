// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The links of a robot description (URDF) and where its joints have them: for collision models
/// here, and for the arms of tools/bridges. Needs tinyxml2.

#include <tinyxml2.h>

#include <array>
#include <string>
#include <vector>

#include "tools/graph_compiler/import/fixed_axes.hpp"
#include "tools/graph_compiler/import/xml_file.hpp"
#include "tools/graph_compiler/mesh/surface.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {

/// An attribute of `kCount` numbers. @throws InputError "file:line: NAME of <ELEMENT> is ..".
template <std::size_t kCount>
std::array<double, kCount> attribute_numbers(const std::string& file,
                                             const tinyxml2::XMLElement& at, const char* name) {
  const std::string text = attribute(at, name);
  const auto line = line_of(at);
  LineScanner scanner(text, {.comments = false});
  std::vector<std::string_view> words, all;
  while (scanner.next(words)) all.insert(all.end(), words.begin(), words.end());
  if (all.size() != kCount) {
    refuse_line(file, line, std::string(name) + " of <" + at.Name() + "> is " + shown_word(text),
                "give " + std::to_string(kCount) + (kCount == 1 ? " number" : " numbers"));
  }
  std::array<double, kCount> result{};
  for (std::size_t k = 0; k < kCount; ++k) {
    result[k] = parse_number(all[k], file, line, name, nullptr);
  }
  return result;
}

/// A frame in another: `turn` maps its vectors there, `origin` is where it stands [m].
struct Placing {
  Turn turn{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Point3 origin{0, 0, 0};

  [[nodiscard]] Point3 of(const Point3& p) const;
  [[nodiscard]] Placing of(const Placing& inner) const;
};

/// That of an <origin> below `element`; the identity where there is none.
Placing origin_below(const tinyxml2::XMLElement& element, const std::string& file);

struct PlacedLink {
  std::string name;  ///< without blanks around it
  const tinyxml2::XMLElement* element = nullptr;
  Placing in_root{};  ///< its frame in that of the root link, all joints at 0
  const tinyxml2::XMLElement* joint = nullptr;  ///< above it; null: it is the root
  std::size_t parent = 0;                       ///< index of the link above that joint
};

/// All links, in the order of the file. `notes`: joints whose limits leave 0 out. Cost: n log n.
/// @throws InputError "file:line: defect; fix": two links of one name, a joint without its two
/// links or with one that is not there, a link below two joints, a circle, several roots.
std::vector<PlacedLink> links_at_zero(const tinyxml2::XMLElement& robot, const std::string& file,
                                      std::vector<std::string>& notes);

}  // namespace haptic::tools
