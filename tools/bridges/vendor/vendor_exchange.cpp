// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/vendor/vendor_exchange.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include "hal/clock/servo_clock.hpp"

namespace haptic::tools {

VendorExchange::VendorExchange(const VendorLimits& limits)
    : limits_(limits), woken_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}

VendorExchange::~VendorExchange() {
  if (woken_ >= 0) (void)close(woken_);
}

hal::BridgeRead VendorExchange::read(std::int64_t now_ns, hal::BridgeSample& sample) noexcept {
  // A counter that is not there is 0 looks at it; the state counts for itself.
  std::uint64_t count = 0;
  if (::read(woken_, &count, sizeof count) < 0) count = 0;
  const VendorState& state = look_.newest();
  if (state.lost != 0 || is_held(now_ns)) return hal::BridgeRead::kLost;
  if (state.samples != seen_) {
    seen_ = state.samples;
    sample = state.sample;
    return hal::BridgeRead::kNew;
  }
  if (seen_ == 0) return hal::BridgeRead::kSilent;
  const std::int64_t age_ns = now_ns - state.sample.sampled_ns;
  if (age_ns > kLongestSilence_ns) return hal::BridgeRead::kLost;
  return age_ns > 2 * limits_.period_ns ? hal::BridgeRead::kSilent : hal::BridgeRead::kSame;
}

bool VendorExchange::is_held(std::int64_t now_ns) noexcept {
  return limits_.longest_release_ns > 0 && order_.drives == 0 &&
         look_.newest().released != order_.release &&
         now_ns - release_ns_ > limits_.longest_release_ns;
}

bool VendorExchange::write(std::int64_t now_ns, const Wrench& wrench_d) noexcept {
  order_.written_ns = now_ns;
  order_.drives = 1;
  order_.wrench_d = record_of(is_finite(wrench_d) ? wrench_d : Wrench{});
  give_order_.publish(order_);
  const VendorState& state = look_.newest();
  return state.lost == 0 && state.holding == 0 &&
         now_ns - state.sample.sampled_ns <= kOldest_ns / 2;
}

bool VendorExchange::release(std::int64_t now_ns) noexcept {
  if (order_.drives != 0 || order_.release == 0) {
    release_ns_ = now_ns;
    order_.drives = 0;
    order_.wrench_d = {};
    ++order_.release;
    give_order_.publish(order_);
  }
  return look_.newest().released == order_.release;
}

bool VendorExchange::is_small(const Wrench& wrench) const noexcept {
  return wrench.force_w.norm() <= kLargestStart * limits_.max_force_n &&
         wrench.torque_w.norm() <= kLargestStart * limits_.max_torque_nm;
}

/// Decides if there is force in this turn.
void VendorExchange::decide(const VendorOrder& order, std::int64_t now_ns) noexcept {
  const bool ordered = order.drives != 0 && !stop_.load();
  const bool is_fresh = now_ns - order.written_ns <= kOldest_ns;
  const bool is_late = last_turn_ns_ != 0 && now_ns - last_turn_ns_ > kOldest_ns;
  last_turn_ns_ = now_ns;
  if (on_ && ordered && (is_late || !is_fresh)) cut_ = true;
  const bool wanted = ordered && is_fresh && !cut_;
  on_ = wanted && (on_ || is_small(wrench_of(order.wrench_d)));
}

void VendorExchange::publish() noexcept {
  tell_.publish(state_);
  const std::uint64_t one = 1;
  // Full: the bridge has not looked for a long time, and is woken anyway.
  [[maybe_unused]] const auto written = ::write(woken_, &one, sizeof one);
}

bool VendorExchange::turn(VendorHandle& handle) noexcept {
  const bool stopping = stop_.load();
  hal::BridgeSample sample;
  const VendorResult sensed = handle.sense(sample);
  sample.sampled_ns = hal::monotonic_ns();
  const VendorOrder& order = hear_.newest();
  decide(order, sample.sampled_ns);
  const VendorResult exerted = handle.exert(on_, on_ ? wrench_of(order.wrench_d) : Wrench{});
  if (on_ && exerted != VendorResult::kDone) cut_ = true;
  if (order.drives == 0 && !on_ && exerted == VendorResult::kDone) {
    state_.released = order.release;
    cut_ = false;
  }
  refused_ = sensed == VendorResult::kDone ? 0 : refused_ + 1;
  const bool lost =
      sensed == VendorResult::kLost || exerted == VendorResult::kLost || refused_ >= kMostRefused;
  if (sensed == VendorResult::kDone) {
    if (cut_) sample.faults |= kDeviceDriveFault;
    state_.sample = sample;
    ++state_.samples;
  }
  state_.lost = lost ? 1 : 0;
  state_.holding = order.drives != 0 && (cut_ || !on_) ? 1 : 0;
  publish();
  if (stopping && exerted == VendorResult::kDone) ended_.store(true);
  return !lost;
}

}  // namespace haptic::tools
