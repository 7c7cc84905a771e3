// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/verification/near_campaign.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "host_sim/lab/verification/contact_poses.hpp"
#include "host_sim/lab/verification/depth_campaign.hpp"

namespace haptic::sim {
namespace {

constexpr double kEpsilons_m[] = {1e-4, 2e-4, 5e-4};
constexpr std::uint64_t kShardPoses = 1000;
constexpr std::uint64_t kTicksPerPose = 6;
/// Share of the size within which a node's measure decides nothing.
constexpr Wide kMargin = sizeof(Real) == sizeof(double) ? 1e-9L : 2e-5L;

enum class Membership { kNear, kNotNear, kAmbiguous };

/// A node by the definition.
struct NodeMeasure {
  Membership membership = Membership::kNotNear;
  bool in_subset = false;  ///< |f - D| + (f - s(n)) < epsilon beyond doubt
};

/// Heights of both pieces over a node's plane [m].
struct Rises {
  Wide a = 0, b = 0;
};
Rises rises_of(const OraclePiece& a, const OraclePiece& b, const OraclePose& pose,
               const NodeValue& node, const WideVec& point_a, const WideVec& point_b) {
  Rises rises;
  for (const WideVec& v : a.vertices)
    rises.a = std::max(rises.a, dot(node.normal, point_a - (pose.x + pose.r * v)));
  for (const WideVec& v : b.vertices) rises.b = std::max(rises.b, dot(node.normal, v - point_b));
  return rises;
}

/// Numbers of nodes: type A, type B, type C (rt_core/METHOD.md section 3).
struct Numbers {
  std::size_t nfa, nva, nfb, nvb, neb;

