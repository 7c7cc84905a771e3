// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/search/plan_shortening.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <unordered_map>

#include "tools/common/split_mix.hpp"
#include "tools/plan/search/way_cost.hpp"
#include "tools/plan/search/wide_way.hpp"

namespace haptic::tools {
namespace {

/// A straight way may be cut in halves this often for its proof.
constexpr int kStraightHalvings = 12;
/// A straight way replaces another one when it is shorter by this share.
constexpr double kShorter = 0.999;
/// How far a corner is moved at once, in lengths of a turn of 1 rad, and how often all are tried.
constexpr double kCornerMoves[] = {0.1, 0.03, 0.01, 0.003, 0.001};
constexpr std::uint32_t kMoveRounds = 12;
/// A straight way longer than this gets a corner in its middle where less than this clearance is
/// left there, up to so many corners.
constexpr double kSplitWay = 0.1, kTight = 0.02;
constexpr std::size_t kMostCorners = 96;
/// Step by which the slope of the clearance is felt, and directions tried besides.
constexpr double kSlopeStep = 1.0e-4;
constexpr int kRandomWays = 4;
/// Stations are this far apart at the least, in the same lengths; and how many are aimed at.
constexpr double kStationWay = 0.02;
constexpr std::size_t kAimedStations = 128;
/// A corner nearer than this to the last is none.
constexpr double kSameCorner = 1.0e-9;

class Shortening {
 public:
  Shortening(StepProver& prover, double turn_m, const ShorteningLimits& limits,
             const ShorteningProgress& progress)
      : prover_(prover),
        cost_(prover, turn_m),
        turn_m_(turn_m),
        limits_(limits),
        progress_(progress),
        began_(prover.work()),
        words_(hashed(~limits.seed)) {}

  CorneredMotion run(const CorneredMotion& motion) {
    corners_ = motion.corners;
    leave_out();
    for (std::uint32_t k = 0; k < limits_.tries && !over(); ++k) cut_across();
    leave_out();
    turns_ = std::ranges::any_of(corners_, [&](const PlanPose& pose) {
      return turn_between(corners_.front(), pose).norm() > 0;
    });
    corners_ = wide_way(corners_, {prover_, turn_m_, kStraightHalvings, [&] { return over(); }});
    by_cost_ = true;
    for (std::uint32_t k = 0; k < limits_.tries && !over(); ++k) cut_across();
    split_tight_ways();
    for (std::uint32_t round = 0; round < kMoveRounds && !over(); ++round) {
      if (!move_corners()) break;
    }
    drop_corners();
    return {corners_};
  }

 private:
  [[nodiscard]] bool over() const {
    const std::uint64_t work = prover_.work() - began_;
    if (progress_) progress_({work, corners_.size()});
    return work > limits_.work;
  }
  [[nodiscard]] bool straight(const PlanPose& from, const PlanPose& to) {
    return prover_.prove(from, to, kStraightHalvings);
  }
  [[nodiscard]] double length(const PlanPose& from, const PlanPose& to) const {
    return step_length_m(from, to, turn_m_);
  }

  /// From each corner straight to the farthest that a doubling and halving search reaches.
  void leave_out() {
    std::vector<PlanPose> kept{corners_.front()};
    std::size_t at = 0;
    while (at + 1 < corners_.size()) {
      std::size_t good = at + 1, bad = corners_.size();
      for (std::size_t reach = 2; at + reach < bad && !over(); reach *= 2) {
        if (straight(corners_[at], corners_[at + reach])) {
          good = at + reach;
        } else {
          bad = at + reach;
        }
      }
      if (bad == corners_.size() && good + 1 < bad && !over() &&
          straight(corners_[at], corners_.back())) {
        good = corners_.size() - 1;
      }
      while (good + 1 < bad && !over()) {
        const std::size_t middle = good + (bad - good) / 2;
        if (straight(corners_[at], corners_[middle])) {
          good = middle;
        } else {
          bad = middle;
        }
      }
      at = good;
      kept.push_back(corners_[at]);
    }
    corners_ = std::move(kept);
  }

