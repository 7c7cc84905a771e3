// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Mesh formats that are read through other libraries: glTF 2 (.gltf, .glb) and COLLADA (.dae)
/// through assimp, 3MF and AMF through tinyxml2 and zlib, STEP (.step, .stp) through Open CASCADE.
/// Optional: a build without the libraries refuses such files and names the packages.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

enum class ImportFormat : std::uint8_t { k3mf, kGltf, kGlb, kDae, kAmf, kStep };

/// How near facets are to the round faces that they stand for.
struct Deflection {
  double asked_m = 0.0;  ///< largest distance that is allowed
  double found_m = 0.0;  ///< largest at the middles of all triangles and of their edges
};

struct ImportedMesh {
  RawMesh mesh;                                ///< in metres
  double unit_m = 1.0;                         ///< of the file [m]
  std::optional<Deflection> deflection;        ///< of STEP: the largest of its products
  std::vector<Deflection> node_deflections{};  ///< of STEP: by `mesh.nodes`, 0 of one without faces
};

/// Default deflection as a share of the diagonal of the part; in an assembly, of each part.
inline constexpr double kDeflectionShare = 5e-4;

struct ImportOptions {
  std::optional<double> deflection_m{};  ///< of STEP; absent: `kDeflectionShare` of the diagonal
};

/// Format by the extension of the file name (any case); nothing where it is none of these.
std::optional<ImportFormat> import_format_of(const std::filesystem::path& path);
/// Folder that names in the file count from.
std::filesystem::path folder_of(const std::filesystem::path& path);
/// True when this build has the libraries for all formats but STEP, and for robot descriptions.
bool can_import();
/// True when this build has Open CASCADE.
bool can_import_step();

/// Reads a file with all its meshes, each at the place of every node that uses it; the parts stay
/// apart as groups, and `mesh.nodes` has their names. Lines and points are left out;
/// `mesh.warnings` says what else is. The axes are those of the file. The libraries run in a
/// process of their own with limits of time and memory, and everything that comes out of it is
/// checked, so a file that makes them crash is refused like any other.
/// @throws InputError "file: defect; fix".
ImportedMesh import_mesh(const std::filesystem::path& path, const ImportOptions& options = {});

/// The same from bytes, of the first `kMaxMeshBytes` at most. A .gltf may name buffers (.bin) below
/// `folder`; nothing else is opened.
ImportedMesh import_bytes(std::span<const char> bytes, ImportFormat format, const std::string& file,
                          const std::filesystem::path& folder, const ImportOptions& options = {});

/// In which frame the mesh of a link is.
enum class LinkFrame : std::uint8_t {
  kLink,   ///< its own
  kRobot,  ///< that of the root link, with all joints at 0
};

/// The collision model of a link of a robot description (URDF), in metres: boxes, cylinders,
/// spheres and meshes with their origins and scales. A scale with a minus sign mirrors, and the
/// faces keep their outside. How names of meshes are looked for: urdf_files.hpp; where joints have
/// a link: urdf_tree.hpp.
/// @throws InputError "file:line: defect; fix".
RawMesh link_mesh(const std::filesystem::path& urdf, const std::string& link,
                  LinkFrame frame = LinkFrame::kLink);

/// The same from text.
RawMesh link_mesh_of(const std::string& text, const std::string& file,
                     const std::filesystem::path& folder, const std::string& link,
                     LinkFrame frame = LinkFrame::kLink);

/// The collision models of all links in the frame LinkFrame::kRobot, each link a node by its name;
/// those without a model have no faces. Notes: joints whose limits leave 0 out.
/// @throws InputError "file:line: defect; fix".
RawMesh robot_mesh(const std::filesystem::path& urdf);

/// The same from text.
RawMesh robot_mesh_of(const std::string& text, const std::string& file,
                      const std::filesystem::path& folder);

/// For a message: the links of a robot description that link_mesh can read, by their names.
/// @throws InputError  the file is no robot description.
std::string collision_links(const std::filesystem::path& urdf);

}  // namespace haptic::tools
