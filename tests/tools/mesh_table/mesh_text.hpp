// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Writes a MeshBuilder as the bytes of a file, as an exporter would.

#include <array>
#include <cstdint>
#include <string>

#include "tests/tools/mesh/mesh_builder.hpp"

namespace haptic::tools::test {

/// Vertices in lines 1 to V, faces after them; `g` lines where the group changes.
std::string obj_text(const MeshBuilder& mesh);
/// OFF, counts in line 2, vertices from line 3.
std::string off_text(const MeshBuilder& mesh);
/// n-gons as fans of triangles; facet f (from 0) at line 2 + 7 f. Groups become solids.
std::string stl_text(const MeshBuilder& mesh);
/// The same triangles; triangle f at byte 84 + 50 f.
std::string stl_binary(const MeshBuilder& mesh);

/// Binary STL with a header and a count that may lie.
std::string stl_bytes(const std::string& header, std::uint32_t announced,
                      const std::vector<std::array<Point3, 3>>& triangles);
std::vector<std::array<Point3, 3>> fans_of(const MeshBuilder& mesh);

enum class Written : unsigned char { kObj, kOff, kStlText, kStlBinary };
inline constexpr Written kAllForms[] = {Written::kObj, Written::kOff, Written::kStlText,
                                        Written::kStlBinary};
std::string written(const MeshBuilder& mesh, Written form);
const char* form_name(Written form);
const char* form_extension(Written form);

}  // namespace haptic::tools::test
