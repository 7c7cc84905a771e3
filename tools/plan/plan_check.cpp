// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/plan_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "rt_core/proxy/proxy_law.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::tools {
namespace {

/// A plan may state a tolerance larger than the core's by this share, for its own rounding.
constexpr double kToleranceShare = 1.01;
/// Stated and proved clearance may differ by this [m], as far as formats and rounding go.
constexpr double kClearanceRounding_m = 1.0e-12;

/// The rotation vector from one orientation to another, by the shorter way; W axes.
Wide3 turn_between(const PlanPose& from, const PlanPose& to) {
  const auto wide = [](const PlanPose& pose) {
    std::array<Wide, 4> q{};
    Wide square = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      q[k] = static_cast<Wide>(pose.q_wxyz[k]);
      square += q[k] * q[k];
    }
    for (Wide& x : q) x /= std::sqrt(square);
    return q;
  };
  const std::array<Wide, 4> p = wide(from), q = wide(to);
  // q p*.
  const Wide w = q[0] * p[0] + q[1] * p[1] + q[2] * p[2] + q[3] * p[3];
  const Wide3 v{q[1] * p[0] - q[0] * p[1] - q[2] * p[3] + q[3] * p[2],
                q[2] * p[0] - q[0] * p[2] - q[3] * p[1] + q[1] * p[3],
                q[3] * p[0] - q[0] * p[3] - q[1] * p[2] + q[2] * p[1]};
  const Wide sine = norm(v);
  if (!(sine > 0)) return {0, 0, 0};
  const Wide angle = 2 * std::atan2(sine, std::abs(w));
  return ((w < 0 ? -angle : angle) / sine) * v;
}

Wide3 unit_or_zero(const Wide3& v) {
  const Wide length = norm(v);
  return length > 0 ? (1 / length) * v : Wide3{0, 0, 0};
}

std::string pair_text(std::uint32_t a, std::uint32_t b) {
  return "pieces " + std::to_string(a) + " and " + std::to_string(b);
}

}  // namespace

PlanCheck::PlanCheck(const SceneView& scene) : scene_(scene) {
  moving_ = scene.bodies()[0].piece_count;
  for (std::uint32_t k = 0; k < scene.pieces().size(); ++k) {
    const PieceView view = scene.piece(k);
    Piece piece;
    piece.flat = is_flat(*view.record);
    if (k >= moving_) piece.reference = widen(scene.bodies()[view.record->body].reference_m);
    for (std::uint32_t v = 0; v < view.vertex_count; ++v) {
      const Real* const x = view.vertices + 3 * std::size_t{v};
      piece.vertices.push_back(
          {static_cast<Wide>(x[0]), static_cast<Wide>(x[1]), static_cast<Wide>(x[2])});
      piece.centre = piece.centre + piece.vertices.back();
      piece.reach_m = std::max(piece.reach_m, norm(piece.vertices.back()));
    }
    piece.centre = (Wide{1} / static_cast<Wide>(view.vertex_count)) * piece.centre;
    for (const Wide3& v : piece.vertices) {
      piece.radius_m = std::max(piece.radius_m, norm(v - piece.centre));
    }
    pieces_.push_back(std::move(piece));
  }
}

PlanCheck::Placed PlanCheck::placed(const PlanPose& pose) {
  const Wide w = static_cast<Wide>(pose.q_wxyz[0]), x = static_cast<Wide>(pose.q_wxyz[1]),
             y = static_cast<Wide>(pose.q_wxyz[2]), z = static_cast<Wide>(pose.q_wxyz[3]);
  const Wide s = 1 / (w * w + x * x + y * y + z * z);
  Placed at;
  at.x0 = widen(pose.x0_m);
  at.rows[0] = {(w * w + x * x - y * y - z * z) * s, 2 * (x * y - w * z) * s,
                2 * (x * z + w * y) * s};
  at.rows[1] = {2 * (x * y + w * z) * s, (w * w - x * x + y * y - z * z) * s,
                2 * (y * z - w * x) * s};
  at.rows[2] = {2 * (x * z - w * y) * s, 2 * (y * z + w * x) * s,
                (w * w - x * x - y * y + z * z) * s};
  return at;
}

Wide3 PlanCheck::turned(const Placed& at, const Wide3& v) {
  return {dot(at.rows[0], v), dot(at.rows[1], v), dot(at.rows[2], v)};
}

Wide3 PlanCheck::normal(const Placed& at, const PlanDirection& direction) {
  const Wide3 of_b = widen(direction.of_b);
  if (direction.kind == 'B') return unit_or_zero(of_b);
  const Wide3 of_a = turned(at, widen(direction.of_a));
  return unit_or_zero(direction.kind == 'A' ? of_a : cross(of_a, of_b));
}

