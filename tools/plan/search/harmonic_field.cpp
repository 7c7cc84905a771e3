// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/search/harmonic_field.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace haptic::tools {
namespace {

/// Sides that have less in common have no passage, in squares of the pitch.
constexpr double kLeastPassage = 1.0e-9;
/// The solver ends when the residual has fallen to this share.
constexpr double kResidual = 1.0e-13;
/// The descent leaves a cell by a point that is not nearer to its edge than this share of the
/// distance to the middle of the passage.
constexpr double kOffEdge = 0.02;

double distance_m(const Vec3d& x, const Vec3d& from, const Vec3d& to) {
  const Vec3d along = to - from;
  const double square = along.squaredNorm();
  const double share = square > 0 ? std::clamp((x - from).dot(along) / square, 0.0, 1.0) : 0.0;
  return (from + share * along - x).norm();
}

double distance_m(const Vec3d& x, std::span<const Vec3d> corners) {
  double least = (x - corners.front()).norm();
  for (std::size_t k = 1; k < corners.size(); ++k) {
    least = std::min(least, distance_m(x, corners[k - 1], corners[k]));
  }
  return least;
}

/// The cell in parts, by planes that are `pitch_m` apart. `middle` lies half way between planes: a
/// start in the middle of its cell has a flow in every direction, of which the mean is the way
/// down.
std::vector<ConvexCell> diced(const ConvexCell& cell, const Vec3d& middle, double pitch_m) {
  std::vector<ConvexCell> parts{cell};
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<ConvexCell> finer;
    for (ConvexCell& part : parts) {
      const double first = middle[axis] + pitch_m / 2;
      double at = first + pitch_m * std::ceil((part.low[axis] - first) / pitch_m + 1e-9);
      for (; at < part.high[axis] - kCellRounding_m; at += pitch_m) {
        CutCell halves = cut(part, Vec3d::Unit(axis), at);
        if (!halves.below.sides.empty()) finer.push_back(std::move(halves.below));
        part = std::move(halves.above);
        if (part.sides.empty()) break;
      }
      if (!part.sides.empty()) finer.push_back(std::move(part));
    }
    parts = std::move(finer);
  }
  return parts;
}

/// The finer cells within `wide_m` of the motion.
std::vector<ConvexCell> channel_cells(const TranslationSpace& space, std::span<const Vec3d> corners,
                                      double pitch_m, double wide_m) {
  Vec3d low = corners.front(), high = low;
  for (const Vec3d& x : corners) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  const Vec3d room = Vec3d::Constant(wide_m + pitch_m);
  low -= room;
  high += room;
  std::vector<ConvexCell> cells;
  for (const ConvexCell& whole : space.cells) {
    ConvexCell cell = whole;
    for (int axis = 0; axis < 3 && !cell.sides.empty(); ++axis) {
      cell = cut(cell, Vec3d::Unit(axis), high[axis]).below;
      if (!cell.sides.empty()) cell = cut(cell, Vec3d::Unit(axis), low[axis]).above;
    }
    if (cell.sides.empty()) continue;
    for (ConvexCell& part : diced(cell, corners.front(), pitch_m)) {
      const Vec3d centre = part.centre();
      double reach = 0;
      for (const CellSide& side : part.sides) {
        for (const Vec3d& x : side.corners) reach = std::max(reach, (x - centre).norm());
      }
      if (distance_m(centre, corners) <= wide_m + reach) cells.push_back(std::move(part));
    }
  }
  return cells;
}

std::uint32_t cell_at(std::span<const ConvexCell> cells, const Vec3d& x) {
  std::uint32_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t k = 0; k < cells.size(); ++k) {
    const double outside = cells[k].outside_m(x);
    if (outside < least) {
      least = outside;
      best = k;
    }
  }
  if (!(least <= kCellRounding_m)) {
    throw std::runtime_error("an end of the channel lies in none of its cells");
  }
  return best;
}

