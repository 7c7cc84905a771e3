// SPDX-License-Identifier: Apache-2.0
#include "rt_core/haptic_core.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/bounded_list.hpp"
#include "rt_core/contact/contact_region.hpp"
#include "rt_core/contact/near_set.hpp"
#include "rt_core/contact/pair_gate.hpp"
#include "rt_core/contact/pair_verdict.hpp"
#include "rt_core/law/paper_law.hpp"
#include "rt_core/law/weighted_region_law.hpp"
#include "rt_core/scene/capacity.hpp"

namespace haptic {
namespace {

/// Two patches of one static body are one contact when their planes agree this closely.
constexpr Real kSamePlaneChord = HAPTIC_REAL_IS_FLOAT ? 1.0e-3_r : 1.0e-6_r;

/// How much more than the stated motion a tick may bring before it is flagged: rounding of the
/// device's own pose.
constexpr Real kMotionMargin = 1.000001_r;

/// What the core keeps of each pair, besides its gate.
struct PairState {
  PairView view;
  FeatureBounds bounds;
  VerdictMemory verdict_memory;
  VerdictResult verdict;
  NearNode best;  ///< node of D_near at the last visit
  Real d_near_m = 0;
  std::uint64_t visited_at = 0;  ///< number of the tick; 0: never
  bool exact = false;
  std::uint32_t near_begin = 0, near_count = 0;  ///< of this tick's visit
  std::uint32_t contact_begin = 0, contact_count = 0;
  ContactSituation situation = ContactSituation::kNone;
};

/// What the gate reads of each pair in every tick: kept apart, so that far pairs cost little.
struct PairGateState {
  GatePlane plane;
  double reach_a_m = 0, reach_b_m = 0;  ///< levers of the odometers
  std::uint32_t body_b = 0;
};

/// A static body's share of the odometers.
struct BodyMotion {
  Vec3 reference_w = Vec3::Zero();
  double swept_m = 0;  ///< sum of the turn times the distance of the grip point from the reference
};

/// A pair that must be looked at, and how near it may be.
struct Candidate {
  double gap_m = 0;
  std::uint32_t pair = 0;
};

/// Pose of A as the formulas use it: grip point and orientation.
struct GripPose {
  Vec3 x0_w = Vec3::Zero();
  Quat q_wa = Quat::Identity();
  Mat3 r_wa = Mat3::Identity();
};

Vec3 to_vec3(const double (&v)[3]) noexcept {
  return {static_cast<Real>(v[0]), static_cast<Real>(v[1]), static_cast<Real>(v[2])};
}

RtStatus check_pose(const Pose& pose) noexcept {
  const auto finite = [](Real x) { return x - x == 0; };
  const Quat& q = pose.q_wa;
  for (int k = 0; k < 3; ++k) {
    if (!finite(pose.p_wa[k])) return RtStatus::kPoseNotFinite;
  }
  for (int k = 0; k < 4; ++k) {
    if (!finite(q.coeffs()[k])) return RtStatus::kPoseNotFinite;
  }
  const Real n = std::sqrt(q.coeffs().squaredNorm());
  return n > 0.999_r && n < 1.001_r ? RtStatus::kOk : RtStatus::kPoseNotUnit;
}

/// Length of the difference of two unit quaternions, sign-aligned: the chord of the turn between
/// them is at most twice that.
Real quaternion_step(const Quat& l, const Quat& r) noexcept {
  const Real minus = (l.coeffs() - r.coeffs()).squaredNorm();
  const Real plus = (l.coeffs() + r.coeffs()).squaredNorm();
  return std::sqrt(std::min(minus, plus));
}

/// Mixes words into a chain: every result depends on all words before it. Words go in turn to lanes
/// that do not wait for each other.
class StateHash {
 public:
  explicit StateHash(std::uint64_t from) noexcept : lanes_{from, ~from, from >> 32, from << 32} {}
  void add(std::uint64_t word) noexcept {
    std::uint64_t& lane = lanes_[next_];
    lane = (lane ^ word) * 0x9e3779b97f4a7c15ull;
    lane ^= lane >> 29;
    next_ = (next_ + 1) % 4;
  }
  void add(Real value) noexcept {
#if HAPTIC_REAL_IS_FLOAT
    add(std::uint64_t{std::bit_cast<std::uint32_t>(value)});
#else
    add(std::bit_cast<std::uint64_t>(value));
#endif
  }
  void add(const Vec3& v) noexcept {
    for (int k = 0; k < 3; ++k) add(v[k]);
  }
  [[nodiscard]] std::uint64_t value() const noexcept {
    std::uint64_t hash = lanes_[0];
    for (std::size_t k = 1; k < 4; ++k) {
      hash = (hash ^ lanes_[k]) * 0xbf58476d1ce4e5b9ull;
      hash ^= hash >> 31;
    }
    return hash;
  }

