// SPDX-License-Identifier: Apache-2.0
// Sessions of the library on a device in real time behind a socket: by the library alone, with the
// run_device that a user has. Judged by what the device was handed.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "hal/clock/servo_clock.hpp"
#include "hal/realtime/shared_memory.hpp"
#include "tests/host_sim/session/session_bench.hpp"
#include "tests/support/signal_process.hpp"
#include "tests/support/text_search.hpp"
#include "tools/session/session_channel.hpp"
#include "tools/session/session_records.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;
using haptic::test::child_named;
using haptic::test::has;
using haptic::test::signal_process;

namespace {

constexpr double kMostStep_n = 4.0;      // of the slew limit in two periods
constexpr double kZeroWithin_ms = 15.0;  // after the program's death, at the device
constexpr int kBusyTries = 5;

/// A program that is to be killed, and what it says.
class Owner {
 public:
  explicit Owner(const std::vector<std::string>& arguments) {
    int ends[2];
    REQUIRE(pipe2(ends, O_CLOEXEC) == 0);
    std::vector<char*> list;
    for (const std::string& argument : arguments)
      list.push_back(const_cast<char*>(argument.c_str()));
    list.push_back(nullptr);
    pid_ = fork();
    REQUIRE(pid_ >= 0);
    if (pid_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (dup2(ends[1], STDOUT_FILENO) < 0 || dup2(ends[1], STDERR_FILENO) < 0) _exit(126);
      execv(list[0], list.data());
      _exit(127);
    }
    close(ends[1]);
    reader_ = ends[0];
    (void)fcntl(reader_, F_SETFL, O_NONBLOCK);
  }
  ~Owner() {
    kill_it();
    close(reader_);
  }
  Owner(const Owner&) = delete;
  Owner& operator=(const Owner&) = delete;

  /// Until it has said `words`.
  [[nodiscard]] bool says(const std::string& words) {
    return comes_true_within(
        [&] {
          std::array<char, 4096> bytes;
          const ssize_t size = read(reader_, bytes.data(), bytes.size());
          if (size > 0) said_.append(bytes.data(), static_cast<std::size_t>(size));
          return has(said_, words);
        },
        60'000);
  }
  [[nodiscard]] const std::string& said() const { return said_; }
  /// @return when it was killed.
  std::int64_t kill_it() {
    const std::int64_t now_ns = hal::monotonic_ns();
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      (void)waitpid(pid_, nullptr, 0);
    }
    pid_ = -1;
    return now_ns;
  }

 private:
  pid_t pid_ = -1;
  int reader_ = -1;
  std::string said_;
};

/// Killed with its force on: zero in time, by the slew limit, and it stays.
void check_killed(const std::string& name, std::vector<std::string> arguments,
                  const std::string& also_says = "") {
  CAPTURE(name);
  Ramp ramp;
  for (int tried = 0; tried < kBusyTries; ++tried) {
    SessionBench bench;
    std::vector<std::string> all = arguments;
    all.push_back(bench.file("block.rtscene"));
    all.push_back(bench.config());
    if (also_says != "") all.push_back("--fork");
    if (name == "large") all.insert(all.end(), {"--megabytes", "400"});
    Owner owner(all);
    const bool opened = owner.says("open");
    INFO(owner.said());
    REQUIRE(opened);
    if (also_says != "") CHECK(owner.says(also_says));
    REQUIRE(bench.is_held());
    if (!bench.press()) continue;
    const std::int64_t killed_ns = owner.kill_it();
    sleep_ms(300);
    ramp = ramp_since(bench.device().record(), killed_ns);
    if (ramp.to_zero_ms >= 0 && ramp.to_zero_ms <= kZeroWithin_ms) break;
    MESSAGE(name << ": zero after " << ramp.to_zero_ms << " ms, tried again");
  }
  MESSAGE(name << ": " << ramp.begin_n << " N, zero on the wire " << ramp.to_zero_ms
               << " ms after SIGKILL");
  CHECK(ramp.begin_n > kFelt_n);
  CHECK(ramp.to_zero_ms >= 0);
  CHECK(ramp.to_zero_ms <= kZeroWithin_ms);
  CHECK(ramp.largest_step_n <= kMostStep_n);
  CHECK(ramp.stays);
}

/// What the library says with another program in run_device's place.
std::string answer_to(const SessionBench& bench, const std::string& as, int& error) {
  const Setting program("HAPTIC_RUN_DEVICE", HAPTIC_OTHER_RUN_DEVICE);
  const Setting how("HAPTIC_OTHER", as);
  const OpenedSession session(bench);
  error = session.error();
  CHECK(session.get() == nullptr);
  return session.text();
}

}  // namespace

