// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A virtual tool between device and wall, and the integrators it may be stepped with
/// (rt_core/METHOD.md section 9): the tool alone, and coupled to the device by a spring and a
/// damper. One axis, linear (the wall pulls as well as it pushes). The rendering core has no such
/// tool: this is the account of why, or of which one it would take.

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "host_sim/lab/stability/spectral_radius.hpp"

namespace haptic::sim {

enum class Integrator : std::uint8_t { kExplicit, kSemiImplicit, kExponential, kBackward };
inline constexpr std::array<Integrator, 4> kIntegrators = {
    Integrator::kExplicit, Integrator::kSemiImplicit, Integrator::kExponential,
    Integrator::kBackward};
[[nodiscard]] const char* to_text(Integrator integrator);

struct ToolModel {
  Integrator integrator = Integrator::kBackward;
  double mass_kg = 0.1;  ///< m_t; in rotation kg m^2
};

/// Next position and velocity of a tool under -k x - b v with everything else at rest.
[[nodiscard]] Eigen::Matrix2d tool_matrix(const ToolModel& tool, double stiffness_n_per_m,
                                          double damping_ns_per_m, double period_s);

/// Largest k_s T^2 / m_t of a tool alone with damping ratio `ratio` (b = 2 ratio sqrt(k_s m_t));
/// kNoLimit when there is none.
[[nodiscard]] double tool_limit(Integrator integrator, double ratio);

/// Coupling between tool and device: damping 2 ratio sqrt(K_c m_t).
struct ToolCoupling {
  double stiffness_n_per_m = 1000;  ///< K_c
  double ratio = 0.7;
};

/// Device, tool and wall of stiffness `wall_n_per_m`. At a sample the tool takes one step with the
/// device held at its sampled position and its speed taken as the backward difference; the coupling
/// wrench to the stepped tool goes to the device, d samples later.
[[nodiscard]] Eigen::MatrixXd coupled_matrix(const LinearLoop& loop, const ToolModel& tool,
                                             const ToolCoupling& coupling, double wall_n_per_m);

/// Largest coupling stiffness K_c at which the coupled loop is stable [N/m]: 0 when there is none,
/// kNoLimit when every one up to kLargestCoupling is.
inline constexpr double kLargestCoupling_n_per_m = 1e7;
[[nodiscard]] double coupling_limit(const LinearLoop& loop, const ToolModel& tool,
                                    double wall_n_per_m, double ratio);

}  // namespace haptic::sim
