// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <fcntl.h>
#include <termios.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>

#include "tools/run_device/stop_key.hpp"

using haptic::tools::StopKey;

namespace {

/// A terminal in this process; its user types at the other end.
class Terminal {
 public:
  Terminal() : user_(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    REQUIRE(user_ >= 0);
    REQUIRE(grantpt(user_) == 0);
    REQUIRE(unlockpt(user_) == 0);
    path_ = ptsname(user_);
    own_ = ::open(path_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    REQUIRE(own_ >= 0);
  }
  ~Terminal() {
    ::close(own_);
    hang_up();
  }
  void type(const std::string& keys) const {
    REQUIRE(::write(user_, keys.data(), keys.size()) == static_cast<ssize_t>(keys.size()));
  }
  void hang_up() {
    if (user_ >= 0) ::close(user_);
    user_ = -1;
  }
  [[nodiscard]] bool waits_for_lines() const {
    termios now{};
    REQUIRE(tcgetattr(own_, &now) == 0);
    return (now.c_lflag & (ICANON | ECHO)) == (ICANON | ECHO);
  }
  void restore_lines() const {  // as a shell does after Ctrl-Z
    termios now{};
    REQUIRE(tcgetattr(own_, &now) == 0);
    now.c_lflag |= ICANON | ECHO;
    REQUIRE(tcsetattr(own_, TCSANOW, &now) == 0);
  }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  int user_ = -1, own_ = -1;
  std::string path_;
};

/// What is typed goes through the kernel's line discipline, which takes its time.
bool comes(StopKey& key) {
  for (int k = 0; k < 200; ++k) {
    if (key.pressed()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

bool stays_away(StopKey& key) {
  for (int k = 0; k < 20; ++k) {
    if (key.pressed()) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

}  // namespace

TEST_SUITE("tools.run_device.stop_key") {
  TEST_CASE("pressed: space or e, once for each press, without Enter") {
    const Terminal terminal;
    StopKey key(terminal.path());
    REQUIRE(key.has_terminal());
    CHECK(stays_away(key));
    for (const char* keys : {" ", "e", "E", "abc e"}) {
      CAPTURE(keys);
      terminal.type(keys);
      CHECK(comes(key));
      CHECK(stays_away(key));
    }
    terminal.type("x\n1");
    CHECK(stays_away(key));
  }

  TEST_CASE("the terminal is as before afterwards, and taken again after a shell had it") {
    const Terminal terminal;
    REQUIRE(terminal.waits_for_lines());
    {
      StopKey key(terminal.path());
      CHECK_FALSE(key.pressed());
      CHECK_FALSE(terminal.waits_for_lines());
      terminal.restore_lines();
      CHECK_FALSE(key.pressed());
      terminal.type("e");
      CHECK(comes(key));
    }
    CHECK(terminal.waits_for_lines());
  }

  TEST_CASE("no terminal, or one that is gone, is no key pressed") {
    StopKey none("/nonexistent/tty"), file("/dev/null");
    CHECK_FALSE(none.has_terminal());
    CHECK_FALSE(file.has_terminal());
    CHECK_FALSE(none.pressed());
    Terminal terminal;
    StopKey key(terminal.path());
    CHECK_FALSE(key.pressed());
    terminal.hang_up();
    CHECK(stays_away(key));
  }
}
