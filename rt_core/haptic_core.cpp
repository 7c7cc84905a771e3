// SPDX-License-Identifier: Apache-2.0
#include "rt_core/haptic_core.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/tick/core_memory.hpp"

namespace haptic {
namespace {

/// The guide is out while these are set.
constexpr std::uint32_t kNoGuide = kFlagClutched | kFlagRecovery | kFlagOutsideEnvelope;

[[nodiscard]] RtStatus check_pose(const Pose& pose) noexcept;
[[nodiscard]] StepResult refused(RtStatus status, std::uint64_t hash) noexcept;
[[nodiscard]] inline Goal goal_of(CoreMemory& m, const StepInput& input) noexcept;
[[nodiscard]] inline StepResult rendered(CoreMemory& m, const StepInput& input,
                                         const Goal& goal) noexcept;
[[nodiscard]] StepResult result_of(const Goal& goal, const ContactSet& contact,
                                   const Output& output) noexcept;
[[nodiscard]] StepResult with_felt(StepResult result, const FreePose& free, const Pose& pose_wa,
                                   const FeltContact& felt) noexcept;

}  // namespace

StepResult HapticCore::step(const StepInput& input) noexcept {
  if (const RtStatus status = check_pose(input.pose_wa); status != RtStatus::kOk)
    return refused(status, memory_->hash);
  return rendered(*memory_, input, goal_of(*memory_, input));
}

RtStatus HapticCore::aim(const StepInput& input, Goal& goal) noexcept {
  const RtStatus status = check_pose(input.pose_wa);
  if (status == RtStatus::kOk) goal = goal_of(*memory_, input);
  return status;
}

StepResult HapticCore::render(const StepInput& input, const Goal& goal) noexcept {
  return rendered(*memory_, input, goal);
}

namespace {

/// From the device's pose to the goal: clutch, anchor, envelope.
Goal goal_of(CoreMemory& m, const StepInput& input) noexcept {
  return m.goal.update(input.pose_wa, input.clutched, m.free_motion.pose(),
                       m.free_motion.at_rest());
}

/// The tick of the contact with its goal there, and what the device is to feel of it.
StepResult rendered(CoreMemory& m, const StepInput& input, const Goal& goal) noexcept {
  const bool proxy = m.has_law(LawId::kProxy);

  // 1. The contact there: which pairs matter, verdicts, near sets, regions. Law proxy does without
  // it unless the caller asks.
  const std::uint32_t motion_flags = m.goal_contact.advance(goal.grip);
  const bool asked = !proxy || (m.searches_goal && input.report_goal_contact);
  const ContactSet contact =
      kSceneTraits.goal_contact && asked ? m.goal_contact.search(goal.grip) : ContactSet{};

  // 2. The device's velocity, for the law's damping and for the account of energy. The wrench that
  // it accepted counts there without the guide's share.
  DeviceMotion device = m.output.sense(goal.device, input);
  if (m.has_guide())
    device.accepted_w = m.guide->take_share(input.accepted_wrench_w, input.accepted_valid);

  // 3. The law: a free configuration and the spring to it, or a wrench of the contacts themselves.
  const FreePose free =
      proxy ? m.free_motion.move(goal.grip, device.twist.twist_w, m.goal_contact.room())
            : FreePose{};
  const DirectForce direct = proxy ? DirectForce{} : m.direct_wrench.of(contact, m.hull);
  const LawWrench law =
      proxy ? LawWrench{free.wrench_w, free.spring_w, free.stored, free.given_j, true}
            : LawWrench{direct.wrench_w, direct.wrench_w, {}, 0, false};

  // 4. Towards the device: ramps, energy, the device's twist.
  const std::uint32_t flags = goal.flags | motion_flags | contact.work.flags | free.flags;
  const Output output = m.output.finish(law, device, input, flags);

  StepResult result = result_of(goal, contact, output);
  result.flags = flags | output.flags;
  result.counters.hull_points = direct.hull_points;
  if (proxy) {
    result = with_felt(result, free, m.goal.mesh_pose(free.grip), m.free_motion.felt());
    // 5. The guide, behind the contact, which does not know of it.
    if (m.has_guide()) {
      const bool wanted = !input.guide_off && (result.flags & kNoGuide) == 0;
      result.guidance = m.guide->update(free.grip, goal.device, result.wrench_w, wanted);
    }
  }
  result.state_hash = m.hash = chained_hash(m.hash, result, proxy);
  raise_peaks(result.counters, m.peaks);
  return result;
}

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

StepResult refused(RtStatus status, std::uint64_t hash) noexcept {
  StepResult result;
  result.status = status;
  result.flags = kFlagBadPose;
  result.state_hash = hash;
  return result;
}

/// Of law kProxy what is felt comes on top (with_felt); of the others the goal is what is felt.
StepResult result_of(const Goal& goal, const ContactSet& contact, const Output& output) noexcept {
  StepResult result;
  result.goal_pose_wa = result.proxy_pose_wa = goal.pose_wa;
  result.outside = goal.outside;
  result.has_goal_contact = contact.searched;
  result.d_near_m = contact.d_near_m;
  result.nearest_pair = contact.nearest_pair;
  result.situation = contact.situation;
  result.near_count = contact.near_count;
  result.wrench_w = output.wrench_w;
  result.spring_w = output.spring_w;
  result.device_twist_w = output.device_twist_w;
  result.energy_j = output.energy_j;
  StepCounters& n = result.counters;
  n.pair_visits = contact.work.pair_visits;
  n.support_pairs = contact.work.support_pairs;
  n.feature_evaluations = contact.work.feature_evaluations;
  n.edge_pairs = contact.work.edge_pairs;
  n.near_nodes = contact.work.near_nodes;
  n.stale_pairs = contact.work.stale_pairs;
  return result;
}

StepResult with_felt(StepResult result, const FreePose& free, const Pose& pose_wa,
                     const FeltContact& felt) noexcept {
  result.proxy_pose_wa = pose_wa;
  result.proxy_gap_m = free.proxy.gap_m;
  result.potential_j = free.proxy.end_potential_j;
  result.behind_ticks = free.proxy.behind_ticks;
  result.situation = felt.situation;
  result.near_count = felt.point_count;
  StepCounters& n = result.counters;
  n.proxy_passes = free.proxy.work.passes;
  n.proxy_rejected = free.proxy.work.rejected;
  n.proxy_rounds = free.proxy.work.rounds;
  n.proxy_rows = free.proxy.work.rows;
  n.qp_iterations = free.proxy.work.qp_iterations;
  n.plane_gaps = free.proxy.work.plane_gaps;
  n.valid_nodes = free.proxy.work.valid_nodes;
  n.full_searches = free.proxy.work.full_searches;
  n.search_work = free.proxy.work.search_work;
  n.qp_programs = free.proxy.work.qp_programs;
  n.qp_steps = free.proxy.work.qp_steps;
  n.list_visits = free.proxy.work.list_visits;
  n.work_units = free.proxy.work.units();
  return result;
}

/// True if the header's state bytes are those of this machine. The graph compiler states what
/// 64-bit addresses need; narrower ones need less, so there the stated bytes have to suffice.
bool states_enough(std::uint64_t stated, std::size_t needed) noexcept {
  return sizeof(void*) == sizeof(std::uint64_t) ? stated == needed : stated >= needed;
}

constexpr std::size_t rounded(std::size_t bytes) noexcept {
  return (bytes + kStateAlignment - 1) / kStateAlignment * kStateAlignment;
}

/// The stages take most of the stack that a function may: a frame of their own.
[[gnu::noinline]] void count_stages(Arena& counting, const SceneView& scene) noexcept {
  CoreMemory memory;
  memory.place(counting, scene);
}

constexpr std::size_t kFixedBytes = rounded(CoreMemory::kOffset + sizeof(CoreMemory));
static_assert(sizeof(HapticCore) <= CoreMemory::kOffset);
static_assert(alignof(CoreMemory) <= alignof(std::max_align_t) &&
              CoreMemory::kOffset % alignof(CoreMemory) == 0);

}  // namespace

void HapticCore::reset() noexcept { memory_->reset(); }

void HapticCore::begin_at(const Pose& pose_wa) noexcept { memory_->goal.begin_at(pose_wa); }

void HapticCore::join(SharedMotion* shared) noexcept {
  memory_->free_motion.join(shared);
  memory_->reset();
}

std::size_t HapticCore::state_bytes(const SceneView& scene) noexcept {
  return state_account(scene).total();
}

StateAccount HapticCore::state_account(const SceneView& scene) noexcept {
  StateAccount account;
  Arena counting(account);
  count_stages(counting, scene);
  account.bytes[static_cast<std::size_t>(StatePart::kCore)] +=
      rounded(kFixedBytes + counting.used()) - counting.used();
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
  void* const place = memory.data() + CoreMemory::kOffset;
  CoreMemory* const placed = ::new (place) CoreMemory();  // placement, no heap
  Arena arena(memory.data() + kFixedBytes);
  placed->place(arena, scene);
  placed->read_scene(scene);
  core = ::new (static_cast<void*>(memory.data())) HapticCore(placed);  // placement, no heap
  return RtStatus::kOk;
}

PairIndex HapticCore::pair_count() const noexcept { return memory_->pair_count; }

const StepPeaks& HapticCore::peaks() const noexcept { return memory_->peaks; }

const FeltContact& HapticCore::felt_contact() const noexcept { return memory_->free_motion.felt(); }

const MotionEnvelope& HapticCore::envelope() const noexcept { return memory_->goal.envelope(); }

PairReport HapticCore::pair_report(std::uint32_t pair) const noexcept {
  return memory_->searches_goal ? memory_->goal_contact.report(pair) : PairReport{};
}

void HapticCore::contact_geometry(PairIndex pair, ContactGeometry& out) noexcept {
  forget_contact(out);
  if (!kSceneTraits.contact_geometry) return;
  CoreMemory& m = *memory_;
  if (m.has_law(LawId::kProxy)) {
    m.free_motion.describe(pair, m.goal_contact.room(), m.hull, out);
  } else {
    m.goal_contact.describe(static_cast<std::uint32_t>(pair), m.hull, out);
  }
}

void raise_peaks(const StepCounters& counters, StepPeaks& peaks) noexcept {
  for (const auto field : {&StepCounters::pair_visits,         &StepCounters::support_pairs,
                           &StepCounters::feature_evaluations, &StepCounters::edge_pairs,
                           &StepCounters::near_nodes,          &StepCounters::hull_points,
                           &StepCounters::stale_pairs,         &StepCounters::proxy_passes,
                           &StepCounters::proxy_rejected,      &StepCounters::proxy_rounds,
                           &StepCounters::proxy_rows,          &StepCounters::qp_iterations,
                           &StepCounters::plane_gaps,          &StepCounters::valid_nodes,
                           &StepCounters::full_searches,       &StepCounters::search_work,
                           &StepCounters::qp_programs,         &StepCounters::qp_steps,
                           &StepCounters::list_visits,         &StepCounters::work_units}) {
    peaks.*field = std::max(peaks.*field, counters.*field);
  }
}

}  // namespace haptic
