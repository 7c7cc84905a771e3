// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/bridge_process.hpp"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <string_view>
#include <system_error>
#include <utility>

#include "hal/clock/servo_clock.hpp"
#include "hal/realtime/stop_signals.hpp"
#include "tools/common/error.hpp"
#include "tools/run_device/bridge_spawn.hpp"

namespace haptic::tools {
namespace {

constexpr std::size_t kLongestLine = 500;
constexpr std::string_view kOwnName = "device_bridge: ";
constexpr int kMostReads = 8;  // of a look
// An arm lets its weight go over 1 s (tools/bridges/dynamixel), and asks silent servos longer.
constexpr std::int64_t kLongestEnd_ns = 5'000'000'000, kLook_ns = 5'000'000;

std::string text_of(int error) { return std::generic_category().message(error); }

std::filesystem::path make_folder() {
  const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
  for (const char* const where : {runtime, "/tmp"}) {
    if (where == nullptr || *where == '\0') continue;
    std::string name = std::string(where) + "/haptic-bridge-XXXXXX";
    if (mkdtemp(name.data()) != nullptr) return name;
  }
  throw OsError("no folder for the socket of a bridge: " + text_of(errno));
}

}  // namespace

BridgeProcess::BridgeProcess(const BridgeCall& call, int priority)
    : call_(call), priority_(priority), program_(bridge_program()), folder_(make_folder()) {}

BridgeProcess::~BridgeProcess() {
  stop();
  std::error_code ignored;
  std::filesystem::remove(socket_path(), ignored);
  std::filesystem::remove(folder_, ignored);
}

void BridgeProcess::start() {
  if (const int error = spawn(); error != 0)
    throw OsError(program_.string() + ": " + text_of(error));
}

int BridgeProcess::spawn() {
  started_ns_ = hal::monotonic_ns();
  close_pipe();
  std::vector<std::string> words{call_.name,
                                 "--listen",
                                 socket_path(),
                                 "--parent",
                                 std::to_string(getpid()),
                                 "--priority",
                                 std::to_string(priority_)};
  words.insert(words.end(), call_.words.begin(), call_.words.end());
  const SpawnedBridge bridge = spawn_bridge(program_, std::move(words));
  pid_ = bridge.pid;
  said_ = bridge.said;
  return bridge.error;
}

std::vector<std::string> BridgeProcess::look() {
  std::vector<std::string> lines;
  hear(lines);
  std::string how;
  if (pid_ > 0 && has_ended(how)) {
    hear(lines);
    lines.push_back("the bridge has ended: " + how);
    pid_ = -1;
  }
  if (pid_ > 0 || started_ns_ == 0 || hal::monotonic_ns() < started_ns_ + kAgain_ns) return lines;
  const int error = spawn();
  lines.push_back(error == 0 ? "the bridge is started again"
                             : "the bridge cannot be started: " + text_of(error));
  return lines;
}

void BridgeProcess::hear(std::vector<std::string>& lines) {
  std::array<char, 1024> bytes;
  for (int k = 0; k < kMostReads && said_ >= 0; ++k) {
    const ssize_t size = read(said_, bytes.data(), bytes.size());
    if (size <= 0) break;
    rest_.append(bytes.data(), static_cast<std::size_t>(size));
  }
  for (std::size_t end = rest_.find('\n'); end != std::string::npos || rest_.size() > kLongestLine;
       end = rest_.find('\n')) {
    const std::size_t length = std::min({end, rest_.size(), kLongestLine});
    std::string line = rest_.substr(0, length);
    if (line.starts_with(kOwnName)) line.erase(0, kOwnName.size());
    lines.push_back(std::move(line));
    rest_.erase(0, length + (length == end ? 1 : 0));
  }
}

bool BridgeProcess::has_ended(std::string& how) {
  int status = 0;
  const pid_t ended = waitpid(pid_, &status, WNOHANG);
  if (ended == 0) return false;
  if (ended < 0) {  // its end was not kept for us
    how = text_of(errno);
    return true;
  }
  how = WIFSIGNALED(status) ? hal::signal_text(WTERMSIG(status))
                            : "exit code " + std::to_string(WEXITSTATUS(status));
  return true;
}

void BridgeProcess::stop() noexcept {
  if (pid_ > 0) {
    (void)kill(pid_, SIGTERM);
    const std::int64_t until_ns = hal::monotonic_ns() + kLongestEnd_ns;
    while (pid_ > 0) {
      if (waitpid(pid_, nullptr, WNOHANG) != 0) {
        pid_ = -1;
      } else if (hal::monotonic_ns() > until_ns) {
        (void)kill(pid_, SIGKILL);
        (void)waitpid(pid_, nullptr, 0);
        pid_ = -1;
      } else {
        (void)hal::sleep_until(hal::monotonic_ns() + kLook_ns);
      }
    }
  }
  close_pipe();
}

void BridgeProcess::close_pipe() noexcept {
  if (said_ >= 0) close(said_);
  said_ = -1;
  rest_.clear();
}

}  // namespace haptic::tools
