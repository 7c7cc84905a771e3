// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Work of libraries that may crash on hostile files, in a process of its own; not used outside
/// this folder and its tests.

#include <functional>
#include <string>

#include "tools/graph_compiler/import/mesh_import.hpp"

namespace haptic::tools {

/// Runs `work` in a child process (tools/common/limited_child.hpp) and hands its result over. The
/// child may use 120 s of processor time and 4 GiB more memory than this process. What comes back
/// is taken for hostile: every count, index and number is checked.
/// @throws InputError  what `work` throws; or when the child ends in another way, or its result is
/// no mesh. OsError: no process or pipe can be made.
ImportedMesh guarded(const std::string& file, const std::function<ImportedMesh()>& work);

/// The child's message for a mesh, and the mesh that such bytes hold.
/// @throws InputError "file: defect; fix": any bytes that are no mesh.
std::string message_of(const ImportedMesh& imported);
ImportedMesh mesh_of_message(const std::string& message, const std::string& file);

}  // namespace haptic::tools
