// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cstdint>
#include <string>

#include "rt_core/safety/arming.hpp"

using namespace haptic;

namespace {

ArmingInput input(bool deadman, std::uint32_t present = 0, bool ready = true) {
  ArmingInput in;
  in.deadman = deadman;
  in.ready = ready;
  in.present = present;
  return in;
}

/// The output as a staircase: it rises while force is wanted and falls while it is not.
struct Staircase {
  static constexpr int kFull = 2;
  int level = 0;
  void report(ArmingInput& in) const {
    in.output_is_zero = level == 0;
    in.output_is_full = level == kFull;
  }
  void follow(bool wants_force) { level += wants_force ? level < kFull : -(level > 0); }
};

/// What an operator can see of an Arming, and whether it keeps its promises in every step.
struct Watched {
  Arming arming;
  Staircase output;
  bool last_deadman = true;  ///< before the first step: as if held
  bool ever_released = false;

  /// Text of the promise that the step broke; nullptr: none.
  const char* step(ArmingInput in) {
    const ArmingState before = arming.state();
    const std::uint32_t latched = arming.latched(), count = arming.count(), first = arming.first();
    const bool idle = before == ArmingState::kDisarmed || before == ArmingState::kFaulted;
    const bool may_arm =
        idle && in.deadman && !last_deadman && ever_released && in.ready && in.present == 0;
    const ArmingState after = arming.update(in);
    last_deadman = in.deadman;
    ever_released = ever_released || !in.deadman;
    output.follow(arming.wants_force());

    if (after != arming.state()) return "the state returned is the state";
    const bool armed_now = arming.count() != count;
    if (armed_now != may_arm) return "arms exactly at a press that finds everything in order";
    if (armed_now && arming.count() != count + 1) return "the count grows by one";
    if (armed_now && after != ArmingState::kArming) return "an arming starts by ramping in";
    if (arming.wants_force() && (!in.deadman || in.present != 0)) {
      return "no force without the deadman, nor with a cause";
    }
    if (arming.wants_force() && arming.latched() != 0) return "no force with a latched fault";
    if (arming.wants_force() && idle && !armed_now) return "force only by arming";
    const std::uint32_t expected = armed_now ? 0 : latched | in.present;
    if (arming.latched() != expected) return "faults latch until an arming clears them";
    const std::uint32_t expected_first = armed_now ? 0 : latched != 0 ? first : in.present;
    if (arming.first() != expected_first) return "the first causes are kept";
    if (after == ArmingState::kArmed && before != ArmingState::kArmed && !in.output_is_full) {
      return "armed only with full force";
    }
    if (before == ArmingState::kDisarming && !in.output_is_zero &&
        after != ArmingState::kDisarming) {
      return "disarming lasts until the output is zero";
    }
    if (after == ArmingState::kDisarmed && arming.latched() != 0) return "a fault shows";
    if (after == ArmingState::kFaulted && arming.latched() == 0) return "a fault has a reason";
    return nullptr;
  }

  const char* step_on(ArmingInput in) {
    output.report(in);
    return step(in);
  }
};

struct ExploredArmings {
  std::uint64_t steps = 0, armings = 0, faulted = 0, full = 0;
  std::string broken;
};

/// From every state there is a way to force: release until nothing is left, then press.
bool can_arm(Watched watched) {
  for (int k = 0; k < 4; ++k) {
    if (watched.step_on(input(false)) != nullptr) return false;
  }
  return watched.step_on(input(true)) == nullptr && watched.arming.wants_force();
}

constexpr int kSymbols = 8;
ArmingInput symbol(int s) {
  return input((s & 1) != 0, (s & 2) != 0 ? std::uint32_t{kFaultDevice} : 0u, s < 4);
}

void explore(const Watched& from, int depth, ExploredArmings& found) {
  if (!found.broken.empty()) return;
  if (depth == 0) {
    if (!can_arm(from)) found.broken = "no way back to force";
    return;
  }
  for (int s = 0; s < kSymbols; ++s) {
    Watched next = from;
    const std::uint32_t count = next.arming.count();
    const char* broken = next.step_on(symbol(s));
    if (broken != nullptr) found.broken = broken;
    found.steps += 1;
    found.armings += next.arming.count() - count;
    found.faulted += next.arming.state() == ArmingState::kFaulted;
    found.full += next.arming.state() == ArmingState::kArmed;
    explore(next, depth - 1, found);
  }
}

/// As above, but the output reported is anything at all.
void explore_any_output(const Watched& from, int depth, ExploredArmings& found) {
  if (depth == 0 || !found.broken.empty()) return;
  for (int s = 0; s < kSymbols * 4; ++s) {
    Watched next = from;
    ArmingInput in = symbol(s % kSymbols);
    in.output_is_zero = (s / kSymbols & 1) != 0;
    in.output_is_full = (s / kSymbols & 2) != 0;
    const char* broken = next.step(in);
    if (broken != nullptr) found.broken = broken;
    found.steps += 1;
    explore_any_output(next, depth - 1, found);
  }
}

}  // namespace

