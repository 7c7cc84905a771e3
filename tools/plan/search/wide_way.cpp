// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/search/wide_way.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <queue>

namespace haptic::tools {
namespace {

constexpr double kNoWay = std::numeric_limits<double>::infinity();
/// Places on the given way.
constexpr std::size_t kPlaces = 64;
/// Places straight out of start and goal: from the first to the last distance, in lengths of a turn
/// of 1 rad, each so many times as far as the one before.
constexpr double kFirstOut = 0.02, kLastOut = 8, kOutGrows = 1.4;
/// Edges lead from a pose to so many of its nearest.
constexpr std::size_t kNearest = 14;
/// Steps by which a pose is moved to more clearance, in lengths of a turn of 1 rad, and how many
/// are tried; how far apart the slope is felt; and how much clearance is enough.
constexpr double kRoomMoves[] = {0.1, 0.03, 0.01, 0.003, 0.001};
constexpr int kMostMoves = 40;
constexpr double kFelt = 1.0e-4, kEnough = 0.1;
/// A move must gain this share of itself.
constexpr double kGain = 0.05;

class Graph {
 public:
  Graph(const std::vector<PlanPose>& corners, const WideWayTools& with)
      : corners_(corners), with_(with), cost_(with.prover, with.turn_m) {
    turns_ = std::ranges::any_of(corners_, [&](const PlanPose& pose) {
      return turn_between(corners_.front(), pose).norm() > 0;
    });
  }

  std::vector<PlanPose> run() {
    add_given_way();
    const std::size_t given = nodes_.size();
    for (std::size_t k = 1; k + 1 < given && !with_.over(); ++k) add_variants(nodes_[k].pose);
    add_straight_out(0);
    add_straight_out(given_end_);
    join_nearest();
    return shortest_way();
  }

 private:
  struct Edge {
    std::size_t a = 0, b = 0;
    double cost_m = 0;
    bool costed = false, proved = false;
  };
  struct Node {
    PlanPose pose;
    double weight = 0;
    std::vector<std::size_t> edges;
  };

  std::size_t add_node(const PlanPose& pose) {
    nodes_.push_back({pose, cost_.weight(pose), {}});
    return nodes_.size() - 1;
  }
  /// A pose that need not be free.
  void try_node(const PlanPose& pose) {
    if (!with_.over() && with_.prover.is_free(pose)) add_node(pose);
  }
  /// An edge whose cost is guessed by the weights at its ends, until it is asked for.
  void add_edge(std::size_t a, std::size_t b, bool proved) {
    const double way_m = cost_.length_m(nodes_[a].pose, nodes_[b].pose);
    nodes_[a].edges.push_back(edges_.size());
    nodes_[b].edges.push_back(edges_.size());
    edges_.push_back({a, b, way_m * std::min(nodes_[a].weight, nodes_[b].weight), false, proved});
  }

  void add_given_way() {
    double way_m = 0;
    for (std::size_t k = 1; k < corners_.size(); ++k)
      way_m += cost_.length_m(corners_[k - 1], corners_[k]);
    const double apart_m = way_m / static_cast<double>(kPlaces);
    add_node(corners_.front());
    for (std::size_t k = 1; k < corners_.size(); ++k) {
      const PlanPose &from = corners_[k - 1], &to = corners_[k];
      const double parts = std::max(std::ceil(cost_.length_m(from, to) / apart_m), 1.0);
      for (double part = 1; part <= parts; ++part) {
        const std::size_t last = nodes_.size() - 1;
        add_edge(last, add_node(part < parts ? between(from, to, part / parts) : to), true);
      }
    }
    given_end_ = nodes_.size() - 1;
  }

  /// A copy: nodes that are added move those that are there.
  void add_variants(const PlanPose pose) {
    try_node(with_more_room(pose));
    if (!turns_) return;
    for (const PlanPose& end : {corners_.front(), corners_.back()}) {
      const PlanPose turned = plan_pose(place_of(pose), turn_of(end));
      try_node(turned);
    }
  }

  void add_straight_out(std::size_t root) {
    const PlanPose pose = nodes_[root].pose;
    for (int axis = 0; axis < 12; ++axis) {
      Vec3d along = Vec3d::Zero();
      along[axis % 3] = axis % 6 < 3 ? 1 : -1;
      if (axis >= 6) along = turn_of(pose) * along;
      for (double far = kFirstOut; far < kLastOut && !with_.over(); far *= kOutGrows) {
        const PlanPose out = plan_pose(place_of(pose) + far * with_.turn_m * along, turn_of(pose));
        if (!with_.prover.is_free(out)) break;
        add_edge(root, add_node(out), false);
      }
    }
  }

