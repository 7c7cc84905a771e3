// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Small files of our own in the formats that are read through other libraries: the tetrahedron of
/// the origin and the unit points of the axes, 1/6 in volume, in units of the file.

#include <string>
#include <utility>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools::test {

/// How files stand in a ZIP archive: as they are, by deflate (in one block without compression), or
/// as they are with all sizes in the fields of ZIP64.
enum class Packing : unsigned char { kStored, kDeflated, kWide };

/// `root`: more attributes of the root element, such as unit="inch".
std::string tetrahedron_amf(const std::string& root = "");
/// AMF of such objects and constellations.
std::string amf_of(const std::string& items, const std::string& root = "");
/// An object with the tetrahedron as each of its volumes.
std::string amf_object(const std::string& id, int volumes = 1);
/// `asset`: what stands in the asset, such as <unit meter="0.01"/>; `node`: before the mesh in its
/// node, such as <translate>.
std::string tetrahedron_dae(const std::string& asset = "", const std::string& node = "");
/// Nodes with <instance_geometry url="#g"/>, the tetrahedron, in a scene with the id "s".
std::string dae_of_nodes(const std::string& nodes, const std::string& asset = "");
/// `build`: the items.
std::string model_of_3mf(const std::string& root = "",
                         const std::string& build = "<item objectid=\"1\"/>");
/// An object with the tetrahedron; `attributes`: more of them, such as type="support".
std::string object_of_3mf(const std::string& id, const std::string& attributes = "");
/// A model of such resources, in metres.
std::string metre_model_of_3mf(const std::string& resources, const std::string& build,
                               const std::string& root = "");
std::string archive_of_3mf(const std::string& model, Packing packing = Packing::kStored);
/// The node's keys, such as "\"scale\":[1,1,-1],"; buffer as data in the text, or `buffer`.bin.
/// `within`: a length; assimp's matrices are of single precision.
bool has_corner_at(const RawMesh& mesh, const Point3& corner, double within = 1e-12);
std::string tetrahedron_gltf(const std::string& node = "", const std::string& buffer = "");
/// Nodes with "mesh":0, the tetrahedron; `roots`: the indices of those of the scene.
std::string gltf_of_nodes(const std::string& nodes, const std::string& roots);
std::string tetrahedron_glb();
/// What the buffer of a .gltf holds.
std::string gltf_buffer();

/// The same with further files in the archive.
std::string archive_of_3mf(const std::string& model,
                           const std::vector<std::pair<std::string, std::string>>& further);

/// ZIP archive of files.
std::string zip_of(const std::vector<std::pair<std::string, std::string>>& files,
                   Packing packing = Packing::kStored);

}  // namespace haptic::tools::test
