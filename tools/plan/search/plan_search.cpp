// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/search/plan_search.hpp"

#include <chrono>
#include <limits>
#include <numbers>

#include "tools/common/split_mix.hpp"
#include "tools/plan/plan_limits.hpp"

namespace haptic::tools {
namespace {

/// Poses of one tree with one contact state that are nearer than this are one, in radii.
constexpr double kSamePose = 0.02;
/// A push along an axis goes this many radii far, about one as many [rad].
constexpr double kPushFar = 3.0, kPushTurn_rad = 1.2;
/// Ticks of a push to a random pose, and of any other.
constexpr std::uint32_t kRandomTicks = 60, kPushTicks = 400;
/// What a move that was made costs against the distance that is left: a node has its first moves
/// made before one that lies farther by this share of the way between start and goal.
constexpr double kMoveCost = 0.1;
/// Steps of the core are short; their proof may cut them in halves this often.
constexpr int kHalvings = 14;
/// Of three branches, one is the search's own choice of a move, one goes to a random pose and one
/// towards the other tree.
constexpr std::uint64_t kKinds = 3;

/// After so many branches every move of the roots is made once, the goal's first: what is tight or
/// on a thread gives in one direction, which may be the last in the order of the moves.
constexpr std::uint64_t kBeforeRoots = 24;

/// Trees nearer than this are joined by a proof where a push does not arrive, in radii.
constexpr double kBridge = 0.05;
constexpr int kBridgeHalvings = 8;

/// A push that contact has led over this share of its way is repeated, this often at the most.
constexpr double kLedOn = 0.5;
constexpr std::uint32_t kMostRepeats = 48;

/// After so many pushes every other random pose may lie farther from the straight way than the
/// first do, and twice as far with every so many more.
constexpr std::uint64_t kNearPushes = 1000, kWidenPushes = 500, kMostWidenings = 40;
/// Past the obstacles a way is looked for so far, in radii.
constexpr double kPast = 1.5;

/// Moves of a node: towards the other root; along and about A's axes and W's; then along the lines
/// that two planes leave.
constexpr std::uint32_t kAxisMoves = 6, kFirstAxis = 1, kFirstTurn = kFirstAxis + 2 * kAxisMoves,
                        kFirstLine = kFirstTurn + 2 * kAxisMoves;
constexpr std::size_t kMostHeld = 4;

struct Node {
  std::size_t parent = 0;
  PlanPose pose;
  std::vector<PlanPose> path;  ///< from the parent, without it, to the pose
  std::uint64_t contact_state = 0;
  std::vector<HoldingPlane> held;
  double left_m = 0;  ///< to the other root
  std::uint32_t moves = 0;
};

struct Tree {
  std::vector<Node> nodes;
  PlanPose other_root;
};

class Search {
 public:
  Search(const SceneView& scene, SlidingPart& part, StepProver& prover, const SearchLimits& limits)
      : part_(part), prover_(prover), limits_(limits), words_(hashed(limits.seed)) {
    radius_m_ = part.radius_m();
    fixed_ = scene.is_locked();
    set_far_box(scene);
  }

  SearchResult run(const PlanPose& start, const PlanPose& goal,
                   const std::function<void(const SearchState&)>& progress) {
    began_s_ = limits_.clock_s();
    began_ticks_ = part_.ticks();
    SearchResult result;
    trees_[0] = {{}, goal};
    trees_[1] = {{}, start};
    way_m_ = distance_m(start, goal);
    nearest_m_ = way_m_;
    for (const PlanPose& pose : {start, goal}) {
      far_low_ = far_low_.cwiseMin(place_of(pose));
      far_high_ = far_high_.cwiseMax(place_of(pose));
    }
    add_root(trees_[0], start);
    add_root(trees_[1], goal);
    double said_s = 0;
    while (!over(result)) {
      if (branch()) {
        result.found = assemble(result.motion);
        if (result.found) break;
      }
      if (seconds() > said_s + 1) {
        said_s = seconds();
        progress(state());
      }
    }
    result.state = state();
    result.nearest_to_start = nearest(trees_[1]);
    result.nearest_to_goal = nearest(trees_[0]);
    result.goal_held = goal_held_;
    return result;
  }