/// Only the cells that are joined to one of them.
void keep_joined(HarmonicField& field, std::uint32_t cell) {
  TranslationSpace joined;
  joined.cells = std::move(field.cells);
  joined.passages = std::move(field.passages);
  const std::uint32_t from[] = {cell};
  const std::vector<bool> kept = joined.reached_from(from);
  std::vector<std::uint32_t> place(kept.size(), 0);
  field.cells.clear();
  for (std::uint32_t k = 0; k < kept.size(); ++k) {
    place[k] = static_cast<std::uint32_t>(field.cells.size());
    if (kept[k]) field.cells.push_back(std::move(joined.cells[k]));
  }
  field.passages.clear();
  for (std::uint32_t k = 0; k < kept.size(); ++k) {
    if (!kept[k]) continue;
    for (Passage& passage : joined.passages[k]) passage.to = place[passage.to];
    field.passages.push_back(std::move(joined.passages[k]));
  }
}

/// Laplace's equation over the cells, the flow through a passage being its area over the distance
/// of the middles times the difference of the values: conjugate gradients, scaled by the diagonal.
class FieldSolver {
 public:
  FieldSolver(HarmonicField& field, std::uint32_t most_rounds)
      : field_(field), most_rounds_(most_rounds) {
    for (const ConvexCell& cell : field.cells) centres_.push_back(cell.centre());
    conductance_.resize(field.cells.size());
    diagonal_.assign(field.cells.size(), 0.0);
    for (std::size_t k = 0; k < field.cells.size(); ++k) {
      for (const Passage& passage : field.passages[k]) {
        const double apart = (centres_[passage.to] - centres_[k]).norm();
        conductance_[k].push_back(passage.area_m2 / std::max(apart, kCellRounding_m));
        diagonal_[k] += conductance_[k].back();
      }
    }
  }

  void solve() {
    const std::size_t count = field_.cells.size();
    std::vector<double>& u = field_.value;
    u.assign(count, 0.5);
    u[field_.start_cell] = 1;
    u[field_.goal_cell] = 0;
    std::vector<double> r(count), z(count), p(count), ap(count);
    apply(u, r);
    for (std::size_t k = 0; k < count; ++k) r[k] = is_free(k) ? -r[k] : 0;
    const auto scale = [&] {
      for (std::size_t k = 0; k < count; ++k) z[k] = is_free(k) ? r[k] / diagonal_[k] : 0;
    };
    scale();
    p = z;
    double rz = dot(r, z);
    const double first = rz;
    for (; field_.rounds < most_rounds_ && rz > kResidual * kResidual * first; ++field_.rounds) {
      apply(p, ap);
      const double step = rz / dot(p, ap);
      for (std::size_t k = 0; k < count; ++k) {
        u[k] += step * p[k];
        r[k] -= is_free(k) ? step * ap[k] : 0;
      }
      scale();
      const double next = dot(r, z);
      for (std::size_t k = 0; k < count; ++k) p[k] = z[k] + next / rz * p[k];
      rz = next;
    }
    field_.residual = first > 0 ? std::sqrt(rz / first) : 0;
  }

  /// The mean flow in each cell: of the flows through its passages, each with its arm.
  void find_descent() {
    for (std::size_t k = 0; k < field_.cells.size(); ++k) {
      Vec3d flow = Vec3d::Zero();
      for (std::size_t j = 0; j < field_.passages[k].size(); ++j) {
        const Passage& passage = field_.passages[k][j];
        const double out = conductance_[k][j] * (field_.value[k] - field_.value[passage.to]);
        flow += out * (passage.middle - centres_[k]);
      }
      field_.descent.push_back(flow.norm() > 0 ? Vec3d(flow.normalized()) : Vec3d::Zero());
    }
  }

 private:
  [[nodiscard]] bool is_free(std::size_t k) const {
    return k != field_.start_cell && k != field_.goal_cell;
  }
  /// What flows out of each cell.
  void apply(const std::vector<double>& u, std::vector<double>& out) const {
    for (std::size_t k = 0; k < u.size(); ++k) {
      double sum = diagonal_[k] * u[k];
      for (std::size_t j = 0; j < conductance_[k].size(); ++j) {
        sum -= conductance_[k][j] * u[field_.passages[k][j].to];
      }
      out[k] = is_free(k) ? sum : 0;
    }
  }
  [[nodiscard]] static double dot(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
    return sum;
  }

