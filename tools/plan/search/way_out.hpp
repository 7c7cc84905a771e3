// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A way of one part out of an assembly, and on to where it is to lie: straight along directions
/// that the shapes suggest, which is cheap; by the cells of its free places, which decides whether
/// a translation leads out at all; and by the search. Every straight piece of a way is proved.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/plan/search/plan_search.hpp"
#include "tools/plan/search/sliding_part.hpp"
#include "tools/plan/search/step_prover.hpp"

namespace haptic::tools {

struct Ball {
  Vec3d centre = Vec3d::Zero();
  double radius_m = 0;
};

/// About the static bodies of a scene that `counts` says yes to, by body from 1; radius 0 where
/// there are none.
[[nodiscard]] Ball ball_about(const SceneView& scene,
                              const std::function<bool(std::size_t)>& counts);

/// Moves out of the pair of pieces that overlap most at a pose, and beyond; zero: nothing says
/// where. None: the pose is free. `depth_m`: by how much they overlap, about.
[[nodiscard]] std::optional<Vec3d> push_out(StepProver& prover, const PlanPose& pose,
                                            double beyond_m, double& depth_m);

/// Parts of an assembly may overlap by this share of its size, as their files round; they are moved
/// apart by no more, in steps of this share of that.
inline constexpr double kSettleShare = 1.0e-4, kSettleStep = 1.0 / 64;

/// How a way out was found.
enum class WayKind : std::uint8_t { kStraight, kCells, kSearch };

struct OutWay {
  CorneredMotion motion;  ///< from the pose in the assembly
  WayKind kind = WayKind::kStraight;
};

/// The moving part of a scene, whose other parts stand as they do when it is taken out.
class WayOut {
 public:
  /// @param rest  about what the part has to leave: there it is clear of it.
  /// `scene` must outlive it. @throws InputError as SlidingPart.
  WayOut(const SceneView& scene, const Ball& rest, std::uint64_t seed);

  [[nodiscard]] SlidingPart& part() { return part_; }
  [[nodiscard]] StepProver& prover() { return prover_; }

  /// The pose nearest to `pose` found at which the part is free and in no closed surface, moved by
  /// `most_m` at most: parts of an assembly overlap by the rounding of their files. None: there is
  /// none so near, and `depth_m` is by how much they overlap, about.
  [[nodiscard]] std::optional<PlanPose> settled(const PlanPose& pose, double most_m,
                                                double& depth_m);

  /// Straight along one direction until the part is clear.
  [[nodiscard]] std::optional<OutWay> straight(const PlanPose& from);
  /// By translations, exactly; none: none leads out, if `impossible` says so, or the scene is
  /// beyond what the cells are for.
  [[nodiscard]] std::optional<OutWay> by_cells(const PlanPose& from, bool& impossible);
  /// By the search, with so many ticks of the core, to a pose that is clear in a direction of a few
  /// that `number` counts. The rest as search_plan.
  [[nodiscard]] std::optional<OutWay> by_search(
      const PlanPose& from, std::uint32_t number, const SearchLimits& limits,
      const std::function<void(const SearchState&)>& progress);
  /// From the pose where `way` ends, which is clear, to `to`: straight, or round the rest.
  [[nodiscard]] bool go_on(OutWay& way, const PlanPose& to);

  /// Planes that held the part in the last search, as it was pushed out of where it was.
  [[nodiscard]] const std::vector<HoldingPlane>& held_by() const { return held_by_; }
  /// The way between two given poses that were looked for by the last search.
  [[nodiscard]] const SearchState& searched() const { return searched_; }

 private:
  [[nodiscard]] PlanPose clear_pose(const PlanPose& from, const Vec3d& along) const;
  [[nodiscard]] std::vector<Vec3d> directions(const PlanPose& from) const;
  [[nodiscard]] bool prove_straight(const PlanPose& from, const PlanPose& to);

  const SceneView& scene_;
  Ball rest_;
  std::uint64_t seed_;
  SlidingPart part_;
  StepProver prover_;
  std::vector<HoldingPlane> held_by_;
  SearchState searched_;
};

}  // namespace haptic::tools