 private:
  [[nodiscard]] double seconds() const { return limits_.clock_s() - began_s_; }
  [[nodiscard]] bool over(SearchResult& result) const {
    result.timed_out = seconds() > limits_.seconds;
    return result.timed_out || part_.ticks() - began_ticks_ >= limits_.most_ticks ||
           trees_[0].nodes.size() + trees_[1].nodes.size() >= limits_.most_nodes;
  }
  [[nodiscard]] SearchState state() const {
    return {seconds(), trees_[0].nodes.size(), trees_[1].nodes.size(),
            pushes_,   part_.ticks(),          nearest_m_};
  }
  [[nodiscard]] double distance_m(const PlanPose& a, const PlanPose& b) const {
    return step_length_m(a, b, radius_m_);
  }
  [[nodiscard]] static const PlanPose& nearest(const Tree& tree) {
    const auto least =
        std::min_element(tree.nodes.begin(), tree.nodes.end(),
                         [](const Node& a, const Node& b) { return a.left_m < b.left_m; });
    return least->pose;
  }
  void add_root(Tree& tree, const PlanPose& pose) {
    Node root;
    root.pose = pose;
    root.left_m = distance_m(pose, tree.other_root);
    tree.nodes.push_back(root);
  }
  [[nodiscard]] std::size_t nearest_node(const Tree& tree, const PlanPose& pose) const {
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < tree.nodes.size(); ++k) {
      const double far = distance_m(tree.nodes[k].pose, pose);
      if (far < least) {
        least = far;
        best = k;
      }
    }
    return best;
  }

  /// One push from a node, and what it makes of the other tree. @return whether the trees meet.
  bool branch() {
    const std::uint32_t root_moves = fixed_ ? kFirstTurn : kFirstLine;
    if (branches_ >= kBeforeRoots && roots_moved_ < 2 * root_moves) {
      const std::size_t root_side = roots_moved_ < root_moves ? 1 : 0;
      const PlanPose target = target_of(trees_[root_side].nodes[0], roots_moved_ % root_moves,
                                        trees_[root_side].other_root);
      roots_moved_ += 1;
      return push_on(root_side, 0, target, kPushTicks, true);
    }
    const std::size_t side = branches_ % 4 == 0 ? 0 : 1;
    const std::uint64_t kind = branches_ / 4 % kKinds;
    branches_ += 1;
    Tree& tree = trees_[side];
    Tree& other = trees_[1 - side];
    std::size_t from = 0;
    PlanPose target;
    std::uint32_t ticks = kPushTicks;
    if (kind == 0) {
      from = next_move(tree, target);
    } else if (kind == 1) {
      target = random_pose();
      from = nearest_node(tree, target);
      ticks = kRandomTicks;
    } else {
      target = other.nodes[static_cast<std::size_t>(words_.next() % other.nodes.size())].pose;
      from = nearest_node(tree, target);
    }
    return push_on(side, from, target, ticks, kind == 0);
  }

  /// The push, `goes_on` where contact leads it; then the other tree reaches for its end.
  bool push_on(std::size_t side, std::size_t from, const PlanPose& target, std::uint32_t ticks,
               bool goes_on) {
    Tree& tree = trees_[side];
    Tree& other = trees_[1 - side];
    std::size_t grown = 0;
    if (!grow(tree, from, target, ticks, grown)) return false;
    if (goes_on) grown = go_on(tree, from, target, grown);
    const PlanPose& reached = tree.nodes[grown].pose;
    const std::size_t near = nearest_node(other, reached);
    nearest_m_ = std::min(nearest_m_, distance_m(other.nodes[near].pose, reached));
    std::size_t met = near;
    bool arrived = distance_m(other.nodes[near].pose, reached) < kMet * radius_m_;
    if (!arrived) {
      arrived_ = false;
      static_cast<void>(grow(other, near, reached, kPushTicks, met));
      arrived = arrived_;
      nearest_m_ = std::min(nearest_m_, distance_m(part_.at(), reached));
      arrived = arrived || is_bridged(other.nodes[met].pose, reached);
    }
    if (!arrived) return false;
    meet_[side] = grown;
    meet_[1 - side] = met;
    return true;
  }

