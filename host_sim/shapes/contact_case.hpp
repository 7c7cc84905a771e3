// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Contacts at which a haptic law is put to the test: sliding off an edge, tilting, thin plates,
/// seams, swinging bars, a corner, a peg in its hole. Each is a scene and a path of the device, so
/// that every law can be run over the same. k_t 1000 N/m.

#include "host_sim/shapes/cut_body.hpp"
#include "host_sim/shapes/proxy_trace.hpp"

namespace haptic::sim {

/// The part of most cases: its vertices lie 50 mm from the grip point.
inline constexpr double kBoxHalf_m[3] = {0.030, 0.024, 0.032};
/// How deep the device is pushed: 3 N.
inline constexpr double kPush_m = 0.003;
/// Half the width of the peg of the cases, its half length, and that of a shorter one.
inline constexpr double kPegHalf_m = 0.005, kPegHalfLength_m = 0.030;
inline constexpr double kShortPegHalfLength_m = 0.016;

[[nodiscard]] tools::Body sample_box();
/// Block of 0.1 x 0.1 x 0.05 m, its top at z = 0.
[[nodiscard]] tools::Body sample_block();
/// The five-piece plate: 0.1 x 0.1 x 0.01 m, its top at z = 0, cut by four planes across x;
/// `whole`: the same plate uncut.
[[nodiscard]] tools::Body sample_plate(bool whole = false);
/// A wide plate with its top at z = 0.
[[nodiscard]] tools::Body thin_plate(double thickness_m, double half_m);
/// Floor and two walls that meet at (3/64, 3/64, -3/64) m, and a box whose faces, flat against all
/// three, put its middle at corner_place(): all exact in binary.
[[nodiscard]] tools::Body corner_body();
[[nodiscard]] tools::Body corner_box();
[[nodiscard]] Vector corner_place();
[[nodiscard]] CoupledScene peg_scene(double clearance_m, double friction = 0,
                                     double half_length_m = kPegHalfLength_m);

[[nodiscard]] Rotation turn_about(double angle_rad, const Vector& axis);

struct ContactCase {
  std::string name;   ///< for files: letters, digits, underscores
  std::string title;  ///< what happens on it
  CoupledScene scene;
  TimedPath path;
  bool releases = false;  ///< ends in a real loss of the hold: a step there is no jump of the law
};

[[nodiscard]] ContactCase slide_off_case();
[[nodiscard]] ContactCase tilt_case();
[[nodiscard]] ContactCase roll_case();
[[nodiscard]] ContactCase edge_case();
[[nodiscard]] ContactCase push_case(double depth_m);
[[nodiscard]] ContactCase seam_case(double speed_m_per_s, double tilt_rad, bool whole);
[[nodiscard]] ContactCase swing_case(double speed_rad_per_s);
[[nodiscard]] ContactCase edge_swing_case();
[[nodiscard]] ContactCase corner_case();
[[nodiscard]] ContactCase insertion_case(double clearance_m);
[[nodiscard]] ContactCase tilted_peg_case(double clearance_m);
[[nodiscard]] ContactCase mouth_case(double clearance_m);

/// One of each, for reports.
[[nodiscard]] std::vector<ContactCase> contact_cases();

/// A closed way of the device in one scene; the pose is periodic in the phase with period 1.
struct ContactLoop {
  std::string name, title;
  CoupledScene scene;
  TimedPose pose;  ///< of the phase
  Vector retreat_w = Vector(0, 0, 0.015);

  /// Twice round, each time in as many periods of the trace.
  [[nodiscard]] TimedPath path_of(double ticks) const;
};
/// Box on a block, round an edge of it, in the corner, peg with 0.1 mm of clearance, five-piece
/// plate: turning and moving at once.
[[nodiscard]] std::vector<ContactLoop> contact_loops();

}  // namespace haptic::sim
