// SPDX-License-Identifier: Apache-2.0
// Group session: a device, by the loop in threads of this process or by run_device.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "tools/library/call.hpp"
#include "tools/library/device_session.hpp"
#include "tools/library/external_session.hpp"
#include "tools/library/simulated_session.hpp"

using namespace haptic;
using namespace haptic::tools;

struct haptic_session {
  std::uint64_t magic = kSessionMagic;
  std::unique_ptr<OpenSession> loop;

  static constexpr std::uint64_t kSessionMagic = 0x73657373696f6e21;
};

namespace {

int check_handle(const haptic_session* session) noexcept {
  if (session == nullptr) return HAPTIC_ERROR_NULL;
  if (session->magic != haptic_session::kSessionMagic) return HAPTIC_ERROR_HANDLE;
  return session->loop->is_of_this_process() ? HAPTIC_OK : HAPTIC_ERROR_CLOSED;
}

/// HAPTIC_ERROR_PART: `hand` is not led.
int check_hand(const haptic_session* session, std::uint32_t hand) noexcept {
  return hand < session->loop->count() ? HAPTIC_OK : HAPTIC_ERROR_PART;
}

/// For a function that changes something.
int check_open(const haptic_session* session) noexcept {
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  return session->loop->closed() ? HAPTIC_ERROR_CLOSED : HAPTIC_OK;
}

/// Memory that the history of a session may take.
constexpr std::size_t kMostHistoryBytes = std::size_t{1} << 30;

constexpr const char *kSimulated = "sim", *kExternal = "external";

bool is_external(const haptic_session_options& options) noexcept {
  return std::strcmp(options.device, kExternal) == 0;
}

bool is_configuration(const haptic_session_options& options) noexcept {
  return std::string_view(options.device).ends_with(".toml");
}

int check_options(const haptic_session_options* options, std::string& text) {
  if (const int error = check_structure(options); error != HAPTIC_OK) return error;
  if (options->device == nullptr) return HAPTIC_ERROR_NULL;
  const bool is_named = std::strcmp(options->device, kSimulated) == 0 || is_external(*options) ||
                        is_configuration(*options);
  if (!is_named) {
    text = "no device '" + std::string(options->device) +
           "'; give \"sim\", \"external\", or the path of a configuration of run_device, which "
           "ends in .toml";
    return HAPTIC_ERROR_DEVICE;
  }
  const bool rate = options->rate_hz == 0 || is_within(options->rate_hz, 50, 10'000);
  const bool numbers = rate && is_within(options->history_s, 0, 3600) && options->priority >= 0 &&
                       options->priority <= 99 && options->hold <= HAPTIC_HOLD_AGAIN &&
                       options->hands >= 0 && options->hands <= static_cast<int>(kMostHands);
  if (!numbers) return HAPTIC_ERROR_NUMBER;
  if (is_configuration(*options) && (options->rate_hz > 0 || options->priority > 0)) {
    text = std::string(options->device) +
           ": says rate and priority itself ([loop]); leave rate_hz and priority 0";
    return HAPTIC_ERROR_NUMBER;
  }
  if (is_external(*options) && (options->priority > 0 || options->hands > 1)) {
    text = "external: the loop is the caller's, of one device; leave priority 0 and hands 0 or 1";
    return options->priority > 0 ? HAPTIC_ERROR_NUMBER : HAPTIC_ERROR_PART;
  }
  return HAPTIC_OK;
}

int open_simulated(const SceneBytes& scene, const SceneView& view,
                   const haptic_session_options& options, std::unique_ptr<OpenSession>& opened) {
  SessionSettings settings;
  settings.devices = options.hands == 2 ? 2 : 1;
  PartScenes parts;
  if (settings.devices > 1 &&
      (PartScenes::open(view, parts) != RtStatus::kOk || parts.hands() < settings.devices))
    return HAPTIC_ERROR_PART;
  const double rate_hz = options.rate_hz > 0 ? options.rate_hz : view.parameters().rate_hz;
  if (!is_within(rate_hz, 50, 10'000)) return HAPTIC_ERROR_NUMBER;
  settings.period_ns = std::llround(1e9 / rate_hz);
  settings.history_s = options.history_s;
  // One recorder for each device, written to at once so that no tick meets a new page.
  if (FlightRecorder::bytes_for(static_cast<std::size_t>(settings.history_s * rate_hz)) >
      kMostHistoryBytes / settings.devices)
    return HAPTIC_ERROR_NUMBER;
  settings.priority = options.priority;
  settings.hold = static_cast<haptic_hold>(options.hold);
  auto session = std::make_unique<SimulatedSession>(scene.span(), settings);
  const int error = session->start();
  if (error == HAPTIC_OK) opened = std::move(session);
  return error;
}

int open_device(const SceneBytes& scene, const SceneView& view,
                const haptic_session_options& options, std::unique_ptr<OpenSession>& opened,
                std::string& text) {
  DeviceSettings settings;
  settings.config = options.device;
  settings.history_s = options.history_s;
  settings.hands = static_cast<std::uint32_t>(options.hands);
  auto session = std::make_unique<DeviceSession>(scene.span(), view, settings);
  const int error = session->start(text);
  if (error == HAPTIC_OK) opened = std::move(session);
  return error;
}

int open_external(const SceneBytes& scene, const SceneView& view,
                  const haptic_session_options& options, const haptic_servo_options& given,
                  std::unique_ptr<OpenSession>& opened, std::string& text) {
  PartScenes parts;
  if (PartScenes::open(view, parts) != RtStatus::kOk) return HAPTIC_ERROR_SCENE;
  if (parts.count() > 0 && parts.hands() > 1) {
    text = "external: the scene has two hands, and the caller's loop has one device";
    return HAPTIC_ERROR_PART;
  }
  haptic_servo_options servo = given;
  if (servo.rate_hz > 0 && options.rate_hz > 0) {
    text = "external: rate_hz is given twice; give it in one of the options";
    return HAPTIC_ERROR_NUMBER;
  }
  servo.rate_hz = std::max(servo.rate_hz, options.rate_hz);
  const double rate_hz = servo.rate_hz > 0 ? servo.rate_hz : view.parameters().rate_hz;
  if (!is_within(rate_hz, 50, 10'000) || FlightRecorder::bytes_for(static_cast<std::size_t>(
                                             options.history_s * rate_hz)) > kMostHistoryBytes)
    return HAPTIC_ERROR_NUMBER;
  opened = std::make_unique<ExternalSession>(scene.span(), servo, options.history_s);
  return HAPTIC_OK;
}

/// `servo`: of a device whose loop is the caller's; null: the defaults.
int open_session(const void* scene, std::size_t scene_bytes, const haptic_session_options* options,
                 const haptic_servo_options* servo, haptic_session** session, std::string& text) {
  if (const int error = check_options(options, text); error != HAPTIC_OK) return error;
  const haptic_servo_options defaults = HAPTIC_SERVO_OPTIONS_INIT;
  if (servo != nullptr && !is_external(*options)) {
    text = "the servo's options are those of device \"external\"";
    return HAPTIC_ERROR_DEVICE;
  }
  if (servo == nullptr) servo = &defaults;
  if (const int error = tools::check_options(servo); error != HAPTIC_OK) return error;
  if (scene == nullptr) return HAPTIC_ERROR_NULL;
  if (scene_bytes == 0) return HAPTIC_ERROR_SIZE;
  const SceneBytes aligned(std::span(static_cast<const std::byte*>(scene), scene_bytes));
  SceneView view;
  if (SceneView::open(aligned.span(), view) != RtStatus::kOk) return HAPTIC_ERROR_SCENE;
  auto opened = std::make_unique<haptic_session>();
  const int error =
      is_configuration(*options) ? open_device(aligned, view, *options, opened->loop, text)
      : is_external(*options) ? open_external(aligned, view, *options, *servo, opened->loop, text)
                              : open_simulated(aligned, view, *options, opened->loop);
  if (error == HAPTIC_OK) *session = opened.release();
  return error;
}

int open_with_text(const void* scene, std::size_t scene_bytes,
                   const haptic_session_options* options, const haptic_servo_options* servo,
                   haptic_session** session, char* text, std::size_t text_bytes) {
  if (session == nullptr) return HAPTIC_ERROR_NULL;
  *session = nullptr;
  if (text == nullptr) return HAPTIC_ERROR_NULL;
  if (text_bytes == 0) return HAPTIC_ERROR_SIZE;
  text[0] = '\0';
  return guarded([&]() -> int {
    std::string why;
    const int error = open_session(scene, scene_bytes, options, servo, session, why);
    if (error == HAPTIC_OK) return error;
    if (why.empty()) why = haptic_error_text(error);
    text[why.copy(text, text_bytes - 1)] = '\0';
    return error;
  });
}

}  // namespace

int haptic_session_open(const void* scene, size_t scene_bytes,
                        const haptic_session_options* options, haptic_session** session) {
  if (session == nullptr) return HAPTIC_ERROR_NULL;
  *session = nullptr;
  return guarded([&]() -> int {
    std::string text;
    return open_session(scene, scene_bytes, options, nullptr, session, text);
  });
}

int haptic_session_open_text(const void* scene, size_t scene_bytes,
                             const haptic_session_options* options, haptic_session** session,
                             char* text, size_t text_bytes) {
  return open_with_text(scene, scene_bytes, options, nullptr, session, text, text_bytes);
}

int haptic_session_open_external(const void* scene, size_t scene_bytes,
                                 const haptic_session_options* options,
                                 const haptic_servo_options* servo, haptic_session** session,
                                 char* text, size_t text_bytes) {
  if (session == nullptr) return HAPTIC_ERROR_NULL;
  *session = nullptr;
  if (servo == nullptr) return HAPTIC_ERROR_NULL;
  return open_with_text(scene, scene_bytes, options, servo, session, text, text_bytes);
}

int haptic_session_tick(haptic_session* session, const haptic_servo_input* input,
                        haptic_servo_output* output) {
  if (const int error = check_structure(output); error != HAPTIC_OK) return error;
  *output = HAPTIC_SERVO_OUTPUT_INIT;
  if (const int error = check_structure(input); error != HAPTIC_OK) return error;
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  return session->loop->tick(*input, *output);
}

int haptic_session_contacts(haptic_session* session, haptic_contact* contacts, size_t capacity,
                            size_t contact_bytes, size_t* count, double* rest) {
  if (const int error = check_list(contacts, capacity, contact_bytes, count); error != HAPTIC_OK)
    return error;
  if (rest != nullptr) std::fill_n(rest, 6, 0.0);
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  Wrench left;
  const int error = session->loop->contacts({contacts, capacity}, *count, left);
  if (error == HAPTIC_OK && rest != nullptr) write_numbers(left, rest);
  return error;
}

int haptic_session_state(const haptic_session* session, haptic_state* state) {
  return haptic_session_state_of(session, 0, state);
}

int haptic_session_state_of(const haptic_session* session, uint32_t hand, haptic_state* state) {
  if (const int error = check_structure(state); error != HAPTIC_OK) return error;
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  if (const int error = check_hand(session, hand); error != HAPTIC_OK) return error;
  session->loop->state(hand, *state);
  return HAPTIC_OK;
}

int haptic_session_device(const haptic_session* session, uint32_t hand,
                          haptic_device_status* status) {
  if (const int error = check_structure(status); error != HAPTIC_OK) return error;
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  if (const int error = check_hand(session, hand); error != HAPTIC_OK) return error;
  session->loop->device(hand, *status);
  return HAPTIC_OK;
}

int haptic_session_events(const haptic_session* session, haptic_event* events, size_t capacity,
                          size_t event_bytes, size_t* count) {
  if (const int error = check_list(events, capacity, event_bytes, count); error != HAPTIC_OK)
    return error;
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  *count = session->loop->events({events, capacity});
  return HAPTIC_OK;
}

int haptic_session_gains(const haptic_session* session, haptic_gains* gains) {
  if (const int error = check_structure(gains); error != HAPTIC_OK) return error;
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  session->loop->gains(*gains);
  return HAPTIC_OK;
}

int haptic_session_verdict(const haptic_session* session, haptic_verdict* verdict) {
  return haptic_session_verdict_of(session, 0, verdict);
}

int haptic_session_verdict_of(const haptic_session* session, uint32_t hand,
                              haptic_verdict* verdict) {
  if (const int error = check_structure(verdict); error != HAPTIC_OK) return error;
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  if (const int error = check_hand(session, hand); error != HAPTIC_OK) return error;
  write_verdict(session->loop->verdict(hand), *verdict);
  return HAPTIC_OK;
}

int haptic_session_history(const haptic_session* session, haptic_tick* ticks, size_t capacity,
                           size_t tick_bytes, size_t* count) {
  return haptic_session_history_of(session, 0, ticks, capacity, tick_bytes, count);
}

int haptic_session_history_of(const haptic_session* session, uint32_t hand, haptic_tick* ticks,
                              size_t capacity, size_t tick_bytes, size_t* count) {
  if (count == nullptr) return HAPTIC_ERROR_NULL;
  *count = 0;
  if (ticks == nullptr) return HAPTIC_ERROR_NULL;
  if (capacity == 0) return HAPTIC_ERROR_SIZE;
  if (tick_bytes != sizeof(haptic_tick)) return HAPTIC_ERROR_VERSION;
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  if (const int error = check_hand(session, hand); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    const std::lock_guard lock(session->loop->mutex);
    *count = session->loop->history(hand, {ticks, capacity});
    return HAPTIC_OK;
  });
}

int haptic_session_move_hand(haptic_session* session, const haptic_hand_goal* goal,
                             uint64_t* number) {
  if (number != nullptr) *number = 0;
  if (const int error = check_structure(goal); error != HAPTIC_OK) return error;
  if (!is_pose(goal->pose)) return HAPTIC_ERROR_POSE;
  if (!is_within(goal->seconds, 0.001, 3600)) return HAPTIC_ERROR_NUMBER;
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  if (const int error = check_hand(session, goal->hand); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    const std::lock_guard lock(session->loop->mutex);
    std::uint64_t given = 0;
    const int error = session->loop->move_hand(*goal, given);
    if (number != nullptr) *number = given;
    return error;
  });
}

