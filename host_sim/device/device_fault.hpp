// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Faults of a device and its bus, as events at periods of the device: given on
/// command, or by a script. The same events over the same device give the same bytes.
///
/// Script: TOML, `format = 1` and [[fault]] tables with
///   kind      one of device_fault_kinds()
///   report    period of the device at which it begins, from 1 on; or t_s, its time
///   count     how many reports, transfers or periods, default 1; not for single events
///   amount    by kind, see there
///   endpoint  "in" (default) or "out", for stall, bus_error and submit_refused

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace haptic::sim {

enum class DeviceFaultKind : std::uint8_t {
  // Faults of the bus.
  kUnplug,            ///< transfers in flight end without a device
  kUnplugAtResubmit,  ///< between a completion and the resubmit in its callback
  kReplug,            ///< amount 1: the power was away too, counters start again
  kStall,
  kBabble,         ///< the device talks beyond the end of its packet
  kBusError,       ///< -EPROTO
  kSubmitRefused,  ///< -ENOMEM
  // Faults of reports: their bytes and their order.
  kShort,      ///< amount: bytes that are missing
  kLong,       ///< amount: bytes too many
  kCorrupt,    ///< amount: bits turned over
  kLost,       ///< not sent
  kDoubled,    ///< sent twice
  kReordered,  ///< pairs that change places
  kLate,       ///< amount: periods that it is held back; those meanwhile are overwritten by it
  kFrozen,     ///< the sequence stands still, everything else is right
  // Faults of the device.
  kEncoderJump,    ///< amount: metres along x
  kEmergencyStop,  ///< pressed for `count` periods
  kDeaf            ///< commands do not reach it for `count` periods: its watchdog cuts the drives
};

struct DeviceFaultEvent {
  DeviceFaultKind kind = DeviceFaultKind::kLost;
  std::uint64_t report = 0;  ///< period at which it begins, from 1 on; 0: the next
  unsigned count = 1;
  double amount = 0;
  bool out_endpoint = false;
};

/// Ranges that a script may give for one kind.
struct DeviceFaultRule {
  const char* name;
  DeviceFaultKind kind;
  bool counted, has_endpoint;
  double low, high, usual;  ///< of amount; both 0: it takes none
};
[[nodiscard]] const std::vector<DeviceFaultRule>& device_fault_kinds();
[[nodiscard]] const char* to_text(DeviceFaultKind kind);

/// Events of a script in the order of their periods. `rate_hz`: reports per second, for t_s.
/// @throws tools::InputError  "file:line: defect; fix".
[[nodiscard]] std::vector<DeviceFaultEvent> read_fault_script(const std::string& path,
                                                              double rate_hz);

// Between the device and its bus: turns each report into what really goes out in that period,
// which may be nothing, several, or damaged bytes.

/// Owner: one thread. The result depends on the events and on the reports alone.
class ReportFaultFilter {
 public:
  /// For kinds of reports; others are ignored. Event times must not lie in the past.
  void add(const DeviceFaultEvent& event);

  /// `period` counts from 1 and grows by one with each call.
  [[nodiscard]] std::vector<std::vector<std::uint8_t>> pass(std::uint64_t period,
                                                            std::span<const std::uint8_t> report);

 private:
  using Bytes = std::vector<std::uint8_t>;
  struct Entry {
    DeviceFaultEvent event;
    Bytes held;
  };
  void damage(const Entry& entry, std::uint64_t period, Bytes& bytes) const;
  void freeze(Bytes& bytes);
  static void delay(Entry& entry, std::uint64_t since, std::vector<Bytes>& sent);
  static void reorder(Entry& entry, std::uint64_t since, std::vector<Bytes>& sent);

  std::vector<Entry> entries_;
  std::uint32_t sequence_ = 0;  ///< of the last report that was not frozen
};

}  // namespace haptic::sim