TEST_SUITE("rt_core.arming") {
  TEST_CASE("every sequence of 8 inputs keeps every promise, and none of them is a dead end") {
    ExploredArmings found;
    explore(Watched{}, 8, found);
    CHECK(found.broken == "");
    CHECK(found.steps == (kSymbols * ((1u << 24) - 1)) / 7);
    CHECK(found.armings > 1'000'000);
    CHECK(found.faulted > 1'000'000);
    CHECK(found.full > 50'000);
  }

  TEST_CASE("every sequence of 4 inputs with any report of the output keeps every promise") {
    ExploredArmings found;
    explore_any_output(Watched{}, 4, found);
    CHECK(found.broken == "");
    CHECK(found.steps == 32u + 32u * 32 + 32u * 32 * 32 + 32u * 32 * 32 * 32);
  }

  TEST_CASE("a session: press, ramp in, hold, release") {
    Arming arming;
    CHECK(arming.state() == ArmingState::kDisarmed);
    CHECK(arming.update(input(true)) == ArmingState::kDisarmed);  // held from the start
    CHECK(arming.update(input(true)) == ArmingState::kDisarmed);
    CHECK(arming.update(input(false)) == ArmingState::kDisarmed);
    CHECK(arming.update(input(true)) == ArmingState::kArming);
    CHECK(arming.count() == 1);
    ArmingInput in = input(true);
    in.output_is_zero = false;
    CHECK(arming.update(in) == ArmingState::kArming);
    in.output_is_full = true;
    CHECK(arming.update(in) == ArmingState::kArmed);
    in.deadman = false;
    CHECK(arming.update(in) == ArmingState::kDisarming);
    in.output_is_full = false;
    in.deadman = true;  // pressed again too soon: it is used up
    CHECK(arming.update(in) == ArmingState::kDisarming);
    in.output_is_zero = true;
    CHECK(arming.update(in) == ArmingState::kDisarmed);
    CHECK(arming.update(in) == ArmingState::kDisarmed);
    CHECK(arming.update(input(false)) == ArmingState::kDisarmed);
    CHECK(arming.update(input(true)) == ArmingState::kArming);
    CHECK(arming.count() == 2);
  }

  TEST_CASE("a fault: latched with its first cause, cleared by releasing and pressing again only") {
    Arming arming;
    (void)arming.update(input(false));
    (void)arming.update(input(true));
    CHECK(arming.update(input(true, kFaultStaleState)) == ArmingState::kDisarming);
    CHECK(arming.update(input(true, kFaultDeviceLost)) == ArmingState::kFaulted);
    CHECK(arming.first() == kFaultStaleState);
    CHECK(arming.latched() == (kFaultStaleState | kFaultDeviceLost));
    CHECK(arming.update(input(true)) == ArmingState::kFaulted);  // gone, but still held
    CHECK(arming.update(input(false)) == ArmingState::kFaulted);
    CHECK(arming.update(input(true, kFaultDevice)) == ArmingState::kFaulted);
    CHECK(arming.update(input(true)) == ArmingState::kFaulted);  // that press was used up
    CHECK(arming.update(input(false)) == ArmingState::kFaulted);
    CHECK(arming.update(input(true, 0, false)) == ArmingState::kFaulted);  // not ready: used up
    CHECK(arming.update(input(true)) == ArmingState::kFaulted);
    CHECK(arming.latched() == (kFaultStaleState | kFaultDeviceLost | kFaultDevice));
    (void)arming.update(input(false));
    CHECK(arming.update(input(true)) == ArmingState::kArming);
    CHECK(arming.latched() == 0);
    CHECK(arming.first() == 0);
  }

  TEST_CASE("every fault has a text of its own, and so have none and an unknown one") {
    std::string all;
    for (std::uint32_t bit = 1; bit <= kFaultFrame; bit <<= 1) {
      const std::string text = fault_text(bit);
      CHECK(text.size() > 8);
      CHECK(all.find(text) == std::string::npos);
      CHECK(fault_text(bit | kFaultFrame) == text);  // the lowest
      all += text + "\n";
    }
    CHECK(std::string(fault_text(0)) == "no fault");
    CHECK(std::string(fault_text(kFaultFrame << 1)) == "unknown fault");
    CHECK(std::string(fault_text(1u << 31)) == "unknown fault");
  }
}
