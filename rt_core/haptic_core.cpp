// SPDX-License-Identifier: Apache-2.0
#include "rt_core/haptic_core.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/core_state.hpp"

namespace haptic {
namespace {

/// Positions beyond this are refused like infinite ones: squares and sums of motion must stay
/// finite, for an odometer that has become infinite would hide every face.
constexpr Real kMaxPosition_m = static_cast<Real>(1.0e3 * kMaxSceneLength_m);

RtStatus check_pose(const Pose& pose) noexcept {
  const auto finite = [](Real x) { return x - x == 0; };
  const Quat& q = pose.q_wa;
  for (int k = 0; k < 3; ++k) {
    const bool usable = finite(pose.p_wa[k]) && std::abs(pose.p_wa[k]) <= kMaxPosition_m;
    if (!usable) return RtStatus::kPoseNotFinite;
  }
  for (int k = 0; k < 4; ++k) {
    if (!finite(q.coeffs()[k])) return RtStatus::kPoseNotFinite;
  }
  const Real n = std::sqrt(q.coeffs().squaredNorm());
  return n > 0.999_r && n < 1.001_r ? RtStatus::kOk : RtStatus::kPoseNotUnit;
}

/// Whether the header's state bytes are those of this machine. The graph compiler states what
/// 64-bit addresses need; narrower ones need less, so there the stated bytes have to suffice.
bool states_enough(std::uint64_t stated, std::size_t needed) noexcept {
  return sizeof(void*) == sizeof(std::uint64_t) ? stated == needed : stated >= needed;
}

}  // namespace

std::size_t HapticCore::state_bytes(const SceneView& scene) noexcept {
  return state_account(scene).total();
}

StateAccount HapticCore::state_account(const SceneView& scene) noexcept {
  StateAccount account;
  Arena counting(account);
  State state;
  state.place(counting, scene);
  const auto rounded = [](std::size_t bytes) {
    return (bytes + kStateAlignment - 1) / kStateAlignment * kStateAlignment;
  };
  const std::size_t fixed = rounded(State::kOffset + sizeof(State));
  account.bytes[static_cast<std::size_t>(StatePart::kCore)] +=
      rounded(fixed + counting.used()) - counting.used();
  return account;
}

RtStatus HapticCore::create(std::span<std::byte> memory, const SceneView& scene,
                            HapticCore*& core) noexcept {
  core = nullptr;
  const std::size_t needed = state_bytes(scene);
  // The header states what the general program needs; an image needs no more.
  if (!kSceneTraits.image && !states_enough(scene.header().capacity.state_bytes, needed)) {
    return RtStatus::kBlobBadCapacity;
  }
  if (reinterpret_cast<std::uintptr_t>(memory.data()) % kStateAlignment != 0)
    return RtStatus::kMemoryMisaligned;
  if (memory.size() < needed) return RtStatus::kMemoryTooSmall;
  static_assert(alignof(State) <= alignof(std::max_align_t) &&
                State::kOffset % alignof(State) == 0);
  State* const state =
      ::new (static_cast<void*>(memory.data() + State::kOffset)) State();  // placement, no heap
  const std::size_t fixed =
      (State::kOffset + sizeof(State) + kStateAlignment - 1) / kStateAlignment * kStateAlignment;
  Arena arena(memory.data() + fixed);
  state->place(arena, scene);
  state->read_scene(scene);
  core = ::new (static_cast<void*>(memory.data())) HapticCore(state);  // placement, no heap
  return RtStatus::kOk;
}

void HapticCore::reset() noexcept { state_->forget(); }

StepResult HapticCore::step(const StepInput& input) noexcept {
  State& s = *state_;
  StepResult result;
  result.status = check_pose(input.pose_wa);
  if (!kSceneTraits.clutch && input.clutched && result.status == RtStatus::kOk) {
    result.status = RtStatus::kInputNotOfImage;
  }
  if (result.status != RtStatus::kOk) {
    if (result.status != RtStatus::kInputNotOfImage) result.flags = kFlagBadPose;
    result.state_hash = s.hash;
    return result;
  }
  const GripPose device = s.device_grip(input.pose_wa);
  GripPose grip = s.goal_of(device, kSceneTraits.clutch && input.clutched, result);
  const bool held = s.keep_inside(grip, result);
  const bool as_given = s.offset.is_zero && !s.offset.clutched && !held;
  result.goal_pose_wa = as_given ? input.pose_wa : s.mesh_pose(grip);
  if (as_given && s.is_fixed()) result.goal_pose_wa.q_wa = grip.q_wa;

  s.near.clear();
  s.contact_nodes.clear();
  s.patches.clear();
  s.points.clear();
  s.advance(grip, result);
  if (!s.has_law(LawId::kProxy) || input.report_goal_contact) s.search_goal(grip, result);
  Wrench wrench;
  if (s.has_law(LawId::kProxy)) {
    wrench = s.proxy_wrench(grip, s.stamp_of(input), result);
  } else {
    wrench = s.total_wrench(result);
    result.spring_w = wrench;
    result.proxy_pose_wa = result.goal_pose_wa;
    s.report_contact(result);
  }
  result.wrench_w = s.finish(wrench, device, input, result);
  s.chain_hash(result);
  raise_peaks(result.counters, s.peaks);
  result.state_hash = s.hash;
  return result;
}

std::uint32_t HapticCore::pair_count() const noexcept {
  return static_cast<std::uint32_t>(state_->pairs.size());
}

const StepPeaks& HapticCore::peaks() const noexcept { return state_->peaks; }

const FeltContact& HapticCore::felt_contact() const noexcept { return state_->proxy.felt(); }

const MotionEnvelope& HapticCore::envelope() const noexcept { return state_->envelope; }

PairReport HapticCore::pair_report(std::uint32_t index) const noexcept {
  const State& s = *state_;
  const PairState& pair = s.pairs[index];
  PairReport report;
  if (s.tick == 0 || s.searched_at != s.tick) return report;
  report.searched = true;
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

void HapticCore::contact_geometry(std::uint32_t index, ContactGeometry& out) noexcept {
  State& s = *state_;
  const PairState& pair = s.pairs[index];
  forget_contact(out);
  if (!kSceneTraits.contact_geometry || s.tick == 0) return;
  if (s.has_law(LawId::kProxy)) return s.felt_geometry(index, out);
  if (pair.visited_at == 0) return;
  const PairGateState& gate = s.gates[index];
  const bool looked_at = pair.visited_at == s.tick || !is_far(gate.plane.gap_m(s.odometer(gate)),
                                                              gate.plane.face, s.exact_band_m);
  if (!looked_at || pair.contact_count == 0) return;
  ContactNodes contact;
  contact.near = s.near.view().subspan(pair.near_begin, pair.near_count);
  contact.nodes = s.contact_nodes.view().subspan(pair.contact_begin, pair.contact_count);
  contact.d_near_m = pair.d_near_m;
  contact.situation = pair.situation;
  contact.epsilon_m = s.epsilon_m;
  describe_contact(pair.view, contact, s.last.x0_w, s.hull, out);
}

/// Geometry of a pair that holds the proxy, from its near set there.
void HapticCore::State::felt_geometry(std::uint32_t index, ContactGeometry& out) noexcept {
  const FeltContact& felt = proxy.felt();
  const auto end = felt.planes.begin() + felt.plane_count;
  if (std::none_of(felt.planes.begin(), end, [&](const FeltPlane& p) { return p.pair == index; }))
    return;
  const std::uint32_t near_begin = near.size(), nodes_begin = contact_nodes.size();
  PairPose pose;
  const NearResult found = proxy.near_set_of(index, scratch, near, pose);
  const std::span<NearNode> nodes(near.begin() + near_begin, near.size() - near_begin);
  if (!nodes.empty()) {
    locate_contacts(pose, nodes, false);
    bool several_planes = false;
    static_cast<void>(
        make_contact_patch(pose, nodes, found.d_near_m, epsilon_m, contact_nodes, several_planes));
    ContactNodes contact;
    contact.near = nodes;
    contact.nodes = contact_nodes.view().subspan(nodes_begin);
    contact.d_near_m = found.d_near_m;
    contact.situation = situation_of(nodes, found.d_near_m, epsilon_m, 1);
    contact.epsilon_m = epsilon_m;
    describe_contact(*pose.pair, contact, proxy.pose().x0_w, hull, out);
    out.cut = out.cut || (found.flags & kNearSetCut) != 0;
  }
  near.truncate(near_begin);
  contact_nodes.truncate(nodes_begin);
}

void raise_peaks(const StepCounters& counters, StepPeaks& peaks) noexcept {
  for (const auto field :
       {&StepCounters::pair_visits, &StepCounters::support_pairs,
        &StepCounters::feature_evaluations, &StepCounters::edge_pairs, &StepCounters::near_nodes,
        &StepCounters::hull_points, &StepCounters::stale_pairs, &StepCounters::proxy_passes,
        &StepCounters::proxy_rejected, &StepCounters::proxy_rounds, &StepCounters::proxy_rows,
        &StepCounters::qp_iterations, &StepCounters::plane_gaps, &StepCounters::valid_nodes,
        &StepCounters::full_searches, &StepCounters::search_work, &StepCounters::qp_programs,
        &StepCounters::qp_steps}) {
    peaks.*field = std::max(peaks.*field, counters.*field);
  }
}

}  // namespace haptic
