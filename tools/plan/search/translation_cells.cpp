// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/search/translation_cells.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>

#include "tools/common/formatted.hpp"
#include "tools/plan/plan_limits.hpp"

namespace haptic::tools {
namespace {

/// A corner nearer to a plane than this lies in it [m].
constexpr double kOnPlane_m = kCellRounding_m / 8;
/// The box is larger than all that it holds by this share of its diagonal.
constexpr double kMargin = 0.1;
/// A box thinner than this has no cells [m].
constexpr double kLeastBox_m = 64 * kCellRounding_m;
/// Less area than this in common is none, in squares of rounding.
constexpr double kLeastArea_m2 = 64 * kCellRounding_m * kCellRounding_m;
/// Planes whose normals differ by less are parallel.
constexpr double kSameNormal = HAPTIC_REAL_IS_FLOAT ? 1.0e-5 : 1.0e-7;

void set_bounds(ConvexCell& cell) {
  cell.low.setConstant(std::numeric_limits<double>::infinity());
  cell.high = -cell.low;
  for (const CellSide& side : cell.sides) {
    for (const Vec3d& x : side.corners) {
      cell.low = cell.low.cwiseMin(x);
      cell.high = cell.high.cwiseMax(x);
    }
  }
}

bool boxes_touch(const ConvexCell& a, const ConvexCell& b) {
  const Vec3d slack = Vec3d::Constant(kCellRounding_m);
  return ((a.low - slack).array() <= b.high.array()).all() &&
         ((b.low - slack).array() <= a.high.array()).all();
}

Vec3d mean_of(std::span<const Vec3d> points) {
  Vec3d sum = Vec3d::Zero();
  for (const Vec3d& x : points) sum += x;
  return sum / static_cast<double>(points.size());
}

/// Distance of a corner from a plane, 0 where it lies in it.
double distance_m(const Vec3d& x, const Vec3d& normal, double offset_m) {
  const double d = normal.dot(x) - offset_m;
  return std::abs(d) <= kOnPlane_m ? 0.0 : d;
}

/// The part of a polygon with sign * (normal.x - offset) <= 0; corners in the plane go to
/// `in_plane` as well.
std::vector<Vec3d> part_of(std::span<const Vec3d> polygon, const Vec3d& normal, double offset_m,
                           double sign, std::vector<Vec3d>* in_plane) {
  std::vector<Vec3d> kept;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3d &from = polygon[k], &to = polygon[(k + 1) % polygon.size()];
    const double d = sign * distance_m(from, normal, offset_m);
    const double e = sign * distance_m(to, normal, offset_m);
    if (d <= 0) kept.push_back(from);
    if (d == 0 && in_plane != nullptr) in_plane->push_back(from);
    if (d * e >= 0) continue;
    kept.emplace_back(from + d / (d - e) * (to - from));
    if (in_plane != nullptr) in_plane->push_back(kept.back());
  }
  return kept;
}

ConvexCell half_of(const ConvexCell& cell, const Vec3d& normal, double offset_m, double sign) {
  ConvexCell half;
  std::vector<Vec3d> rim;
  for (const CellSide& side : cell.sides) {
    CellSide kept{side.normal, side.offset_m, part_of(side.corners, normal, offset_m, sign, &rim)};
    if (kept.corners.size() >= 3 && area_m2(kept.corners) > 0)
      half.sides.push_back(std::move(kept));
  }
  CellSide cap{sign * normal, sign * offset_m, planar_hull(rim, sign * normal)};
  if (cap.corners.size() >= 3) half.sides.push_back(std::move(cap));
  set_bounds(half);
  return half;
}

/// The part of one cell's side that lies in another cell, within rounding.
std::vector<Vec3d> side_within(const CellSide& side, const ConvexCell& other) {
  std::vector<Vec3d> rest = side.corners;
  for (const CellSide& plane : other.sides) {
    if (rest.empty()) break;
    rest = cut_polygon(rest, plane.normal, plane.offset_m + kCellRounding_m);
  }
  return rest;
}

Passage passage_between(const ConvexCell& a, const ConvexCell& b) {
  Passage best;
  for (const CellSide& side : a.sides) {
    // All of b beyond the side, or this side away from b.
    std::vector<Vec3d> common = side_within(side, b);
    if (common.empty()) continue;
    const double area = area_m2(common);
    if (!best.corners.empty() && area <= best.area_m2) continue;
    best.area_m2 = area;
    best.corners = std::move(common);
  }
  if (!best.corners.empty()) best.middle = mean_of(best.corners);
  return best;
}

/// Cuts the cells along the faces of one C-obstacle and leaves out what lies in it. A cell that
/// only its box brings near stays whole.
std::vector<ConvexCell> without(std::vector<ConvexCell> cells, std::span<const PlacedFace> faces,
                                const ConvexCell& obstacle, double tolerance_m) {
  std::vector<ConvexCell> left;
  for (ConvexCell& cell : cells) {
    std::vector<ConvexCell> parts;
    bool meets = boxes_touch(cell, obstacle);
    if (meets) {
      ConvexCell rest = cell;
      for (const PlacedFace& placed : faces) {
        CutCell halves = cut(rest, placed.face.normal, placed.face.offset_m - tolerance_m);
        if (!halves.above.sides.empty()) parts.push_back(std::move(halves.above));
        rest = std::move(halves.below);
        meets = !rest.sides.empty();
        if (!meets) break;
      }
    }
    if (!meets) {
      left.push_back(std::move(cell));
      continue;
    }
    for (ConvexCell& part : parts) left.push_back(std::move(part));
  }
  return left;
}

/// The polyhedron of the half spaces of a C-obstacle's faces. All of them hold it, so it is the
/// C-obstacle where its corners are corners of the faces; else a face is missing, and it is empty.
ConvexCell polyhedron_of(std::span<const PlacedFace> faces) {
  Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const PlacedFace& placed : faces) {
    for (const Vec3d& x : placed.face.polygon) {
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
  }
  const Vec3d margin = Vec3d::Constant(kMargin * (high - low).norm());
  ConvexCell cell = box_cell(low - margin, high + margin);
  for (const PlacedFace& placed : faces) {
    cell = cut(cell, placed.face.normal, placed.face.offset_m).below;
    if (cell.sides.empty()) return {};
  }
  for (const CellSide& side : cell.sides) {
    for (const Vec3d& x : side.corners) {
      const bool known = std::any_of(faces.begin(), faces.end(), [&](const PlacedFace& placed) {
        return std::any_of(placed.face.polygon.begin(), placed.face.polygon.end(),
                           [&](const Vec3d& y) { return (x - y).norm() <= kCellRounding_m; });
      });
      if (!known) return {};
    }
  }
  return cell;
}

}  // namespace

