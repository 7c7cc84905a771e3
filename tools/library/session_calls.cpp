// SPDX-License-Identifier: Apache-2.0
// Group session: the loop in threads of this process.
#include <cmath>
#include <cstring>
#include <memory>
#include <mutex>

#include "tools/library/call.hpp"
#include "tools/library/simulated_session.hpp"

using namespace haptic;
using namespace haptic::tools;

struct haptic_session {
  haptic_session(std::span<const std::byte> scene, const SessionSettings& settings)
      : loop(scene, settings) {}
  std::uint64_t magic = kSessionMagic;
  SimulatedSession loop;

  static constexpr std::uint64_t kSessionMagic = 0x73657373696f6e21;
};

namespace {

int check_handle(const haptic_session* session) noexcept {
  if (session == nullptr) return HAPTIC_ERROR_NULL;
  return session->magic == haptic_session::kSessionMagic ? HAPTIC_OK : HAPTIC_ERROR_HANDLE;
}

/// HAPTIC_ERROR_PART: `hand` is not led.
int check_hand(const haptic_session* session, std::uint32_t hand) noexcept {
  return hand < session->loop.count() ? HAPTIC_OK : HAPTIC_ERROR_PART;
}

/// For a function that changes something.
int check_open(const haptic_session* session) noexcept {
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  return session->loop.closed() ? HAPTIC_ERROR_CLOSED : HAPTIC_OK;
}

/// Memory that the history of a session may take.
constexpr std::size_t kMostHistoryBytes = std::size_t{1} << 30;

int check_options(const haptic_session_options* options) noexcept {
  if (const int error = check_structure(options); error != HAPTIC_OK) return error;
  if (options->device == nullptr) return HAPTIC_ERROR_NULL;
  if (std::strcmp(options->device, "sim") != 0) return HAPTIC_ERROR_DEVICE;
  const bool rate = options->rate_hz == 0 || is_within(options->rate_hz, 50, 10'000);
  const bool numbers = rate && is_within(options->history_s, 0, 3600) && options->priority >= 0 &&
                       options->priority <= 99 && options->hold <= HAPTIC_HOLD_AGAIN &&
                       options->hands >= 0 && options->hands <= static_cast<int>(kMostHands);
  return numbers ? HAPTIC_OK : HAPTIC_ERROR_NUMBER;
}

}  // namespace

int haptic_session_open(const void* scene, size_t scene_bytes,
                        const haptic_session_options* options, haptic_session** session) {
  if (session == nullptr) return HAPTIC_ERROR_NULL;
  *session = nullptr;
  if (const int error = check_options(options); error != HAPTIC_OK) return error;
  if (scene == nullptr) return HAPTIC_ERROR_NULL;
  if (scene_bytes == 0) return HAPTIC_ERROR_SIZE;
  return guarded([&]() -> int {
    const SceneBytes aligned(std::span(static_cast<const std::byte*>(scene), scene_bytes));
    SceneView view;
    if (SceneView::open(aligned.span(), view) != RtStatus::kOk) return HAPTIC_ERROR_SCENE;
    SessionSettings settings;
    settings.devices = options->hands == 2 ? 2 : 1;
    PartScenes parts;
    if (settings.devices > 1 &&
        (PartScenes::open(view, parts) != RtStatus::kOk || parts.hands() < settings.devices))
      return HAPTIC_ERROR_PART;
    const double rate_hz = options->rate_hz > 0 ? options->rate_hz : view.parameters().rate_hz;
    if (!is_within(rate_hz, 50, 10'000)) return HAPTIC_ERROR_NUMBER;
    settings.period_ns = std::llround(1e9 / rate_hz);
    settings.history_s = options->history_s;
    // One recorder for each device, written to at once so that no tick meets a new page.
    if (FlightRecorder::bytes_for(static_cast<std::size_t>(settings.history_s * rate_hz)) >
        kMostHistoryBytes / settings.devices)
      return HAPTIC_ERROR_NUMBER;
    settings.priority = options->priority;
    settings.hold = static_cast<haptic_hold>(options->hold);
    auto opened = std::make_unique<haptic_session>(aligned.span(), settings);
    if (const int error = opened->loop.start(); error != HAPTIC_OK) return error;
    *session = opened.release();
    return HAPTIC_OK;
  });
}

int haptic_session_state(const haptic_session* session, haptic_state* state) {
  return haptic_session_state_of(session, 0, state);
}

int haptic_session_state_of(const haptic_session* session, uint32_t hand, haptic_state* state) {
  if (const int error = check_structure(state); error != HAPTIC_OK) return error;
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  if (const int error = check_hand(session, hand); error != HAPTIC_OK) return error;
  session->loop.line(hand).state(*state);
  return HAPTIC_OK;
}

int haptic_session_gains(const haptic_session* session, haptic_gains* gains) {
  if (const int error = check_structure(gains); error != HAPTIC_OK) return error;
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  session->loop.gains(*gains);
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
  write_verdict(session->loop.line(hand).verdict(), *verdict);
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
    const std::lock_guard lock(session->loop.mutex);
    *count = session->loop.history(hand, {ticks, capacity});
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
    const std::lock_guard lock(session->loop.mutex);
    const std::uint64_t given = session->loop.line(goal->hand).move_hand(goal->pose, goal->seconds);
    if (number != nullptr) *number = given;
    return HAPTIC_OK;
  });
}

int haptic_session_hold(haptic_session* session, int hold) {
  if (hold < HAPTIC_RELEASE || hold > HAPTIC_HOLD_AGAIN) return HAPTIC_ERROR_NUMBER;
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    const std::lock_guard lock(session->loop.mutex);
    for (std::size_t k = 0; k < session->loop.count(); ++k)
      session->loop.line(k).hold(static_cast<haptic_hold>(hold));
    return HAPTIC_OK;
  });
}

