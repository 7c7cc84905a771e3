// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Small meshes for the tests of the cleaning, and what must hold for every cleaned surface.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "tools/graph_compiler/mesh/cleaning.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"

namespace haptic::tools::test {

/// A mesh under construction; faces are 0-based loops.
struct MeshBuilder {
  std::vector<Point3> vertices;
  std::vector<std::vector<std::uint32_t>> faces;
  std::vector<std::uint32_t> groups;  ///< per face
  std::uint32_t group = 0;

  std::uint32_t vertex(const Point3& p);
  void face(std::vector<std::uint32_t> loop);
  /// Six quads, outward (or inward), with eight vertices of its own.
  void box(const Point3& low, const Point3& high, bool outward = true);
  /// Each face gets vertices of its own, as STL does.
  void unshare();
  /// `indexed` as for OBJ; print resolution 1e-9.
  RawMesh raw(bool indexed = true) const;
};

RawMesh parse_text(std::string_view text, MeshFormat format = MeshFormat::kObj);

/// Cleans with scale 1.
Surface clean(const RawMesh& raw);
/// The message of the InputError that cleaning throws; empty if it does not.
std::string refusal(const RawMesh& raw);
std::string refusal(const RawMesh& raw, const CleaningOptions& options);
bool contains(const std::string& text, std::string_view part);

/// Enclosed volume of the surface, voids subtracted [m^3].
double volume(const Surface& surface);
/// Count of a step; npos if there is no such step.
std::size_t step_count(const Surface& surface, std::string_view name);

/// First violated promise of surface.hpp, empty if none: simple loops, two faces of opposite
/// direction of one shell at each edge, one disc of faces around each vertex, shells and solids
/// that refer to each other correctly, outer shells of positive and voids of negative volume.
std::string violation(const Surface& surface);

}  // namespace haptic::tools::test
