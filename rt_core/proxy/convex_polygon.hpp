// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A convex polygon that is cut down side by side: the intersection of two faces. Corners are a
/// ring, so a cut removes what lies beyond it and touches nothing else; successive cuts that turn
/// one way find the place of the next one where the last one was. A whole intersection thus costs
/// the sum of the two corner counts, not their product.

#include <cstdint>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/plane_point.hpp"

namespace haptic {

class ConvexPolygon {
 public:
  /// Room for polygons of `corners` corners cut `cuts` times; corners + 2 cuts < 65536.
  void place(Arena& arena, std::uint32_t corners, std::uint32_t cuts) noexcept {
    corners_ = arena.take<Corner>(corners + 2 * std::size_t{cuts});
  }

  /// Back to no corners.
  void clear() noexcept { used_ = 0; }
  /// Appends a corner, counter-clockwise; coincident and collinear ones are welcome.
  void add(const PlanePoint& point) noexcept;

  /// Keeps what lies left of the line from `from` to `to`; false: nothing does. Corners within
  /// about `band_m` of the line stay as they are. A new corner lies between two old ones, so no cut
  /// can lead outside the polygon. Cost: see above; never more than twice round the ring.
  [[nodiscard]] bool cut(const PlanePoint& from, const PlanePoint& to, Real band_m) noexcept;

  /// Takes a corner out. The ring must keep one.
  void remove(std::uint16_t corner) noexcept;

  /// A corner of the ring; the others follow by `next`. At least one must have been added.
  [[nodiscard]] std::uint16_t first() const noexcept { return at_; }
  [[nodiscard]] std::uint16_t next(std::uint16_t corner) const noexcept {
    return corners_[corner].next;
  }
  [[nodiscard]] const PlanePoint& point(std::uint16_t corner) const noexcept {
    return corners_[corner].point;
  }
  /// No ring has more corners than this.
  [[nodiscard]] std::uint32_t bound() const noexcept { return used_; }

 private:
  struct Corner {
    PlanePoint point;
    std::uint16_t next = 0, previous = 0;
  };
  struct Reach {
    std::uint16_t corner;
    Real beyond;
  };

  template <typename Beyond>
  [[nodiscard]] Reach climb(const Beyond& beyond, std::uint16_t start, Real band) const noexcept;
  template <bool kForward, typename Beyond>
  [[nodiscard]] Reach first_kept(const Beyond& beyond, Reach from, Real band,
                                 Reach& last_removed) const noexcept;
  [[nodiscard]] std::uint16_t corner_on_line(const Reach& kept, const Reach& removed,
                                             Real band) noexcept;
  void link(std::uint16_t from, std::uint16_t to) noexcept {
    corners_[from].next = to;
    corners_[to].previous = from;
  }

  std::span<Corner> corners_;
  std::uint32_t used_ = 0;
  std::uint16_t at_ = 0;  ///< where the last cut was
};

}  // namespace haptic