int haptic_session_hold_of(haptic_session* session, uint32_t hand, int hold) {
  if (hold < HAPTIC_RELEASE || hold > HAPTIC_HOLD_AGAIN) return HAPTIC_ERROR_NUMBER;
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  if (const int error = check_hand(session, hand); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    const std::lock_guard lock(session->loop.mutex);
    session->loop.line(hand).hold(static_cast<haptic_hold>(hold));
    return HAPTIC_OK;
  });
}

int haptic_session_hold_part(haptic_session* session, uint32_t hand, uint32_t part) {
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  if (hand != 0) return HAPTIC_ERROR_PART;
  return guarded([&]() -> int { return session->loop.hold_part(part); });
}

int haptic_session_release_part(haptic_session* session, uint32_t hand) {
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  if (hand != 0) return HAPTIC_ERROR_PART;
  return guarded([&]() -> int { return session->loop.release_part(); });
}

int haptic_session_bodies(const haptic_session* session, haptic_body* bodies, size_t capacity,
                          size_t body_bytes, size_t* count) {
  if (const int error = check_list(bodies, capacity, body_bytes, count); error != HAPTIC_OK)
    return error;
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    *count = session->loop.bodies({bodies, capacity});
    return *count > 0 ? HAPTIC_OK : HAPTIC_ERROR_PART;
  });
}

int haptic_session_frame(haptic_session* session, const haptic_frame* frame) {
  if (const int error = check_frame(frame); error != HAPTIC_OK) return error;
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    const std::lock_guard lock(session->loop.frame_mutex);
    session->loop.move_fixed(*frame);
    return is_pose(frame->pose) ? HAPTIC_OK : HAPTIC_ERROR_POSE;
  });
}

int haptic_session_drive(haptic_session* session, uint32_t part, const haptic_frame* frame) {
  if (const int error = check_frame(frame); error != HAPTIC_OK) return error;
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    const std::lock_guard lock(session->loop.frame_mutex);
    if (!session->loop.drive(part, *frame)) return HAPTIC_ERROR_PART;
    return is_pose(frame->pose) ? HAPTIC_OK : HAPTIC_ERROR_POSE;
  });
}

int haptic_session_driven(const haptic_session* session, haptic_driven* driven, size_t capacity,
                          size_t driven_bytes, size_t* count) {
  if (const int error = check_list(driven, capacity, driven_bytes, count); error != HAPTIC_OK)
    return error;
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    *count = session->loop.driven({driven, capacity});
    return *count > 0 ? HAPTIC_OK : HAPTIC_ERROR_PART;
  });
}

int haptic_session_stop(haptic_session* session) {
  if (const int error = check_open(session); error != HAPTIC_OK) return error;
  session->loop.stop();
  return HAPTIC_OK;
}

int haptic_session_close(haptic_session* session) {
  if (const int error = check_handle(session); error != HAPTIC_OK) return error;
  return guarded([&]() -> int {
    const std::lock_guard lock(session->loop.mutex);
    if (session->loop.closed()) return HAPTIC_ERROR_CLOSED;
    session->loop.close();
    return HAPTIC_OK;
  });
}

int haptic_session_free(haptic_session** session) {
  if (session == nullptr) return HAPTIC_ERROR_NULL;
  if (*session == nullptr) return HAPTIC_OK;
  if (const int error = check_handle(*session); error != HAPTIC_OK) return error;
  (*session)->loop.close();
  (*session)->magic = 0;
  delete *session;
  *session = nullptr;
  return HAPTIC_OK;
}
