// SPDX-License-Identifier: Apache-2.0
#include "tools/library/bodies.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "tools/library/call.hpp"

namespace haptic::tools {

namespace {

Pose in_w(const Pose& frame, const Pose& pose) noexcept {
  return {frame.p_wa + frame.q_wa * pose.p_wa, frame.q_wa * pose.q_wa};
}

}  // namespace

void note_holds(const Hands& hands, HeldNow& now) noexcept {
  const Pose frame = pose_of_numbers(now.frame_pose);
  for (std::uint32_t k = 0; k < hands.count(); ++k) {
    const PartHand& hand = hands.hand(k);
    const PartHand::Phase phase = hand.phase();
    const bool holds = phase == PartHand::Phase::kHolding || phase == PartHand::Phase::kLettingGo;
    now.hold[k] = holds ? hand.part() + 1 : 0;
    write_numbers(in_w(frame, hands.felt_wa(k)), now.felt_pose[k]);
  }
}

void note_driven(const PartHand& hand, HeldNow& now) noexcept {
  const Pose frame = pose_of_numbers(now.frame_pose);
  const DrivenParts& parts = hand.driven();
  now.driven_count = parts.count();
  for (std::uint32_t k = 0; k < parts.count(); ++k) {
    const DrivenState& state = parts.states()[k];
    haptic_driven& driven = now.driven[k];
    driven = haptic_driven{};
    driven.part = parts.record(k).part;
    write_numbers(in_w(frame, state.felt_wa), driven.pose);
    write_numbers(in_w(frame, state.commanded_wa), driven.commanded);
    driven.lag_m = static_cast<double>(state.lag_m);
    driven.lag_rad = static_cast<double>(state.lag_rad);
    const Wrench& pushed = state.pushed_w;
    write_numbers(Wrench{frame.q_wa * pushed.force_w, frame.q_wa * pushed.torque_w}, driven.wrench);
    driven.touches = state.touches() ? 1 : 0;
    driven.lost = state.is_lost ? 1 : 0;
  }
}

std::uint32_t driven_of(const PartScenes& parts, std::uint32_t part) noexcept {
  for (std::uint32_t k = 0; k < parts.driven().size(); ++k)
    if (parts.driven()[k].part == part) return k;
  return kMostDriven;
}

bool is_owned(const PartScenes& parts, std::uint32_t part) noexcept {
  return driven_of(parts, part) < kMostDriven && parts[part].role == PartRole::kDriven;
}

int check_frame(const haptic_frame* frame) noexcept {
  if (const int error = check_structure(frame); error != HAPTIC_OK) return error;
  const bool is_right = is_within(frame->fastest_m_per_s, 0.001, kMostFrame_m_per_s) &&
                        is_within(frame->fastest_rad_per_s, 0.001, kMostFrame_rad_per_s) &&
                        is_within(frame->late_s, 0.005, kMostFrame_late_s);
  return is_right ? HAPTIC_OK : HAPTIC_ERROR_NUMBER;
}

FrameRecord next_record(const FrameRecord& last, const haptic_frame& frame,
                        std::int64_t stamp_ns) noexcept {
  FrameRecord record;
  record.number = last.number + 1;
  record.stamp_ns = stamp_ns;
  std::copy_n(frame.pose, 3, record.p_m);
  std::copy_n(frame.pose + 3, 4, record.q_xyzw);
  record.fastest_m_per_s = frame.fastest_m_per_s;
  record.fastest_rad_per_s = frame.fastest_rad_per_s;
  record.late_ns = std::llround(1e9 * frame.late_s);
  record.stands = frame.stands;
  return record;
}

std::size_t write_driven(const HeldNow& now, std::span<haptic_driven> driven) noexcept {
  const auto count = static_cast<std::size_t>(now.driven_count);
  std::copy_n(now.driven.begin(), std::min(driven.size(), count), driven.begin());
  return count;
}

std::size_t write_bodies(const PartScenes& parts, const PartHand& hand, const HeldNow& now,
                         std::span<haptic_body> bodies) noexcept {
  const Pose frame = pose_of_numbers(now.frame_pose);
  const std::size_t count = std::min<std::size_t>(bodies.size(), parts.count());
  for (std::uint32_t k = 0; k < count; ++k) {
    haptic_body& body = bodies[k];
    body = haptic_body{};
    body.part = k;
    body.role = static_cast<std::uint32_t>(parts[k].role);
    const std::string_view name = parts.name(k);
    name.copy(body.name, sizeof body.name - 1);
    if (const std::uint32_t d = driven_of(parts, k); d < now.driven_count) {
      std::copy_n(now.driven[d].pose, 7, body.pose);
      continue;
    }
    if (const auto held = std::ranges::find(now.hold, k + 1); held != now.hold.end()) {
      const auto number = static_cast<std::size_t>(held - now.hold.begin());
      body.held_by = static_cast<std::uint32_t>(number) + 1;
      std::copy_n(now.felt_pose[number], 7, body.pose);
      continue;
    }
    double pose[7];
    std::copy_n(hand.places()[k].p_wa_m, 3, pose);
    std::copy_n(hand.places()[k].q_wa_xyzw, 4, pose + 3);
    const Pose placed = pose_of_numbers(pose);
    write_numbers(in_w(frame, placed), body.pose);
  }
  return parts.count();
}

}  // namespace haptic::tools
