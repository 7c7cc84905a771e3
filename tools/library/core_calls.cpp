// SPDX-License-Identifier: Apache-2.0
// Group core: a scene and a core in memory of the caller. Nothing is allocated here.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <new>
#include <span>

#include "tools/library/bodies.hpp"
#include "tools/library/call.hpp"
#include "tools/library/core_handle.hpp"

using namespace haptic;
using namespace haptic::tools;

namespace {

int open_scene(const void* scene, std::size_t bytes, SceneView& view, PartScenes& parts,
               RtStatus& status) noexcept {
  if (scene == nullptr) return HAPTIC_ERROR_NULL;
  if (bytes == 0) return HAPTIC_ERROR_SIZE;
  if (!is_aligned(scene)) return HAPTIC_ERROR_MEMORY;
  status = SceneView::open({static_cast<const std::byte*>(scene), bytes}, view);
  if (status == RtStatus::kOk) status = PartScenes::open(view, parts);
  return status == RtStatus::kOk ? HAPTIC_OK : HAPTIC_ERROR_SCENE;
}

/// One after the other from `memory` on.
PartHand::Room room_at(std::byte* memory, const PartScenes& parts) noexcept {
  const std::size_t scene = aligned_size(parts.most_bytes());
  const std::size_t state = aligned_size(parts.most_state_bytes());
  return {{memory, parts.most_bytes()},
          {memory + scene, parts.most_state_bytes()},
          {memory + scene + state, parts.most_law_bytes()}};
}
std::size_t room_bytes(const PartScenes& parts) noexcept {
  return aligned_size(parts.most_bytes()) + aligned_size(parts.most_state_bytes()) +
         aligned_size(parts.most_law_bytes());
}

/// `parts`: of the scene.
std::size_t memory_bytes(const SceneView& view, const PartScenes& parts) noexcept {
  if (parts.count() == 0) return sizeof(haptic_core) + HapticCore::state_bytes(view);
  return sizeof(haptic_core) + sizeof(PartsOfCore) + 2 * room_bytes(parts);
}

/// The core, or the hand, in the memory after `handle`.
RtStatus create(haptic_core& handle, std::byte* memory, std::size_t bytes) noexcept {
  PartScenes parts;
  const RtStatus opened = PartScenes::open(handle.view, parts);
  if (opened != RtStatus::kOk) return opened;
  if (parts.count() == 0) return HapticCore::create({memory, bytes}, handle.view, handle.core);
  handle.parts = new (memory) PartsOfCore;  // placement, no heap
  handle.parts->scenes = parts;
  std::byte* const rooms = memory + sizeof(PartsOfCore);
  const RtStatus begun = handle.parts->hands.begin(
      handle.parts->scenes, {room_at(rooms, parts), room_at(rooms + room_bytes(parts), parts)});
  note_driven(handle.parts->hand(), handle.held);
  return begun;
}

StepInput input_of(const haptic_core& handle, const double* pose, std::int64_t stamp_ns,
                   bool clutched) noexcept {
  StepInput input;
  input.sequence = handle.counts.ticks;
  input.stamp_ns = stamp_ns;
  input.pose_wa = pose_of_numbers(pose);
  input.clutched = clutched;
  return input;
}

bool has_wrench(const StepResult& result) noexcept {
  return !result.wrench_w.force_w.isZero(0) || !result.wrench_w.torque_w.isZero(0);
}

/// Before a step of a scene with parts.
void follow(haptic_core& handle, std::int64_t stamp_ns) noexcept {
  PartsOfCore& parts = *handle.parts;
  const std::size_t driven = parts.scenes.driven().size();
  if (driven > 0)
    parts.hands.follow(
        {std::span(parts.driven).first(driven), stamp_ns, handle.counts.is_felt != 0});
}

/// After it.
void note_parts(haptic_core& handle) noexcept {
  note_driven(handle.parts->hand(), handle.held);
  note_holds(handle.parts->hands, handle.held);
}

/// @return HAPTIC_OK or HAPTIC_ERROR_POSE.
int step(haptic_core& handle, const double* pose, std::int64_t stamp_ns, bool clutched,
         StepResult& result) noexcept {
  const StepInput input = input_of(handle, pose, stamp_ns, clutched);
  if (handle.parts != nullptr) {
    follow(handle, stamp_ns);
    result = handle.parts->hands.step(input);
    note_parts(handle);
  } else {
    result = handle.core->step(input);
  }
  handle.judge.take(result);
  handle.counts.is_felt = has_wrench(result) ? 1 : 0;
  handle.last = {result.wrench_w, result.proxy_pose_wa};
  handle.counts.was_refused = result.status != RtStatus::kOk ? 1 : 0;
  if (result.status != RtStatus::kOk) return HAPTIC_ERROR_POSE;
  handle.counts.ticks += 1;
  handle.counts.last_ns = stamp_ns;
  return HAPTIC_OK;
}

/// Both hands of a scene with two. @return HAPTIC_OK or HAPTIC_ERROR_POSE, of either.
int step_hands(haptic_core& handle, const Hands::Each<const StepInput*>& inputs,
               std::int64_t stamp_ns, Hands::Each<StepResult>& results) noexcept {
  follow(handle, stamp_ns);
  results = handle.parts->hands.step(inputs);
  note_parts(handle);
  bool is_right = true;
  handle.counts.is_felt = 0;
  for (std::size_t k = 0; k < kMostHands; ++k) {
    if (inputs[k] == nullptr) continue;
    (k == 0 ? handle.judge : handle.second_judge).take(results[k]);
    if (has_wrench(results[k])) handle.counts.is_felt = 1;
    is_right = is_right && results[k].status == RtStatus::kOk;
  }
  handle.counts.ticks += 1;
  handle.counts.last_ns = stamp_ns;
  return is_right ? HAPTIC_OK : HAPTIC_ERROR_POSE;
}

void write_output(const StepResult& result, haptic_step_output& output) noexcept {
  output.situation = static_cast<std::uint32_t>(result.situation);
  write_numbers(result.wrench_w, output.wrench);
  write_numbers(result.proxy_pose_wa, output.felt_pose);
  output.gap_m = static_cast<double>(result.proxy_gap_m);
  output.flags = result.flags;
  output.near_count = result.near_count;
  output.state_hash = result.state_hash;
}

template <class T>
void put(T* to, std::size_t index, T value) noexcept {
  if (to != nullptr) to[index] = value;
}

int replay_ticks(haptic_core& handle, haptic_replay& replay) noexcept {
  const double rate_hz = handle.view.parameters().rate_hz;
  const double begin_s = handle.counts.ticks == 0
                             ? 0.0
                             : 1e-9 * static_cast<double>(handle.counts.last_ns) + 1 / rate_hz;
  for (std::size_t k = 0; k < replay.count; ++k) {
    replay.done = k;
    const double time_s =
        replay.times_s != nullptr ? replay.times_s[k] : begin_s + static_cast<double>(k) / rate_hz;
    if (!is_within(time_s, 0, kMostTime_s)) return HAPTIC_ERROR_NUMBER;
    StepResult result;
    const int error = step(handle, replay.poses + 7 * k, std::llround(1e9 * time_s), false, result);
    if (error != HAPTIC_OK) return error;
    if (replay.wrenches != nullptr) write_numbers(result.wrench_w, replay.wrenches + 6 * k);
    if (replay.felt_poses != nullptr)
      write_numbers(result.proxy_pose_wa, replay.felt_poses + 7 * k);
    put(replay.gaps_m, k, static_cast<double>(result.proxy_gap_m));
    put(replay.situations, k, static_cast<std::uint32_t>(result.situation));
    put(replay.flags, k, result.flags);
    put(replay.state_hashes, k, result.state_hash);
  }
  replay.done = replay.count;
  return HAPTIC_OK;
}

}  // namespace

