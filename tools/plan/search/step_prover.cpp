// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/search/step_prover.hpp"

#include <algorithm>
#include <limits>

namespace haptic::tools {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// Of the tolerance, what is left to the rounding of the check [share].
constexpr double kTolerated = 0.999;
/// Of a pair with a facet, the distance that has to be left for the same reason [m].
constexpr double kFacetRoom_m = 1.0e-12;
/// Edges with a smaller sine between them have no plane.
constexpr double kLeastSine = 1.5e-8;
/// A fixed piece larger than so many times the median is looked at always.
constexpr double kLarge = 4;
/// Pairs farther apart leave enough clearance, in radii of the part.
constexpr double kFarAway = 0.5;
/// Height by which a neighbour may rise over the plane of two edges and still be none.
constexpr double kLevel_m = 1.0e-9;
/// Work of a sphere that is looked at, of one that is near, and of a pair of pieces, each next to
/// that of a vertex: by the time that each takes.
constexpr std::uint64_t kSphereWork = 2, kNearWork = 12, kPairWork = 24;

Vec3d wide(const Real* x) {
  return {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])};
}

}  // namespace

double CorneredMotion::length_m(double turn_m) const {
  double sum = 0;
  for (std::size_t k = 1; k < corners.size(); ++k) {
    sum += step_length_m(corners[k - 1], corners[k], turn_m);
  }
  return sum;
}

StepProver::StepProver(const SceneView& scene, double tolerance_m)
    : limits_(scene.parameters().envelope),
      moving_(scene.bodies()[0].piece_count),
      tolerance_m_(kTolerated * tolerance_m) {
  for (std::uint32_t k = 0; k < scene.pieces().size(); ++k) {
    const PieceView view = scene.piece(k);
    Piece piece;
    piece.flat = is_flat(*view.record);
    if (k >= moving_) piece.reference = Vec3d(scene.bodies()[view.record->body].reference_m);
    for (std::uint32_t v = 0; v < view.vertex_count; ++v) {
      piece.vertices.push_back(wide(view.vertices + 3 * std::size_t{v}));
      piece.centre += piece.vertices.back();
      piece.reach_m = std::max(piece.reach_m, piece.vertices.back().norm());
    }
    piece.centre /= static_cast<double>(view.vertex_count);
    for (const Vec3d& v : piece.vertices) {
      piece.radius_m = std::max(piece.radius_m, (v - piece.centre).norm());
    }
    for (std::uint32_t p = 0; p < plane_count(*view.record); ++p) {
      piece.normals.push_back(view.plane_normal(p).cast<double>());
    }
    for (std::uint32_t e = 0; e < view.edge_count; ++e) {
      Edge edge;
      edge.v0 = view.edges[e].vertex[0];
      edge.v1 = view.edges[e].vertex[1];
      edge.apex[0] = view.edges[e].apex[0];
      edge.apex[1] = view.edges[e].apex[1];
      edge.unit = (piece.vertices[edge.v1] - piece.vertices[edge.v0]).normalized();
      piece.edges.push_back(edge);
    }
    if (k < moving_) reach_m_ = std::max(reach_m_, piece.reach_m);
    pieces_.push_back(std::move(piece));
  }
  sort_fixed_pieces();
}

void StepProver::sort_fixed_pieces() {
  std::vector<double> radii;
  Vec3d low = Vec3d::Constant(kInfinite), high = -low;
  for (std::uint32_t k = moving_; k < pieces_.size(); ++k) {
    radii.push_back(pieces_[k].radius_m);
    low = low.cwiseMin(pieces_[k].reference + pieces_[k].centre);
    high = high.cwiseMax(pieces_[k].reference + pieces_[k].centre);
  }
  if (radii.empty()) return;
  const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::ranges::nth_element(radii, middle);
  static_cast<void>((high - low).maxCoeff(&axis_));
  for (std::uint32_t k = moving_; k < pieces_.size(); ++k) {
    const Piece& piece = pieces_[k];
    if (piece.radius_m > kLarge * *middle) {
      large_.push_back(k);
      continue;
    }
    along_axis_.emplace_back((piece.reference + piece.centre)[axis_], k);
    largest_m_ = std::max(largest_m_, piece.radius_m);
  }
  std::ranges::sort(along_axis_);
}

