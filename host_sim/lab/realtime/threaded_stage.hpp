// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The stage of the fault matrix in real time: the stack in its threads, the caller's thread is the
/// device. A period is one of the wall clock; where the machine let a thread be late, the sample of
/// that period says by how much.

#include <array>
#include <atomic>
#include <cstdint>

#include "host_sim/lab/faults/fault_stage.hpp"
#include "host_sim/lab/realtime/threaded_loop.hpp"
#include "rt_core/exchange/spsc_ring.hpp"

namespace haptic::sim {

/// Allocations of the two threads.
struct ThreadHeap {
  std::uint64_t servo_calls = 0;  ///< of all servo threads within their loops, so far
  /// Of the USB thread at its last send, less the one that libusb makes for each transfer that it
  /// submits: it must stand still while reports flow. Connecting allocates.
  std::int64_t usb_calls = 0;
};

/// Owner: the thread that plays the device. Takes SCHED_FIFO for it.
class ThreadedStage final : public FaultStage, private hal::LinkObserver {
 public:
  /// `heap_calls`: allocations of the calling thread so far; null: not counted.
  ThreadedStage(std::span<const std::byte> scene, const StackSettings& stack,
                std::uint64_t (*heap_calls)());
  ~ThreadedStage() override;

  [[nodiscard]] ReferenceUsb& bus() override { return loop_.bus(); }
  void emergency_stop() override { loop_.loop().emergency_stop(); }
  void stop_link() override { loop_.link().emergency_stop(); }
  void suspend() override { slept_ns_.fetch_add(1'000'000'000); }
  void stall_servo(unsigned periods) override;
  void spoil_commands(FaultCause cause) override { spoil_.store(cause); }
  void lose_servo() override;
  void release_servo() override { spoil_.store(FaultCause::kNothing); }
  void restart_servo() override;
  void unplug() override { bus().unplug(); }
  void plug(bool power) override;

  /// The caller has done something else meanwhile: the next period begins now, and is not late.
  void restart();
  [[nodiscard]] ThreadHeap heap() const;
  [[nodiscard]] LoopGrants grants() const;
  [[nodiscard]] int servo_error() const { return loop_.servo_error(); }
  [[nodiscard]] std::uint64_t lost_sends() const { return lost_sends_.load(); }

 private:
  /// A command as it went out.
  struct SentBytes {
    std::int64_t stamp_ns = 0;
    std::uint32_t size = 0;
    std::array<std::uint8_t, 64> bytes{};
  };

  FaultSample pass_period() override;
  [[nodiscard]] ThreadedLoopSettings settings_of(const StackSettings& stack);
  void take_sends(FaultSample& sample);
  [[nodiscard]] HandAction note_begin(double t_s);
  static std::int64_t link_clock(void* self);
  static std::int64_t link_slept(void* self);
  static std::int64_t tick_clock(void* self);
  static void saw(void* self, const ServoInput& input, const ServoResult& result);
  void note_tick(const ServoInput& input, const ServoResult& result) noexcept;
  void on_report(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
                 hal::ReportVerdict verdict, std::uint64_t sequence) noexcept override;
  void on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
               const hal::GuardedOutput& output) noexcept override;
  void on_link(std::int64_t stamp_ns, LinkState state, hal::HalStatus why) noexcept override;

  const std::int64_t period_ns_;
  std::uint64_t (*heap_calls_)();
  CoreSession session_;
  ThreadedLoop loop_;
  std::int64_t next_ns_ = 0;     ///< of the device's next period
  std::uint32_t acts_ = 0;       ///< sequence of the command that acts in this period
  std::uint32_t last_sent_ = 0;  ///< sequence of the newest command reported
  int priority_error_ = 0;

  // Of the servo thread, read by the device's.
  std::atomic<ArmingState> arming_{ArmingState::kDisarmed};
  std::atomic<std::uint32_t> safety_{0}, told_{0}, told_since_{0};
  std::atomic<std::int64_t> tick_late_ns_{0};
  std::atomic<std::uint64_t> servo_calls_{0};
  std::uint64_t servo_calls_before_ = 0;
  // Of the device's thread, read by the servo thread.
  std::atomic<std::int64_t> stalled_until_ns_{0};
  std::atomic<std::int64_t> slept_ns_{0};  ///< the machine
  std::atomic<FaultCause> spoil_{FaultCause::kNothing};

  // Of the USB thread.
  SpscRing<SentBytes, 1024> sent_;
  std::atomic<std::int64_t> usb_late_ns_{0};
  std::atomic<std::int64_t> usb_calls_{0};
  std::atomic<std::uint64_t> lost_sends_{0};
  std::int64_t submits_ = 0;
  std::int64_t last_look_ns_ = 0;
};

}  // namespace haptic::sim