 private:
  std::uint64_t lanes_[4];
  std::size_t next_ = 0;
};
constexpr std::uint64_t kHashStart = 0xcbf29ce484222325ull;

}  // namespace

struct HapticCore::State {
  SceneView scene;
  Vec3 grip_a = Vec3::Zero();  ///< grip point in A's mesh frame
  LawId law = LawId::kWeightedRegion;
  Real k_f_n_per_m = 0;
  Real epsilon_m = 0, epsilon_o_m = 0;
  double exact_band_m = 0;
  Real max_step_m = 0, max_turn_rad = 0;  ///< motion per tick of the speed certificate; 0: none
  std::uint32_t max_visits = 0;

  std::span<PairState> pairs;
  std::span<PairGateState> gates;  ///< by pair
  std::span<BodyMotion> bodies;
  std::span<Real> moving_lanes;              ///< turned vertices, by moving piece
  std::span<std::size_t> lanes_begin;        ///< of each moving piece
  std::span<std::uint64_t> lanes_turned_at;  ///< tick in which each piece was turned
  NearScratch scratch;
  BoundedList<NearNode> near;  ///< near sets of the pairs visited in this tick
  BoundedList<std::uint32_t> contact_nodes;
  BoundedList<Candidate> candidates;
  BoundedList<ContactPatch> patches;
  BoundedList<Vec3> points;         ///< paper's law: of all patches
  BoundedList<Vec3> merged_points;  ///< of the patches that share a plane
  BoundedList<WeightedContact> contacts;
  std::span<std::uint8_t> merged;  ///< per patch: already part of an earlier one
  HullScratch hull;

  MotionSum motion;
  GripPose last;
  bool has_last = false;
  std::uint64_t tick = 0;
  std::uint64_t hash = kHashStart;
  StepPeaks peaks;

  /// Places everything in `arena`; with a counting arena only the size is computed.
  void place(Arena& arena, const SceneView& view) noexcept;
  void read_scene(const SceneView& view) noexcept;
  void forget() noexcept;

