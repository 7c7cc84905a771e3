// SPDX-License-Identifier: Apache-2.0
#include "tools/library/simulated_session.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <system_error>

#include "hal/clock/linux_process.hpp"
#include "hal/clock/servo_clock.hpp"
#include "tools/common/changed_scene.hpp"
#include "tools/graph_compiler/coupling/served_size.hpp"
#include "tools/graph_compiler/coupling/simulated_gains.hpp"
#include "tools/graph_compiler/graph/part_tables.hpp"
#include "tools/library/call.hpp"

namespace haptic::tools {
namespace {

SceneView view_of(const SceneBytes& scene) {
  SceneView view;
  if (SceneView::open(scene.span(), view) != RtStatus::kOk)
    throw std::logic_error("the scene was not opened before");
  return view;
}

double stiffness_of(const SceneParameters& p) {
  return p.law == LawId::kProxy ? p.coupling.k_t_n_per_m : p.k_f_n_per_m;
}

/// The scene as the session renders it: with gains that handle and hand hold.
SceneBytes rendered_scene(std::span<const std::byte> scene, std::int64_t period_ns,
                          double& asked_n_per_m, double& asked_nm_per_rad, std::string& lowered) {
  SceneBytes bytes(scene);
  const SceneView view = view_of(bytes);
  const SceneParameters& p = view.parameters();
  asked_n_per_m = stiffness_of(p);
  asked_nm_per_rad = p.law == LawId::kProxy ? p.coupling.k_r_nm_per_rad : 0.0;
  const double period_s = 1e-9 * static_cast<double>(period_ns);
  const SimulatedLoop loop{held_peer(kPeerLatePeriods * period_s), 1 / period_s, false};
  SceneBytes held = with_changed(view, [&](const SceneView& of) {
    const auto gains = simulated_gains(of.parameters(), served_size(of).radius_m, loop);
    if (!gains) return SceneBytes(of.blob());
    if (lowered.empty()) lowered = gains->text;
    return changed_scene(of, [&](SceneParameters& changed) { gains->put(changed); });
  });
  return lowered.empty() ? std::move(bytes) : std::move(held);
}

hal::ServoLoopSettings loop_settings(const SessionSettings& settings, const SessionParts& parts) {
  hal::ServoLoopSettings loop;
  loop.period_ns = settings.period_ns;
  loop.frames = &parts.frames();
  loop.driven = parts.driven_records();
  return loop;
}

}  // namespace

SimulatedSession::SimulatedSession(std::span<const std::byte> scene,
                                   const SessionSettings& settings)
    : settings_(settings),
      scene_(
          rendered_scene(scene, settings.period_ns, asked_n_per_m_, asked_nm_per_rad_, lowered_)),
      view_(view_of(scene_)),
      parts_(view_) {
  for (std::size_t k = 0; k < settings.devices; ++k) {
    const SceneView& held = k == 0 ? view_ : parts_.parts()->hands.hand(1).scene();
    lines_.push_back(std::make_unique<SessionLine>(
        held, LineSettings{settings.period_ns, settings.history_s, settings.priority}));
  }
  make_loop();
}

void SimulatedSession::make_loop() {
  const hal::ServoLoopSettings settings = loop_settings(settings_, parts_);
  SessionLine& first = *lines_[0];
  HeldParts* const parts = parts_.parts();
  if (lines_.size() > 1) {
    SessionLine& second = *lines_[1];
    two_tick_.emplace(parts->hands, std::array{first.parameters(), second.parameters()},
                      std::array{&first.recorder(), &second.recorder()});
    loop_.emplace(*two_tick_, std::array{&first.mailbox(), &second.mailbox()}, settings);
    loop_->watch(&SimulatedSession::watch_second, this, 1);
  } else {
    if (parts != nullptr) {
      tick_.emplace(parts->hand(), first.parameters(), &first.recorder());
    } else {
      tick_.emplace(*parts_.core(), first.parameters(), view_.header().capacity, &first.recorder());
    }
    loop_.emplace(*tick_, first.mailbox(), settings);
  }
  loop_->watch(&SimulatedSession::watch_first, this);
}

int SimulatedSession::start() {
  opened_ns_ = hal::monotonic_ns();
  try {
    const hal::SignalsHeld held;
    servo_ = std::thread([this] {
      hal::ThreadSettings thread;
      thread.priority = settings_.priority;
      int refused = 0;
      for (const hal::StepGrant& grant : hal::start_realtime_thread(thread)) {
        if (grant.step == hal::StartStep::kPriority && grant.asked) refused = grant.error;
      }
      begun_.store(refused);
      begun_.notify_one();
      if (refused == 0) (void)loop_->run(stop_);
    });
  } catch (const std::system_error&) {
    closed_.store(true);
    return HAPTIC_ERROR_SYSTEM;
  }
  begun_.wait(-1);
  bool begins = begun_.load() == 0;
  for (const auto& line : lines_) begins = begins && line->start();
  if (!begins) {
    close();
    return HAPTIC_ERROR_SYSTEM;
  }
  // A switch that is held from the start arms nothing: it is pressed once the device is ready.
  if (settings_.hold != HAPTIC_RELEASE) {
    constexpr std::int64_t kLongestStart_ns = 2'000'000'000;
    for (const auto& line : lines_) {
      haptic_state now = HAPTIC_STATE_INIT;
      while (now.link != static_cast<std::uint32_t>(LinkState::kReady) &&
             hal::monotonic_ns() - opened_ns_ < kLongestStart_ns) {
        (void)hal::sleep_until(hal::monotonic_ns() + settings_.period_ns);
        line->notes().state(now);
      }
    }
    for (const auto& line : lines_) line->hold(settings_.hold);
  }
  return HAPTIC_OK;
}

void SimulatedSession::close() noexcept {
  if (closed_.exchange(true)) return;
  // Each ramps to zero by itself, while the loop still ticks.
  for (const auto& line : lines_) line->begin_stop();
  for (const auto& line : lines_) line->stop();
  stop_.store(true);
  if (servo_.joinable()) servo_.join();
}

void SimulatedSession::watch_first(void* self, const ServoInput& input, const ServoResult& result) {
  static_cast<SimulatedSession*>(self)->note(0, input, result);
}

void SimulatedSession::watch_second(void* self, const ServoInput& input,
                                    const ServoResult& result) {
  static_cast<SimulatedSession*>(self)->note(1, input, result);
}

// On the servo thread. The counters of the loop are those of the tick before.
void SimulatedSession::note(std::size_t hand, const ServoInput& input,
                            const ServoResult& result) noexcept {
  lines_[hand]->note(input, result, loop_->counters(), opened_ns_, parts_.after(result));
}

void SimulatedSession::gains(haptic_gains& gains) const noexcept {
  gains = HAPTIC_GAINS_INIT;
  const SceneParameters& p = view_.parameters();
  gains.lowered = lowered_.empty() ? 0 : 1;
  gains.stiffness_n_per_m = stiffness_of(p);
  gains.stiffness_nm_per_rad = p.law == LawId::kProxy ? p.coupling.k_r_nm_per_rad : 0.0;
  gains.asked_n_per_m = asked_n_per_m_;
  gains.asked_nm_per_rad = asked_nm_per_rad_;
  lowered_.copy(gains.text, sizeof gains.text - 1);
}

void SimulatedSession::device(std::size_t hand, haptic_device_status& status) const noexcept {
  status = HAPTIC_DEVICE_STATUS_INIT;
  haptic_state now = HAPTIC_STATE_INIT;
  lines_[hand]->notes().state(now);
  status.phase = closed()        ? HAPTIC_DEVICE_ENDED
                 : now.tick == 0 ? HAPTIC_DEVICE_STARTS
                                 : HAPTIC_DEVICE_RUNS;
  status.link = closed() ? 0 : now.link;
  status.faults = now.device_faults;
  if (closed()) return;
  status.force_n = std::hypot(now.sent_wrench[0], now.sent_wrench[1], now.sent_wrench[2]);
  status.torque_nm = std::hypot(now.sent_wrench[3], now.sent_wrench[4], now.sent_wrench[5]);
}

int SimulatedSession::move_fixed(const haptic_frame& frame) {
  parts_.move_fixed(frame, hal::monotonic_ns());
  return HAPTIC_OK;
}

int SimulatedSession::drive(std::uint32_t part, const haptic_frame& frame) {
  return parts_.drive(part, frame, hal::monotonic_ns());
}

void SimulatedSession::stop() noexcept {
  loop_->emergency_stop();
  for (const auto& line : lines_) line->emergency_stop();
}

}  // namespace haptic::tools
