// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The wrench that a device may have now: of the command that it has accepted last, by its own
/// word, or of one that was sent since. Where it takes no commands the last one sent says nothing
/// of what the hand feels.

#include <array>
#include <cstddef>
#include <cstdint>

#include "hal/device_link.hpp"
#include "hal/drivers/driver.hpp"
#include "rt_core/base/pose.hpp"

namespace haptic::hal {

/// Owner: the link's thread. Pure.
class SentWrenches {
 public:
  /// A connection begins: the device has nothing of ours.
  void begin() noexcept;
  /// A command was handed over; `receipt` is the driver's after it was written.
  void sent(const Wrench& wrench_d, const CommandReceipt& receipt) noexcept;
  /// A report was read.
  void told(const CommandReceipt& receipt) noexcept;
  /// Never less than the device has, as long as it applies nothing that it has not accepted. Of a
  /// device that does not say what it accepts: the last sent.
  [[nodiscard]] HeldWrench held() const noexcept;
  /// The wrench that the device has by its own word, by the newest report; null: it does not say,
  /// or it is none that is remembered.
  [[nodiscard]] const Wrench* accepted() const noexcept {
    return tells_ && is_known_ ? &accepted_d_ : nullptr;
  }

 private:
  struct Sent {
    std::uint32_t sequence = 0;
    HeldWrench wrench;
    Wrench wrench_d;
  };
  /// Commands that are remembered one by one; of more that are not accepted the largest counts.
  static constexpr std::size_t kRemembered = 64;

  std::array<Sent, kRemembered> ring_{};
  std::size_t first_ = 0, count_ = 0;
  bool forgot_ = false;  ///< more were sent than are remembered: `largest_` counts them too
  HeldWrench accepted_, largest_, last_;
  Wrench accepted_d_;
  bool is_known_ = false;   ///< accepted_d_ is what was accepted last
  std::uint32_t told_ = 0;  ///< sequence accepted last
  bool tells_ = false;      ///< the device says what it accepts
};

}  // namespace haptic::hal
