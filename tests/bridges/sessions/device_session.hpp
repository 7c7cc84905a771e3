// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One session as a user has it: list, configuration, compiled peg, run. The programs are the ones
/// that are shipped, with their defaults; only `--allow-degraded` is added, which a machine that is
/// not in real time needs.

#include <sys/types.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tests/bridges/sessions/emulated_hand.hpp"
#include "tests/support/program_run.hpp"

namespace haptic::test {

/// The square peg of the gallery, upright, 3 mm above its hole of 40 mm.
inline constexpr double kPegGap_m = 0.003, kHoleDepth_m = 0.040, kPegPlay_m = 0.0003;

/// The calling thread, and those that it starts meanwhile, run before what else this machine does:
/// a device does not wait for a compiler. Where Linux refuses that, nothing changes.
class InRealTime {
 public:
  InRealTime();
  ~InRealTime();
  InRealTime(const InRealTime&) = delete;
  InRealTime& operator=(const InRealTime&) = delete;
};

class DeviceSession {
 public:
  /// Compiles the peg.
  explicit DeviceSession(EmulatedHand& hand);
  ~DeviceSession();
  DeviceSession(const DeviceSession&) = delete;
  DeviceSession& operator=(const DeviceSession&) = delete;

  /// `run_device list --json` in the hand's environment. Empty: it is not JSON.
  [[nodiscard]] nlohmann::json list();
  /// Starts `run_device run` with what list proposes for `driver`. False: it proposes nothing.
  [[nodiscard]] bool start(const nlohmann::json& listed, const std::string& driver);

  /// The hand at `way` of the time since the call, for `seconds`, or until `done`.
  void lead(double seconds, const std::function<Vec3(double t_s)>& way,
            const std::function<bool()>& done = nullptr);
  /// Switch released, then pressed; true: armed.
  [[nodiscard]] bool arm(const Vec3& way_d);
  /// SIGTERM, and its end.
  void end();

  /// Lines so far: events, notes, status, at the end the summary.
  [[nodiscard]] std::vector<nlohmann::json> lines() const;
  /// The newest of a kind; null: none.
  [[nodiscard]] nlohmann::json newest(const std::string& kind) const;
  [[nodiscard]] bool has_said(const std::string& words) const;
  [[nodiscard]] bool has_ended();
  [[nodiscard]] int exit_code() const { return exit_code_; }
  [[nodiscard]] std::string errors() const;
  /// Processes of bridges that this run has started.
  [[nodiscard]] std::vector<pid_t> bridges() const;
  [[nodiscard]] pid_t pid() const { return pid_; }

 private:
  [[nodiscard]] std::string with_environment(const std::string& command) const;

  EmulatedHand& hand_;
  const sim::test::ScratchFolder folder_;
  pid_t pid_ = -1;
  bool is_over_ = false;
  int exit_code_ = -1;
};

}  // namespace haptic::test