void StepProver::find_near(const Vec3d& centre, double radius_m) {
  near_.clear();
  const auto look = [&](std::uint32_t k) {
    const Piece& b = pieces_[k];
    const double least = radius_m + b.radius_m;
    if ((centre - b.reference - b.centre).squaredNorm() <= least * least) near_.push_back(k);
  };
  const double most_m = radius_m + largest_m_, middle = centre[axis_];
  auto at = std::ranges::lower_bound(along_axis_, std::pair{middle - most_m, 0u});
  work_ += kNearWork + kSphereWork * large_.size();
  for (; at != along_axis_.end() && at->first <= middle + most_m; ++at) {
    work_ += kSphereWork;
    look(at->second);
  }
  for (const std::uint32_t k : large_) look(k);
  work_ += kNearWork * near_.size();
  std::ranges::sort(near_);
}

double StepProver::gap_m(const Placed& at, const Piece& a, const Piece& b, const Vec3d& n) {
  work_ += a.vertices.size() + b.vertices.size();
  const Vec3d n_a = at.r.transpose() * n;
  double low_a = kInfinite, high_b = -kInfinite;
  for (const Vec3d& v : a.vertices) low_a = std::min(low_a, n_a.dot(v));
  for (const Vec3d& v : b.vertices) high_b = std::max(high_b, n.dot(v));
  return n.dot(at.x0 - b.reference) + low_a - high_b;
}

/// Zero where two edges are too close to parallel.
Vec3d StepProver::normal_of(const Placed& at, const Piece& a, const Piece& b, const Plane& plane) {
  if (plane.kind == 'A') return at.r * -a.normals[plane.i];
  if (plane.kind == 'B') return b.normals[plane.j];
  const Vec3d m = (at.r * a.edges[plane.i].unit).cross(b.edges[plane.j].unit);
  const double sine = m.norm();
  if (sine < kLeastSine) return Vec3d::Zero();
  return m / (plane.flipped ? -sine : sine);
}

/// Lower bound of the distance on the way, of a plane with these normals and gaps at its ends.
double StepProver::bound_m(const Motion& motion, const Piece& a, const Piece& b, const Vec3d& n_p,
                           const Vec3d& n_q, double g_p, double g_q) {
  static_cast<void>(b);
  const Vec3d change = n_q - n_p;
  const double change2 = change.squaredNorm();
  if (!(change2 < 1)) return -kInfinite;
  const double across = std::max(n_p.cross(motion.turn).norm(), n_q.cross(motion.turn).norm());
  const double curvature =
      2 * (std::abs(change.dot(motion.dx)) + std::sqrt(change2) * a.reach_m * motion.angle) +
      a.reach_m * motion.angle * across;
  double lowest = std::min(g_p, g_q);
  if (2 * std::abs(g_q - g_p) < curvature) {
    const double slope = g_q - g_p - curvature / 2;
    lowest = g_p - slope * slope / (2 * curvature);
  }
  return lowest < 0 ? lowest / std::sqrt(1 - change2 / 4) : lowest;
}

/// Calls visit(plane, normal) for the planes of all faces and, where `edges_too`, of those pairs
/// of edges that make a C-face at this orientation; until it returns false.
template <typename Visit>
void StepProver::for_each_plane(const Placed& at, const Piece& a, const Piece& b, bool edges_too,
                                const Visit& visit) {
  for (std::uint32_t i = 0; i < a.normals.size(); ++i) {
    if (!visit(Plane{'A', i, 0, false}, Vec3d(at.r * -a.normals[i]))) return;
  }
  for (std::uint32_t j = 0; j < b.normals.size(); ++j) {
    if (!visit(Plane{'B', 0, j, false}, b.normals[j])) return;
  }
  if (!edges_too) return;
  for (std::uint32_t i = 0; i < a.edges.size(); ++i) {
    const Edge& e = a.edges[i];
    const Vec3d u = at.r * e.unit;
    const Vec3d rise_a[2] = {at.r * (a.vertices[e.apex[0]] - a.vertices[e.v0]),
                             at.r * (a.vertices[e.apex[1]] - a.vertices[e.v0])};
    work_ += b.edges.size();
    for (std::uint32_t j = 0; j < b.edges.size(); ++j) {
      const Edge& g = b.edges[j];
      const Vec3d m = u.cross(g.unit);
      const double sine = m.norm();
      if (sine < kLeastSine) continue;
      const Vec3d rise_b[2] = {b.vertices[g.apex[0]] - b.vertices[g.v0],
                               b.vertices[g.apex[1]] - b.vertices[g.v0]};
      for (const bool flipped : {false, true}) {
        const Vec3d n = m / (flipped ? -sine : sine);
        if (n.dot(rise_b[0]) > kLevel_m || n.dot(rise_b[1]) > kLevel_m) continue;
        if (n.dot(rise_a[0]) < -kLevel_m || n.dot(rise_a[1]) < -kLevel_m) continue;
        if (!visit(Plane{'C', i, j, flipped}, n)) return;
      }
    }
  }
}

