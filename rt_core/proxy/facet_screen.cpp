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
  a_.rows = arena.take<Row>(rows);
  a_.normal = arena.take<Vec3>(rows);
  a_.row_begin = arena.take<std::uint32_t>(of_a + std::size_t{1});
  b_.facets = arena.take<StaticFacet>(facets);
  b_.corners_w = arena.take<Vec3>(static_cast<std::size_t>(size.corners));
  b_.tree.place(arena, facets);
  a_.lever_m = arena.take<Group>(groups);
  gaps_.slack_m = arena.take<Group>(groups);
  gaps_.least_m = arena.take<Group>(groups);
  gaps_.beyond_m = arena.take<Group>(groups);
  gaps_.least_q_m = arena.take<Group>(groups);
  gaps_.beyond_q_m = arena.take<Group>(groups);
  lists_.blocks = arena.take<ScreenBlock>(blocks);
  lists_.free = BoundedList<std::uint32_t>(arena.take<std::uint32_t>(blocks));
  b_.found = arena.take<std::uint32_t>(facets);
  b_.mark = arena.take<std::uint32_t>(facets);
  lost_.pairs = BoundedList<Lost>(arena.take<Lost>(kMostLost));
  lost_.turned = BoundedList<Turned>(arena.take<Turned>(kMostTurned));
  lost_.misses = BoundedList<ScreenMiss>(arena.take<ScreenMiss>(kMostRenewed));
}

void FacetScreen::read_scene(const SceneView& scene) noexcept {
  const std::uint32_t of_a = scene.bodies()[0].piece_count;
  std::uint32_t rows = 0, corners = 0;
  for (std::uint32_t i = 0; i < scene.pieces().size(); ++i) {
    const PieceView view = scene.piece(i);
    const std::span<const std::uint16_t> loop = view.face_vertices(0);
    if (i < of_a) {
      a_.row_begin[i] = rows;
      for (std::uint32_t k = 2; k < view.vertex_count; ++k) {
        Row& row = a_.rows[rows];
        row = Row{};
        row.corner[0] = view.vertex(loop[0]);
        row.corner[1] = view.vertex(loop[k - 1]);
        row.corner[2] = view.vertex(loop[k]);
        row.piece = i;
        a_.normal[rows++] = view.plane_normal(0);
      }
      continue;
    }
    StaticFacet& facet = b_.facets[i - of_a];
    const BodyRecord& body = scene.bodies()[scene.pieces()[i].body];
    facet.normal = view.plane_normal(0);
    facet.begin = corners;
    facet.count = view.vertex_count;
    for (std::uint32_t k = 0; k < view.vertex_count; ++k) {
      Vec3 at = view.vertex(loop[k]);
      for (int x = 0; x < 3; ++x) at[x] += static_cast<Real>(body.reference_m[x]);
      b_.corners_w[corners++] = at;
    }
    facet.offset_m = facet.normal.dot(b_.corners_w[facet.begin]);
  }
  a_.row_begin[of_a] = rows;
  b_.tree.build(b_.facets, b_.corners_w);
  reset();
}

void FacetScreen::reset() noexcept {
  for (std::size_t k = 0; k < a_.lever_m.size(); ++k) {
    for (std::uint32_t lane = 0; lane < kFloatLanes; ++lane) {
      const std::size_t row = k * kFloatLanes + lane;
      const bool is_row = row < a_.rows.size();
      gaps_.least_m[k].x[lane] = gaps_.beyond_m[k].x[lane] = kNoGap;
      gaps_.slack_m[k].x[lane] = is_row ? -1.0f : kNoGap;
      Real lever2 = 0;
      for (int c = 0; c < 3 && is_row; ++c) {
        lever2 = std::max(lever2, a_.rows[row].corner[c].squaredNorm());
      }
      a_.lever_m[k].x[lane] = rounded_up(std::sqrt(lever2));
      a_.lever_most_m = std::max(a_.lever_most_m, static_cast<Real>(a_.lever_m[k].x[lane]));
      if (is_row) a_.rows[row].near = a_.rows[row].far = kNoFacet;
    }
  }
  lists_.free.clear();
  for (auto k = static_cast<std::uint32_t>(lists_.blocks.size()); k > 0; --k) {
    static_cast<void>(lists_.free.push(k - 1));
  }
  for (std::uint32_t& mark : b_.mark) mark = 0;
  b_.stamp = 0;
  lost_.pairs.clear();
  lost_.misses.clear();
  lost_.searched = work_ = 0;
  end_.known = end_.done = lost_.overflowed = false;
  settled_ = true;
  clear_m_ = -std::numeric_limits<Real>::max();
  nearest_m_ = 0;
  lists_.is_full = false;
  lists_.most_range_m = kLongest;
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
  const bool same = end_.done && q.x0_w == end_.q.x0_w && q.q_wa.coeffs() == end_.q.q_wa.coeffs();
  if (!same) settled_ = false;
  const FloatLanes far = lanes_above(far_m), turn = lanes_above(turn_rad), kept = all_lanes(kKept);
  if (same) {
    std::swap(gaps_.least_m, gaps_.least_q_m);
    std::swap(gaps_.beyond_m, gaps_.beyond_q_m);
    for (const Turned& turned : lost_.turned) {
      write(lists_.blocks[turned.block], turned.lane, a_.rows[turned.row], turned.facet,
            turned.normal_w);
      of(gaps_.least_m, turned.row) = lost_.need_m;
    }
  }
  lost_.turned.clear();
  FloatLanes nearest = all_lanes(kNoGap), clear = nearest;
  for (std::size_t k = 0; k < gaps_.least_m.size(); ++k) {
    const FloatLanes motion = turn * load_floats(a_.lever_m[k].x) + far;
    const FloatLanes slack = load_floats(gaps_.slack_m[k].x) * kept - motion;
    store_floats(slack, gaps_.slack_m[k].x);
    clear = smaller(clear, slack);
    if (!same) {
      store_floats(load_floats(gaps_.least_m[k].x) * kept - motion, gaps_.least_m[k].x);
      store_floats(load_floats(gaps_.beyond_m[k].x) * kept - motion, gaps_.beyond_m[k].x);
    }
    nearest = smaller(nearest,
                      smaller(load_floats(gaps_.least_m[k].x), load_floats(gaps_.beyond_m[k].x)));
  }
  nearest_m_ = static_cast<Real>(least_lane(nearest));
  clear_m_ = static_cast<Real>(least_lane(clear));
  end_.known = end_.done = false;
}

}  // namespace haptic
