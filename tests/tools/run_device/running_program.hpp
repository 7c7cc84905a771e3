// SPDX-License-Identifier: Apache-2.0
#pragma once
/// `run_device run` while it runs: watched by its lines, harmed, and waited for.

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/signal_process.hpp"
#include "tests/tools/run_device/run_bench.hpp"

namespace haptic::tools::test {

struct Ended {
  int exit_code = -1;
  std::vector<nlohmann::json> lines;
  std::string err;
};

/// A file of an earlier run must not be taken for this one's.
inline std::string absent(const std::string& file) {
  std::filesystem::remove(file);
  return file;
}

/// `run` with 60 s to go, unless its ticks are done before. Killed and reaped with this object if
/// it is still there, after any failure.
class RunningProgram {
 public:
  RunningProgram(const Bench& bench, const char* ticks, const char* terminal = nullptr,
                 bool is_watched = false)
      : out_(absent(bench.folder.file("out"))),
        err_(absent(bench.folder.file("err"))),
        pid_(fork()) {
    REQUIRE(pid_ >= 0);
    if (pid_ > 0) return;
    // The first terminal that the leader of a session opens is its own.
    if (terminal != nullptr && (setsid() < 0 || open(terminal, O_RDWR) < 0)) _exit(125);
    const int out = open(out_.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
    const int err = open(err_.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
    if (dup2(out, STDOUT_FILENO) < 0 || dup2(err, STDERR_FILENO) < 0) _exit(126);
    // As a caller leaves it that does not wait for its children.
    (void)std::signal(SIGCHLD, SIG_IGN);
    // The list ends with the first null.
    execl(HAPTIC_RUN_DEVICE, "run_device", "run", bench.config.c_str(), "--json", "--status-every",
          "0.05", "--seconds", "60",
          is_watched         ? "--serve"
          : ticks != nullptr ? "--ticks"
                             : nullptr,
          is_watched ? nullptr : ticks, nullptr);
    _exit(127);
  }
  ~RunningProgram() {
    if (status_.has_value()) return;
    kill(pid_, SIGKILL);  // its servo process goes with it
    waitpid(pid_, nullptr, 0);
  }
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;

  /// The process is not reaped yet: the number is still its own.
  [[nodiscard]] pid_t pid() const { return status_.has_value() ? 0 : pid_; }
  [[nodiscard]] std::vector<nlohmann::json> lines() const {
    return lines_of(sim::test::text_of_file(out_));
  }
  [[nodiscard]] bool has_ended() {
    int status = 0;
    if (!status_.has_value() && waitpid(pid_, &status, WNOHANG) == pid_) status_ = status;
    return status_.has_value();
  }
  [[nodiscard]] Ended ended() const {
    const bool exited = status_.has_value() && WIFEXITED(*status_);
    return {exited ? WEXITSTATUS(*status_) : -1, lines(), sim::test::text_of_file(err_)};
  }

 private:
  std::string out_, err_;
  pid_t pid_;
  std::optional<int> status_;
};

/// Asks every 20 ms, for so long at the most.
inline bool comes_true(std::chrono::seconds limit, const std::function<bool()>& asked) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!asked()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

/// Runs until `enough` says so of a status; then does `harm` to the process and waits for its end.
inline Ended run_until(const Bench& bench, const std::function<bool(const nlohmann::json&)>& enough,
                       const std::function<void(pid_t)>& harm, const char* ticks = nullptr) {
  RunningProgram program(bench, ticks);
  bool met = false;
  const bool in_time = comes_true(std::chrono::seconds(55), [&] {
    const bool over = program.has_ended();
    const std::vector<nlohmann::json> lines = program.lines();
    met = !over && !lines.empty() && enough(lines.back());
    return met || over;
  });
  INFO("standard error so far: " << program.ended().err);
  REQUIRE(in_time);
  REQUIRE(met);
  harm(program.pid());
  REQUIRE(comes_true(std::chrono::seconds(90), [&] { return program.has_ended(); }));
  return program.ended();
}

inline void kill_servo_of(pid_t pid) {
  haptic::test::signal_process(haptic::test::child_named(pid, "haptic-servo"), SIGKILL);
}

}  // namespace haptic::tools::test