  void advance(const GripPose& grip, StepResult& result) noexcept;
  [[nodiscard]] Odometer odometer(const PairGateState& gate) const noexcept;
  void pass_gate(const GripPose& grip, StepResult& result) noexcept;
  void spend_budget(const GripPose& grip, StepResult& result) noexcept;
  [[nodiscard]] PairPose pose_of(std::uint32_t pair, const GripPose& grip) noexcept;
  void visit(std::uint32_t pair, const GripPose& grip, StepResult& result) noexcept;
  void hold(const Candidate& candidate, const GripPose& grip, StepResult& result) noexcept;
  void touch(PairState& pair, const PairPose& pose, StepResult& result) noexcept;
  void report_nearest(std::uint32_t pair, Real d_near_m, StepResult& result) const noexcept;
  [[nodiscard]] Wrench total_wrench(StepResult& result) noexcept;
  void add_to_group(const ContactPatch& patch, ContactPatch& group) noexcept;
  void chain_hash(const StepResult& result) noexcept;
  void raise_peaks(const StepCounters& counters) noexcept;
};

void HapticCore::State::place(Arena& arena, const SceneView& view) noexcept {
  const SceneCapacity& c = view.header().capacity;
  const std::uint32_t moving_pieces = view.bodies()[0].piece_count;
  pairs = arena.take<PairState>(c.pair_count);
  gates = arena.take<PairGateState>(c.pair_count);
  bodies = arena.take<BodyMotion>(view.bodies().size());
  moving_lanes = arena.take<Real>(3 * std::size_t{c.moving_lanes});
  lanes_begin = arena.take<std::size_t>(moving_pieces);
  lanes_turned_at = arena.take<std::uint64_t>(moving_pieces);
  NearScratch::Size size;
  for (std::uint32_t i = 0; i < c.pair_count; ++i) {
    const PairRecord& record = view.pairs()[i];
    const PieceRecord& a = view.pieces()[record.piece_a];
    const PieceRecord& b = view.pieces()[record.piece_b];
    size.fit(a, b);
    FeatureBounds bounds;
    bounds.place(arena, a, b);
    if (!pairs.empty()) pairs[i].bounds = bounds;
  }
  scratch.place(arena, size);
  // A pair that is held for want of budget adds the one node that it keeps.
  const std::size_t near_nodes = std::size_t{c.max_near_nodes} + c.pair_count;
  near = BoundedList<NearNode>(arena.take<NearNode>(near_nodes));
  contact_nodes = BoundedList<std::uint32_t>(arena.take<std::uint32_t>(near_nodes));
  candidates = BoundedList<Candidate>(arena.take<Candidate>(c.pair_count));
  patches = BoundedList<ContactPatch>(arena.take<ContactPatch>(c.pair_count));
  merged = arena.take<std::uint8_t>(c.pair_count);
  hull.points = arena.take<PlanePoint>(near_nodes);
  hull.hull = arena.take<PlanePoint>(2 * near_nodes);
  if (view.parameters().law == LawId::kPaper) {
    points = BoundedList<Vec3>(arena.take<Vec3>(near_nodes));
    merged_points = BoundedList<Vec3>(arena.take<Vec3>(near_nodes));
  } else {
    contacts = BoundedList<WeightedContact>(arena.take<WeightedContact>(near_nodes));
  }
}

void HapticCore::State::read_scene(const SceneView& view) noexcept {
  scene = view;
  const SceneParameters& p = scene.parameters();
  grip_a = to_vec3(scene.bodies()[0].reference_m);
  law = p.law;
  k_f_n_per_m = static_cast<Real>(p.k_f_n_per_m);
  epsilon_m = static_cast<Real>(p.epsilon_m);
  epsilon_o_m = static_cast<Real>(p.epsilon_o_m);
  exact_band_m = p.exact_band_m;
  max_visits = scene.header().capacity.max_pair_visits;
  if (p.motion_limits_given != 0) {
    max_step_m = static_cast<Real>(p.max_linear_speed_m_per_s / p.rate_hz) * kMotionMargin;
    max_turn_rad = static_cast<Real>(p.max_angular_speed_rad_per_s / p.rate_hz) * kMotionMargin;
  }
  std::size_t lanes = 0;
  for (std::uint32_t i = 0; i < lanes_begin.size(); ++i) {
    lanes_begin[i] = lanes;
    lanes += 3 * std::size_t{scene.piece(i).lane_count};
  }
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    bodies[i].reference_w = to_vec3(scene.bodies()[i].reference_m);
  }
  for (std::uint32_t i = 0; i < pairs.size(); ++i) {
    pairs[i].view = scene.pair(i);
    gates[i].reach_a_m = pairs[i].view.a.record->reach_m;
    gates[i].reach_b_m = pairs[i].view.b.record->reach_m;
    gates[i].body_b = pairs[i].view.b.record->body;
  }
  forget();
}

void HapticCore::State::forget() noexcept {
  for (PairState& pair : pairs) {
    pair.bounds.reset();
    pair.verdict_memory = VerdictMemory{};
    pair.visited_at = 0;
    pair.exact = false;
    pair.situation = ContactSituation::kNone;
  }
  for (PairGateState& gate : gates) gate.plane = GatePlane{};
  for (BodyMotion& body : bodies) body.swept_m = 0;
  for (std::uint64_t& turned : lanes_turned_at) turned = 0;
  motion = MotionSum{};
  has_last = false;
  tick = 0;
  hash = kHashStart;
  peaks = StepPeaks{};
}

std::size_t HapticCore::state_bytes(const SceneView& scene) noexcept {
  Arena counting;
  State state;
  const std::size_t fixed = (sizeof(HapticCore) + sizeof(State) + kStateAlignment - 1) /
                            kStateAlignment * kStateAlignment;
  state.place(counting, scene);
  return (fixed + counting.used() + kStateAlignment - 1) / kStateAlignment * kStateAlignment;
}