PlanDirection StepProver::direction_of(const Piece& a, const Piece& b, const Plane& plane) {
  const auto numbers = [](const Vec3d& v) { return std::array{v.x(), v.y(), v.z()}; };
  PlanDirection direction;
  direction.kind = plane.kind;
  if (plane.kind == 'A') direction.of_a = numbers(-a.normals[plane.i]);
  if (plane.kind == 'B') direction.of_b = numbers(b.normals[plane.j]);
  if (plane.kind == 'C') {
    const Vec3d& along = a.edges[plane.i].unit;
    direction.of_a = numbers(plane.flipped ? -along : along);
    direction.of_b = numbers(b.edges[plane.j].unit);
  }
  return direction;
}

StepProver::Found StepProver::find_plane(const Motion& motion, std::uint32_t i, std::uint32_t j,
                                         ProofSearch search, const ClearEnds& ends,
                                         PlanWitness& witness) {
  const Piece& a = pieces_[i];
  const Piece& b = pieces_[j];
  const double needed = a.flat || b.flat ? kFacetRoom_m : -tolerance_m_;
  work_ += kPairWork;
  double best = -kInfinite, best_p = -kInfinite, best_q = -kInfinite;
  Plane best_plane;
  const auto look = [&](const Plane& plane, const Vec3d& n_p) {
    const double g_p = gap_m(motion.p, a, b, n_p);
    best_p = std::max(best_p, g_p);
    const Vec3d n_q = plane.kind == 'B' ? n_p : normal_of(motion.q, a, b, plane);
    if (n_q.isZero(0)) return true;
    const double g_q = gap_m(motion.q, a, b, n_q);
    best_q = std::max(best_q, g_q);
    if (g_p < needed || g_q < needed) return true;
    const double bound = bound_m(motion, a, b, n_p, n_q, g_p, g_q);
    if (bound <= best) return true;
    best = bound;
    best_plane = plane;
    return search != ProofSearch::kAny || bound < needed;
  };
  const auto proved = [&] {
    witness = {i, j, direction_of(a, b, best_plane)};
    return Found::kProved;
  };
  const std::uint64_t key = std::uint64_t{i} << 32 | j;
  if (const auto last = last_.find(key); last != last_.end()) {
    const Vec3d n_p = normal_of(motion.p, a, b, last->second);
    if (!n_p.isZero(0)) static_cast<void>(look(last->second, n_p));
    const bool keeps = search == ProofSearch::kKept && best >= std::max(needed, 0.0) &&
                       best_p >= ends.begin_m && best_q >= ends.end_m;
    if (keeps || (best >= needed && search == ProofSearch::kAny)) return proved();
  }
  for_each_plane(motion.p, a, b, false, look);
  if (best < needed) for_each_plane(motion.p, a, b, true, look);
  if (best >= needed) {
    last_[key] = best_plane;
    return proved();
  }
  if (best_q < needed) {
    // Planes of two edges at the end of the way may not have been C-faces at its begin.
    for_each_plane(motion.q, a, b, true, [&](const Plane&, const Vec3d& n) {
      best_q = std::max(best_q, gap_m(motion.q, a, b, n));
      return best_q < needed;
    });
  }
  return best_p < needed || best_q < needed ? Found::kMeets : Found::kTurnsTooFast;
}

