// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/verification/depth_campaign.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "host_sim/lab/verification/contact_poses.hpp"
#include "host_sim/shapes/coherent_path.hpp"

namespace haptic::sim {
namespace {

constexpr double kDepthEpsilon_m = 1e-4;
constexpr std::uint64_t kShardTicks = 2500;
constexpr std::uint64_t kTicksBetweenJumps = 100;
constexpr PathSpeed kSpeeds[] = {{1.0, 10.0}, {0.3, 3.0}};

/// How far a value lies outside the range that D_near may be in.
Wide error_of(const PairTruth& truth, Wide d_near_m) {
  if (std::isnan(d_near_m)) return std::numeric_limits<Wide>::infinity();
  if (d_near_m < truth.lower_m) return truth.lower_m - d_near_m;
  return d_near_m > truth.upper_m ? d_near_m - truth.upper_m : 0;
}

}  // namespace

Wide depth_tolerance_m(const VerifiedPair& pair) {
  return precision_of_real().relative_depth * pair.size_m();
}

void DepthTotals::add(const DepthTotals& other) {
  for (const auto field : {&DepthTotals::ticks, &DepthTotals::inside, &DepthTotals::near,
                           &DepthTotals::jumps, &DepthTotals::wrong, &DepthTotals::wrong_bounds,
                           &DepthTotals::said_inexact, &DepthTotals::ranges}) {
    this->*field += other.*field;
  }
  largest_inside_m = std::max(largest_inside_m, other.largest_inside_m);
  largest_near_m = std::max(largest_near_m, other.largest_near_m);
  failures.add(other.failures);
}

void check_depth(VerifiedPair& pair, const Pose& pose_wa, const PairTruth& truth,
                 DepthTotals& totals) {
  ++totals.ticks;
  const PairReport report = pair.core().pair_report(0);
  const Wide tolerance_m = depth_tolerance_m(pair);
  const Wide d_near_m = widen(report.d_near_m);
  if (truth.reference_m > kExactBand_m) {
    // The value is that of a plane that separates: never above the distance. A held plane may lie
    // above D_near, which is itself only a lower bound, so the certificate is what is checked.
    const Wide gap_m = pair.certificates().gap_m(
        pair.oracle_pose(pose_wa),
        {widen(report.normal_w[0]), widen(report.normal_w[1]), widen(report.normal_w[2])});
    const bool sphere = !report.visited && report.normal_w.squaredNorm() == 0;
    if (d_near_m > 0 && (sphere || d_near_m <= std::max(gap_m, truth.upper_m) + tolerance_m))
      return;
    ++totals.wrong_bounds;
    totals.failures.add("bound beyond 5 mm",
                        failure_text(pair.name(), pose_wa,
                                     number_text(d_near_m) + " m, gap along its normal " +
                                         number_text(gap_m) + " m"));
    return;
  }
  const bool inside = truth.reference_m <= 0;
  ++(inside ? totals.inside : totals.near);
  if (truth.upper_m - truth.lower_m > tolerance_m) ++totals.ranges;
  if (!report.exact) ++totals.said_inexact;
  const Wide error_m = error_of(truth, d_near_m);
  Wide& largest_m = inside ? totals.largest_inside_m : totals.largest_near_m;
  largest_m = std::max(largest_m, error_m);
  if (error_m <= tolerance_m) return;
  ++totals.wrong;
  totals.failures.add("wrong D_near",
                      failure_text(pair.name(), pose_wa,
                                   number_text(d_near_m) + " m is off by " + number_text(error_m) +
                                       " m (allowed " + number_text(tolerance_m) + ")"));
}

DepthTotals run_depths_on(VerifiedPair& pair, const VerifiedBodies& bodies, std::uint64_t ticks,
                          std::uint64_t seed) {
  DepthTotals totals;
  Seeded random(seed);
  const ContactPoses poses(bodies.a, bodies.b);
  pair.core().reset();
  StepInput input;
  input.report_goal_contact = true;
  const auto step = [&](const Pose& pose_wa) {
    input.pose_wa = pose_wa;
    ++input.sequence;
    static_cast<void>(pair.core().step(input));
    const PairTruth truth = pair.truth(pair.oracle_pose(pose_wa));
    check_depth(pair, pose_wa, truth, totals);
    return static_cast<double>(truth.reference_m);
  };
  CoherentPath path(pair.view(), kSpeeds[random.below(2)],
                    static_cast<std::uint64_t>(random.below(1u << 30)));
  double d_near_m = 0;
  for (std::uint64_t tick = 1; totals.ticks < ticks; ++tick) {
    d_near_m = step(path.next(d_near_m));
    if (tick % kTicksBetweenJumps != 0 || totals.ticks == ticks) continue;
    // A jump into contact or near it, and back to the path: another jump.
    ++totals.jumps;
    static_cast<void>(step(poses.generic(poses.draw_gap_m(random), random).pose()));
  }
  return totals;
}

std::vector<DepthRow> run_depths(const DepthCampaign& size,
                                 const std::vector<VerifiedBodies>& pairs,
                                 const RunOptions& options) {
  Campaign<DepthRow> campaign;
  double total_share = 0;
  for (const VerifiedBodies& bodies : pairs) total_share += bodies.near_share;
  for (const VerifiedBodies& bodies : pairs)
    campaign.add({bodies.name, 0, {}},
                 static_cast<double>(size.ticks) * bodies.near_share / total_share, kShardTicks);
  std::vector<double> sizes(campaign.shards.size());
  campaign.run<VerifiedPair>(
      options, "D_near", [&](auto& kept, const auto& shard, std::size_t number) {
        std::unique_ptr<VerifiedPair>& pair = kept[shard.row];
        if (!pair) pair = std::make_unique<VerifiedPair>(pairs[shard.row], kDepthEpsilon_m);
        sizes[number] = static_cast<double>(pair->size_m());
        return run_depths_on(*pair, pairs[shard.row], shard.count,
                             seed_of(size.seed, 1000000 + number));
      });
  for (std::size_t k = 0; k < sizes.size(); ++k)
    campaign.rows[campaign.shards[k].row].size_m = sizes[k];
  return campaign.rows;
}

}  // namespace haptic::sim
