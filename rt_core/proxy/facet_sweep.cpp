// SPDX-License-Identifier: Apache-2.0
// Sweeps of the screen: a step judged by the planes of all lists, and other planes for what is
// lost.
#include <algorithm>
#include <bit>
#include <cmath>

#include "rt_core/proxy/facet_screen.hpp"
#include "rt_core/proxy/lane_kernels.hpp"
#include "rt_core/proxy/screen_numbers.hpp"

namespace haptic {
namespace {

/// Turns up to this are compared by the sine of half of them.
constexpr Real kSmallSine = 0.05_r, kOfSine = 2.002_r;
/// Missed pairs of one search.
constexpr std::uint32_t kMostMisses = 12;
/// Blocks of a row that are swept with it and not counted by themselves.
constexpr std::uint32_t kBlocksOfRow = 2;
/// So few lost pairs are searched in any order.
constexpr std::uint32_t kFewLost = 48;

}  // namespace

/// What the arcs of a row's corners ask for on top of the least gap.
Real FacetScreen::excess_m(std::uint32_t row, const Way& way) const noexcept {
  const Real lever_m = static_cast<Real>(a_.lever_m[row / kFloatLanes].x[row % kFloatLanes]);
  return std::max(lever_m * way.turn_rad * way.turn_rad / 8 - way.dip_m, Real{0});
}

/// Gaps of a row at q, and at p where that is asked for: those below what is needed at either are
/// lost.
void FacetScreen::sweep_row(const Due& due, const Way& way) noexcept {
  const RowSweep row{&a_.rows[due.row],
                     lists_.blocks.data(),
                     lists_.next.data(),
                     &way.q,
                     due.is_bent ? &way.p : nullptr,
                     due.row,
                     due.need_m};
  const RowSwept swept = LaneKernels{is_wide_}.sweep_row(row, lost_.pairs);
  work_ += kBlockWork * (std::max(swept.blocks, kBlocksOfRow) - kBlocksOfRow);
  lost_.worst_m = std::min(lost_.worst_m, swept.worst_m);
  lost_.overflowed = lost_.overflowed || swept.overflowed;
  of(gaps_.least_q_m, due.row) = (swept.least_m - row.row->rounding_m) * kKept;
}

void FacetScreen::sweep(const Way& way) noexcept {
  const GripPose& q = way.q;
  // What is known at another end that was swept before holds here but for the way between the two.
  Real apart_m = 0, apart_rad = 0;
  bool knows = end_.known;
  if (knows) {
    const Real sine = std::sqrt((q.q_wa * end_.q.q_wa.conjugate()).vec().squaredNorm());
    knows = sine < kSmallSine;
    apart_m = std::sqrt((q.x0_w - end_.q.x0_w).squaredNorm());
    apart_rad = kOfSine * (sine + 8 * kRealEpsilon);
  }
  lost_.due.clear();
  lost_.pairs.clear();
  lost_.turned.clear();
  lost_.misses.clear();
  lost_.searched = 0;
  lost_.overflowed = lost_.has_faces = false;
  const float need_m = rounded_up(way.least_m * kScreenRoundedUp);
  lost_.worst_m = lost_.need_m = need_m;
  const FloatLanes kept = all_lanes(kKept), zero = all_lanes(0.0f);
  const FloatLanes far = lanes_above(way.far_m), turn = lanes_above(way.turn_rad);
  const FloatLanes bend = lanes_above(way.turn_rad * way.turn_rad / 8);
  const FloatLanes dip = all_lanes(rounded_down(way.dip_m)), least = all_lanes(need_m);
  const FloatLanes apart = lanes_above(apart_m), apart_turn = lanes_above(apart_rad);
  const bool bends = a_.lever_most_m * way.turn_rad * way.turn_rad / 8 > way.dip_m;
  for (std::size_t k = 0; k < gaps_.least_m.size(); ++k) {
    const FloatLanes lever = load_floats(a_.lever_m[k].x);
    const FloatLanes motion = turn * lever + far;
    const FloatLanes least_p = load_floats(gaps_.least_m[k].x),
                     beyond_p = load_floats(gaps_.beyond_m[k].x);
    FloatLanes left = least_p * kept - motion, beyond = beyond_p * kept - motion;
    if (knows) {
      const FloatLanes between = apart_turn * lever + apart;
      left = larger(left, load_floats(gaps_.least_q_m[k].x) * kept - between);
      beyond = larger(beyond, load_floats(gaps_.beyond_q_m[k].x) * kept - between);
    }
    store_floats(left, gaps_.least_q_m[k].x);
    store_floats(beyond, gaps_.beyond_q_m[k].x);
    FloatLanes need = least;
    std::uint32_t bent = 0;
    if (bends) {
      need = least + larger(bend * lever - dip, zero);
      left = smaller(left, least_p);
      beyond = smaller(beyond, beyond_p);
      bent = lanes_below(least_p, need) | lanes_below(beyond_p, need);
    }
    const std::uint32_t open = lanes_below(beyond, need);
    std::uint32_t due = open | lanes_below(left, need);
    if (due == 0) continue;
    alignas(32) float need_of[kFloatLanes];
    store_floats(need, need_of);
    for (; due != 0; due &= due - 1) {
      const auto lane = static_cast<std::uint32_t>(std::countr_zero(due));
      const auto number = static_cast<std::uint32_t>(k) * kFloatLanes + lane;
      if ((open >> lane & 1) != 0) {  // what was far may be near: all of it
        Row& row = a_.rows[number];
        std::uint32_t end = number;
        while (lists_.next[end] != kNoFacet) end = lists_.next[end];
        lists_.next[end] = row.far;
        row.far = kNoFacet;
        of(gaps_.least_m, number) = std::min(of(gaps_.least_m, number), of(gaps_.beyond_m, number));
        of(gaps_.beyond_m, number) = of(gaps_.beyond_q_m, number) = kNoGap;
      }
      static_cast<void>(lost_.due.push({number, (bent >> lane & 1) != 0, need_of[lane]}));
    }
  }
  // Rows are fetched some time before they are judged.
  constexpr std::uint32_t kAhead = 4, kSoon = 2;
  for (std::uint32_t k = 0; k < lost_.due.size(); ++k) {
    if (k + kAhead < lost_.due.size()) {
      const std::uint32_t ahead = lost_.due[k + kAhead].row;
      __builtin_prefetch(&a_.rows[ahead]);
      __builtin_prefetch(&a_.rows[ahead].corner[2][0]);
      __builtin_prefetch(&lists_.blocks[ahead]);
      __builtin_prefetch(&lists_.blocks[ahead].normal[2][0]);
    }
    if (k + kSoon < lost_.due.size()) {
      const std::uint32_t second = lists_.next[lost_.due[k + kSoon].row];
      if (second != kNoFacet) {
        __builtin_prefetch(&lists_.blocks[second]);
        __builtin_prefetch(&lists_.blocks[second].normal[2][0]);
      }
    }
    work_ += kSweptWork;
    sweep_row(lost_.due[k], way);
  }
  end_.q = q;
  end_.known = true;
  end_.done = false;
}

/// Moves those that lack up to a level, which rises in a few steps to what is needed, to the front
/// of those not searched yet: what lacks most comes first. @return where they end.
std::uint32_t FacetScreen::worst_lost(float need_m) noexcept {
  std::uint32_t end = lost_.left;
  if (!(end - lost_.searched > kFewLost && need_m - lost_.worst_m > 0.1f * need_m)) return end;
  const float level = lost_.worst_m + 0.25f * (need_m - lost_.worst_m);
  end = lost_.searched;
  float next_m = need_m;
  for (std::uint32_t k = lost_.searched; k < lost_.left; ++k) {
    if (lost_.pairs[k].gap_m <= level) {
      std::swap(lost_.pairs[k], lost_.pairs[end++]);
    } else {
      next_m = std::min(next_m, lost_.pairs[k].gap_m);
    }
  }
  lost_.worst_m = next_m;
  return end;
}

/// Gives another plane to all that a face parts, and moves the others to the front; false: the work
/// did not do.
bool FacetScreen::search_faces(const Way& way, bool is_move, std::uint32_t most_work) noexcept {
  const std::uint32_t begin = work_;
  PlaneBatch batch{};
  for (std::uint32_t k = 0; k < lost_.pairs.size(); k += kFloatLanes) {
    if (work_ - begin >= most_work) return false;
    search_batch(batch, k, std::min(lost_.pairs.size() - k, kFloatLanes), way, is_move);
  }
  lost_.left = 0;
  for (std::uint32_t k = 0; k < lost_.pairs.size(); ++k) {
    if (!lost_.pairs[k].is_found) std::swap(lost_.pairs[k], lost_.pairs[lost_.left++]);
  }
  lost_.has_faces = true;
  return true;
}

/// True if a plane, fixed or turning, certifies a lane on the way; `tried`: what was looked at.
bool FacetScreen::certify_lost(const Lost& lost, std::uint32_t facet, const LostRow& at,
                               const Way& way, Tried& tried) noexcept {
  const Row& row = a_.rows[lost.row];
  Between between{lost.row, facet, &way.p, nullptr, &at.at_p, nullptr, at.needed_m};
  if (at.is_move) {
    between.q = &way.q;
    between.at_q = &at.at_q;
  }
  Turned turned{lost.row, lost.block, lost.lane, facet, Vec3::Zero()};
  const Real lever_m = static_cast<Real>(of(a_.lever_m, lost.row));
  const auto turns = [&] {
    return at.is_move && turns_past(row, lever_m, way, tried, turned.normal_w) &&
           lost_.turned.push(turned);
  };
  bool found = find_plane(between, tried);
  // The end first, for what holds there may hold on.
  if (!found && turns()) return true;
  if (!found && at.is_move) {
    found = find_closest(at.at_q, between, tried);
    if (!found && turns()) return true;
  }
  found = found || find_closest(at.at_p, between, tried);
  if (!found) return turns();
  write(lost.block, lost.lane, plane_lane(row, facet, tried.best.normal_w));
  float& least = of(gaps_.least_m, lost.row);
  least = std::min(least, rounded_down(tried.best.gap_p_m - static_cast<Real>(row.rounding_m)));
  return true;
}

FacetScreen::Search FacetScreen::search(const Way& way, std::uint32_t most_work) noexcept {
  const std::uint32_t begin = work_;
  lost_.misses.clear();
  const Search end = search_lost(way, most_work);
  const std::size_t sweep_work = kSweptWork * a_.rows.size() + kBlockWork * lists_.blocks.size();
  if (!lost_.overflowed || !lost_.has_faces || lost_.searched < lost_.left ||
      !lost_.misses.empty() || work_ - begin + sweep_work >= most_work) {
    return end;
  }
  // Those that have found planes have made room for the others.
  sweep(way);
  return search_lost(way, most_work - (work_ - begin));
}

FacetScreen::Search FacetScreen::search_lost(const Way& way, std::uint32_t most_work) noexcept {
  const GripPose &p = way.p, &q = way.q;
  LostRow at;
  at.is_move = !(q.x0_w == p.x0_w && q.q_wa.coeffs() == p.q_wa.coeffs());
  const float need_m = rounded_up(way.least_m * kScreenRoundedUp);
  const std::uint32_t begin = work_;
  if (!lost_.has_faces && !search_faces(way, at.is_move, most_work)) return Search::kSpent;
  while (lost_.searched < lost_.left) {
    for (const std::uint32_t end = worst_lost(need_m); lost_.searched < end; ++lost_.searched) {
      const Lost& lost = lost_.pairs[lost_.searched];
      const std::uint32_t facet = lists_.lanes[lost.block].facet[lost.lane];
      if (facet == kNoFacet) continue;  // the law has it
      if (work_ - begin >= most_work) return Search::kSpent;
      const Row& row = a_.rows[lost.row];
      if (lost.row != at.row) {
        at.at_p = placed(row, p);
        at.at_q = placed(row, q);
        at.needed_m = way.least_m + excess_m(lost.row, way) + static_cast<Real>(row.rounding_m);
        at.row = lost.row;
      }
      Tried tried;
      if (certify_lost(lost, facet, at, way, tried)) continue;
      static_cast<void>(lost_.misses.push({lost.row, a_.piece[lost.row], b_.tree.order()[facet],
                                           at.is_move ? way.least_m : tried.best.gap_p_m}));
      if (lost_.misses.size() == kMostMisses) {
        ++lost_.searched;
        return Search::kMisses;
      }
    }
  }
  if (lost_.overflowed) return Search::kSpent;
  for (const Lost& lost : lost_.pairs) {
    float& least = of(gaps_.least_q_m, lost.row);
    least = std::max(least, need_m);
  }
  // Those that turn have their planes at q once p is there.
  for (const Turned& turned : lost_.turned) of(gaps_.least_q_m, turned.row) = -kNoGap;
  end_.done = true;
  return Search::kDone;
}

}  // namespace haptic
