// SPDX-License-Identifier: Apache-2.0
// The bridge before the real spacenavd, with a Magellan SpaceMouse on a pseudo-terminal for its
// device. The daemon has a /run of its own. Needs the daemon and the right to mount.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "hal/clock/servo_clock.hpp"
#include "tests/support/text_search.hpp"
#include "tools/bridges/spacenav/spacenav_device.hpp"

using namespace haptic;
using hal::BridgeRead;
using haptic::test::has;

namespace {

constexpr const char* kSpacenavd = "/usr/bin/spacenavd";
constexpr std::int64_t kDaemonMs_ns = 1'000'000;
constexpr int kNoRight = 77;

/// Facts of the Magellan's packets: spacenavd's dev_serial.c (GPL-3; facts only).
class RealSpacenavd {
 public:
  RealSpacenavd() {
    (void)mkdtemp(folder_.data());
    master_ = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0) return;
    const std::string line = ptsname(master_);
    // Held open, so that the line does not hang up; without an echo of what the daemon asks.
    slave_ = open(line.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    termios raw{};
    (void)tcgetattr(slave_, &raw);
    cfmakeraw(&raw);
    (void)tcsetattr(slave_, TCSANOW, &raw);
    const std::string configuration = folder_ + "/spnavrc", log = folder_ + "/log";
    std::ofstream(configuration) << "serial = " << line << '\n';
    pid_ = fork();
    if (pid_ == 0) {
      if (unshare(CLONE_NEWNS) != 0 ||
          mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
          mount("none", "/run", "tmpfs", 0, nullptr) != 0 || chdir("/") != 0)
        _exit(kNoRight);
      const int none = open("/dev/null", O_RDWR);
      for (const int fd : {0, 1, 2}) (void)dup2(none, fd);
      (void)execl(kSpacenavd, kSpacenavd, "-d", "-c", configuration.c_str(), "-l", log.c_str(),
                  nullptr);
      _exit(kNoRight);
    }
    is_there_ = say_who_it_is() && listens();
  }
  ~RealSpacenavd() {
    kill();
    if (slave_ >= 0) close(slave_);
    if (master_ >= 0) close(master_);
    std::error_code error;
    std::filesystem::remove_all(folder_, error);
  }
  RealSpacenavd(const RealSpacenavd&) = delete;
  RealSpacenavd& operator=(const RealSpacenavd&) = delete;

  [[nodiscard]] bool is_there() const { return is_there_; }
  [[nodiscard]] std::string path() const {
    return "/proc/" + std::to_string(pid_) + "/root/run/spnav.sock";
  }
  /// Right, up, towards the operator.
  void report(const std::array<int, 6>& axes) {
    std::string packet = "d";
    for (const int axis : axes) {
      for (const int shift : {12, 8, 4, 0}) packet += digit((axis + 0x8000) >> shift);
    }
    put(packet + "\r");
  }
  void press(int buttons) {
    put(std::string("k") + digit(buttons) + digit(buttons >> 4) + digit(buttons >> 8) + "\r");
  }
  void kill() {
    if (pid_ <= 0) return;
    (void)::kill(pid_, SIGKILL);
    (void)waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }

 private:
  /// The low half of a byte counts.
  static char digit(int value) { return static_cast<char>('@' + (value & 15)); }
  void put(const std::string& bytes) { (void)!write(master_, bytes.data(), bytes.size()); }

  /// It asks a Spaceball first, for two seconds.
  [[nodiscard]] bool say_who_it_is() {
    std::string asked;
    const std::int64_t end_ns = hal::monotonic_ns() + 4000 * kDaemonMs_ns;
    while (!has(asked, "vQ\r") && hal::monotonic_ns() < end_ns) {
      pollfd line{master_, POLLIN, 0};
      std::array<char, 64> bytes{};
      if (poll(&line, 1, 20) > 0)
        asked.append(bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(
                                       read(master_, bytes.data(), bytes.size()), 0)));
      if (waitpid(pid_, nullptr, WNOHANG) != 0) return pid_ = -1, false;
    }
    usleep(20'000);  // what comes at once it throws away
    put("v  MAGELLAN  Version 6.60\r");
    return true;
  }
  [[nodiscard]] bool listens() const {
    std::error_code error;
    for (int k = 0; k < 200; ++k, usleep(5000)) {
      if (std::filesystem::exists(path(), error)) return true;
    }
    return false;
  }

  std::string folder_ = "/tmp/spacenavd-XXXXXX";
  int master_ = -1, slave_ = -1;
  pid_t pid_ = -1;
  bool is_there_ = false;
};

/// Reads until there is an event more, for a second at most.
bool read_event(tools::SpacenavDevice& bridge, std::int64_t& now_ns, hal::BridgeSample& sample) {
  const std::uint64_t before = bridge.counts().events;
  for (int k = 0; k < 1000 && bridge.counts().events == before; ++k, usleep(1000)) {
    now_ns += kDaemonMs_ns;
    if (bridge.read(now_ns, sample) == BridgeRead::kLost) return false;
  }
  return bridge.counts().events != before;
}

}  // namespace

TEST_SUITE("bridges.real_spacenavd") {
  TEST_CASE("the real daemon: requests, motion, buttons, its end") {
    if (access(kSpacenavd, X_OK) != 0) {
      MESSAGE("skipped: no spacenavd here (apt-get install spacenavd)");
      return;
    }
    RealSpacenavd daemon;
    if (!daemon.is_there()) {
      MESSAGE("skipped: no right to give spacenavd a /run of its own");
      return;
    }
    tools::SpacenavDevice bridge({daemon.path(), 100, {}});
    std::string why;
    const bool is_open = bridge.open(why);
    CAPTURE(why);
    REQUIRE(is_open);
    CHECK(bridge.version() == 1);
    CHECK(bridge.facts().name.starts_with("Magellan SpaceMouse, spacenavd at /proc/"));
    std::int64_t now_ns = kDaemonMs_ns;
    hal::BridgeSample sample;
    daemon.report({100, 0, 0, 0, 0, 0});
    REQUIRE(read_event(bridge, now_ns, sample));
    CHECK(sample.twist_d.linear_m_per_s[0] == 0.1_r);
    daemon.report({0, 100, 0, 0, 0, 0});
    REQUIRE(read_event(bridge, now_ns, sample));
    CHECK(sample.twist_d.linear_m_per_s[0] == 0.0_r);
    CHECK(sample.twist_d.linear_m_per_s[2] == 0.1_r);
    daemon.report({0, 0, -100, 0, 0, -100});
    REQUIRE(read_event(bridge, now_ns, sample));
    CHECK(sample.twist_d.linear_m_per_s[1] == 0.1_r);
    CHECK(sample.twist_d.angular_rad_per_s[1] == 1.0_r);
    daemon.press(5);
    REQUIRE(read_event(bridge, now_ns, sample));
    for (int k = 0; k < 100 && sample.switches != 5u; ++k, usleep(1000))
      (void)bridge.read(now_ns += kDaemonMs_ns, sample);
    CHECK(sample.switches == 5u);
    daemon.press(0);
    for (int k = 0; k < 1000 && sample.switches != 0u; ++k, usleep(1000))
      (void)bridge.read(now_ns += kDaemonMs_ns, sample);
    CHECK(sample.switches == 0u);
    CHECK(bridge.counts().unknown == 0u);
    CHECK(bridge.counts().impossible == 0u);
    daemon.kill();
    CHECK(bridge.read(now_ns + kDaemonMs_ns, sample) == BridgeRead::kLost);
  }
}
