// SPDX-License-Identifier: Apache-2.0
#include "host_sim/oracle/literal_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace haptic::sim {
namespace {

double length(const Point& a) { return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

/// Angle of the rotation between two orientations [rad], from the chord: |R - R0|_F = 2 sqrt(2)
/// sin(angle / 2).
double angle_between(const PlacedMoving& from, const PlacedMoving& to) {
  double squares = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const double d = to.r_wa[i][j] - from.r_wa[i][j];
      squares += d * d;
    }
  }
  return 2.0 * std::asin(std::min(1.0, std::sqrt(squares / 8.0)));
}

}  // namespace

LiteralTracker::LiteralTracker(const SceneView& view, DeltaReading reading)
    : view_(view), reading_(reading), epsilon_m_(view.parameters().epsilon_m) {
  double radius = 0.0;
  for (std::uint32_t k = 0; k < view.pair_count(); ++k) tracks_.emplace_back(FlatPair(view, k));
  for (const PieceRecord& piece : view.pieces()) radius = std::max(radius, piece.radius_m);
  tolerance_m_ = kApplicabilityTolerance * 2.0 * radius;
  d_near_.assign(tracks_.size(), 0.0);
}

void LiteralTracker::update(const Pose& pose_wa) {
  const PlacedMoving moving = place_moving(view_, pose_wa);
  double translation = 0.0, angle = 0.0;
  if (started_) {
    translation = length({moving.grip_w[0] - last_.grip_w[0], moving.grip_w[1] - last_.grip_w[1],
                          moving.grip_w[2] - last_.grip_w[2]});
    angle = angle_between(last_, moving);
  }
  nodes_evaluated_ = 0;
  empty_local_sets_ = 0;
  for (std::size_t k = 0; k < tracks_.size(); ++k) {
    Track& track = tracks_[k];
    track.pair.place(moving);
    double delta = std::numeric_limits<double>::infinity();
    if (started_) {
      delta = translation;
      if (reading_ == DeltaReading::kTranslationAndRotation)
        delta += track.pair.largest_lever_m() * angle;
    }
    update_pair(k, delta);
  }
  last_ = moving;  // step 6
  started_ = true;
}

void LiteralTracker::update_pair(std::size_t index, double delta_m) {
  Track& track = tracks_[index];
  if (!started_) {  // nothing to track from: all nodes (rt_core/METHOD.md section 6, row 12)
    track.neighbor.resize(track.pair.node_count());
    for (std::uint32_t n = 0; n < track.pair.node_count(); ++n) track.neighbor[n] = n;
  }
  std::vector<Candidate> local;
  for (const std::uint32_t node : track.neighbor) {  // steps 1 and 2
    const FlatPair::Value value = track.pair.evaluate(node);
    ++nodes_evaluated_;
    const bool kept = !started_ || std::abs(d_near_[index] - value.depth_m) < delta_m;
    if (value.violation_m <= tolerance_m_ && kept) local.push_back({node, value.depth_m});
  }
  if (local.empty()) {
    // Nothing left: keep the near set (rt_core/METHOD.md section 6, row 5) with the values its
    // planes have now, so that the next tick's pruning does not start from a stale D_Near.
    ++empty_local_sets_;
    for (const std::uint32_t node : track.near)
      local.push_back({node, track.pair.evaluate(node).depth_m});
    double largest = -std::numeric_limits<double>::infinity();
    for (const Candidate& c : local) {
      if (c.depth_m <= largest) continue;
      largest = c.depth_m;
      track.largest = c.node;
    }
    if (!local.empty()) d_near_[index] = largest;
    return;
  }
  set_near(track, index, local);
}

void LiteralTracker::set_near(Track& track, std::size_t index, std::span<const Candidate> local) {
  const auto best = std::max_element(
      local.begin(), local.end(),
      [](const Candidate& l, const Candidate& r) { return l.depth_m < r.depth_m; });
  d_near_[index] = best->depth_m;  // step 3
  track.largest = best->node;
  track.near.clear();
  for (const Candidate& c : local) {
    if (best->depth_m - c.depth_m < epsilon_m_) track.near.push_back(c.node);
  }
  track.neighbor = track.near;  // step 5
  const PairView& pair = track.pair.view();
  for (const std::uint32_t node : track.near) {
    const auto [type, i, j] = node_features(pair, node);
    for_each_graph_neighbor(pair, type, i, j,
                            [&](std::uint32_t other) { track.neighbor.push_back(other); });
  }
  std::sort(track.neighbor.begin(), track.neighbor.end());
  track.neighbor.erase(std::unique(track.neighbor.begin(), track.neighbor.end()),
                       track.neighbor.end());
}

std::uint32_t LiteralTracker::nearest_pair() const {
  return static_cast<std::uint32_t>(std::min_element(d_near_.begin(), d_near_.end()) -
                                    d_near_.begin());
}

void LiteralTracker::wrench(double k_f_n_per_m, Point& force_n, Point& torque_nm) const {
  force_n = torque_nm = {0.0, 0.0, 0.0};
  const std::uint32_t index = nearest_pair();
  if (d_near_[index] > 0.0) return;  // step 4
  const Track& track = tracks_[index];
  Point n{}, app{};
  track.pair.contact(track.largest, n, app);
  const Point& x = track.pair.grip_m();
  for (std::size_t i = 0; i < 3; ++i) force_n[i] = -k_f_n_per_m * d_near_[index] * n[i];  // eq. (2)
  const Point lever{x[0] - app[0], x[1] - app[1], x[2] - app[2]};
  torque_nm = {force_n[1] * lever[2] - force_n[2] * lever[1],
               force_n[2] * lever[0] - force_n[0] * lever[2],
               force_n[0] * lever[1] - force_n[1] * lever[0]};  // eq. (3): F x (x - App)
}

}  // namespace haptic::sim
