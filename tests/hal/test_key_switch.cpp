// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>

#include "hal/input/key_switch.hpp"

using namespace haptic::hal;

namespace {

constexpr std::uint16_t kKey = KEY_B, kOther = KEY_C;

/// A named pipe where the input device would be; the bytes through it are the kernel's own.
class InputPipe {
 public:
  InputPipe()
      : path_(std::filesystem::temp_directory_path() /
              ("haptic_key_switch_" + std::to_string(getpid()))) {
    std::filesystem::remove(path_);
    make();
  }
  ~InputPipe() { remove(); }
  void make() {
    REQUIRE(mkfifo(path_.c_str(), 0600) == 0);
    fd_ = ::open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    REQUIRE(fd_ >= 0);
  }
  /// The device goes: its readers find the end of the file.
  void remove() {
    std::filesystem::remove(path_);
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  void send(std::uint16_t type, std::uint16_t code, int value) const {
    input_event event{};
    event.type = type;
    event.code = code;
    event.value = value;
    REQUIRE(::write(fd_, &event, sizeof event) == sizeof event);
  }
  void send_half() const {
    const char bytes[sizeof(input_event) / 2] = {};
    REQUIRE(::write(fd_, bytes, sizeof bytes) == sizeof bytes);
  }
  [[nodiscard]] std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
  int fd_ = -1;
};

bool comes_open(const KeySwitch& key) {
  for (int k = 0; k < 500 && !key.is_open(); ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return key.is_open();
}

}  // namespace

TEST_SUITE("hal.key_switch") {
  TEST_CASE("pressed: from its key's press to its release, and no other key's") {
    const InputPipe pipe;
    KeySwitch key({pipe.path(), kKey});
    CHECK(key.pressed() == 0u);
    pipe.send(EV_KEY, kOther, 1);
    pipe.send(EV_REL, kKey, 1);
    pipe.send(EV_KEY, kKey, 2);  // a repetition of a press that was never seen
    CHECK(key.pressed() == 0u);
    pipe.send(EV_KEY, kKey, 1);
    pipe.send(EV_SYN, SYN_REPORT, 0);
    CHECK(key.pressed() == kInputSwitch);
    for (int k = 0; k < 50; ++k) CHECK(key.pressed() == kInputSwitch);  // a pedal held is silent
    pipe.send(EV_KEY, kKey, 2);
    pipe.send(EV_KEY, kOther, 0);
    CHECK(key.pressed() == kInputSwitch);
    pipe.send(EV_KEY, kKey, 0);
    CHECK(key.pressed() == 0u);
    pipe.send(EV_KEY, kKey, 1);
    pipe.send(EV_KEY, kKey, 0);
    CHECK(key.pressed() == 0u);
  }

  TEST_CASE("pressed: lost events, half an event and a flood are a release until the next press") {
    const InputPipe pipe;
    KeySwitch key({pipe.path(), kKey});
    pipe.send(EV_KEY, kKey, 1);
    REQUIRE(key.pressed() == kInputSwitch);
    pipe.send(EV_SYN, SYN_DROPPED, 0);
    CHECK(key.pressed() == 0u);
    pipe.send(EV_KEY, kKey, 2);
    CHECK(key.pressed() == 0u);
    pipe.send(EV_KEY, kKey, 1);
    CHECK(key.pressed() == kInputSwitch);
    for (int k = 0; k < 1000; ++k) pipe.send(EV_KEY, kOther, k & 1);
    CHECK(key.pressed() == 0u);
    for (int k = 0; k < 100; ++k) CHECK(key.pressed() == 0u);
    pipe.send(EV_KEY, kKey, 1);
    REQUIRE(key.pressed() == kInputSwitch);
    pipe.send_half();
    CHECK(key.pressed() == 0u);
  }

  TEST_CASE(
      "pressed: a device that goes away is a released one; it is opened when it comes again") {
    InputPipe pipe;
    KeySwitch key({pipe.path(), kKey});
    pipe.send(EV_KEY, kKey, 1);
    REQUIRE(key.pressed() == kInputSwitch);
    pipe.remove();
    CHECK(key.pressed() == 0u);
    CHECK_FALSE(key.is_open());
    pipe.make();
    REQUIRE(comes_open(key));
    CHECK(key.pressed() == 0u);
    pipe.send(EV_KEY, kKey, 1);
    CHECK(key.pressed() == kInputSwitch);
  }

  TEST_CASE("pressed: there is no device, then there is") {
    KeySwitch none({"/nonexistent/event0", kKey});
    CHECK(none.pressed() == 0u);
    CHECK_FALSE(none.is_open());
  }
}
