// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The scenes of the proxy campaign: parts and obstacles of the kinds that break god-objects. All
/// made here, grip point at the part's origin, obstacles about the origin of W.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

/// A plate about the origin, normal along z: nothing may come through it.
struct FuzzPlate {
  double half_x_m = 0, half_y_m = 0;
};

struct FuzzScene {
  std::string name;
  Solid part;
  std::vector<Solid> pieces;         ///< of one static body
  double share = 1;                  ///< of the ticks; less where they take longer
  Vector home = Vector::Zero();      ///< the device wanders about here
  Vector range = Vector::Zero();     ///< as far as this along each axis [m]
  double tilt_rad = 3.2;             ///< and turns from upright up to this
  Vector start = Vector(0, 0, 0.2);  ///< free, upright
  std::optional<FuzzPlate> plate;
  bool device = false;  ///< with a [device]: its length, damping, passivity
};

/// All scenes, the same in every run.
[[nodiscard]] std::vector<FuzzScene> fuzz_scenes();

/// Stiffness of the coupling in every scene: 1000 N/m, and the default length.
inline constexpr double kFuzzStiffness_n_per_m = 1000.0;

/// Those, a wedge of 1 degree in its groove and a box under a ceiling that tilts by 1 degree, a peg
/// with 1 um of clearance, and some of them five hundred times smaller.
[[nodiscard]] std::vector<FuzzScene> hold_scenes();

/// The solid turned and then moved.
[[nodiscard]] Solid placed(Solid solid, const Rotation& q, const Vector& p);

/// Compiled for law `proxy`. Without a device there is no damping: the wrench is the spring's pull.
/// With one of 0.1 kg: damping and passivity. `passes`,
/// `work_units` 0: the default.
/// @throws tools::InputError when the writer refuses it.
[[nodiscard]] std::vector<std::byte> compiled(const FuzzScene& scene, double friction,
                                              std::uint32_t passes = 0,
                                              std::uint32_t work_units = 0);

}  // namespace haptic::sim
