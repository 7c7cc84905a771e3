// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A square peg of 10 mm and its hole in five pieces, with any clearance and friction, led through
/// two insertions under the proxy law.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "host_sim/shapes/contact_case.hpp"
#include "host_sim/shapes/contact_path.hpp"

namespace haptic::sim {

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
[[nodiscard]] std::vector<std::byte> inserted_peg_scene(double clearance_m, double friction);

/// Where device and proxy are, and the wrench on the hand.
struct PegState {
  PathPose device, proxy;
  Vector force_n = Vector::Zero(), torque_nm = Vector::Zero();
};

struct PegRun {
  double largest_force_step_n = 0, largest_torque_step_nm = 0;
  double largest_force_n = 0;  ///< across the hole
  double worst_gap_m = 0;
  PegState end;
  PegState slip;         ///< of kTilted: when the pushed peg has begun to move
  double deepest_m = 0;  ///< lowest z of a corner of the peg
  double advance_m = 0;  ///< of the proxy in z during the push of kTilted
  std::uint32_t refused_ticks = 0;
  std::vector<double> t_s, lag_mm;  ///< per tick: proxy over device
};

/// Runs the path in ticks of `period_s`; `trace`: fills the lists.
[[nodiscard]] PegRun run_peg(std::span<const std::byte> scene, PegPath path, double period_s,
                             bool trace);

/// How far the peg, as far as it is in the hole, reaches beyond its half width along +x [m]: the
/// clearance when it touches that wall.
[[nodiscard]] double reach_aside_m(const PathPose& peg);

/// Upward force that sliding contact can give a peg tilted about y: the lower corner on one wall,
/// its side on the rim across. Both normal forces follow from the spring's force along x and its
/// torque, each carries `friction` times itself along the peg's way [N].
[[nodiscard]] double two_point_force_n(const PegState& state, double clearance_m, double friction);

}  // namespace haptic::sim