  [[nodiscard]] double room_m(const PlanPose& pose) const {
    return with_.prover.clearance(pose).gap_m;
  }
  /// Up the slope of the clearance, in place and turn.
  [[nodiscard]] PlanPose with_more_room(PlanPose pose) const {
    const auto moved = [&](const Vec3d& place, const Vec3d& turn, double far_m) {
      return plan_pose(place_of(pose) + far_m * place,
                       exp_of(far_m / with_.turn_m * turn) * turn_of(pose));
    };
    double room = room_m(pose);
    for (int k = 0; k < kMostMoves && room < kEnough * with_.turn_m && !with_.over(); ++k) {
      Vec3d slope[2] = {Vec3d::Zero(), Vec3d::Zero()};
      for (int axis = 0; axis < (turns_ ? 6 : 3); ++axis) {
        Vec3d along[2] = {Vec3d::Zero(), Vec3d::Zero()};
        along[axis / 3][axis % 3] = 1;
        const double felt_m = kFelt * with_.turn_m;
        slope[axis / 3][axis % 3] =
            room_m(moved(along[0], along[1], felt_m)) - room_m(moved(along[0], along[1], -felt_m));
      }
      const double steep = std::hypot(slope[0].norm(), slope[1].norm());
      if (!(steep > 0)) break;
      bool better = false;
      for (const double share : kRoomMoves) {
        const double far_m = share * with_.turn_m;
        const PlanPose trial = moved(slope[0] / steep, slope[1] / steep, far_m);
        const double there = room_m(trial);
        if (!(there > room + kGain * far_m)) continue;
        pose = trial;
        room = there;
        better = true;
        break;
      }
      if (!better) break;
    }
    return pose;
  }

  void join_nearest() {
    std::vector<std::size_t> order(nodes_.size());
    std::vector<double> far(nodes_.size());
    const std::size_t count = std::min(kNearest + 1, nodes_.size());
    for (std::size_t k = 0; k < nodes_.size() && !with_.over(); ++k) {
      std::iota(order.begin(), order.end(), std::size_t{0});
      for (std::size_t j = 0; j < nodes_.size(); ++j)
        far[j] = cost_.length_m(nodes_[k].pose, nodes_[j].pose);
      std::ranges::partial_sort(order, order.begin() + static_cast<std::ptrdiff_t>(count),
                                [&](std::size_t a, std::size_t b) {
                                  return far[a] < far[b] || (far[a] == far[b] && a < b);
                                });
      for (std::size_t j = 0; j < count; ++j) {
        if (order[j] != k && far[order[j]] > 0) add_edge(k, order[j], false);
      }
    }
  }

  /// Edges of the cheapest way from the start to the end of the given one, last first.
  [[nodiscard]] std::vector<std::size_t> cheapest() const {
    std::vector<double> least(nodes_.size(), kNoWay);
    std::vector<std::size_t> by(nodes_.size(), edges_.size());
    using Entry = std::pair<double, std::size_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    least[0] = 0;
    open.push({0, 0});
    while (!open.empty()) {
      const auto [cost, at] = open.top();
      open.pop();
      if (cost > least[at]) continue;
      if (at == given_end_) break;
      for (const std::size_t number : nodes_[at].edges) {
        const Edge& edge = edges_[number];
        const std::size_t next = edge.a == at ? edge.b : edge.a;
        if (!(cost + edge.cost_m < least[next])) continue;
        least[next] = cost + edge.cost_m;
        by[next] = number;
        open.push({least[next], next});
      }
    }
    std::vector<std::size_t> way;
    for (std::size_t at = given_end_; at != 0;) {
      way.push_back(by[at]);
      const Edge& edge = edges_[by[at]];
      at = edge.a == at ? edge.b : edge.a;
    }
    return way;
  }

  /// What is guessed on the cheapest way is found out, until nothing on it is guessed. Edges of the
  /// given way are proved, so there always is a way.
  [[nodiscard]] std::vector<PlanPose> shortest_way() {
    for (;;) {
      const std::vector<std::size_t> way = cheapest();
      bool known = true;
      for (const std::size_t number : way) {
        Edge& edge = edges_[number];
        if (edge.costed && edge.proved) continue;
        if (with_.over()) return corners_;
        known = false;
        const PlanPose &from = nodes_[edge.a].pose, &to = nodes_[edge.b].pose;
        if (!edge.costed) {
          edge.cost_m = cost_.of(from, to);
          edge.costed = true;
          continue;  // it may not be on the cheapest way any more
        }
        edge.proved = with_.prover.prove(from, to, with_.halvings);
        if (!edge.proved) edge.cost_m = kNoWay;
      }
      if (known) return corners_of(way);
    }
  }

  [[nodiscard]] std::vector<PlanPose> corners_of(const std::vector<std::size_t>& way) const {
    std::vector<PlanPose> poses{nodes_[0].pose};
    std::size_t at = 0;
    for (std::size_t k = way.size(); k-- > 0;) {
      const Edge& edge = edges_[way[k]];
      at = edge.a == at ? edge.b : edge.a;
      poses.push_back(nodes_[at].pose);
    }
    return poses;
  }

  const std::vector<PlanPose>& corners_;
  const WideWayTools& with_;
  WayCost cost_;
  std::vector<Node> nodes_;
  std::vector<Edge> edges_;
  std::size_t given_end_ = 0;
  bool turns_ = false;  ///< the given way turns the part; else no other does
};

}  // namespace

std::vector<PlanPose> wide_way(const std::vector<PlanPose>& corners, const WideWayTools& with) {
  if (corners.size() < 2 || with.over()) return corners;
  return Graph(corners, with).run();
}

}  // namespace haptic::tools
