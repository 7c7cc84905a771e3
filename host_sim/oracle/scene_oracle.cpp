// SPDX-License-Identifier: Apache-2.0
#include "host_sim/oracle/scene_oracle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace haptic::sim {

namespace {

/// By node, whether it can carry force; empty where every reachable one can.
std::vector<bool> live_nodes(const PairView& pair) {
  std::vector<bool> live(pair.record.node_count);
  bool hides = false;
  for (std::uint32_t node = 0; node < pair.record.node_count; ++node) {
    live[node] = pair.marks.node(NodeScope::kLive, node);
    hides = hides || live[node] != pair.marks.node(NodeScope::kReachable, node);
  }
  if (!hides) live.clear();
  return live;
}

/// Range of the depth of a colliding pair: over its live nodes those that must count, and those
/// that may, as applicability goes within the allowed error of D_near. Where none may, it is that
/// of all nodes. `size_m`: of the pair.
void measure_live(const std::vector<NodeValue>& nodes, const std::vector<bool>& live, Wide size_m,
                  const Precision& precision, PairTruth& truth) {
  const Wide slack_m = precision.relative_depth * size_m;
  constexpr Wide kNone = -std::numeric_limits<Wide>::infinity();
  Wide lower = kNone, upper = kNone;
  for (const NodeValue& node : nodes) {
    if (!live[node.node] || node.violation_m > slack_m) continue;
    const Wide turn_m = precision.value_roundings * precision.unit_roundoff / node.sine * size_m;
    upper = std::max(upper, node.depth_m + turn_m);
    if (node.violation_m < -slack_m) lower = std::max(lower, node.depth_m - turn_m);
  }
  if (upper == kNone) return;
  truth.lower_m = lower;
  truth.upper_m = lower == kNone ? truth.reference_m : upper;
}

}  // namespace

SceneOracle::SceneOracle(const SceneView& view) {
  const auto count = static_cast<std::uint32_t>(view.pieces().size());
  for (std::uint32_t i = 0; i < count; ++i) pieces_.push_back(oracle_piece_of(view.piece(i)));
  for (const BodyRecord& body : view.bodies()) {
    references_.push_back(
        {widen(body.reference_m[0]), widen(body.reference_m[1]), widen(body.reference_m[2])});
    std::vector<WideVec> points;
    for (std::uint32_t k = 0; k < body.piece_count; ++k) {
      const auto& vertices = pieces_[body.piece_begin + k].vertices;
      points.insert(points.end(), vertices.begin(), vertices.end());
    }
    sizes_.push_back(diameter(points));
    size_m_ = std::max(size_m_, sizes_.back());
  }
  for (std::uint32_t k = 0; k < view.pair_count(); ++k) {
    const PairRecord& pair = view.pair_record(k);
    pairs_.push_back(
        {pair.piece_a, pair.piece_b, view.pieces()[pair.piece_b].body, live_nodes(view.pair(k))});
  }
}

void SceneOracle::evaluate(const Pose& pose_wa, std::vector<PairVerdict>& verdicts) const {
  const Quat& q = pose_wa.q_wa;
  OraclePose pose;
  pose.r = rotation_of(widen(q.w()), widen(q.x()), widen(q.y()), widen(q.z()));
  const WideVec p{widen(pose_wa.p_wa[0]), widen(pose_wa.p_wa[1]), widen(pose_wa.p_wa[2])};
  const WideVec grip_w = p + pose.r * references_[0];
  const Precision precision = precision_of_real();
  // Coordinates far from the origin carry their own rounding, regardless of the size of the bodies.
  const Wide coordinates = norm(p) + norm(references_[0]);
  verdicts.resize(pairs_.size());
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Pair& pair = pairs_[k];
    pose.x = grip_w - references_[pair.body_b];
    const Wide size = std::max(sizes_[0], sizes_[pair.body_b]);
    verdicts[k].truth =
        search_pair(pieces_[pair.piece_a], pieces_[pair.piece_b], pose, size, precision);
    if (!pair.live.empty() && verdicts[k].truth.reference_m <= 0) {
      measure_live(all_nodes(pieces_[pair.piece_a], pieces_[pair.piece_b], pose), pair.live, size,
                   precision, verdicts[k].truth);
    }
    verdicts[k].tolerance_m =
        precision.relative_depth * size +
        8 * precision.unit_roundoff * (coordinates + norm(references_[pair.body_b]));
  }
}

void TrackCheck::add(std::uint64_t tick, std::span<const PairVerdict> verdicts,
                     std::span<const PairValue> values) {
  CheckTotals& t = totals_;
  bool wrong_verdict = false, wrong_depth = false;
  ++t.ticks;
  for (std::size_t k = 0; k < verdicts.size(); ++k) {
    const PairVerdict& v = verdicts[k];
    const Wide d = widen(values[k].d_near_m);
    ++t.pair_ticks;
    const int side = v.side();
    if (side == 0) ++t.touching_pairs;
    if (v.widened()) ++t.widened_pairs;
    const bool pair_verdict_wrong =
        std::isnan(values[k].d_near_m) || (side > 0 && d <= 0) || (side < 0 && d > 0);
    Wide error = 0;
    if (values[k].exact) {
      error = v.error_m(d);
    } else if (d > 0) {
      ++t.far_pairs;
    } else {
      ++t.bounded_pairs;
      error = std::max(d - v.truth.reference_m, Wide{0});
    }
    const bool pair_depth_wrong = error > v.tolerance_m;
    if (error > t.largest_error_m) {
      t.largest_error_m = error;
      t.tolerance_at_largest_m = v.tolerance_m;
    }
    if ((pair_verdict_wrong || pair_depth_wrong) && t.passed()) {
      t.first_wrong_tick = tick;
      t.first_wrong_pair = k;
    }
    if (pair_verdict_wrong) {
      ++t.wrong_verdict_pairs;
      ++(side > 0 ? t.false_collision_pairs : t.missed_collision_pairs);
    }
    if (pair_depth_wrong) ++t.wrong_depth_pairs;
    wrong_verdict |= pair_verdict_wrong;
    wrong_depth |= pair_depth_wrong;
  }
  t.wrong_verdict_ticks += wrong_verdict ? 1u : 0u;
  t.wrong_depth_ticks += wrong_depth ? 1u : 0u;
  wrong_run_ = (wrong_verdict || wrong_depth) ? wrong_run_ + 1 : 0;
  wrong_verdict_run_ = wrong_verdict ? wrong_verdict_run_ + 1 : 0;
  t.longest_wrong_run = std::max(t.longest_wrong_run, wrong_run_);
  t.longest_wrong_verdict_run = std::max(t.longest_wrong_verdict_run, wrong_verdict_run_);
}

}  // namespace haptic::sim
