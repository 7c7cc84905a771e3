// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which faults of the link the servo thread learns, and for how long: while their cause is there,
/// and until a command has answered a state that carried them. A fault that comes and goes between
/// two ticks is thus never missed, and none stays when there is nothing left to arm against.

#include <cstdint>

#include "hal/drivers/driver.hpp"
#include "rt_core/exchange/device_exchange.hpp"

namespace haptic::hal {

/// Reports that a slow device may miss before it is silent.
inline constexpr std::int64_t kMissedReports = 3;

struct FaultLimits {
  std::int64_t silence_ns = 20'000'000;
  std::uint32_t corrupt_in_a_row = 5, frozen_in_a_row = 10;
};

/// Owner: the USB thread. Pure: give it the time.
class LinkFaults {
 public:
  explicit LinkFaults(const FaultLimits& limits) noexcept
      : limits_(limits), silence_ns_(limits.silence_ns) {}

  /// Reports begin: nothing is wrong with them yet. kLinkLost has no cause any more.
  void begin(std::int64_t now_ns) noexcept;
  /// Sets the report period that the device of this connection states; not above 0: not known. A
  /// device is silent once kMissedReports of them are missing and the limit is over.
  void expect_reports_every(std::int64_t report_period_ns) noexcept;
  /// A report came, good or bad.
  void note(ReportVerdict verdict, std::int64_t now_ns) noexcept;
  /// A silent device has said something by it.
  void heard(std::int64_t now_ns) noexcept { heard_ns_ = now_ns; }
  /// Raises the fault once the device has been silent for too long.
  void check_silence(std::int64_t now_ns) noexcept;

  /// The causes of `bits` are there now, or not.
  void set_present(std::uint32_t bits, bool present) noexcept;
  /// Their causes have come and gone.
  void raise(std::uint32_t bits) noexcept;

  /// A state with shown() went out for report number `sequence`.
  void carried(std::uint64_t sequence) noexcept;
  /// The newest command: what it has answered and has no cause any more is not shown longer.
  void answered(const DeviceCommand& command) noexcept;

  [[nodiscard]] std::uint32_t present() const noexcept { return present_; }
  /// DeviceFault, upper half.
  [[nodiscard]] std::uint32_t shown() const noexcept { return present_ | unanswered_; }

 private:
  FaultLimits limits_;
  std::int64_t silence_ns_;  ///< of this connection
  std::uint32_t present_ = 0, unanswered_ = 0;
  std::uint64_t carried_from_ = 0;  ///< report since which all of shown() went out; 0: none yet
  std::int64_t heard_ns_ = 0;       ///< last valid report
  std::uint32_t corrupt_ = 0, frozen_ = 0;  ///< in a row
};

}  // namespace haptic::hal
