// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/verification/verdict_campaign.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "host_sim/lab/verification/contact_poses.hpp"
#include "host_sim/shapes/coherent_path.hpp"

namespace haptic::sim {
namespace {

constexpr double kVerdictEpsilon_m = 1e-4;
constexpr std::uint64_t kShardQueries = 20000;
constexpr std::uint32_t kPathTicks = 1000;
constexpr QueryMode kModes[] = {QueryMode::kPath, QueryMode::kFirstTick, QueryMode::kJump};
constexpr double kModeShare[] = {0.5, 0.25, 0.25};
/// Half of the queries at generic orientations, half spread over the levels of noise.
constexpr double kGenericShare = 0.5;

std::vector<double> noise_levels_rad() {
  std::vector<double> levels{0.0};
  for (int decade = -16; decade <= -4; ++decade) levels.push_back(std::pow(10.0, decade));
  return levels;
}

/// One mode of queries on one pair; draws poses and feeds the core.
class QueryRun {
 public:
  QueryRun(VerifiedPair& pair, const VerifiedBodies& bodies, bool aligned, double noise_rad,
           std::uint32_t judged_one_in, std::uint64_t seed)
      : pair_(pair),
        poses_(bodies.a, bodies.b),
        aligned_(aligned),
        noise_rad_(noise_rad),
        judged_one_in_(judged_one_in),
        random_(seed) {}

  [[nodiscard]] VerdictTotals run(QueryMode mode, std::uint64_t queries) {
    pair_.core().reset();
    while (totals_.queries < queries) {
      if (mode == QueryMode::kPath) {
        const std::uint64_t ticks = std::min<std::uint64_t>(kPathTicks, queries - totals_.queries);
        if (aligned_) {
          rock(ticks);
        } else {
          wander(ticks);
        }
        continue;
      }
      if (mode == QueryMode::kFirstTick) pair_.core().reset();
      query(draw().pose());
    }
    return totals_;
  }

 private:
  Placement draw() {
    const double gap_m = poses_.draw_gap_m(random_);
    if (!aligned_) {
      return random_.uniform(0.0, 1.0) < 0.1 ? poses_.anywhere(random_)
                                             : poses_.generic(gap_m, random_);
    }
    switch (random_.below(4)) {
      case 0:
      case 1:
        return poses_.lie_exactly(noise_rad_, gap_m, random_);
      case 2:
        return poses_.meet(FeatureKind::kFace, FeatureKind::kFace, true, noise_rad_, gap_m,
                           random_);
      default:
        return poses_.meet(draw_kind(random_), draw_kind(random_), true, noise_rad_, gap_m,
                           random_);
    }
  }

  void query(const Pose& pose_wa) {
    StepInput input;
    input.report_goal_contact = true;
    input.pose_wa = pose_wa;
    input.sequence = totals_.queries;
    const StepResult result = pair_.core().step(input);
    const bool judge = judged_one_in_ > 0 && random_.below(judged_one_in_) == 0;
    check_verdict(pair_, pose_wa, result, judge, totals_);
  }

  /// A coherent path all round the obstacle, steered by the answers: they only choose where to
  /// look.
  void wander(std::uint64_t ticks) {
    const PathSpeed speed{std::pow(10.0, random_.uniform(-1.3, 0.0)),
                          std::pow(10.0, random_.uniform(-0.3, 1.0))};
    CoherentPath path(pair_.view(), speed, static_cast<std::uint64_t>(random_.below(1u << 30)));
    double d_near_m = 0;
    for (std::uint64_t tick = 0; tick < ticks; ++tick) {
      query(path.next(d_near_m));
      d_near_m = static_cast<double>(pair_.core().pair_report(0).d_near_m);
      if (!std::isfinite(d_near_m)) d_near_m = 0;
    }
  }

  /// A coherent path about one aligned contact: A slides, lifts off, presses and rocks by the
  /// noise.
  void rock(std::uint64_t ticks) {
    const Placement start = draw();
    const Vector slide = random_.direction(), lift = random_.direction();
    const Vector axis = random_.direction();
    const double amplitude_m = std::pow(10.0, random_.uniform(-4.0, -2.0));
    const double lift_m = std::pow(10.0, random_.uniform(-6.0, -2.5));
    const double turns = random_.uniform(0.5, 5.0);
    for (std::uint64_t tick = 0; tick < ticks; ++tick) {
      const double t = 2 * std::numbers::pi * turns * static_cast<double>(tick) / kPathTicks;
      const Vector x =
          start.x + amplitude_m * std::sin(t) * slide + lift_m * std::sin(2.7 * t) * lift;
      query(pose_at(x, tilted(start.q, axis, noise_rad_ * std::sin(1.3 * t))));
    }
  }

