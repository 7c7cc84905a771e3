// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Pairs of parts as people draw them and bring them along: families of drawings, each with its
/// dimensions drawn from a seed and with a clearance, where the moving part starts, and the way in.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host_sim/lab/strangers/drawn_mesh.hpp"

namespace haptic::sim {

/// Where a fixed part stands: its position, then roll, pitch and yaw about fixed axes.
struct PartPlace {
  Vector position_mm = Vector::Zero();
  Vector rpy_rad = Vector::Zero();
  [[nodiscard]] Rotation rotation() const;
};

/// Where the moving part is beside its way in.
struct WayPose {
  double to_go_mm = 0;           ///< along the way until it is home
  double across_mm[2] = {0, 0};  ///< beside the way
  double tilt_rad[2] = {0, 0};   ///< about the two directions across, about its middle
  double turn_rad = 0;           ///< about the way, through the origin of its file
};

struct StrangerPair {
  std::string family;
  std::uint64_t seed = 0;
  double clearance_mm = 0;
  DrawnMesh moving;  ///< where it is home, in the frame of W
  std::vector<DrawnMesh> fixed;
  std::vector<PartPlace> places;  ///< of the fixed parts, as the scene file says them
  /// The same as they are meant, before the numbers were cut to five digits; empty: no other.
  std::vector<PartPlace> meant;
  Vector way = -Vector::UnitZ();                ///< of insertion, unit length
  double depth_mm = 10;                         ///< of the straight way
  double before_mm = 4;                         ///< of free way before it; there the part starts
  double beyond_mm = 3;                         ///< how far the hand presses beyond home
  double beside_mm = 0.3, beside_rad = 0.0175;  ///< that the hand misses the way by
  std::vector<WayPose> detour;                  ///< first, on the way from the start
  double turn_rad = 0;                          ///< on the straight way
  std::vector<WayPose> turns;  ///< turn and way to go, after the straight way, until home
  bool as_text = false;        ///< the STL files

  [[nodiscard]] WayPose start() const;
  /// Pose of the moving part's file in W [m].
  [[nodiscard]] MotionSample pose(const WayPose& at, double t_s) const;
};

/// Their names, in the order of the reports.
[[nodiscard]] std::vector<std::string_view> stranger_families();
/// The clearances that belong to a family [mm], a share of 5 um to 1 mm.
[[nodiscard]] std::vector<double> clearances_of(std::string_view family);
/// A pair of a family; its clearance is drawn from its list unless given. Equal arguments, equal
/// bits. @throws tools::UsageError for a name that is no family.
[[nodiscard]] StrangerPair stranger_pair(std::string_view family, std::uint64_t seed,
                                         std::optional<double> clearance_mm = {});

}  // namespace haptic::sim
