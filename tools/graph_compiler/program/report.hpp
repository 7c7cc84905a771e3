// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Account of a compilation: for people (stdout) and for programs (--report).

#include <string>
#include <vector>

#include "tools/graph_compiler/program/compile_scene.hpp"

namespace haptic::tools {

/// JSON. Everything but the key `timing` is the same on every run, machine and working directory.
std::string report_as_json(const CompiledScene& compiled);

/// Everything, for people.
std::string report_as_text(const CompiledScene& compiled);

/// Summary for a first reader, in ten lines: the first two parts and how they are compiled, pairs
/// of pieces, budget of a tick, stiffness, memory, how many warnings and the first note, the file
/// that was written, and last the certificate, or the warning that a list of the tick can overflow.
std::string summary_as_text(const CompiledScene& compiled, const std::string& output);

/// Why the scene cannot be certified, one sentence each; empty when it can.
std::vector<std::string> unproven_of(const CompiledScene& compiled);

/// Where epsilon, the width of the near set, is larger than the features of a part: the search
/// stays exact, but has to look at far more. At most two sentences per part, about its worst piece:
/// a face narrower than epsilon across an edge, a vertex that stands less than epsilon over its
/// neighbors. Empty in the ordinary case.
std::vector<std::string> epsilon_warnings(const CompiledScene& compiled);

/// Those of the scene file, "mesh: warning" of all parts, and what the compiler itself has to warn
/// of: epsilon where near sets are formed, and last, why the scene cannot be certified.
std::vector<std::string> warnings_of(const CompiledScene& compiled);

}  // namespace haptic::tools
