// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One contact pressed by a known depth, at every size: the wrench in closed form against the
/// core's. A spring k_t, k_r between device and proxy under the one constraint that the contact is:
/// what is left is a minimum over one angle.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/stability/extreme_scene.hpp"
#include "host_sim/oracle/wide.hpp"

namespace haptic::sim {

/// What touches: A above, B below, the device `depth` too low.
enum class PressKind : std::uint8_t {
  kFace,    ///< face on face, B tilted by `tilt_rad` about y, contact stays flat
  kVertex,  ///< A's vertex on B's face, `lever_m` from x_0
  kEdges    ///< A's edge along x on B's edge along y, `lever_m` from x_0
};

struct PressedContact {
  ExtremeScene scene;
  PressKind kind = PressKind::kFace;
  double lever_m = 0;   ///< of the contact from x_0, along x
  double height_m = 0;  ///< of x_0 over the contact
  double tilt_rad = 0;
  double depth_m = 0;
};

/// Force and torque on the hand, W axes, torque about x_0.
struct PressWrench {
  WideVec force_n, torque_nm;
};

/// Wrench of the spring at its minimum for the device at `x_d_m` from B's place and no rotation.
/// The angle is found by bisection on the derivative in long double.
[[nodiscard]] PressWrench proxy_press(const PressedContact& contact, const WideVec& x_d_m, Wide k_t,
                                      Wide k_r);
/// Eqs. (1)-(3) of the paper there.
[[nodiscard]] PressWrench paper_press(const PressedContact& contact, const WideVec& x_d_m,
                                      Wide k_f);

/// What the core makes of it after it has come down and rested.
struct PressErrors {
  LawId law = LawId::kProxy;
  double force_error_n = 0, torque_error_nm = 0;
  double force_limit_n = 0, torque_limit_nm = 0;
  double force_n = 0;           ///< of the closed form
  double gap_m = 0;             ///< law proxy: worst gap of the proxy over the run
  double tolerance_m = 0;       ///< depth that counts as free
  std::uint32_t bad_ticks = 0;  ///< pose refused, or a NaN in the wrench
  std::string refusal;
  bool must_be_refused = false;  ///< coordinates too coarse for the proxy in this scalar

  [[nodiscard]] bool ok() const {
    if (must_be_refused) return !refusal.empty();
    return refusal.empty() && bad_ticks == 0 && force_error_n <= force_limit_n &&
           torque_error_nm <= torque_limit_nm && gap_m >= -2 * tolerance_m;
  }
};

/// Contacts at sizes from 1e-6 to 1e3 m, at 1e4 m from the origin, on a plate of 1 um, with a
/// needle and with faces 1e-16 to 1e-2 rad from parallel. `quick`: the ends of each family.
[[nodiscard]] std::vector<PressedContact> pressed_contacts(bool quick);

/// `fault`: share by which the closed form is changed, to show that the comparison can fail.
[[nodiscard]] PressErrors press(const PressedContact& contact, LawId law, double fault = 0);

[[nodiscard]] const char* to_text(PressKind kind);

}  // namespace haptic::sim