int haptic_scene_read(const void* scene, size_t scene_bytes, haptic_scene_info* info) {
  if (const int error = check_structure(info); error != HAPTIC_OK) return error;
  *info = HAPTIC_SCENE_INFO_INIT;
  SceneView view;
  PartScenes parts;
  RtStatus status = RtStatus::kOk;
  const int error = open_scene(scene, scene_bytes, view, parts, status);
  if (status != RtStatus::kOk)
    (void)std::snprintf(info->trouble, sizeof info->trouble, "%s", to_text(status));
  if (error != HAPTIC_OK) return error;
  const SceneParameters& p = view.parameters();
  info->parts = static_cast<std::uint32_t>(view.bodies().size());
  info->pieces = static_cast<std::uint32_t>(view.pieces().size());
  info->pairs = static_cast<std::uint32_t>(std::min<PairIndex>(view.pair_count(), UINT32_MAX));
  info->memory_bytes = memory_bytes(view, parts);
  info->rate_hz = p.rate_hz;
  std::copy_n(p.start_p_wa_m, 3, info->start_pose);
  std::copy_n(p.start_q_wa_xyzw, 4, info->start_pose + 3);
  std::copy_n(view.bodies()[0].reference_m, 3, info->grip_m);
  info->stiffness_n_per_m = p.law == LawId::kProxy ? p.coupling.k_t_n_per_m : p.k_f_n_per_m;
  const std::string_view name = view.text(p.name_offset, p.name_bytes);
  std::memcpy(info->name, name.data(), std::min(name.size(), sizeof info->name - 1));
  return HAPTIC_OK;
}

