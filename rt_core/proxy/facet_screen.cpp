// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/facet_screen.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/proxy/screen_numbers.hpp"

namespace haptic {
namespace {

/// Missed pairs of one renewal, and lost and turned pairs of one sweep.
constexpr std::uint32_t kMostRenewed = 1024, kMostLost = 16384, kMostTurned = 4096;

}  // namespace

bool FacetScreen::serves(const SceneView& scene) noexcept {
  return scene.has_facets() && is_screened(scene.pieces(), scene.bodies()[0].piece_count);
}

void FacetScreen::place(Arena& arena, const SceneView& scene) noexcept {
  const std::uint32_t of_a = scene.bodies()[0].piece_count;
  const ScreenSize size = screen_size(scene.pieces(), of_a);
  const auto rows = static_cast<std::size_t>(size.rows);
  const auto facets = static_cast<std::uint32_t>(size.facets);
  const auto blocks = static_cast<std::size_t>(size.blocks());
  const std::size_t groups = (rows + kFloatLanes - 1) / kFloatLanes;
  rows_ = arena.take<Row>(rows);
  normal_a_ = arena.take<Vec3>(rows);
  row_begin_ = arena.take<std::uint32_t>(of_a + std::size_t{1});
  facets_ = arena.take<StaticFacet>(facets);
  corners_w_ = arena.take<Vec3>(static_cast<std::size_t>(size.corners));
  tree_.place(arena, facets);
  lever_m_ = arena.take<Group>(groups);
  slack_m_ = arena.take<Group>(groups);
  least_m_ = arena.take<Group>(groups);
  beyond_m_ = arena.take<Group>(groups);
  least_q_m_ = arena.take<Group>(groups);
  beyond_q_m_ = arena.take<Group>(groups);
  blocks_ = arena.take<ScreenBlock>(blocks);
  free_ = BoundedList<std::uint32_t>(arena.take<std::uint32_t>(blocks));
  found_ = arena.take<std::uint32_t>(facets);
  mark_ = arena.take<std::uint32_t>(facets);
  lost_ = BoundedList<Lost>(arena.take<Lost>(kMostLost));
  turned_ = BoundedList<Turned>(arena.take<Turned>(kMostTurned));
  misses_ = BoundedList<ScreenMiss>(arena.take<ScreenMiss>(kMostRenewed));
}

void FacetScreen::read_scene(const SceneView& scene) noexcept {
  const std::uint32_t of_a = scene.bodies()[0].piece_count;
  std::uint32_t rows = 0, corners = 0;
  for (std::uint32_t i = 0; i < scene.pieces().size(); ++i) {
    const PieceView view = scene.piece(i);
    const std::span<const std::uint16_t> loop = view.face_vertices(0);
    if (i < of_a) {
      row_begin_[i] = rows;
      for (std::uint32_t k = 2; k < view.vertex_count; ++k) {
        Row& row = rows_[rows];
        row = Row{};
        row.corner[0] = view.vertex(loop[0]);
        row.corner[1] = view.vertex(loop[k - 1]);
        row.corner[2] = view.vertex(loop[k]);
        row.piece = i;
        normal_a_[rows++] = view.plane_normal(0);
      }
      continue;
    }
    StaticFacet& facet = facets_[i - of_a];
    const BodyRecord& body = scene.bodies()[scene.pieces()[i].body];
    facet.normal = view.plane_normal(0);
    facet.begin = corners;
    facet.count = view.vertex_count;
    for (std::uint32_t k = 0; k < view.vertex_count; ++k) {
      Vec3 at = view.vertex(loop[k]);
      for (int x = 0; x < 3; ++x) at[x] += static_cast<Real>(body.reference_m[x]);
      corners_w_[corners++] = at;
    }
    facet.offset_m = facet.normal.dot(corners_w_[facet.begin]);
  }
  row_begin_[of_a] = rows;
  tree_.build(facets_, corners_w_);
  reset();
}

void FacetScreen::reset() noexcept {
  for (std::size_t k = 0; k < lever_m_.size(); ++k) {
    for (std::uint32_t lane = 0; lane < kFloatLanes; ++lane) {
      const std::size_t row = k * kFloatLanes + lane;
      const bool is_row = row < rows_.size();
      least_m_[k].x[lane] = beyond_m_[k].x[lane] = kNoGap;
      slack_m_[k].x[lane] = is_row ? -1.0f : kNoGap;
      Real lever2 = 0;
      for (int c = 0; c < 3 && is_row; ++c) {
        lever2 = std::max(lever2, rows_[row].corner[c].squaredNorm());
      }
      lever_m_[k].x[lane] = rounded_up(std::sqrt(lever2));
      lever_most_m_ = std::max(lever_most_m_, static_cast<Real>(lever_m_[k].x[lane]));
      if (is_row) rows_[row].near = rows_[row].far = kNoFacet;
    }
  }
  free_.clear();
  for (auto k = static_cast<std::uint32_t>(blocks_.size()); k > 0; --k) {
    static_cast<void>(free_.push(k - 1));
  }
  for (std::uint32_t& mark : mark_) mark = 0;
  stamp_ = 0;
  lost_.clear();
  misses_.clear();
  searched_ = work_ = 0;
  q_known_ = q_done_ = overflowed_ = false;
  settled_ = true;
  clear_m_ = -std::numeric_limits<Real>::max();
  nearest_m_ = 0;
  is_full_ = false;
  most_range_m_ = kLongest;
}

Vec3 FacetScreen::middle_of(const Placed& at) noexcept {
  return (at.corner_w[0] + at.corner_w[1] + at.corner_w[2]) / 3;
}

Real FacetScreen::radius_of(const Placed& at) noexcept {
  Real radius2 = 0;
  for (const Vec3& corner : at.corner_w) {
    radius2 = std::max(radius2, (corner - middle_of(at)).squaredNorm());
  }
  return std::sqrt(radius2);
}

FacetScreen::Placed FacetScreen::placed(const Row& row, const GripPose& p) const noexcept {
  return {{p.r_wa * row.corner[0] + p.x0_w, p.r_wa * row.corner[1] + p.x0_w,
           p.r_wa * row.corner[2] + p.x0_w}};
}

void FacetScreen::accept(const GripPose& q, Real far_m, Real turn_rad) noexcept {
  const bool same = q_done_ && q.x0_w == q_.x0_w && q.q_wa.coeffs() == q_.q_wa.coeffs();
  if (!same) settled_ = false;
  const FloatLanes far = lanes_above(far_m), turn = lanes_above(turn_rad), kept = all_lanes(kKept);
  if (same) {
    std::swap(least_m_, least_q_m_);
    std::swap(beyond_m_, beyond_q_m_);
    for (const Turned& turned : turned_) {
      write(blocks_[turned.block], turned.lane, rows_[turned.row], turned.facet, turned.normal_w);
      of(least_m_, turned.row) = need_m_;
    }
  }
  turned_.clear();
  FloatLanes nearest = all_lanes(kNoGap), clear = nearest;
  for (std::size_t k = 0; k < least_m_.size(); ++k) {
    const FloatLanes motion = turn * load_floats(lever_m_[k].x) + far;
    const FloatLanes slack = load_floats(slack_m_[k].x) * kept - motion;
    store_floats(slack, slack_m_[k].x);
    clear = smaller(clear, slack);
    if (!same) {
      store_floats(load_floats(least_m_[k].x) * kept - motion, least_m_[k].x);
      store_floats(load_floats(beyond_m_[k].x) * kept - motion, beyond_m_[k].x);
    }
    nearest = smaller(nearest, smaller(load_floats(least_m_[k].x), load_floats(beyond_m_[k].x)));
  }
  nearest_m_ = static_cast<Real>(least_lane(nearest));
  clear_m_ = static_cast<Real>(least_lane(clear));
  q_known_ = q_done_ = false;
}

}  // namespace haptic
