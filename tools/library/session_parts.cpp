// SPDX-License-Identifier: Apache-2.0
#include "tools/library/session_parts.hpp"

#include <stdexcept>

#include "hal/clock/servo_clock.hpp"
#include "tools/library/call.hpp"

namespace haptic::tools {

SessionParts::SessionParts(const SceneView& view) {
  if (HeldParts::open(view, parts_) != RtStatus::kOk)
    throw std::logic_error("the parts of a scene that was opened are refused");
  for (std::size_t k = 0; k < driven_.size(); ++k) streams_[k].writer.emplace(driven_[k]);
  if (parts_ != nullptr) return;  // they have cores of their own
  core_memory_ = SceneBytes(HapticCore::state_bytes(view));
  if (HapticCore::create(core_memory_.span(), view, core_) != RtStatus::kOk)
    throw std::logic_error("the core refuses a scene that was opened");
}

HeldNow SessionParts::after(const ServoResult& result) const noexcept {
  HeldNow held;
  write_numbers(result.frame_wf, held.frame_pose);
  if (parts_ != nullptr) note_holds(parts_->hands, held);
  if (parts_ != nullptr) note_driven(parts_->hand(), held);
  return held;
}

int SessionParts::hold_part(std::uint32_t part, std::int64_t period_ns,
                            const std::atomic<bool>& ended) {
  if (parts_ == nullptr || part >= parts_->scenes.count() || !parts_->scenes.may_be_taken(part))
    return HAPTIC_ERROR_PART;
  constexpr std::int64_t kLongestRamp_ns = 2'000'000'000;
  const std::int64_t until_ns = hal::monotonic_ns() + kLongestRamp_ns;
  while (true) {
    if (const int error = go_on_to(part); error != HAPTIC_ERROR_BUSY) return error;
    if (ended.load() || hal::monotonic_ns() >= until_ns) return HAPTIC_ERROR_BUSY;
    (void)hal::sleep_until(hal::monotonic_ns() + period_ns);
  }
}

/// Does what can be done now on the way to holding `part`. HAPTIC_ERROR_BUSY: it is not all.
int SessionParts::go_on_to(std::uint32_t part) {
  const std::lock_guard lock(mutex_);
  PartHand& hand = parts_->hand();
  switch (hand.phase()) {
    case PartHand::Phase::kEmpty:
      // Its scene was opened before, and a pose that was felt is a pose.
      return hand.prepare(part) == RtStatus::kOk ? HAPTIC_OK : HAPTIC_ERROR_INTERNAL;
    case PartHand::Phase::kHolding:
      if (hand.part() == part) return HAPTIC_OK;
      hand.release();
      break;
    case PartHand::Phase::kLettingGo:
    case PartHand::Phase::kPrepared:
      break;
  }
  return HAPTIC_ERROR_BUSY;
}

int SessionParts::release_part() {
  if (parts_ == nullptr || parts_->scenes.holds_throughout()) return HAPTIC_ERROR_PART;
  const std::lock_guard lock(mutex_);
  parts_->hand().release();
  return HAPTIC_OK;
}

std::size_t SessionParts::bodies(const HeldNow& now, std::span<haptic_body> bodies) const {
  if (parts_ == nullptr) return 0;
  const std::lock_guard lock(mutex_);
  return write_bodies(parts_->scenes, parts_->hand(), now, bodies);
}

void SessionParts::move_fixed(const haptic_frame& frame, std::int64_t now_ns) noexcept {
  frame_ = next_record(frame_, frame, now_ns);
  frame_writer_.publish(frame_);
}

int SessionParts::drive(std::uint32_t part, const haptic_frame& frame,
                        std::int64_t now_ns) noexcept {
  const std::uint32_t k = parts_ != nullptr ? driven_of(parts_->scenes, part) : kMostDriven;
  if (k == kMostDriven || !is_owned(parts_->scenes, part)) return HAPTIC_ERROR_PART;
  DrivenStream& stream = streams_[k];
  stream.last = next_record(stream.last, frame, now_ns);
  stream.writer->publish(stream.last);
  return HAPTIC_OK;
}

}  // namespace haptic::tools