double ConvexCell::outside_m(const Vec3d& x) const {
  double most = -std::numeric_limits<double>::infinity();
  for (const CellSide& side : sides) most = std::max(most, side.normal.dot(x) - side.offset_m);
  return most;
}

double ConvexCell::volume_m3() const {
  const Vec3d within = centre();
  double sum = 0;
  for (const CellSide& side : sides) {
    sum += (side.offset_m - side.normal.dot(within)) * area_m2(side.corners) / 3;
  }
  return sum;
}

Vec3d ConvexCell::centre() const {
  Vec3d sum = Vec3d::Zero();
  double count = 0;
  for (const CellSide& side : sides) {
    for (const Vec3d& x : side.corners) sum += x;
    count += static_cast<double>(side.corners.size());
  }
  return sum / count;
}

ConvexCell box_cell(const Vec3d& low, const Vec3d& high) {
  ConvexCell cell;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      const int i = (axis + 1) % 3, j = (axis + 2) % 3;
      CellSide side;
      side.normal = sign * Vec3d::Unit(axis);
      side.offset_m = sign > 0 ? high[axis] : -low[axis];
      for (int k = 0; k < 4; ++k) {
        const int turn = sign > 0 ? k : 3 - k;
        Vec3d x;
        x[axis] = sign > 0 ? high[axis] : low[axis];
        x[i] = turn == 1 || turn == 2 ? high[i] : low[i];
        x[j] = turn >= 2 ? high[j] : low[j];
        side.corners.push_back(x);
      }
      cell.sides.push_back(std::move(side));
    }
  }
  cell.low = low;
  cell.high = high;
  return cell;
}

CutCell cut(const ConvexCell& cell, const Vec3d& normal, double offset_m) {
  bool below = false, above = false;
  for (const CellSide& side : cell.sides) {
    for (const Vec3d& x : side.corners) {
      const double d = distance_m(x, normal, offset_m);
      below = below || d < 0;
      above = above || d > 0;
    }
  }
  if (!above) return {cell, {}};
  if (!below) return {{}, cell};
  return {half_of(cell, normal, offset_m, 1), half_of(cell, normal, offset_m, -1)};
}

double area_m2(std::span<const Vec3d> polygon) {
  Vec3d sum = Vec3d::Zero();
  for (std::size_t k = 2; k < polygon.size(); ++k) {
    sum += (polygon[k - 1] - polygon[0]).cross(polygon[k] - polygon[0]);
  }
  return sum.norm() / 2;
}

