// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/convex_polygon.hpp"

#include <cmath>

namespace haptic {

void ConvexPolygon::add(const PlanePoint& point) noexcept {
  const auto corner = static_cast<std::uint16_t>(used_++);
  corners_[corner].point = point;
  link(corner == 0 ? corner : static_cast<std::uint16_t>(corner - 1), corner);
  link(corner, 0);
  at_ = 0;
}

/// The corner with the largest `beyond`. Round a convex polygon it rises to one top and falls, but
/// for rounding: a fall of less than `band` does not end the search.
template <typename Beyond>
ConvexPolygon::Reach ConvexPolygon::climb(const Beyond& beyond, std::uint16_t start,
                                          Real band) const noexcept {
  const Real at_start = beyond(corners_[start].point);
  Reach top{start, at_start};
  std::uint16_t at = corners_[start].next;
  for (std::uint32_t k = 0; k < used_ && at != start; ++k, at = corners_[at].next) {
    const Real b = beyond(corners_[at].point);
    if (b < top.beyond - band) break;
    if (b > top.beyond) top = {at, b};
  }
  if (top.beyond > at_start + band || at == start) return top;
  at = corners_[start].previous;
  for (std::uint32_t k = 0; k < used_ && at != start; ++k, at = corners_[at].previous) {
    const Real b = beyond(corners_[at].point);
    if (b < top.beyond - band) break;
    if (b > top.beyond) top = {at, b};
  }
  return top;
}

/// Goes on from `from`, which lies beyond the line, to the first corner that does not; `from`
/// itself when all do.
template <bool kForward, typename Beyond>
ConvexPolygon::Reach ConvexPolygon::first_kept(const Beyond& beyond, Reach from, Real band,
                                               Reach& last_removed) const noexcept {
  Reach removed = from;
  for (std::uint32_t k = 0; k < used_; ++k) {
    const Corner& corner = corners_[removed.corner];
    const std::uint16_t at = kForward ? corner.next : corner.previous;
    if (at == from.corner) break;
    const Real b = beyond(corners_[at].point);
    if (b <= band) {
      last_removed = removed;
      return {at, b};
    }
    removed = {at, b};
  }
  return from;
}

/// Where the side between a kept and a removed corner meets the line: a new corner, or the kept one
/// when it lies on the line already.
std::uint16_t ConvexPolygon::corner_on_line(const Reach& kept, const Reach& removed,
                                            Real band) noexcept {
  if (kept.beyond >= -band) return kept.corner;
  const PlanePoint in = corners_[kept.corner].point;
  const PlanePoint way = corners_[removed.corner].point - in;
  const Real share = kept.beyond / (kept.beyond - removed.beyond);  // both terms of one sign
  const auto corner = static_cast<std::uint16_t>(used_++);
  corners_[corner].point = {in.x + share * way.x, in.y + share * way.y};
  return corner;
}

bool ConvexPolygon::cut(const PlanePoint& from, const PlanePoint& to, Real band_m) noexcept {
  const PlanePoint side = to - from;
  // Distances are left multiplied by the length of the side, which the band takes on too; the sum
  // of its coordinates will do for that.
  const Real band = band_m * (std::abs(side.x) + std::abs(side.y));
  const auto beyond = [&](const PlanePoint& p) { return cross(p - from, side); };
  const Reach top = climb(beyond, at_, band);
  at_ = top.corner;
  if (!(top.beyond > band)) return true;
  Reach out_after{}, out_before{};
  const Reach after = first_kept<true>(beyond, top, band, out_after);
  if (after.corner == top.corner) return false;
  const Reach before = first_kept<false>(beyond, top, band, out_before);
  const std::uint16_t last = corner_on_line(before, out_before, band);
  const std::uint16_t first = corner_on_line(after, out_after, band);
  if (last != before.corner) link(before.corner, last);
  link(last, first);
  if (first != after.corner) link(first, after.corner);
  at_ = first;
  return true;
}

void ConvexPolygon::remove(std::uint16_t corner) noexcept {
  const Corner& gone = corners_[corner];
  at_ = gone.previous;
  link(gone.previous, gone.next);
}

}  // namespace haptic
