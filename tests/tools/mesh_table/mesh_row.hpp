// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One row of the table of broken and awkward meshes: what goes in, and what must come out. The
/// outcome is written down with the row, not taken from a run.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "tests/tools/mesh/mesh_builder.hpp"

namespace haptic::tools::test {

/// How far a mesh gets along read_mesh -> clean_surface -> flatten -> decompose -> to_body.
enum class Stage : unsigned char { kRead, kClean, kFlatten, kDecompose, kAccepted };
const char* stage_name(Stage stage);

struct Row {
  std::string name;  ///< unique
  std::string file;  ///< name of the file, with its extension
  std::string bytes;
  enum class Source : unsigned char { kFile, kFolder, kMissing } source = Source::kFile;
  CleaningOptions options;

  Stage stage = Stage::kAccepted;
  // Refused at `stage`: parts of the message.
  std::string place;  ///< "file.obj:7:", "byte 84", "(0.5, 0.5, 1) m", "face 3 (line 11)"
  std::string fix;
  // Accepted.
  std::size_t solids = 1, pieces = 1;
  double volume_m3 = 0.0;
  double volume_tolerance = 1e-9;    ///< relative
  std::size_t vertices = 0;          ///< places of the file found among the corners of the pieces
  bool vertices_keep_places = true;  ///< to 4 ulp; false where the repair moves some
  std::string warning;               ///< part of one warning, if one is due

  // Fluent, so that a row reads as one sentence.
  Row& with_warning(std::string text);
  Row& with_scale(double x, double y, double z);
  /// Vertices move within the tolerance of the mesh: the volume holds to `relative`.
  Row& moved(double relative);
};

Row accepted(std::string name, std::string file, std::string bytes, std::size_t solids,
             std::size_t pieces, double volume_m3, std::size_t vertices);
Row refused(std::string name, std::string file, std::string bytes, Stage stage, std::string place,
            std::string fix);

inline constexpr double kTetra_m3 = 1.0 / 6.0;  ///< of the tetrahedron of the axes

/// `text` with `to` in each place of `from`.
std::string replaced(std::string text, std::string_view from, std::string_view to);

// The table by kind of defect.
std::vector<Row> text_rows();      ///< lines, words and numbers of OBJ and OFF
std::vector<Row> stl_rows();       ///< both forms of STL
std::vector<Row> file_rows();      ///< names, extensions, folders, contents of another kind
std::vector<Row> topology_rows();  ///< open, one-sided, touching, nested: in every format
std::vector<Row> geometry_rows();  ///< bent, thin, tiny, huge, jittered: in every format

}  // namespace haptic::tools::test