  [[nodiscard]] bool is_edges(std::uint32_t node) const { return node >= nfa * nvb + nva * nfb; }
  /// A vertex of each feature of the node.
  void points(std::uint32_t node, const OraclePiece& a, const OraclePiece& b, std::uint32_t& va,
              std::uint32_t& vb) const {
    std::size_t n = node;
    if (n < nfa * nvb) {
      va = a.loops[n / nvb].front();
      vb = static_cast<std::uint32_t>(n % nvb);
      return;
    }
    n -= nfa * nvb;
    if (n < nva * nfb) {
      va = static_cast<std::uint32_t>(n / nfb);
      vb = b.loops[n % nfb].front();
      return;
    }
    n -= nva * nfb;
    va = a.edges[n / neb].vertex[0];
    vb = b.edges[n % neb].vertex[0];
  }
};

Numbers numbers_of(const VerifiedPair& pair) {
  const OraclePiece &a = pair.piece_a(), &b = pair.piece_b();
  return {a.loops.size(), a.vertices.size(), b.loops.size(), b.vertices.size(), b.edges.size()};
}

NodeMeasure measure(const VerifiedPair& pair, const OraclePose& pose, const Numbers& numbers,
                    const NodeValue& node, Wide d_m) {
  const OraclePiece &a = pair.piece_a(), &b = pair.piece_b();
  const Precision precision = precision_of_real();
  const bool edges = numbers.is_edges(node.node);
  std::uint32_t va = 0, vb = 0;
  numbers.points(node.node, a, b, va, vb);
  const Rises rises = rises_of(a, b, pose, node, pose.x + pose.r * a.vertices[va], b.vertices[vb]);
  const Wide epsilon_m = pair.epsilon_m();
  const Wide margin_m =
      kMargin * pair.size_m() + 32 * precision.unit_roundoff * pair.size_m() / node.sine;
  const Wide violation_m =
      edges && node.violation_m > 0 ? std::max(rises.a, rises.b) : node.violation_m;
  const Wide off_m = std::abs(node.depth_m - d_m);
  const Wide value_m = off_m + std::max(violation_m, 0.0L);
  const Wide rise_m = rises.a + rises.b;
  const Wide most_m = widen(kMaxRise) * epsilon_m;
  NodeMeasure result;
  const bool out = value_m >= epsilon_m + margin_m || (!edges && rise_m >= most_m + margin_m);
  const bool in = value_m < epsilon_m - margin_m && (edges || rise_m < most_m - margin_m);
  const bool at_least_sine =
      edges && std::abs(node.sine - precision.optional_sine) < 1e-3L * precision.optional_sine;
  result.membership = out                    ? Membership::kNotNear
                      : in && !at_least_sine ? Membership::kNear
                                             : Membership::kAmbiguous;
  result.in_subset = !at_least_sine && off_m + rise_m < epsilon_m - margin_m;
  return result;
}

/// One pose with one pair of features chosen for it.
Placement draw_contact(const ContactPoses& poses, double epsilon_m, Seeded& random) {
  const double share = random.uniform(0.0, 1.0);
  double gap_m = random.uniform(-3e-3, 3e-3);
  if (share < 0.3) gap_m = random.uniform(-1.5, 1.5) * epsilon_m;
  if (share < 0.05) gap_m = 0;
  const double tilt_rad = random.below(4) == 0 ? 0.0 : std::pow(10.0, random.uniform(-9.0, -3.0));
  switch (random.below(8)) {
    case 0:
      return poses.generic(gap_m, random);
    case 1:
    case 2:
      return poses.meet(FeatureKind::kFace, FeatureKind::kFace, random.below(2) == 0, tilt_rad,
                        gap_m, random);
    case 3:
      return poses.lie_exactly(tilt_rad, gap_m, random);
    case 4:
      return poses.meet(FeatureKind::kEdge, FeatureKind::kFace, random.below(2) == 0, tilt_rad,
                        gap_m, random);
    case 5:
      return poses.meet(FeatureKind::kFace, FeatureKind::kEdge, random.below(2) == 0, tilt_rad,
                        gap_m, random);
    case 6:
      return poses.meet(FeatureKind::kVertex, draw_kind(random), false, tilt_rad, gap_m, random);
    default:
      return poses.meet(FeatureKind::kEdge, FeatureKind::kEdge, random.below(2) == 0, tilt_rad,
                        gap_m, random);
  }
}

}  // namespace

void NearTotals::add(const NearTotals& other) {
  for (const auto field :
       {&NearTotals::poses, &NearTotals::beyond, &NearTotals::ranges, &NearTotals::members,
        &NearTotals::missing, &NearTotals::extra, &NearTotals::subset_missing,
        &NearTotals::ambiguous, &NearTotals::cut, &NearTotals::several}) {
    this->*field += other.*field;
  }
  largest_set = std::max(largest_set, other.largest_set);
  failures.add(other.failures);
}

bool check_near_set(VerifiedPair& pair, const Pose& pose_wa, std::span<const NearNode> near,
                    NearTotals& totals) {
  const OraclePose pose = pair.oracle_pose(pose_wa);
  const PairTruth truth = pair.truth(pose);
  const Wide margin_m = kMargin * pair.size_m();
  if (truth.reference_m > kExactBand_m) {
    ++totals.beyond;
    return false;
  }
  if (truth.upper_m - truth.lower_m > 0.01L * margin_m) {
    ++totals.ranges;
    return false;
  }
  ++totals.poses;
  const Wide d_m = truth.reference_m;
  const Precision precision = precision_of_real();
  const Numbers numbers = numbers_of(pair);
  std::map<std::uint32_t, bool> found;  // node: explained by the definition
  for (const NearNode& node : near) found[node.node] = false;
  std::uint64_t members = 0;
  const auto fail = [&](const NodeValue& node, const char* what) {
    totals.failures.add(
        what,
        failure_text(pair.name(), pose_wa,
                     "node " + std::to_string(node.node) + ", f " + number_text(node.depth_m) +
                         " m, D_near " + number_text(d_m) + " m, violation " +
                         number_text(node.violation_m) + " m, sine " + number_text(node.sine)));
  };
  for (const NodeValue& node :
       pair.near_candidates(pose, d_m, 2 * margin_m, 0.999L * precision.optional_sine)) {
    const NodeMeasure m = measure(pair, pose, numbers, node, d_m);
    const auto there = found.find(node.node);
    const bool listed = there != found.end();
    if (m.membership == Membership::kAmbiguous) {
      ++totals.ambiguous;
    } else if (m.membership == Membership::kNear) {
      ++members;
      if (!listed) {
        ++totals.missing;
        fail(node, "missing from the near set");
      }
    } else if (listed) {
      ++totals.extra;
      fail(node, "in the near set without reason");
    }
    if (m.in_subset && !listed) ++totals.subset_missing;
    if (listed) there->second = true;
  }
  for (const auto& [number, explained] : found) {
    if (explained) continue;
    ++totals.extra;
    NodeValue node;
    node.node = number;
    fail(node, "in the near set, but far from it by the definition");
  }
  totals.members += members;
  totals.several += members > 1 ? 1u : 0u;
  totals.largest_set = std::max<std::uint64_t>(totals.largest_set, near.size());
  return true;
}

NearTotals run_near_sets_on(VerifiedPair& pair, const VerifiedBodies& bodies, std::uint64_t poses,
                            std::uint64_t seed) {
  NearTotals totals;
  Seeded random(seed);
  const ContactPoses draws(bodies.a, bodies.b);
  const auto epsilon_m = static_cast<double>(pair.epsilon_m());
  pair.core().reset();
  StepInput input;
  input.report_goal_contact = true;
  while (totals.poses < poses) {
    const Placement start = draw_contact(draws, epsilon_m, random);
    // A jump, then a few ticks of small motion: bounds of different ages.
    const double step_m = std::pow(10.0, random.uniform(-7.0, -3.0));
    const double turn_rad = random.below(2) == 0 ? 0.0 : std::pow(10.0, random.uniform(-9.0, -3.0));
    const Vector along = random.direction(), about = random.direction();
    for (std::uint64_t tick = 0; tick < kTicksPerPose && totals.poses < poses; ++tick) {
      const auto count = static_cast<double>(tick);
      input.pose_wa =
          pose_at(start.x + count * step_m * along, tilted(start.q, about, count * turn_rad));
      ++input.sequence;
      const StepResult result = pair.core().step(input);
      const PairReport report = pair.core().pair_report(0);
      if ((result.flags & kFlagNearSetCut) != 0) ++totals.cut;
      if (!check_near_set(pair, input.pose_wa, report.near, totals)) break;
    }
  }
  return totals;
}

std::vector<NearRow> run_near_sets(const NearCampaign& size,
                                   const std::vector<VerifiedBodies>& pairs,
                                   const RunOptions& options) {
  Campaign<NearRow> campaign;
  double total_share = 0;
  for (const VerifiedBodies& bodies : pairs) total_share += bodies.near_share;
  for (const VerifiedBodies& bodies : pairs) {
    const double poses = static_cast<double>(size.poses) * bodies.near_share /
                         (total_share * std::size(kEpsilons_m));
    for (const double epsilon_m : kEpsilons_m)
      campaign.add({bodies.name, epsilon_m, {}}, poses, kShardPoses);
  }
  campaign.run<VerifiedPair>(
      options, "near sets", [&](auto& kept, const auto& shard, std::size_t number) {
        const VerifiedBodies& bodies = pairs[shard.row / std::size(kEpsilons_m)];
        std::unique_ptr<VerifiedPair>& pair = kept[shard.row];
        if (!pair)
          pair = std::make_unique<VerifiedPair>(bodies, campaign.rows[shard.row].epsilon_m);
        return run_near_sets_on(*pair, bodies, shard.count, seed_of(size.seed, 2000000 + number));
      });
  return campaign.rows;
}

}  // namespace haptic::sim
