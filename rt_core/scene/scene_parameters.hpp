// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a compiled scene says besides its geometry: law, device, coupling, where the part goes; and
/// the limits of these numbers. Bytes of section kParameters (scene_format.hpp).

#include <cstdint>

namespace haptic {

/// Largest coordinate [m] and stiffness [N/m]: far beyond any device, and small enough that no
/// force, torque or square of a length leaves the range of Real, single precision included.
inline constexpr double kMaxSceneLength_m = 1.0e6;
inline constexpr double kMaxStiffness_n_per_m = 1.0e12;
/// Limits of the coupling: least stiffness and length L = sqrt(k_r / k_t), which must stay apart
/// from zero in single precision; damping [N s/m], rotation error [rad] and window [s] at most;
/// coefficient of friction at most.
inline constexpr double kMinStiffness_n_per_m = 1.0e-12;
inline constexpr double kMinCouplingLength_m = 1.0e-9;
inline constexpr double kMaxCouplingDamping_ns_per_m = 1.0e12;
inline constexpr double kMaxRotationError_rad = 3.0;
inline constexpr double kMaxWindow_s = 1.0e3;
inline constexpr double kMaxFriction = 2.0;

enum class LawId : std::uint32_t { kPaper = 1, kWeightedRegion = 2, kProxy = 3 };

/// Properties of the haptic device; SI units. A value of 0 in a limit means "not given".
struct DeviceParameters {
  double mass_kg, damping_ns_per_m, coulomb_friction_n, encoder_step_m;
  double max_force_n, max_torque_nm, max_force_rate_n_per_s, max_torque_rate_nm_per_s;
  double max_stiffness_n_per_m, max_damping_ns_per_m;
  double delay_s;
  std::uint32_t given;  ///< 1 when the scene has a [device] table
  std::uint32_t reserved;
};

/// How the proxy is coupled to the device (law kProxy), and what stands between any law and the
/// device. SI units; every value resolved by the compiler, 0 where a limit is said to be none.
struct CouplingParameters {
  double k_t_n_per_m;              ///< coupling stiffness in translation, > 0
  double k_r_nm_per_rad;           ///< in rotation, > 0; k_r = k_t L^2, L 1e-9 to 1e6 m
  double damping_ns_per_m;         ///< B: coupling damping in translation; B L^2 in rotation; >= 0
  double damping_share;            ///< it is at most this share of the spring wrench, 0 to 1
  double max_rotation_error_rad;   ///< theta_sat: the anchor follows beyond; in (0, 3]
  double max_translation_error_m;  ///< the anchor follows beyond; 0: no limit
  double min_window_s;             ///< of the twist estimator, 0 to max_window_s
  double max_window_s;             ///< of the twist estimator, > 0
  double encoder_step_rad;         ///< angular step of the device; 0: not given
  double tolerance_m;              ///< depth that counts as free; 0: from the size of the part
  std::uint32_t passes;            ///< of the proxy in one tick, 1 to kMaxProxyPasses
  std::uint32_t reserved;
  std::uint32_t passivity;     ///< 1: energy observer and controller act on the wrench
  std::uint32_t allow_active;  ///< 1: gains beyond the passivity budget were allowed
};

/// Bits of EnvelopeParameters::given.
enum EnvelopeGiven : std::uint32_t { kOrientationGiven = 1u << 0, kWorkspaceGiven = 1u << 1 };

/// Where the part goes; nodes that none of these poses needs may be missing from the marks. What is
/// not given is zero.
struct EnvelopeParameters {
  double q_wa_xyzw[4];   ///< middle of the orientations, unit
  double max_angle_rad;  ///< largest turn from it, 0 to pi; 0: the part never turns
  double min_m[3];       ///< of the box that the grip point stays in, W axes
  double max_m[3];
  std::uint32_t given;  ///< EnvelopeGiven
  std::uint32_t reserved;
};

struct SceneParameters {
  LawId law;
  std::uint32_t motion_limits_given;  ///< 1 when the scene has a [motion_limits] table
  double k_f_n_per_m;                 ///< paper's k_F
  double epsilon_m;                   ///< paper's epsilon: width of the near set
  double epsilon_o_m;   ///< weighted law: distance outside its features at which a contact ends
  double exact_band_m;  ///< separations beyond this may be answered by a held plane, flagged
  double rate_hz;
  double start_p_wa_m[3];  ///< start pose of A's mesh frame in W
  double start_q_wa_xyzw[4];
  double max_linear_speed_m_per_s, max_angular_speed_rad_per_s;
  std::uint32_t name_offset, name_bytes;  ///< in kText
  DeviceParameters device;
  CouplingParameters coupling;
  EnvelopeParameters envelope;
};

}  // namespace haptic
