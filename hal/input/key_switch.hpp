// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One key of a Linux input device (evdev) as a switch: a foot pedal or a keyboard as the deadman
/// switch of a device that has none.
///
/// Pressed is what the key's own press says and nothing else. A device that is not there, goes away
/// or loses events is a released one until the key is pressed again. A pedal is silent while it is
/// held, so that one which hangs with its key down is not noticed: this is no emergency stop.

#include <linux/input.h>
#include <pthread.h>

#include <atomic>
#include <cstdint>
#include <string>

#include "hal/input/switch_source.hpp"

namespace haptic::hal {

struct KeySwitchSettings {
  std::string path;       ///< /dev/input/by-id/...; read only, not grabbed
  std::uint16_t key = 0;  ///< EV_KEY code, as evtest shows it
  std::uint32_t mask = kInputSwitch;
};

/// `pressed` reads what has come, in a bounded number of reads, with no call that waits. Opening
/// and closing may wait for the device: a thread of ordinary priority does both, every
/// 0.1 s until the device is there.
class KeySwitch final : public SwitchSource {
 public:
  explicit KeySwitch(const KeySwitchSettings& settings);
  ~KeySwitch() override;
  KeySwitch(const KeySwitch&) = delete;
  KeySwitch& operator=(const KeySwitch&) = delete;

  [[nodiscard]] std::uint32_t pressed() noexcept override;
  /// From any thread: whether the device is open.
  [[nodiscard]] bool is_open() const noexcept { return fd_.load(std::memory_order_acquire) >= 0; }

 private:
  static void* entry(void* self);
  void look() noexcept;
  [[nodiscard]] bool take_events(int fd) noexcept;
  void take(const input_event& event) noexcept;

  KeySwitchSettings settings_;
  bool down_ = false;  ///< the link's thread's own
  std::atomic<int> fd_{-1}, gone_{-1};
  std::atomic<bool> stop_{false};
  pthread_t thread_{};
  bool has_thread_ = false;
};

}  // namespace haptic::hal
