// SPDX-License-Identifier: Apache-2.0
#pragma once
/// "robot.urdf#LINK": how a link of a robot description is named, in scene files and on the command
/// line.

#include <filesystem>
#include <optional>
#include <string>

namespace haptic::tools {

struct LinkName {
  std::string file;
  std::optional<std::string> link;  ///< absent: there is no # in the name, or nothing behind it
};

/// Split at the last #.
LinkName split_link(const std::string& given);

/// True where the extension is that of robot descriptions, .urdf or .xacro, in any case.
bool is_description(const std::filesystem::path& path);

/// "; its links with a collision model: 'a', 'b'", or nothing where the file cannot be read.
std::string links_told(const std::filesystem::path& description);

}  // namespace haptic::tools
