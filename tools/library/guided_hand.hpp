// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The simulated hand of a session, which its owner leads from goal to goal.

#include <atomic>
#include <cstdint>

#include "rt_core/exchange/newest_record.hpp"
#include "tools/library/haptic.h"
#include "tools/run_device/simulated_peer.hpp"

namespace haptic::tools {

/// Order of the owner to the hand: handle poses in D.
struct HandOrder {
  std::uint64_t number = 0;  ///< of the goal; 0: none yet
  double pose_dh[7] = {0, 0, 0, 0, 0, 0, 1};
  double seconds = 0;
  std::uint64_t hold = HAPTIC_RELEASE;  ///< haptic_hold
};

/// Goes from where its last goal has led it to the next, without a jerk; orders and reached goals
/// cross threads without waiting.
class GuidedHand final : public SimulatedHand {
 public:
  HandWish wish(double t_s) noexcept override;                             ///< link's thread
  void order(const HandOrder& order) noexcept { writer_.publish(order); }  ///< one thread at a time
  [[nodiscard]] std::uint64_t reached() const noexcept {                   ///< any thread
    return reached_.load(std::memory_order_acquire);
  }
  /// Servo thread, after each tick.
  void note_fault(bool faulted) noexcept { faulted_.store(faulted, std::memory_order_relaxed); }
  /// Any thread: does not press until `allow_presses`; what is held stays held.
  void stop_presses() noexcept { stopped_.store(true, std::memory_order_relaxed); }
  void allow_presses() noexcept { stopped_.store(false, std::memory_order_relaxed); }
  [[nodiscard]] bool holds() const noexcept { return holds_.load(std::memory_order_relaxed); }

 private:
  [[nodiscard]] bool presses(std::uint64_t hold, double t_s) noexcept;

  NewestRecord<HandOrder> orders_;
  NewestWriter<HandOrder> writer_{orders_};
  NewestReader<HandOrder> reader_{orders_};
  HandWish from_, now_;
  double from_s_ = 0;
  std::uint64_t number_ = 0;
  std::atomic<std::uint64_t> reached_{0};
  double pressed_s_ = 0, released_s_ = 0;  ///< since when, as the switch is
  std::atomic<bool> holds_{false}, faulted_{false}, stopped_{false};
};

}  // namespace haptic::tools