int haptic_session_hold(haptic_session* session, int hold) {
  if (hold < HAPTIC_RELEASE || hold > HAPTIC_HOLD_AGAIN) return HAPTIC_ERROR_NUMBER;
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    const std::lock_guard lock(session->loop->mutex);
    int error = HAPTIC_OK;
    for (std::size_t k = 0; k < session->loop->count() && error == HAPTIC_OK; ++k)
      error = session->loop->hold(k, static_cast<haptic_hold>(hold));
    return error;
  });
}

int haptic_session_hold_of(haptic_session* session, uint32_t hand, int hold) {
  if (hold < HAPTIC_RELEASE || hold > HAPTIC_HOLD_AGAIN) return HAPTIC_ERROR_NUMBER;
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  if (const int error = check_hand(session, hand); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    const std::lock_guard lock(session->loop->mutex);
    return session->loop->hold(hand, static_cast<haptic_hold>(hold));
  });
}

int haptic_session_hold_part(haptic_session* session, uint32_t hand, uint32_t part) {
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  if (hand != 0) return HAPTIC_ERROR_PART;
  return guarded([&]() -> int { return session->loop->hold_part(part); });
}

int haptic_session_release_part(haptic_session* session, uint32_t hand) {
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  if (hand != 0) return HAPTIC_ERROR_PART;
  return guarded([&]() -> int { return session->loop->release_part(); });
}