std::vector<Vec3d> cut_polygon(std::span<const Vec3d> polygon, const Vec3d& normal,
                               double offset_m) {
  return part_of(polygon, normal, offset_m, 1, nullptr);
}

std::vector<std::vector<Passage>> passages_of(std::span<const ConvexCell> cells,
                                              double least_area_m2) {
  std::vector<std::vector<Passage>> passages(cells.size());
  std::vector<std::uint32_t> order(cells.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return cells[a].low[0] < cells[b].low[0] || (cells[a].low[0] == cells[b].low[0] && a < b);
  });
  // Those that begin before, and may reach so far.
  std::vector<std::uint32_t> open;
  for (const std::uint32_t i : order) {
    std::erase_if(open, [&](std::uint32_t j) {
      return cells[j].high[0] < cells[i].low[0] - kCellRounding_m;
    });
    for (const std::uint32_t j : open) {
      if (!boxes_touch(cells[i], cells[j])) continue;
      Passage passage = passage_between(cells[i], cells[j]);
      if (passage.corners.empty() || passage.area_m2 < least_area_m2) continue;
      passage.to = j;
      passages[i].push_back(passage);
      passage.to = i;
      passages[j].push_back(std::move(passage));
    }
    open.push_back(i);
  }
  for (std::vector<Passage>& list : passages) {
    std::sort(list.begin(), list.end(),
              [](const Passage& a, const Passage& b) { return a.to < b.to; });
  }
  return passages;
}

TranslationSpace make_translation_space(const SceneView& scene, const Pose& pose_wa,
                                        std::span<const Vec3d> places, double tolerance_m) {
  TranslationSpace space;
  space.tolerance_m = tolerance_m;
  for (const PieceRecord& piece : scene.pieces()) {
    if (is_flat(piece)) {
      space.undecided = "the scene has surfaces, whose facets have no volume";
      return space;
    }
  }
  if (scene.pair_count() > kMostPairs) {
    space.undecided = formatted("the scene has %llu pairs of pieces, more than %zu",
                                static_cast<unsigned long long>(scene.pair_count()), kMostPairs);
    return space;
  }
  std::vector<ConvexCell> obstacles;
  std::vector<std::size_t> first_face{0};
  Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (std::uint32_t pair = 0; pair < scene.pair_count(); ++pair) {
    if (scene.pair_record(pair).node_count > kMostPairNodes) {
      space.undecided = formatted("pair %u has %u basic contacts, more than %u", pair,
                                  scene.pair_record(pair).node_count, kMostPairNodes);
      return space;
    }
    for (CFace& face : make_c_obstacle(scene, pair, pose_wa).faces) {
      if (face.polygon.size() >= 3) space.faces.push_back({pair, std::move(face)});
    }
    const std::span<const PlacedFace> faces(
        space.faces.begin() + static_cast<std::ptrdiff_t>(first_face.back()), space.faces.end());
    obstacles.push_back(polyhedron_of(faces));
    if (obstacles.back().sides.empty()) {
      space.undecided = formatted("the C-faces of pair %u are not closed", pair);
      return space;
    }
    first_face.push_back(space.faces.size());
    low = low.cwiseMin(obstacles.back().low);
    high = high.cwiseMax(obstacles.back().high);
  }
  for (const Vec3d& x : places) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  const Vec3d margin = Vec3d::Constant(kMargin * (high - low).norm());
  low -= margin;
  high += margin;
  if (const PlanLimits limits(scene.parameters().envelope); limits.has_box()) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::max(low[axis], limits.low_m(axis));
      high[axis] = std::min(high[axis], limits.high_m(axis));
      if (high[axis] - low[axis] > kLeastBox_m) continue;
      space.undecided = formatted("[motion_limits] workspace leaves no room along %c",
                                  "xyz"[static_cast<std::size_t>(axis)]);
      return space;
    }
  }
  space.cells = {box_cell(low, high)};
  for (std::size_t k = 0; k < obstacles.size(); ++k) {
    const std::span<const PlacedFace> faces(space.faces.data() + first_face[k],
                                            first_face[k + 1] - first_face[k]);
    space.cells = without(std::move(space.cells), faces, obstacles[k], tolerance_m);
    if (space.cells.size() > kMostCells) {
      space.undecided = formatted("the C-faces make more than %zu cells", kMostCells);
      space.cells.clear();
      return space;
    }
  }
  space.passages = passages_of(space.cells, 0);
  return space;
}

