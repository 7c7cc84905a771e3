// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A plan: a motion of the moving part from a start to a goal, as poses that are joined by straight
/// steps, and the planes that prove the steps free. A plane is written once, with all pairs of
/// pieces that it keeps apart and the run of steps in which it does. Written by `host_sim plan`,
/// proved again by `scene_inspect --plan` (plan_check.hpp), given to the hand by the compiler's
/// [guide].
///
/// Poses are those of the grip point: x_0^A in W [m] and the orientation of A. Along a straight
/// step the grip point moves and the part turns at constant speed, by the shorter way. SI units.

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "tools/plan/plan_pose.hpp"

namespace haptic::tools {

/// The direction of a plane between two convex pieces, from B's to A's, by what it turns with. With
/// R, the orientation of A: R of_a, of a face of A; of_b, of a face of B; R of_a x of_b, across two
/// edges. Along a step it changes at constant rate from what it is at the one pose to what it is at
/// the other.
struct PlanDirection {
  char kind = 'B';  ///< 'A', 'B' or 'C'
  /// Directions of about unit length; zero where the kind has none. of_a in the frame of A, of_b in
  /// W.
  std::array<double, 3> of_a{}, of_b{};

  friend auto operator<=>(const PlanDirection&, const PlanDirection&) = default;
};

/// A plane that keeps a pair of pieces apart in one step.
struct PlanWitness {
  std::uint32_t piece_a = 0, piece_b = 0;  ///< of the scene
  PlanDirection direction;

  friend bool operator==(const PlanWitness&, const PlanWitness&) = default;
};

/// A pair of pieces over a run of steps, from `first` to `last`; step k is between poses k and k+1.
struct PlanRun {
  std::uint32_t piece_a = 0, piece_b = 0, first = 0, last = 0;

  friend bool operator==(const PlanRun&, const PlanRun&) = default;
};

/// A plane and all that it keeps apart.
struct PlanPlane {
  PlanDirection direction;
  std::vector<PlanRun> runs;  ///< by first step, then by piece of A, then of B

  friend bool operator==(const PlanPlane&, const PlanPlane&) = default;
};

/// Two pieces that touch at a station, as far as the plan's contact distance goes.
struct PlanContact {
  std::uint32_t piece_a = 0, piece_b = 0;
  char kind = 'A';  ///< as PlanDirection::kind

  friend bool operator==(const PlanContact&, const PlanContact&) = default;
};

/// A pose of the plan that the guide knows.
struct PlanStation {
  std::uint32_t pose = 0;             ///< index in Plan::poses
  double clearance_m = 0;             ///< proved: no pair of pieces is nearer; below 0 by rounding
  double cost_to_go_m = 0;            ///< length of the rest of the plan
  std::vector<PlanContact> contacts;  ///< by piece of A, then of B

  friend bool operator==(const PlanStation&, const PlanStation&) = default;
};

struct Plan {
  std::uint64_t geometry = 0;         ///< geometry_hash of the scene
  std::uint64_t seed = 0;             ///< of the search
  std::string scene;                  ///< its name, for people
  double tolerance_m = 0;             ///< depth that counts as free; of a facet nothing does
  double contact_m = 0;               ///< pieces nearer than this touch
  double length_m = 0;                ///< that a turn of 1 rad counts as
  std::vector<PlanPose> poses;        ///< from the start to the goal
  std::vector<PlanPlane> planes;      ///< of a pair in a step there is one at the most
  std::vector<PlanStation> stations;  ///< ascending; the first pose, .., the last

  [[nodiscard]] std::size_t steps() const { return poses.empty() ? 0 : poses.size() - 1; }

  friend bool operator==(const Plan&, const Plan&) = default;
};

/// A control character of ASCII, which a plan's name of a scene does not hold.
[[nodiscard]] constexpr bool is_control(char c) { return (c >= 0 && c < ' ') || c == 127; }

/// Limits of the format.
inline constexpr std::size_t kMostPlanPoses = 200'000;
inline constexpr std::size_t kMostPlanPlanes = 2'000'000;
inline constexpr std::size_t kMostPlanRuns = 16'000'000;  ///< of all planes
inline constexpr std::size_t kMostPlanStations = 256;
inline constexpr double kMostPlanPlace_m = 1.0e6;  ///< of each coordinate
inline constexpr std::size_t kMostPlanBytes = std::size_t{1} << 30;

/// The planes of a plan, one step after the other.
class PlanSweep {
 public:
  /// The plan must outlive it. Cost: the runs are sorted.
  explicit PlanSweep(const Plan& plan);

  /// The planes of a step, by piece of A, then of B, until the next call. Steps ascend from call
  /// to call; one may be asked for again.
  [[nodiscard]] const std::vector<PlanWitness>& at(std::size_t step);

 private:
  struct Entry {
    const PlanRun* run;
    const PlanDirection* direction;
  };
  std::vector<Entry> all_;     ///< by first step, then by piece
  std::vector<Entry> active_;  ///< by piece
  std::vector<PlanWitness> planes_;
  std::size_t next_ = 0;  ///< of all_
  std::size_t step_ = 0;
  bool begun_ = false;
};

/// Hash of what a plan is a proof about: the vertices of all pieces and where the bodies stand.
/// Gains, budgets and marks of a scene do not change it.
[[nodiscard]] std::uint64_t geometry_hash(const SceneView& scene) noexcept;

/// Length of the straight step between two poses: root of |dx|^2 + (length_m angle)^2.
[[nodiscard]] double step_length_m(const PlanPose& from, const PlanPose& to, double length_m);

/// The file, as text; the last line is a hash of all before. Numbers are exact.
[[nodiscard]] std::string plan_as_text(const Plan& plan);

/// Reads it back. Everything is checked that can be without the scene: the hash, that every number
/// is one and within the format's limits, that no pose is there twice in a row, that indices exist
/// and ascend, that no pair has two planes in a step, and that the costs to go are those of the
/// poses. @throws InputError "FILE:LINE: defect; fix".
[[nodiscard]] Plan parse_plan(std::string_view text, const std::string& file);
[[nodiscard]] Plan read_plan(const std::string& path);

/// The same text with its last line made again: for tests of what the hash would hide.
[[nodiscard]] std::string resealed_plan(std::string_view text);

}  // namespace haptic::tools
