// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The core in the closed loop, on a wall and in a hole: whether it comes to rest there.

#include <string>
#include <vector>

#include "host_sim/device/simulated_device.hpp"
#include "host_sim/lab/stability/spectral_radius.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {

/// What is rendered, how fast, and who holds the device (0.1 kg and 1 N s/m, rotor 1e-4 kg m^2 and
/// 1e-3 N m s, no Coulomb friction).
struct TrialSetting {
  LawId law = LawId::kPaper;
  double rate_hz = 1000;
  unsigned delay_samples = 0;
  std::string hand = "none";    ///< hand_named
  double damping_ns_per_m = 0;  ///< coupling damping B; proxy law alone
};

/// Gains of a trial in a scene: bare, without budget and passivity layer, as what is sought is
/// where the loop alone stops being stable.
void set_trial(SceneParameters& parameters, const TrialSetting& setting, double stiffness_n_per_m);

/// Whether the core accepts scenes of this law at all.
[[nodiscard]] bool law_served(LawId law);

/// The same as a linear loop: device and hand on one axis.
[[nodiscard]] LinearLoop linear_loop(const TrialSetting& setting);

/// A cube pressed 2 mm into a wall by a constant push, the hand's target where it rests, is let go
/// 0.1 mm off its equilibrium: whether the energy of its deviation falls. A run ends when that
/// energy has grown by nine, has fallen to a hundred-thousandth, or after `seconds`.
[[nodiscard]] bool wall_is_stable(const TrialSetting& setting, double stiffness_n_per_m,
                                  double seconds);

/// Largest stable stiffness on the wall [N/m], within 0.1 %, sought by bisection from around
/// `guess` (a factor of 32 either way at most; 0 or kNoLimit beyond).
[[nodiscard]] double wall_limit(const TrialSetting& setting, double guess, double seconds);

/// Stiffnesses tried in the hole [N/m].
[[nodiscard]] const std::vector<double>& peg_stiffnesses();

/// A square peg, 20 mm deep in a hole with 0.1 mm of clearance per side; the hand's target moves
/// 3 mm and 2 mm sideways and turns by 0.05 rad within a second, then rests for `seconds`. A loop
/// that is not at rest then is watched for as long again, up to eight times, while what it does
/// still falls by a tenth each time: next to the boundary a stable loop settles slowly, and one
/// beyond it grows or keeps on.
struct PegRest {
  /// Largest in the last part of the run, a tenth of the motion and `seconds`.
  double speed_m_per_s = 0, turn_rad_per_s = 0;
  double rest_s = 0;     ///< how long the target had rested
  bool in_place = true;  ///< not shaken along the hole by 1 mm
  double off_m = 0;      ///< the farthest along the hole so far
  [[nodiscard]] bool slow() const { return speed_m_per_s < 0.5e-3; }
  [[nodiscard]] bool turns_slowly() const { return turn_rad_per_s < 0.05; }
  [[nodiscard]] bool at_rest() const { return in_place && slow() && turns_slowly(); }
};
[[nodiscard]] PegRest peg_rest(const TrialSetting& setting, double stiffness_n_per_m,
                               double seconds);

/// How deep the peg is held, and the way along its hole after which it counts as shaken out:
/// pressing and turning never move it as far, and a loop that does may come to rest outside.
struct PegHold {
  double depth_m = 0.020, thrown_m = 1.0e-3;
};
/// The same in a scene of its own with such a peg and hole.
[[nodiscard]] PegRest peg_rest_in(CoreSession& session, const TrialSetting& setting, double seconds,
                                  const PegHold& hold);

/// Largest of peg_stiffnesses() up to which all come to rest, 0 when the first does not; and for
/// how long the target had rested by then.
struct PegLimit {
  double stiffness_n_per_m = 0, rest_s = 0;
};
[[nodiscard]] PegLimit peg_limit(const TrialSetting& setting, double seconds);

}  // namespace haptic::sim