StepProver::Found StepProver::try_step(const PlanPose& from, const PlanPose& to, ProofSearch search,
                                       const ClearEnds& ends, std::vector<PlanWitness>& planes) {
  Motion motion;
  motion.p = {place_of(from), turn_of(from).toRotationMatrix()};
  motion.q = {place_of(to), turn_of(to).toRotationMatrix()};
  motion.dx = motion.q.x0 - motion.p.x0;
  motion.turn = turn_between(from, to);
  motion.far = motion.dx.norm();
  motion.angle = motion.turn.norm();
  planes.clear();
  Found result = Found::kProved;
  for (std::uint32_t i = 0; i < moving_; ++i) {
    const Piece& a = pieces_[i];
    const Vec3d at_p = motion.p.x0 + motion.p.r * a.centre;
    const Vec3d at_q = motion.q.x0 + motion.q.r * a.centre;
    const double half_way = (motion.far + motion.angle * a.centre.norm()) / 2;
    find_near((at_p + at_q) / 2, a.radius_m + 2 * half_way + kLevel_m);
    for (const std::uint32_t j : near_) {
      const Piece& b = pieces_[j];
      const Vec3d centre_b = b.reference + b.centre;
      const double apart2 =
          std::min((at_p - centre_b).squaredNorm(), (at_q - centre_b).squaredNorm());
      const double least = a.radius_m + b.radius_m + half_way + kLevel_m;
      if (apart2 > least * least) continue;
      PlanWitness witness;
      const Found found = find_plane(motion, i, j, search, ends, witness);
      if (found == Found::kProved) {
        planes.push_back(witness);
        continue;
      }
      result = std::max(result, found);
      blocked_ = {i, j, from};
      if (result == Found::kMeets) return result;
    }
  }
  return result;
}

template <typename Take>
bool StepProver::prove_steps(const PlanPose& from, const PlanPose& to, int halvings,
                             ProofSearch search, const ClearEnds& clear, const Take& take) {
  if (!limits_.hold(from) || !limits_.hold(to) || !limits_.hold_between(from, to)) return false;
  // Depth first, from the start on; a stack of ends that are still to be reached.
  struct End {
    PlanPose to;
    int halvings;
  };
  std::vector<End> ends{{to, halvings}};
  PlanPose at = from;
  ClearEnds of_step;
  of_step.begin_m = clear.begin_m;
  std::vector<PlanWitness> planes;
  while (!ends.empty()) {
    const End end = ends.back();
    of_step.end_m = ends.size() == 1 ? clear.end_m : ClearEnds{}.end_m;
    const Found found = try_step(at, end.to, search, of_step, planes);
    if (found == Found::kProved) {
      take(end.to, planes);
      at = end.to;
      of_step.begin_m = ClearEnds{}.begin_m;
      ends.pop_back();
      continue;
    }
    // An end that is not free is not reached, also where nothing lies before it.
    if (found == Found::kMeets || end.halvings == 0) return false;
    ends.back().halvings -= 1;
    ends.push_back({between(at, end.to, 0.5), end.halvings - 1});
  }
  return true;
}

bool StepProver::prove(const PlanPose& from, const PlanPose& to, int halvings) {
  return prove_steps(from, to, halvings, ProofSearch::kAny, {},
                     [](const PlanPose&, const std::vector<PlanWitness>&) {});
}

bool StepProver::prove(const PlanPose& from, const PlanPose& to, int halvings, ProofSearch search,
                       ProvedMotion& motion, const ClearEnds& ends) {
  const std::size_t before = motion.poses.size();
  const auto append = [&](const PlanPose& pose, const std::vector<PlanWitness>& planes) {
    motion.poses.push_back(pose);
    motion.steps.push_back(planes);
  };
  const bool proved = prove_steps(from, to, halvings, search, ends, append);
  if (!proved) {
    motion.poses.resize(before);
    motion.steps.resize(before);
  }
  return proved;
}

bool StepProver::is_free(const PlanPose& pose) {
  if (!limits_.hold(pose)) return false;
  std::vector<PlanWitness> planes;
  return try_step(pose, pose, ProofSearch::kAny, {}, planes) == Found::kProved;
}

StepProver::Clearance StepProver::clearance(const PlanPose& pose) {
  const Placed at{place_of(pose), turn_of(pose).toRotationMatrix()};
  Clearance least;
  least.gap_m = kFarAway * reach_m_;
  for (std::uint32_t i = 0; i < moving_; ++i) {
    const Vec3d centre_a = at.x0 + at.r * pieces_[i].centre;
    find_near(centre_a, pieces_[i].radius_m + std::max(least.gap_m, 0.0));
    for (const std::uint32_t j : near_) {
      const Piece& a = pieces_[i];
      const Piece& b = pieces_[j];
      const double spheres = (centre_a - b.reference - b.centre).norm() - a.radius_m - b.radius_m;
      if (spheres > least.gap_m) continue;
      Clearance pair{spheres, Vec3d::Zero()};
      for_each_plane(at, a, b, false, [&](const Plane&, const Vec3d& n) {
        const double gap = gap_m(at, a, b, n);
        if (gap > pair.gap_m) pair = {gap, n};
        return true;
      });
      if (pair.gap_m < least.gap_m) least = pair;
    }
  }
  return least;
}

}  // namespace haptic::tools
