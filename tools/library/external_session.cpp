// SPDX-License-Identifier: Apache-2.0
#include "tools/library/external_session.hpp"

#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "hal/clock/servo_clock.hpp"
#include "tools/library/call.hpp"
#include "tools/library/contact_shares.hpp"

namespace haptic::tools {
namespace {

SceneView view_of(const SceneBytes& scene) {
  SceneView view;
  if (SceneView::open(scene.span(), view) != RtStatus::kOk)
    throw std::logic_error("the scene was not opened before");
  return view;
}

/// The lowest bit of ArmingWait, for people.
const char* wait_words(std::uint32_t waits) noexcept {
  if ((waits & kWaitDevice) != 0) return "the device is not ready, or has given no report";
  if ((waits & kWaitHomed) != 0) return "the device is not calibrated";
  if ((waits & kWaitPose) != 0) return "no pose that can be used has come yet";
  if ((waits & kWaitLate) != 0) return "reports or ticks come too late";
  if ((waits & kWaitInside) != 0) return "the part is being led out of an obstacle";
  if ((waits & kWaitCause) != 0) return "the cause of a fault is there";
  if ((waits & kWaitRampOut) != 0) return "the force ramps to zero";
  if ((waits & kWaitDeadmanReleased) != 0) return "release the deadman switch, then press it";
  return (waits & kWaitDeadmanPressed) != 0 ? "press the deadman switch" : "";
}

bool is_zero(const haptic_servo_output& output) noexcept {
  return std::all_of(output.wrench, output.wrench + 6, [](double x) { return x == 0; });
}

int this_thread() noexcept { return static_cast<int>(syscall(SYS_gettid)); }

}  // namespace

ExternalSession::ExternalSession(std::span<const std::byte> scene,
                                 const haptic_servo_options& options, double history_s)
    : scene_(scene),
      view_(view_of(scene_)),
      parameters_(parameters_of(options, view_)),
      parts_(view_),
      notes_(view_, parameters_, history_s),
      opened_ns_(hal::monotonic_ns()),
      time_(parameters_.limits.period_ns),
      frames_(parts_.frames()) {
  const auto records = parts_.driven_records();
  for (std::size_t k = 0; k < records.size(); ++k) driven_[k].emplace(records[k]);
  if (HeldParts* const parts = parts_.parts(); parts != nullptr) {
    tick_.emplace(parts->hand(), parameters_, &notes_.recorder());
  } else {
    tick_.emplace(*parts_.core(), parameters_, view_.header().capacity, &notes_.recorder());
  }
}

int ExternalSession::tick(const haptic_servo_input& input, haptic_servo_output& output) noexcept {
  const Turn turn(busy_);
  if (!turn.is_mine) return HAPTIC_ERROR_BUSY;
  if (is_over_.load()) return HAPTIC_ERROR_CLOSED;
  const std::int64_t begin_ns = hal::monotonic_ns();
  // Read before the tick: a close that comes during it is that of the next.
  const bool is_closing = closed_.load();
  loop_thread_.store(this_thread(), std::memory_order_relaxed);
  const std::uint32_t lost_periods = parameters_.limits.lost_periods;
  const std::int64_t before_ns = time_.now_ns();
  const bool goes_on = time_.advance(input.time_s, lost_periods);
  ServoInput given = input_of(time_, goes_on, lost_periods, input);
  given.emergency_stop = given.emergency_stop || stop_.exchange(false) || is_closing;
  given.frame = frames_.newest();
  const std::size_t driven = parts_.driven_records().size();
  for (std::size_t k = 0; k < driven; ++k) newest_driven_[k] = driven_[k]->newest();
  given.driven = std::span<const FrameRecord>(newest_driven_).first(driven);
  const ServoResult& result = result_ = tick_->step(given);
  write_output(result, output);
  waits_.store(result.waits, std::memory_order_relaxed);
  faults_.store(result.faults, std::memory_order_relaxed);
  if (input.ready != 0 && input.report != last_report_) {
    last_report_ = input.report;
    reports_.fetch_add(1, std::memory_order_relaxed);
  }
  count(time_.now_ns() - before_ns, begin_ns);
  haptic_state& state = notes_.take(given, result, counts_, parts_.after(result));
  const std::uint32_t deadman = parameters_.switches.deadman;
  state.hand_held = (input.switches & deadman) == deadman ? 1 : 0;
  notes_.publish();
  tick_now_ns_.store(time_.now_ns(), std::memory_order_relaxed);
  ticked_ns_.store(begin_ns, std::memory_order_release);
  if (is_closing && is_zero(output)) is_over_.store(true);
  return HAPTIC_OK;
}

int ExternalSession::contacts(std::span<haptic_contact> contacts, std::size_t& count,
                              Wrench& rest) noexcept {
  const Turn turn(busy_);
  if (!turn.is_mine) return HAPTIC_ERROR_BUSY;
  if (parts_.core() == nullptr) return HAPTIC_ERROR_PART;
  if (view_.parameters().law != LawId::kProxy) return HAPTIC_ERROR_SCENE;
  const StepResult& rendered = result_.rendered;
  if (counts_.ticks == 0 || rendered.status != RtStatus::kOk) return HAPTIC_OK;
  count = write_contacts(*parts_.core(), view_, {rendered.wrench_w, rendered.proxy_pose_wa},
                         contacts, rest);
  turn_into(result_.frame_wf, contacts.first(std::min(count, contacts.size())), rest);
  return HAPTIC_OK;
}

void ExternalSession::count(std::int64_t passed_ns, std::int64_t begin_ns) noexcept {
  const std::int64_t periods = passed_ns / parameters_.limits.period_ns;
  counts_.ticks += 1;
  if (counts_.ticks > 1 && periods > 1) {
    counts_.late += 1;
    counts_.missed_periods += static_cast<std::uint64_t>(periods) - 1;
  }
  counts_.largest_tick_ns = std::max(counts_.largest_tick_ns, hal::monotonic_ns() - begin_ns);
  counts_.since_opened_ns = begin_ns - opened_ns_;
}

std::int64_t ExternalSession::silence_ns() const noexcept {
  const std::int64_t last_ns = ticked_ns_.load(std::memory_order_acquire);
  return last_ns == 0 ? 0 : hal::monotonic_ns() - last_ns;
}

void ExternalSession::close() noexcept {
  if (closed_.exchange(true) || !is_of_this_process()) return;
  constexpr std::int64_t kLongestRamp_ns = 500'000'000, kLook_ns = 1'000'000;
  const bool is_loop = loop_thread_.load() == this_thread();
  const std::int64_t until_ns = hal::monotonic_ns() + kLongestRamp_ns;
  const std::int64_t quiet_ns =
      std::max<std::int64_t>(50'000'000, 10 * parameters_.limits.period_ns);
  while (!is_loop && !is_over_.load() && ticked_ns_.load() != 0 && silence_ns() < quiet_ns &&
         hal::monotonic_ns() < until_ns)
    (void)hal::sleep_until(hal::monotonic_ns() + kLook_ns);
}

void ExternalSession::state(std::size_t /*hand*/, haptic_state& state) const noexcept {
  notes_.state(state);
}

void ExternalSession::gains(haptic_gains& gains) const noexcept {
  gains = HAPTIC_GAINS_INIT;
  const SceneParameters& p = view_.parameters();
  const bool is_proxy = p.law == LawId::kProxy;
  gains.stiffness_n_per_m = gains.asked_n_per_m = is_proxy ? p.coupling.k_t_n_per_m : p.k_f_n_per_m;
  gains.stiffness_nm_per_rad = gains.asked_nm_per_rad = is_proxy ? p.coupling.k_r_nm_per_rad : 0.0;
}

void ExternalSession::device(std::size_t /*hand*/, haptic_device_status& status) const noexcept {
  status = HAPTIC_DEVICE_STATUS_INIT;
  haptic_state now = HAPTIC_STATE_INIT;
  notes_.state(now);
  status.reports = reports_.load(std::memory_order_relaxed);
  status.phase = is_over_.load()          ? HAPTIC_DEVICE_ENDED
                 : ticked_ns_.load() == 0 ? HAPTIC_DEVICE_STARTS
                                          : HAPTIC_DEVICE_RUNS;
  status.faults = now.device_faults;
  if (status.phase == HAPTIC_DEVICE_ENDED) {
    (void)std::snprintf(status.why, sizeof status.why, "the session was closed");
    return;
  }
  status.link = now.link;
  status.force_n = std::hypot(now.sent_wrench[0], now.sent_wrench[1], now.sent_wrench[2]);
  status.torque_nm = std::hypot(now.sent_wrench[3], now.sent_wrench[4], now.sent_wrench[5]);
  const std::int64_t silence = silence_ns();
  const std::int64_t lost_ns = parameters_.limits.lost_periods * parameters_.limits.period_ns;
  status.is_silent = silence > lost_ns ? 1 : 0;
  if (status.phase == HAPTIC_DEVICE_STARTS) {
    (void)std::snprintf(status.waits_for, sizeof status.waits_for,
                        "the loop of the device has not called haptic_session_tick yet");
  } else if (status.is_silent != 0) {
    (void)std::snprintf(
        status.waits_for, sizeof status.waits_for,
        "the loop of the device has not called haptic_session_tick for %.0f ms; the "
        "device keeps its last force until its own watchdog takes it away",
        1e-6 * static_cast<double>(silence));
  } else {
    const std::uint32_t faults = faults_.load(std::memory_order_relaxed);
    (void)std::snprintf(status.waits_for, sizeof status.waits_for, "%s%s%s",
                        wait_words(waits_.load(std::memory_order_relaxed)),
                        faults != 0 ? "; fault: " : "", faults != 0 ? fault_text(faults) : "");
  }
}

int ExternalSession::move_fixed(const haptic_frame& frame) {
  parts_.move_fixed(frame, tick_now_ns_.load());
  return HAPTIC_OK;
}

int ExternalSession::drive(std::uint32_t part, const haptic_frame& frame) {
  return parts_.drive(part, frame, tick_now_ns_.load());
}

}  // namespace haptic::tools
