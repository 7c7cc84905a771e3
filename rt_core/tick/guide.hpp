// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Guidance: a force that leads the hand along a plan (Rosell, Vazquez, Perez, Iniguez 2008, J
/// Intell Robot Syst 53:223, with a plan that is proved in the place of their channel of cells).
///
/// Its potential is U = pull (cost to go) + hold (pseudo-Huber function of the distance from the
/// way, beyond a share of the clearance of the stations), over place and turn with a turn of 1 rad
/// as long as turn_m: both slopes are bounded, and so is the force. The pull falls where the part
/// is not lined up with the way, so that the hold leads it there first: pulled on regardless, a peg
/// beside its hole would stand on the rim, which tips it away from where the hold turns it. The
/// force is then no gradient; what it does is bounded by the account below. U is taken at the felt
/// part, not at the hand's goal, and the force acts on the hand alone: it never presses the part
/// into an obstacle, and the contact wrench has the same bits with and without it.
///
/// Off the way by more than let_go_m the force has faded to zero and the guide lets go. It takes up
/// again, or begins, at a station that the part is nearer to than its clearance: then the straight
/// motion there is free, for no point of the part moves farther than what is proved to be left.
///
/// Sampling makes energy, as any force that is held does; so the guide has an account: what it does
/// on the device is subtracted, what the hand puts in is added, up to the energy that the scene
/// states, and what is left limits the force.

#include <cstdint>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/pose.hpp"
#include "rt_core/scene/scene_view.hpp"
#include "rt_core/tick/guidance.hpp"

namespace haptic {

/// Segments of the way that a tick looks at, and stations where it looks for one to begin at.
inline constexpr std::uint32_t kGuideWindow = 4, kGuideSearch = 4;

class GuideStage {
 public:
  void read_scene(const SceneView& scene) noexcept;
  void reset() noexcept;

  /// Takes its part out of the wrench that acted on the device since the last tick, by the share of
  /// both that did; where all of it acted, the rest is exactly the contact's command. Not `valid`:
  /// the command is what acted. @return the contact's part.
  [[nodiscard]] Wrench take_share(const Wrench& acted, bool valid) noexcept;

  /// Once a tick. `felt`: the part; `device`: the grip point of the hand; `contact_w`: what is
  /// rendered besides; `wanted`: switched on and nothing forbids it. Cost: at most kGuideWindow
  /// segments and kGuideSearch stations.
  [[nodiscard]] Guidance update(const GripPose& felt, const GripPose& device,
                                const Wrench& contact_w, bool wanted) noexcept;

 private:
  struct Offset {
    Vec3 place_m, turn_m;
    [[nodiscard]] Real square() const noexcept {
      return place_m.squaredNorm() + turn_m.squaredNorm();
    }
  };
  [[nodiscard]] Offset offset_from(const GuideStation& station,
                                   const GripPose& pose) const noexcept;
  void account(const GripPose& device) noexcept;
  void look_for_station(const GripPose& felt) noexcept;
  void fade_out() noexcept;

  std::span<const GuideStation> stations_;
  Real pull_n_ = 0, hold_n_ = 0, turn_m_ = 0, near_goal_m_ = 0, let_go_m_ = 0;
  Real gain_step_ = 0;           ///< of the ramp in a tick
  Real most_j_ = 0, low_j_ = 0;  ///< energy that is stated; below the latter the force is limited
  Real energy_j_ = 0;
  Real gain_ = 0, lined_ = 1;  ///< of the ramp; share of the pull, which follows in its time
  std::uint32_t segment_ = 0, search_ = 0;
  bool on_ = false, has_device_ = false, told_ = false;
  Wrench contact_w_, last_w_;  ///< of the last tick: the contact's, the guide's
  Wrench acted_w_;             ///< of it, what acted on the device
  GripPose device_;            ///< of the last tick
};

}  // namespace haptic