  VerifiedPair& pair_;
  ContactPoses poses_;
  bool aligned_;
  double noise_rad_;
  std::uint32_t judged_one_in_;
  Seeded random_;
  VerdictTotals totals_;
};

/// What is wrong with an answer; no kind: nothing.
struct Defect {
  std::string kind, words;
};

void check_separation(const VerifiedPair& pair, const OraclePose& pose, const PairReport& report,
                      VerdictTotals& totals, Defect& defect) {
  ++totals.separated;
  WideVec n{widen(report.normal_w[0]), widen(report.normal_w[1]), widen(report.normal_w[2])};
  if (!report.visited) {
    ++totals.far_answers;
    // A pair that was never near is answered from the spheres round its pieces, which gives no
    // direction; that of their centres must then do.
    if (norm(n) == 0) n = pair.certificates().between_centres(pose);
  }
  const Wide gap_m = pair.certificates().gap_m(pose, n);
  if (!(gap_m > 0)) {
    ++totals.bad_separations;
    defect = {"separated without a gap",
              "the gap along the direction is " + number_text(gap_m) + " m"};
  } else if (!(widen(report.separation_bound_m) <= gap_m + pair.certificates().rounding_m(pose))) {
    ++totals.bad_bounds;
    const Wide over_m = widen(report.separation_bound_m) - gap_m;
    defect = {"bound above the gap", "the gap is " + number_text(gap_m) + " m, the bound " +
                                         number_text(over_m) + " m more"};
  }
}

void check_collision(const VerifiedPair& pair, const OraclePose& pose, const PairReport& report,
                     VerdictTotals& totals, Defect& defect) {
  ++totals.colliding;
  PortalVertices portal;
  for (std::size_t k = 0; k < 3; ++k) {
    portal.a[k] = report.portal[k].a;
    portal.b[k] = report.portal[k].b;
  }
  const CollisionCertificate certificate = pair.certificates().collision(pose, portal);
  if (certificate.holds()) {
    totals.by_slack += certificate.inside ? 0u : 1u;
    totals.largest_excess_m = std::max(totals.largest_excess_m, certificate.distance_m);
    return;
  }
  ++totals.bad_collisions;
  defect = {"colliding outside the tetrahedron",
            "by " + number_text(certificate.distance_m) + " m (allowed " +
                number_text(certificate.slack_m) + "), D_near said to be " +
                number_text(widen(report.d_near_m)) + " m"};
}

/// Against the exhaustive search. Outside, the largest plane value is a lower bound of the distance
/// and has its sign.
void judge_verdict(VerifiedPair& pair, const OraclePose& pose, const PairReport& report,
                   VerdictTotals& totals, Defect& defect) {
  ++totals.judged;
  // The gap along any direction is a lower bound of the signed distance, so the reported one may
  // raise what the search has found: it leaves out edges within 1e-12 of parallel.
  const WideVec n{widen(report.normal_w[0]), widen(report.normal_w[1]), widen(report.normal_w[2])};
  const Wide truth_m = std::max(pair.truth(pose).reference_m, pair.certificates().gap_m(pose, n));
  const Wide rounding_m = pair.certificates().rounding_m(pose);
  const bool separated = report.verdict == Verdict::kSeparated;
  if (separated || report.verdict == Verdict::kColliding) {
    if (separated ? truth_m >= -rounding_m : truth_m <= rounding_m) return;
    ++totals.wrong_verdicts;
    defect = {separated ? "wrongly separated" : "wrongly colliding",
              "D_near is " + number_text(truth_m) + " m"};
  } else if (!(std::abs(truth_m) <= widen(report.thickness_m) + rounding_m)) {
    ++totals.wrong_boundaries;
    defect = {"touching away from the boundary",
              "said to be within " + number_text(widen(report.thickness_m)) +
                  " m of it, but D_near is " + number_text(truth_m) + " m"};
  }
}

}  // namespace

const char* name_of(QueryMode mode) {
  switch (mode) {
    case QueryMode::kPath:
      return "path";
    case QueryMode::kFirstTick:
      return "first tick";
    case QueryMode::kJump:
      break;
  }
  return "jump";
}

void VerdictTotals::add(const VerdictTotals& other) {
  for (const auto field :
       {&VerdictTotals::queries, &VerdictTotals::separated, &VerdictTotals::colliding,
        &VerdictTotals::touching, &VerdictTotals::undecided, &VerdictTotals::far_answers,
        &VerdictTotals::inexact, &VerdictTotals::refused, &VerdictTotals::bad_separations,
        &VerdictTotals::bad_bounds, &VerdictTotals::bad_collisions, &VerdictTotals::judged,
        &VerdictTotals::wrong_verdicts, &VerdictTotals::wrong_boundaries,
        &VerdictTotals::by_slack}) {
    this->*field += other.*field;
  }
  largest_excess_m = std::max(largest_excess_m, other.largest_excess_m);
  largest_thickness_m = std::max(largest_thickness_m, other.largest_thickness_m);
  failures.add(other.failures);
}

void check_verdict(VerifiedPair& pair, const Pose& pose_wa, const StepResult& result, bool judge,
                   VerdictTotals& totals) {
  ++totals.queries;
  Defect defect;
  if (result.status != RtStatus::kOk) {
    ++totals.refused;
    totals.failures.add("refused", failure_text(pair.name(), pose_wa, to_text(result.status)));
    return;
  }
  const PairReport report = pair.core().pair_report(0);
  const OraclePose pose = pair.oracle_pose(pose_wa);
  if (report.visited && !report.exact) ++totals.inexact;
  bool boundary = false;
  switch (report.verdict) {
    case Verdict::kSeparated:
      check_separation(pair, pose, report, totals, defect);
      break;
    case Verdict::kColliding:
      check_collision(pair, pose, report, totals, defect);
      break;
    case Verdict::kTouching:
      ++totals.touching;
      boundary = true;
      break;
    case Verdict::kUndecided:
      ++totals.undecided;
      defect = {"undecided", "thickness " + number_text(widen(report.thickness_m)) + " m"};
      boundary = true;
      break;
  }
  if (boundary)
    totals.largest_thickness_m = std::max(totals.largest_thickness_m, widen(report.thickness_m));
  if (judge || boundary) judge_verdict(pair, pose, report, totals, defect);
  if (!defect.kind.empty())
    totals.failures.add(defect.kind, failure_text(pair.name(), pose_wa, defect.words));
}

VerdictTotals run_verdicts_on(VerifiedPair& pair, const VerifiedBodies& bodies,
                              std::uint64_t queries, std::uint32_t judged_one_in,
                              std::uint64_t seed) {
  VerdictTotals totals;
  std::uint64_t number = 0;
  for (const bool aligned : {false, true}) {
    for (const QueryMode mode : kModes) {
      QueryRun run(pair, bodies, aligned, 0.0, judged_one_in, seed_of(seed, number++));
      totals.add(run.run(mode, queries / 6 + 1));
    }
  }
  return totals;
}

std::vector<VerdictRow> run_verdicts(const VerdictCampaign& size,
                                     const std::vector<VerifiedBodies>& pairs,
                                     const RunOptions& options) {
  const std::vector<double> levels = noise_levels_rad();
  Campaign<VerdictRow> campaign;
  std::vector<std::uint32_t> judged_one_in;  // by pair
  double total_share = 0, total_judged = 0;
  for (const VerifiedBodies& bodies : pairs) {
    total_share += bodies.query_share;
    total_judged += bodies.judged_share;
  }
  for (const VerifiedBodies& bodies : pairs) {
    const double wanted = static_cast<double>(size.queries) * bodies.query_share / total_share;
    const double judged = static_cast<double>(size.judged) * bodies.judged_share / total_judged;
    judged_one_in.push_back(
        static_cast<std::uint32_t>(judged > 0 ? std::max(1.0, wanted / judged) : 0.0));
    for (std::size_t orientation = 0; orientation <= levels.size(); ++orientation) {
      const bool aligned = orientation > 0;
      const double share =
          aligned ? (1 - kGenericShare) / static_cast<double>(levels.size()) : kGenericShare;
      for (std::size_t m = 0; m < std::size(kModes); ++m) {
        campaign.add({bodies.name, kModes[m], aligned, aligned ? levels[orientation - 1] : 0.0, {}},
                     wanted * share * kModeShare[m], kShardQueries);
      }
    }
  }
  const std::size_t rows_of_pair = campaign.rows.size() / pairs.size();
  campaign.run<VerifiedPair>(
      options, "verdicts", [&](auto& kept, const auto& shard, std::size_t number) {
        const std::size_t p = shard.row / rows_of_pair;
        if (!kept[p]) kept[p] = std::make_unique<VerifiedPair>(pairs[p], kVerdictEpsilon_m);
        const VerdictRow& row = campaign.rows[shard.row];
        QueryRun run(*kept[p], pairs[p], row.aligned, row.noise_rad, judged_one_in[p],
                     seed_of(size.seed, number));
        return run.run(row.mode, shard.count);
      });
  return campaign.rows;
}

}  // namespace haptic::sim
