// SPDX-License-Identifier: Apache-2.0
// How a run of `run_device run` ends: by a signal, and when a servo process is killed.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <linux/capability.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <thread>

#include "tests/support/signal_process.hpp"
#include "tests/tools/run_device/running_program.hpp"

using haptic::sim::test::text_of_file;
using haptic::test::child_named;
using haptic::test::signal_process;
using namespace haptic::tools::test;
using nlohmann::json;

namespace {

bool presses(const json& status) {
  return status["kind"] == "status" && status["arming"] == "armed" && status["force_n"] > 1.5;
}

std::string status_of(pid_t pid, const std::string& key) {
  std::ifstream stream("/proc/" + std::to_string(pid) + "/status");
  std::string word, value;
  while (stream >> word) {
    if (word == key && stream >> value) return value;
  }
  return "";
}

constexpr const char* kDescriptorsHidden =
    "skipped: not root, who alone sees what files a process holds that refuses attachment";

/// What its descriptors stand for, by number. None: it refuses attachment, and this user is not
/// root.
std::optional<std::map<std::string, std::string>> descriptors_of(pid_t pid) {
  std::map<std::string, std::string> found;
  std::error_code error;
  const std::filesystem::path folder = "/proc/" + std::to_string(pid) + "/fd";
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
    found[entry.path().filename()] = std::filesystem::read_symlink(entry.path(), error);
  if (error == std::errc::permission_denied && geteuid() != 0) return std::nullopt;
  return found;
}

/// A thread of a program and its processes: where it is, and how it is scheduled.
struct ThreadOf {
  std::string process, policy;
  long priority = 0;
  auto operator<=>(const ThreadOf&) const = default;
};

/// How a thread is scheduled, by /proc/PID/task/TID/stat.
ThreadOf thread_in(const std::filesystem::path& task, const std::string& process) {
  std::string stat;
  std::getline(std::ifstream(task / "stat"), stat);
  // The name may hold anything; behind its last parenthesis come the fields from the third on.
  std::istringstream fields(stat.substr(stat.rfind(')') + 1));
  std::vector<std::string> words{"", "", ""};
  for (std::string word; fields >> word;) words.push_back(word);
  constexpr std::size_t kPriority = 40, kPolicy = 41;
  if (words.size() <= kPolicy) return {process, "gone", 0};
  static const std::map<std::string, std::string> kPolicies = {
      {"0", "other"}, {"1", "fifo"}, {"2", "rr"}, {"3", "batch"}, {"5", "idle"}, {"6", "deadline"}};
  return {process, kPolicies.at(words[kPolicy]), std::stol(words[kPriority])};
}

/// All threads of a program and of the processes that it has forked, in order.
std::vector<ThreadOf> threads_of(pid_t program) {
  std::vector<ThreadOf> threads;
  std::vector<pid_t> processes{program};
  for (std::size_t k = 0; k < processes.size(); ++k) {
    const std::filesystem::path folder = "/proc/" + std::to_string(processes[k]);
    std::string name;
    std::getline(std::ifstream(folder / "comm"), name);
    std::error_code ended;
    for (const auto& task : std::filesystem::directory_iterator(folder / "task", ended)) {
      threads.push_back(thread_in(task.path(), name));
      std::ifstream children(task.path() / "children");
      for (pid_t child = 0; children >> child;) processes.push_back(child);
    }
  }
  std::ranges::sort(threads);
  return threads;
}

}  // namespace

