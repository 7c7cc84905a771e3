// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Law proxy in a tick: the part's free configuration follows the goal, and its coupling pulls.

#include <cstdint>

#include "rt_core/base/pose.hpp"
#include "rt_core/proxy/late_hold.hpp"
#include "rt_core/proxy/proxy_law.hpp"
#include "rt_core/proxy/shared_motion.hpp"
#include "rt_core/safety/passivity.hpp"
#include "rt_core/scene/scene_traits.hpp"
#include "rt_core/tracking/contact_polygon.hpp"
#include "rt_core/tracking/contact_region.hpp"
#include "rt_core/tracking/search_room.hpp"

namespace haptic {

/// The spring of a scene's coupling.
[[nodiscard]] Spring coupling_spring(const CouplingParameters& coupling) noexcept;

/// Where the part is felt, and with what force.
struct FreePose {
  GripPose grip;        ///< the proxy
  Wrench spring_w;      ///< the coupling's pull
  Wrench wrench_w;      ///< with its damping
  StoredEnergy stored;  ///< in the spring
  ProxyTick proxy;
  double given_j = 0;  ///< energy of the spring from other parts that move, less what it gave them
  std::uint32_t flags =
      0;  ///< kFlagProxyLimited, kFlagRecovery, kFlagProxyStuck, kFlagHooked,
          ///< kFlagSaturated, kFlagBehind, kFlagListFull, kFlagHeld, kFlagDriven..
};

class FreeMotion {
 public:
  void place(Arena& arena, const SceneView& scene) noexcept { proxy_.place(arena, scene); }
  void read_scene(const SceneView& scene) noexcept;
  /// Others move too: from the next reset on `move` takes over what their law has said of the part.
  /// Null: none do.
  void join(SharedMotion* shared) noexcept { shared_ = shared; }
  void reset() noexcept;
  /// Moves the proxy towards the goal, which moves with the device at `twist_w`. `room` is left as
  /// it was.
  [[nodiscard]] FreePose move(const GripPose& goal, const Twist& twist_w,
                              SearchRoom& room) noexcept;

  /// The proxy; null before its first tick.
  [[nodiscard]] const GripPose* pose() const noexcept {
    if (is_shared()) return shared_->started ? &shared_->pose : nullptr;
    return proxy_.started() ? &proxy_.pose() : nullptr;
  }
  /// True if the proxy stood at its goal at the end of the last tick and touched nothing.
  [[nodiscard]] bool at_rest() const noexcept { return at_rest_; }
  /// Planes that hold the proxy, of the last tick.
  [[nodiscard]] const FeltContact& felt() const noexcept {
    return is_shared() ? shared_->felt : proxy_.felt();
  }
  /// Contact of a pair that holds the proxy, from its near set there, into the emptied `out`; for
  /// reports between ticks. `room` is left as it was. Of a plane of another part that moves: none.
  void describe(PairIndex pair, SearchRoom& room, const HullScratch& hull,
                ContactGeometry& out) noexcept;

 private:
  // An image has one part that moves.
  [[nodiscard]] bool is_shared() const noexcept {
    return !kSceneTraits.image && shared_ != nullptr;
  }
  [[nodiscard]] Real damping_gain(const Wrench& spring_w, const Twist& twist_w) const noexcept;
  [[nodiscard]] Real room_to_limit(const Wrench& spring_w) const noexcept;
  [[nodiscard]] bool is_stuck(const FreePose& free) const noexcept;

  Proxy proxy_;
  SharedMotion* shared_ = nullptr;
  LateHold hold_;
  Spring spring_;
  Real radius_m_ = 0;     ///< of A about the grip point
  Real tolerance_m_ = 0;  ///< of the proxy
  bool at_rest_ = false;
  Real epsilon_m_ = 0;
  Real damping_ns_per_m_ = 0, damping_share_ = 0;
};

}  // namespace haptic
