// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Tests that come in a short form and a full one: the full one runs in `tools/check --all`, and by
/// hand with the environment variable HAPTIC_ALL_CHECKS set to anything.

#include <cstdlib>

namespace haptic::test {

/// True where the full form is asked for. A case that has no short form says
/// `* doctest::skip(!all_checks())` after its name.
[[nodiscard]] inline bool all_checks() { return std::getenv("HAPTIC_ALL_CHECKS") != nullptr; }

/// Number of trials: `few` in the short form, `all` in the full one.
template <typename Number>
[[nodiscard]] Number trials(Number few, Number all) {
  return all_checks() ? all : few;
}

}  // namespace haptic::test
