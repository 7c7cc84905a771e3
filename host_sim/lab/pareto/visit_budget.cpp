// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/pareto/visit_budget.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "host_sim/lab/peers/core_peer.hpp"
#include "host_sim/oracle/near_reference.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {
namespace {

constexpr std::uint32_t kSide = 6;
static_assert(kSide * kSide == kFieldPosts);
constexpr double kPitch_m = 0.010, kHalfPost_m = 0.003;

OraclePiece post_piece(const Solid& solid) {
  std::vector<WideVec> vertices;
  for (const Vector& v : solid.vertices)
    vertices.push_back({widen(v[0]), widen(v[1]), widen(v[2])});
  return make_oracle_piece(std::move(vertices), solid.loops);
}

/// The value that the core is given, and the truth is taken at.
double as_real(double value) { return static_cast<double>(static_cast<Real>(value)); }

WorkloadPose rounded(const Vector& p, const Rotation& q) {
  WorkloadPose pose;
  for (int k = 0; k < 3; ++k) pose.p_wa[k] = as_real(p[k]);
  pose.q_wa = Rotation(as_real(q.w()), as_real(q.x()), as_real(q.y()), as_real(q.z()));
  return pose;
}

/// The truth of the whole field from those of its posts: the smallest D_near, and every normal that
/// attains it.
NearTruth smallest(const std::vector<NearTruth>& posts) {
  NearTruth all = posts.front();
  for (const NearTruth& post : posts) {
    if (post.truth.reference_m < all.truth.reference_m)
      all.truth.reference_m = post.truth.reference_m;
    all.truth.lower_m = std::min(all.truth.lower_m, post.truth.lower_m);
    all.truth.upper_m = std::min(all.truth.upper_m, post.truth.upper_m);
  }
  all.normals.clear();
  for (const NearTruth& post : posts) {
    if (post.truth.reference_m - all.truth.reference_m < widen(NearReference::kTie_m))
      all.normals.insert(all.normals.end(), post.normals.begin(), post.normals.end());
  }
  return all;
}

/// Forces of one run, and the share of ticks in which a near pair had to be left out.
struct ForceRun {
  std::vector<Vector> forces;
  double held_share = 0;
};
ForceRun forces_of(const PostField& field, const TruthfulWorkload& workload, std::uint32_t visits) {
  CoreSetting setting;
  setting.max_pair_visits = visits;
  CoreSession session(core_scene(field.block, field.posts, setting), kFieldName);
  ForceRun run;
  StepInput input;
  std::size_t held = 0;
  for (const WorkloadPose& pose : workload.motion.poses) {
    input.pose_wa = pose_at(pose.p_wa, pose.q_wa);
    ++input.sequence;
    const StepResult result = session.core().step(input);
    run.forces.push_back(result.wrench_w.force_w.cast<double>());
    held += (result.flags & kFlagBudgetUsedUp) != 0 ? 1u : 0u;
  }
  run.held_share = static_cast<double>(held) / static_cast<double>(run.forces.size());
  return run;
}

VisitBudget measure_budget(const PostField& field, const TruthfulWorkload& workload,
                           std::uint32_t visits, const ForceRun& all, const MeasurePlan& plan,
                           const TickClock& clock) {
  VisitBudget budget;
  budget.visits = visits;
  CoreSetting setting;
  setting.max_pair_visits = visits;
  const auto peer = make_core_peer(field.block, field.posts, setting);
  const auto samples = measure_motion(*peer, workload, 1, plan, clock);
  for (const PoseSample& s : samples) {
    if (state_of(workload.truths[s.pose]) == PairState::kContact)
      budget.result.contact_ns.push_back(s.tick_ns);
  }
  std::sort(budget.result.contact_ns.begin(), budget.result.contact_ns.end());
  budget.result.rows = rows_of(samples, workload.truths);
  for (ParetoRow& row : budget.result.rows) {
    row.pair = kFieldName;
    row.method = "ours";
    row.setting = visits == kFieldPosts ? "visits all" : "visits " + std::to_string(visits);
    row.scalar = kRealName;
  }
  const ForceRun run = forces_of(field, workload, visits);
  budget.held_share = run.held_share;
  for (std::size_t k = 0; k < run.forces.size(); ++k) {
    budget.force_error_n = std::max(budget.force_error_n, (run.forces[k] - all.forces[k]).norm());
    budget.force_n = std::max(budget.force_n, all.forces[k].norm());
  }
  return budget;
}

}  // namespace

