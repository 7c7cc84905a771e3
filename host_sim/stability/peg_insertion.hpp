// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A square peg of 10 mm and its hole in five pieces, with any clearance and friction, led through
/// two insertions under the proxy law.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/continuity/contact_path.hpp"

namespace haptic::sim {

inline constexpr double kPegHalfWidth_m = 0.005, kPegHalfLength_m = 0.030;
/// Stiffness of the spring between device and proxy.
inline constexpr double kPegStiffness_n_per_m = 1000.0, kPegTurnStiffness_nm_per_rad = 1.0;

/// How the device moves. Both start free of the hole's walls.
enum class PegPath : std::uint8_t {
  /// From above the mouth to the floor, swaying sideways and tilting against the walls; at the end
  /// 2 mm off the middle along x.
  kWobble,
  /// 15 mm deep, tilted by kPegTilt_rad about y until the peg stands on two points, then pushed
  /// down
  /// by kPegPush_m.
  kTilted
};
inline constexpr double kPegTilt_rad = 0.08, kPegPush_m = 0.008;

/// Device at s seconds of the path, origin of the peg in its middle, rim of the hole at z = 0.
[[nodiscard]] PathPose device_on(PegPath path, double s);
[[nodiscard]] double duration_s(PegPath path);

/// Bytes of peg and hole; clearance per side. @throws tools::InputError when refused.
[[nodiscard]] std::vector<std::byte> peg_scene(double clearance_m, double friction);

struct PegRun {
  double largest_force_step_n = 0, largest_torque_step_nm = 0;
  double worst_gap_m = 0;
  PathPose device, proxy;  ///< at the end
  Vector force_n = Vector::Zero(), torque_nm = Vector::Zero();
  double deepest_tip_m = 0;   ///< lowest z of the middle of the peg's lower end
  double advance_m = 0;       ///< of the proxy in z during the push of kTilted
  double last_advance_m = 0;  ///< during its last tenth
  std::uint32_t refused_ticks = 0;
  std::vector<double> t_s, lag_mm, force_z_n, offset_mm;  ///< per tick: proxy over device
};

/// Runs the path in ticks of `period_s`; `trace`: fills the lists.
[[nodiscard]] PegRun run_peg(std::span<const std::byte> scene, PegPath path, double period_s,
                             bool trace);

/// Force along z that friction on two points can hold against the push, at the end of kTilted: the
/// couple of the normals balances the torque of the spring over the height between lower corner and
/// rim, each normal carries mu times itself.
[[nodiscard]] double two_point_friction_n(const PegRun& run, double friction);

}  // namespace haptic::sim