int haptic_session_bodies(const haptic_session* session, haptic_body* bodies, size_t capacity,
                          size_t body_bytes, size_t* count) {
  if (const int error = check_list(bodies, capacity, body_bytes, count); error != HAPTIC_OK)
    return error;
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    *count = session->loop->bodies({bodies, capacity});
    return *count > 0 ? HAPTIC_OK : HAPTIC_ERROR_PART;
  });
}

int haptic_session_frame(haptic_session* session, const haptic_frame* frame) {
  if (const int error = check_frame(frame); error != HAPTIC_OK) return error;
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    const std::lock_guard lock(session->loop->frame_mutex);
    const int error = session->loop->move_fixed(*frame);
    if (error != HAPTIC_OK) return error;
    return is_pose(frame->pose) ? HAPTIC_OK : HAPTIC_ERROR_POSE;
  });
}

int haptic_session_drive(haptic_session* session, uint32_t part, const haptic_frame* frame) {
  if (const int error = check_frame(frame); error != HAPTIC_OK) return error;
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    const std::lock_guard lock(session->loop->frame_mutex);
    const int error = session->loop->drive(part, *frame);
    if (error != HAPTIC_OK) return error;
    return is_pose(frame->pose) ? HAPTIC_OK : HAPTIC_ERROR_POSE;
  });
}

