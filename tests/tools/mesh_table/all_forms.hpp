// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The same mesh as OBJ, OFF, text STL and binary STL.

#include <string>
#include <vector>

#include "tests/tools/mesh_table/mesh_row.hpp"
#include "tests/tools/mesh_table/mesh_text.hpp"

namespace haptic::tools::test {

class FormRows {
 public:
  /// Accepted alike in all formats; vertices at the same place count once.
  void good(const std::string& name, const MeshBuilder& mesh, std::size_t solids,
            std::size_t pieces, double volume_m3, std::size_t vertices) {
    begin();
    for (const Written form : kAllForms) {
      rows.push_back(accepted(name + ", " + form_name(form), file(form), written(mesh, form),
                              solids, pieces, volume_m3, vertices));
    }
  }
  void bad(const std::string& name, const MeshBuilder& mesh, Stage stage, const std::string& place,
           const std::string& mend) {
    begin();
    for (const Written form : kAllForms) {
      rows.push_back(refused(name + ", " + form_name(form), file(form), written(mesh, form), stage,
                             place, mend));
    }
  }
  /// The rows of the last mesh, where a format needs another outcome.
  Row& last(Written form) { return rows[first_ + static_cast<std::size_t>(form)]; }
  template <typename Change>
  void each_last(const Change& change) {
    for (const Written form : kAllForms) {
      change(last(form));
    }
  }
  std::vector<Row> rows;

 private:
  void begin() { first_ = rows.size(); }
  static std::string file(Written form) { return std::string("m") + form_extension(form); }
  std::size_t first_ = 0;
};

}  // namespace haptic::tools::test
