// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Other programs, run to their end with their output in files, and a folder for these.

#include <cstdint>
#include <string>
#include <vector>

namespace haptic::sim {

/// Time of a program, in itself and in the system for it, and its largest memory.
struct ChildCost {
  double processor_s = 0;
  std::uint64_t peak_bytes = 0;
};

/// Runs a command, found on the PATH where it names no folder, with its two streams in files.
/// @param cost  of the command, where it is asked for.
/// @return its wait status, or -1 and errno: it cannot be started.
[[nodiscard]] int run_to_end(const std::vector<std::string>& command, const std::string& out,
                             const std::string& err, ChildCost* cost = nullptr);

/// A program of this project that lies next to the one that runs.
/// @throws tools::InputError  it is not there; the text names the target to build.
[[nodiscard]] std::string program_beside(const std::string& name);

/// All bytes of a file; empty when it cannot be read.
[[nodiscard]] std::string file_text(const std::string& path);

/// The last line with a word in it.
[[nodiscard]] std::string last_line(const std::string& text);

/// A folder of its own in the system's temporary one, removed at the end with all that it holds.
class TemporaryFolder {
 public:
  /// @throws tools::InputError  it cannot be made.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] std::string file(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

}  // namespace haptic::sim
