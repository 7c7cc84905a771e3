// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The mesh while it is being cleaned: shared by the cleaning steps, not used outside this folder.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

struct WorkFace {
  std::vector<std::uint32_t> loop;  ///< indices into WorkMesh::points
  std::uint32_t source_face = 0;
  std::uint32_t part = 0;  ///< faces of different parts share no point (see weld.hpp)
};

struct WorkMesh {
  std::string file;
  const RawMesh* raw = nullptr;
  Point3 centre_m{0, 0, 0};
  double diagonal_m = 0.0;
  double tolerance_m = 0.0;  ///< `tol` of METHOD section 3
  std::optional<PrintedPlanes> printed;
  double taken_as_exact_m = 0.0;  ///< as of Surface
  std::vector<Point3> points;     ///< local [m]
  std::vector<std::uint32_t> source_vertex;
  std::vector<WorkFace> faces;
  std::vector<CleaningStep> steps;
  std::vector<std::string> warnings;
  std::vector<CloseFaces> close_faces;
};

/// "(x, y, z) m" in the scaled file frame.
std::string place_text(const WorkMesh& mesh, const Point3& local);
/// "face 12 (line 41)" or "face 12 (byte 684)": 1-based number and place in the file.
std::string face_text(const WorkMesh& mesh, std::uint32_t source_face);
/// A length for a message: "2.1e-03 m".
std::string length_text(double length_m);
/// Throws InputError "file: defect; fix".
[[noreturn]] void refuse_mesh(const WorkMesh& mesh, const std::string& defect,
                              const std::string& fix);

}  // namespace haptic::tools
