// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/mesh_table/mesh_row.hpp"

#include <utility>

namespace haptic::tools::test {

const char* stage_name(Stage stage) {
  switch (stage) {
    case Stage::kRead:
      return "refused by read";
    case Stage::kClean:
      return "refused by clean";
    case Stage::kFlatten:
      return "refused by flatten";
    case Stage::kDecompose:
      return "refused by decompose";
    default:
      return "accepted";
  }
}

Row& Row::with_warning(std::string text) {
  warning = std::move(text);
  return *this;
}

Row& Row::with_scale(double x, double y, double z) {
  options.scale_to_m = {x, y, z};
  return *this;
}

Row& Row::moved(double relative) {
  volume_tolerance = relative;
  vertices_keep_places = false;
  return *this;
}

Row accepted(std::string name, std::string file, std::string bytes, std::size_t solids,
             std::size_t pieces, double volume_m3, std::size_t vertices) {
  Row row;
  row.name = std::move(name);
  row.file = std::move(file);
  row.bytes = std::move(bytes);
  row.solids = solids;
  row.pieces = pieces;
  row.volume_m3 = volume_m3;
  row.vertices = vertices;
  return row;
}

Row refused(std::string name, std::string file, std::string bytes, Stage stage, std::string place,
            std::string fix) {
  Row row;
  row.name = std::move(name);
  row.file = std::move(file);
  row.bytes = std::move(bytes);
  row.stage = stage;
  row.place = std::move(place);
  row.fix = std::move(fix);
  return row;
}

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos;
       at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

}  // namespace haptic::tools::test
