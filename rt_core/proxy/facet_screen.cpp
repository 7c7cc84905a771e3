// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/facet_screen.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/base/wide_lanes.hpp"
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
  a_.shape = arena.take<Shape>(rows);
  a_.piece = arena.take<std::uint32_t>(rows);
  a_.first = arena.take<std::uint32_t>(of_a);
  a_.in_order = arena.take<std::uint32_t>(of_a);
  b_.facets = arena.take<StaticFacet>(facets);
  b_.corners_w = arena.take<Vec3>(static_cast<std::size_t>(size.corners));
  b_.number = arena.take<std::uint32_t>(facets);
  b_.tree.place(arena, facets);
  a_.lever_m = arena.take<Group>(groups);
  gaps_.slack_m = arena.take<Group>(groups);
  gaps_.least_m = arena.take<Group>(groups);
  gaps_.beyond_m = arena.take<Group>(groups);
  gaps_.least_q_m = arena.take<Group>(groups);
  gaps_.beyond_q_m = arena.take<Group>(groups);
  lists_.blocks = arena.take<ScreenBlock>(blocks);
  lists_.lanes = arena.take<ScreenLanes>(blocks);
  lists_.next = arena.take<std::uint32_t>(blocks);
  lists_.free = BoundedList<std::uint32_t>(arena.take<std::uint32_t>(blocks - rows));
  b_.found = arena.take<std::uint32_t>(facets);
  b_.mark = arena.take<std::uint32_t>(facets);
  lost_.due = BoundedList<Due>(arena.take<Due>(rows));
  lost_.pairs = BoundedList<Lost>(arena.take<Lost>(kMostLost));
  lost_.turned = BoundedList<Turned>(arena.take<Turned>(kMostTurned));
  lost_.misses = BoundedList<ScreenMiss>(arena.take<ScreenMiss>(kMostRenewed));
}

namespace {

/// In the plane of `normal`, off the edge between two corners: away from `middle`; zero for an edge
/// without length.
Vec3 off_edge(const Vec3& from, const Vec3& to, const Vec3& normal, const Vec3& middle) noexcept {
  const Vec3 across = (to - from).cross(normal);
  const Real length = std::sqrt(across.squaredNorm());
  if (!(length > 0)) return Vec3::Zero();
  const Vec3 outward = across / length;
  return outward.dot(middle - from) > 0 ? Vec3(-outward) : outward;
}

/// A place on a curve that fills the cube of the part, so that what follows each other is near.
std::uint64_t place_on_curve(const Vec3& at, const Vec3& low, Real side_m) noexcept {
  constexpr int kBits = 20;
  std::uint64_t place = 0;
  std::uint32_t cell[3];
  for (int x = 0; x < 3; ++x) {
    const Real share = side_m > 0 ? (at[x] - low[x]) / side_m : Real{0};
    cell[x] = static_cast<std::uint32_t>(std::clamp(share, 0.0_r, 1.0_r) * ((1 << kBits) - 1));
  }
  for (int bit = kBits - 1; bit >= 0; --bit) {
    for (const std::uint32_t of : cell) place = place << 1 | (of >> bit & 1u);
  }
  return place;
}

}  // namespace

/// Numbers the pieces of A so that those near each other follow each other.
void FacetScreen::order_pieces(const SceneView& scene) noexcept {
  const auto middle = [&](std::uint32_t piece) {
    const PieceView view = scene.piece(piece);
    return Vec3(view.vertex(0) + view.vertex(view.vertex_count / 2));
  };
  Vec3 low = middle(0), high = low;
  for (std::uint32_t i = 0; i < a_.in_order.size(); ++i) {
    a_.in_order[i] = i;
    low = low.cwiseMin(middle(i));
    high = high.cwiseMax(middle(i));
  }
  const Real side_m = (high - low).maxCoeff();
  const auto precedes = [&](std::uint32_t l, std::uint32_t r) {
    const std::uint64_t at_l = place_on_curve(middle(l), low, side_m),
                        at_r = place_on_curve(middle(r), low, side_m);
    return at_l < at_r || (at_l == at_r && l < r);
  };
  // A sort that does not call itself.
  std::make_heap(a_.in_order.begin(), a_.in_order.end(), precedes);
  std::sort_heap(a_.in_order.begin(), a_.in_order.end(), precedes);
}

