// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The whole stack in one thread and in the device's own time: hand, device model, bus, driver,
/// output guard, servo tick, core. Equal calls give equal bits, so that a fault can be put anywhere
/// and a run can be compared with another.

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "hal/device_limits.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/realtime/servo_loop.hpp"
#include "hal/usb/bus_record.hpp"
#include "hal/usb/usb_link.hpp"
#include "host_sim/device/reference_usb.hpp"
#include "host_sim/session/core_session.hpp"
#include "rt_core/exchange/newest_record.hpp"

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

/// Owner: one thread. The session outlives the stack.
class DeviceStack final : private hal::LinkObserver {
 public:
  /// `hand`: where it wants the handle, and its fingers, by time; in D. A program that uses
  /// StackCarrier::kUsb links haptic_usbfs. @throws tools::InputError  a setting out of range.
  DeviceStack(CoreSession& session, const StackSettings& settings,
              std::function<HandAction(double t_s)> hand);
  ~DeviceStack() override;
  DeviceStack(const DeviceStack&) = delete;
  DeviceStack& operator=(const DeviceStack&) = delete;

  /// One period of the device, the link and the servo loop.
  StackTick step();

  /// For a recorder: what the session depends on, its tape (StackCarrier::kUsb) and its ticks, also
  /// after restart_servo. Before the first step; null: no longer.
  [[nodiscard]] hal::BusSession bus_session() const;
  void record(hal::LinkTape* tape, hal::TickWatch watch, void* watch_context);

  /// The newest pose of a driven part, by their order in the scene, stamped by now_ns().
  void drive(std::size_t driven, const FrameRecord& record);

  // Access for tests between two periods.
  [[nodiscard]] ReferenceUsb& bus() { return *bus_; }
  void stall_servo(bool stalled) { servo_stalled_ = stalled; }
  void emergency_stop() { loop_->emergency_stop(); }
  /// Instead of the servo tick's: what a servo thread gone wrong might say.
  void say_instead(std::function<haptic::DeviceCommand(const haptic::DeviceCommand&)> command) {
    instead_ = std::move(command);
  }
  void servo_lost();
  /// The call of the link, with StackCarrier::kUsb.
  void stop_link();
  /// The machine sleeps for a second; no time passes that its clock would show.
  void suspend() { slept_ns_ += 1'000'000'000; }
  /// The servo loop and its history start again, as after a restart of its process.
  void restart_servo();
  /// Unplugged for good, or plugged in again (with `power`: the device was without power too).
  void unplug();
  void plug(bool power);

  [[nodiscard]] std::int64_t now_ns() const { return now_ns_; }
  [[nodiscard]] double period_s() const;
  [[nodiscard]] LawId law() const { return session_.view().parameters().law; }
  [[nodiscard]] hal::LinkCounters link_counters() const;
  [[nodiscard]] std::vector<StepTrace> flight() const;

 private:
  class DirectLink;
  static std::int64_t clock(void* self);
  static std::int64_t slept(void* self);
  static void saw(void* self, const ServoInput& input, const ServoResult& result);
  [[nodiscard]] ServoParameters servo_parameters() const;
  [[nodiscard]] hal::LinkSettings link_settings() const;
  void serve_servo(bool by_report);
  void on_report(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
                 hal::ReportVerdict verdict, std::uint64_t sequence) noexcept override;
  void on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
               const hal::GuardedOutput& output) noexcept override;
  void on_link(std::int64_t stamp_ns, LinkState state, hal::HalStatus why) noexcept override;

  CoreSession& session_;
  StackSettings settings_;
  ReferenceModel model_;
  hal::ReferenceDriver driver_;
  hal::MailboxMemory mailbox_;
  std::array<NewestRecord<FrameRecord>, kMostDriven> driven_;
  std::array<std::optional<NewestWriter<FrameRecord>>, kMostDriven> driven_writers_;
  std::unique_ptr<ReferenceUsb> bus_;
  std::unique_ptr<hal::UsbLink> link_;
  std::unique_ptr<DirectLink> direct_;
  tools::SceneBytes recorder_memory_;
  std::unique_ptr<FlightRecorder> recorder_;
  std::unique_ptr<ServoTick> tick_;
  std::unique_ptr<hal::ServoLoop> loop_;
  std::function<haptic::DeviceCommand(const haptic::DeviceCommand&)> instead_;

  hal::TickWatch watch_ = nullptr;
  void* watch_context_ = nullptr;

  StackTick out_;
  std::int64_t now_ns_ = 0, period_ns_ = 0, slept_ns_ = 0;
  std::uint32_t seen_ = 0;  ///< states published before this period
  std::uint32_t stalled_periods_ = 0;
  bool servo_stalled_ = false, in_poll_ = false;
};

}  // namespace haptic::sim