  /// A straight way between two places on the motion, anywhere.
  void cut_across() {
    if (corners_.size() < 3) return;
    std::vector<double> way{0};
    for (std::size_t k = 1; k < corners_.size(); ++k) {
      way.push_back(way.back() + length(corners_[k - 1], corners_[k]));
    }
    double from = words_.uniform() * way.back(), to = words_.uniform() * way.back();
    if (to < from) std::swap(from, to);
    const auto edge_of = [&](double place) {
      const auto above = std::upper_bound(way.begin(), way.end() - 1, place);
      return static_cast<std::size_t>(above - way.begin()) - 1;
    };
    const std::size_t first = edge_of(from), last = edge_of(to);
    if (first >= last) return;
    const auto pose_at = [&](std::size_t edge, double place) {
      const double long_m = way[edge + 1] - way[edge];
      return between(corners_[edge], corners_[edge + 1],
                     long_m > 0 ? (place - way[edge]) / long_m : 0.0);
    };
    const PlanPose a = pose_at(first, from), b = pose_at(last, to);
    if (by_cost_) {
      double before = 0;
      for (std::size_t k = first; k <= last; ++k) before += cost_.of(corners_[k], corners_[k + 1]);
      const double after =
          cost_.of(corners_[first], a) + cost_.of(a, b) + cost_.of(b, corners_[last + 1]);
      if (!(after < kShorter * before)) return;
    } else if (!(length(a, b) < kShorter * (to - from))) {
      return;
    }
    if (!straight(corners_[first], a) || !straight(a, b) || !straight(b, corners_[last + 1]))
      return;
    std::vector<PlanPose> kept(corners_.begin(),
                               corners_.begin() + static_cast<std::ptrdiff_t>(first) + 1);
    for (const PlanPose& pose : {a, b}) {
      if (length(kept.back(), pose) > kSameCorner * turn_m_) kept.push_back(pose);
    }
    kept.insert(kept.end(), corners_.begin() + static_cast<std::ptrdiff_t>(last) + 1,
                corners_.end());
    corners_ = std::move(kept);
  }

  /// A corner in the middle of each way that is long and tight there: corners alone are moved away.
  void split_tight_ways() {
    for (std::size_t k = 1; k < corners_.size() && !over();) {
      const PlanPose middle = between(corners_[k - 1], corners_[k], 0.5);
      const bool splits = corners_.size() < kMostCorners &&
                          length(corners_[k - 1], corners_[k]) > kSplitWay * turn_m_ &&
                          prover_.clearance(middle).gap_m < kTight * turn_m_;
      if (splits) {
        corners_.insert(corners_.begin() + static_cast<std::ptrdiff_t>(k), middle);
      } else {
        ++k;
      }
    }
  }

  /// A step in place and turn, a turn of 1 rad as long as turn_m.
  struct Way {
    Vec3d place = Vec3d::Zero(), turn = Vec3d::Zero();
    [[nodiscard]] double norm() const { return std::hypot(place.norm(), turn.norm()); }
  };
  [[nodiscard]] PlanPose moved(const PlanPose& pose, const Way& way, double far_m) const {
    return plan_pose(place_of(pose) + far_m * way.place,
                     exp_of(far_m / turn_m_ * way.turn) * turn_of(pose));
  }
  [[nodiscard]] double gap_m(const PlanPose& pose) { return prover_.clearance(pose).gap_m; }

  /// Directions in which a corner may be better placed: out of what is nearest, up the slope of the
  /// clearance with turns, to the straight way between its neighbours, and some at random.
  [[nodiscard]] std::vector<Way> ways_on(std::size_t k) {
    const PlanPose& corner = corners_[k];
    const PlanPose straight = between(corners_[k - 1], corners_[k + 1], 0.5);
    std::vector<Way> ways{
        {prover_.clearance(corner).normal_w, Vec3d::Zero()},
        {place_of(straight) - place_of(corner), turn_m_ * turn_between(corner, straight)}};
    if (!turns_) return ways;
    const double step_m = kSlopeStep * turn_m_;
    Way slope;
    for (int i = 0; i < 6; ++i) {
      Way axis;
      (i < 3 ? axis.place : axis.turn)[i % 3] = 1;
      (i < 3 ? slope.place : slope.turn)[i % 3] =
          gap_m(moved(corner, axis, step_m)) - gap_m(moved(corner, axis, -step_m));
    }
    ways.push_back(slope);
    for (int n = 0; n < kRandomWays; ++n) {
      Way random;
      for (int i = 0; i < 6; ++i)
        (i < 3 ? random.place : random.turn)[i % 3] = 2 * words_.uniform() - 1;
      ways.push_back(random);
    }
    return ways;
  }

