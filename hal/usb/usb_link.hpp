// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One device on the bus, through libusb: opening, the transfers in flight, unplug and re-plug. All
/// libusb is called from one thread, the one that calls `poll`; the servo thread meets it only in
/// the two triple buffers.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "hal/device.hpp"
#include "hal/device_link.hpp"
#include "hal/device_mailbox.hpp"
#include "hal/drivers/driver.hpp"
#include "hal/input/gripper_switch.hpp"
#include "hal/input/switch_source.hpp"
#include "hal/usb/link_tape.hpp"
#include "hal/usb/output_guard.hpp"
#include "hal/zero_command.hpp"
#include "rt_core/safety/safety_limits.hpp"

namespace haptic::hal {

/// Which device: by identity (0: the driver's own), serial number and place on the bus if not
/// empty; or a descriptor that somebody else opened, which is then wrapped and not closed.
struct UsbAddress {
  std::uint16_t vendor_id = 0, product_id = 0;
  std::string serial;
  std::string bus_path;  ///< as in /sys/bus/usb/devices: bus, hyphen, ports joined by points
  int wrapped_fd = -1;
};

/// Parses "VID:PID", "VID:PID:SERIAL", either with "@1-2.3" behind it, or "1-2.3" alone; the
/// identity is hexadecimal, the place on the bus decimal. Returns false when it is none of them.
[[nodiscard]] bool parse_usb_address(const std::string& text, UsbAddress& address);

struct LinkSettings {
  UsbAddress address;
  SafetyLimits limits;
  Real force_share = 1;  ///< of what the device states; `limits` is lowered by it already
  /// Switches that must all be pressed by the device's own report, or the output ramps to zero
  /// until the servo thread arms again, no matter what it says; 0: none is looked at.
  std::uint32_t deadman = 0;
  int in_transfers = 3;                  ///< queued at any time, 2 to 4
  std::int64_t silence_ns = 20'000'000;  ///< no valid report for this long: kLinkSilent
  std::uint32_t corrupt_in_a_row = 5, frozen_in_a_row = 10;
  /// Report-clocked: after a report, wait for its command at most this long, then send what there
  /// is; 0: send the newest at once (timer-clocked).
  std::int64_t answer_wait_ns = 0;
  bool wake_servo = false;  ///< the servo loop sleeps on states_published: wake it at each state
  /// Asked at each connection what keeps a device that states this of itself from being used, for
  /// people; empty: nothing does. On the link's thread, before reports flow; may allocate.
  std::function<std::string(const DeviceCapabilities& stated)> accept;
  std::int64_t retry_ns = 200'000'000;  ///< between attempts to open a device that is absent
  /// Switches that are not the device's; they outlive the link. Null: none.
  SwitchSource* switches = nullptr;
  /// The device's gripper as the switch kClosedGripper, which the device itself then has not.
  GripperSettings gripper;
  /// Clock and, report-clocked, what to do while waiting; null: CLOCK_MONOTONIC and a yield.
  std::int64_t (*clock)(void* context) = nullptr;
  /// For how long the machine has slept so far, with the context of `clock`; null: CLOCK_BOOTTIME
  /// against CLOCK_MONOTONIC, or never where there is a `clock`.
  std::int64_t (*slept)(void* context) = nullptr;
  void* clock_context = nullptr;
  /// Is given the zero command of the device while it is open; outlives the link. Null: nobody.
  ZeroHolder* zero_holder = nullptr;
};

/// Sees every report and every send; called on the USB thread.
class LinkObserver {
 public:
  virtual ~LinkObserver() = default;
  virtual void on_report(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
                         ReportVerdict verdict, std::uint64_t sequence) noexcept = 0;
  virtual void on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
                       const GuardedOutput& output) noexcept = 0;
  virtual void on_link(std::int64_t stamp_ns, LinkState state, HalStatus why) noexcept = 0;
};

/// Owner: the USB thread (construction and destruction may be elsewhere, before and after it runs).
/// Allocates in the constructor and while connecting, not while reports flow (except for what
/// libusb allocates itself).
class UsbLink final : public DeviceLink {
 public:
  UsbLink(Driver& driver, const DeviceMailbox& mailbox, const LinkSettings& settings);
  ~UsbLink() override;
  UsbLink(const UsbLink&) = delete;
  UsbLink& operator=(const UsbLink&) = delete;

  /// Before the first poll; null: none.
  void observe(LinkObserver* observer) noexcept override;
  /// As `observe`; outlives the link.
  void tape(LinkTape* tape) noexcept;

  /// From any thread: the descriptor to be wrapped from now on, also where it has the number of the
  /// last one, whose device is gone. Negative: none yet.
  void set_wrapped_fd(int fd) noexcept;

  /// One turn: tries to connect where there is no device (at most every retry_ns, or when one is
  /// plugged in), else handles what the bus has, waiting at most `timeout_ns`, checks silence and
  /// stale commands, and sends: at each report, and at least once a period (a quarter more after a
  /// report, so as not to come just before the next one). Call it again at once, with at most half
  /// a period. Never throws; the status is the link's condition, kOk while reports can flow.
  HalStatus poll(std::int64_t timeout_ns) noexcept override;

  /// Orderly end, in this order: ramp to zero, zero command and its completion, the driver's last
  /// report, which switches the drives off (all bounded: 0.3 s), no resubmission, cancel, handle
  /// events until every callback has run, release, close. A poll after it opens again.
  void close() noexcept override;

  /// From any thread: makes a blocking start give up and poll return soon; until `close` nothing is
  /// opened any more.
  void cancel() noexcept override;
  /// The servo process ended: ramp to zero, latch kLinkServoLost.
  void servo_lost() noexcept override;
  void emergency_stop() noexcept override;
  /// Another servo process has taken over: its own mailbox from now on, since what a killed one
  /// left half done in its own cannot be known. From any thread; `mailbox` outlives the link, and
  /// so does the one before.
  void use_mailbox(const DeviceMailbox& mailbox) noexcept override;

  [[nodiscard]] LinkState state() const noexcept override;
  [[nodiscard]] HeldWrench held() const noexcept override;
  [[nodiscard]] std::optional<double> gap_m() const noexcept override;
  [[nodiscard]] LinkCounters counters() const noexcept override;
  /// Text of the last trouble with libusb's code and what to do, for people; not for the loop.
  [[nodiscard]] std::string trouble() const override;

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace haptic::hal
