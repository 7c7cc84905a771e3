// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The proof of a plan, in long double from the vertices of the scene alone: nothing of the core
/// is used, nor of what made the plan. Every pair of pieces is looked at in every step; the planes
/// that the plan brings are taken for nothing but directions to try, and that one plane is written
/// for many pairs and steps saves no look at any of them.
///
/// Let n(s) = (1 - s) n_0 + s n_1 be the direction of a plane on the way, d(s) the way from a
/// vertex of B's piece to one of A's, and M = n.d. n is linear, |d'| <= |dx| + r |turn| with the
/// largest distance r of a vertex of A's piece from the grip point, and |n.d''| <= r |turn| |n x
/// turn|: so |M''| <= K = 2 (|n'.dx| + |n'| r |turn|) + r |turn| max |n x turn|, the maximum being
/// at an end. Hence M lies over the parabola of curvature K through the least values at both ends,
/// over all vertices, and the distance of the two pieces along n(s) over that by |n(s)|. A pair
/// without a plane is free where the spheres about its two pieces stay apart.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tools/graph_compiler/graph/wide3.hpp"
#include "tools/plan/plan.hpp"

namespace haptic::tools {

/// Proof of one step.
struct StepProof {
  bool holds = false;
  Wide least_m = 0;                        ///< lower bound of every pair's distance along the way
  std::uint32_t piece_a = 0, piece_b = 0;  ///< the pair with the least, or the one that fails
  bool has_plane = false;                  ///< of that pair
};

struct StationProof {
  Wide clearance_m = 0;  ///< lower bound of the distance of all pairs
  std::vector<PlanContact> contacts;
};

class PlanCheck {
 public:
  /// The view must outlive it. @throws InputError where the plan names pieces that the scene does
  /// not have so, or is of another scene.
  explicit PlanCheck(const SceneView& scene);

  /// Proves one straight step. `planes` by piece, each pair once. Depths to `tolerance_m` count as
  /// free, of a pair with a facet none.
  [[nodiscard]] StepProof step(const PlanPose& from, const PlanPose& to,
                               const std::vector<PlanWitness>& planes, double tolerance_m) const;

  /// Proof of a pose by the planes of the steps before and after it. Either may be null.
  [[nodiscard]] StationProof station(const PlanPose& pose, const std::vector<PlanWitness>* before,
                                     const std::vector<PlanWitness>* after, double contact_m) const;

  [[nodiscard]] const SceneView& scene() const { return scene_; }

 private:
  struct Piece {
    std::vector<Wide3> vertices;  ///< about the grip point, or the reference of the body
    Wide3 centre{};               ///< alike
    Wide radius_m = 0;            ///< about the centre
    Wide reach_m = 0;             ///< about the origin
    Wide3 reference{};            ///< of B's body; of A zero
    bool flat = false;
  };
  struct Placed {
    Wide3 x0{};
    std::array<Wide3, 3> rows{};  ///< of the rotation matrix
  };
  [[nodiscard]] static Placed placed(const PlanPose& pose);
  [[nodiscard]] static Wide3 turned(const Placed& at, const Wide3& v);
  /// Normal of unit length; zero where two edges are parallel.
  [[nodiscard]] static Wide3 normal(const Placed& at, const PlanDirection& direction);
  [[nodiscard]] Wide gap_m(const Placed& at, const Piece& a, const Piece& b, const Wide3& n) const;

  const SceneView& scene_;
  std::vector<Piece> pieces_;
  std::uint32_t moving_ = 0;  ///< pieces of A; they come first
};

/// Result of the check of a whole plan.
struct PlanProof {
  std::uint64_t steps = 0, certified = 0, pairs = 0;
  std::uint64_t planes = 0,
                runs = 0;        ///< of the plan; pairs over runs of steps that they keep apart
  std::uint64_t kept_apart = 0;  ///< by planes: pairs of each step, over all steps
  double least_m = 0;            ///< over all steps that hold
  std::string failure;           ///< a sentence; empty: every step, every station and the ends hold
  [[nodiscard]] bool holds() const { return failure.empty() && certified == steps; }
};

/// Depth that counts as free in this scene at the most: that of the core, and rounding.
[[nodiscard]] double most_tolerance_m(const SceneView& scene);

/// Checks all of a plan. @throws InputError when it is not of this scene: "FILE: defect; fix".
[[nodiscard]] PlanProof prove_plan(const SceneView& scene, const Plan& plan,
                                   const std::string& file);

}  // namespace haptic::tools
