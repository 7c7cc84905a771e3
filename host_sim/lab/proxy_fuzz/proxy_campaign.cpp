// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/proxy_fuzz/proxy_campaign.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "host_sim/lab/proxy_fuzz/fuzz_run.hpp"

namespace haptic::sim {

namespace {

constexpr double kPeriod_s = 1e-3;
constexpr std::uint32_t kLongestRest = 40;

Rotation turned(const Vector& axis, double angle_rad) {
  return Rotation(Eigen::AngleAxisd(angle_rad, axis));
}

/// Ticks of a run; each begins at a free pose of its own.
constexpr std::uint64_t kShardTicks = 1000;

}  // namespace

const char* to_text(FuzzMotionKind kind) {
  switch (kind) {
    case FuzzMotionKind::kSlow:
      return "slow";
    case FuzzMotionKind::kFast:
      return "fast";
    case FuzzMotionKind::kJitter:
      return "jitter";
    case FuzzMotionKind::kTeleport:
      return "teleport";
    case FuzzMotionKind::kMixed:
      break;
  }
  return "mixed";
}

FuzzMotion::FuzzMotion(const FuzzScene& scene, FuzzMotionKind kind, const Vector& p,
                       const Rotation& q, std::uint64_t seed)
    : scene_(scene), kind_(kind), now_(kind), random_(seed), p_(p), goal_p_(p), q_(q), goal_q_(q) {}

void FuzzMotion::draw_goal() {
  for (int i = 0; i < 3; ++i) {
    goal_p_[i] = scene_.home[i] + random_.uniform(-scene_.range[i], scene_.range[i]);
  }
  const Vector axis = random_.direction();
  goal_q_ = turned(axis, random_.uniform(-scene_.tilt_rad, scene_.tilt_rad));
  turn_share_ = random_.uniform(0.1, 1.0);
  rest_ = random_.below(3) == 0 ? random_.below(kLongestRest) : 0;
}

/// Goes on towards the present aim, no farther than this.
void FuzzMotion::advance(double linear_m, double angular_rad) {
  const Vector way = goal_p_ - p_;
  const double distance = way.norm();
  const double angle = q_.angularDistance(goal_q_);
  if (distance <= linear_m) {
    p_ = goal_p_;
    if (rest_ > 0) {
      --rest_;
      return;
    }
    draw_goal();
    return;
  }
  p_ += way * (linear_m / distance);
  if (angle > 0) q_ = q_.slerp(std::min(1.0, angular_rad / angle), goal_q_).normalized();
}

Pose FuzzMotion::next() {
  if (kind_ == FuzzMotionKind::kMixed && change_in_-- == 0) {
    now_ = kFuzzMotions[random_.below(4)];
    change_in_ = 20 + random_.below(180);
  }
  const bool fast = now_ == FuzzMotionKind::kFast;
  advance((fast ? 1.0 : 0.1) * kPeriod_s, (fast ? 10.0 : 1.0) * turn_share_ * kPeriod_s);
  const bool jitter = now_ == FuzzMotionKind::kJitter;
  if (!jitter && now_ != FuzzMotionKind::kTeleport) return pose_at(p_, q_);
  const double far_m = jitter ? 1e-3 : 20e-3, turn_rad = jitter ? 0.05 : 1.5;
  Vector shift, turn;
  for (int i = 0; i < 3; ++i) shift[i] = random_.uniform(-far_m, far_m);
  for (int i = 0; i < 3; ++i) turn[i] = random_.uniform(-turn_rad, turn_rad);
  return pose_at(p_ + shift, turned(turn.normalized(), turn.norm()) * q_);
}

std::optional<ProxyFault> proxy_fault_named(const std::string& name) {
  if (name == "certificate") return ProxyFault::kCertificate;
  if (name == "spring") return ProxyFault::kSpring;
  if (name == "vertex") return ProxyFault::kVertex;
  return std::nullopt;
}

void ProxyFuzzTotals::add(const ProxyFuzzTotals& other) {
  using T = ProxyFuzzTotals;
  for (const auto field : {&T::ticks, &T::held, &T::deep, &T::rises, &T::stalls, &T::walls,
                           &T::crossings, &T::wrenches, &T::goals, &T::over_caps, &T::recoveries,
                           &T::rejected_passes, &T::limited, &T::anchored}) {
    this->*field += other.*field;
  }
  for (const auto field : {&T::longest_still, &T::longest_stall, &T::longest_rejected}) {
    this->*field = std::max(this->*field, other.*field);
  }
  worst_gap_m = std::min(worst_gap_m, other.worst_gap_m);
  for (const auto field : {&T::largest_rise_j, &T::largest_rise_share, &T::largest_wrench_error}) {
    this->*field = std::max(this->*field, other.*field);
  }
  using C = StepCounters;
  for (const auto field : {&C::proxy_passes, &C::proxy_rejected, &C::proxy_rounds, &C::proxy_rows,
                           &C::qp_iterations, &C::plane_gaps, &C::valid_nodes}) {
    peaks.*field = std::max(peaks.*field, other.peaks.*field);
  }
  failures.add(other.failures);
}

ProxyFuzzTotals ProxyFuzzResult::totals() const {
  ProxyFuzzTotals sum;
  for (const ProxyFuzzRow& row : rows) sum.add(row.totals);
  return sum;
}

ProxyFuzzResult run_proxy_fuzz(const ProxyFuzzSize& size, const RunOptions& options) {
  const std::vector<FuzzScene> scenes = fuzz_scenes();
  const std::size_t frictions = size.frictions.size(), kinds = std::size(kFuzzMotions);
  double shares = 0;
  for (const FuzzScene& scene : scenes) shares += scene.share;
  const double per_share = static_cast<double>(size.ticks) /
                           (shares * static_cast<double>(frictions) * static_cast<double>(kinds));
  Campaign<ProxyFuzzRow> campaign;
  for (const FuzzScene& scene : scenes) {
    for (const double friction : size.frictions) {
      for (const FuzzMotionKind kind : kFuzzMotions)
        campaign.add({scene.name, to_text(kind), friction, {}}, per_share * scene.share,
                     kShardTicks);
    }
  }
  std::vector<std::vector<std::byte>> blobs(scenes.size() * frictions);
  run_shards(
      blobs.size(), {options.threads, false}, "scenes", [] { return 0; },
      [&](int, std::size_t k) {
        blobs[k] = compiled(scenes[k / frictions], size.frictions[k % frictions]);
      });
  campaign.run<FuzzRun>(options, "proxy", [&](auto& kept, const auto& shard, std::size_t number) {
    const std::size_t at = shard.row / kinds;
    std::unique_ptr<FuzzRun>& run = kept[at];
    if (!run) {
      run = std::make_unique<FuzzRun>(scenes[at / frictions], size.frictions[at % frictions],
                                      blobs[at], size.fault);
    }
    return run->run(kFuzzMotions[shard.row % kinds], shard.count, seed_of(size.seed, number));
  });
  return {size, std::move(campaign.rows)};
}

}  // namespace haptic::sim
