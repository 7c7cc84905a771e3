// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The steps of the paper's Sec. III as printed, for comparison: one hop in the contact graph,
/// pruning by delta with the previous D_Near, plane values without supports, no certificate, no
/// second search. rt_core/METHOD.md section 7.1 says what to expect of it. Not real-time: host
/// only.

#include <cstdint>
#include <span>
#include <vector>

#include "rt_core/contact/contact_situation.hpp"
#include "tools/c_space/flat_pair.hpp"

namespace haptic::sim {

using tools::FlatPair;
using tools::place_moving;
using tools::PlacedMoving;
using tools::Point;

/// Readings of "delta, small and related to |x_new - x_0|" (step 2).
enum class DeltaReading : std::uint8_t {
  kTranslation,             ///< |x_new - x_0|
  kTranslationAndRotation,  ///< |x_new - x_0| + max |x - b + R a| * angle: keeps every plane that
                            ///< moved within a tick
};

class LiteralTracker {
 public:
  LiteralTracker(const SceneView& view, DeltaReading reading);

  /// Steps 1 to 6 for every pair; the first call searches exhaustively.
  void update(const Pose& pose_wa);
  /// Forgets everything.
  void reset() { started_ = false; }

  [[nodiscard]] std::span<const double> d_near_m() const { return d_near_; }
  [[nodiscard]] std::uint32_t nearest_pair() const;
  [[nodiscard]] std::span<const std::uint32_t> near_nodes(std::uint32_t pair) const {
    return tracks_[pair].near;
  }
  [[nodiscard]] std::uint64_t nodes_evaluated() const {
    return nodes_evaluated_;
  }  ///< of the last update
  [[nodiscard]] std::uint64_t empty_local_sets() const {
    return empty_local_sets_;
  }  ///< of the last update

  /// Equations (2) and (3) for the node of largest value in the nearest pair; zero when separated.
  /// The torque is about the grip point. Several near nodes are not combined: this tracker is
  /// compared by its verdict and D_Near.
  void wrench(double k_f_n_per_m, Point& force_n, Point& torque_nm) const;

  /// Nodes are applicable within this tolerance ("within some tolerance values", step 2), in sizes
  /// of the scene.
  static constexpr double kApplicabilityTolerance = 1e-8;

 private:
  struct Track {
    FlatPair pair;
    std::vector<std::uint32_t> near;      ///< ascending
    std::vector<std::uint32_t> neighbor;  ///< near nodes and their G-neighbors, ascending
    std::uint32_t largest = 0;            ///< the near node with the largest value
    explicit Track(FlatPair flat) : pair(std::move(flat)) {}
  };
  struct Candidate {
    std::uint32_t node;
    double depth_m;
  };
  void update_pair(std::size_t index, double delta_m);
  void set_near(Track& track, std::size_t index, std::span<const Candidate> local);

  std::vector<Track> tracks_;
  std::vector<double> d_near_;
  const SceneView& view_;
  DeltaReading reading_;
  double epsilon_m_, tolerance_m_ = 0;
  bool started_ = false;
  PlacedMoving last_{};
  std::uint64_t nodes_evaluated_ = 0, empty_local_sets_ = 0;
};

}  // namespace haptic::sim
