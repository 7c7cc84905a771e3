// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/child_run.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "tools/common/error.hpp"

namespace haptic::sim {

int run_to_end(const std::vector<std::string>& command, const std::string& out,
               const std::string& err, ChildCost* cost) {
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  constexpr int kFlags = O_WRONLY | O_CREAT | O_TRUNC;
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, out.c_str(), kFlags, 0600);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, err.c_str(), kFlags, 0600);
  pid_t child = 0;
  const int error =
      posix_spawnp(&child, arguments[0], &files, nullptr, arguments.data(), ::environ);
  posix_spawn_file_actions_destroy(&files);
  if (error != 0) {
    errno = error;
    return -1;
  }
  int status = 0;
  rusage used{};
  while (::wait4(child, &status, 0, &used) < 0) {
    if (errno != EINTR) return -1;
  }
  if (cost != nullptr) {
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    constexpr std::uint64_t kUnit = 1024;  // of ru_maxrss
    cost->processor_s = seconds(used.ru_utime) + seconds(used.ru_stime);
    cost->peak_bytes = kUnit * static_cast<std::uint64_t>(used.ru_maxrss);
  }
  return status;
}

std::string program_beside(const std::string& name) {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) throw tools::InputError("/proc/self/exe: " + error.message());
  const std::filesystem::path path = self.parent_path() / name;
  if (!std::filesystem::exists(path, error))
    throw tools::InputError(path.string() + ": is not built; build the target " + name);
  return path.string();
}

std::string file_text(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::string last_line(const std::string& text) {
  std::istringstream lines(text);
  std::string last;
  for (std::string line; std::getline(lines, line);) {
    if (line.find_first_not_of(" \t\r=") != std::string::npos) last = line;
  }
  return last;
}

TemporaryFolder::TemporaryFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "haptic_wcet_XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr)
    throw tools::InputError(name + ": the folder cannot be made: " + std::strerror(errno));
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace haptic::sim
