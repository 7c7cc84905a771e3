// SPDX-License-Identifier: Apache-2.0
// Group servo: the tick of run_device in memory of the caller. Nothing is allocated here.
#include <atomic>
#include <cstdint>
#include <new>
#include <optional>
#include <span>

#include "rt_core/scene/part_scenes.hpp"
#include "rt_core/servo_tick.hpp"
#include "tools/library/call.hpp"
#include "tools/library/caller_tick.hpp"
#include "tools/library/handle_call.hpp"
#include "tools/verdict/session_judge.hpp"

using namespace haptic;
using namespace haptic::tools;

/// At the begin of the caller's memory; the core's state follows.
struct alignas(kStateAlignment) haptic_servo {
  explicit haptic_servo(std::int64_t period_ns) noexcept : time(period_ns) {}
  std::atomic<std::uint64_t> magic{0};
  std::atomic<bool> busy{false}, stop{false};
  SceneView view;
  HapticCore* core = nullptr;
  ServoParameters parameters;
  std::optional<ServoTick> tick;
  CallersTime time;
  SessionJudge judge;

  static constexpr std::uint64_t kOpenMagic = 0x736572766f6f706e;
  static constexpr std::uint64_t kClosedMagic = 0x7368757473657276;
};

namespace {

using ServoCall = HandleCall<haptic_servo>;

/// Options and scene of a servo. @return HAPTIC_OK, or what is wrong with them.
int open_scene(const void* scene, std::size_t bytes, const haptic_servo_options* options,
               SceneView& view) noexcept {
  if (const int error = check_options(options); error != HAPTIC_OK) return error;
  if (scene == nullptr) return HAPTIC_ERROR_NULL;
  if (bytes == 0) return HAPTIC_ERROR_SIZE;
  if (!is_aligned(scene)) return HAPTIC_ERROR_MEMORY;
  PartScenes parts;
  if (SceneView::open({static_cast<const std::byte*>(scene), bytes}, view) != RtStatus::kOk ||
      PartScenes::open(view, parts) != RtStatus::kOk)
    return HAPTIC_ERROR_SCENE;
  if (parts.count() > 0 && parts.hands() > 1) return HAPTIC_ERROR_PART;
  return is_within(view.parameters().rate_hz, 50, 10'000) || options->rate_hz > 0
             ? HAPTIC_OK
             : HAPTIC_ERROR_NUMBER;
}

}  // namespace

int haptic_servo_bounds_of(const void* scene, size_t scene_bytes,
                           const haptic_servo_options* options, haptic_servo_bounds* bounds) {
  if (const int error = check_structure(bounds); error != HAPTIC_OK) return error;
  *bounds = HAPTIC_SERVO_BOUNDS_INIT;
  SceneView view;
  if (const int error = open_scene(scene, scene_bytes, options, view); error != HAPTIC_OK)
    return error;
  const SafetyLimits limits = parameters_of(*options, view).limits;
  const SceneCapacity& most = view.header().capacity;
  bounds->held_periods = limits.held_periods;
  bounds->lost_periods = limits.lost_periods;
  bounds->most_work = most.max_work_units + most.max_feature_evaluations;
  bounds->memory_bytes = sizeof(haptic_servo) + HapticCore::state_bytes(view);
  bounds->period_s = 1e-9 * static_cast<double>(limits.period_ns);
  bounds->longest_ramp_s = static_cast<double>(longest_ramp_s(limits));
  return HAPTIC_OK;
}

int haptic_servo_begin(const void* scene, size_t scene_bytes, void* memory, size_t memory_bytes,
                       const haptic_servo_options* options, haptic_servo** servo) {
  if (servo == nullptr) return HAPTIC_ERROR_NULL;
  *servo = nullptr;
  SceneView view;
  if (const int error = open_scene(scene, scene_bytes, options, view); error != HAPTIC_OK)
    return error;
  if (memory == nullptr) return HAPTIC_ERROR_NULL;
  if (!is_aligned(memory) || memory_bytes < sizeof(haptic_servo) + HapticCore::state_bytes(view))
    return HAPTIC_ERROR_MEMORY;
  const ServoParameters parameters = parameters_of(*options, view);
  auto* const handle = new (memory) haptic_servo(parameters.limits.period_ns);  // no heap
  handle->view = view;
  handle->parameters = parameters;
  std::byte* const rest = static_cast<std::byte*>(memory) + sizeof(haptic_servo);
  if (HapticCore::create({rest, memory_bytes - sizeof(haptic_servo)}, handle->view, handle->core) !=
      RtStatus::kOk)
    return HAPTIC_ERROR_SCENE;
  handle->judge = SessionJudge(handle->view);
  handle->tick.emplace(*handle->core, parameters, handle->view.header().capacity, nullptr);
  handle->magic.store(haptic_servo::kOpenMagic, std::memory_order_release);
  *servo = handle;
  return HAPTIC_OK;
}

int haptic_servo_tick(haptic_servo* servo, const haptic_servo_input* input,
                      haptic_servo_output* output) {
  if (const int error = check_structure(output); error != HAPTIC_OK) return error;
  *output = HAPTIC_SERVO_OUTPUT_INIT;
  if (const int error = check_structure(input); error != HAPTIC_OK) return error;
  const ServoCall call(servo);
  if (call.error() != HAPTIC_OK) return call.error();
  haptic_servo& handle = *call;
  const std::uint32_t lost_periods = handle.parameters.limits.lost_periods;
  const bool goes_on = handle.time.advance(input->time_s, lost_periods);
  ServoInput given = input_of(handle.time, goes_on, lost_periods, *input);
  given.emergency_stop = given.emergency_stop || handle.stop.exchange(false);
  const ServoResult result = handle.tick->step(given);
  if (result.rendered_new) handle.judge.take(result.rendered);
  write_output(result, *output);
  return HAPTIC_OK;
}

int haptic_servo_stop(haptic_servo* servo) {
  if (const int error = open_error(servo); error != HAPTIC_OK) return error;
  servo->stop.store(true);
  return HAPTIC_OK;
}

int haptic_servo_verdict(haptic_servo* servo, haptic_verdict* verdict) {
  if (const int error = check_structure(verdict); error != HAPTIC_OK) return error;
  const ServoCall call(servo);
  if (call.error() != HAPTIC_OK) return call.error();
  write_verdict((*call).judge.verdict(), *verdict);
  return HAPTIC_OK;
}

int haptic_servo_close(haptic_servo* servo) {
  const ServoCall call(servo);
  if (call.error() != HAPTIC_OK) return call.error();
  (*call).magic.store(haptic_servo::kClosedMagic, std::memory_order_relaxed);
  return HAPTIC_OK;
}
