// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A serial port that nothing waits for: opened for this program alone, raw, at any baud rate that
/// the adapter can make (termios2).

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "hal/bridge/device_tap.hpp"

namespace haptic::tools {

/// Where the port's neighbourhood is looked up; another root for tests.
struct SerialSystem {
  std::string root;  ///< before /dev/serial/by-id, /sys and /run; empty: this machine
};

/// Owner: one thread.
class SerialPort {
 public:
  SerialPort() = default;
  ~SerialPort() { close(); }
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;

  /// Opens `path`, 8 data bits, no parity, 1 stop bit, no flow control, with low latency where the
  /// driver has it, and drops what waits in it. @return true: open; else `why` says the defect and
  /// the fix in a sentence: absent, no right (dialout), held by another program, no serial port,
  /// a rate that the adapter cannot make.
  [[nodiscard]] bool open(const std::string& path, std::uint32_t baud, std::string& why,
                          const SerialSystem& system = {});
  /// All that passes here, and the time by `now_ns`, goes through it; before `open`.
  void set_tap(std::shared_ptr<hal::DeviceTap> tap) noexcept { tap_ = std::move(tap); }
  void close() noexcept;
  [[nodiscard]] bool is_open() const noexcept { return fd_ >= 0; }
  /// The device has gone, or its driver failed: nothing comes and goes any more.
  [[nodiscard]] bool is_lost() const noexcept { return lost_; }
  [[nodiscard]] int descriptor() const noexcept { return fd_; }

  /// Takes up to `bytes.size()` bytes of what has come. @return their count; 0: none.
  [[nodiscard]] std::size_t read(std::span<std::uint8_t> bytes) noexcept;
  /// All of `bytes` or a failure: a packet cut short is no packet. False: the port took less, which
  /// for packets of a hundred bytes means that it does not drain.
  [[nodiscard]] bool write(std::span<const std::uint8_t> bytes) noexcept;
  /// Drops what has come.
  void drop_input() noexcept;
  /// Until bytes come, or `timeout_ns` is over. For opening and closing alone.
  void wait(std::int64_t timeout_ns) noexcept;
  /// CLOCK_MONOTONIC [ns], for what an answer's time decides.
  [[nodiscard]] std::int64_t now_ns() const noexcept;

 private:
  [[nodiscard]] bool open_port(const std::string& path, std::uint32_t baud, std::string& why,
                               const SerialSystem& system);
  [[nodiscard]] std::int64_t read_port(std::span<std::uint8_t> bytes) noexcept;
  [[nodiscard]] std::int64_t write_port(std::span<const std::uint8_t> bytes) noexcept;
  [[nodiscard]] bool is_usable() const noexcept {
    return !lost_ && (fd_ >= 0 || (tap_ != nullptr && tap_->is_replay()));
  }

  std::shared_ptr<hal::DeviceTap> tap_;
  int fd_ = -1;
  bool lost_ = false;
};

/// Advice on an open port for its owner, sentences, empty where all is well: the latency timer of
/// an FTDI adapter above 1 ms, ModemManager that writes to ttyACM ports.
[[nodiscard]] std::string serial_advice(const std::string& path, const SerialSystem& system = {});

/// CLOCK_MONOTONIC [ns].
[[nodiscard]] std::int64_t monotonic_ns() noexcept;

}  // namespace haptic::tools
