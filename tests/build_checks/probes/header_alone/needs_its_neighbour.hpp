// SPDX-License-Identifier: Apache-2.0
#pragma once
// Violates the rule: std::uint32_t without its header, which the source file happens to include
// before.
inline std::uint32_t twice(std::uint32_t value) { return 2 * value; }