/// n need not be unit: the least of n.(x + R a - b) over all vertices.
Wide PlanCheck::gap_m(const Placed& at, const Piece& a, const Piece& b, const Wide3& n) const {
  const Wide3 n_a = n[0] * at.rows[0] + n[1] * at.rows[1] + n[2] * at.rows[2];
  Wide low_a = std::numeric_limits<Wide>::infinity();
  for (const Wide3& v : a.vertices) low_a = std::min(low_a, dot(n_a, v));
  Wide high_b = -std::numeric_limits<Wide>::infinity();
  for (const Wide3& v : b.vertices) high_b = std::max(high_b, dot(n, v));
  return dot(n, at.x0 - b.reference) + low_a - high_b;
}

StepProof PlanCheck::step(const PlanPose& from, const PlanPose& to,
                          const std::vector<PlanWitness>& planes, double tolerance_m) const {
  const Placed p = placed(from), q = placed(to);
  const Wide3 turn = turn_between(from, to);
  const Wide3 dx = q.x0 - p.x0;
  const Wide angle = norm(turn), far = norm(dx);
  StepProof proof;
  proof.holds = true;
  proof.least_m = std::numeric_limits<Wide>::infinity();
  std::size_t next = 0;
  for (std::uint32_t i = 0; i < moving_; ++i) {
    const Piece& a = pieces_[i];
    const Wide3 at_p = p.x0 + turned(p, a.centre), at_q = q.x0 + turned(q, a.centre);
    // The centre of A's piece moves no farther than this on either half of the way.
    const Wide motion = (far + angle * norm(a.centre)) / 2;
    for (std::uint32_t j = moving_; j < pieces_.size(); ++j) {
      const Piece& b = pieces_[j];
      const bool given =
          next < planes.size() && planes[next].piece_a == i && planes[next].piece_b == j;
      const Wide3 from_p = at_p - b.reference - b.centre, from_q = at_q - b.reference - b.centre;
      const Wide near2 = std::min(dot(from_p, from_p), dot(from_q, from_q));
      const Wide reach = a.radius_m + b.radius_m + motion;
      // Farther apart than the least so far, and free: neither the one nor the other is asked.
      const Wide beyond = reach + std::max(proof.least_m, Wide{0});
      if (!given && near2 > beyond * beyond) continue;
      Wide least = std::sqrt(near2) - reach;
      if (given) {
        const PlanDirection& direction = planes[next].direction;
        const Wide3 n_p = normal(p, direction), n_q = normal(q, direction);
        next += 1;
        const Wide3 change = n_q - n_p;
        const Wide change2 = dot(change, change);
        const bool has_normals = dot(n_p, n_p) > 0 && dot(n_q, n_q) > 0;
        // A plane that turns by more than 60 degrees may have come round to the other side.
        if (has_normals && change2 < 1) {
          const Wide across = std::max(norm(cross(n_p, turn)), norm(cross(n_q, turn)));
          const Wide curvature =
              2 * (std::abs(dot(change, dx)) + std::sqrt(change2) * a.reach_m * angle) +
              a.reach_m * angle * across;
          const Wide g_p = gap_m(p, a, b, n_p), g_q = gap_m(q, a, b, n_q);
          Wide lowest = std::min(g_p, g_q);
          if (2 * std::abs(g_q - g_p) < curvature) {
            const Wide slope = g_q - g_p - curvature / 2;
            lowest = g_p - slope * slope / (2 * curvature);
          }
          // n(s) is no shorter than this, and no longer than 1.
          if (lowest < 0) lowest /= std::sqrt(1 - change2 / 4);
          least = std::max(least, lowest);
        }
      }
      const Wide needed = a.flat || b.flat ? Wide{0} : -static_cast<Wide>(tolerance_m);
      const bool free = a.flat || b.flat ? least > needed : least >= needed;
      if (least < proof.least_m || (!free && proof.holds)) {
        proof.least_m = least;
        proof.piece_a = i;
        proof.piece_b = j;
        proof.has_plane = given;
      }
      if (!free) {
        proof.holds = false;
        return proof;
      }
    }
  }
  // Planes of pairs that do not exist, or out of order.
  if (next != planes.size()) {
    proof.holds = false;
    proof.piece_a = planes[next].piece_a;
    proof.piece_b = planes[next].piece_b;
    proof.has_plane = true;
  }
  return proof;
}

