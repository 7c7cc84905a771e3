// SPDX-License-Identifier: Apache-2.0
/// Any bytes as a compiled scene: refused, or good for a core whose ticks stay within memory and
/// within the bounds that the header states. Length and hash are corrected first, or hardly any
/// mutation would reach the checks behind them.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>
#include <string>

#include "rt_core/hands.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/support/counter_bounds.hpp"
#include "tools/common/scene_bytes.hpp"

namespace {

using haptic::fuzz::require;

void correct_header(std::span<std::byte> blob) {
  if (blob.size() < sizeof(haptic::SceneHeader)) {
    return;
  }
  haptic::SceneHeader header;
  std::memcpy(&header, blob.data(), sizeof header);
  std::memcpy(header.magic, haptic::kSceneMagic, sizeof header.magic);
  header.version = haptic::kSceneVersion;
  header.byte_count = blob.size();
  header.content_hash = 0;
  std::memcpy(blob.data(), &header, sizeof header);
  header.content_hash = haptic::scene_content_hash(blob);
  std::memcpy(blob.data(), &header, sizeof header);
}

/// The scenes inside one with parts, whose hashes a mutation has left behind too.
void correct_parts(std::span<std::byte> blob) {
  haptic::SceneView scene;
  if (haptic::SceneView::open(blob, scene) != haptic::RtStatus::kOk) return;
  std::span<std::byte> inside;
  std::span<const haptic::PartRecord> parts;
  std::span<const haptic::BodyPairRecord> pairs;
  for (const haptic::SectionEntry& s : scene.sections()) {
    const auto offset = static_cast<std::size_t>(s.offset);
    const auto bytes = static_cast<std::size_t>(s.count * s.element_bytes);
    if (s.id == haptic::SectionId::kPartScenes) inside = blob.subspan(offset, bytes);
    if (s.id == haptic::SectionId::kParts && s.element_bytes == sizeof(haptic::PartRecord))
      parts = {reinterpret_cast<const haptic::PartRecord*>(blob.data() + offset),
               static_cast<std::size_t>(s.count)};
    if (s.id == haptic::SectionId::kBodyPairs && s.element_bytes == sizeof(haptic::BodyPairRecord))
      pairs = {reinterpret_cast<const haptic::BodyPairRecord*>(blob.data() + offset),
               static_cast<std::size_t>(s.count)};
  }
  const auto correct_scene = [&](std::uint64_t begin, std::uint64_t size) {
    if (begin > inside.size() || size > inside.size() - begin) return;
    correct_header(inside.subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(size)));
  };
  for (const haptic::PartRecord& part : parts) correct_scene(part.scene_begin, part.scene_bytes);
  for (const haptic::BodyPairRecord& pair : pairs)
    correct_scene(pair.scene_begin, pair.scene_bytes);
  correct_header(blob);
}

haptic::Real real(double x) { return static_cast<haptic::Real>(x); }

/// The scene's start, moved along y and z by shares of the part's radius.
haptic::StepInput beside_start(const haptic::SceneView& scene, double share_y, double share_z) {
  const haptic::SceneParameters& p = scene.parameters();
  const double radius_m = scene.piece(0).record->radius_m;
  const double* q = p.start_q_wa_xyzw;
  haptic::StepInput input;
  input.pose_wa.p_wa =
      haptic::Vec3(real(p.start_p_wa_m[0]), real(p.start_p_wa_m[1] + share_y * radius_m),
                   real(p.start_p_wa_m[2] + share_z * radius_m));
  input.pose_wa.q_wa = haptic::Quat(real(q[3]), real(q[0]), real(q[1]), real(q[2]));
  input.report_goal_contact = true;
  return input;
}

/// From the start down and aside so slowly that a proxy keeps up and is pressed on what is below.
constexpr unsigned kPressedTicks = 20;
haptic::StepInput pressed(const haptic::SceneView& scene, unsigned tick) {
  return beside_start(scene, 0.02 * tick, -0.1 * tick);
}

/// Leaps about the start: apart, touching, deep, turned, and two that must be refused.
constexpr unsigned kLeaps = 12;
haptic::StepInput leap(const haptic::SceneView& scene, unsigned tick) {
  const double share = tick == 0 ? 0.0 : 0.3 * (tick - 4.0);
  haptic::StepInput input = beside_start(scene, share, -3.0 * share);
  const double half = 0.3 * tick;
  if (tick % 3 == 2) {
    input.pose_wa.q_wa = haptic::Quat(real(std::cos(half)), real(0.6 * std::sin(half)), real(0.0),
                                      real(0.8 * std::sin(half)));
  }
  if (tick == 7) {
    input.pose_wa.p_wa[1] = std::nan("");
  } else if (tick == 8) {
    input.pose_wa.q_wa.w() = real(2.0);
  }
  return input;
}

void check_tick(const haptic::SceneCapacity& bounds, const haptic::StepResult& result) {
  const std::string over = haptic::test::over_bound(result.counters, bounds);
  require(over.empty(), ("within the header's bound: " + over).c_str());
  const haptic::Wrench& w = result.wrench_w;
  bool finite = !result.has_goal_contact || std::isfinite(static_cast<double>(result.d_near_m));
  for (int i = 0; i < 3; ++i) {
    finite = finite && std::isfinite(static_cast<double>(w.force_w[i])) &&
             std::isfinite(static_cast<double>(w.torque_w[i]));
  }
  require(finite, "force, torque and a depth that was searched are finite");
}

