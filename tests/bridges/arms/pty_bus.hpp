// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A serial bus with servos on a pseudo terminal, served by a thread of its own.

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <ctime>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace haptic::test {

inline std::int64_t steady_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

/// Owner: the test's thread; what the servos do runs under `lock` on the bus's.
class PtyBus {
 public:
  PtyBus() {
    int slave = -1;
    std::array<char, 128> name{};
    if (::openpty(&master_, &slave, name.data(), nullptr, nullptr) != 0)
      throw std::runtime_error("no pseudo terminal");
    termios line{};
    ::tcgetattr(slave, &line);
    ::cfmakeraw(&line);
    ::tcsetattr(slave, TCSANOW, &line);
    slave_ = slave;
    path_ = name.data();
  }
  virtual ~PtyBus() {
    stop();
    pull();
  }
  PtyBus(const PtyBus&) = delete;
  PtyBus& operator=(const PtyBus&) = delete;

  [[nodiscard]] const std::string& path() const { return path_; }
  /// The cable is out: the port hangs up.
  void pull() {
    stop();
    if (slave_ >= 0) ::close(slave_);
    if (master_ >= 0) ::close(master_);
    slave_ = master_ = -1;
  }

 protected:
  void run() {
    thread_ = std::thread([this] {
      std::array<std::uint8_t, 512> bytes{};
      while (!stop_.load()) {
        pollfd at{master_, POLLIN, 0};
        ::poll(&at, 1, 1);
        const ssize_t count =
            (at.revents & POLLIN) != 0 ? ::read(master_, bytes.data(), bytes.size()) : 0;
        const std::lock_guard guard(lock_);
        if (count > 0) heard_.insert(heard_.end(), bytes.begin(), bytes.begin() + count);
        serve(steady_ns());
      }
    });
  }
  void stop() {
    stop_.store(true);
    if (thread_.joinable()) thread_.join();
  }
  void say(const std::vector<std::uint8_t>& bytes) {
    [[maybe_unused]] const ssize_t count = ::write(master_, bytes.data(), bytes.size());
  }
  /// Takes instructions out of heard_ and answers them; called about once a millisecond.
  virtual void serve(std::int64_t now_ns) = 0;

  std::vector<std::uint8_t> heard_;
  mutable std::mutex lock_;

 private:
  int master_ = -1, slave_ = -1;
  std::string path_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace haptic::test