PostField post_field(std::uint64_t seed) {
  PostField field;
  field.block = centred_box("block", 0.040, 0.040, 0.010);
  Seeded random(seed);
  for (std::uint32_t i = 0; i < kSide; ++i) {
    for (std::uint32_t j = 0; j < kSide; ++j) {
      const double x = (i - 0.5 * (kSide - 1)) * kPitch_m, y = (j - 0.5 * (kSide - 1)) * kPitch_m;
      const double top = random.uniform(-3.0e-4, 3.0e-4);
      field.posts.push_back(box_solid("post", Vector(x - kHalfPost_m, y - kHalfPost_m, -0.02),
                                      Vector(x + kHalfPost_m, y + kHalfPost_m, top)));
    }
  }
  return field;
}

TruthfulWorkload field_workload(const PostField& field, std::size_t pose_count,
                                std::uint64_t seed) {
  TruthfulWorkload workload;
  Seeded random(seed);
  double phase[5];
  for (double& p : phase) p = random.uniform(0.0, 2.0 * std::numbers::pi);
  const auto wave = [&](int k, double hertz, double t_s) {
    return std::sin(2.0 * std::numbers::pi * hertz * t_s + phase[k]);
  };
  std::vector<std::unique_ptr<NearReference>> references;
  const OraclePiece block = post_piece(field.block);
  for (const Solid& post : field.posts)
    references.push_back(std::make_unique<NearReference>(block, post_piece(post)));
  std::vector<NearTruth> posts(field.posts.size());
  for (std::size_t i = 0; i < pose_count; ++i) {
    const double t_s = 1e-3 * static_cast<double>(i);
    const Vector p(0.010 * wave(0, 0.7, t_s), 0.010 * wave(1, 1.1, t_s),
                   0.0104 + 0.0016 * wave(2, 2.3, t_s));
    const Vector tilt(0.02 * wave(3, 1.7, t_s), 0.02 * wave(4, 1.3, t_s), 0);
    const double angle = tilt.norm();
    const WorkloadPose pose = rounded(
        p, Rotation(Eigen::AngleAxisd(angle, angle > 0 ? Vector(tilt / angle) : Vector::UnitX())));
    const Rotation& q = pose.q_wa;
    const OraclePose at{rotation_of(widen(q.w()), widen(q.x()), widen(q.y()), widen(q.z())),
                        {widen(pose.p_wa[0]), widen(pose.p_wa[1]), widen(pose.p_wa[2])}};
    for (std::size_t k = 0; k < posts.size(); ++k) posts[k] = references[k]->at(at);
    workload.motion.poses.push_back(pose);
    workload.poses.push_back(peer_pose(pose.p_wa, pose.q_wa));
    workload.truths.push_back(smallest(posts));
  }
  workload.motion.recordings.push_back({WorkloadKind::kFaceFace, 0, pose_count});
  return workload;
}

std::vector<VisitBudget> measure_visit_budgets(std::size_t pose_count, std::uint64_t seed,
                                               const MeasurePlan& plan, const TickClock& clock) {
  const PostField field = post_field(seed + 70);
  const TruthfulWorkload workload = field_workload(field, pose_count, seed + 71);
  const ForceRun all = forces_of(field, workload, kFieldPosts);
  std::vector<VisitBudget> budgets;
  for (const std::uint32_t visits : {1u, 2u, 4u, 8u, 16u, kFieldPosts})
    budgets.push_back(measure_budget(field, workload, visits, all, plan, clock));
  return budgets;
}

}  // namespace haptic::sim
