// SPDX-License-Identifier: Apache-2.0
// Facets screened in bulk: what the law takes from the screen, and gives back to it.
#include <algorithm>
#include <array>
#include <cmath>

#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {
namespace {

/// Gaps of what is listed, in tolerances beneath the skin: a step may end half of one beneath it,
/// and p is above that but for what planes and single precision round off.
constexpr Real kStepsRoom = 0.05_r, kBeneath = 0.5_r - kStepsRoom;
/// A pair goes back with so many tolerances beneath the skin.
constexpr Real kBackBeneath = 0.1_r;
/// Of the pairs that the law has it gives this share back in a tick where it can.
constexpr std::uint32_t kGivenBackShare = 4, kMostBack = 256;
/// Lists hold facets up to this share of the part's radius away, or so many of its steps or of what
/// a pass may reach.
constexpr Real kRangeShare = 1.2e-2_r, kRangeSteps = 6, kRangeReaches = 2, kMostRangeShare = 0.1_r;
/// Share of the budget that is left which lists may take.
constexpr std::uint32_t kListShareOfBudget = 2;

}  // namespace

Real Proxy::screened_least_m() const noexcept {
  return skin_m() - kBeneath * parameters_.scale.tolerance_m;
}

/// Work that is left of the budget, or of what is granted beyond it.
std::uint32_t Proxy::screen_budget(std::uint32_t granted, const ProxyTick& tick) const noexcept {
  const std::uint32_t units = tick.work.units();
  const std::uint64_t left = units < parameters_.work_units ? parameters_.work_units - units : 0;
  return static_cast<std::uint32_t>(
      std::clamp<std::uint64_t>(kScreenOfUnit * left, granted, UINT32_MAX / 2));
}

/// Counts the screen's work; what lies beyond the budget is taken from what is granted.
void Proxy::count_screened(std::uint32_t& granted, ProxyTick& tick) noexcept {
  const std::uint32_t work = near_.screen->take_work();
  const std::uint32_t budget = screen_budget(0, tick);
  if (work > budget) granted -= std::min(granted, work - budget);
  tick.work.screened += work;
}

/// Missed pairs get a slot each, and where they are to be reached in this pass a place among those;
/// false: there was none for one of them.
bool Proxy::take_missed(bool reach, ProxyTick& tick) noexcept {
  FacetScreen& screen = *near_.screen;
  bool all = true;
  for (const ScreenMiss& miss : screen.misses()) {
    const bool known = near_.list.has(miss.piece_a, miss.facet);
    const std::uint32_t slot = near_.list.add(miss.piece_a, miss.facet, miss.gap_m);
    if (slot == NearPairs::kNoSlot) {
      tick.crowded = true;
      all = false;
      if (!reach) screen.refuse(miss);
      continue;
    }
    screen.drop(miss);
    if (!known) {
      range_.list_path_m = part_.path_m;
      range_.list_turn_rad = part_.turn_rad;
      enter(slot);
    }
    if (reach)
      pass_.nearest_m = std::min(pass_.nearest_m, take_in(slot, miss.gap_m - skin_m(), tick));
  }
  return all;
}

/// After a move that no search has certified: planes that do not hold at p are replaced, and pairs
/// without one are the law's.
void Proxy::settle_screen(ProxyTick& tick) noexcept {
  FacetScreen& screen = *near_.screen;
  const FacetScreen::Way here{part_.pose, part_.pose, Vec3::Zero(),       Vec3::Zero(),
                              0,          0,          screened_least_m(), 0};
  if (!may_begin(kSweepGrant, tick)) return;
  screen.sweep(here);
  tick.work.screened += screen.take_work();
  for (;;) {
    const FacetScreen::Search end = screen.search(here, screen_budget(move_.granted_planes, tick));
    const bool all = take_missed(false, tick);
    count_screened(move_.granted_planes, tick);
    if (end == FacetScreen::Search::kSpent || (end == FacetScreen::Search::kDone && !all)) {
      move_.spent = move_.spent || end == FacetScreen::Search::kSpent;
      return;
    }
    if (end == FacetScreen::Search::kDone) break;
  }
  screen.accept(part_.pose, 0, 0);
  screen.settle();
}