TEST_SUITE("host_sim.device_session") {
  TEST_CASE("opens, arms, presses: what is felt is in the state, and what is sent on the wire") {
    SessionBench bench;
    OpenedSession session(bench);
    INFO(session.text());
    REQUIRE(session.error() == HAPTIC_OK);
    REQUIRE(bench.is_held());
    CHECK(comes_true_within([&] { return session.state().link == 2; }));
    REQUIRE(std::string(session.device().why).empty());
    CHECK(session.device().phase == HAPTIC_DEVICE_RUNS);
    REQUIRE(bench.press());
    haptic_state state = session.state();
    CHECK(state.arming == 2);
    CHECK(state.hand_held == 1);
    CHECK(state.wrench[2] > kFelt_n);
    // A tick that is late lets the force fade for as long.
    CHECK(comes_true_within([&] {
      return std::abs(session.state().sent_wrench[2] - bench.device().handed_n()) < 0.1 &&
             std::abs(session.state().wrench[2] - bench.device().handed_n()) < 0.3;
    }));
    CHECK(state.felt_pose[2] == doctest::Approx(0.010).epsilon(0.01));
    CHECK(state.hand_pose[2] < 0.009);
    CHECK(state.situation == 5);  // face on face
    CHECK(state.time_s > 0.3);
    CHECK(comes_true_within([&] { return session.device().force_n > kFelt_n; }));
    CHECK(session.has_event("connected"));
    CHECK(session.has_event("armed"));
    CHECK(std::string(session.device().waits_for).empty());

    // What there is of a person's hand is not led.
    haptic_hand_goal goal = HAPTIC_HAND_GOAL_INIT;
    CHECK(haptic_session_move_hand(session.get(), &goal, nullptr) == HAPTIC_ERROR_DEVICE);
    CHECK(haptic_session_hold(session.get(), HAPTIC_HOLD) == HAPTIC_ERROR_DEVICE);
    CHECK(haptic_session_hold_part(session.get(), 0, 0) == HAPTIC_ERROR_PART);
    haptic_gains gains = HAPTIC_GAINS_INIT;
    CHECK(haptic_session_gains(session.get(), &gains) == HAPTIC_OK);
    CHECK(gains.stiffness_n_per_m == 400);
    haptic_state second = HAPTIC_STATE_INIT;
    CHECK(haptic_session_state_of(session.get(), 1, &second) == HAPTIC_ERROR_PART);

    std::vector<haptic_tick> ticks(20'000);
    std::size_t count = 0;
    REQUIRE(haptic_session_history(session.get(), ticks.data(), ticks.size(), sizeof ticks[0],
                                   &count) == HAPTIC_OK);
    REQUIRE(count > 200);
    ticks.resize(count);
    CHECK(std::ranges::is_sorted(ticks, {}, &haptic_tick::tick));
    CHECK(ticks.back().sent_wrench[2] > kFelt_n);
    CHECK(ticks.back().hand_pose[2] == doctest::Approx(state.hand_pose[2]).epsilon(0.1));
    CHECK(ticks.front().hand_pose[2] > 0.010);

    // A stop: zero by the slew limit, until the switch is released and pressed again.
    const std::int64_t stop_ns = hal::monotonic_ns();
    REQUIRE(haptic_session_stop(session.get()) == HAPTIC_OK);
    sleep_ms(300);
    const Ramp ramp = ramp_since(bench.device().record(), stop_ns);
    CHECK(ramp.to_zero_ms >= 0);
    CHECK(ramp.to_zero_ms < 50);
    CHECK(ramp.largest_step_n <= kMostStep_n);
    CHECK(ramp.stays);
    CHECK(comes_true_within([&] { return session.state().arming == 4; }));
    CHECK(bench.press());

    // Closed it ends at zero, with the drives off; what was can be read.
    const std::int64_t close_ns = hal::monotonic_ns();
    REQUIRE(haptic_session_close(session.get()) == HAPTIC_OK);
    CHECK(hal::monotonic_ns() - close_ns < 2000 * kMs);
    const WireRecord wire = bench.device().record();
    CHECK(ramp_since(wire, close_ns).stays);
    CHECK_FALSE(wire.commands.back().drives_on);
    state = session.state();
    CHECK(state.tick > 200);
    CHECK(state.arming == 0);
    CHECK(state.link == 0);
    CHECK(state.sent_wrench[2] == 0);
    CHECK(session.device().phase == HAPTIC_DEVICE_ENDED);
    CHECK(std::string(session.device().why) == "the session was closed");
    haptic_verdict verdict = HAPTIC_VERDICT_INIT;
    REQUIRE(haptic_session_verdict(session.get(), &verdict) == HAPTIC_OK);
    CHECK(verdict.contact_ticks > 100);
    CHECK(haptic_session_stop(session.get()) == HAPTIC_ERROR_CLOSED);
    REQUIRE(haptic_session_history(session.get(), ticks.data(), ticks.size(), sizeof ticks[0],
                                   &count) == HAPTIC_OK);
    CHECK(count > 200);
  }

  TEST_CASE("the fixed parts are moved by the program, and felt there") {
    SessionBench bench;
    OpenedSession session(bench);
    REQUIRE(session.error() == HAPTIC_OK);
    REQUIRE(bench.is_held());
    haptic_frame frame = HAPTIC_FRAME_INIT;
    frame.pose[2] = -0.003;
    frame.stands = 1;
    REQUIRE(haptic_session_frame(session.get(), &frame) == HAPTIC_OK);
    sleep_ms(100);
    REQUIRE(bench.press());
    CHECK(session.state().felt_pose[2] == doctest::Approx(0.007).epsilon(0.02));
    frame.pose[2] = std::nan("");
    CHECK(haptic_session_frame(session.get(), &frame) == HAPTIC_ERROR_POSE);
    CHECK(comes_true_within([&] { return (session.state().safety_faults & 1u << 13) != 0; }));
    CHECK(comes_true_within([&] { return bench.device().handed_n() == 0; }));
  }

  TEST_CASE("killed with its force on: a large program, and one with a child that lives on") {
    check_killed("large", {HAPTIC_SESSION_OWNER});
    check_killed("forked", {HAPTIC_SESSION_OWNER}, "child: has no session");
  }

  TEST_CASE("killed with its force on: Python") {
    if (run_program(HAPTIC_PYTHON, "-c 'import numpy'").exit_code != 0) {
      MESSAGE("skipped: no python3 with numpy");
      return;
    }
    const Setting package("PYTHONPATH", HAPTIC_PYTHON_PACKAGE);
    const Setting library("HAPTIC_LIBRARY", HAPTIC_LIBRARY_FILE);
    check_killed("python", {HAPTIC_PYTHON, HAPTIC_PYTHON_OWNER}, "child: has no session");
  }

  TEST_CASE("the processes behind a session are killed: it says so, and no call hangs") {
    SessionBench bench;
    OpenedSession session(bench);
    REQUIRE(session.error() == HAPTIC_OK);
    REQUIRE(bench.is_held());
    REQUIRE(bench.press());
    const pid_t guardian = child_named(getpid(), "run_device");
    signal_process(child_named(guardian, "haptic-servo"), SIGKILL);
    CHECK(comes_true_within([&] { return session.has_event("spare begins"); }));
    CHECK(comes_true_within([&] { return bench.device().handed_n() == 0; }));
    // The spare serves the device; the part begins where it starts once more, while the handle is
    // down.
    CHECK(session.device().phase == HAPTIC_DEVICE_RUNS);
    CHECK(comes_true_within([&] { return session.state().tick > 100; }));
    std::vector<haptic_tick> ticks(20'000);
    std::size_t count = 0;
    REQUIRE(haptic_session_history(session.get(), ticks.data(), ticks.size(), sizeof ticks[0],
                                   &count) == HAPTIC_OK);
    CHECK(count > 200);

    signal_process(guardian, SIGKILL);
    CHECK(comes_true_within([&] { return session.device().phase == HAPTIC_DEVICE_ENDED; }));
    CHECK(has(session.device().why, "without a word"));
    CHECK(session.state().link == 0);
    haptic_frame frame = HAPTIC_FRAME_INIT;
    CHECK(haptic_session_frame(session.get(), &frame) == HAPTIC_ERROR_DEVICE);
    CHECK(haptic_session_stop(session.get()) == HAPTIC_OK);
    sleep_ms(100);
    CHECK_FALSE(bench.device().record().commands.back().drives_on);
    CHECK(haptic_session_close(session.get()) == HAPTIC_OK);
  }

  TEST_CASE("refusals: each says what is wrong and how to have it otherwise") {
    SessionBench bench;
    const auto refused = [&](const std::string& config, int error, const std::string& words,
                             std::int32_t hands = 0) {
      const OpenedSession session(bench, config, hands);
      CAPTURE(session.text());
      CHECK(session.error() == error);
      CHECK(session.get() == nullptr);
      CHECK(has(session.text(), words));
    };
    refused(bench.file("nowhere.toml"), HAPTIC_ERROR_INPUT, "nowhere.toml");
    refused("falcon", HAPTIC_ERROR_DEVICE, "no device 'falcon'");
    bench.write("wrong.toml",
                "scene = \"block.rtscene\"\n[device]\ndriver = \"reference\"\nadress = \"x\"\n");
    refused(bench.file("wrong.toml"), HAPTIC_ERROR_INPUT, "wrong.toml:4");
    bench.write("hands.toml", "scene = \"block.rtscene\"\n[device]\ndriver = \"sim\"\n");
    refused(bench.file("hands.toml"), HAPTIC_ERROR_INPUT, "the session leads 2 hands", 2);

    // Another scene of the same size.
    std::vector<std::byte> other = bench.scene();
    other.back() ^= std::byte{1};
    const std::string as_text(reinterpret_cast<const char*>(other.data()), other.size());
    bench.write("other.rtscene", as_text);
    bench.write("other.toml", "scene = \"other.rtscene\"\n[device]\ndriver = \"sim\"\n");
    refused(bench.file("other.toml"), HAPTIC_ERROR_INPUT,
            "is not the one that the session was opened with");
    {
      const Setting nowhere("HAPTIC_RUN_DEVICE", "/nowhere/run_device");
      refused(bench.config(), HAPTIC_ERROR_SYSTEM, "HAPTIC_RUN_DEVICE is '/nowhere/run_device'");
    }
    haptic_session_options options = HAPTIC_SESSION_OPTIONS_INIT;
    const std::string config = bench.config();
    options.device = config.c_str();
    options.rate_hz = 1000;
    haptic_session* session = nullptr;
    char small[8];
    CHECK(haptic_session_open_text(bench.scene().data(), bench.scene().size(), &options, &session,
                                   small, sizeof small) == HAPTIC_ERROR_NUMBER);
    CHECK(std::strlen(small) == sizeof small - 1);  // cut
    // None of them has left a process, or come to the device.
    CHECK(child_named(getpid(), "run_device") == 0);
    CHECK(bench.device().hosts() == 0);
  }

  TEST_CASE("no run_device anywhere: the error names all three places") {
    SessionBench bench;
    std::filesystem::copy_file(HAPTIC_LIBRARY_FILE, bench.file("libhaptic.so.0"));
    const Setting library("LD_LIBRARY_PATH", bench.file(""));
    const Setting path("PATH", "/nowhere");
    const Setting none("HAPTIC_RUN_DEVICE", "");
    Owner owner({HAPTIC_SESSION_OWNER, bench.file("block.rtscene"), bench.config()});
    CHECK(owner.says("set HAPTIC_RUN_DEVICE\n"));
    CAPTURE(owner.said());
    CHECK(has(owner.said(), "HAPTIC_ERROR_SYSTEM: no run_device: it is not at "));
    CHECK(has(owner.said(), "bin/run_device"));
    CHECK(has(owner.said(), "HAPTIC_RUN_DEVICE is not set"));
    CHECK(has(owner.said(), "PATH does not have it"));
  }

  TEST_CASE("another program in run_device's place: refused, whichever way it answers") {
    SessionBench bench;
    int error = 0;
    for (const char* const as : {"version", "layout", "short", "garbage", "older"}) {
      CAPTURE(as);
      const std::string text = answer_to(bench, as, error);
      CAPTURE(text);
      CHECK(error == HAPTIC_ERROR_VERSION);
      CHECK(has(text, "other_run_device"));
    }
    CHECK(has(answer_to(bench, "version", error), "session record version 2 against 1"));
    for (const char* const as :
         {"devices", "processes", "range", "overflow", "unaligned", "shrinks", "descriptors"}) {
      CAPTURE(as);
      CHECK(has(answer_to(bench, as, error), "numbers or memory that cannot be"));
      CHECK(error == HAPTIC_ERROR_INTERNAL);
    }
    CHECK(has(answer_to(bench, "twice", error), "answers what no run_device answers"));
    CHECK(has(answer_to(bench, "ends", error), "exit code 7"));
    CHECK(error == HAPTIC_ERROR_DEVICE);
  }

  TEST_CASE("any bytes in what run_device writes: every read gives some value") {
    SessionBench bench;
    const Setting program("HAPTIC_RUN_DEVICE", HAPTIC_OTHER_RUN_DEVICE);
    const Setting how("HAPTIC_OTHER", "scribbles");
    OpenedSession session(bench);
    REQUIRE(session.error() == HAPTIC_OK);
    std::vector<haptic_tick> ticks(200);
    haptic_verdict verdict = HAPTIC_VERDICT_INIT;
    unsigned different = 0;
    std::uint64_t last = 0;
    for (int k = 0; k < 1'000'000 && (k < 3000 || different <= 100); ++k) {
      const haptic_state state = session.state();
      different += state.tick != last ? 1 : 0;
      last = state.tick;
      REQUIRE(state.situation <= 6);
      REQUIRE(state.arming <= 4);
      REQUIRE(state.link <= 2);
      const haptic_device_status device = session.device();
      REQUIRE(std::memchr(device.why, 0, sizeof device.why) != nullptr);
      REQUIRE(std::memchr(device.trouble, 0, sizeof device.trouble) != nullptr);
      REQUIRE(device.phase <= HAPTIC_DEVICE_ENDED);
      for (const haptic_event& event : session.events())
        REQUIRE(std::memchr(event.text, 0, sizeof event.text) != nullptr);
      REQUIRE(haptic_session_verdict(session.get(), &verdict) == HAPTIC_OK);
      REQUIRE(std::memchr(verdict.text, 0, sizeof verdict.text) != nullptr);
      std::size_t count = 0;
      if (k % 50 == 0)
        REQUIRE(haptic_session_history(session.get(), ticks.data(), ticks.size(), sizeof ticks[0],
                                       &count) == HAPTIC_OK);
    }
    CHECK(different > 100);
    CHECK(haptic_session_close(session.get()) == HAPTIC_OK);
  }

  TEST_CASE("run_device refuses a request that is none: exit code, words, no device touched") {
    SessionBench bench;
    std::mt19937_64 random(11);
    const tools::SessionAsk good = [&] {
      tools::SessionAsk ask;
      ask.scene_sha256 = tools::hash_of_scene(bench.scene());
      return ask;
    }();
    for (int form = 0; form < 9; ++form) {
      CAPTURE(form);
      int ends[2];
      REQUIRE(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) == 0);
      tools::SessionAsk ask = good;
      std::size_t size = sizeof ask, descriptors = 2;
      if (form == 0) ask.magic ^= 1;
      if (form == 1) ask.layout.version = 7;
      if (form == 2) size = 9;
      if (form == 3) descriptors = 0;
      if (form == 4) ask.history_s = std::nan("");
      if (form == 5) ask.hands = 9;
      if (form == 6) ask.scene_sha256[3] ^= 1;
      if (form == 7)
        for (std::size_t k = 0; k < sizeof ask; k += 8) {
          const std::uint64_t word = random();
          std::memcpy(reinterpret_cast<char*>(&ask) + k, &word,
                      std::min<std::size_t>(8, sizeof ask - k));
        }
      // Memory of the wrong size.
      const hal::SharedMemory down(form == 8 ? 64 : sizeof(tools::SessionDown),
                                   hal::SharedMemory::Readers::kByDescriptor);
      const tools::Descriptor self(static_cast<int>(syscall(SYS_pidfd_open, getpid(), 0)));
      const std::array<int, 2> given{down.descriptor(), self.get()};
      REQUIRE(tools::send_message(ends[0], std::as_bytes(std::span(&ask, 1)).first(size),
                                  std::span(given).first(descriptors)) == 0);
      const std::string err = bench.file("err");
      const pid_t pid = fork();
      if (pid == 0) {
        const int to = open(err.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
        if (dup2(to, STDERR_FILENO) < 0 || dup2(ends[1], 9) < 0) _exit(126);
        execl(HAPTIC_RUN_DEVICE, "run_device", "run", bench.config().c_str(), "--session", "9",
              nullptr);
        _exit(127);
      }
      close(ends[1]);
      int status = 0;
      REQUIRE(waitpid(pid, &status, 0) == pid);
      close(ends[0]);
      CHECK(WIFEXITED(status));
      CHECK(WEXITSTATUS(status) == 3);
      CHECK(text_of_file(err).size() > 20);
    }
    CHECK(bench.device().hosts() == 0);
  }
}
