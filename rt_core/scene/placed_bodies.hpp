// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A scene whose static bodies stand elsewhere than where it was compiled: the same pieces and
/// contacts, in tables that are turned. So a part that the hand has put down is an obstacle for the
/// next one, where it lies.

#include <cmath>
#include <cstddef>
#include <span>

#include "rt_core/base/status.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic {

/// Place of a part in W: of its mesh frame. In double, for a part stays where it is let go over any
/// number of holds.
struct PartPlace {
  double p_wa_m[3] = {0, 0, 0};
  double q_wa_xyzw[4] = {0, 0, 0, 1};  ///< unit

  friend bool operator==(const PartPlace&, const PartPlace&) = default;
};

/// How a static body was moved since its scene was compiled: a point x_W of it is at turn x_W +
/// shift now.
struct BodyMove {
  double turn_xyzw[4] = {0, 0, 0, 1};  ///< unit
  double shift_m[3] = {0, 0, 0};

  [[nodiscard]] bool is_none() const noexcept {
    const double* const q = turn_xyzw;
    const bool turns = !(q[0] == 0 && q[1] == 0 && q[2] == 0 && std::abs(q[3]) == 1);
    return !turns && shift_m[0] == 0 && shift_m[1] == 0 && shift_m[2] == 0;
  }
};

/// Writes the scene into `placed` with body b + 1 moved by `moves[b]`, and the start of the moving
/// body at `start`. A body that was not moved
/// keeps its bits; the others round once, however often they have been moved, for `scene` is the
/// compiled one. Its graphs must not have been pruned by orientation or workspace.
/// @param moves   one for each static body.
/// @param placed  scene.blob().size() bytes, at a multiple of kSceneAlignment; not the scene's own.
/// @return kOk; kMemoryTooSmall, kMemoryMisaligned for `placed`; kBlobBadCount for another number
/// of moves; kBlobBadNumber for a turn that is not unit to 1e-6, or for a body outside the format's
/// range of coordinates.
/// Cost: O(bytes), no heap. Not for the servo loop.
[[nodiscard]] RtStatus place_bodies(const SceneView& scene, const PartPlace& start,
                                    std::span<const BodyMove> moves,
                                    std::span<std::byte> placed) noexcept;

}  // namespace haptic