StationProof PlanCheck::station(const PlanPose& pose, const std::vector<PlanWitness>* before,
                                const std::vector<PlanWitness>* after, double contact_m) const {
  const Placed at = placed(pose);
  struct Best {
    Wide gap_m;
    char kind;
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, Best> best;
  const auto look = [&](const std::vector<PlanWitness>* planes) {
    if (planes == nullptr) return;
    for (const PlanWitness& plane : *planes) {
      const bool exists =
          plane.piece_a < moving_ && plane.piece_b >= moving_ && plane.piece_b < pieces_.size();
      if (!exists) continue;
      const Wide3 n = normal(at, plane.direction);
      if (!(dot(n, n) > 0)) continue;
      const Wide gap = gap_m(at, pieces_[plane.piece_a], pieces_[plane.piece_b], n);
      const auto [found, is_new] =
          best.try_emplace({plane.piece_a, plane.piece_b}, Best{gap, plane.direction.kind});
      if (!is_new && gap > found->second.gap_m) found->second = {gap, plane.direction.kind};
    }
  };
  look(before);
  look(after);
  StationProof proof;
  proof.clearance_m = std::numeric_limits<Wide>::infinity();
  for (std::uint32_t i = 0; i < moving_; ++i) {
    const Piece& a = pieces_[i];
    const Wide3 centre = at.x0 + turned(at, a.centre);
    for (std::uint32_t j = moving_; j < pieces_.size(); ++j) {
      const Piece& b = pieces_[j];
      Wide gap = norm(centre - b.reference - b.centre) - a.radius_m - b.radius_m;
      // A plane matters where the spheres leave less than the least so far, or what counts as
      // contact.
      const auto found = gap < std::max(proof.clearance_m, static_cast<Wide>(contact_m))
                             ? best.find({i, j})
                             : best.end();
      if (found != best.end()) gap = std::max(gap, found->second.gap_m);
      proof.clearance_m = std::min(proof.clearance_m, gap);
      if (found != best.end() && gap < static_cast<Wide>(contact_m)) {
        proof.contacts.push_back({i, j, found->second.kind});
      }
    }
  }
  return proof;
}

double most_tolerance_m(const SceneView& scene) {
  return kToleranceShare * static_cast<double>(proxy_scale(scene).tolerance_m);
}

namespace {

/// The first statement of a station that its planes do not prove; empty: all are proved.
std::string failure_of_station(const PlanCheck& check, const Plan& plan, std::size_t number,
                               const std::vector<PlanWitness>* before,
                               const std::vector<PlanWitness>* after) {
  const PlanStation& station = plan.stations[number];
  const StationProof found = check.station(plan.poses[station.pose], before, after, plan.contact_m);
  const std::string name = "station " + std::to_string(number);
  const double proved = static_cast<double>(found.clearance_m);
  if (!(std::abs(station.clearance_m - proved) <= kClearanceRounding_m)) {
    return name + ": states a clearance of " + short_number(station.clearance_m, 9) +
           " m; proved are " + short_number(proved, 9) + " m";
  }
  if (station.contacts != found.contacts)
    return name + ": states other contacts than its planes have";
  return "";
}

}  // namespace

PlanProof prove_plan(const SceneView& scene, const Plan& plan, const std::string& file) {
  if (plan.geometry != geometry_hash(scene)) {
    throw InputError(file + ": is a plan of other geometry ('" + plan.scene +
                     "') than this scene's; make it again with host_sim plan");
  }
  const double most = most_tolerance_m(scene);
  if (plan.tolerance_m > most) {
    throw InputError(file + ": takes a depth of " + short_number(plan.tolerance_m, 4) +
                     " m for free, this scene at most " + short_number(most, 4) +
                     " m; make it again with host_sim plan");
  }
  const PlanCheck check(scene);
  PlanProof proof;
  proof.steps = plan.steps();
  proof.planes = plan.planes.size();
  for (const PlanPlane& plane : plan.planes) proof.runs += plane.runs.size();
  proof.pairs = std::uint64_t{scene.bodies()[0].piece_count} *
                (scene.pieces().size() - scene.bodies()[0].piece_count);
  Wide least = std::numeric_limits<Wide>::infinity();
  std::string station_failure;
  PlanSweep sweep(plan);
  std::vector<PlanWitness> before;
  std::size_t station = 0;
  for (std::size_t k = 0; k <= plan.steps(); ++k) {
    const std::vector<PlanWitness>* const after = k < plan.steps() ? &sweep.at(k) : nullptr;
    if (station < plan.stations.size() && plan.stations[station].pose == k) {
      if (station_failure.empty()) {
        station_failure =
            failure_of_station(check, plan, station, k > 0 ? &before : nullptr, after);
      }
      station += 1;
    }
    if (after == nullptr) break;
    const StepProof step = check.step(plan.poses[k], plan.poses[k + 1], *after, plan.tolerance_m);
    proof.kept_apart += after->size();
    before = *after;
    if (step.holds) {
      proof.certified += 1;
      least = std::min(least, step.least_m);
    } else if (proof.failure.empty()) {
      proof.failure = "step " + std::to_string(k) + ": " + pair_text(step.piece_a, step.piece_b) +
                      (step.has_plane ? " are not kept apart by their plane, which leaves "
                                      : " have no plane, and their spheres leave ") +
                      short_number(static_cast<double>(step.least_m), 6) + " m";
    }
  }
  if (plan.steps() == 0) {
    proof.failure = "the plan has no step";
  }
  if (proof.failure.empty()) proof.failure = station_failure;
  proof.least_m = static_cast<double>(least);
  return proof;
}

}  // namespace haptic::tools
