// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The exhaustive long double search over all pairs of a compiled scene, and the account of what a
/// tracker got wrong.

#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "host_sim/oracle/exhaustive.hpp"
#include "rt_core/base/pose.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic::sim {

/// Truth of one pair at one pose, with the tolerance that the scalar of the core is held to.
struct PairVerdict {
  PairTruth truth;
  Wide tolerance_m = 0;  ///< relative_depth * size, and the rounding of the coordinates themselves

  /// +1 separated, -1 collision, 0 within the tolerance of touching: either verdict is right.
  [[nodiscard]] int side() const {
    if (truth.reference_m > tolerance_m) return 1;
    return truth.reference_m < -tolerance_m ? -1 : 0;
  }
  /// Distance of `d_near_m` from what D_near may be [m]; 0 within, infinite for NaN.
  [[nodiscard]] Wide error_m(Wide d_near_m) const {
    if (std::isnan(d_near_m)) return std::numeric_limits<Wide>::infinity();
    if (d_near_m < truth.lower_m) return truth.lower_m - d_near_m;
    return d_near_m > truth.upper_m ? d_near_m - truth.upper_m : 0;
  }
  [[nodiscard]] bool widened() const { return truth.upper_m - truth.lower_m > tolerance_m; }
};

class SceneOracle {
 public:
  /// The view's blob need not outlive the oracle.
  explicit SceneOracle(const SceneView& view);

  /// Truth of every pair with A's mesh frame at `pose_wa` (the numbers that the core is given; the
  /// quaternion is brought to unit length here in long double). `verdicts` gets one entry per pair.
  /// Verdict and depth of a pair that is apart are those of all of its nodes, so that they judge
  /// the scene's marks as well; a pair that collides has the depth of its live nodes where some are
  /// not.
  void evaluate(const Pose& pose_wa, std::vector<PairVerdict>& verdicts) const;

  [[nodiscard]] Wide size_m() const { return size_m_; }  ///< largest diameter of the scene's bodies

 private:
  struct Pair {
    std::size_t piece_a, piece_b, body_b;
    std::vector<bool> live;  ///< by node; empty where all that is needed carries force
  };
  std::vector<OraclePiece> pieces_;
  std::vector<Pair> pairs_;
  std::vector<WideVec> references_;  ///< of the bodies
  std::vector<Wide> sizes_;          ///< diameters of the bodies [m]
  Wide size_m_ = 0;
};

/// Counts over a run. A pair-tick is one pair in one tick.
struct CheckTotals {
  std::uint64_t ticks = 0, pair_ticks = 0;
  std::uint64_t wrong_verdict_ticks = 0, wrong_verdict_pairs = 0;
  std::uint64_t wrong_depth_ticks = 0, wrong_depth_pairs = 0;
  std::uint64_t false_collision_pairs = 0, missed_collision_pairs = 0;  ///< of the wrong verdicts
  std::uint64_t touching_pairs =
      0;  ///< within the tolerance of D_near = 0: either verdict counts as right
  std::uint64_t far_pairs = 0;  ///< apart, value a bound: verdict compared
  std::uint64_t bounded_pairs =
      0;  ///< colliding, flagged: verdict compared, value as a lower bound
  std::uint64_t widened_pairs = 0;      ///< nearly parallel edges outside: D_near itself is a range
  std::uint64_t longest_wrong_run = 0;  ///< ticks in a row with a wrong verdict or D_near
  std::uint64_t longest_wrong_verdict_run = 0;
  Wide largest_error_m = 0, tolerance_at_largest_m = 0;
  std::uint64_t first_wrong_tick = 0,
                first_wrong_pair = 0;  ///< valid when a count of wrong ones is not 0

  [[nodiscard]] bool passed() const { return wrong_verdict_pairs == 0 && wrong_depth_pairs == 0; }
};

/// A tracker's values of one pair.
struct PairValue {
  double d_near_m = 0;
  /// false: apart, a bound that proves it, and only the verdict counts; colliding, a lower bound of
  /// D_near over all nodes.
  bool exact = true;
};

/// Compares a tracker tick by tick.
class TrackCheck {
 public:
  /// `values`: the tracker's, per pair. `tick`: number for reports.
  void add(std::uint64_t tick, std::span<const PairVerdict> verdicts,
           std::span<const PairValue> values);
  [[nodiscard]] const CheckTotals& totals() const { return totals_; }

 private:
  CheckTotals totals_;
  std::uint64_t wrong_run_ = 0, wrong_verdict_run_ = 0;
};

}  // namespace haptic::sim
