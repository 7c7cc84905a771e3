// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A device behind a socket, a scene and a configuration for it: what a session opens.

#include <doctest/doctest.h>
#include <haptic.h>
#include <sys/types.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "host_sim/lab/processes/served_device.hpp"
#include "tests/support/program_run.hpp"

namespace haptic::sim::test {

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr double kFelt_n = 0.25;  // a machine that is busy gives a device little

void sleep_ms(int ms);
[[nodiscard]] bool comes_true_within(const std::function<bool()>& holds, int within_ms = 10'000);

/// A block in the hand, 5 mm over a plate, and the configuration of the device that holds it.
class SessionBench {
 public:
  SessionBench();

  [[nodiscard]] std::string file(const std::string& name) const { return folder_.file(name); }
  [[nodiscard]] std::string config() const { return file("device.toml"); }
  [[nodiscard]] const std::vector<std::byte>& scene() const { return scene_; }
  [[nodiscard]] ServedDevice& device() { return *device_; }
  void write(const std::string& name, const std::string& text) const;

  /// Releases the deadman switch, holds it, and presses the block on the plate. @return whether it
  /// is felt.
  bool press();
  [[nodiscard]] bool is_held() {
    return comes_true_within([this] { return device().hosts() > 0; });
  }

 private:
  ScratchFolder folder_{"device_session"};
  std::vector<std::byte> scene_;
  std::unique_ptr<ServedDevice> device_;
};

/// A session that ends with its test.
class OpenedSession {
 public:
  explicit OpenedSession(const SessionBench& bench) : OpenedSession(bench, bench.config()) {}
  OpenedSession(const SessionBench& bench, const std::string& config, std::int32_t hands = 0);
  ~OpenedSession() { (void)haptic_session_free(&session_); }
  OpenedSession(const OpenedSession&) = delete;
  OpenedSession& operator=(const OpenedSession&) = delete;

  [[nodiscard]] int error() const { return error_; }
  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] haptic_session* get() const { return session_; }
  [[nodiscard]] haptic_state state() const;
  [[nodiscard]] haptic_device_status device() const;
  [[nodiscard]] std::vector<haptic_event> events() const;
  [[nodiscard]] bool has_event(const std::string& name) const;

 private:
  haptic_session* session_ = nullptr;
  int error_ = HAPTIC_OK;
  std::string text_;
};

/// An environment variable for the time of this object.
class Setting {
 public:
  Setting(const char* name, const std::string& value);
  ~Setting();
  Setting(const Setting&) = delete;
  Setting& operator=(const Setting&) = delete;

 private:
  const char* name_;
  std::string before_;
  bool was_set_;
};

/// From a moment on: until the first zero, and how it was reached.
struct Ramp {
  double to_zero_ms = -1;  ///< -1: there was none
  double largest_step_n = 0;
  double begin_n = 0;  ///< of the command before
  bool stays = true;   ///< nothing but zero after it
};
[[nodiscard]] Ramp ramp_since(const WireRecord& wire, std::int64_t begin_ns);

}  // namespace haptic::sim::test
