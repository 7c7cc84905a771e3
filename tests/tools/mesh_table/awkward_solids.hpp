// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Builders of solids that the table writes in several formats.

#include <string>
#include <vector>

#include "tests/tools/mesh/mesh_builder.hpp"
#include "tests/tools/mesh_table/mesh_row.hpp"
#include "tests/tools/mesh_table/mesh_text.hpp"

namespace haptic::tools::test {

MeshBuilder box_mesh(const Point3& low, const Point3& high, bool outward = true);

/// Prism from z = 0 to z = `height` over a polygon (x, y), counter-clockwise; the caps are one
/// n-gon each, or fans around the origin.
MeshBuilder prism_mesh(const std::vector<Point3>& polygon, double height, bool fan_caps);

/// Regular points on the circle, joined in steps of `step`: 5 and 2 give the pentagram.
std::vector<Point3> star_polygon(std::size_t points, std::size_t step, double radius);
/// 2 n points at two radii in turn: n reflex edges in the prism.
std::vector<Point3> toothed_polygon(std::size_t teeth, double outer, double inner);

/// A strip of quads that closes after half a turn: open, one-sided.
MeshBuilder moebius_strip(std::uint32_t quads);
/// The Klein bottle in three dimensions, as triangles: closed, one-sided, through itself.
MeshBuilder klein_bottle();
/// 3 x 3 x 1 with a square hole of 1 x 1, quads only.
MeshBuilder square_ring();

/// Rows of the same mesh as OBJ, OFF, text STL and binary STL.
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
           const std::string& fix) {
    begin();
    for (const Written form : kAllForms) {
      rows.push_back(refused(name + ", " + form_name(form), file(form), written(mesh, form), stage,
                             place, fix));
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
