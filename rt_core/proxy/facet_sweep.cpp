// SPDX-License-Identifier: Apache-2.0
// Sweeps of the screen: a step judged by the planes of all lists, and other planes for what is
// lost.
#include <algorithm>
#include <bit>
#include <cmath>

#include "rt_core/proxy/facet_screen.hpp"
#include "rt_core/proxy/screen_numbers.hpp"

namespace haptic {
namespace {

/// Turns up to this are compared by the sine of half of them.
constexpr Real kSmallSine = 0.05_r, kOfSine = 2.002_r;
/// Missed pairs of one search.
constexpr std::uint32_t kMostMisses = 12;
/// So few lost pairs are searched in any order.
constexpr std::uint32_t kFewLost = 48;

}  // namespace

/// What the arcs of a row's corners ask for on top of the least gap.
Real FacetScreen::excess_m(std::uint32_t row, const Way& way) const noexcept {
  const Real lever_m = static_cast<Real>(lever_m_[row / kFloatLanes].x[row % kFloatLanes]);
  return std::max(lever_m * way.turn_rad * way.turn_rad / 8 - way.dip_m, Real{0});
}

/// Gaps of a row at q, and at p where that is given: those below `need_m` at either are lost.
void FacetScreen::sweep_row(std::uint32_t number, const GripPose& q, const GripPose* p,
                            float need_m) noexcept {
  struct alignas(16) Corners {
    float at[3][4] = {};
  };
  const Row& row = rows_[number];
  const auto corners_at = [&](const GripPose& pose) {
    Corners corners;
    const Placed at = placed(row, pose);
    for (int k = 0; k < 3; ++k) {
      for (int x = 0; x < 3; ++x) {
        corners.at[k][x] = static_cast<float>(at.corner_w[k][x] - row.origin_w[x]);
      }
    }
    return corners;
  };
  const Corners at_q = corners_at(q);
  const Corners at_p = p != nullptr ? corners_at(*p) : Corners{};
  const FloatLanes need = all_lanes(need_m + row.rounding_m);
  FloatLanes least = all_lanes(kNoGap);
  for (std::uint32_t k = row.near; k != kNoFacet; k = blocks_[k].next) {
    work_ += kBlockWork;
    FloatLanes gap = gaps(blocks_[k], at_q.at);
    least = smaller(least, gap);
    if (p != nullptr) gap = smaller(gap, gaps(blocks_[k], at_p.at));
    std::uint32_t bad = lanes_below(gap, need);
    if (bad == 0) continue;
    alignas(16) float each[kFloatLanes];
    store_floats(gap, each);
    for (; bad != 0; bad &= bad - 1) {
      const auto lane = static_cast<std::uint32_t>(std::countr_zero(bad));
      const float gap_m = each[lane] - row.rounding_m;
      worst_m_ = std::min(worst_m_, gap_m);
      if (!lost_.push({gap_m, number, k, lane})) overflowed_ = true;
    }
  }
  of(least_q_m_, number) = (least_lane(least) - row.rounding_m) * kKept;
}

void FacetScreen::sweep(const Way& way) noexcept {
  const GripPose& q = way.q;
  // What is known at another end that was swept before holds here but for the way between the two.
  Real apart_m = 0, apart_rad = 0;
  bool knows = q_known_;
  if (knows) {
    const Real sine = std::sqrt((q.q_wa * q_.q_wa.conjugate()).vec().squaredNorm());
    knows = sine < kSmallSine;
    apart_m = std::sqrt((q.x0_w - q_.x0_w).squaredNorm());
    apart_rad = kOfSine * (sine + 8 * kRealEpsilon);
  }
  lost_.clear();
  turned_.clear();
  misses_.clear();
  searched_ = 0;
  overflowed_ = false;
  const float need_m = rounded_up(way.least_m * kScreenRoundedUp);
  worst_m_ = need_m_ = need_m;
  const FloatLanes kept = all_lanes(kKept), zero = all_lanes(0.0f);
  const FloatLanes far = lanes_above(way.far_m), turn = lanes_above(way.turn_rad);
  const FloatLanes bend = lanes_above(way.turn_rad * way.turn_rad / 8);
  const FloatLanes dip = all_lanes(rounded_down(way.dip_m)), least = all_lanes(need_m);
  const FloatLanes apart = lanes_above(apart_m), apart_turn = lanes_above(apart_rad);
  const bool bends = lever_most_m_ * way.turn_rad * way.turn_rad / 8 > way.dip_m;
  for (std::size_t k = 0; k < least_m_.size(); ++k) {
    const FloatLanes lever = load_floats(lever_m_[k].x);
    const FloatLanes motion = turn * lever + far;
    const FloatLanes least_p = load_floats(least_m_[k].x), beyond_p = load_floats(beyond_m_[k].x);
    FloatLanes left = least_p * kept - motion, beyond = beyond_p * kept - motion;
    if (knows) {
      const FloatLanes between = apart_turn * lever + apart;
      left = larger(left, load_floats(least_q_m_[k].x) * kept - between);
      beyond = larger(beyond, load_floats(beyond_q_m_[k].x) * kept - between);
    }
    store_floats(left, least_q_m_[k].x);
    store_floats(beyond, beyond_q_m_[k].x);
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
    alignas(16) float need_of[kFloatLanes];
    store_floats(need, need_of);
    for (; due != 0; due &= due - 1) {
      const auto lane = static_cast<std::uint32_t>(std::countr_zero(due));
      const auto number = static_cast<std::uint32_t>(k) * kFloatLanes + lane;
      work_ += kSweptWork;
      if ((open >> lane & 1) != 0) {  // what was far may be near: all of it
        Row& row = rows_[number];
        std::uint32_t* end = &row.near;
        while (*end != kNoFacet) end = &blocks_[*end].next;
        *end = row.far;
        row.far = kNoFacet;
        of(least_m_, number) = std::min(of(least_m_, number), of(beyond_m_, number));
        of(beyond_m_, number) = of(beyond_q_m_, number) = kNoGap;
      }
      sweep_row(number, q, (bent >> lane & 1) != 0 ? &way.p : nullptr, need_of[lane]);
    }
  }
  q_ = q;
  q_known_ = true;
  q_done_ = false;
}

/// Moves those that lack up to a level, which rises in a few steps to what is needed, to the front
/// of those not searched yet: what lacks most comes first. @return where they end.
std::uint32_t FacetScreen::worst_lost(float need_m) noexcept {
  std::uint32_t end = lost_.size();
  if (!(end - searched_ > kFewLost && need_m - worst_m_ > 0.1f * need_m)) return end;
  const float level = worst_m_ + 0.25f * (need_m - worst_m_);
  end = searched_;
  float next_m = need_m;
  for (std::uint32_t k = searched_; k < lost_.size(); ++k) {
    if (lost_[k].gap_m <= level) {
      std::swap(lost_[k], lost_[end++]);
    } else {
      next_m = std::min(next_m, lost_[k].gap_m);
    }
  }
  worst_m_ = next_m;
  return end;
}

/// True if a plane, fixed or turning, certifies a lane on the way; `tried`: what was looked at.
bool FacetScreen::certify_lost(const Lost& lost, std::uint32_t facet, const LostRow& at,
                               const Way& way, Tried& tried) noexcept {
  const Row& row = rows_[lost.row];
  Between between{lost.row, facet, &way.p, nullptr, &at.at_p, nullptr, at.needed_m};
  if (at.is_move) {
    between.q = &way.q;
    between.at_q = &at.at_q;
  }
  Turned turned{lost.row, lost.block, lost.lane, facet, Vec3::Zero()};
  const Real lever_m = static_cast<Real>(of(lever_m_, lost.row));
  const auto turns = [&] {
    return at.is_move && turns_past(row, lever_m, way, tried, turned.normal_w) &&
           turned_.push(turned);
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
  write(blocks_[lost.block], lost.lane, row, facet, tried.best.normal_w);
  float& least = of(least_m_, lost.row);
  least = std::min(least, rounded_down(tried.best.gap_p_m - static_cast<Real>(row.rounding_m)));
  return true;
}

FacetScreen::Search FacetScreen::search(const Way& way, std::uint32_t most_work) noexcept {
  misses_.clear();
  const GripPose &p = way.p, &q = way.q;
  LostRow at;
  at.is_move = !(q.x0_w == p.x0_w && q.q_wa.coeffs() == p.q_wa.coeffs());
  const float need_m = rounded_up(way.least_m * kScreenRoundedUp);
  const std::uint32_t begin = work_;
  while (searched_ < lost_.size()) {
    for (const std::uint32_t end = worst_lost(need_m); searched_ < end; ++searched_) {
      const Lost& lost = lost_[searched_];
      const std::uint32_t facet = blocks_[lost.block].facet[lost.lane];
      if (facet == kNoFacet) continue;  // the law has it
      if (work_ - begin >= most_work) return Search::kSpent;
      const Row& row = rows_[lost.row];
      if (lost.row != at.row) {
        at.at_p = placed(row, p);
        at.at_q = placed(row, q);
        at.needed_m = way.least_m + excess_m(lost.row, way) + static_cast<Real>(row.rounding_m);
        at.row = lost.row;
      }
      Tried tried;
      if (certify_lost(lost, facet, at, way, tried)) continue;
      static_cast<void>(misses_.push(
          {lost.row, row.piece, facet, at.is_move ? way.least_m : tried.best.gap_p_m}));
      if (misses_.size() == kMostMisses) {
        ++searched_;
        return Search::kMisses;
      }
    }
  }
  if (overflowed_) return Search::kSpent;
  for (const Lost& lost : lost_) {
    float& least = of(least_q_m_, lost.row);
    least = std::max(least, need_m);
  }
  // Those that turn have their planes at q once p is there.
  for (const Turned& turned : turned_) of(least_q_m_, turned.row) = -kNoGap;
  q_done_ = true;
  return Search::kDone;
}

}  // namespace haptic
