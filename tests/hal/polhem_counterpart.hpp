// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A Polhem board as the bus sees it: lock-step reports, counters, the latched calibration switch,
/// the drives and their watchdog. For tests; usable as the port of a driver's start, or byte by
/// byte behind a simulated bus.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/drivers/polhem_codec.hpp"
#include "tests/support/device_counterpart.hpp"

namespace haptic::test {

class PolhemCounterpart : public DeviceCounterpart {
 public:
  // Faults; the default is a good device.
  bool silent = false;        ///< never reports
  int old_reports = 0;        ///< reports already under way: sent with the counts before
  int lost_set_commands = 0;  ///< commands to set the counts that do not arrive
  bool sets_wrong_counts = false;

  // World side.
  /// Counts since power-up change by this.
  void turn(const std::array<int, 6>& by);
  void press_switch() { flagged_ = true; }
  /// Time passes; without a report for 0.5 s the drives go off.
  void pass(std::int64_t ns);
  [[nodiscard]] bool drives_on() const { return drives_on_; }
  [[nodiscard]] const std::array<std::int16_t, 3>& currents_ma() const { return currents_ma_; }
  [[nodiscard]] const std::array<int, 6>& counts() const { return counts_; }
  [[nodiscard]] int set_commands() const { return set_commands_; }

  // Bytes.
  bool on_out(std::span<const std::uint8_t> bytes) override;
  /// The report that answers the last one from the host; 0: none, the bus sees NAK.
  std::size_t on_in(std::span<std::uint8_t> bytes) override;

 private:
  [[nodiscard]] hal::PolhemReport report() const;

  std::array<int, 6> counts_{};
  std::array<std::int16_t, 3> currents_ma_{};
  bool flagged_ = false, drives_on_ = false, due_ = false;
  hal::PolhemReport under_way_;
  int old_left_ = 0;
  std::int64_t since_report_ns_ = 0;
  int set_commands_ = 0;
};

}  // namespace haptic::test
