// SPDX-License-Identifier: Apache-2.0
// Memory of the core, its start, and the odometers.
#include "rt_core/core_state.hpp"

#include <algorithm>
#include <cmath>

namespace haptic {
namespace {

/// How much more than the stated motion a tick may bring before it is flagged: rounding of the
/// device's own pose.
constexpr Real kMotionMargin = 1.000001_r;

Vec3 to_vec3(const double (&v)[3]) noexcept {
  return {static_cast<Real>(v[0]), static_cast<Real>(v[1]), static_cast<Real>(v[2])};
}

MotionEnvelope envelope_of(const SceneParameters& p) noexcept {
  MotionEnvelope envelope;
  const EnvelopeParameters& e = p.envelope;
  if ((e.given & kOrientationGiven) != 0) {
    const double* q = e.q_wa_xyzw;
    envelope.q_wa = Quat(static_cast<Real>(q[3]), static_cast<Real>(q[0]), static_cast<Real>(q[1]),
                         static_cast<Real>(q[2]))
                        .normalized();
    envelope.max_angle_rad = static_cast<Real>(e.max_angle_rad);
  }
  if ((e.given & kWorkspaceGiven) != 0) {
    envelope.centre_w = (to_vec3(e.min_m) + to_vec3(e.max_m)) / 2;
    envelope.half_extent_m = (to_vec3(e.max_m) - to_vec3(e.min_m)) / 2;
  }
  return envelope;
}

bool pair_has_hidden(const PairView& pair) noexcept {
  if (pair.is_fixed()) return pair.fixed->hidden != 0;
  const auto counts = [&](NodeScope scope) {
    return live_counts(pair.marks, scope, *pair.record, *pair.a.record, *pair.b.record);
  };
  return has_hidden(counts(NodeScope::kReachable), counts(NodeScope::kLive));
}

/// Length of the difference of two unit quaternions, sign-aligned: the chord of the turn between
/// them is at most twice that.
Real quaternion_step(const Quat& l, const Quat& r) noexcept {
  const Real minus = (l.coeffs() - r.coeffs()).squaredNorm();
  const Real plus = (l.coeffs() + r.coeffs()).squaredNorm();
  return std::sqrt(std::min(minus, plus));
}

}  // namespace

void HapticCore::State::place(Arena& arena, const SceneView& view) noexcept {
  const SceneCapacity& c = view.header().capacity;
  const std::uint32_t moving_pieces = view.bodies()[0].piece_count;
  arena.enter(StatePart::kPairs);
  pairs = arena.take<PairState>(c.pair_count);
  gates = arena.take<PairGateState>(c.pair_count);
  bodies = arena.take<BodyMotion>(view.bodies().size());
  if (!view.is_fixed()) {
    moving_lanes = arena.take<Real>(3 * std::size_t{c.moving_lanes});
    lanes_begin = arena.take<std::size_t>(moving_pieces);
    lanes_turned_at = arena.take<std::uint64_t>(moving_pieces);
  }
  NearScratch::Size size;
  arena.enter(StatePart::kBounds);
  for (std::uint32_t i = 0; i < c.pair_count; ++i) {
    const PairRecord& record = view.pairs()[i];
    const PieceRecord& a = view.pieces()[record.piece_a];
    const PieceRecord& b = view.pieces()[record.piece_b];
    if (view.is_fixed()) continue;  // planes need no history
    size.fit(a, b);
    FeatureBounds bounds;
    bounds.place(arena, a, b);
    if (!pairs.empty()) pairs[i].bounds = bounds;
  }
  arena.enter(StatePart::kSearch);
  scratch.place(arena, size);
  // A pair that is held for want of budget adds the one node that it keeps.
  const std::size_t near_nodes = std::size_t{c.max_near_nodes} + c.pair_count;
  arena.enter(StatePart::kContacts);
  near = BoundedList<NearNode>(arena.take<NearNode>(near_nodes));
  contact_nodes = BoundedList<std::uint32_t>(arena.take<std::uint32_t>(near_nodes));
  candidates = BoundedList<Candidate>(arena.take<Candidate>(c.pair_count));
  const std::uint32_t patch_count = kMergesPatches ? c.pair_count : 0;
  patches = BoundedList<ContactPatch>(arena.take<ContactPatch>(patch_count));
  joined = arena.take<bool>(patch_count);
  const std::size_t hull_points = kFormsHulls ? near_nodes : 0;
  hull.points = arena.take<PlanePoint>(hull_points);
  hull.hull = arena.take<PlanePoint>(2 * hull_points);
  arena.enter(StatePart::kOutput);
  output.twist = arena.take<TwistEstimator>(view.parameters().device.given != 0 ? 1 : 0);
  const LawId id = view.parameters().law;
  arena.enter(StatePart::kLaw);
  if (kSceneTraits.is_law(id, LawId::kProxy)) {
    place_proxy(arena, view);
  } else if (kSceneTraits.is_law(id, LawId::kPaper)) {
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
  envelope = envelope_of(p);
  never_turns = scene.is_fixed();
  if (is_fixed()) fixed_r_wa = envelope.q_wa.toRotationMatrix();
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
    pairs[i].has_hidden = pair_has_hidden(pairs[i].view);
    has_seams = has_seams || pairs[i].has_hidden;
    gates[i].reach_a_m = pairs[i].view.a.record->reach_m;
    gates[i].reach_b_m = pairs[i].view.b.record->reach_m;
    gates[i].body_b = pairs[i].view.b.record->body;
  }
  if (has_law(LawId::kProxy)) configure_proxy();
  configure_output();
  forget();
}

void HapticCore::State::forget() noexcept {
  for (PairState& pair : pairs) {
    if (!is_fixed()) pair.bounds.reset(pair.view.marks);
    pair.verdict_memory = VerdictMemory{};
    pair.visited_at = 0;
    pair.exact = false;
    pair.bears = true;
    pair.situation = ContactSituation::kNone;
  }
  for (PairGateState& gate : gates) gate.plane = GatePlane{};
  for (BodyMotion& body : bodies) body.swept_m = 0;
  for (std::uint64_t& turned : lanes_turned_at) turned = 0;
  if (has_law(LawId::kProxy)) proxy.reset();
  offset = GoalOffset{};
  forget_output();
  watch.reset();
  left = false;
  motion = MotionSum{};
  has_last = false;
  tick = searched_at = 0;
  hash = kHashStart;
  peaks = StepPeaks{};
}

/// Odometers, each step rounded up; a tick at rest leaves them alone.
void HapticCore::State::advance(const GripPose& grip, StepResult& result) noexcept {
  tick += 1;
  if (has_last) {
    const Real step = std::sqrt((grip.x0_w - last.x0_w).squaredNorm());
    const Real turn = is_fixed() ? 0 : 2 * quaternion_step(grip.q_wa, last.q_wa);
    if (max_step_m > 0 && step > max_step_m) result.flags |= kFlagMotionExceeded;
    if (max_turn_rad > 0 && turn > max_turn_rad) result.flags |= kFlagMotionExceeded;
    if (step != 0 || turn != 0) {
      constexpr double kUp = 1 + 64 * static_cast<double>(kRealEpsilon);
      motion.path_m = (motion.path_m + static_cast<double>(step) * kUp) * (1 + 0x1p-52);
      motion.turn_rad = (motion.turn_rad + static_cast<double>(turn) * kUp) * (1 + 0x1p-52);
      if (is_fixed()) return remember(grip);
      for (BodyMotion& body : bodies) {
        const Real distance = std::sqrt((last.x0_w - body.reference_w).squaredNorm()) + step;
        body.swept_m = (body.swept_m + static_cast<double>(turn * distance) * kUp) * (1 + 0x1p-52);
      }
    }
  }
  remember(grip);
}

void HapticCore::State::remember(const GripPose& grip) noexcept {
  last = grip;
  has_last = true;
}

Odometer HapticCore::State::odometer(const PairGateState& gate) const noexcept {
  if (is_fixed()) return {motion.path_m, motion.path_m};
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

}  // namespace haptic
