// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The gaps between several bodies and the energies of their springs, judged in long double from
/// poses and vertices alone: solids by a direction that keeps their pieces apart, surfaces triangle
/// against triangle.

#include <deque>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "host_sim/lab/bodies_fuzz/bodies_scene.hpp"
#include "host_sim/lab/proxy_fuzz/proxy_judge.hpp"
#include "host_sim/oracle/mesh_pair.hpp"
#include "rt_core/bodies/body_law.hpp"

namespace haptic::sim {

/// Pose of A in the mesh frame of B.
[[nodiscard]] WidePose seen_from_wide(const WidePose& b, const WidePose& a);

/// A length that a pull is proportional to, and its energy: Huber's function of a spring.
struct WidePull {
  WideVec force, torque;
  Wide energy_j = 0;
};
[[nodiscard]] WidePull wide_pull(const Spring& spring, const WideError& error);

/// A body as the judge has it.
struct JudgedBody {
  std::vector<OraclePiece> pieces;  ///< of a surface: none
  std::vector<Triangle> triangles;  ///< of everything
  Wide radius_m = 0;                ///< about the origin of its mesh frame
};

/// Two bodies, asked at poses of A in the mesh frame of B.
class BodyPairJudge {
 public:
  /// The bodies must outlive it.
  BodyPairJudge(const JudgedBody& a, const JudgedBody& b, Wide tolerance_m, Wide allowed_m);

  /// The smallest signed distance of two pieces where it is below `wanted_m`, else a lower bound of
  /// it; infinite: they are far. For a surface: 0, or less the depth of the deepest crossing.
  [[nodiscard]] Wide end_gap_m(const WidePose& pose, Wide wanted_m);
  /// The smallest one on the way, where it is deeper than allowed; else the smallest seen.
  [[nodiscard]] Wide way_gap_m(const WidePose& from, const WidePose& to);
  /// A lower bound of the distance, as a rule at least `within_m` where the distance is.
  [[nodiscard]] Wide clear_m(const WidePose& pose, Wide within_m);

 private:
  [[nodiscard]] bool far(const WidePose& pose, Wide distance_m) const;

  Wide radius_a_m_, reach_m_;  ///< reach: of both
  Wide tolerance_m_, allowed_m_;
  std::vector<FreeWitness> witnesses_;  ///< by pair of pieces
  std::unique_ptr<MeshPair> meshes_;    ///< where one is a surface
};

class BodiesJudge {
 public:
  /// The pairs are those that `compiled` has.
  explicit BodiesJudge(const CompiledBodies& compiled);
  BodiesJudge(const BodiesJudge&) = delete;
  BodiesJudge& operator=(const BodiesJudge&) = delete;

  struct PairGap {
    Wide gap_m = std::numeric_limits<Wide>::infinity();
    std::size_t pair = 0;  ///< number among the compiled ones
  };
  /// The smallest of all pairs, as BodyPairJudge has it.
  [[nodiscard]] PairGap end_gap(std::span<const WidePose> poses, Wide wanted_m);
  /// On the ways of all pairs, each in the mesh frame of its B.
  [[nodiscard]] PairGap way_gap(std::span<const WidePose> before, std::span<const WidePose> after);
  /// How far one body is at least from all others and from what stands.
  [[nodiscard]] Wide clear_m(std::size_t body, std::span<const WidePose> poses, Wide within_m);
  /// The same from the bodies before it alone, and from what stands.
  [[nodiscard]] Wide clear_of_earlier_m(std::size_t body, std::span<const WidePose> poses,
                                        Wide within_m);

  [[nodiscard]] Wide tolerance_m() const { return tolerance_m_; }  ///< of "free" in the core
  /// Depth that the checks allow: the tolerance, and the rounding of what it is measured from.
  [[nodiscard]] Wide allowed_depth_m() const { return allowed_m_; }
  [[nodiscard]] Wide extent_m() const { return extent_m_; }
  [[nodiscard]] bool has_surfaces() const { return has_surfaces_; }
  /// "hand box, driver prism".
  [[nodiscard]] std::string name_of(std::size_t pair) const;
  [[nodiscard]] const CompiledBodyPair& pair(std::size_t number) const {
    return compiled_.pairs[number];
  }

 private:
  [[nodiscard]] WidePose relative(std::size_t pair, std::span<const WidePose> poses) const;
  template <typename Wanted>
  [[nodiscard]] Wide clear_of(std::span<const WidePose> poses, Wide within_m, const Wanted& wanted);

  const CompiledBodies& compiled_;
  std::deque<JudgedBody> bodies_;  ///< by body, and at the end what stands
  std::vector<BodyPairJudge> pairs_;
  Wide tolerance_m_ = 0, allowed_m_ = 0, extent_m_ = 0;
  bool has_surfaces_ = false;
};

}  // namespace haptic::sim
