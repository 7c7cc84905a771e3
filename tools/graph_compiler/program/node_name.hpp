// SPDX-License-Identifier: Apache-2.0
#pragma once
/// "robot.urdf#LINK", "gearbox.step#shaft": how a link of a robot description or a node of a mesh
/// file is named, in scene files and on the command line.

#include <filesystem>
#include <optional>
#include <string>

namespace haptic::tools {

struct NodeName {
  std::string file;
  std::optional<std::string> node;  ///< absent: there is no # in the name, or nothing behind it
};

/// Names of files and of nodes may have a # themselves. The whole is the name of a file where there
/// is one, which counts from `folder`; else the first # ends it that has the name of a file before
/// it, or else the extension of a mesh or a robot description, or else the last.
NodeName split_node(const std::filesystem::path& folder, const std::string& given);

/// True where the extension is that of a format that is read as a mesh, in any case.
bool is_mesh_file(const std::filesystem::path& path);

/// True where the extension is that of robot descriptions, .urdf or .xacro, in any case.
bool is_description(const std::filesystem::path& path);

/// "; its links with a collision model: 'a', 'b'", or nothing where the file cannot be read.
std::string links_told(const std::filesystem::path& description);

}  // namespace haptic::tools
