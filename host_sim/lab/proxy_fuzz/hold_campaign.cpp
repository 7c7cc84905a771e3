// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/proxy_fuzz/hold_campaign.hpp"

#include <algorithm>
#include <cstring>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "host_sim/lab/proxy_fuzz/fuzz_run.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {
namespace {

constexpr std::uint32_t kHoldTicks = 1200, kSettleTicks = 200;
constexpr double kHoldFriction = 0.3;
constexpr Wide kLargestResidual_n = 0.01L, kLargestRise_j = 1e-9L;
constexpr Wide kHeld_m = 1e-6L;  ///< farther from its goal a part of 50 mm is held
/// What tells the user that the part is not where the energy is least.
constexpr std::uint32_t kSaysSo = kFlagProxyLimited | kFlagProxyStuck | kFlagHooked | kFlagRecovery;

/// A scene with or without friction and device, ready to run.
struct HoldRun {
  const FuzzScene& scene;
  double friction;
  CoreSession session;
  ProxyJudge judge;

  HoldRun(const FuzzScene& of, double mu, std::span<const std::byte> blob)
      : scene(of), friction(mu), session(blob, of.name), judge(of, session.view()) {}
};

bool same_bits(const Pose& a, const Pose& b) {
  return a.p_wa == b.p_wa && a.q_wa.coeffs() == b.q_wa.coeffs();
}

bool same_bits(const Wrench& a, const Wrench& b) {
  return a.force_w == b.force_w && a.torque_w == b.torque_w;
}

void add_line(std::string& text, std::uint32_t tick, const StepResult& r, Wide energy_j) {
  text += std::to_string(tick);
  for (int i = 0; i < 3; ++i) {
    text += ",";
    append_number(text, static_cast<double>(r.proxy_pose_wa.p_wa[i]));
  }
  for (int i = 0; i < 3; ++i) {
    text += ",";
    append_number(text, static_cast<double>(r.wrench_w.force_w[i]));
  }
  for (int i = 0; i < 3; ++i) {
    text += ",";
    append_number(text, static_cast<double>(r.wrench_w.torque_w[i]));
  }
  text += ",";
  append_number(text, static_cast<double>(energy_j));
  text += "," + std::to_string(r.flags) + "\n";
}

/// Moves, holds and judges one pose. `ticks`: a line for each tick of the hold, where wanted.
void hold(HoldRun& run, FuzzMotionKind kind, std::uint64_t seed, std::optional<ProxyFault> fault,
          HoldPose& pose, std::string* ticks) {
  Seeded random(seed);
  Vector p;
  Rotation q;
  draw_start(run.scene, run.judge, random, p, q);
  FuzzMotion motion(run.scene, kind, p, q, random.below(1u << 30));
  const std::uint32_t moves = 20 + random.below(180);
  HapticCore& core = run.session.core();
  core.reset();
  StepInput input;
  input.pose_wa = pose_at(p, q);
  StepResult result, before;
  for (std::uint32_t t = 0; t < moves; ++t) {
    if (t > 0) input.pose_wa = motion.next();
    ++input.sequence;
    result = core.step(input);
  }
  const Wide share = run.judge.radius_m() / 0.05L, allowed = run.judge.allowed_depth_m();
  Wide start_j = 0;
  for (std::uint32_t t = 0; t < kHoldTicks; ++t) {
    before = result;
    ++input.sequence;
    if (fault == ProxyFault::kRestless && t % 64 == 63) {
      const Vec3 pull = result.goal_pose_wa.p_wa - result.proxy_pose_wa.p_wa;
      displace(run.session, result, 1e-3_r * pull);
    }
    result = core.step(input);
    const WidePose goal = wide_pose(result.goal_pose_wa), part = wide_pose(result.proxy_pose_wa);
    if (t == 0) {
      start_j = run.judge.potential_j(wide_error(goal, wide_pose(before.proxy_pose_wa)));
    }
    const bool same = same_bits(result.proxy_pose_wa, before.proxy_pose_wa) &&
                      same_bits(result.wrench_w, before.wrench_w);
    if (!same) pose.last_change = t;
    if (!same || t == 0) {
      const Wide energy = run.judge.potential_j(wide_error(goal, part));
      pose.largest_rise_j = std::max(pose.largest_rise_j, energy - start_j);
      const Wide gap = run.judge.end_gap_m(part, -allowed);
      pose.worst_gap_m = std::min(pose.worst_gap_m, gap / share);
      pose.deep = pose.deep || gap < -allowed;
    }
    if (ticks != nullptr) {
      add_line(*ticks, t, result, run.judge.potential_j(wide_error(goal, part)));
    }
  }
  const WidePose goal = wide_pose(result.goal_pose_wa), part = wide_pose(result.proxy_pose_wa);
  const WideError error = wide_error(goal, part);
  pose.flags = result.flags;
  pose.force_n = norm(widen(kFuzzStiffness_n_per_m) * error.translation_m);
  if (norm(error.translation_m) + run.judge.radius_m() * norm(error.rotation_rad) >
      kHeld_m * share) {
    pose.residual_n = run.judge.residual_n(goal, part, widen(run.friction));
  }
  pose.moving = pose.last_change > kSettleTicks;
  pose.flagged = (result.flags & kSaysSo) != 0;
  pose.unbalanced = !pose.flagged && pose.residual_n > kLargestResidual_n;
  pose.rising = pose.largest_rise_j > kLargestRise_j;
  if (!pose.failed()) return;
  pose.failure = failure_text(
      "part", result.proxy_pose_wa,
      failure_text("goal", result.goal_pose_wa,
                   "last change in tick " + std::to_string(pose.last_change) + ", residual " +
                       number_text(pose.residual_n) + " N, energy above its start by " +
                       number_text(pose.largest_rise_j) + " J, worst gap " +
                       number_text(pose.worst_gap_m) + " m, flags " + std::to_string(pose.flags)));
}

std::vector<Cell> cells_of(const HoldTotals& t) {
  return {t.poses,
          t.held,
          t.moving,
          t.unbalanced,
          t.rising,
          t.deep,
          t.flagged,
          number_text(t.largest_residual_n),
          number_text(t.largest_rise_j),
          number_text(t.worst_gap_m * 1e6L)};
}

ReportTable hold_table(const HoldResult& result) {
  ReportTable table(
      "scene,friction,poses,held,moving,unbalanced,energy rises,too deep,flagged,largest residual "
      "N,largest rise J,worst gap um");
  Groups<std::pair<std::string, double>, HoldTotals> rows;
  for (const HoldPose& pose : result.poses) rows.at({pose.scene, pose.friction}).add(pose);
  for (const auto& [key, totals] : rows.list()) {
    std::vector<Cell> cells{key.first, number_text(widen(key.second))};
    for (const Cell& cell : cells_of(totals)) cells.push_back(cell);
    table.add(std::move(cells));
  }
  return table;
}

}  // namespace