  HarmonicField& field_;
  std::uint32_t most_rounds_;
  std::vector<Vec3d> centres_;
  std::vector<std::vector<double>> conductance_;  ///< as the passages
  std::vector<double> diagonal_;
};

/// Whether a point in the plane of a convex polygon lies in it.
bool is_in(std::span<const Vec3d> polygon, const Vec3d& normal, const Vec3d& x) {
  bool left = false, right = false;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3d along = polygon[(k + 1) % polygon.size()] - polygon[k];
    const double turn = along.cross(x - polygon[k]).dot(normal);
    left = left || turn > 0;
    right = right || turn < 0;
  }
  return !left || !right;
}

/// Where the flow from `x` leaves the cell, if that is by a passage to a lower cell; else the
/// middle of the passage with the most flow to one.
Vec3d way_out(const HarmonicField& field, std::uint32_t cell, const Vec3d& x, std::uint32_t& next) {
  const Vec3d& along = field.descent[cell];
  const CellSide* side = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const CellSide& other : field.cells[cell].sides) {
    const double speed = other.normal.dot(along);
    if (!(speed > 0)) continue;
    const double far = std::max(0.0, (other.offset_m - other.normal.dot(x)) / speed);
    if (far < least) {
      least = far;
      side = &other;
    }
  }
  const Passage* most = nullptr;
  double most_flow = 0;
  for (const Passage& passage : field.passages[cell]) {
    if (!(field.value[passage.to] < field.value[cell])) continue;
    const double flow = passage.area_m2 * (field.value[cell] - field.value[passage.to]);
    if (most == nullptr || flow > most_flow) {
      most = &passage;
      most_flow = flow;
    }
    if (side == nullptr) continue;
    const Vec3d hit = x + least * along;
    const Vec3d inner = hit + kOffEdge * (passage.middle - hit);
    if (std::abs(side->normal.dot(passage.middle) - side->offset_m) > 2 * kCellRounding_m ||
        !is_in(passage.corners, side->normal, inner)) {
      continue;
    }
    next = passage.to;
    return inner;
  }
  if (most == nullptr) throw std::runtime_error("the field has a least value besides the goal");
  next = most->to;
  return most->middle;
}

}  // namespace

HarmonicField make_harmonic_field(const TranslationSpace& space, std::span<const Vec3d> corners,
                                  const FieldLimits& limits) {
  HarmonicField field;
  double length = 0;
  for (std::size_t k = 1; k < corners.size(); ++k) length += (corners[k] - corners[k - 1]).norm();
  field.pitch_m = length / limits.cells_along;
  field.cells = channel_cells(space, corners, field.pitch_m, limits.wide * length);
  field.passages = passages_of(field.cells, kLeastPassage * field.pitch_m * field.pitch_m);
  keep_joined(field, cell_at(field.cells, corners.front()));
  field.start_cell = cell_at(field.cells, corners.front());
  field.goal_cell = cell_at(field.cells, corners.back());
  FieldSolver solver(field, limits.rounds);
  if (field.start_cell == field.goal_cell) {
    field.value.assign(field.cells.size(), 0.0);
  } else {
    solver.solve();
  }
  solver.find_descent();
  return field;
}

std::vector<Vec3d> descend(const HarmonicField& field, const Vec3d& start, const Vec3d& goal) {
  std::vector<Vec3d> way{start};
  // The values fall from cell to cell, so that none comes twice.
  for (std::uint32_t at = field.start_cell; at != field.goal_cell;) {
    std::uint32_t next = at;
    way.push_back(way_out(field, at, way.back(), next));
    at = next;
  }
  way.push_back(goal);
  return way;
}

HarmonicDescent descend_about(const TranslationSpace& space, const CorneredMotion& about) {
  std::vector<Vec3d> corners;
  for (const PlanPose& pose : about.corners) corners.push_back(place_of(pose));
  HarmonicDescent result;
  result.field = make_harmonic_field(space, corners);
  for (const Vec3d& x : descend(result.field, corners.front(), corners.back()))
    result.motion.corners.push_back(plan_pose(x, turn_of(about.corners.front())));
  return result;
}

}  // namespace haptic::tools
