// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/bodies_fuzz/hands_run.hpp"

#include <algorithm>
#include <chrono>
#include <vector>

#include "host_sim/lab/bodies_fuzz/bodies_judge.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_motion.hpp"
#include "host_sim/report/shard_run.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {
namespace {

constexpr std::int64_t kHandsTick_ns = 1'000'000;

/// Pose of a mesh frame whose body is seen from `grip_m` in it.
Pose mesh_pose(const BodyPlace& place, const Vec3& grip_m) {
  Pose pose;
  pose.q_wa = place.q.cast<Real>().normalized();
  pose.p_wa = place.p.cast<Real>() - pose.q_wa * grip_m;
  return pose;
}

WidePose wide_grip_pose(const Pose& mesh_wa, const Vec3& grip_m) {
  Pose pose = mesh_wa;
  pose.p_wa += mesh_wa.q_wa * grip_m;
  return wide_pose(pose);
}

class HandsRun {
 public:
  HandsRun(const std::string& scene, const CompiledBodies& compiled,
           std::optional<BodiesFault> fault)
      : compiled_(compiled),
        session_(scene, GoalContact::kLeftOut),
        hands_(*session_.hands()),
        judge_(compiled),
        fault_(fault) {
    const std::vector<FuzzBody>& bodies = compiled.scene.bodies;
    for (const FuzzBody& body : bodies) grips_.push_back(body.is->grip_m);
    const std::span<const DrivenRecord> movers = session_.parts()->driven();
    records_.resize(movers.size());
    for (std::size_t body = hands_.count(); body < bodies.size(); ++body) {
      for (std::size_t k = 0; k < movers.size(); ++k) {
        if (session_.parts()->name(movers[k].part) == bodies[body].name) movers_.push_back(k);
      }
    }
  }

  BodiesTotals run(std::uint64_t ticks, std::uint64_t seed, std::uint64_t number) {
    label_ = "hands of " + compiled_.scene.name + ", seed " + std::to_string(seed) + ", run " +
             std::to_string(number);
    Seeded random(seed_of(seed, number));
    std::vector<BodyPlace> starts;
    for (const FuzzBody& body : compiled_.scene.bodies)
      starts.push_back({body.start, body.start_turn});
    BodiesMotion motion(compiled_.scene, starts, random.below(1u << 30));
    session_.reset();
    for (std::uint64_t t = 0; t < ticks; ++t) {
      goals_ = motion.next();
      give(goals_, t);
      if (!take(t)) break;
    }
    return std::move(totals_);
  }

 private:
  void give(const std::vector<BodyPlace>& goals, std::uint64_t t) {
    const auto stamp_ns = static_cast<std::int64_t>(t + 1) * kHandsTick_ns;
    for (std::size_t k = 0; k < movers_.size(); ++k) {
      const std::size_t body = hands_.count() + k;
      if (compiled_.scene.bodies[body].role != BodyRole::kDriver) continue;
      const Pose pose = mesh_pose(goals[body], grips_[body]);
      FrameRecord& record = records_[movers_[k]];
      record.number = t + 1;
      record.stamp_ns = stamp_ns;
      for (int i = 0; i < 3; ++i) record.p_m[i] = static_cast<double>(pose.p_wa[i]);
      for (int i = 0; i < 4; ++i) record.q_xyzw[i] = static_cast<double>(pose.q_wa.coeffs()[i]);
    }
    Hands::Each<StepInput> inputs;
    Hands::Each<const StepInput*> given{};
    for (std::uint32_t hand = 0; hand < hands_.count(); ++hand) {
      inputs[hand].sequence = t;
      inputs[hand].stamp_ns = stamp_ns;
      inputs[hand].pose_wa = mesh_pose(goals[hand], grips_[hand]);
      given[hand] = &inputs[hand];
    }
    hands_.follow({records_, stamp_ns, true});
    const auto start = std::chrono::steady_clock::now();
    results_ = hands_.step(given);
    const auto ns = std::chrono::nanoseconds(std::chrono::steady_clock::now() - start).count();
    totals_.peak_ns = std::max(totals_.peak_ns, static_cast<std::uint64_t>(ns));
  }

  /// False: the run is of no more use.
  bool take(std::uint64_t t) {
    ++totals_.hand_ticks;
    std::vector<WidePose> poses;
    for (std::uint32_t hand = 0; hand < hands_.count(); ++hand) {
      const StepResult& result = results_[hand];
      if (result.status != RtStatus::kOk) {
        fail(t, "refused", to_text(result.status), totals_.refused);
        return false;
      }
      if (!is_finite(result.wrench_w)) fail(t, "not finite", "a wrench", totals_.infinite);
      const bool at_goal = fault_ == BodiesFault::kGoal;
      poses.push_back(wide_grip_pose(
          at_goal ? mesh_pose(goals_[hand], grips_[hand]) : hands_.felt_wa(hand), grips_[hand]));
      note_work(t, result.counters);
    }
    for (std::size_t k = 0; k < movers_.size(); ++k) {
      const std::size_t body = hands_.count() + k;
      poses.push_back(wide_grip_pose(hands_.driven().states()[movers_[k]].felt_wa, grips_[body]));
    }
    const Wide allowed = judge_.allowed_depth_m();
    // The pose of a mesh frame and back is one rounding more.
    const BodiesJudge::PairGap found = judge_.end_gap(poses, -allowed);
    totals_.worst_gap_m = std::min(totals_.worst_gap_m, found.gap_m / judge_.tolerance_m());
    if (found.gap_m >= -allowed) return true;
    fail(t, "not free", judge_.name_of(found.pair) + ", gap " + number_text(found.gap_m) + " m",
         totals_.deep);
    return true;
  }

  void note_work(std::uint64_t t, const StepCounters& counters) {
    const std::uint64_t bound =
        fault_ == BodiesFault::kBound ? 0 : session_.bounds().max_work_units;
    totals_.units_bound = std::max(totals_.units_bound, bound);
    totals_.peak_units = std::max<std::uint64_t>(totals_.peak_units, counters.work_units);
    if (counters.work_units <= bound) return;
    fail(t, "over its bound",
         std::to_string(counters.work_units) + " units of " + std::to_string(bound), totals_.over);
  }

  void fail(std::uint64_t t, const char* kind, const std::string& what, std::uint64_t& count) {
    ++count;
    totals_.failures.add(kind, label_ + ", tick " + std::to_string(t) + ", " + what);
  }

  const CompiledBodies& compiled_;
  CoreSession session_;
  Hands& hands_;
  BodiesJudge judge_;
  std::optional<BodiesFault> fault_;
  std::vector<Vec3> grips_;           ///< by body, in its mesh frame
  std::vector<BodyPlace> goals_;      ///< of this tick, by body
  std::vector<std::size_t> movers_;   ///< by body behind the hands': number of the mover
  std::vector<FrameRecord> records_;  ///< by mover
  Hands::Each<StepResult> results_;
  std::string label_;
  BodiesTotals totals_;
};

}  // namespace

BodiesTotals run_hands(const std::string& scene, const CompiledBodies& compiled,
                       std::uint64_t ticks, std::uint64_t seed, std::uint64_t number,
                       std::optional<BodiesFault> fault) {
  return HandsRun(scene, compiled, fault).run(ticks, seed, number);
}

}  // namespace haptic::sim