void HoldTotals::add(const HoldPose& pose) {
  ++poses;
  if (pose.force_n > 1e-3L) ++held;
  if (pose.moving) ++moving;
  if (pose.unbalanced) ++unbalanced;
  if (pose.rising) ++rising;
  if (pose.deep) ++deep;
  if (pose.flagged && pose.residual_n > kLargestResidual_n) ++flagged;
  if (!pose.flagged) largest_residual_n = std::max(largest_residual_n, pose.residual_n);
  largest_rise_j = std::max(largest_rise_j, pose.largest_rise_j);
  worst_gap_m = std::min(worst_gap_m, pose.worst_gap_m);
}

HoldTotals HoldResult::totals() const {
  HoldTotals totals;
  for (const HoldPose& pose : poses) totals.add(pose);
  return totals;
}

HoldResult run_hold(const HoldSize& size, const RunOptions& options) {
  std::vector<FuzzScene> scenes;
  for (FuzzScene& scene : hold_scenes()) {
    scene.device = false;
    scenes.push_back(scene);
    scene.device = true;
    scenes.push_back(std::move(scene));
  }
  constexpr double kFrictions[] = {0.0, kHoldFriction};
  const std::size_t frictions = std::size(kFrictions), kinds = std::size(kFuzzMotions);
  const std::size_t runs = scenes.size() * frictions;
  const std::vector<std::uint64_t> numbers = numbers_of(size.poses, size.only);
  std::vector<bool> wanted(runs, false);
  for (const std::uint64_t number : numbers) wanted[number % runs] = true;
  std::vector<std::vector<std::byte>> blobs(runs);
  run_shards(
      runs, {options.threads, false}, "scenes", [] { return 0; },
      [&](int, std::size_t k) {
        if (wanted[k]) blobs[k] = compiled(scenes[k / frictions], kFrictions[k % frictions]);
      });
  HoldResult result;
  result.size = size;
  result.poses.resize(numbers.size());
  if (size.only) {
    result.ticks_csv =
        "tick,p_x_m,p_y_m,p_z_m,f_x_n,f_y_n,f_z_n,t_x_nm,t_y_nm,t_z_nm,energy_j,flags\n";
  }
  run_shards(
      numbers.size(), options, "hold",
      [] { return std::map<std::size_t, std::unique_ptr<HoldRun>>(); },
      [&](auto& kept, std::size_t k) {
        const std::uint64_t number = numbers[k];
        const std::size_t at = number % runs;
        std::unique_ptr<HoldRun>& run = kept[at];
        if (!run) {
          run = std::make_unique<HoldRun>(scenes[at / frictions], kFrictions[at % frictions],
                                          blobs[at]);
          if (size.fault) damage(run->session, *size.fault);
        }
        HoldPose& pose = result.poses[k];
        const FuzzMotionKind kind = kFuzzMotions[number / runs % kinds];
        pose.number = number;
        pose.scene = run->scene.name;
        pose.device = run->scene.device;
        pose.friction = run->friction;
        pose.motion = to_text(kind);
        hold(*run, kind, seed_of(size.seed, number), size.fault, pose,
             size.only ? &result.ticks_csv : nullptr);
      });
  return result;
}

