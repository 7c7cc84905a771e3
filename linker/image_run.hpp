// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A short drive of the core over one compiled scene, the same in a freestanding image and in a
/// hosted program: equal hashes of the two show that the image computes the same bits. No heap, no
/// system call.

#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/base/scalar.hpp"

namespace haptic {

enum class ImageVerdict : std::uint8_t {
  kDone = 0,
  kRotationWrong,  ///< log(exp(v)) differs from v
  kBadBlobTaken,   ///< a truncated blob was accepted
  kSceneRefused,
  kMemoryRefused,  ///< fewer bytes of state than the scene needs, or misaligned
  kTickFailed,     ///< a tick did not return kOk
  kForceWhenFree,  ///< force although the device pose was separated; not judged along a motion
  kNoContact,      ///< the drive felt nothing
  kNotRepeatable   ///< the second drive after reset() gave other bits
};

struct ImageReport {
  ImageVerdict verdict = ImageVerdict::kDone;
  std::uint32_t ticks = 0;          ///< per drive
  std::uint32_t contact_ticks = 0;  ///< of them in collision
  std::uint64_t hash = 0;           ///< of all ticks' state hashes, in order
};

/// Opens `blob`, builds a core in `state` and drives it twice: along `motion`, of whose Reals each
/// seven are one tick's pose (coordinates [m], quaternion x y z w); where that is empty, from the
/// scene's start pose 20 mm down along W's z axis and back in 1000 ticks, turning slowly.
[[nodiscard]] ImageReport run_image(std::span<const std::byte> blob, std::span<std::byte> state,
                                    std::span<const Real> motion) noexcept;

}  // namespace haptic
