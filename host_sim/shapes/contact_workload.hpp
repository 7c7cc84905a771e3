// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Seeded 1 kHz motions of one convex body on another, for methods to be timed and checked on:
/// every kind of contact in turn, approached, pressed, slid over and left at the speed of a hand.

#include <cstdint>
#include <span>
#include <vector>

#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

enum class WorkloadKind : std::uint8_t {
  kFreeFlight,  ///< 8 to 45 mm off
  kVertexFace,  ///< either body's vertex
  kFaceFace,    ///< tilt 1e-9 to 1e-3 rad
  kEdgeFace,    ///< edge of A along a face of B, same tilts
  kDeep,        ///< 5 to 12 mm inside
  kEdgeEdge,    ///< crossing edges
  kGrazing,     ///< fast slides within 20 um of touching
  kFaceEdge     ///< face of A on an edge of B, tilts as above
};
inline constexpr std::size_t kWorkloadKinds = 8;
[[nodiscard]] const char* to_text(WorkloadKind kind);

/// Speed limits of A's frame; no two poses 1 ms apart exceed them.
inline constexpr double kWorkloadSpeed_m_per_s = 0.3, kWorkloadTurn_rad_per_s = 3.0;

/// One pose, rounded to Real; `q_wa` has unit length within that rounding. B's frame is W.
struct WorkloadPose {
  Vector p_wa;
  Rotation q_wa;
};

/// A motion from start to end; the next recording starts elsewhere.
struct Recording {
  WorkloadKind kind = WorkloadKind::kFreeFlight;
  std::size_t begin = 0, end = 0;  ///< pose indices
};

struct ContactWorkload {
  std::vector<WorkloadPose> poses;
  std::vector<Recording> recordings;  ///< all poses, in order
};

/// `pose_count` poses in recordings of equal length, a whole number of them for every kind (500
/// poses each when there are enough, else 250 or less). Between key poses the position and the turn
/// follow one cubic from rest to rest, its length such that the limits hold.
/// @throws tools::InputError when there are fewer poses than kinds.
[[nodiscard]] ContactWorkload contact_workload(const Solid& a, const Solid& b,
                                               std::size_t pose_count, std::uint64_t seed);

}  // namespace haptic::sim