std::string hold_page(const HoldResult& result) {
  const HoldTotals t = result.totals();
  std::string text = "# The device held still\n\n";
  text += std::to_string(t.poses) + " poses, seed " + std::to_string(result.size.seed) +
          ": the device moves as in the proxy campaign and is held for 1.2 s. Moving: wrench or "
          "part changes a bit after 0.2 s. Residual: of the spring's pull against all contact "
          "forces that features touching at the end can bear, at most 0.01 N without a flag. "
          "Energy: never above that at the start by more than 1e-9 J. Gaps are for a part of 50 mm "
          "and must be at least -0.1 um.\n\n| moving | unbalanced | energy rises | too deep |\n"
          "|---|---|---|---|\n| ";
  text += std::to_string(t.moving) + " | " + std::to_string(t.unbalanced) + " | " +
          std::to_string(t.rising) + " | " + std::to_string(t.deep) + " |\n\n";
  text += hold_table(result).markdown();
  constexpr std::size_t kListed = 40;
  std::size_t listed = 0;
  for (const HoldPose& pose : result.poses) {
    if (!pose.failed() || listed == kListed) continue;
    if (listed++ == 0) text += "\n## Failures (one again: --only NUMBER)\n\n";
    text += "- pose " + std::to_string(pose.number) + ", " + pose.scene + ", friction " +
            number_text(widen(pose.friction)) + (pose.device ? ", device, " : ", no device, ") +
            pose.motion + ", " + pose.failure + "\n";
  }
  return text;
}

CampaignEnd hold_end(const HoldResult& result) {
  const HoldTotals t = result.totals();
  ReportTable lines(
      "pose,scene,friction,device,motion,last_change,flags,force_n,residual_n,largest_rise_j,"
      "worst_gap_m,moving,unbalanced,rising,deep");
  for (const HoldPose& p : result.poses) {
    lines.add({p.number, quoted(p.scene), p.friction, p.device ? 1 : 0, p.motion, p.last_change,
               p.flags, number_text(p.force_n), number_text(p.residual_n),
               number_text(p.largest_rise_j), number_text(p.worst_gap_m), p.moving ? 1 : 0,
               p.unbalanced ? 1 : 0, p.rising ? 1 : 0, p.deep ? 1 : 0});
  }
  nlohmann::ordered_json j;
  j["seed"] = result.size.seed;
  j["poses"] = t.poses;
  j["held"] = t.held;
  j["passed"] = t.failed() == 0;
  j["moving"] = t.moving;
  j["unbalanced"] = t.unbalanced;
  j["energy_rises"] = t.rising;
  j["too_deep"] = t.deep;
  j["flagged"] = t.flagged;
  j["largest_residual_n"] = static_cast<double>(t.largest_residual_n);
  j["largest_rise_j"] = static_cast<double>(t.largest_rise_j);
  j["worst_end_gap_m"] = static_cast<double>(t.worst_gap_m);
  const std::string page = hold_page(result);
  CampaignEnd end{page, campaign_files("hold", lines.csv(), j, page), t.failed() == 0};
  if (result.size.only) end.files.push_back({"hold_ticks.csv", result.ticks_csv});
  return end;
}

}  // namespace haptic::sim
