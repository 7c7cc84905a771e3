// SPDX-License-Identifier: Apache-2.0
#include "rt_core/haptic_core.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/bounded_list.hpp"
#include "rt_core/contact/contact_region.hpp"
#include "rt_core/contact/contact_tracker.hpp"
#include "rt_core/contact/pair_pose.hpp"
#include "rt_core/law/paper_law.hpp"

namespace haptic {
namespace {

/// Two patches of one static body are one contact when their planes agree this closely.
constexpr Real kSamePlaneChord = HAPTIC_REAL_IS_FLOAT ? 1.0e-3_r : 1.0e-6_r;

/// What the core keeps of each pair besides its track.
struct PairState {
  PairView view;
  PairTrack track;
  BoundedList<std::uint32_t> near_nodes;     ///< numbers of the near set
  BoundedList<std::uint32_t> contact_nodes;  ///< those with their point in both features
  ContactSituation situation = ContactSituation::kNone;
  Vec3 reference_w = Vec3::Zero();  ///< of B's body
  Real lever_m = 0;                 ///< largest distance of this piece of A from x_0^A
  bool relocalised = false;
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

/// FNV-1a over 64-bit words.
class StateHash {
 public:
  void add(std::uint64_t word) noexcept {
    hash_ = (hash_ ^ word) * 0x100000001b3ull;
    hash_ ^= hash_ >> 32;
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
  [[nodiscard]] std::uint64_t value() const noexcept { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325ull;
};

}  // namespace

struct HapticCore::State {
  SceneView scene;
  Vec3 grip_a = Vec3::Zero();  ///< grip point in A's mesh frame
  Real k_f_n_per_m = 0;
  Real epsilon_m = 0;
  MovingGeometry moving;
  std::span<PairState> pairs;
  TrackerScratch tracker;
  BoundedList<ContactPatch> patches;
  BoundedList<Vec3> points;         ///< of all patches
  BoundedList<Vec3> merged_points;  ///< of the patches that share a plane
  std::span<std::uint8_t> merged;   ///< per patch: already part of an earlier one
  HullScratch hull;
  GripPose last;
  bool has_last = false;

