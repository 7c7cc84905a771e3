// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Meshes that a scene is drafted from: where they are, and in which unit.

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"
#include "tools/graph_compiler/program/node_name.hpp"
#include "tools/graph_compiler/program/unit_guess.hpp"

namespace haptic::tools {

/// Along the axes of a mesh.
struct DraftBox {
  std::array<double, 3> low{}, high{};

  [[nodiscard]] double diagonal() const;
};

struct DraftMesh {
  std::filesystem::path path;
  std::shared_ptr<const RawMesh> mesh;  ///< as read
  bool has_unit = false;                ///< the file states it: the mesh is in metres
  std::optional<std::string> link{};    ///< of a robot description
  bool in_robot = false;                ///< the link stands where the joints at 0 have it
  std::optional<std::string> node{};    ///< of a mesh file
  std::string name{};                   ///< for people

  [[nodiscard]] DraftBox box() const;  ///< as the mesh
  [[nodiscard]] double diagonal() const { return box().diagonal(); }
};

/// The source of a part: a file, a node of a mesh file, or a link of a robot description. A file
/// whose name has a # is taken as the file that it is.
[[nodiscard]] NodeName draft_source(const std::filesystem::path& given);

/// @param given  as draft_source has it. @throws InputError  the mesh cannot be read, the file has
/// no such node, or is a robot description and no link is named: the message lists its links.
[[nodiscard]] DraftMesh read_draft_mesh(const std::filesystem::path& given);

/// The unit of those files that state none, from the sizes of all that go together with the first;
/// with an empty name where all state theirs.
[[nodiscard]] FileUnit unit_of(const std::vector<DraftMesh>& meshes);

}  // namespace haptic::tools
