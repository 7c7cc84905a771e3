// SPDX-License-Identifier: Apache-2.0
// Lists of the screen: which facets are near a triangle, and the blocks that hold them.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "rt_core/proxy/facet_screen.hpp"
#include "rt_core/proxy/near_pairs.hpp"
#include "rt_core/proxy/screen_numbers.hpp"

namespace haptic {
namespace {

/// Roundings of a gap, in those of the size of its row, and in those of its coordinates.
constexpr Real kGapRounding = 12 * 6.0e-8_r, kPlaceRounding = 8 * kRealEpsilon;
/// Facets beyond this share of the range are listed apart: they are seldom looked at.
constexpr Real kNearShare = 0.4_r;
/// A new facet keeps the face of the triangle where that leaves so many times the least gap.
constexpr Real kPlentyOfLeast = 4;
/// The slack of a row with facets in its lists counts up to so many ranges.
constexpr Real kMostSlack = 8;
/// A row is looked up again where its slack is less than this share of the range, or less than what
/// is needed; where blocks run short the range shrinks by the one factor, and grows by the other.
constexpr Real kNeedShare = 0.5_r, kFullShare = 0.6_r, kFullGrowth = 1.02_r;
/// Rows are renewed in the order of their slack, in these shares of what they need.
constexpr Real kLevels[] = {0.25_r, 0.5_r, 0.75_r, 1.0_r};

/// Directions outward from the edges of a triangle, in its plane.
struct Sides {
  Vec3 corner_w[3], outward_w[3];
};

Sides sides_of(const Vec3 (&corner_w)[3], const Vec3& normal_w) noexcept {
  Sides sides;
  const Vec3 middle_w = (corner_w[0] + corner_w[1] + corner_w[2]) / 3;
  for (int k = 0; k < 3; ++k) {
    const Vec3 across = (corner_w[(k + 1) % 3] - corner_w[k]).cross(normal_w);
    const Vec3 outward = across / std::sqrt(across.squaredNorm());
    sides.corner_w[k] = corner_w[k];
    sides.outward_w[k] = outward.dot(middle_w - corner_w[k]) > 0 ? Vec3(-outward) : outward;
  }
  return sides;
}

/// How far corners lie beside a triangle at least, as far as it takes to be more than `range_m`.
Real beside_m(const Sides& sides, std::span<const Vec3> corners_w, Real range_m) noexcept {
  Real most_m = 0;
  for (int k = 0; k < 3 && !(most_m > range_m); ++k) {
    Real least_m = std::numeric_limits<Real>::max();
    for (const Vec3& corner : corners_w) {
      least_m = std::min(least_m, sides.outward_w[k].dot(corner - sides.corner_w[k]));
    }
    most_m = std::max(most_m, least_m);
  }
  return most_m;
}

}  // namespace

void FacetScreen::clear_lane(ScreenBlock& block, std::uint32_t lane) const noexcept {
  for (auto& normal : block.normal) normal[lane] = 0;
  block.height_m[lane] = -1.0e9f;
  block.facet[lane] = kNoFacet;
}

/// The plane that touches the facet along this direction.
void FacetScreen::write(ScreenBlock& block, std::uint32_t lane, const Row& row, std::uint32_t facet,
                        const Vec3& normal_w) const noexcept {
  Vec3 rounded;
  for (int x = 0; x < 3; ++x) {
    block.normal[x][lane] = static_cast<float>(normal_w[x]);
    rounded[x] = static_cast<Real>(block.normal[x][lane]);
  }
  const StaticFacet& of = b_.facets[facet];
  Real height_m = -std::numeric_limits<Real>::max();
  for (std::uint32_t k = of.begin; k < of.begin + of.count; ++k) {
    height_m = std::max(height_m, rounded.dot(b_.corners_w[k] - row.origin_w));
  }
  block.height_m[lane] = rounded_up(height_m);
  block.facet[lane] = facet;
}

/// Puts a facet into a chain; false: there is no block left.
bool FacetScreen::append(const Row& row, Chain& chain, std::uint32_t facet, const Vec3& normal_w,
                         Real gap_m) noexcept {
  if (chain.used == kFloatLanes) {
    if (lists_.free.empty()) return false;
    const std::uint32_t id = lists_.free[lists_.free.size() - 1];
    lists_.free.truncate(lists_.free.size() - 1);
    for (std::uint32_t lane = 0; lane < kFloatLanes; ++lane) clear_lane(lists_.blocks[id], lane);
    lists_.blocks[id].next = *chain.first;
    *chain.first = id;
    chain.used = 0;
  }
  write(lists_.blocks[*chain.first], chain.used++, row, facet, normal_w);
  chain.least_m = std::min(chain.least_m, rounded_down(gap_m - static_cast<Real>(row.rounding_m)));
  return true;
}

void FacetScreen::drop(Row& row, std::uint32_t facet) noexcept {
  for (const std::uint32_t chain : {row.near, row.far}) {
    for (std::uint32_t k = chain; k != kNoFacet; k = lists_.blocks[k].next) {
      for (std::uint32_t lane = 0; lane < kFloatLanes; ++lane) {
        if (lists_.blocks[k].facet[lane] == facet) clear_lane(lists_.blocks[k], lane);
      }
    }
  }
}

void FacetScreen::refuse(const ScreenMiss& miss) noexcept {
  float& slack_m = of(gaps_.slack_m, miss.row);
  slack_m = std::min(slack_m, rounded_down(miss.gap_m));
  clear_m_ = std::min(clear_m_, static_cast<Real>(slack_m));
}

/// True if a row has left the place that its planes are measured from.
bool FacetScreen::is_far_from_origin(const Row& row, const Placed& at, Real range_m) noexcept {
  const Real far_m = radius_of(at) + range_m;
  return (middle_of(at) - row.origin_w).squaredNorm() > far_m * far_m;
}

/// What a gap of a row's blocks is rounded by, as long as its slack lasts.
void FacetScreen::set_rounding(std::uint32_t number, const Placed& at, Real range_m) noexcept {
  Row& row = a_.rows[number];
  const Real size_m = 2 * radius_of(at) + (kMostSlack + 1) * range_m;
  const Real place_m =
      std::sqrt(row.origin_w.squaredNorm()) + size_m + static_cast<Real>(of(a_.lever_m, number));
  row.rounding_m = rounded_up(kGapRounding * size_m + kPlaceRounding * place_m);
}

/// The facets of a row's blocks that are within range stay, with their planes, where these leave
/// the least gap.
void FacetScreen::keep_listed(std::uint32_t number, LookUp& look) noexcept {
  Row& row = a_.rows[number];
  alignas(16) float corner[3][4] = {};
  for (int k = 0; k < 3; ++k) {
    for (int x = 0; x < 3; ++x) {
      corner[k][x] = static_cast<float>(look.at.corner_w[k][x] - row.origin_w[x]);
    }
  }
  const std::uint32_t old[2] = {row.near, row.far};
  row.near = row.far = kNoFacet;
  for (const std::uint32_t chain : old) {
    for (std::uint32_t k = chain; k != kNoFacet;) {
      // A block that is given back is written to as soon as lanes of it are put into others.
      std::uint32_t facets[kFloatLanes];
      float normals[3][kFloatLanes];
      std::copy_n(lists_.blocks[k].facet, kFloatLanes, facets);
      for (int x = 0; x < 3; ++x) std::copy_n(lists_.blocks[k].normal[x], kFloatLanes, normals[x]);
      alignas(16) float gap_m[kFloatLanes];
      if (!look.moves) store_floats(gaps(lists_.blocks[k], corner), gap_m);
      static_cast<void>(lists_.free.push(k));
      k = lists_.blocks[k].next;
      for (std::uint32_t lane = 0; lane < kFloatLanes; ++lane) {
        const std::uint32_t facet = facets[lane];
        if (facet == kNoFacet || b_.mark[facet] != b_.stamp) continue;
        work_ += kKeptWork;
        const Vec3 normal_w(static_cast<Real>(normals[0][lane]),
                            static_cast<Real>(normals[1][lane]),
                            static_cast<Real>(normals[2][lane]));
        const Real gap =
            (look.moves ? gap_along(normal_w, look.at, facet) : static_cast<Real>(gap_m[lane])) -
            static_cast<Real>(row.rounding_m);
        if (gap < look.least_m) continue;  // it needs another plane
        b_.mark[facet] = b_.stamp + 1;
        if (gap > look.range_m) {
          look.others_m = std::min(look.others_m, gap);
        } else {
          put(row, look, facet, normal_w, gap);
        }
      }
    }
  }
}

/// What is within range and in no list yet.
void FacetScreen::add_found(std::uint32_t number, const GripPose& p, const NearPairs& taken,
                            LookUp& look) noexcept {
  Row& row = a_.rows[number];
  const Real rounding_m = static_cast<Real>(row.rounding_m);
  const Vec3 normal_a_w = p.r_wa * a_.normal[number];
  const Real offset_a_m = normal_a_w.dot(look.at.corner_w[0]);
  const Sides sides = sides_of(look.at.corner_w, normal_a_w);
  std::uint32_t fresh = 0;
  for (const std::uint32_t facet : b_.found.first(look.found)) {
    if (b_.mark[facet] != b_.stamp) continue;
    work_ += kNewWork;
    Real low_m = std::numeric_limits<Real>::max(), high_m = -low_m;
    for (const Vec3& corner : corners_of(facet)) {
      const Real height_m = normal_a_w.dot(corner) - offset_a_m;
      low_m = std::min(low_m, height_m);
      high_m = std::max(high_m, height_m);
    }
    const Real apart_m = std::max(low_m, -high_m) - rounding_m;
    const Real aside_m =
        apart_m > look.range_m
            ? apart_m
            : beside_m(sides, corners_of(facet), look.range_m + rounding_m) - rounding_m;
    if (aside_m > look.range_m) {
      look.others_m = std::min(look.others_m, aside_m);
      continue;
    }
    if (taken.has(row.piece, facet)) continue;
    if (fresh++ == kMostNewFacets) {  // the others wait for the next time
      look.others_m = std::min(look.others_m, Real{0});
      return;
    }
    if (apart_m >= kPlentyOfLeast * look.least_m) {
      put(row, look, facet, low_m > 0 ? Vec3(-normal_a_w) : normal_a_w, apart_m);
      continue;
    }
    Tried tried;
    Between between{number, facet};
    between.p = &p;
    between.at_p = &look.at;
    between.need_m = look.least_m + rounding_m;
    const bool has_plane = find_plane(between, tried) || find_closest(look.at, between, tried);
    const Real gap_m = tried.best.gap_p_m - rounding_m;
    if (has_plane) {
      put(row, look, facet, tried.best.normal_w, gap_m);
    } else if (!lost_.misses.push({number, row.piece, facet, gap_m})) {
      look.others_m = std::min(look.others_m, gap_m);
    }
  }
}

/// Finds the facets within range of a row; those that are listed keep their planes.
void FacetScreen::look_up(std::uint32_t number, const GripPose& p, Real range_m, Real least_m,
                          const NearPairs& taken) noexcept {
  Row& row = a_.rows[number];
  LookUp look;
  look.at = placed(row, p);
  look.range_m = range_m;
  look.least_m = least_m;
  const FacetTree::Found found = b_.tree.find(look.at.corner_w, range_m, b_.found);
  work_ += kRowWork + kNodeWork * found.visits;
  look.others_m = found.others_m;
  if (b_.stamp > UINT32_MAX - 2) {
    for (std::uint32_t& mark : b_.mark) mark = 0;
    b_.stamp = 0;
  }
  b_.stamp += 2;
  for (std::uint32_t k = 0; k < found.count; ++k) b_.mark[b_.found[k]] = b_.stamp;
  // Its origin stays while the triangle is about there, for planes are measured from it.
  look.moves = is_far_from_origin(row, look.at, range_m);
  if (look.moves) row.origin_w = middle_of(look.at);
  set_rounding(number, look.at, range_m);
  look.near.first = &row.near;
  look.far.first = &row.far;
  keep_listed(number, look);
  look.found = found.count;
  add_found(number, p, taken, look);
  if (row.near != kNoFacet || row.far != kNoFacet) {
    look.others_m = std::min(look.others_m, kMostSlack * range_m);
  }
  of(gaps_.least_m, number) = look.near.least_m;
  of(gaps_.beyond_m, number) = look.far.least_m;
  of(gaps_.slack_m, number) = rounded_down(std::min(look.others_m, kLongest));
}

/// Puts a facet into the list of its distance.
void FacetScreen::put(const Row& row, LookUp& look, std::uint32_t facet, const Vec3& normal_w,
                      Real gap_m) noexcept {
  Chain& chain = gap_m > kNearShare * look.range_m ? look.far : look.near;
  if (append(row, chain, facet, normal_w, gap_m)) return;
  look.others_m = std::min(look.others_m, gap_m);
  lists_.is_full = true;
}

/// Takes what is not near from all lists.
void FacetScreen::shed() noexcept {
  for (std::uint32_t number = 0; number < a_.rows.size(); ++number) {
    Row& row = a_.rows[number];
    if (row.far == kNoFacet) continue;
    for (std::uint32_t k = row.far; k != kNoFacet; k = lists_.blocks[k].next) {
      static_cast<void>(lists_.free.push(k));
      work_ += kBlockWork;
    }
    row.far = kNoFacet;
    float& slack_m = of(gaps_.slack_m, number);
    slack_m = std::min(slack_m, of(gaps_.beyond_m, number));
    clear_m_ = std::min(clear_m_, static_cast<Real>(slack_m));
    of(gaps_.beyond_m, number) = kNoGap;
  }
}

void FacetScreen::renew(const GripPose& p, Real need_m, Real range_m, Real least_m,
                        std::uint32_t most_work, const NearPairs& taken) noexcept {
  lost_.misses.clear();
  if (clear_m_ >= need_m) return;
  end_.known = end_.done = lists_.is_full = false;
  const std::uint32_t begin = work_;
  range_m = lists_.range_m = std::min(range_m, lists_.most_range_m);
  need_m = std::min(need_m, kNeedShare * range_m);
  for (const Real share : kLevels) {
    const FloatLanes level = all_lanes(static_cast<float>(share * need_m));
    for (std::size_t k = 0; k < gaps_.slack_m.size(); ++k) {
      std::uint32_t due = lanes_below(load_floats(gaps_.slack_m[k].x), level);
      for (; due != 0 && work_ - begin < most_work; due &= due - 1) {
        const auto lane = static_cast<std::uint32_t>(std::countr_zero(due));
        look_up(static_cast<std::uint32_t>(k) * kFloatLanes + lane, p, range_m, least_m, taken);
      }
    }
    if (work_ - begin >= most_work) break;
  }
  FloatLanes clear = all_lanes(kNoGap), nearest = clear;
  for (std::size_t k = 0; k < gaps_.slack_m.size(); ++k) {
    clear = smaller(clear, load_floats(gaps_.slack_m[k].x));
    nearest = smaller(nearest,
                      smaller(load_floats(gaps_.least_m[k].x), load_floats(gaps_.beyond_m[k].x)));
  }
  clear_m_ = static_cast<Real>(least_lane(clear));
  nearest_m_ = static_cast<Real>(least_lane(nearest));
  if (lists_.is_full) shed();
  // Where there are not blocks enough the lists are shorter for a while.
  lists_.most_range_m =
      lists_.is_full ? kFullShare * range_m : std::min(kFullGrowth * lists_.most_range_m, kLongest);
}

bool FacetScreen::take_back(std::uint32_t piece_a, std::uint32_t facet, const GripPose& p,
                            Real least_m) noexcept {
  const std::uint32_t begin = a_.row_begin[piece_a], end = a_.row_begin[piece_a + 1];
  const auto find = [&](std::uint32_t number, Tried& tried) {
    const Placed at = placed(a_.rows[number], p);
    Between between{number, facet};
    between.p = &p;
    between.at_p = &at;
    between.need_m = least_m + static_cast<Real>(a_.rows[number].rounding_m);
    return find_plane(between, tried) || find_closest(at, between, tried);
  };
  Tried tried;
  for (std::uint32_t number = begin; number < end; ++number) {
    tried = {};
    if (!find(number, tried)) return false;
  }
  for (std::uint32_t number = begin; number < end; ++number) {
    Row& row = a_.rows[number];
    if (end - begin > 1) {
      tried = {};
      static_cast<void>(find(number, tried));
    }
    const Plane& plane = tried.best;
    drop(row, facet);
    if (row.near == kNoFacet && row.far == kNoFacet) {
      const Placed at = placed(row, p);
      row.origin_w = middle_of(at);
      set_rounding(number, at, lists_.range_m);
      float& slack_m = of(gaps_.slack_m, number);
      slack_m = std::min(slack_m, rounded_down(kMostSlack * lists_.range_m));
    }
    Chain chain{&row.near};
    // A place that was left, or a block of its own.
    for (std::uint32_t k = row.near; k != kNoFacet && chain.used == kFloatLanes;
         k = lists_.blocks[k].next) {
      for (std::uint32_t lane = 0; lane < kFloatLanes; ++lane) {
        if (lists_.blocks[k].facet[lane] != kNoFacet) continue;
        write(lists_.blocks[k], lane, row, facet, plane.normal_w);
        chain.used = 0;
        break;
      }
    }
    if (chain.used == kFloatLanes && !append(row, chain, facet, plane.normal_w, plane.gap_p_m)) {
      refuse({number, piece_a, facet, plane.gap_p_m});
      continue;
    }
    float& least = of(gaps_.least_m, number);
    least = std::min(least, rounded_down(plane.gap_p_m - static_cast<Real>(row.rounding_m)));
  }
  end_.known = end_.done = false;
  return true;
}

}  // namespace haptic