TEST_SUITE("tools.run_device.end") {
  TEST_CASE("SIGINT and SIGTERM while the hand presses: ramp to zero, exit 0") {
    const Bench bench;
    for (const int signal : {SIGINT, SIGTERM}) {
      CAPTURE(signal);
      const Ended ended =
          run_until(bench, presses, [signal](pid_t pid) { signal_process(pid, signal); });
      CHECK(ended.exit_code == 0);
      REQUIRE_FALSE(ended.lines.empty());
      const json& summary = ended.lines.back();
      REQUIRE(summary["kind"] == "summary");
      CHECK(summary["largest_force_n"] > 1.5);
      const json& ending = summary["ending"];
      CAPTURE(ending.dump());
      CHECK(ending["outputs"] >= 1);
      CHECK(ending["jumps"] == 0);
      CHECK(ending["last_force_n"] == 0.0);
      CHECK(ending["last_torque_nm"] == 0.0);
      // The device can tell an end from a host that died; on a busy machine it may have been late.
      if (summary["peer"]["watchdog_cuts"] == 0) CHECK(summary["peer"]["released"] == 1);
    }
  }

  TEST_CASE("signals that go on while it ends cost it neither its report nor its exit code") {
    const Bench bench;
    const Ended ended = run_until(bench, presses, [](pid_t pid) {
      for (int k = 0; k < 400; ++k) {
        signal_process(pid, k % 2 == 0 ? SIGINT : SIGTERM);
        std::this_thread::sleep_for(std::chrono::microseconds(500));
      }
    });
    CHECK(ended.exit_code == 0);
    REQUIRE_FALSE(ended.lines.empty());
    CHECK(ended.lines.back()["kind"] == "summary");
    CHECK(ended.lines.back()["ending"]["last_force_n"] == 0.0);
  }

  TEST_CASE("a key on the terminal while the hand presses: zero, latched, and the run goes on") {
    const Bench bench;
    const int user = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    REQUIRE(user >= 0);
    REQUIRE(grantpt(user) == 0);
    REQUIRE(unlockpt(user) == 0);
    RunningProgram program(bench, nullptr, ptsname(user));
    const auto says = [&program](const std::function<bool(const json&)>& asked) {
      return comes_true(std::chrono::seconds(55), [&] {
        const std::vector<json> lines = program.lines();
        return program.has_ended() || (!lines.empty() && asked(lines.back()));
      });
    };
    REQUIRE(says(presses));
    REQUIRE_FALSE(program.has_ended());
    REQUIRE(::write(user, "e", 1) == 1);
    CHECK(says([](const json& status) {
      if (status["kind"] != "status") return false;  // an event
      const std::string faults = status["safety_faults"];
      return status["force_n"] == 0.0 && faults.find("emergency stop") != std::string::npos;
    }));
    // The scripted hand lets go and presses again.
    CHECK(says(presses));
    CHECK_FALSE(program.has_ended());
    signal_process(program.pid(), SIGINT);
    REQUIRE(comes_true(std::chrono::seconds(90), [&] { return program.has_ended(); }));
    CHECK(program.ended().exit_code == 0);
    ::close(user);
  }

  TEST_CASE("watched: the same threads, and a process more, all of whose threads are idle ones") {
    const Bench bench;
    std::vector<ThreadOf> threads[2];
    std::optional<std::map<std::string, std::string>> descriptors[2];
    for (const bool is_watched : {false, true}) {
      CAPTURE(is_watched);
      RunningProgram program(bench, nullptr, nullptr, is_watched);
      REQUIRE(comes_true(std::chrono::seconds(55), [&] {
        const std::vector<json> lines = program.lines();
        return program.has_ended() || (!lines.empty() && presses(lines.back()));
      }));
      REQUIRE_FALSE(program.has_ended());
      threads[is_watched] = threads_of(program.pid());
      descriptors[is_watched] = descriptors_of(child_named(program.pid(), "haptic-servo"));
      signal_process(program.pid(), SIGINT);
      REQUIRE(comes_true(std::chrono::seconds(90), [&] { return program.has_ended(); }));
      CHECK(program.ended().exit_code == 0);
    }
    std::vector<ThreadOf> more, fewer;
    std::ranges::set_difference(threads[1], threads[0], std::back_inserter(more));
    std::ranges::set_difference(threads[0], threads[1], std::back_inserter(fewer));
    CHECK(fewer.empty());
    REQUIRE_FALSE(more.empty());
    for (const ThreadOf& thread : more) {
      CAPTURE(thread.process);
      CHECK(thread.process == "haptic-watcher");
      CHECK(thread.policy == "idle");
      CHECK(thread.priority == 0);
    }
    if (!descriptors[0] || !descriptors[1]) {
      MESSAGE(kDescriptorsHidden);
      return;
    }
    // The servo process has nothing in its hands that it had not before.
    CHECK(descriptors[1]->size() == descriptors[0]->size());
  }

  TEST_CASE("a killed servo process: reported, written down, and a spare goes on until the end") {
    const Bench bench;
    write(bench.config,
          std::string(kHead) + kWorkspace + "[recorder]\ncrash_file = \"crash.csv\"\n");
    const Ended ended = run_until(bench, presses, [](pid_t pid) {
      kill_servo_of(pid);
      std::this_thread::sleep_for(std::chrono::seconds(2));  // of the spare at work
      signal_process(pid, SIGINT);
    });
    CHECK(ended.exit_code == 1);
    CHECK(ended.err.find("killed by signal 9") != std::string::npos);
    REQUIRE_FALSE(ended.lines.empty());
    const json& summary = ended.lines.back();
    REQUIRE(summary["kind"] == "summary");
    CHECK(summary["servo_processes"] == 2);
    CHECK(summary["ending"]["last_force_n"] == 0.0);
    const std::string crash = text_of_file(bench.folder.file("crash.csv"));
    CHECK(crash.find("killed by signal 9") != std::string::npos);
    CHECK(std::count(crash.begin(), crash.end(), '\n') > 100);
  }

  TEST_CASE("a servo process killed on the way to --ticks: the spare does the rest") {
    const Bench bench;
    // Killed as soon as its ticks count, so that a stalled machine has time left for the spare's.
    const auto armed = [](const json& status) {
      return status["kind"] == "status" && status["arming"] == "armed";
    };
    const Ended ended = run_until(bench, armed, kill_servo_of, "2500");
    CHECK(ended.exit_code == 1);  // since one was killed
    REQUIRE_FALSE(ended.lines.empty());
    const json& summary = ended.lines.back();
    REQUIRE(summary["kind"] == "summary");
    CHECK(summary["why"] == "the ticks asked for are done");
    CHECK(summary["servo_processes"] == 2);
    CHECK(summary["ticks"] == 2500);
    CHECK(summary["wakeups"]["count"] < 2500);  // of the spare alone
    CHECK(summary["wakeups"]["count"] > 0);
  }

  TEST_CASE("rights: of the servo process and of the one with the device, what they use is left") {
    const Bench bench;
    const std::string held = bench.folder.file("held_by_the_shell");
    const int inherited = open(held.c_str(), O_CREAT | O_RDWR, 0600);
    REQUIRE(inherited >= 0);
    std::optional<std::map<std::string, std::string>> of_servo, of_device;
    std::string calls, privileges, capabilities;
    const Ended ended = run_until(bench, presses, [&](pid_t pid) {
      const pid_t servo = child_named(pid, "haptic-servo");
      of_servo = descriptors_of(servo);
      of_device = descriptors_of(pid);
      calls = status_of(servo, "Seccomp:");
      privileges = status_of(servo, "NoNewPrivs:");
      capabilities = status_of(pid, "CapEff:");
      signal_process(pid, SIGINT);
    });
    close(inherited);
    CHECK(ended.exit_code == 0);
    if (of_servo && of_device) {
      // Standard error, for a failed assertion's last words.
      CHECK(of_servo->size() == 1);
      CHECK(of_servo->count("2") == 1);
      CHECK(of_device->size() >= 3);
      for (const auto& [number, file] : *of_device) CHECK(file != held);
    } else {
      MESSAGE(kDescriptorsHidden);
    }
    constexpr unsigned long long kMayStay = 1ULL << CAP_SYS_NICE | 1ULL << CAP_IPC_LOCK;
    CHECK((std::stoull(capabilities, nullptr, 16) & ~kMayStay) == 0);
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    MESSAGE("skipped: a sanitizer is compiled in, so that the servo process is not confined");
#else
    CHECK(calls == "2");
    CHECK(privileges == "1");
#endif
  }
}