RtStatus HapticCore::create(std::span<std::byte> memory, const SceneView& scene,
                            HapticCore*& core) noexcept {
  core = nullptr;
  const std::size_t needed = state_bytes(scene);
  if (scene.header().capacity.state_bytes != needed) return RtStatus::kBlobBadCapacity;
  if (reinterpret_cast<std::uintptr_t>(memory.data()) % kStateAlignment != 0)
    return RtStatus::kMemoryMisaligned;
  if (memory.size() < needed) return RtStatus::kMemoryTooSmall;
  static_assert(alignof(State) <= alignof(std::max_align_t) &&
                sizeof(HapticCore) % alignof(State) == 0);
  State* const state =
      ::new (static_cast<void*>(memory.data() + sizeof(HapticCore))) State();  // placement, no heap
  const std::size_t fixed = (sizeof(HapticCore) + sizeof(State) + kStateAlignment - 1) /
                            kStateAlignment * kStateAlignment;
  Arena arena(memory.data() + fixed);
  state->place(arena, scene);
  state->read_scene(scene);
  core = ::new (static_cast<void*>(memory.data())) HapticCore(state);  // placement, no heap
  return RtStatus::kOk;
}

void HapticCore::reset() noexcept { state_->forget(); }

/// Odometers, each step rounded up; a tick at rest leaves them alone.
void HapticCore::State::advance(const GripPose& grip, StepResult& result) noexcept {
  tick += 1;
  if (has_last) {
    const Real step = std::sqrt((grip.x0_w - last.x0_w).squaredNorm());
    const Real turn = 2 * quaternion_step(grip.q_wa, last.q_wa);
    if (max_step_m > 0 && step > max_step_m) result.flags |= kFlagMotionExceeded;
    if (max_turn_rad > 0 && turn > max_turn_rad) result.flags |= kFlagMotionExceeded;
    if (step != 0 || turn != 0) {
      constexpr double kUp = 1 + 64 * static_cast<double>(kRealEpsilon);
      motion.path_m = (motion.path_m + static_cast<double>(step) * kUp) * (1 + 0x1p-52);
      motion.turn_rad = (motion.turn_rad + static_cast<double>(turn) * kUp) * (1 + 0x1p-52);
      for (BodyMotion& body : bodies) {
        const Real distance = std::sqrt((last.x0_w - body.reference_w).squaredNorm()) + step;
        body.swept_m = (body.swept_m + static_cast<double>(turn * distance) * kUp) * (1 + 0x1p-52);
      }
    }
  }
  last = grip;
  has_last = true;
}

Odometer HapticCore::State::odometer(const PairGateState& gate) const noexcept {
  const double swept = bodies[gate.body_b].swept_m;
  return {motion.path_m + (swept + motion.turn_rad * gate.reach_b_m),
          motion.path_m + motion.turn_rad * gate.reach_a_m};
}

void HapticCore::State::report_nearest(std::uint32_t pair, Real d_near_m,
                                       StepResult& result) const noexcept {
  if (d_near_m < result.d_near_m || (d_near_m == result.d_near_m && pair < result.nearest_pair)) {
    result.d_near_m = d_near_m;
    result.nearest_pair = pair;
  }
}

/// Sorts the pairs into those that a plane proves to be far and the candidates for a visit.
void HapticCore::State::pass_gate(const GripPose& grip, StepResult& result) noexcept {
  candidates.clear();
  for (std::uint32_t i = 0; i < gates.size(); ++i) {
    PairGateState& gate = gates[i];
    const Odometer now = odometer(gate);
    double gap = gate.plane.gap_m(now);
    if (!is_far(gap, gate.plane.face, exact_band_m)) {
      const Vec3 y_w = grip.x0_w - bodies[gate.body_b].reference_w;
      if (pairs[i].visited_at == 0) {
        gate.plane = sphere_gate(pairs[i].view, grip.r_wa, y_w, now);
        gap = gate.plane.gap_m(now);
      } else if (renew_gate(pairs[i].view, grip.r_wa, y_w, now, exact_band_m, gate.plane)) {
        result.counters.support_pairs += 1;
        gap = gate.plane.gap_m(now);
      }
    }
    if (is_far(gap, gate.plane.face, exact_band_m)) {
      result.flags |= kFlagFarBand;
      report_nearest(i, static_cast<Real>(gap), result);
    } else {
      static_cast<void>(candidates.push({gap, i}));
    }
  }
}