int haptic_core_create(const void* scene, size_t scene_bytes, void* memory, size_t bytes,
                       haptic_core** core) {
  if (core == nullptr) return HAPTIC_ERROR_NULL;
  *core = nullptr;
  SceneView view;
  PartScenes parts;
  RtStatus status = RtStatus::kOk;
  if (const int error = open_scene(scene, scene_bytes, view, parts, status); error != HAPTIC_OK)
    return error;
  if (memory == nullptr) return HAPTIC_ERROR_NULL;
  if (!is_aligned(memory) || bytes < memory_bytes(view, parts)) return HAPTIC_ERROR_MEMORY;
  std::memset(memory, 0, memory_bytes(view, parts));  // a state that is saved has nothing of before
  auto* handle = new (memory) haptic_core;            // placement, no heap
  handle->view = view;
  handle->judge = handle->second_judge = SessionJudge(view);
  std::byte* const rest = static_cast<std::byte*>(memory) + sizeof(haptic_core);
  if (create(*handle, rest, bytes - sizeof(haptic_core)) != RtStatus::kOk)
    return HAPTIC_ERROR_SCENE;
  handle->magic.store(haptic_core::kOpenMagic, std::memory_order_release);
  *core = handle;
  return HAPTIC_OK;
}

int haptic_core_step(haptic_core* core, const haptic_step_input* input,
                     haptic_step_output* output) {
  if (const int error = check_structure(input); error != HAPTIC_OK) return error;
  if (const int error = check_structure(output); error != HAPTIC_OK) return error;
  *output = HAPTIC_STEP_OUTPUT_INIT;
  const CoreCall call(core);
  if (call.error() != HAPTIC_OK) return call.error();
  if (!is_within(input->time_s, 0, kMostTime_s)) return HAPTIC_ERROR_NUMBER;
  StepResult result;
  const int error =
      step(*call, input->pose, std::llround(1e9 * input->time_s), input->clutched != 0, result);
  if (error != HAPTIC_OK) return error;
  write_output(result, *output);
  return HAPTIC_OK;
}

