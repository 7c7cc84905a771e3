// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/bridge_spawn.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include "hal/clock/servo_clock.hpp"
#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

/// The last line of what a bridge wrote, until it ended or was told to.
std::string last_line(const SpawnedBridge& bridge) {
  const std::int64_t until_ns = hal::monotonic_ns() + kLongestProbe_ns;
  std::string text;
  std::array<char, 4096> bytes;
  while (text.size() < kMostBridgeAnswer) {
    const std::int64_t left_ms = (until_ns - hal::monotonic_ns()) / 1'000'000;
    pollfd watched{bridge.said, POLLIN, 0};
    if (left_ms <= 0 || poll(&watched, 1, static_cast<int>(left_ms)) <= 0) break;
    const ssize_t size = read(bridge.said, bytes.data(), bytes.size());
    if (size <= 0) break;
    text.append(bytes.data(), static_cast<std::size_t>(size));
  }
  while (text.ends_with('\n')) text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

}  // namespace

std::filesystem::path bridge_program() {
  std::error_code error;
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path program = own.parent_path() / "device_bridge";
  if (error || access(program.c_str(), X_OK) != 0)
    throw OsError(program.string() + ": not there, or not to be run; install it beside run_device");
  return program;
}

SpawnedBridge spawn_bridge(const std::filesystem::path& program, std::vector<std::string> words) {
  SpawnedBridge bridge;
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return {-1, -1, errno};
  (void)fcntl(ends[0], F_SETFL, O_NONBLOCK);
  words.insert(words.begin(), program.string());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);

  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  (void)posix_spawn_file_actions_init(&files);
  (void)posix_spawnattr_init(&attributes);
  (void)posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  (void)posix_spawn_file_actions_adddup2(&files, ends[1], STDOUT_FILENO);
  (void)posix_spawn_file_actions_adddup2(&files, ends[1], STDERR_FILENO);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  (void)posix_spawnattr_setsigmask(&attributes, &none);
  (void)posix_spawnattr_setsigdefault(&attributes, &all);
  (void)posix_spawnattr_setpgroup(&attributes, 0);
  (void)posix_spawnattr_setflags(
      &attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  bridge.error =
      posix_spawn(&bridge.pid, program.c_str(), &files, &attributes, pointers.data(), environ);
  (void)posix_spawnattr_destroy(&attributes);
  (void)posix_spawn_file_actions_destroy(&files);
  close(ends[1]);
  bridge.said = ends[0];
  if (bridge.error == 0) return bridge;
  close(ends[0]);
  return {-1, -1, bridge.error};
}

BridgeAnswer probe_bridge(const std::filesystem::path& program, const std::string& bridge) {
  BridgeAnswer answer;
  const SpawnedBridge spawned = spawn_bridge(program, {bridge, "--probe", "--json"});
  if (spawned.error != 0) {
    answer.why = std::generic_category().message(spawned.error);
    return answer;
  }
  const std::string line = last_line(spawned);
  (void)kill(spawned.pid, SIGKILL);  // it has answered, or does not
  int status = 0;
  (void)waitpid(spawned.pid, &status, 0);
  close(spawned.said);
  answer = read_bridge_answer(line);
  if (line.empty())
    answer.why = "the bridge has not answered within " +
                 std::to_string(kLongestProbe_ns / 1'000'000'000) + " s";
  return answer;
}

}  // namespace haptic::tools
