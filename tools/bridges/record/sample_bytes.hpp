// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Samples and wrenches as a recording has them: numbers of 64 bits for every Real, so that two
/// of them are the same when their bytes are.

#include <array>
#include <cstddef>
#include <span>

#include "hal/bridge/bridged_device.hpp"

namespace haptic::tools {

/// Time; point, quaternion x y z w; twist, linear and angular, zero where it is not valid; bits;
/// switches; faults.
inline constexpr std::size_t kSampleBytes = 8 * (1 + 3 + 4 + 6 + 1 + 1 + 1);
using SampleBytes = std::array<std::byte, kSampleBytes>;
[[nodiscard]] SampleBytes bytes_of(const hal::BridgeSample& sample) noexcept;

/// Force, torque.
inline constexpr std::size_t kWrenchBytes = 8 * 6;
using WrenchBytes = std::array<std::byte, kWrenchBytes>;
[[nodiscard]] WrenchBytes bytes_of(const Wrench& wrench) noexcept;
/// @param bytes  kWrenchBytes of them
[[nodiscard]] Wrench wrench_of_bytes(std::span<const std::byte> bytes) noexcept;

}  // namespace haptic::tools