int haptic_core_step_hands(haptic_core* core, const haptic_step_input* first,
                           const haptic_step_input* second, haptic_step_output* first_output,
                           haptic_step_output* second_output) {
  const Hands::Each<const haptic_step_input*> given{first, second};
  const Hands::Each<haptic_step_output*> outputs{first_output, second_output};
  if (first == nullptr && second == nullptr) return HAPTIC_ERROR_NULL;
  for (std::size_t k = 0; k < kMostHands; ++k) {
    if (given[k] == nullptr) continue;
    if (const int error = check_structure(given[k]); error != HAPTIC_OK) return error;
    if (const int error = check_structure(outputs[k]); error != HAPTIC_OK) return error;
    *outputs[k] = HAPTIC_STEP_OUTPUT_INIT;
  }
  const CoreCall call(core);
  if (call.error() != HAPTIC_OK) return call.error();
  const haptic_core& handle = *call;
  if (handle.parts == nullptr || handle.parts->hands.count() < kMostHands) return HAPTIC_ERROR_PART;
  const double time_s = (first != nullptr ? first : second)->time_s;
  const bool is_one_time = first == nullptr || second == nullptr ||
                           !(second->time_s < time_s || second->time_s > time_s);
  if (!is_within(time_s, 0, kMostTime_s) || !is_one_time) return HAPTIC_ERROR_NUMBER;
  const std::int64_t stamp_ns = std::llround(1e9 * time_s);
  Hands::Each<StepInput> inputs;
  Hands::Each<const StepInput*> to_hands{};
  for (std::size_t k = 0; k < kMostHands; ++k) {
    if (given[k] == nullptr) continue;
    inputs[k] = input_of(handle, given[k]->pose, stamp_ns, given[k]->clutched != 0);
    to_hands[k] = &inputs[k];
  }
  Hands::Each<StepResult> results;
  const int error = step_hands(*call, to_hands, stamp_ns, results);
  for (std::size_t k = 0; k < kMostHands; ++k)
    if (given[k] != nullptr && results[k].status == RtStatus::kOk)
      write_output(results[k], *outputs[k]);
  return error;
}

int haptic_core_replay(haptic_core* core, haptic_replay* replay) {
  if (const int error = check_structure(replay); error != HAPTIC_OK) return error;
  replay->done = 0;
  if (replay->poses == nullptr) return HAPTIC_ERROR_NULL;
  if (replay->count == 0) return HAPTIC_ERROR_SIZE;
  const CoreCall call(core);
  if (call.error() != HAPTIC_OK) return call.error();
  return replay_ticks(*call, *replay);
}

int haptic_core_verdict(haptic_core* core, haptic_verdict* verdict) {
  if (const int error = check_structure(verdict); error != HAPTIC_OK) return error;
  const CoreCall call(core);
  if (call.error() != HAPTIC_OK) return call.error();
  // A second hand that was never stepped has failed at nothing.
  const SessionVerdict second = (*call).second_judge.verdict();
  const SessionVerdict first = (*call).judge.verdict();
  const bool tells_second =
      second.ticks > 0 && (first.ticks == 0 || (second.failed() && !first.failed()));
  write_verdict(tells_second ? second : first, *verdict);
  return HAPTIC_OK;
}

int haptic_core_reset(haptic_core* core) {
  const CoreCall call(core);
  if (call.error() != HAPTIC_OK) return call.error();
  if ((*call).parts != nullptr) {
    (*call).parts->hands.reset();
  } else {
    (*call).core->reset();
  }
  (*call).counts = {};
  (*call).last = {};
  (*call).judge.reset();
  (*call).second_judge.reset();
  return HAPTIC_OK;
}

int haptic_core_hold_part(haptic_core* core, uint32_t hand, uint32_t part) {
  const CoreCall call(core);
  if (call.error() != HAPTIC_OK) return call.error();
  PartsOfCore* const parts = (*call).parts;
  if (parts == nullptr || hand != 0 || part >= parts->scenes.count() ||
      !parts->scenes.may_be_taken(part))
    return HAPTIC_ERROR_PART;
  const PartHand::Phase phase = parts->hand().phase();
  if (phase == PartHand::Phase::kHolding && parts->hand().part() == part) return HAPTIC_OK;
  parts->hand().release();
  if (phase != PartHand::Phase::kEmpty) return HAPTIC_ERROR_BUSY;
  return parts->hand().prepare(part) == RtStatus::kOk ? HAPTIC_OK : HAPTIC_ERROR_INTERNAL;
}