/// Lists the facets that a step of this pass may meet.
void Proxy::renew_screen(ProxyTick& tick) noexcept {
  FacetScreen& screen = *near_.screen;
  if (!screen.is_settled()) settle_screen(tick);
  const Real radius_m = parameters_.radius_m;
  const Real asked_m = std::max(kRangeSteps * near_.tick_motion_m, kRangeReaches * pass_.reach_m);
  const Real range_m = std::clamp(asked_m, kRangeShare * radius_m, kMostRangeShare * radius_m);
  // A part that waits for its lists leaves nothing to the passes.
  const bool waits = !(screen.clear_m() > skin_m());
  const std::uint32_t work = screen_budget(0, tick) / (waits ? 1 : kListShareOfBudget);
  screen.renew(part_.pose, pass_.reach_m + 2 * skin_m(), range_m, screened_least_m(),
               std::max(work, move_.granted_lists), near_.list);
  tick.crowded = tick.crowded || (screen.is_full() && !(unlisted_m() > pass_.reach_m));
  static_cast<void>(take_missed(false, tick));
  count_screened(move_.granted_lists, tick);
}

/// What the screen says of a step, once those that the law has are certified; `goes_on`: the pairs
/// that were missed before are.
Proxy::Screened Proxy::screen_step(const Step& step, Real least_m, bool goes_on,
                                   ProxyTick& tick) noexcept {
  FacetScreen& screen = *near_.screen;
  const Real tolerance_m = parameters_.scale.tolerance_m;
  FacetScreen::Way way{part_.pose, step.q, step.dx_m, step.dtheta_rad};
  way.far_m = std::sqrt(step.dx_m.squaredNorm());
  way.turn_rad = std::sqrt(step.dtheta_rad.squaredNorm());
  way.least_m = skin_m() + std::max(least_m, -tolerance_m / 2) + kStepsRoom * tolerance_m;
  way.dip_m = tolerance_m / 2;
  if (!goes_on) {
    if (!may_begin(kSweepGrant, tick)) return Screened::kSpent;
    screen.sweep(way);
    tick.work.screened += screen.take_work();
  }
  const FacetScreen::Search end = screen.search(way, screen_budget(move_.granted_planes, tick));
  count_screened(move_.granted_planes, tick);
  const bool missed = !screen.misses().empty();
  if (!take_missed(true, tick)) {
    screen.forget_end();
    return Screened::kRefused;
  }
  if (end == FacetScreen::Search::kSpent) {
    screen.forget_end();
    return Screened::kSpent;
  }
  return missed || end == FacetScreen::Search::kMisses ? Screened::kMissed : Screened::kDone;
}

/// Pairs that hold nothing any more go back to the screen.
void Proxy::give_back(ProxyTick& tick) noexcept {
  FacetScreen& screen = *near_.screen;
  const Real least_m = skin_m() - kBackBeneath * parameters_.scale.tolerance_m;
  const std::uint32_t of_a = near_.scene[0].bodies()[0].piece_count;
  std::array<std::uint32_t, kMostBack> gone;
  std::uint32_t count = 0;
  for (const std::uint32_t slot : near_.list.slots()) {
    if ((slot + static_cast<std::uint32_t>(part_.version)) % kGivenBackShare != 0) continue;
    if (count == gone.size()) break;
    const ProxyPair& pair = near_.pairs[slot];
    const auto names = [&](const auto& list) {
      return std::any_of(list.begin(), list.end(),
                         [&](const auto& item) { return item.pair == slot; });
    };
    if (pair.inside || names(kept_.active) || names(kept_.pending) || names(program_.cones) ||
        names(slip_.last_cones)) {
      continue;
    }
    if (pair.gap_version == part_.version && pair.gap_m + skin_m() < least_m) continue;
    const PairRecord record = near_.scene[0].pair_record(pair.index);
    if (screen.take_back(record.piece_a, record.piece_b - of_a, part_.pose, least_m))
      gone[count++] = slot;
  }
  for (std::uint32_t k = 0; k < count; ++k) {
    forget(gone[k]);
    near_.list.remove(gone[k]);
  }
  tick.work.screened += screen.take_work();
}

}  // namespace haptic
