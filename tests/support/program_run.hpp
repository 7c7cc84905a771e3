// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Runs a program as a user would and keeps what it said.

#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace haptic::sim::test {

/// A folder of its own, removed at the end.
class ScratchFolder {
 public:
  explicit ScratchFolder(const std::string& name)
      : path_(std::filesystem::temp_directory_path() /
              ("haptic_" + name + "_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

inline std::string text_of_file(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

struct ProgramResult {
  int exit_code = -1;
  std::string out, err;
};

/// `arguments` as typed in a shell.
inline ProgramResult run_program(const std::string& program, const std::string& arguments) {
  const ScratchFolder folder("run");
  const std::string command = "'" + program + "' " + arguments + " >'" + folder.file("out") +
                              "' 2>'" + folder.file("err") + "'";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of_file(folder.file("out")),
          text_of_file(folder.file("err"))};
}

}  // namespace haptic::sim::test