/// Visits the candidates, nearest first while the budget lasts; the others keep their last plane.
void HapticCore::State::spend_budget(const GripPose& grip, StepResult& result) noexcept {
  std::uint32_t visits = candidates.size();
  if (visits > max_visits) {
    const auto nearer = [](const Candidate& l, const Candidate& r) {
      return l.gap_m < r.gap_m || (l.gap_m == r.gap_m && l.pair < r.pair);
    };
    // A heap sort: no recursion, n log n.
    std::make_heap(candidates.begin(), candidates.end(), nearer);
    std::sort_heap(candidates.begin(), candidates.end(), nearer);
    visits = max_visits;
    result.flags |= kFlagBudgetUsedUp;
  }
  for (std::uint32_t k = 0; k < candidates.size(); ++k) {
    if (k < visits) {
      visit(candidates[k].pair, grip, result);
    } else {
      hold(candidates[k], grip, result);
    }
  }
}

/// The pair's pose; turns the vertices of its piece of A if no pair before it has.
PairPose HapticCore::State::pose_of(std::uint32_t pair, const GripPose& grip) noexcept {
  const PairView& view = pairs[pair].view;
  const std::uint32_t piece = view.record->piece_a;
  Real* const lanes = moving_lanes.data() + lanes_begin[piece];
  if (lanes_turned_at[piece] != tick) {
    turn_vertices(view.a, grip.r_wa, lanes);
    lanes_turned_at[piece] = tick;
  }
  return make_pair_pose(view, lanes, grip.r_wa, grip.x0_w - bodies[gates[pair].body_b].reference_w);
}

void HapticCore::State::visit(std::uint32_t index, const GripPose& grip,
                              StepResult& result) noexcept {
  PairState& pair = pairs[index];
  const PairPose pose = pose_of(index, grip);
  const Odometer now = odometer(gates[index]);
  pair.bounds.advance(now, pose.size_m);
  const bool first = pair.visited_at == 0;
  pair.near_begin = near.size();
  const NearResult found = find_near_set(pose, epsilon_m, pair.bounds, scratch, near);
  pair.near_count = near.size() - pair.near_begin;
  pair.verdict = pair_verdict(pose, found, pair.verdict_memory);
  pair.exact = (found.flags & kNearEdgePairsCut) == 0;
  pair.d_near_m = found.d_near_m;
  if (pair.verdict.verdict == Verdict::kSeparated) {
    pair.d_near_m = std::max(pair.d_near_m, pair.verdict.separation_bound_m);
  }
  pair.best = found.best;
  pair.visited_at = tick;
  gates[index].plane = gate_plane(pose, found, now);

  StepCounters& counters = result.counters;
  counters.pair_visits += 1;
  counters.feature_evaluations += found.feature_evaluations;
  counters.edge_pairs += found.edge_pairs;
  counters.support_pairs += found.support_pairs + pair.verdict.support_pairs;
  counters.near_nodes += pair.near_count;
  if ((found.flags & kNearAllStale) != 0) {
    counters.stale_pairs += 1;
    result.flags |= first ? kFlagFirstTick : kFlagRelocalised;
  }
  if ((found.flags & kNearSetCut) != 0) result.flags |= kFlagNearSetCut;
  if (!pair.exact) result.flags |= kFlagInexact;
  if (pair.verdict.verdict == Verdict::kTouching) result.flags |= kFlagVerdictTouching;
  if (pair.verdict.verdict == Verdict::kUndecided) result.flags |= kFlagVerdictUndecided;
  report_nearest(index, pair.d_near_m, result);
  touch(pair, pose, result);
}

/// No budget is left for this pair: its last nearest C-face is taken to be the nearest still.
void HapticCore::State::hold(const Candidate& candidate, const GripPose& grip,
                             StepResult& result) noexcept {
  const std::uint32_t index = candidate.pair;
  PairState& pair = pairs[index];
  pair.exact = false;
  if (pair.visited_at == 0) {
    report_nearest(index, static_cast<Real>(candidate.gap_m), result);
    return;
  }
  const PairPose pose = pose_of(index, grip);
  const NodePlane plane = node_plane(pose, pair.best.type, pair.best.i, pair.best.j);
  if (plane.defined) {
    pair.best.normal_w = plane.normal_w;
    pair.best.f_m = plane.f_m;
    pair.d_near_m = plane.f_m;
  }
  pair.near_begin = near.size();
  pair.near_count = near.push(pair.best) ? 1 : 0;
  report_nearest(index, pair.d_near_m, result);
  touch(pair, pose, result);
}

