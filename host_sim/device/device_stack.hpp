// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The whole stack in one thread and in the devices' own time: a device for each hand
/// (device_line.hpp), servo tick, core. Equal calls give equal bits, so that a fault can be put
/// anywhere and a run can be compared with another.

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "hal/realtime/servo_loop.hpp"
#include "host_sim/device/device_line.hpp"
#include "host_sim/session/core_session.hpp"
#include "rt_core/exchange/newest_record.hpp"

namespace haptic::sim {

/// A device of a stack. `hand`: where it wants the handle, and its fingers, by time; in D.
struct StackDevice {
  StackSettings settings;
  std::function<HandAction(double t_s)> hand;
};

/// Owner: one thread. The session outlives the stack.
class DeviceStack {
 public:
  /// A program that uses StackCarrier::kUsb links haptic_usbfs. @throws tools::InputError  a
  /// setting out of range.
  DeviceStack(CoreSession& session, const StackSettings& settings,
              std::function<HandAction(double t_s)> hand);
  /// With a device for each hand of the scene. Both report at the rate of the first, timer-clocked.
  /// @throws tools::InputError  for a scene with another number of hands.
  DeviceStack(CoreSession& session, std::vector<StackDevice> devices);
  DeviceStack(const DeviceStack&) = delete;
  DeviceStack& operator=(const DeviceStack&) = delete;

  /// One period of the devices, the links and the servo loop. @return tick().
  const StackTick& step();
  /// The last period, by hand.
  [[nodiscard]] const StackTick& tick(std::size_t hand = 0) const { return lines_[hand]->tick(); }

  /// For a recorder: what the session depends on, its tape (StackCarrier::kUsb) and its ticks, also
  /// after restart_servo. Before the first step; null: no longer.
  [[nodiscard]] hal::BusSession bus_session() const;
  void record(hal::LinkTape* tape, hal::TickWatch watch, void* watch_context);

  /// The newest pose of a driven part, by their order in the scene, stamped by now_ns().
  void drive(std::size_t driven, const FrameRecord& record);

  // Access for tests between two periods.
  [[nodiscard]] ReferenceUsb& bus(std::size_t hand = 0) { return lines_[hand]->bus(); }
  void stall_servo(bool stalled) { servo_stalled_ = stalled; }
  void emergency_stop() { loop_->emergency_stop(); }
  /// Instead of the servo tick's: what a servo thread gone wrong might say.
  void say_instead(std::function<haptic::DeviceCommand(const haptic::DeviceCommand&)> command,
                   std::size_t hand = 0) {
    instead_[hand] = std::move(command);
  }
  void servo_lost();
  /// The call of the link, with StackCarrier::kUsb.
  void stop_link(std::size_t hand = 0) { lines_[hand]->stop_link(); }
  /// The machine sleeps for a second; no time passes that its clock would show.
  void suspend() { clock_.slept_ns += 1'000'000'000; }
  /// The servo loop and its history start again, as after a restart of its process.
  void restart_servo();
  /// Unplugged for good, or plugged in again (with `power`: the device was without power too).
  void unplug(std::size_t hand = 0) { lines_[hand]->unplug(); }
  void plug(bool power, std::size_t hand = 0) { lines_[hand]->plug(power); }

  [[nodiscard]] std::int64_t now_ns() const { return clock_.now_ns; }
  [[nodiscard]] double period_s() const;
  [[nodiscard]] LawId law() const { return session_.view().parameters().law; }
  [[nodiscard]] hal::LinkCounters link_counters(std::size_t hand = 0) const {
    return lines_[hand]->link_counters();
  }
  [[nodiscard]] std::vector<StepTrace> flight() const;

 private:
  static void saw(void* self, const ServoInput& input, const ServoResult& result);
  static void saw_second(void* self, const ServoInput& input, const ServoResult& result);
  [[nodiscard]] ServoParameters servo_parameters(std::size_t hand = 0) const;
  void make_tick();
  void serve_servo(bool by_report);

  CoreSession& session_;
  DeviceLine::Clock clock_;
  std::vector<std::unique_ptr<DeviceLine>> lines_;  ///< by hand
  std::array<NewestRecord<FrameRecord>, kMostDriven> driven_;
  std::array<std::optional<NewestWriter<FrameRecord>>, kMostDriven> driven_writers_;
  tools::SceneBytes recorder_memory_;
  std::unique_ptr<FlightRecorder> recorder_;  ///< of the first hand
  std::unique_ptr<ServoTick> tick_;
  std::unique_ptr<TwoHandTick> two_tick_;  ///< one of the two is null
  std::unique_ptr<hal::ServoLoop> loop_;
  std::array<std::function<haptic::DeviceCommand(const haptic::DeviceCommand&)>, kMostHands>
      instead_;
  hal::TickWatch watch_ = nullptr;
  void* watch_context_ = nullptr;
  std::uint32_t stalled_periods_ = 0;
  bool servo_ran_ = false;  ///< in this period
  bool servo_stalled_ = false;
};

}  // namespace haptic::sim