std::vector<std::uint32_t> TranslationSpace::cells_at(const Vec3d& x) const {
  std::vector<std::uint32_t> found;
  for (std::uint32_t k = 0; k < cells.size(); ++k) {
    if (cells[k].outside_m(x) <= kCellRounding_m) found.push_back(k);
  }
  return found;
}

std::vector<bool> TranslationSpace::reached_from(std::span<const std::uint32_t> from) const {
  std::vector<bool> reached(cells.size(), false);
  std::vector<std::uint32_t> open(from.begin(), from.end());
  for (const std::uint32_t k : from) reached[k] = true;
  while (!open.empty()) {
    const std::uint32_t at = open.back();
    open.pop_back();
    for (const Passage& passage : passages[at]) {
      if (reached[passage.to]) continue;
      reached[passage.to] = true;
      open.push_back(passage.to);
    }
  }
  return reached;
}

CellWay way_through(const TranslationSpace& space, const Vec3d& from, const Vec3d& to) {
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  struct Reached {
    double way_m = std::numeric_limits<double>::infinity();
    Vec3d at = Vec3d::Zero();
    std::uint32_t before = kNone;
  };
  std::vector<Reached> reached(space.cells.size());
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  for (const std::uint32_t k : space.cells_at(from)) {
    reached[k] = {0, from, kNone};
    open.emplace(0.0, k);
  }
  std::vector<bool> is_goal(space.cells.size(), false);
  for (const std::uint32_t k : space.cells_at(to)) is_goal[k] = true;
  CellWay way;
  while (!open.empty()) {
    const auto [way_m, at] = open.top();
    open.pop();
    if (way_m > reached[at].way_m) continue;
    if (is_goal[at]) {
      way.places.push_back(to);
      for (std::uint32_t k = at; k != kNone; k = reached[k].before) {
        way.places.push_back(reached[k].at);
        way.cells.push_back(k);
      }
      std::reverse(way.places.begin(), way.places.end());
      std::reverse(way.cells.begin(), way.cells.end());
      return way;
    }
    for (const Passage& passage : space.passages[at]) {
      // The last leg counts where the goal is in the next cell.
      const double next_m = way_m + (passage.middle - reached[at].at).norm();
      if (!(next_m < reached[passage.to].way_m)) continue;
      reached[passage.to] = {next_m, passage.middle, at};
      open.emplace(next_m, passage.to);
    }
  }
  return way;
}

Enclosure enclosure_of(const TranslationSpace& space, const std::vector<bool>& cells) {
  Enclosure enclosure;
  enclosure.low.setConstant(std::numeric_limits<double>::infinity());
  enclosure.high = -enclosure.low;
  std::vector<double> areas(space.faces.size(), 0.0);
  for (std::size_t k = 0; k < space.cells.size(); ++k) {
    if (!cells[k]) continue;
    const ConvexCell& cell = space.cells[k];
    enclosure.cells += 1;
    enclosure.low = enclosure.low.cwiseMin(cell.low);
    enclosure.high = enclosure.high.cwiseMax(cell.high);
    for (const CellSide& side : cell.sides) {
      for (std::size_t f = 0; f < space.faces.size(); ++f) {
        const CFace& face = space.faces[f].face;
        if ((side.normal + face.normal).norm() > kSameNormal ||
            std::abs(side.offset_m + face.offset_m - space.tolerance_m) > kCellRounding_m) {
          continue;
        }
        // The part of the side in front of the C-face: within the planes across its edges.
        std::vector<Vec3d> rest = side.corners;
        for (std::size_t c = 0; c < face.polygon.size() && rest.size() >= 3; ++c) {
          const Vec3d& corner = face.polygon[c];
          const Vec3d out = (face.polygon[(c + 1) % face.polygon.size()] - corner)
                                .cross(face.normal)
                                .normalized();
          rest = cut_polygon(rest, out, out.dot(corner));
        }
        if (rest.size() >= 3) areas[f] += area_m2(rest);
      }
    }
  }
  for (std::size_t f = 0; f < space.faces.size(); ++f) {
    if (areas[f] <= kLeastArea_m2) continue;
    const PlacedFace& placed = space.faces[f];
    enclosure.faces.push_back(
        {placed.pair, placed.face.normal, placed.face.offset_m, areas[f], placed.face.nodes});
  }
  std::stable_sort(
      enclosure.faces.begin(), enclosure.faces.end(),
      [](const BlockingFace& a, const BlockingFace& b) { return a.area_m2 > b.area_m2; });
  return enclosure;
}

}  // namespace haptic::tools