/// Contact region of a pair whose near set stands in the list.
void HapticCore::State::touch(PairState& pair, const PairPose& pose, StepResult& result) noexcept {
  pair.contact_begin = contact_nodes.size();
  pair.contact_count = 0;
  if (pair.d_near_m > 0) {
    pair.situation = ContactSituation::kNone;
    return;
  }
  const std::span<NearNode> nodes(near.begin() + pair.near_begin, pair.near_count);
  locate_contacts(pose, nodes);
  bool several_planes = false;
  ContactPatch patch =
      make_contact_patch(pose, nodes, pair.d_near_m, epsilon_m, contact_nodes, several_planes);
  patch.near_begin = pair.near_begin;
  patch.near_count = pair.near_count;
  pair.contact_count = contact_nodes.size() - pair.contact_begin;
  pair.situation = settled_situation(nodes, pair.d_near_m, epsilon_m, pair.situation);
  if (law == LawId::kPaper) {
    if (several_planes) result.flags |= kFlagSeveralPlanes;
    collect_points(nodes, epsilon_m, points, patch);
    patch.situation = several_planes ? ContactSituation::kSeveralPlanes
                                     : situation_of(nodes, pair.d_near_m, epsilon_m, 1);
  }
  static_cast<void>(patches.push(patch));
}

/// Takes a patch's contacts into the lists of its group: the near nodes with their weights, or the
/// paper's distinct points.
void HapticCore::State::add_to_group(const ContactPatch& patch, ContactPatch& group) noexcept {
  group.d_near_m = std::min(group.d_near_m, patch.d_near_m);
  if (law == LawId::kPaper) {
    const Real distance = patch.merge_distance_m;
    for (std::uint32_t k = 0; k < patch.point_count; ++k) {
      const Vec3& p = points[patch.point_begin + k];
      bool known = false;
      for (const Vec3& q : merged_points) {
        known = known || (q - p).squaredNorm() <= distance * distance;
      }
      if (!known) static_cast<void>(merged_points.push(p));
    }
    return;
  }
  for (std::uint32_t k = 0; k < patch.near_count; ++k) {
    const NearNode& n = near[patch.near_begin + k];
    Real weight =
        contact_weight(n.f_m, patch.d_near_m, n.violation_m, n.outside_m, epsilon_m, epsilon_o_m);
    if (n.rise_m > (kMaxRise - 1) * epsilon_m) weight *= kMaxRise - n.rise_m / epsilon_m;
    if (weight > 0) static_cast<void>(contacts.push({n.normal_w, n.app_w, weight}));
  }
}

/// Contacts of one body in one plane are one contact: deepest D_near once, points united (method
/// section 10).
Wrench HapticCore::State::total_wrench(StepResult& result) noexcept {
  Wrench total;
  std::fill_n(merged.begin(), patches.size(), std::uint8_t{0});
  for (std::uint32_t i = 0; i < patches.size(); ++i) {
    if (merged[i] != 0) continue;
    ContactPatch group = patches[i];
    merged_points.clear();
    contacts.clear();
    add_to_group(patches[i], group);
    for (std::uint32_t j = i + 1; j < patches.size(); ++j) {
      const ContactPatch& other = patches[j];
      const bool same_plane =
          other.body_b == group.body_b &&
          (other.normal_w - patches[i].normal_w).squaredNorm() <=
              kSamePlaneChord * kSamePlaneChord &&
          std::abs(other.d_near_m - patches[i].d_near_m) <= other.merge_distance_m;
      if (!same_plane || merged[j] != 0) continue;
      merged[j] = 1;
      add_to_group(other, group);
    }
    Wrench wrench;
    std::uint32_t hull_points = 0;
    if (law == LawId::kPaper) {
      hull_points = merged_points.size();
      wrench = paper_wrench(group, merged_points.view(), k_f_n_per_m, group.size_m, hull);
    } else {
      hull_points = contacts.size();
      wrench =
          weighted_region_wrench(contacts.view(), group.d_near_m, k_f_n_per_m, group.size_m, hull);
    }
    result.counters.hull_points = std::max(result.counters.hull_points, hull_points);
    total.force_w += wrench.force_w;
    total.torque_w += wrench.torque_w;
  }
  return total;
}

