// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A tick as a page gets it, given to a core here as the page gives it to its own.

#include "rt_core/haptic_core.hpp"
#include "tools/live/page_file.hpp"

namespace haptic::sim::test {

[[nodiscard]] inline Vec3 vector_in(const double* values) {
  return {static_cast<Real>(values[0]), static_cast<Real>(values[1]), static_cast<Real>(values[2])};
}

[[nodiscard]] inline StepInput recorded_input(const tools::RecordedTick& tick) {
  StepInput input;
  input.stamp_ns = tick.stamp_ns;
  input.pose_wa.p_wa = vector_in(tick.p_wa_m);
  for (int c = 0; c < 4; ++c) input.pose_wa.q_wa.coeffs()[c] = static_cast<Real>(tick.q_wa_xyzw[c]);
  input.accepted_wrench_w = {vector_in(tick.accepted_w), vector_in(tick.accepted_w + 3)};
  input.accepted_valid = (tick.marks & tools::kMarkAccepted) != 0;
  input.twist_w = {vector_in(tick.twist_w), vector_in(tick.twist_w + 3)};
  input.twist_valid = (tick.marks & tools::kMarkTwist) != 0;
  input.clutched = (tick.marks & tools::kMarkClutched) != 0;
  return input;
}

/// The state hash after it.
[[nodiscard]] inline std::uint64_t hash_after(HapticCore& core, const tools::RecordedTick& tick) {
  if ((tick.marks & tools::kMarkReset) != 0) core.reset();
  return core.step(recorded_input(tick)).state_hash;
}

}  // namespace haptic::sim::test
