// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Checks whether this machine can run a servo loop with a device on USB: one line per question,
/// with what was found and how to fix it. Looks and tries; changes nothing that stays.

#include <cstdint>
#include <string>
#include <vector>

#include "hal/realtime/system_probes.hpp"
#include "hal/realtime/system_tree.hpp"

namespace haptic::hal {

enum class DoctorLevel : std::uint8_t {
  kPass = 0,
  kWarning,  ///< the loop runs, but later or less surely than it could
  kFailure,  ///< the loop cannot run, or not with this device
  kSkipped,  ///< does not apply, was not asked for, or cannot be seen here
  kCount
};

/// "pass", "warning", "failure", "skipped".
[[nodiscard]] const char* to_text(DoctorLevel level) noexcept;

/// One finding.
struct DoctorLine {
  std::string name;  ///< the same on every machine
  DoctorLevel level = DoctorLevel::kSkipped;
  bool refuses_in_strict = false;  ///< a warning that `strict` does not let pass
  std::string found;
  /// Never empty; "none needed" where all is well. Lines that begin with four blanks are commands
  /// or file lines, to be copied as they are.
  std::string fix;
};

/// The loop that is planned. Core 0 of `cpus` is the servo thread's, the next the USB thread's;
/// empty: they are not tied, one: they share it.
struct DoctorQuestions {
  std::uint16_t vendor_id = 0, product_id = 0;  ///< 0: no device named
  std::string serial;                           ///< empty: any
  std::string
      bus_path;        ///< its place, as in /sys/bus/usb/devices; empty: any, at no identity: none
  std::string bridge;  ///< name of the driver whose device must be there by its bridge; empty: none
  std::int64_t period_ns = 1'000'000;
  std::vector<int> cpus;
  int servo_priority = 80, usb_priority = 79;  ///< SCHED_FIFO
  bool measure = true;
  std::int64_t measure_ns = 2'000'000'000;
  /// A wake-up later than this is worth a warning that refuses; 0: a quarter of the period.
  std::int64_t wakeup_limit_ns = 0;
  /// Where wake-ups fail: let rtla, which needs root and half a minute, say who is late.
  bool name_culprit = false;
};

/// Every line, always the same ones in the same order. `measurement`, where not null, receives the
/// wake-ups that were measured. Takes `measure_ns` and some milliseconds.
[[nodiscard]] std::vector<DoctorLine> examine(const SystemTree& tree, SystemProbes& probes,
                                              const DoctorQuestions& questions,
                                              WakeupMeasurement* measurement = nullptr);

/// True if motors may be enabled: no failure and, in `strict`, no warning that refuses.
[[nodiscard]] bool is_fit(const std::vector<DoctorLine>& lines, bool strict) noexcept;

}  // namespace haptic::hal
