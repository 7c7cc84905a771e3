// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/search/way_out.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tools/plan/search/inside_surface.hpp"
#include "tools/plan/search/plan_making.hpp"
#include "tools/plan/search/translation_plan.hpp"

namespace haptic::tools {
namespace {

/// Beyond the balls about it and about the rest a part is clear with this much of its radius.
constexpr double kBeyond = 0.02;
/// Straight ways are proved in pieces: the first is so short, in radii, for most ways are blocked
/// at once; each is longer than the one before by this factor, up to the longest.
constexpr double kFirstPiece = 0.01, kLonger = 1.6, kLongestPiece = 0.5;
/// Halvings of a piece; and of a step of the way around the rest.
constexpr int kPieceHalvings = 5, kRoundHalvings = 8;
/// Directions nearer than this are one [rad, about]; so many are tried.
constexpr double kSameDirection = 1.0e-3;
constexpr std::size_t kMostDirections = 160;
/// Pieces of others nearer than this, in radii of the part, have faces that may lead it.
constexpr double kNear = 0.02;
/// The cells are asked where they are quick.
constexpr std::uint64_t kMostCellPairs = 200;
/// Turn of one step of a way around the rest [rad].
constexpr double kRoundTurn_rad = 0.4;
/// Rounds of settling.
constexpr int kSettleRounds = 60;

bool has_facets(const SceneView& scene) {
  return std::any_of(scene.pieces().begin(), scene.pieces().end(),
                     [](const PieceRecord& piece) { return is_flat(piece); });
}

}  // namespace

Ball ball_about(const SceneView& scene, const std::function<bool(std::size_t)>& counts) {
  Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  const auto each_vertex = [&](const auto& take) {
    for (std::uint32_t k = scene.bodies()[0].piece_count; k < scene.pieces().size(); ++k) {
      const PieceView piece = scene.piece(k);
      if (!counts(piece.record->body)) continue;
      const Vec3d at(scene.bodies()[piece.record->body].reference_m);
      for (std::uint32_t v = 0; v < piece.vertex_count; ++v)
        take(Vec3d(at + piece.vertex(v).cast<double>()));
    }
  };
  each_vertex([&](const Vec3d& x) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  });
  Ball ball;
  if (!(low.x() <= high.x())) return ball;
  ball.centre = (low + high) / 2;
  each_vertex(
      [&](const Vec3d& x) { ball.radius_m = std::max(ball.radius_m, (x - ball.centre).norm()); });
  return ball;
}

WayOut::WayOut(const SceneView& scene, const Ball& rest, std::uint64_t seed)
    : scene_(scene),
      rest_(rest),
      seed_(seed),
      part_(scene),
      prover_(scene, plan_tolerance_m(scene)) {}

std::optional<Vec3d> push_out(StepProver& prover, const PlanPose& pose, double beyond_m,
                              double& depth_m) {
  depth_m = 0;
  if (prover.is_free(pose)) return std::nullopt;
  const StepProver::Clearance least = prover.clearance(pose);
  depth_m = std::max(-least.gap_m, 0.0);
  return (depth_m + beyond_m) * least.normal_w;
}

std::optional<PlanPose> WayOut::settled(const PlanPose& pose, double most_m, double& depth_m) {
  PlanPose at = pose;
  for (int round = 0; round < kSettleRounds; ++round) {
    double overlap_m = 0;
    const std::optional<Vec3d> by = push_out(prover_, at, kSettleStep * most_m, overlap_m);
    if (round == 0) depth_m = overlap_m;
    if (!by) return enclosing_body(scene_, at) ? std::nullopt : std::optional(at);
    at = plan_pose(place_of(at) + *by, turn_of(at));
    if (by->isZero(0) || (place_of(at) - place_of(pose)).norm() > most_m) break;
  }
  return std::nullopt;
}

PlanPose WayOut::clear_pose(const PlanPose& from, const Vec3d& along) const {
  // Where the grip point leaves the ball of the rest, larger by the part.
  const double clear_m = rest_.radius_m + (1 + kBeyond) * part_.radius_m();
  const Vec3d x = place_of(from) - rest_.centre;
  const double b = x.dot(along), c = x.squaredNorm() - clear_m * clear_m;
  const double t = c > 0 && b > 0 ? 0.0 : -b + std::sqrt(std::max(b * b - c, 0.0));
  return plan_pose(place_of(from) + std::max(t, kBeyond * part_.radius_m()) * along, turn_of(from));
}

std::vector<Vec3d> WayOut::directions(const PlanPose& from) const {
  std::vector<Vec3d> all;
  const auto add = [&](const Vec3d& along) {
    if (all.size() + 2 > kMostDirections || !(along.norm() > 0.5)) return;
    const Vec3d unit = along.normalized();
    for (const Vec3d& known : all)
      if (unit.cross(known).norm() < kSameDirection) return;
    all.push_back(unit);
    all.push_back(-unit);
  };
  const Eigen::Matrix3d r = turn_of(from).toRotationMatrix();
  // Upwards first, and out of the rest.
  const Vec3d out = place_of(from) - rest_.centre;
  for (const int axis : {2, 0, 1})
    add((out[axis] < 0 && axis != 2 ? -1.0 : 1.0) * Vec3d::Unit(axis));
  for (int axis = 0; axis < 3; ++axis) add(r.col(axis));
  // Faces of others that the part touches, then its own.
  for (std::uint32_t i = 0; i < scene_.bodies()[0].piece_count; ++i) {
    const PieceRecord& a = scene_.pieces()[i];
    const Vec3d centre_a = place_of(from) + r * Vec3d(a.centre_m);
    for (std::uint32_t j = scene_.bodies()[0].piece_count; j < scene_.pieces().size(); ++j) {
      const PieceView b = scene_.piece(j);
      const Vec3d centre_b =
          Vec3d(scene_.bodies()[b.record->body].reference_m) + Vec3d(b.record->centre_m);
      const double least = a.radius_m + b.record->radius_m + kNear * part_.radius_m();
      if ((centre_a - centre_b).squaredNorm() > least * least) continue;
      for (std::uint32_t f = 0; f < b.face_count; ++f) add(b.face_normal(f).cast<double>());
      if (all.size() + 2 > kMostDirections / 2) break;
    }
  }
  for (std::uint32_t i = 0; i < scene_.bodies()[0].piece_count; ++i) {
    const PieceView a = scene_.piece(i);
    for (std::uint32_t f = 0; f < a.face_count; ++f) add(r * a.face_normal(f).cast<double>());
  }
  return all;
}

