// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What must hold of every tick of the proxy, judged in long double from poses and vertices alone:
/// it is free, its energy does not rise, nothing comes through a plate, the wrench is the spring's
/// pull, and it does not stand still where it could follow.

#include <cstdint>
#include <vector>

#include "host_sim/lab/proxy_fuzz/fuzz_scene.hpp"
#include "host_sim/oracle/exhaustive.hpp"
#include "rt_core/haptic_core.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {

// Whether two convex pieces are apart, from their vertices alone and in long double: a direction
// along which there is a gap proves it, whoever found the direction. Directions come from the
// normals of faces and the cross products of edges, the last one first; nothing of
// rt_core/contact is used.

/// A direction from B to A and the gap along it: a lower bound of the signed distance.
struct FreeGap {
  Wide gap_m = -std::numeric_limits<Wide>::infinity();
  WideVec normal_w;
  std::uint32_t vertex_a = 0, vertex_b = 0;  ///< between which the gap is
};

/// From the first vertex of an edge to its second [m].
[[nodiscard]] inline WideVec along(const OraclePiece& piece, std::uint32_t edge) {
  const OracleEdge& e = piece.edges[edge];
  return piece.vertices[e.vertex[1]] - piece.vertices[e.vertex[0]];
}

struct PairPath;

class FreeWitness {
 public:
  /// The pieces must outlive it.
  FreeWitness(const OraclePiece& a, const OraclePiece& b);

  /// The first gap found of at least `wanted_m`; else the largest known. Climbs from the last
  /// direction over the features at its support vertices, then from every face.
  [[nodiscard]] FreeGap find(const OraclePose& pose, Wide wanted_m);
  /// The signed distance by every face and every pair of edges. Milliseconds for large pieces.
  [[nodiscard]] Wide exhaustive_m(const OraclePose& pose) const;
  /// The smallest signed distance found on the way from `from` to `to`: straight, turning evenly.
  /// Cut in halves until every part is proven to stay above `wanted_m` by one face or pair of edges
  /// (or by the speed of its points), or is too short to matter; stops early once it is deeper.
  [[nodiscard]] Wide path_m(const PairPath& path, Wide wanted_m, Wide resolution_m);
  /// Whether the spheres round the pieces are this far apart.
  [[nodiscard]] bool far(const OraclePose& pose, Wide distance_m) const;

  /// The gap along a unit direction.
  [[nodiscard]] Wide gap_m(const OraclePose& pose, const WideVec& normal) const {
    return gap_along(pose, normal).gap_m;
  }

  [[nodiscard]] const OraclePiece& piece_a() const { return a_; }
  [[nodiscard]] const OraclePiece& piece_b() const { return b_; }

 private:
  enum class Kind : std::uint8_t { kFaceA, kFaceB, kEdges };
  struct Direction {
    Kind kind = Kind::kFaceB;
    std::uint32_t i = 0, j = 0;
    Wide sign = 1;
  };
  struct Incidence {
    std::vector<std::vector<std::uint32_t>> faces, edges;  ///< by vertex
    WideVec centre;
    Wide radius_m = 0, lever_m = 0;  ///< about the centre, about the origin
    explicit Incidence(const OraclePiece& piece);
  };
  struct Sample {
    Wide at = 0, gap_m = 0;
    OraclePose pose;
    Direction direction;
  };
  [[nodiscard]] Sample sampled(const PairPath& path, Wide at, Wide wanted_m);
  [[nodiscard]] bool proven(const PairPath& path, const Sample& from, const Sample& to,
                            const Direction& d, Wide wanted_m) const;
  [[nodiscard]] bool normal_of(const OraclePose& pose, const Direction& d, WideVec& normal) const;
  [[nodiscard]] FreeGap gap_along(const OraclePose& pose, const WideVec& normal) const;
  void consider(const OraclePose& pose, const Direction& d, Direction& best, FreeGap& gap) const;
  void climb(const OraclePose& pose, Wide wanted_m, Direction& best, FreeGap& gap) const;

  const OraclePiece& a_;
  const OraclePiece& b_;
  Incidence at_a_, at_b_;
  Wide size_m_;
  Direction last_;
};

/// A pose in long double; the quaternion of unit length.
struct WidePose {
  WideVec p;
  Wide q_wxyz[4] = {1, 0, 0, 0};
  WideRotation r;
};
[[nodiscard]] WidePose wide_pose(const Pose& pose);
/// Displaced by dx, and turned by exp(dtheta).
[[nodiscard]] WidePose moved_pose(const WidePose& pose, const WideVec& dx, const WideVec& dtheta);

/// The way of A between two configurations, as B sees it: straight, and turning evenly about one
/// axis by the smaller angle.
struct PairPath {
  WidePose from, to;
  WideVec reference_w;  ///< of B's body
  WideVec move_m, turn_rad;
  PairPath(const WidePose& from, const WidePose& to, const WideVec& reference_w);
  [[nodiscard]] OraclePose at(Wide share) const;
};

