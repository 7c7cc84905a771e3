// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A scene whose static bodies stand elsewhere than where it was compiled: the same pieces and
/// contacts, in tables that are turned. So a part that the hand has put down is an obstacle for the
/// next one, where it lies.

#include <cmath>
#include <cstddef>
#include <span>

#include "rt_core/base/pose.hpp"
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

/// In Real; Pose::q_wa as the place has it.
[[nodiscard]] Pose pose_of(const PartPlace& place) noexcept;

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

/// The copy of a scene whose static bodies are moved one by one. Its graphs must not have been
/// pruned by orientation or workspace. A body that is not moved keeps its bits; the others round
/// once, however often their part was moved, for the scene copied is the compiled one.
/// No heap; not for the servo loop.
class PlacedBodies {
 public:
  /// Copies `scene` into `memory`, scene.blob().size() bytes at a multiple of kSceneAlignment, with
  /// the start of the moving body at `start`. `scene` must outlive this.
  /// @return kOk; kMemoryTooSmall, kMemoryMisaligned. Cost: O(bytes).
  [[nodiscard]] RtStatus begin(const SceneView& scene, const PartPlace& start,
                               std::span<std::byte> memory) noexcept;
  /// Moves static body `body`, at least 1, each at most once.
  /// @return kOk; kBlobBadCount for no such body; kBlobBadNumber for a turn that is not unit to
  /// 1e-6, or for a body outside the format's range of coordinates. Cost: O(bytes of the body).
  [[nodiscard]] RtStatus move(std::size_t body, const BodyMove& move) noexcept;
  /// The scene, as SceneView::open takes it. Cost: O(bytes).
  [[nodiscard]] std::span<const std::byte> finish() noexcept;

 private:
  const SceneView* scene_ = nullptr;
  std::span<std::byte> blob_;
};

}  // namespace haptic