void HapticCore::State::chain_hash(const StepResult& result) noexcept {
  StateHash chain(hash);
  chain.add(result.wrench_w.force_w);
  chain.add(result.wrench_w.torque_w);
  chain.add(result.d_near_m);
  chain.add(std::uint64_t{result.flags} << 32 | result.nearest_pair);
  chain.add(std::uint64_t{result.counters.feature_evaluations} << 32 | result.counters.edge_pairs);
  chain.add(std::uint64_t{result.counters.near_nodes} << 32 | result.counters.support_pairs);
  hash = chain.value();
}

StepResult HapticCore::step(const StepInput& input) noexcept {
  State& s = *state_;
  StepResult result;
  result.status = check_pose(input.pose_wa);
  if (result.status != RtStatus::kOk) {
    result.flags = kFlagBadPose;
    result.state_hash = s.hash;
    return result;
  }
  GripPose grip;
  grip.q_wa = input.pose_wa.q_wa.normalized();
  grip.r_wa = grip.q_wa.toRotationMatrix();
  grip.x0_w = input.pose_wa.p_wa + grip.r_wa * s.grip_a;

  s.near.clear();
  s.contact_nodes.clear();
  s.patches.clear();
  s.points.clear();
  result.d_near_m = std::numeric_limits<Real>::max();
  s.advance(grip, result);
  s.pass_gate(grip, result);
  s.spend_budget(grip, result);
  const PairState& nearest = s.pairs[result.nearest_pair];
  if (nearest.visited_at == s.tick) {
    result.situation = nearest.situation;
    result.near_count = nearest.near_count;
  }
  result.wrench_w = s.total_wrench(result);
  s.chain_hash(result);
  s.raise_peaks(result.counters);
  result.state_hash = s.hash;
  return result;
}

void HapticCore::State::raise_peaks(const StepCounters& counters) noexcept {
  for (const auto field :
       {&StepCounters::pair_visits, &StepCounters::support_pairs,
        &StepCounters::feature_evaluations, &StepCounters::edge_pairs, &StepCounters::near_nodes,
        &StepCounters::hull_points, &StepCounters::stale_pairs}) {
    peaks.*field = std::max(peaks.*field, counters.*field);
  }
}

std::uint32_t HapticCore::pair_count() const noexcept {
  return static_cast<std::uint32_t>(state_->pairs.size());
}

const StepPeaks& HapticCore::peaks() const noexcept { return state_->peaks; }

PairReport HapticCore::pair_report(std::uint32_t index) const noexcept {
  const State& s = *state_;
  const PairState& pair = s.pairs[index];
  PairReport report;
  if (s.tick == 0) return report;
  report.visited = pair.visited_at == s.tick;
  if (report.visited) {
    report.verdict = pair.verdict.verdict;
    report.normal_w = pair.verdict.normal_w;
    report.separation_bound_m = pair.verdict.separation_bound_m;
    report.thickness_m = pair.verdict.thickness_m;
    report.portal = pair.verdict_memory.portal;
    report.d_near_m = pair.d_near_m;
    report.exact = pair.exact;
    report.best_node = pair.best.node;
    report.near = s.near.view().subspan(pair.near_begin, pair.near_count);
    report.contact_nodes = s.contact_nodes.view().subspan(pair.contact_begin, pair.contact_count);
    report.situation = pair.situation;
    return report;
  }
  const PairGateState& gate = s.gates[index];
  const double gap = gate.plane.gap_m(s.odometer(gate));
  if (is_far(gap, gate.plane.face, s.exact_band_m)) {
    report.verdict = Verdict::kSeparated;
    report.separation_bound_m = static_cast<Real>(gap);
    report.d_near_m = static_cast<Real>(gap);
    report.normal_w = gate.plane.of_a ? Vec3(s.last.r_wa * gate.plane.normal) : gate.plane.normal;
  } else {  // held for want of budget
    report.d_near_m = pair.d_near_m;
    report.normal_w = pair.best.normal_w;
    report.situation = pair.situation;
  }
  return report;
}

}  // namespace haptic