  /// Places everything in `arena`; with a counting arena only the size is computed.
  void place(Arena& arena, const SceneView& view) noexcept;
  void bind_pairs() noexcept;
  void visit_pair(PairState& pair, const GripPose& grip, StepResult& result) noexcept;
  [[nodiscard]] Wrench total_wrench() noexcept;
  [[nodiscard]] std::uint64_t hash(const StepResult& result) const noexcept;
};

void HapticCore::State::place(Arena& arena, const SceneView& view) noexcept {
  const SceneCapacity& c = view.header().capacity;
  moving.vertices_w = arena.take<Real>(3 * std::size_t{c.moving_vertices}).data();
  moving.normals_w = arena.take<Real>(3 * std::size_t{c.moving_faces}).data();
  moving.directions_w = arena.take<Real>(3 * std::size_t{c.moving_edges}).data();
  pairs = arena.take<PairState>(c.pair_count);
  for (std::uint32_t i = 0; i < c.pair_count; ++i) {
    const std::size_t near = view.pairs()[i].near_capacity;
    const auto near_nodes = arena.take<NearNode>(near);
    const auto near_numbers = arena.take<std::uint32_t>(near);
    const auto contact_nodes = arena.take<std::uint32_t>(near);
    if (pairs.empty()) continue;
    pairs[i].track.near = BoundedList<NearNode>(near_nodes);
    pairs[i].near_nodes = BoundedList<std::uint32_t>(near_numbers);
    pairs[i].contact_nodes = BoundedList<std::uint32_t>(contact_nodes);
  }
  const auto marks = arena.take<std::uint64_t>((std::size_t{c.largest_pair_nodes} + 63) / 64);
  const auto reached = arena.take<std::uint32_t>(c.largest_pair_nodes);
  tracker.reached = NodeSet(marks, reached);
  tracker.reached_f = arena.take<Real>(c.largest_pair_nodes);
  tracker.candidates =
      BoundedList<NearNode>(arena.take<NearNode>(std::size_t{kCandidateFactor} * c.largest_near));
  patches = BoundedList<ContactPatch>(arena.take<ContactPatch>(c.pair_count));
  merged = arena.take<std::uint8_t>(c.pair_count);
  points = BoundedList<Vec3>(arena.take<Vec3>(c.total_near));
  merged_points = BoundedList<Vec3>(arena.take<Vec3>(c.total_near));
  hull.points = arena.take<PlanePoint>(c.total_near);
  hull.hull = arena.take<PlanePoint>(2 * std::size_t{c.total_near});
}

void HapticCore::State::bind_pairs() noexcept {
  for (std::uint32_t i = 0; i < pairs.size(); ++i) {
    PairState& pair = pairs[i];
    pair.view = scene.pair(i);
    const PieceRecord& a = *pair.view.a.record;
    pair.reference_w = to_vec3(scene.bodies()[pair.view.b.record->body].reference_m);
    pair.lever_m = std::sqrt(to_vec3(a.centre_m).squaredNorm()) + static_cast<Real>(a.radius_m);
  }
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
  state->scene = scene;
  state->grip_a = to_vec3(scene.bodies()[0].reference_m);
  state->k_f_n_per_m = static_cast<Real>(scene.parameters().k_f_n_per_m);
  state->epsilon_m = static_cast<Real>(scene.parameters().epsilon_m);
  state->bind_pairs();
  core = ::new (static_cast<void*>(memory.data())) HapticCore(state);  // placement, no heap
  return RtStatus::kOk;
}

void HapticCore::reset() noexcept {
  for (PairState& pair : state_->pairs) {
    pair.track.valid = false;
    pair.track.verdict = VerdictMemory{};
    pair.track.audit_next = 0;
    pair.track.audit_node = 0;
    pair.track.audit_support = SupportPair{};
    pair.track.near.clear();
    pair.near_nodes.clear();
    pair.contact_nodes.clear();
  }
  state_->has_last = false;
}

void HapticCore::State::visit_pair(PairState& pair, const GripPose& grip,
                                   StepResult& result) noexcept {
  const PairPose pose = make_pair_pose(pair.view, moving, grip.r_wa, grip.x0_w - pair.reference_w);
  PairMotion motion;
  if (has_last) {
    motion.bound_m = std::sqrt((grip.x0_w - last.x0_w).squaredNorm()) +
                     2 * quaternion_step(grip.q_wa, last.q_wa) * pair.lever_m;
  }
  const TrackResult tracked = track_pair(pose, motion, epsilon_m, pair.track, tracker);
  result.counters.nodes_evaluated += tracked.nodes_evaluated;
  result.counters.support_pairs += tracked.support_pairs;
  result.counters.pair_visits += 1;
  pair.relocalised = (tracked.flags & kTrackRelocalised) != 0;
  result.counters.relocalised_pairs += pair.relocalised ? 1 : 0;
  constexpr struct {
    std::uint32_t track, step;
  } kFlags[] = {{kTrackRelocalised, kFlagRelocalised},  {kTrackFirst, kFlagFirstTick},
                {kTrackEmpty, kFlagLocalSetEmpty},      {kTrackContradiction, kFlagContradiction},
                {kTrackNearCut, kFlagNearSetCut},       {kTrackUndecided, kFlagVerdictUndecided},
                {kTrackOverflow, kFlagLocalSetOverflow}};
  for (const auto& flag : kFlags) result.flags |= (tracked.flags & flag.track) != 0 ? flag.step : 0;

  pair.near_nodes.clear();
  for (const NearNode& n : pair.track.near) static_cast<void>(pair.near_nodes.push(n.node));
  pair.contact_nodes.clear();
  pair.situation = ContactSituation::kNone;
  if (pair.track.d_near_m > 0) return;
  bool several_planes = false;
  const ContactPatch patch =
      make_contact_patch(pose, pair.track, epsilon_m, points, pair.contact_nodes, several_planes);
  if (several_planes) result.flags |= kFlagSeveralPlanes;
  pair.situation = patch.situation;
  static_cast<void>(patches.push(patch));
}

Wrench HapticCore::State::total_wrench() noexcept {
  Wrench total;
  std::fill(merged.begin(), merged.end(), std::uint8_t{0});
  for (std::uint32_t i = 0; i < patches.size(); ++i) {
    if (merged[i] != 0) continue;
    // Contacts of one body in one plane are one contact: deepest D_near once, points united (method
    // section 10).
    ContactPatch group = patches[i];
    merged_points.clear();
    for (std::uint32_t j = i; j < patches.size(); ++j) {
      const ContactPatch& other = patches[j];
      const bool same_plane =
          other.body_b == group.body_b &&
          (other.normal_w - patches[i].normal_w).squaredNorm() <=
              kSamePlaneChord * kSamePlaneChord &&
          std::abs(other.d_near_m - patches[i].d_near_m) <= other.merge_distance_m;
      if (j != i && !same_plane) continue;
      merged[j] = 1;
      group.d_near_m = std::min(group.d_near_m, other.d_near_m);
      for (std::uint32_t k = 0; k < other.point_count; ++k) {
        const Vec3& p = points[other.point_begin + k];
        bool known = false;
        for (const Vec3& q : merged_points) {
          known = known || (q - p).squaredNorm() <= other.merge_distance_m * other.merge_distance_m;
        }
        if (!known) static_cast<void>(merged_points.push(p));
      }
    }
    const Wrench wrench =
        paper_wrench(group, merged_points.view(), k_f_n_per_m, group.size_m, hull);
    total.force_w += wrench.force_w;
    total.torque_w += wrench.torque_w;
  }
  return total;
}

std::uint64_t HapticCore::State::hash(const StepResult& result) const noexcept {
  StateHash hash;
  for (const PairState& pair : pairs) {
    hash.add(pair.track.d_near_m);
    hash.add(std::uint64_t{pair.track.best_node});
    for (const NearNode& n : pair.track.near) {
      hash.add(std::uint64_t{n.node});
      hash.add(n.plane.f_m);
    }
    for (const Vec3& d : pair.track.verdict.direction_w) hash.add(d);
    for (const SupportPair& s : {pair.track.verdict.last_support, pair.track.audit_support}) {
      hash.add(std::uint64_t{s.a} << 32 | s.b);
    }
    hash.add(std::uint64_t{pair.track.audit_next} << 33 |
             std::uint64_t{pair.track.audit_node} << 1 | (pair.track.verdict.warm ? 1u : 0u));
  }
  hash.add(result.wrench_w.force_w);
  hash.add(result.wrench_w.torque_w);
  hash.add(std::uint64_t{result.flags});
  return hash.value();
}

StepResult HapticCore::step(const StepInput& input) noexcept {
  State& s = *state_;
  StepResult result;
  result.status = check_pose(input.pose_wa);
  if (result.status != RtStatus::kOk) {
    result.flags = kFlagBadPose;
    return result;
  }
  GripPose grip;
  grip.q_wa = input.pose_wa.q_wa.normalized();
  grip.r_wa = grip.q_wa.toRotationMatrix();
  grip.x0_w = input.pose_wa.p_wa + grip.r_wa * s.grip_a;

  const std::uint32_t moving_pieces = s.scene.bodies()[0].piece_count;
  for (std::uint32_t i = 0; i < moving_pieces; ++i)
    turn_piece(s.scene.piece(i), grip.r_wa, s.moving);
  s.patches.clear();
  s.points.clear();
  result.d_near_m = std::numeric_limits<Real>::max();
  for (std::uint32_t i = 0; i < s.pairs.size(); ++i) {
    PairState& pair = s.pairs[i];
    s.visit_pair(pair, grip, result);
    if (pair.track.d_near_m < result.d_near_m) {
      result.d_near_m = pair.track.d_near_m;
      result.nearest_pair = i;
      result.near_count = pair.track.near.size();
      result.situation = pair.situation;
    }
  }
  result.wrench_w = s.total_wrench();
  s.last = grip;
  s.has_last = true;
  result.state_hash = s.hash(result);
  return result;
}

std::uint32_t HapticCore::pair_count() const noexcept {
  return static_cast<std::uint32_t>(state_->pairs.size());
}
Real HapticCore::pair_d_near_m(std::uint32_t pair) const noexcept {
  return state_->pairs[pair].track.d_near_m;
}
std::span<const std::uint32_t> HapticCore::pair_near_nodes(std::uint32_t pair) const noexcept {
  return state_->pairs[pair].near_nodes.view();
}
std::span<const std::uint32_t> HapticCore::pair_contact_nodes(std::uint32_t pair) const noexcept {
  return state_->pairs[pair].contact_nodes.view();
}
ContactSituation HapticCore::pair_situation(std::uint32_t pair) const noexcept {
  return state_->pairs[pair].situation;
}
std::uint32_t HapticCore::pair_neighborhood_size(std::uint32_t pair) const noexcept {
  return state_->pairs[pair].track.neighborhood_size;
}
bool HapticCore::pair_relocalised(std::uint32_t pair) const noexcept {
  return state_->pairs[pair].relocalised;
}

}  // namespace haptic
