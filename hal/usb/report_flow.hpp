// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The way of a report and of a command between driver and mailbox, regardless of the bus: checks,
/// stamps, faults, the output guard, and when to send.

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "hal/drivers/driver.hpp"
#include "hal/usb/link_faults.hpp"
#include "hal/usb/output_guard.hpp"
#include "hal/usb/report_transfers.hpp"
#include "hal/usb/sent_wrenches.hpp"
#include "hal/usb/usb_link.hpp"

namespace haptic::hal {

/// Owner: the USB thread; `state`, `counters`, `servo_lost` and `use_mailbox` from any.
class ReportFlow final : public TransferSink {
 public:
  ReportFlow(Driver& driver, const DeviceMailbox& mailbox, const LinkSettings& settings) noexcept;

  /// Through which it sends; outlives the flow.
  void attach(ReportTransfers& transfers) noexcept { transfers_ = &transfers; }
  void observe(LinkObserver* observer) noexcept { observer_ = observer; }
  void tape(LinkTape* tape) noexcept { tape_ = tape; }

  [[nodiscard]] std::int64_t now_ns() const noexcept;

  /// The device is there, its driver starts it: publishes kStarting.
  void begin_start() noexcept;
  /// Reports flow from now on; the output is zero until armed again, and within what the driver's
  /// device states now. One that states something else than at the last connection:
  /// kLinkOtherDevice.
  void begin_reports() noexcept;
  /// The device is away: publishes kAbsent, and kLinkLost where `lost`.
  void end(bool lost, HalStatus why) noexcept;
  /// After the bus was served: silence, a stuck OUT transfer, and the output when no report has
  /// clocked it for a period.
  void turn() noexcept;
  /// Time until `turn` has to send [ns]; 0: now.
  [[nodiscard]] std::int64_t until_turn_ns() const noexcept;

  /// From now on the output ramps to zero; `is_at_rest` once a zero was delivered, and after it
  /// what switches the drives off.
  void begin_rest() noexcept;
  [[nodiscard]] bool is_at_rest() const noexcept;

  void emergency_stop() noexcept { stop_called_.store(true, std::memory_order_release); }
  void servo_lost() noexcept { servo_lost_.store(true, std::memory_order_release); }
  /// Release: who meets the mailbox sees it as it was made.
  void use_mailbox(const DeviceMailbox& mailbox) noexcept {
    next_mailbox_.store(&mailbox, std::memory_order_release);
  }
  /// Why the device that its driver has started may not be used, by LinkSettings::accept; empty: it
  /// may. Before begin_reports, of every carrier. `bus_interval_ns`: as of
  /// DeviceCapabilities. May allocate.
  [[nodiscard]] std::string defect(std::int64_t bus_interval_ns) const;
  /// As DeviceLink::held, from any thread. A device that was lost may have its last wrench until
  /// its own watchdog has cut it; after that, nothing.
  [[nodiscard]] HeldWrench held() const noexcept;
  /// As DeviceLink::gap_m, from any thread.
  [[nodiscard]] std::optional<double> gap_m() const noexcept {
    const double gap_m = gap_m_.load(std::memory_order_relaxed);
    return gap_m >= 0 ? std::optional(gap_m) : std::nullopt;
  }
  /// Capabilities that the device of the last connection stated.
  [[nodiscard]] const DeviceCapabilities& stated() const noexcept { return stated_; }
  /// True if the device of the connection before stated others.
  [[nodiscard]] bool is_other_device() const noexcept { return other_device_; }
  [[nodiscard]] LinkState state() const noexcept { return link_.load(std::memory_order_acquire); }
  [[nodiscard]] LinkCounters& counters() noexcept { return counters_; }