/// The triangles of a piece of A, from this row on. @return how many.
std::uint32_t FacetScreen::read_triangles(const PieceView& view, std::uint32_t piece,
                                          std::uint32_t begin) noexcept {
  const std::span<const std::uint16_t> loop = view.face_vertices(0);
  a_.first[piece] = begin;
  std::uint32_t number = begin;
  for (std::uint32_t k = 2; k < view.vertex_count; ++k, ++number) {
    const Vec3 corner[3] = {view.vertex(loop[0]), view.vertex(loop[k - 1]), view.vertex(loop[k])};
    Row& row = a_.rows[number];
    row = Row{};
    for (int x = 0; x < 3; ++x) {
      for (int c = 0; c < 4; ++c) row.corner[x][c] = corner[std::min(c, 2)][x];
    }
    Shape& shape = a_.shape[number];
    shape.normal = view.plane_normal(0);
    const Vec3 middle = (corner[0] + corner[1] + corner[2]) / 3;
    for (int c = 0; c < 3; ++c) {
      shape.outward[c] = off_edge(corner[c], corner[(c + 1) % 3], shape.normal, middle);
    }
    a_.piece[number] = piece;
  }
  return number - begin;
}

/// A facet of the obstacles, its corners from this place on.
void FacetScreen::read_facet(const SceneView& scene, std::uint32_t piece, StaticFacet& facet,
                             std::uint32_t begin) noexcept {
  const PieceView view = scene.piece(piece);
  const std::span<const std::uint16_t> loop = view.face_vertices(0);
  const BodyRecord& body = scene.bodies()[scene.pieces()[piece].body];
  facet.normal = view.plane_normal(0);
  facet.begin = begin;
  facet.count = view.vertex_count;
  for (std::uint32_t k = 0; k < view.vertex_count; ++k) {
    Vec3 at = view.vertex(loop[k]);
    for (int x = 0; x < 3; ++x) at[x] += static_cast<Real>(body.reference_m[x]);
    b_.corners_w[begin + k] = at;
  }
  facet.offset_m = facet.normal.dot(b_.corners_w[begin]);
}

void FacetScreen::read_scene(const SceneView& scene) noexcept {
  const std::uint32_t of_a = scene.bodies()[0].piece_count;
  is_wide_ = has_wide_lanes();
  order_pieces(scene);
  std::uint32_t rows = 0;
  for (const std::uint32_t piece : a_.in_order)
    rows += read_triangles(scene.piece(piece), piece, rows);
  // As the scene has them for the tree, then as the tree numbers them.
  std::uint32_t corners = 0;
  for (std::uint32_t f = 0; f < b_.facets.size(); ++f) {
    read_facet(scene, of_a + f, b_.facets[f], corners);
    corners += b_.facets[f].count;
  }
  b_.tree.build(b_.facets, b_.corners_w);
  corners = 0;
  for (std::uint32_t f = 0; f < b_.facets.size(); ++f) {
    const std::uint32_t facet = b_.tree.order()[f];
    b_.number[facet] = f;
    read_facet(scene, of_a + facet, b_.facets[f], corners);
    corners += b_.facets[f].count;
  }
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
        const auto& corner = a_.rows[row].corner;
        lever2 = std::max(lever2, Vec3(corner[0][c], corner[1][c], corner[2][c]).squaredNorm());
      }
      a_.lever_m[k].x[lane] = rounded_up(std::sqrt(lever2));
      a_.lever_most_m = std::max(a_.lever_most_m, static_cast<Real>(a_.lever_m[k].x[lane]));
      if (is_row) a_.rows[row].far = kNoFacet;
    }
  }
  lists_.free.clear();
  for (auto k = static_cast<std::uint32_t>(lists_.blocks.size()); k > 0; --k) {
    clear_block(k - 1);
    if (k > a_.rows.size()) static_cast<void>(lists_.free.push(k - 1));
  }
  for (std::uint32_t& mark : b_.mark) mark = 0;
  b_.stamp = 0;
  lost_.pairs.clear();
  lost_.misses.clear();
  lost_.searched = lost_.left = work_ = 0;
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

FacetScreen::Placed FacetScreen::placed(const Row& row, const GripPose& p) noexcept {
  Placed at;
  for (int c = 0; c < 3; ++c) {
    at.corner_w[c] = p.r_wa * Vec3(row.corner[0][c], row.corner[1][c], row.corner[2][c]) + p.x0_w;
  }
  return at;
}

void FacetScreen::accept(const GripPose& q, Real far_m, Real turn_rad) noexcept {
  const bool same = end_.done && q.x0_w == end_.q.x0_w && q.q_wa.coeffs() == end_.q.q_wa.coeffs();
  if (!same) settled_ = false;
  const FloatLanes far = lanes_above(far_m), turn = lanes_above(turn_rad), kept = all_lanes(kKept);
  if (same) {
    std::swap(gaps_.least_m, gaps_.least_q_m);
    std::swap(gaps_.beyond_m, gaps_.beyond_q_m);
    for (const Turned& turned : lost_.turned) {
      write(turned.block, turned.lane,
            plane_lane(a_.rows[turned.row], turned.facet, turned.normal_w));
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
