// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Scene files made for tests: of the shared real parts (read where they are, never copied), and of
/// cubes.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/program_run.hpp"

namespace haptic::test {

/// Shared parts that are solids within the compiler's limits, and those that are not.
std::vector<std::string> compilable_parts();
std::vector<std::string> refused_parts();

/// Folder of a shared part; need not exist.
std::string shared_part(const std::string& name);

nlohmann::json read_json(const std::string& path);

/// Writes scene.toml for a shared part, as solids, into `folder` from its task.json and returns its
/// path.
std::string write_part_scene(const std::string& name, const sim::test::ScratchFolder& folder);

/// Unit cube from (offset, offset, offset) as OBJ.
void write_cube(const std::string& path, double offset = 0.0);

/// So many of them in a row, each of its own, with as much room between two.
void write_cubes(const std::string& path, int count);

}  // namespace haptic::test