bool WayOut::prove_straight(const PlanPose& from, const PlanPose& to) {
  const double far_m = step_length_m(from, to, part_.radius_m());
  double piece = kFirstPiece * part_.radius_m();
  PlanPose at = from;
  for (double gone = 0; gone < far_m;) {
    gone = gone + piece < far_m ? gone + piece : far_m;
    const PlanPose next = gone < far_m ? between(from, to, gone / far_m) : to;
    if (!prover_.prove(at, next, kPieceHalvings)) return false;
    at = next;
    piece = std::min(kLonger * piece, kLongestPiece * part_.radius_m());
  }
  return true;
}

std::optional<OutWay> WayOut::straight(const PlanPose& from) {
  for (const Vec3d& along : directions(from)) {
    const PlanPose to = clear_pose(from, along);
    if (prove_straight(from, to)) return OutWay{{{from, to}}, WayKind::kStraight};
  }
  return std::nullopt;
}

std::optional<OutWay> WayOut::by_cells(const PlanPose& from, bool& impossible) {
  impossible = false;
  if (has_facets(scene_) || scene_.pair_count() > kMostCellPairs) return std::nullopt;
  const TranslationResult result =
      plan_translation(scene_, prover_, part_.mesh_pose(from), from,
                       clear_pose(from, Vec3d::UnitZ()), plan_tolerance_m(scene_));
  impossible = result.verdict == TranslationVerdict::kImpossible;
  if (result.verdict != TranslationVerdict::kFound) return std::nullopt;
  return OutWay{result.motion, WayKind::kCells};
}

std::optional<OutWay> WayOut::by_search(const PlanPose& from, std::uint32_t number,
                                        const SearchLimits& limits,
                                        const std::function<void(const SearchState&)>& progress) {
  Vec3d along = place_of(from) - rest_.centre;
  if (number % 7 == 0 && along.norm() > 1e-3 * part_.radius_m()) {
    along.normalize();
  } else {
    const std::uint32_t axis = (number + 6) % 7 % 6;  // z, -z, x, -x, y, -y
    along = (axis % 2 == 0 ? 1.0 : -1.0) * Vec3d::Unit(static_cast<int>(axis / 2 + 2) % 3);
  }
  const PlanPose to = clear_pose(from, along);
  if (!prover_.is_free(to)) return std::nullopt;
  const SearchResult result = search_plan(scene_, part_, prover_, to, from, limits, progress);
  held_by_ = result.goal_held;
  searched_ = result.state;
  if (!result.found) return std::nullopt;
  OutWay way{result.motion, WayKind::kSearch};
  std::reverse(way.motion.corners.begin(), way.motion.corners.end());
  return way;
}

bool WayOut::go_on(OutWay& way, const PlanPose& to) {
  const PlanPose from = way.motion.corners.back();
  if (from == to) return true;
  if (prove_straight(from, to)) {
    way.motion.corners.push_back(to);
    return true;
  }
  // Outwards, over a ball about the rest, and on to where it is to lie.
  const double round_m = 1.1 * (rest_.radius_m + (1 + kBeyond) * part_.radius_m());
  const auto direction_of = [&](const PlanPose& pose) {
    const Vec3d x = place_of(pose) - rest_.centre;
    return x.norm() > 0 ? Vec3d(x.normalized()) : Vec3d(Vec3d::UnitZ());
  };
  const Vec3d first = direction_of(from), last = direction_of(to);
  Vec3d axis = first.cross(last);
  if (axis.norm() < 1e-6) {
    axis = first.cross(std::abs(first.z()) < 0.9 ? Vec3d::UnitZ() : Vec3d::UnitX());
  }
  axis.normalize();
  const double angle = std::atan2(first.cross(last).norm(), first.dot(last));
  const int steps = 1 + static_cast<int>(angle / kRoundTurn_rad);
  CorneredMotion round = way.motion;
  const auto step = [&](const PlanPose& next) {
    if (round.corners.back() == next) return true;
    if (!prover_.prove(round.corners.back(), next, kRoundHalvings)) return false;
    round.corners.push_back(next);
    return true;
  };
  for (int k = 0; k <= steps; ++k) {
    const Vec3d along = exp_of(angle * k / steps * axis) * first;
    // It turns on the way, if at all.
    const PlanPose turned = between(from, to, static_cast<double>(k) / steps);
    if (!step(plan_pose(rest_.centre + round_m * along, turn_of(turned)))) return false;
  }
  if (!prove_straight(round.corners.back(), to)) return false;
  round.corners.push_back(to);
  way.motion = std::move(round);
  return true;
}

}  // namespace haptic::tools
