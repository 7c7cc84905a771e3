// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Law proxy in a tick: the part's free configuration follows the goal, and its coupling pulls.

#include <cstdint>

#include "rt_core/base/pose.hpp"
#include "rt_core/proxy/late_hold.hpp"
#include "rt_core/proxy/proxy_law.hpp"
#include "rt_core/safety/passivity.hpp"
#include "rt_core/tracking/contact_polygon.hpp"
#include "rt_core/tracking/contact_region.hpp"
#include "rt_core/tracking/search_room.hpp"

namespace haptic {

/// Where the part is felt, and with what force.
struct FreePose {
  GripPose grip;        ///< the proxy
  Wrench spring_w;      ///< the coupling's pull
  Wrench wrench_w;      ///< with its damping
  StoredEnergy stored;  ///< in the spring
  ProxyTick proxy;
  std::uint32_t flags = 0;  ///< kFlagProxyLimited, kFlagRecovery, kFlagProxyStuck, kFlagHooked,
                            ///< kFlagSaturated, kFlagBehind, kFlagListFull, kFlagHeld
};

class FreeMotion {
 public:
  void place(Arena& arena, const SceneView& scene) noexcept { proxy_.place(arena, scene); }
  void read_scene(const SceneView& scene) noexcept;
  void reset() noexcept;
  /// Moves the proxy towards the goal, which moves with the device at `twist_w`. `room` is left as
  /// it was.
  [[nodiscard]] FreePose move(const GripPose& goal, const Twist& twist_w,
                              SearchRoom& room) noexcept;

  /// The proxy; null before its first tick.
  [[nodiscard]] const GripPose* pose() const noexcept {
    return proxy_.started() ? &proxy_.pose() : nullptr;
  }
  /// True if the proxy stood at its goal at the end of the last tick and touched nothing.
  [[nodiscard]] bool at_rest() const noexcept { return at_rest_; }
  /// Planes that hold the proxy, of the last tick.
  [[nodiscard]] const FeltContact& felt() const noexcept { return proxy_.felt(); }
  /// Contact of a pair that holds the proxy, from its near set there, into the emptied `out`; for
  /// reports between ticks. `room` is left as it was.
  void describe(PairIndex pair, SearchRoom& room, const HullScratch& hull,
                ContactGeometry& out) noexcept;

 private:
  [[nodiscard]] Real damping_gain(const Wrench& spring_w, const Twist& twist_w) const noexcept;
  [[nodiscard]] Real room_to_limit(const Wrench& spring_w) const noexcept;
  [[nodiscard]] bool is_stuck(const FreePose& free) const noexcept;

  Proxy proxy_;
  LateHold hold_;
  Spring spring_;
  Real radius_m_ = 0;     ///< of A about the grip point
  Real tolerance_m_ = 0;  ///< of the proxy
  bool at_rest_ = false;
  Real epsilon_m_ = 0;
  Real damping_ns_per_m_ = 0, damping_share_ = 0;
};

}  // namespace haptic
