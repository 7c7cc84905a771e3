// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Files that a robot description names: by paths, by file://, and by the packages of ROS and the
/// models of Gazebo. Needs tinyxml2; not used outside this folder.

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace haptic::tools {

/// Where a description stands, for messages.
struct UrdfPlace {
  std::string file;
  std::size_t line = 0;
  std::filesystem::path folder;
};

/// The file that `name` stands for. "PATH", "file://PATH" and "file:PATH" count from the folder of
/// the description; "package://NAME/PATH", "model://NAME/PATH" and "$(find NAME)/PATH" are looked
/// for as NAME/PATH in that folder and those above, and as PATH in those of them whose package.xml
/// has the name. Bytes written as %20 are tried as such, and letters of another case at last, with
/// a note.
/// @throws InputError "file:line: no mesh NAME; fix".
std::filesystem::path urdf_mesh_file(const std::string& name, const UrdfPlace& at,
                                     std::vector<std::string>& notes);

}  // namespace haptic::tools