  /// Moves each corner but the ends to where the way costs less. @return whether one has moved.
  bool move_corners() {
    bool moved_one = false;
    for (std::size_t k = 1; k + 1 < corners_.size() && !over(); ++k) {
      const double before =
          cost_.of(corners_[k - 1], corners_[k]) + cost_.of(corners_[k], corners_[k + 1]);
      for (const Way& way : ways_on(k)) {
        if (way.norm() > 0 && moves_along(k, way, before)) {
          moved_one = true;
          break;
        }
      }
    }
    return moved_one;
  }

  bool moves_along(std::size_t k, const Way& way, double before) {
    for (const double share : kCornerMoves) {
      const PlanPose trial = moved(corners_[k], way, share * turn_m_ / way.norm());
      const double after = cost_.of(corners_[k - 1], trial) + cost_.of(trial, corners_[k + 1]);
      if (!(after < kShorter * before)) continue;
      if (!straight(corners_[k - 1], trial) || !straight(trial, corners_[k + 1])) continue;
      corners_[k] = trial;
      return true;
    }
    return false;
  }

  /// Leaves out corners that the way costs no more without.
  void drop_corners() {
    for (std::size_t k = 1; k + 1 < corners_.size() && !over();) {
      const double with =
          cost_.of(corners_[k - 1], corners_[k]) + cost_.of(corners_[k], corners_[k + 1]);
      const bool drops = cost_.of(corners_[k - 1], corners_[k + 1]) <= with &&
                         straight(corners_[k - 1], corners_[k + 1]);
      if (drops) {
        corners_.erase(corners_.begin() + static_cast<std::ptrdiff_t>(k));
      } else {
        ++k;
      }
    }
  }

  StepProver& prover_;
  WayCost cost_;
  double turn_m_;
  const ShorteningLimits& limits_;
  const ShorteningProgress& progress_;
  std::uint64_t began_;  ///< work of the prover before
  SplitMix64 words_;
  std::vector<PlanPose> corners_;
  bool turns_ = false;    ///< the motion turns the part; else no change does
  bool by_cost_ = false;  ///< what is compared: cost, or length
};

/// The planes of steps, each written once: a pair that keeps its plane goes on with its run.
class PlaneGathering {
 public:
  /// Steps in their order, planes by piece.
  void add(std::uint32_t step, const std::vector<PlanWitness>& planes) {
    for (const PlanWitness& witness : planes) {
      const auto [known, is_new] = by_direction_.try_emplace(witness.direction, planes_.size());
      if (is_new) planes_.push_back({witness.direction, {}});
      const std::uint64_t pair = std::uint64_t{witness.piece_a} << 32 | witness.piece_b;
      Last& last = last_[pair];
      std::vector<PlanRun>& runs = planes_[known->second].runs;
      const bool goes_on = last.plane == known->second && last.run < runs.size() &&
                           runs[last.run].piece_a == witness.piece_a &&
                           runs[last.run].piece_b == witness.piece_b &&
                           runs[last.run].last + 1 == step;
      if (goes_on) {
        runs[last.run].last = step;
        continue;
      }
      last = {known->second, runs.size()};
      runs.push_back({witness.piece_a, witness.piece_b, step, step});
    }
  }
  [[nodiscard]] std::vector<PlanPlane> take() { return std::move(planes_); }