  void on_report(std::span<const std::uint8_t> bytes) noexcept override;
  /// The same of a report whose device says when it was sampled, by this machine's clock. What is
  /// not between the stamp before and now is taken for the nearer of them; how old it is the servo
  /// thread sees, and one that is never new makes a silent link.
  void on_report(std::span<const std::uint8_t> bytes, std::int64_t sampled_ns) noexcept;
  void on_report_done() noexcept override;
  void on_out_end(bool delivered) noexcept override;

 private:
  [[nodiscard]] std::int64_t clock_ns() const noexcept;
  void note(const LinkEvent& event) const noexcept {
    if (tape_ != nullptr) tape_->on_event(event);
  }
  [[nodiscard]] DeviceSide& mailbox() noexcept;
  void take_limits() noexcept;
  void take_command() noexcept;
  void wait_for_answer() noexcept;
  void drive() noexcept;
  void lose_send() noexcept;
  void wait_for_device(std::int64_t now_ns, GuardedOutput& output) noexcept;
  [[nodiscard]] bool send(std::int64_t now_ns, const GuardedOutput& output) noexcept;
  void follow_servo(std::int64_t now_ns) noexcept;
  void latch_present() noexcept;
  void follow_holder() noexcept;
  void follow_calls() noexcept;
  void follow_switches() noexcept;
  void follow_gripper() noexcept;
  void fill_silence(std::int64_t now_ns) noexcept;
  void release() noexcept;
  void take_report(std::span<const std::uint8_t> bytes, std::int64_t now_ns,
                   std::int64_t stamp_ns) noexcept;
  void tell_held(const HeldWrench& held) noexcept;
  [[nodiscard]] std::int64_t slept_ns() const noexcept;
  void publish(bool with_report, HalStatus why = HalStatus::kOk) noexcept;
  void publish_changes() noexcept;

  Driver& driver_;
  DeviceSide mailbox_;
  std::atomic<const DeviceMailbox*> next_mailbox_{nullptr};  ///< null: none since mailbox_
  const LinkSettings& settings_;
  ReportTransfers* transfers_ = nullptr;
  LinkObserver* observer_ = nullptr;
  LinkTape* tape_ = nullptr;
  LinkCounters counters_;
  OutputGuard guard_;
  LinkFaults faults_;
  GripperSwitch gripper_;
  std::int64_t period_ns_;

  DeviceCommand command_;        ///< the newest
  DeviceState state_;            ///< the newest, as the driver reads it
  std::uint32_t published_ = 0;  ///< faults of the last state published
  std::uint32_t guard_faults_ = 0;
  DeviceCapabilities stated_;
  std::uint32_t connection_ = 0;  ///< counts them
  bool other_device_ = false;
  SentWrenches sent_;
  std::uint64_t sequence_ = 0;
  ReportVerdict verdict_ = ReportVerdict::kNothing;
  std::int64_t driven_ns_ = 0, out_since_ns_ = 0, servo_lost_ns_ = 0;
  unsigned lost_sends_ = 0;       ///< in a row
  bool timed_ = false;            ///< the last output was clocked by time, not by a report
  bool owed_ = false;             ///< an output was due while OUT was in flight
  bool out_zero_ = false;         ///< the one in flight is zero
  bool zero_held_ = false;        ///< the holder has this connection's zero command
  std::uint32_t zeros_sent_ = 0;  ///< by the holder
  bool resting_ = false, zero_delivered_ = false, releasing_ = false, at_rest_ = false;
  std::int64_t slept_ns_ = 0;         ///< the machine, as far as it is known
  std::uint32_t outer_switches_ = 0;  ///< pressed beside the device
  std::atomic<bool> stop_called_{false};
  std::atomic<bool> servo_lost_{false};
  std::atomic<LinkState> link_{LinkState::kAbsent};
  std::atomic<double> held_force_n_{0}, held_torque_nm_{0};
  std::atomic<double> gap_m_{-1};               ///< below 0: none
  std::atomic<std::int64_t> held_until_ns_{0};  ///< 0: until something else is known
};

}  // namespace haptic::hal