  /// Contact may keep a push from arriving though nothing lies between: then a proof joins the two.
  [[nodiscard]] bool is_bridged(const PlanPose& from, const PlanPose& to) {
    return distance_m(from, to) < kBridge * radius_m_ && prover_.prove(from, to, kBridgeHalvings);
  }

  /// Pushes from a node; the end of the push, and poses at which the contact changed, become nodes.
  /// @return whether one did; `last`: the number of the last, or where the push arrived.
  bool grow(Tree& tree, std::size_t from, const PlanPose& target, std::uint32_t ticks,
            std::size_t& last) {
    PushLimits limits;
    limits.most_ticks = ticks;
    part_.place(tree.nodes[from].pose);
    std::vector<PlanPose> path;
    const PushResult end = part_.push(target, limits, path);
    pushes_ += 1;
    arrived_ = end.arrived;
    if (path.empty()) return false;
    if (from == 0 && &tree == &trees_[1]) goal_held_ = part_.holding();
    Node node;
    node.parent = from;
    node.pose = part_.at();
    node.path = std::move(path);
    node.contact_state = part_.contact_state();
    node.held = part_.holding();
    if (node.held.size() > kMostHeld) node.held.resize(kMostHeld);
    node.left_m = distance_m(node.pose, tree.other_root);
    if (!end.arrived && is_known(tree, node)) return false;
    last = tree.nodes.size();
    tree.nodes.push_back(std::move(node));
    return true;
  }

  /// A part that contact leads, as a nut on its thread, goes on as it was pushed while that leads
  /// it on: on a screw the way to the other tree is long, and nothing but the turns shortens it.
  [[nodiscard]] std::size_t go_on(Tree& tree, std::size_t from, const PlanPose& target,
                                  std::size_t grown) {
    const Vec3d turn = turn_between(tree.nodes[from].pose, target);
    const Vec3d far = place_of(target) - place_of(tree.nodes[from].pose);
    const double asked_m = distance_m(tree.nodes[from].pose, target);
    for (std::uint32_t k = 0; k < kMostRepeats; ++k) {
      const std::size_t last = grown;
      const PlanPose& at = tree.nodes[last].pose;
      const std::size_t before = k == 0 ? from : tree.nodes[last].parent;
      if (tree.nodes[last].held.empty()) break;
      if (distance_m(tree.nodes[before].pose, at) < kLedOn * asked_m) break;
      // Away from the other tree it is led by the moves of the nodes, if at all.
      const Vec3d there = place_of(tree.other_root);
      if ((place_of(at) - there).norm() > (place_of(tree.nodes[before].pose) - there).norm()) break;
      const PlanPose next = plan_pose(place_of(at) + far, exp_of(turn) * turn_of(at));
      if (!grow(tree, last, next, kPushTicks, grown)) break;
    }
    return grown;
  }

  [[nodiscard]] bool is_known(const Tree& tree, const Node& node) const {
    return std::any_of(tree.nodes.begin(), tree.nodes.end(), [&](const Node& known) {
      return known.contact_state == node.contact_state &&
             distance_m(known.pose, node.pose) < kSamePose * radius_m_;
    });
  }