 private:
  struct Last {
    std::size_t plane = 0, run = 0;
  };
  std::vector<PlanPlane> planes_;
  std::map<PlanDirection, std::size_t> by_direction_;
  std::unordered_map<std::uint64_t, Last> last_;  ///< run of each pair
};

/// Poses of the stations: all corners, and between them as many as the aim allows. Of too many
/// corners every so manieth.
std::vector<PlanPose> station_poses(const CorneredMotion& motion, double turn_m,
                                    std::vector<bool>& is_station) {
  const double way = motion.length_m(turn_m);
  const double apart = std::max(way / static_cast<double>(kAimedStations), kStationWay * turn_m);
  std::vector<PlanPose> poses{motion.corners.front()};
  for (std::size_t k = 1; k < motion.corners.size(); ++k) {
    const PlanPose &from = motion.corners[k - 1], &to = motion.corners[k];
    const double parts = std::ceil(step_length_m(from, to, turn_m) / apart);
    for (double part = 1; part < parts; ++part) poses.push_back(between(from, to, part / parts));
    if (!(to == poses.back())) poses.push_back(to);
  }
  const std::size_t every = (poses.size() + kMostPlanStations - 2) / (kMostPlanStations - 1);
  is_station.assign(poses.size(), false);
  for (std::size_t k = 0; k < poses.size(); k += every) is_station[k] = true;
  is_station.back() = true;
  return poses;
}

}  // namespace

CorneredMotion shortened(const CorneredMotion& motion, StepProver& prover, double turn_m,
                         const ShorteningLimits& limits, const ShorteningProgress& progress) {
  return Shortening(prover, turn_m, limits, progress).run(motion);
}

Plan make_plan(const CorneredMotion& motion, StepProver& prover, const PlanCheck& check,
               const PlanTitle& title) {
  Plan plan;
  plan.geometry = geometry_hash(check.scene());
  plan.seed = title.seed;
  plan.scene = title.scene;
  std::replace_if(plan.scene.begin(), plan.scene.end(), is_control, ' ');
  plan.tolerance_m = title.tolerance_m;
  plan.contact_m = title.contact_m;
  plan.length_m = title.turn_m;
  std::vector<bool> is_station;
  const std::vector<PlanPose> poses = station_poses(motion, title.turn_m, is_station);
  plan.poses.push_back(poses.front());
  plan.stations.emplace_back();
  // Near a station a plane is kept where it leaves as much as the nearest pair has there, and is
  // that of no contact: what the station says is then what the best planes do.
  const auto clear_at = [&](std::size_t k) {
    return is_station[k] ? std::max(prover.clearance(poses[k]).gap_m, title.contact_m)
                         : ClearEnds{}.end_m;
  };
  PlaneGathering planes;
  ClearEnds ends;
  ends.end_m = clear_at(0);
  for (std::size_t k = 1; k < poses.size(); ++k) {
    ends = {ends.end_m, clear_at(k)};
    ProvedMotion proved;
    if (!prover.prove(poses[k - 1], poses[k], kStraightHalvings + 4, ProofSearch::kKept, proved,
                      ends)) {
      throw std::runtime_error("a step of the shortened motion could not be proved again");
    }
    for (std::size_t j = 0; j < proved.poses.size(); ++j) {
      const StepProof step =
          check.step(plan.poses.back(), proved.poses[j], proved.steps[j], plan.tolerance_m);
      if (!step.holds) {
        throw std::runtime_error("a step that was proved does not hold in long double");
      }
      planes.add(static_cast<std::uint32_t>(plan.steps()), proved.steps[j]);
      plan.poses.push_back(proved.poses[j]);
    }
    if (!is_station[k]) continue;
    PlanStation station;
    station.pose = static_cast<std::uint32_t>(plan.poses.size() - 1);
    plan.stations.push_back(station);
  }
  plan.planes = planes.take();
  double to_go = 0;
  std::size_t at = plan.poses.size() - 1;
  for (std::size_t k = plan.stations.size(); k-- > 0;) {
    PlanStation& station = plan.stations[k];
    for (; at > station.pose; --at) {
      to_go += step_length_m(plan.poses[at - 1], plan.poses[at], plan.length_m);
    }
    station.cost_to_go_m = to_go;
  }
  PlanSweep sweep(plan);
  for (PlanStation& station : plan.stations) {
    std::vector<PlanWitness> before;
    if (station.pose > 0) before = sweep.at(station.pose - 1);
    const std::vector<PlanWitness>* const after =
        station.pose < plan.steps() ? &sweep.at(station.pose) : nullptr;
    StationProof found = check.station(plan.poses[station.pose],
                                       station.pose > 0 ? &before : nullptr, after, plan.contact_m);
    station.clearance_m = static_cast<double>(found.clearance_m);
    station.contacts = std::move(found.contacts);
  }
  return plan;
}

}  // namespace haptic::tools
