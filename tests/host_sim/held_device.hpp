// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A device on the bus of this process, in real time; a guardian that holds it; a servo process
/// that renders a cube on a wall; and an operator whose hand presses it in. Everything that is
/// handed to the device and everything that it does is written down, and judged afterwards.

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hal/drivers/reference_driver.hpp"
#include "hal/realtime/device_guardian.hpp"
#include "hal/usb/usb_link.hpp"
#include "host_sim/device/reference_usb.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::test {

inline constexpr double kFullForce_n = 10;  ///< of the device's 12: what counts as pressed hard
inline constexpr unsigned kDeadman = 1;
inline constexpr std::uint64_t kHashEvery = 100;  ///< ticks between two hashes on the pipe

/// A command handed to the bus.
struct SentCommand {
  std::int64_t stamp_ns = 0;
  sim::Vector force_n = sim::Vector::Zero(), torque_nm = sim::Vector::Zero();
  bool drives_on = false;
  std::uint64_t tick = 0;    ///< of the servo, that it rests on
  std::uint32_t faults = 0;  ///< latched in the guard
};

/// A period of the device.
struct DevicePeriod {
  std::int64_t wall_ns = 0;  ///< when it ended
  sim::Vector force_n = sim::Vector::Zero();
  bool drives_on = false;
  std::uint32_t cuts = 0;
};

/// Written by one thread, read by others up to size(). Full: what comes is left out.
template <class T>
class Log {
 public:
  Log() : items_(kRoom) {}
  void add(const T& item) noexcept {
    const std::size_t at = size_.load(std::memory_order_relaxed);
    if (at == kRoom) return;
    items_[at] = item;
    size_.store(at + 1, std::memory_order_release);
  }
  [[nodiscard]] std::size_t size() const noexcept { return size_.load(std::memory_order_acquire); }
  [[nodiscard]] std::span<const T> items() const noexcept { return {items_.data(), size()}; }

 private:
  static constexpr std::size_t kRoom = 1u << 17;
  std::vector<T> items_;
  std::atomic<std::size_t> size_{0};
};

/// What a servo process reports in addition to its flight recorder.
struct HashNote {
  std::uint64_t tick = 0, hash = 0;
};

class HeldDevice final : private hal::LinkObserver {
 public:
  explicit HeldDevice(unsigned spares);
  ~HeldDevice() override;

  /// The operator releases the switch, lifts the cube off the wall, presses the deadman and then
  /// the cube into the wall until kFullForce_n act; again when the scheduler of this machine lets
  /// ticks be so late that the servo lets go. False: not within the patience.
  [[nodiscard]] bool press();
  /// Lets go of everything, until no force acts.
  [[nodiscard]] bool lift();
  /// The hand presses in or lifts, the deadman is held or not.
  void hold(bool deadman, bool pressing);

  /// Periods of the device pass. False: they do not.
  [[nodiscard]] bool pass(std::size_t periods) const;

  /// The servo process is ended by SIGSEGV just before its next tick.
  void crash_servo() { flags().crash.store(true); }
  /// The USB thread hangs, as if this process were dead; or goes on.
  void hang_usb(bool hangs) { hangs_.store(hangs); }
  /// Hashes of the servo process, as many as it has reported.
  [[nodiscard]] std::vector<HashNote> hash_notes();

  [[nodiscard]] hal::DeviceGuardian& guardian() { return guardian_; }
  [[nodiscard]] hal::UsbLink& link() { return *link_; }
  [[nodiscard]] std::span<const SentCommand> sent() const { return sent_.items(); }
  [[nodiscard]] std::span<const DevicePeriod> periods() const { return periods_.items(); }
  [[nodiscard]] double force_n() const;
  [[nodiscard]] const SafetyLimits& limits() const { return limits_; }
  [[nodiscard]] unsigned presses() const { return presses_; }

 private:
  struct Flags {
    std::atomic<bool> crash{false};
  };
  struct Servo;
  [[nodiscard]] Flags& flags() { return *flags_; }
  [[nodiscard]] int serve(const hal::ServoSeat& seat);
  [[nodiscard]] sim::HandAction hand(double t_s);
  [[nodiscard]] bool reaches(double low_n, double high_n, std::size_t periods) const;
  void on_report(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
                 hal::ReportVerdict verdict, std::uint64_t sequence) noexcept override;
  void on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
               const hal::GuardedOutput& output) noexcept override;
  void on_link(std::int64_t, LinkState, hal::HalStatus) noexcept override {}

  sim::CoreSession session_;
  SafetyLimits limits_;
  hal::SharedMemory memory_{sizeof(Flags)};
  Flags* flags_ = nullptr;
  int notes_[2] = {-1, -1};  ///< pipe
  hal::DeviceGuardian guardian_;

  Log<SentCommand> sent_;
  Log<DevicePeriod> periods_;
  std::atomic<bool> deadman_{false}, pressing_{false}, hangs_{false};
  double depth_m_ = 0;  ///< of the hand's target; the device's thread's own
  unsigned presses_ = 0;

  std::unique_ptr<sim::ReferenceModel> model_;
  std::unique_ptr<sim::ReferenceUsb> usb_;
  hal::ReferenceDriver driver_;
  std::unique_ptr<hal::UsbLink> link_;
};

}  // namespace haptic::test
