// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A driver: a pure codec between the bytes of one kind of device and its state and command, and
/// the small state machine round it (sequence, homing, calibration). Nothing here knows libusb.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "hal/device.hpp"
#include "hal/drivers/usb_port.hpp"

namespace haptic::hal {

/// Largest report of any driver [bytes].
inline constexpr std::size_t kMaxReportBytes = 128;

/// Where the device is found and how its reports travel.
struct UsbProfile {
  const char* name = "";
  std::uint16_t vendor_id = 0, product_id = 0;
  std::uint8_t interface_number = 0;
  std::uint8_t in_endpoint = 0x81;
  std::uint8_t out_endpoint = 0;  ///< 0: reports go in only
  bool bulk = false;              ///< endpoints are bulk; else interrupt
  std::uint16_t in_bytes = 0, out_bytes = 0;
  bool lock_step = false;      ///< it answers each report from the host with one of its own
  bool kernel_driver = false;  ///< a kernel driver holds the interface and must be detached
  /// Asked before the device is opened: who has it by way of that kernel driver, and what to do
  /// about it, for people; empty: nobody. Returns at once; may allocate. Null: nobody can have it.
  std::string (*holder)() = nullptr;
};

/// Result of reading one report.
enum class ReportVerdict : std::uint8_t {
  kState = 0,    ///< `state` is new
  kNothing,      ///< valid, but no new state in it
  kBadLength,    ///< `state` is unchanged here and below
  kBadCheck,     ///< check sum, frame or reserved bytes
  kBadNumber,    ///< a value outside what the device can say; kinematics that did not converge
  kNotAdvancing  ///< its sequence is not newer than the last one's
};

/// A device's word on our commands, where its reports have one. Sequences wrap round.
struct CommandReceipt {
  bool told = false;           ///< its reports say what it has accepted; else nothing below counts
  bool drives_on = false;      ///< it exerts what it has accepted
  std::uint32_t sent = 0;      ///< sequence of the last command written
  std::uint32_t accepted = 0;  ///< of the last one that it has accepted
  /// Reports in a row by which it has accepted nothing although newer commands were there.
  std::uint32_t unanswered = 0;
};

/// Owner: the USB thread. `read` and `write` are wait-free and do not allocate.
class Driver {
 public:
  virtual ~Driver() = default;
  /// Known once the driver is constructed, and constant from then on.
  [[nodiscard]] virtual const UsbProfile& profile() const noexcept { return profile_; }
  /// Before `start` those that are assumed, after it those that the device states, if it can.
  [[nodiscard]] virtual const DeviceCapabilities& capabilities() const noexcept {
    return capabilities_;
  }

  /// From power-up to flowing reports; called once per connection, with all state forgotten. May
  /// block (firmware takes seconds), always bounded, and gives up when port.cancelled().
  [[nodiscard]] virtual HalStatus start(UsbPort& port) noexcept = 0;

  /// One report from the device. Fills pose_dh, twist_d, twist_valid, link, switches, faults of
  /// `state` (DeviceFault's lower half); sequence, stamp and the rest belong to the link. `link`
  /// becomes kReady only once calibrated and homed.
  [[nodiscard]] virtual ReportVerdict read(std::span<const std::uint8_t> report,
                                           std::int64_t stamp_ns, DeviceState& state) noexcept = 0;

  /// The next report to the device, for a wrench within the device's capabilities; returns its
  /// length, 0 when there is nothing to send. `report` has room for out_bytes. `delivered_d`
  /// becomes what the device will exert for it: rounded to its units, zero while not homed.
  [[nodiscard]] virtual std::size_t write(const Wrench& wrench_d, std::uint64_t tick,
                                          std::span<std::uint8_t> report,
                                          Wrench& delivered_d) noexcept = 0;

  /// A report that takes the force away whenever it is sent from now on, by anyone and after any
  /// other; returns its length, 0: none is needed. Of the state after the last `read`; the driver
  /// does not count it as sent.
  [[nodiscard]] virtual std::size_t zero_report(std::span<std::uint8_t> report) const noexcept = 0;

  /// After the last `read` or `write`.
  [[nodiscard]] virtual CommandReceipt receipt() const noexcept { return {}; }

  /// Gap of its gripper by the last report that was read; empty: it measures none, or not now.
  [[nodiscard]] virtual std::optional<Real> gap_m() const noexcept { return std::nullopt; }

  /// The last report of a session, after zero was delivered: switches the drives off, so that the
  /// device can tell an end from a host that died. Length; 0: the protocol has none.
  [[nodiscard]] virtual std::size_t release(std::uint64_t tick,
                                            std::span<std::uint8_t> report) noexcept {
    static_cast<void>(tick);
    static_cast<void>(report);
    return 0;
  }

  /// For a device whose silence means something: `state` as it is by `stamp_ns`, filled as by
  /// `read`. False, and `state` unchanged: silence says nothing; the link then counts it as a
  /// fault.
  [[nodiscard]] virtual bool rest(std::int64_t stamp_ns, DeviceState& state) noexcept {
    static_cast<void>(stamp_ns);
    static_cast<void>(state);
    return false;
  }

 protected:
  UsbProfile profile_;
  DeviceCapabilities capabilities_;
};

}  // namespace haptic::hal