/// (x_d - x, log(R_d R^T)) of goal against proxy.
struct WideError {
  WideVec translation_m, rotation_rad;
};
[[nodiscard]] WideError wide_error(const WidePose& goal, const WidePose& proxy);

class ProxyJudge {
 public:
  /// `view` is only read here. Grip point at the part's origin.
  ProxyJudge(const FuzzScene& scene, const SceneView& view);
  ProxyJudge(const ProxyJudge&) = delete;
  ProxyJudge& operator=(const ProxyJudge&) = delete;

  /// Lower bound of the smallest signed distance of all pairs (infinite: all are far), as a rule
  /// at least `wanted_m` where the distance is.
  [[nodiscard]] Wide free_gap_m(const WidePose& pose, Wide wanted_m);
  /// The smallest signed distance itself, by the exhaustive search of every pair with no gap of
  /// `wanted_m` at hand.
  [[nodiscard]] Wide exact_gap_m(const WidePose& pose, Wide wanted_m);
  /// The first where it is at least `wanted_m`, else the second.
  [[nodiscard]] Wide end_gap_m(const WidePose& pose, Wide wanted_m) {
    const Wide gap = free_gap_m(pose, wanted_m);
    return gap < wanted_m ? exact_gap_m(pose, wanted_m) : gap;
  }

  /// The smallest signed distance on the way from one configuration to the next, where it is below
  /// `-allowed_depth_m()`; else the smallest seen.
  [[nodiscard]] Wide path_gap_m(const WidePose& before, const WidePose& after);

  [[nodiscard]] Wide potential_j(const WideError& error) const;
  /// Largest difference of the wrench to -K g, as a share of what rounding makes of it. `held`: the
  /// force and the torque of it may be shorter.
  [[nodiscard]] Wide wrench_error(const Wrench& wrench, bool held, const WidePose& goal,
                                  const WidePose& proxy) const;
  /// Whether a point of the part went through the plate, well inside its rim.
  [[nodiscard]] bool crossed(const WidePose& before, const WidePose& after) const;
  /// Energy after a move of 0.1 mm (of a part of 50 mm) straight towards the goal, when nothing is
  /// within twice that; infinite else.
  [[nodiscard]] Wide unhindered_j(const WidePose& goal, const WidePose& proxy);
  /// More than a hundredth of a millimetre, of a part of 50 mm: a release takes several ticks.
  [[nodiscard]] bool moves(const WidePose& before, const WidePose& after) const;
  /// Whether a small free move lowers the energy by clearly more than rounding: along the pull, or
  /// at random, off what touches. Without friction only. Deterministic.
  [[nodiscard]] bool could_follow(const WidePose& goal, const WidePose& proxy);

  [[nodiscard]] Wide radius_m() const { return radius_m_; }
  [[nodiscard]] Wide tolerance_m() const { return tolerance_m_; }  ///< of "free" in the core
  /// Depth that the checks allow: the tolerance, 0.1 um for a part of 50 mm, and the rounding of
  /// what it is measured from.
  [[nodiscard]] Wide allowed_depth_m() const { return tolerance_m_ + rounding_m_; }
  /// Largest residual in N (torque over the length of the coupling) that contact forces leave of
  /// the spring's pull: the smallest |pull + sum of them| over all non-negative ones at the pairs
  /// of features that touch, with Coulomb friction where `friction` > 0.
  [[nodiscard]] Wide residual_n(const WidePose& goal, const WidePose& proxy, Wide friction);

 private:
  struct Row {
    WideVec n, moment, arm;  ///< arm: from the grip point, W axes
  };
  [[nodiscard]] OraclePose in_frame(const WidePose& pose, std::size_t pair) const;
  void feature_rows(const WidePose& proxy, std::size_t pair, std::vector<Row>& rows) const;
  void touching_rows(const WidePose& proxy, std::vector<Row>& rows);
  void push_out(const std::vector<Row>& rows, WideVec& dx, WideVec& dtheta) const;
  [[nodiscard]] bool lowers(const WidePose& goal, const WidePose& proxy, const WideVec& dx,
                            const WideVec& dtheta, Wide start_j, Wide least_j);

  std::vector<OraclePiece> pieces_;
  std::vector<FreeWitness> witnesses_;  ///< by pair
  std::vector<WideVec> references_;     ///< of B's body, by pair
  std::optional<FuzzPlate> plate_;
  Wide k_t_, k_r_, length_m_;
  Wide limit_rad_;  ///< turn from which on the torque no longer grows
  Wide radius_m_ = 0, tolerance_m_ = 0, rounding_m_ = 0;
};

}  // namespace haptic::sim