void run_core(const haptic::SceneView& scene) {
  const std::size_t size = haptic::HapticCore::state_bytes(scene);
  require(size <= (std::size_t{1} << 28), "the memory of a core follows from the scene's size");
  haptic::tools::SceneBytes memory(size);
  haptic::HapticCore* core = nullptr;
  const haptic::RtStatus created = haptic::HapticCore::create(memory.span(), scene, core);
  require((created == haptic::RtStatus::kOk) == (core != nullptr), "a core exists if created");
  if (core == nullptr) {
    return;
  }
  for (unsigned tick = 0; tick < kPressedTicks; ++tick) {
    check_tick(scene.header().capacity, core->step(pressed(scene, tick)));
  }
  for (unsigned tick = 0; tick < kLeaps; ++tick) {
    check_tick(scene.header().capacity, core->step(leap(scene, tick)));
  }
}

constexpr std::size_t kMostLawBytes = std::size_t{1} << 26;

/// Takes every part that may be held, and lets it go; two hands press theirs on.
void run_parts(const haptic::SceneView& scene) {
  haptic::PartScenes parts;
  if (haptic::PartScenes::open(scene, parts) != haptic::RtStatus::kOk || parts.count() == 0) return;
  // Nobody checks that the law needs as much as the scene says.
  if (parts.most_law_bytes() > kMostLawBytes) return;
  haptic::tools::SceneBytes bytes[2], state[2], law[2];
  for (int k = 0; k < 2; ++k) {
    bytes[k] = haptic::tools::SceneBytes(parts.most_bytes());
    state[k] = haptic::tools::SceneBytes(parts.most_state_bytes());
    law[k] = haptic::tools::SceneBytes(parts.most_law_bytes());
  }
  haptic::Hands hands;
  if (hands.begin(parts, {haptic::PartHand::Room{bytes[0].span(), state[0].span(), law[0].span()},
                          {bytes[1].span(), state[1].span(), law[1].span()}}) !=
      haptic::RtStatus::kOk) {
    return;
  }
  haptic::PartHand& hand = hands.hand(0);
  // Driven parts come from their start along -x, as fast as they may.
  std::array<haptic::FrameRecord, haptic::kMostDriven> frames;
  const std::span<const haptic::FrameRecord> newest =
      std::span(frames).first(parts.driven().size());
  std::uint64_t ticks = 0;
  const auto step_hand = [&](const haptic::StepInput& input) {
    constexpr double kTick_s = 1e-3;
    ++ticks;
    const auto now_ns = static_cast<std::int64_t>(ticks * 1'000'000);
    for (std::size_t k = 0; k < newest.size(); ++k) {
      const haptic::DrivenRecord& driven = parts.driven()[k];
      const haptic::PartPlace start = parts.start_of(driven.part);
      haptic::FrameRecord& frame = frames[k];
      frame.number = ticks;
      frame.stamp_ns = now_ns;
      std::ranges::copy(start.p_wa_m, frame.p_m);
      std::ranges::copy(start.q_wa_xyzw, frame.q_xyzw);
      frame.p_m[0] -= kTick_s * static_cast<double>(ticks) * driven.fastest_m_per_s;
      frame.fastest_m_per_s = driven.fastest_m_per_s;
      frame.fastest_rad_per_s = driven.fastest_rad_per_s;
      frame.late_ns = static_cast<std::int64_t>(1e9 * driven.late_s);
    }
    hands.follow({newest, now_ns, true});
    const bool has_second = hands.count() > 1 && ticks % 5 != 0;
    const haptic::StepInput second =
        has_second ? pressed(hands.hand(1).scene(), static_cast<unsigned>(ticks)) : input;
    const haptic::Hands::Each<haptic::StepResult> results =
        hands.step({&input, has_second ? &second : nullptr});
    for (const haptic::StepResult& result : results) check_tick(hands.bounds(), result);
  };
  constexpr unsigned kLongestRamp = 400;
  if (hands.count() > 1) {
    for (unsigned tick = 0; tick < kPressedTicks; ++tick) step_hand(pressed(hand.scene(), tick));
    return;
  }
  for (std::uint32_t part = 0; part < parts.count(); ++part) {
    for (unsigned tick = 0; tick < kPressedTicks; ++tick) step_hand(pressed(hand.scene(), tick));
    hand.release();
    const haptic::StepInput still = pressed(hand.scene(), kPressedTicks);
    for (unsigned k = 0; k < kLongestRamp; ++k) step_hand(still);
    if (hand.phase() != haptic::PartHand::Phase::kEmpty) return;
    const haptic::RtStatus taken = hand.prepare((part + 1) % parts.count());
    require(
        (taken == haptic::RtStatus::kOk) == (hand.phase() == haptic::PartHand::Phase::kPrepared),
        "a hand is prepared where nothing was refused");
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // Exactly these bytes, so that the sanitizer sees the first access beyond them.
  haptic::tools::SceneBytes blob(std::as_bytes(std::span(data, size)));
  for (const bool corrected : {false, true}) {
    if (corrected) {
      correct_header(blob.span());
      correct_parts(blob.span());
    }
    haptic::SceneView scene;
    if (haptic::SceneView::open(blob.span(), scene) == haptic::RtStatus::kOk) {
      run_core(scene);
      run_parts(scene);
    }
  }
  return 0;
}
