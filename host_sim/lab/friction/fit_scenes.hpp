// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Tight fits whose friction is known: a part pressed against some of its walls and slid along
/// them, with the force that Coulomb's law gives.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/surface_fuzz/fuzz_meshes.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// Of the spring in all of them.
inline constexpr double kFitStiffness_n_per_m = 1000;

enum class FitKind : std::uint8_t {
  kSlot,      ///< a key between two walls, pressed on one
  kHole,      ///< a square peg between four, pressed on one
  kTube,      ///< a round peg of 24 facets in a bore of as many, pressed on one of them
  kDovetail,  ///< pulled up against both flanks
  kVee15,     ///< a V groove of 15 degrees on either side, pressed down
  kVee45,
  kCorner,  ///< on a floor and along a wall, pressed on both
};
inline constexpr FitKind kFitKinds[] = {FitKind::kSlot,     FitKind::kHole,  FitKind::kTube,
                                        FitKind::kDovetail, FitKind::kVee15, FitKind::kVee45,
                                        FitKind::kCorner};
[[nodiscard]] const char* fit_name(FitKind kind);

struct FitScene {
  std::string text;                 ///< of the scene file, up to [rendering]
  std::vector<OutputText> files;    ///< beside it
  Vector press_w = Vector::Zero();  ///< by so many m for 1 m of the spring's stretch
  Vector reach_w = Vector::Zero();  ///< from its place until it touches [m]
  Vector slide_w = Vector::UnitZ();
  double normal_share = 1;  ///< sum of the normal forces over the force of one stretch
  /// From this coefficient on the walls that are pressed lock the part by themselves: statics
  /// allows any force along them.
  double locks_at = 1e9;
};

/// The part in the middle of its fit, `clearance_m` wide in all. A V groove has none.
[[nodiscard]] FitScene fit_scene(FitKind kind, double clearance_m);
/// The whole scene file, of parts "a" and "b". `passes`: 0 leaves the compiler's; `units`: of the
/// budget, 0 as well.
[[nodiscard]] std::string scene_text(const std::string& parts, double k_n_per_m, double friction,
                                     std::uint32_t passes, std::uint32_t units);

/// A prism along y over a polygon in x and z, given counter-clockwise seen against y.
[[nodiscard]] FuzzMesh prism_along_y(const std::vector<std::array<double, 2>>& polygon,
                                     double low_m, double high_m);
/// The tables [moving] and [[static]] of a box, and of a mesh file.
[[nodiscard]] std::string box_text(bool moving, const Vector& size_m, const Vector& at_m);
[[nodiscard]] std::string mesh_text(bool moving, const std::string& file, const Vector& at_m);

}  // namespace haptic::sim
