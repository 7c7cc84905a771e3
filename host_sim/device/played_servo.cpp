// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/played_servo.hpp"

#include <algorithm>
#include <bit>

namespace haptic::sim {
namespace {

using hal::RecordedTick;

/// Commands computed ahead of the link that takes them; more wait for it.
constexpr std::size_t kMostCommandsAhead = 4096;

bool same_bits(const std::array<double, 6>& a, const std::array<double, 6>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), [](double x, double y) {
    return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
  });
}

/// Of a state that a tick saw: what tells it from the others that the link published.
bool is_seen(const RecordedTick& tick, const haptic::DeviceState& state) {
  ServoInput input;
  input.state = state;
  const RecordedTick of = hal::recorded(input, ServoResult{});
  return of.sequence == tick.sequence && of.stamp_ns == tick.stamp_ns && of.link == tick.link &&
         of.twist_valid == tick.twist_valid && of.device_faults == tick.device_faults &&
         of.accepted_tick == tick.accepted_tick && same_bits(of.accepted_d, tick.accepted_d);
}

bool is_made(const RecordedTick& expected, const RecordedTick& found) {
  return expected.tick == found.tick && expected.state_content == found.state_content &&
         expected.state_hash == found.state_hash &&
         same_bits(expected.command_d, found.command_d) &&
         expected.command_sequence == found.command_sequence && expected.arming == found.arming &&
         expected.faults == found.faults && expected.limiter_flags == found.limiter_flags &&
         expected.arming_state == found.arming_state;
}

}  // namespace

PlayedServo::PlayedServo(CoreSession& session, const hal::BusSession& header,
                         std::span<const std::uint8_t> file, std::size_t first)
    : session_(session), parameters_(header.servo), track_(file, first) {
  states_.emplace_back();  // what a mailbox holds before the first
  restart();
}

void PlayedServo::restart() {
  session_.core().reset();
  tick_ = std::make_unique<ServoTick>(session_.core(), parameters_,
                                      session_.view().header().capacity, nullptr);
}

bool PlayedServo::step() {
  if (!track_.has_next() || !difference_.empty()) return false;
  const RecordedTick& expected = track_.next();
  const auto state = std::ranges::find_if(
      states_, [&](const haptic::DeviceState& s) { return is_seen(expected, s); });
  if (state == states_.end()) return false;
  states_.erase(states_.begin(), state);
  if (expected.tick == 1 && ticks_ > 0) restart();
  ServoInput input;
  input.state = states_.front();
  input.now_ns = expected.now_ns;
  input.late_periods = expected.late_periods;
  input.emergency_stop = expected.emergency_stop;
  const ServoResult result = tick_->step(input);
  const RecordedTick found = hal::recorded(input, result);
  if (!is_made(expected, found)) {
    difference_ = difference(expected, found);
    return false;
  }
  commands_.push_back(result.command);
  ++ticks_;
  track_.advance();
  return true;
}

void PlayedServo::run() {
  while (commands_.size() < kMostCommandsAhead && step()) {
  }
}

const DeviceCommand* PlayedServo::command(std::uint64_t tick, std::int64_t stamp_ns) {
  for (;;) {
    while (!commands_.empty()) {
      const DeviceCommand& oldest = commands_.front();
      if (oldest.tick == tick && oldest.stamp_ns == stamp_ns) return &oldest;
      commands_.pop_front();
    }
    if (!step()) return nullptr;
  }
}

void PlayedServo::run_to_end() {
  while (step()) commands_.clear();
}

}  // namespace haptic::sim