  /// The node with the least of way left and moves made, and its next move.
  [[nodiscard]] std::size_t next_move(Tree& tree, PlanPose& target) {
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < tree.nodes.size(); ++k) {
      const Node& node = tree.nodes[k];
      const double cost = node.left_m / way_m_ + kMoveCost * node.moves;
      if (cost < least) {
        least = cost;
        best = k;
      }
    }
    Node& node = tree.nodes[best];
    target = target_of(node, node.moves, tree.other_root);
    node.moves += 1;
    return best;
  }

  [[nodiscard]] PlanPose target_of(const Node& node, std::uint32_t move,
                                   const PlanPose& other_root) {
    if (move == 0) return other_root;
    const Vec3d x = place_of(node.pose);
    const Quatd q = turn_of(node.pose);
    const auto axis_of = [&](std::uint32_t number) {
      Vec3d axis = Vec3d::Zero();
      axis[static_cast<int>(number % kAxisMoves / 2)] = number % 2 == 0 ? 1 : -1;
      return number < kAxisMoves ? Vec3d(q * axis) : axis;
    };
    if (move < kFirstTurn) {
      return plan_pose(x + kPushFar * radius_m_ * axis_of(move - kFirstAxis), q);
    }
    if (move < kFirstLine && !fixed_) {
      return plan_pose(x, exp_of(kPushTurn_rad * axis_of(move - kFirstTurn)) * q);
    }
    // Along the line that two planes leave, one way and the other; then anywhere near.
    const std::size_t planes = node.held.size();
    std::uint32_t line = move - (fixed_ ? kFirstTurn : kFirstLine);
    for (std::size_t i = 0; i < planes; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const Vec3d along = node.held[i].normal_w.cross(node.held[j].normal_w);
        if (along.norm() < 0.1) continue;
        if (line < 2) {
          return plan_pose(x + (line == 0 ? 1 : -1) * kPushFar * radius_m_ * along.normalized(), q);
        }
        line -= 2;
      }
    }
    return plan_pose(x + kPushFar * radius_m_ * random_in_ball(),
                     fixed_ ? q : Quatd(exp_of(kPushTurn_rad * random_in_ball()) * q));
  }

  [[nodiscard]] Vec3d random_in_ball() {
    for (;;) {
      const double x = words_.uniform(), y = words_.uniform(), z = words_.uniform();
      const Vec3d v(2 * x - 1, 2 * y - 1, 2 * z - 1);
      if (v.squaredNorm() <= 1) return v;
    }
  }
  /// Where the part may have to go to pass round all that stands there, within the workspace.
  void set_far_box(const SceneView& scene) {
    const Vec3d past = Vec3d::Constant(kPast * radius_m_);
    far_low_.setConstant(std::numeric_limits<double>::infinity());
    far_high_ = -far_low_;
    for (std::uint32_t k = scene.bodies()[0].piece_count; k < scene.pieces().size(); ++k) {
      const PieceView piece = scene.piece(k);
      const Vec3d at(scene.bodies()[piece.record->body].reference_m);
      for (std::uint32_t v = 0; v < piece.vertex_count; ++v) {
        const Vec3d x = at + piece.vertex(v).cast<double>();
        far_low_ = far_low_.cwiseMin(x - past);
        far_high_ = far_high_.cwiseMax(x + past);
      }
    }
    const PlanLimits limits(scene.parameters().envelope);
    for (int axis = 0; axis < 3 && limits.has_box(); ++axis) {
      low_[axis] = limits.low_m(axis);
      high_[axis] = limits.high_m(axis);
    }
    far_low_ = far_low_.cwiseMax(low_).cwiseMin(high_);
    far_high_ = far_high_.cwiseMin(high_).cwiseMax(low_);
  }
  /// About a place between the roots; after many pushes also farther away.
  [[nodiscard]] Vec3d random_place(const Vec3d& middle) {
    const double near_m = radius_m_ + way_m_ / 4;
    random_places_ += 1;
    if (pushes_ < kNearPushes || random_places_ % 2 == 0) {
      return (middle + near_m * random_in_ball()).cwiseMax(low_).cwiseMin(high_);
    }
    const std::uint64_t widenings = 1 + (pushes_ - kNearPushes) / kWidenPushes;
    const double far_m = std::ldexp(near_m, static_cast<int>(std::min(widenings, kMostWidenings)));
    const Vec3d low = far_low_.cwiseMax(middle - Vec3d::Constant(far_m));
    const Vec3d high = far_high_.cwiseMin(middle + Vec3d::Constant(far_m));
    const double x = words_.uniform(), y = words_.uniform(), z = words_.uniform();
    return low + Vec3d(x, y, z).cwiseProduct(high - low);
  }
  /// Between the two roots and about, turned by anything.
  [[nodiscard]] PlanPose random_pose() {
    const double share = words_.uniform();
    const PlanPose middle = between(trees_[1].other_root, trees_[0].other_root, share);
    const Vec3d x = random_place(place_of(middle));
    if (fixed_) return plan_pose(x, turn_of(middle));
    const double most = words_.uniform() < 0.5 ? 0.3 : std::numbers::pi;
    return plan_pose(x, exp_of(most * random_in_ball()) * turn_of(middle));
  }

  /// Poses from the root of a tree to a node.
  [[nodiscard]] static std::vector<PlanPose> way_to(const Tree& tree, std::size_t node) {
    std::vector<std::size_t> chain;
    for (std::size_t at = node; at != 0; at = tree.nodes[at].parent) chain.push_back(at);
    std::vector<PlanPose> way{tree.nodes[0].pose};
    for (std::size_t k = chain.size(); k-- > 0;) {
      const std::vector<PlanPose>& path = tree.nodes[chain[k]].path;
      way.insert(way.end(), path.begin(), path.end());
    }
    return way;
  }

  /// The way through the two nodes that met, proved step by step.
  [[nodiscard]] bool assemble(CorneredMotion& motion) {
    std::vector<PlanPose> way = way_to(trees_[0], meet_[0]);
    const std::vector<PlanPose> back = way_to(trees_[1], meet_[1]);
    way.insert(way.end(), back.rbegin(), back.rend());
    motion = {{way.front()}};
    for (const PlanPose& pose : way) {
      if (pose == motion.corners.back()) continue;
      if (!prover_.prove(motion.corners.back(), pose, kHalvings)) return false;
      motion.corners.push_back(pose);
    }
    return true;
  }

  /// Two poses that are nearer have met, in radii: the step between them is proved like all others.
  static constexpr double kMet = 1.0e-6;

  SlidingPart& part_;
  StepProver& prover_;
  const SearchLimits& limits_;
  SplitMix64 words_;
  double radius_m_ = 0, way_m_ = 0, nearest_m_ = 0;
  bool fixed_ = false, arrived_ = false;
  Vec3d low_ = Vec3d::Constant(-std::numeric_limits<double>::infinity());  ///< of the workspace
  Vec3d high_ = Vec3d::Constant(std::numeric_limits<double>::infinity());
  Vec3d far_low_ = Vec3d::Zero(), far_high_ = Vec3d::Zero();  ///< of random poses
  std::uint64_t random_places_ = 0;
  Tree trees_[2];  ///< from the start, from the goal
  std::size_t meet_[2] = {0, 0};
  std::uint64_t branches_ = 0, pushes_ = 0;
  std::uint32_t roots_moved_ = 0;  ///< moves of both roots that were made for kBeforeRoots
  std::vector<HoldingPlane> goal_held_;
  double began_s_ = 0;
  std::uint64_t began_ticks_ = 0;
};

}  // namespace

double wall_clock_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

SearchResult search_plan(const SceneView& scene, SlidingPart& part, StepProver& prover,
                         const PlanPose& start, const PlanPose& goal, const SearchLimits& limits,
                         const std::function<void(const SearchState&)>& progress) {
  return Search(scene, part, prover, limits).run(start, goal, progress);
}

}  // namespace haptic::tools
