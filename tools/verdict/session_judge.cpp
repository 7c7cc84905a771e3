// SPDX-License-Identifier: Apache-2.0
#include "tools/verdict/session_judge.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "rt_core/scene/part_scenes.hpp"

namespace haptic::tools {
namespace {

/// Force and part are as the core wants them while none of these is set.
constexpr std::uint32_t kOutOfForce = kFlagRamping | kFlagRecovery | kFlagClutched;

constexpr std::uint32_t bit(WhyNot why) noexcept { return 1u << static_cast<unsigned>(why); }
constexpr std::uint32_t bit(Outcome outcome) noexcept {
  return 1u << static_cast<unsigned>(outcome);
}

/// Goes on with a run, or ends it; keeps the longest.
void follow(bool goes_on, std::uint64_t tick, TickRun& run, TickRun& longest) noexcept {
  if (!goes_on) {
    run = {};
    return;
  }
  if (run.ticks == 0) run.begin = tick;
  run.ticks += 1;
  if (run.ticks > longest.ticks) longest = run;
}

/// The most that the guides of a scene do; of parts that are held one after another each once.
double guide_energy_j(const SceneView& scene) noexcept {
  const auto of = [](const SceneView& held) {
    const GuideRecord* const guide = held.guide();
    return guide != nullptr ? guide->energy_j : 0.0;
  };
  PartScenes parts;
  if (PartScenes::open(scene, parts) != RtStatus::kOk || parts.count() == 0) return of(scene);
  double energy_j = 0;
  for (std::uint32_t k = 0; k < parts.count(); ++k) {
    SceneView held;
    if (parts.may_be_held(k) && SceneView::open(parts.scene_of(k), held) == RtStatus::kOk)
      energy_j += of(held);
  }
  return energy_j;
}

}  // namespace

bool felt_part_touches(const StepResult& result, LawId law) noexcept {
  if (result.status != RtStatus::kOk) return false;
  if (result.situation != ContactSituation::kNone) return true;
  return law != LawId::kProxy && result.d_near_m <= 0;
}

JudgedTick judged_tick(const StepResult& result, LawId law) noexcept {
  JudgedTick tick;
  tick.refused = result.status != RtStatus::kOk;
  tick.in_contact = felt_part_touches(result, law);
  tick.pull_n = static_cast<double>(std::sqrt(result.spring_w.force_w.squaredNorm()));
  tick.flags = result.flags;
  tick.energy_j = static_cast<double>(result.energy_j);
  return tick;
}

const char* to_text(WhyNot why) noexcept {
  constexpr std::array<const char*, kWhyNots> kTexts{"refused",   "inside", "outside",   "stuck",
                                                     "list_full", "behind", "saturated", "ramped"};
  const auto at = static_cast<std::size_t>(why);
  return at < kTexts.size() ? kTexts[at] : "unknown";
}

const char* to_text(Outcome outcome) noexcept {
  constexpr std::array<const char*, static_cast<std::size_t>(Outcome::kCount)> kTexts{
      "followed", "no_ticks", "energy_given_out", "force_without_contact",
      "stuck",    "inside",   "behind",           "nothing_touched"};
  const auto at = static_cast<std::size_t>(outcome);
  return at < kTexts.size() ? kTexts[at] : "unknown";
}

std::uint32_t why_not(const JudgedTick& tick) noexcept {
  if (tick.refused) return bit(WhyNot::kRefused);
  constexpr struct {
    std::uint32_t flag;
    WhyNot why;
  } kFlags[] = {{kFlagRecovery, WhyNot::kInside},  {kFlagOutsideEnvelope, WhyNot::kOutside},
                {kFlagProxyStuck, WhyNot::kStuck}, {kFlagListFull, WhyNot::kListFull},
                {kFlagBehind, WhyNot::kBehind},    {kFlagSaturated, WhyNot::kSaturated},
                {kFlagRamping, WhyNot::kRamped}};
  std::uint32_t bits = 0;
  for (const auto& of : kFlags) bits |= (tick.flags & of.flag) != 0 ? bit(of.why) : 0u;
  return bits;
}

void add(const SessionVerdict& later, SessionVerdict& to) noexcept {
  if (later.ticks == 0) return;
  if (to.ticks == 0) {
    to = later;
    return;
  }
  const auto longer = [&to](TickRun run, TickRun& longest) {
    run.begin += to.ticks;
    if (run.ticks > longest.ticks) longest = run;
  };
  longer(later.longest_open, to.longest_open);
  longer(later.longest_stuck, to.longest_stuck);
  to.failures |= later.failures;
  to.outcome =
      to.failures != 0 ? static_cast<Outcome>(std::countr_zero(to.failures)) : Outcome::kFollowed;
  to.ticks += later.ticks;
  to.followed_ticks += later.followed_ticks;
  to.contact_ticks += later.contact_ticks;
  for (std::size_t k = 0; k < kWhyNots; ++k) to.why_not[k] += later.why_not[k];
  to.inside_to_end = later.inside_to_end;
  to.open_force_n = std::max(to.open_force_n, later.open_force_n);
  if (!(to.given_out_j >= later.given_out_j)) to.given_out_j = later.given_out_j;
}

SessionJudge::SessionJudge(const SceneView& scene) noexcept {
  const SceneParameters& p = scene.parameters();
  law_ = p.law;
  sum_.pair_count = scene.pair_count();
  sum_.near_pairs = scene.header().capacity.near_slots;
  sum_.work_units = p.work_units;
  sum_.has_device = p.device.given != 0;
  observes_ = p.coupling.passivity != 0;
  allowed_work_j_ += guide_energy_j(scene);
}

void SessionJudge::take(const JudgedTick& tick) noexcept {
  const std::uint64_t now = sum_.ticks;
  const std::uint32_t why = haptic::tools::why_not(tick);
  sum_.ticks += 1;
  sum_.followed_ticks += why == 0 ? 1u : 0u;
  sum_.contact_ticks += tick.in_contact ? 1u : 0u;
  for (std::size_t k = 0; k < kWhyNots; ++k) sum_.why_not[k] += why >> k & 1u;
  const bool inside = (why & bit(WhyNot::kInside)) != 0;
  if (now == 0) sum_.started_inside = inside;
  sum_.inside_to_end = inside ? sum_.inside_to_end + 1 : 0;

  if (observes_ && !tick.refused) note_work(-tick.energy_j);

  const bool felt = !tick.refused && (tick.flags & kOutOfForce) == 0;
  const bool open = felt && !tick.in_contact && tick.pull_n > kOpenForce_n;
  follow(open, now, open_, sum_.longest_open);
  open_force_n_ = open ? std::max(open_force_n_, tick.pull_n) : 0;
  if (open_.ticks > kMostOpenTicks) sum_.open_force_n = std::max(sum_.open_force_n, open_force_n_);
  follow(felt && (why & bit(WhyNot::kStuck)) != 0, now, stuck_, sum_.longest_stuck);
}

void SessionJudge::note_work(double delivered_j) noexcept {
  // A first account may be below zero: what was given out is counted from nothing.
  const double before = std::isnan(sum_.given_out_j) ? 0 : sum_.given_out_j;
  sum_.given_out_j = std::max(before, delivered_j);
}

void SessionJudge::reset() noexcept {
  const SessionVerdict old = sum_;
  sum_ = {};
  sum_.pair_count = old.pair_count;
  sum_.near_pairs = old.near_pairs;
  sum_.work_units = old.work_units;
  sum_.has_device = old.has_device;
  open_ = stuck_ = {};
  open_force_n_ = 0;
}

SessionVerdict SessionJudge::verdict() const noexcept {
  SessionVerdict v = sum_;
  if (v.ticks == 0) return v;
  const auto fail = [&v](bool failed, Outcome outcome) {
    if (!failed) return;
    if (v.failures == 0) v.outcome = outcome;
    v.failures |= bit(outcome);
  };
  v.outcome = Outcome::kFollowed;
  const std::uint64_t behind = v.why_not[static_cast<std::size_t>(WhyNot::kBehind)];
  fail(v.given_out_j > allowed_work_j_, Outcome::kEnergy);
  fail(v.longest_open.ticks > kMostOpenTicks, Outcome::kForceInTheOpen);
  fail(v.longest_stuck.ticks > kMostStuckTicks, Outcome::kStuck);
  fail(v.inside_to_end > kMostInsideTicks, Outcome::kInside);
  fail(behind > kFewBehindTicks &&
           static_cast<double>(behind) > kMostBehindShare * static_cast<double>(v.ticks),
       Outcome::kBehind);
  fail(expects_contact_ && v.contact_ticks == 0, Outcome::kNothingTouched);
  return v;
}

}  // namespace haptic::tools
