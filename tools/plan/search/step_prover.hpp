// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Finds the planes that prove a straight motion of the part free: for every pair of pieces that
/// spheres do not keep apart, the plane of a face or of two edges that leaves a distance on all of
/// the way (tools/plan/plan_check.hpp has the bound, and checks what is found here). A motion whose
/// planes turn too fast for the bound is cut in halves. A pose that leaves the scene's limits is
/// not free, and no way leads there.

#include <cstdint>
#include <limits>
#include <optional>
#include <unordered_map>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "tools/plan/plan_limits.hpp"
#include "tools/plan/search/pose_algebra.hpp"

namespace haptic::tools {

/// Proved steps one after the other: `poses` after the start, each with the planes of the step
/// that leads to it.
struct ProvedMotion {
  std::vector<PlanPose> poses;
  std::vector<std::vector<PlanWitness>> steps;
};

/// A motion as corners with a proved straight way between each two.
struct CorneredMotion {
  std::vector<PlanPose> corners;
  [[nodiscard]] double length_m(double turn_m) const;
};

enum class ProofSearch : std::uint8_t {
  kAny,   ///< the first plane that does
  kBest,  ///< the best of all faces', for a clearance
  /// The plane that did last while it leaves a distance, and as much at the ends as ClearEnds asks
  /// for, else the best: a plane then lasts for a run of steps.
  kKept,
};

/// What a plane that is kept must leave where the motion begins and where it ends [m].
struct ClearEnds {
  double begin_m = -std::numeric_limits<double>::infinity();
  double end_m = -std::numeric_limits<double>::infinity();
};

class StepProver {
 public:
  /// The view must outlive it. Depths to `tolerance_m` count as free, of a pair with a facet none.
  StepProver(const SceneView& scene, double tolerance_m);

  /// Whether the straight way is proved in at most 2^`halvings` steps.
  [[nodiscard]] bool prove(const PlanPose& from, const PlanPose& to, int halvings);

  /// Appends those steps; false, and `motion` as before: none were found.
  [[nodiscard]] bool prove(const PlanPose& from, const PlanPose& to, int halvings,
                           ProofSearch search, ProvedMotion& motion, const ClearEnds& ends = {});

  /// Whether the pose is within the scene's limits, and a plane of every pair leaves a distance.
  [[nodiscard]] bool is_free(const PlanPose& pose);

  /// Lower bound of the distance of the nearest pair at a pose, and the direction that parts it;
  /// pairs farther than half the part's radius are not looked at, and that is the bound.
  struct Clearance {
    double gap_m = 0;
    Vec3d normal_w = Vec3d::Zero();  ///< towards A; zero where spheres alone were looked at
  };
  [[nodiscard]] Clearance clearance(const PlanPose& pose);

  /// The pair that the last motion failed for, and where.
  struct Blocked {
    std::uint32_t piece_a = 0, piece_b = 0;
    PlanPose at;
  };
  [[nodiscard]] const Blocked& blocked() const { return blocked_; }
  /// What was done since it was made, counted as vertices looked at: the same for the same calls on
  /// any machine, and about in proportion to the time they take.
  [[nodiscard]] std::uint64_t work() const { return work_; }

 private:
  struct Edge {
    std::uint32_t v0 = 0, v1 = 0, apex[2] = {0, 0};
    Vec3d unit = Vec3d::Zero();
  };
  struct Piece {
    std::vector<Vec3d> vertices, normals;
    std::vector<Edge> edges;
    Vec3d centre = Vec3d::Zero(), reference = Vec3d::Zero();
    double radius_m = 0, reach_m = 0;
    bool flat = false;
  };
  struct Plane {
    char kind = 'A';
    std::uint32_t i = 0, j = 0;
    bool flipped = false;
  };
  struct Placed {
    Vec3d x0;
    Eigen::Matrix3d r;
  };
  struct Motion {
    Placed p, q;
    Vec3d dx, turn;
    double far = 0, angle = 0;
  };
  enum class Found : std::uint8_t { kProved, kTurnsTooFast, kMeets };

  [[nodiscard]] double gap_m(const Placed& at, const Piece& a, const Piece& b, const Vec3d& n);
  [[nodiscard]] static Vec3d normal_of(const Placed& at, const Piece& a, const Piece& b,
                                       const Plane& plane);
  [[nodiscard]] static double bound_m(const Motion& motion, const Piece& a, const Piece& b,
                                      const Vec3d& n_p, const Vec3d& n_q, double g_p, double g_q);
  [[nodiscard]] Found find_plane(const Motion& motion, std::uint32_t i, std::uint32_t j,
                                 ProofSearch search, const ClearEnds& ends, PlanWitness& witness);
  [[nodiscard]] Found try_step(const PlanPose& from, const PlanPose& to, ProofSearch search,
                               const ClearEnds& ends, std::vector<PlanWitness>& planes);
  /// Calls take(pose, planes) for each step that is proved; false: not all are.
  template <typename Take>
  [[nodiscard]] bool prove_steps(const PlanPose& from, const PlanPose& to, int halvings,
                                 ProofSearch search, const ClearEnds& ends, const Take& take);
  [[nodiscard]] static PlanDirection direction_of(const Piece& a, const Piece& b,
                                                  const Plane& plane);
  /// Fixed pieces, ascending, that a ball may touch: all that do, and others.
  void find_near(const Vec3d& centre, double radius_m);
  void sort_fixed_pieces();
  template <typename Visit>
  void for_each_plane(const Placed& at, const Piece& a, const Piece& b, bool edges_too,
                      const Visit& visit);

  PlanLimits limits_;
  std::vector<Piece> pieces_;
  /// Fixed pieces by where the middles of their spheres lie along the axis on which they lie the
  /// farthest apart, but for large ones; the largest radius of these spheres; the large ones.
  std::vector<std::pair<double, std::uint32_t>> along_axis_;
  int axis_ = 0;
  double largest_m_ = 0, reach_m_ = 0;
  std::vector<std::uint32_t> large_;
  std::vector<std::uint32_t> near_;  ///< of find_near
  std::uint32_t moving_ = 0;
  double tolerance_m_ = 0;
  std::unordered_map<std::uint64_t, Plane> last_;  ///< by pair: the plane that did last
  Blocked blocked_;
  std::uint64_t work_ = 0;
};

}  // namespace haptic::tools
