// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One device of a stack: the hand on it, its model, its bus, its driver and its output guard, in
/// one thread and in the device's own time.

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "hal/device_limits.hpp"
#include "hal/device_mailbox.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/usb/bus_record.hpp"
#include "hal/usb/usb_link.hpp"
#include "host_sim/device/reference_usb.hpp"
#include "rt_core/servo_tick.hpp"

namespace haptic::sim {

enum class StackCarrier : std::uint8_t {
  kDirect = 0,  ///< the driver is handed the device's bytes
  kUsb          ///< through libusb, over the in-process bus
};

struct StackSettings {
  StackCarrier carrier = StackCarrier::kDirect;
  /// The command answers the report that it was computed from; else it goes out with the next one.
  bool report_clocked = false;
  double servo_phase = 0.5;  ///< timer-clocked: ticks come this share of a period after a report
  unsigned ticks_per_report = 1;  ///< timer-clocked: servo ticks, evenly spaced
  ReferenceModelSettings model;
  /// Limits of servo tick and output guard, before what the device states at its connection;
  /// limits_of(reference_capabilities()).
  SafetyLimits limits;
  WorkspaceMap map;  ///< its grip point is set from the scene
  MotionEnvelope envelope;
  std::size_t recorded_ticks = 4096;  ///< of the flight recorder
};

/// Settings with the limits of the reference device.
[[nodiscard]] StackSettings reference_stack(StackCarrier carrier);

/// A command as it was handed to the bus.
struct StackSend {
  std::int64_t stamp_ns = 0;
  std::uint32_t sequence = 0;
  bool drives_on = false;
  Load wrench;  ///< in its bytes
};

/// Record of one period.
struct StackTick {
  std::uint64_t period = 0;  ///< of the device, from 1 on
  double t_s = 0;
  DeviceState device;  ///< where the handle really is
  Load acting;         ///< on the handle in this period
  bool drives_on = false;
  std::uint32_t cuts = 0;     ///< by the device's watchdog, so far
  haptic::DeviceState state;  ///< what the servo tick saw
  ServoResult servo;
  bool servo_ran = false;
  std::uint64_t sends = 0;      ///< commands handed to the bus, so far
  Wrench handed_d;              ///< in the newest of them, before the driver has had its say
  std::vector<StackSend> sent;  ///< in this period
  LinkState link = LinkState::kAbsent;
};

/// Owner: one thread. The stack outlives it.
class DeviceLine final : private hal::LinkObserver {
 public:
  /// The share of a device in the stack that it is in.
  struct Clock {
    std::int64_t now_ns = 0, slept_ns = 0;
    /// The servo loop may run now: a report has come, and its command is waited for. Null: it runs
    /// later.
    std::function<void()> serve;
  };

  /// `settings` in the form that a stack gives them. `hand`: where it wants the handle, and its
  /// fingers, by time; in D. A program that uses StackCarrier::kUsb links haptic_usbfs.
  DeviceLine(Clock& clock, const StackSettings& settings,
             std::function<HandAction(double t_s)> hand);
  ~DeviceLine() override;
  DeviceLine(const DeviceLine&) = delete;
  DeviceLine& operator=(const DeviceLine&) = delete;

  void begin_period();
  /// The device moves on, and its report comes.
  void report();
  /// Sends what waits to go out.
  void send();
  void end_period();

  [[nodiscard]] const hal::DeviceMailbox& mailbox() const { return mailbox_; }
  /// A state has come in this period.
  [[nodiscard]] bool has_new_state() const {
    return mailbox_.states->published.load(std::memory_order_acquire) != seen_;
  }
  [[nodiscard]] const StackSettings& settings() const { return settings_; }
  [[nodiscard]] StackTick& tick() { return out_; }
  [[nodiscard]] ReferenceUsb& bus() { return *bus_; }
  [[nodiscard]] const hal::ReferenceDriver& driver() const { return driver_; }
  [[nodiscard]] hal::LinkSettings link_settings() const;
  [[nodiscard]] hal::LinkCounters link_counters() const;
  [[nodiscard]] std::int64_t period_ns() const { return period_ns_; }

  void tape(hal::LinkTape* tape);
  void servo_lost();
  void stop_link();
  void unplug();
  void plug(bool power);

 private:
  class DirectLink;
  static std::int64_t clock(void* self);
  static std::int64_t slept(void* self);
  void on_report(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
                 hal::ReportVerdict verdict, std::uint64_t sequence) noexcept override;
  void on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
               const hal::GuardedOutput& output) noexcept override;
  void on_link(std::int64_t stamp_ns, LinkState state, hal::HalStatus why) noexcept override;

  Clock& clock_;
  StackSettings settings_;
  std::int64_t period_ns_;
  ReferenceModel model_;
  hal::ReferenceDriver driver_;
  hal::MailboxMemory mailbox_;
  std::unique_ptr<ReferenceUsb> bus_;
  std::unique_ptr<hal::UsbLink> link_;
  std::unique_ptr<DirectLink> direct_;
  StackTick out_;
  std::uint32_t seen_ = 0;  ///< states published before this period
  bool in_poll_ = false;
};

}  // namespace haptic::sim