int haptic_core_release_part(haptic_core* core, uint32_t hand) {
  const CoreCall call(core);
  if (call.error() != HAPTIC_OK) return call.error();
  PartsOfCore* const parts = (*call).parts;
  if (parts == nullptr || hand != 0 || parts->scenes.holds_throughout()) return HAPTIC_ERROR_PART;
  parts->hand().release();
  return HAPTIC_OK;
}

int haptic_core_bodies(haptic_core* core, haptic_body* bodies, size_t capacity, size_t body_bytes,
                       size_t* count) {
  if (const int error = check_list(bodies, capacity, body_bytes, count); error != HAPTIC_OK)
    return error;
  const CoreCall call(core);
  if (call.error() != HAPTIC_OK) return call.error();
  const PartsOfCore* const parts = (*call).parts;
  if (parts == nullptr) return HAPTIC_ERROR_PART;
  *count = write_bodies(parts->scenes, parts->hand(), (*call).held, {bodies, capacity});
  return HAPTIC_OK;
}

int haptic_core_drive(haptic_core* core, uint32_t part, const haptic_frame* frame, double time_s) {
  if (const int error = check_frame(frame); error != HAPTIC_OK) return error;
  if (!is_within(time_s, 0, kMostTime_s)) return HAPTIC_ERROR_NUMBER;
  const CoreCall call(core);
  if (call.error() != HAPTIC_OK) return call.error();
  PartsOfCore* const parts = (*call).parts;
  const std::uint32_t driven = parts != nullptr ? driven_of(parts->scenes, part) : kMostDriven;
  if (driven == kMostDriven || !is_owned(parts->scenes, part)) return HAPTIC_ERROR_PART;
  FrameRecord& record = parts->driven[driven];
  record = next_record(record, *frame, std::llround(1e9 * time_s));
  return is_pose(frame->pose) ? HAPTIC_OK : HAPTIC_ERROR_POSE;
}

int haptic_core_driven(haptic_core* core, haptic_driven* driven, size_t capacity,
                       size_t driven_bytes, size_t* count) {
  if (const int error = check_list(driven, capacity, driven_bytes, count); error != HAPTIC_OK)
    return error;
  const CoreCall call(core);
  if (call.error() != HAPTIC_OK) return call.error();
  *count = write_driven((*call).held, {driven, capacity});
  return *count > 0 ? HAPTIC_OK : HAPTIC_ERROR_PART;
}

int haptic_core_contacts(haptic_core* core, haptic_contact* contacts, size_t capacity,
                         size_t contact_bytes, size_t* count, double* rest) {
  if (const int error = check_list(contacts, capacity, contact_bytes, count); error != HAPTIC_OK)
    return error;
  if (rest != nullptr) std::fill_n(rest, 6, 0.0);
  const CoreCall call(core);
  if (call.error() != HAPTIC_OK) return call.error();
  haptic_core& handle = *call;
  if (handle.parts != nullptr) return HAPTIC_ERROR_PART;
  if (handle.view.parameters().law != LawId::kProxy) return HAPTIC_ERROR_SCENE;
  if (handle.counts.ticks == 0 || handle.counts.was_refused != 0) return HAPTIC_OK;
  Wrench left;
  *count = write_contacts(*handle.core, handle.view, handle.last, {contacts, capacity}, left);
  if (rest != nullptr) write_numbers(left, rest);
  return HAPTIC_OK;
}

int haptic_core_close(haptic_core* core) {
  const CoreCall call(core);
  if (call.error() != HAPTIC_OK) return call.error();
  (*call).magic.store(haptic_core::kClosedMagic, std::memory_order_relaxed);
  return HAPTIC_OK;
}