int haptic_session_driven(const haptic_session* session, haptic_driven* driven, size_t capacity,
                          size_t driven_bytes, size_t* count) {
  if (const int error = check_list(driven, capacity, driven_bytes, count); error != HAPTIC_OK)
    return error;
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    *count = session->loop->driven({driven, capacity});
    return *count > 0 ? HAPTIC_OK : HAPTIC_ERROR_PART;
  });
}

int haptic_session_stop(haptic_session* session) {
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  session->loop->stop();
  return HAPTIC_OK;
}

int haptic_session_close(haptic_session* session) {
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    const std::lock_guard lock(session->loop->mutex);
    if (session->loop->closed()) return HAPTIC_ERROR_CLOSED;
    session->loop->close();
    return HAPTIC_OK;
  });
}

int haptic_session_free(haptic_session** session) {
  if (session == nullptr) return HAPTIC_ERROR_NULL;
  if (*session == nullptr) return HAPTIC_OK;
  const int error = check_handle(*session);
  if (error == HAPTIC_ERROR_CLOSED) {  // of the process that this one was forked from
    *session = nullptr;
    return HAPTIC_OK;
  }
  if (error != HAPTIC_OK) return error;
  (*session)->loop->close();
  (*session)->magic = 0;
  delete *session;
  *session = nullptr;
  return HAPTIC_OK;
}
