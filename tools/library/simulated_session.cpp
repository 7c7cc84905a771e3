// SPDX-License-Identifier: Apache-2.0
#include "tools/library/simulated_session.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <system_error>

#include "hal/clock/linux_process.hpp"
#include "hal/clock/servo_clock.hpp"
#include "hal/device_limits.hpp"
#include "tools/common/changed_scene.hpp"
#include "tools/graph_compiler/coupling/served_size.hpp"
#include "tools/graph_compiler/coupling/simulated_gains.hpp"
#include "tools/graph_compiler/graph/part_tables.hpp"
#include "tools/library/call.hpp"

namespace haptic::tools {
namespace {

std::unique_ptr<HeldParts> parts_in(const SceneView& view) {
  std::unique_ptr<HeldParts> parts;
  if (HeldParts::open(view, parts) != RtStatus::kOk)
    throw std::logic_error("the parts of a scene that was opened are refused");
  return parts;
}

/// Null: its parts have cores of their own.
HapticCore* core_in(SceneBytes& memory, const SceneView& view, const HeldParts* parts) {
  HapticCore* core = nullptr;
  if (parts != nullptr) return core;
  memory = SceneBytes(HapticCore::state_bytes(view));
  if (HapticCore::create(memory.span(), view, core) != RtStatus::kOk)
    throw std::logic_error("the core refuses a scene that was opened");
  return core;
}

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

std::size_t recorded_ticks(const SessionSettings& settings) {
  return static_cast<std::size_t>(
      std::ceil(1e9 * settings.history_s / static_cast<double>(settings.period_ns)));
}

ServoTick tick_over(HapticCore* core, HeldParts* parts, const SceneView& view,
                    const ServoParameters& parameters, FlightRecorder& recorder) {
  if (parts != nullptr) return ServoTick(parts->hand(), parameters, &recorder);
  return ServoTick(*core, parameters, view.header().capacity, &recorder);
}

/// The handle's origin and axes are the part's where the scene has it start.
ServoParameters servo_parameters(const SceneView& view, const hal::Driver& driver,
                                 std::int64_t period_ns) {
  ServoParameters p;
  const SceneParameters& scene = view.parameters();
  const auto real = [](double x) { return static_cast<Real>(x); };
  const double* grip = view.bodies()[0].reference_m;
  const double* q = scene.start_q_wa_xyzw;
  p.map.grip_a = Vec3(real(grip[0]), real(grip[1]), real(grip[2]));
  p.map.q_ha = Quat(real(q[3]), real(q[0]), real(q[1]), real(q[2])).normalized();
  const double* at = scene.start_p_wa_m;
  p.map.offset_w = Vec3(real(at[0]), real(at[1]), real(at[2])) + p.map.q_ha * p.map.grip_a;
  p.limits = hal::limits_of(driver.capabilities(), period_ns);
  return p;
}

hal::LinkSettings link_settings(const ServoParameters& parameters) {
  hal::LinkSettings settings;
  settings.limits = parameters.limits;
  settings.deadman = parameters.switches.deadman;
  return settings;
}

hal::UsbThreadSettings thread_settings(const SessionSettings& settings) {
  hal::UsbThreadSettings thread;
  thread.period_ns = settings.period_ns;
  thread.priority = std::max(0, settings.priority - 1);
  thread.name = "haptic-link";
  return thread;
}

hal::ServoLoopSettings loop_settings(const SessionSettings& settings,
                                     const NewestRecord<FrameRecord>& frames,
                                     std::span<const NewestRecord<FrameRecord>> driven) {
  hal::ServoLoopSettings loop;
  loop.period_ns = settings.period_ns;
  loop.frames = &frames;
  loop.driven = driven;
  return loop;
}

std::span<const NewestRecord<FrameRecord>> driven_in(
    const HeldParts* parts, std::span<const NewestRecord<FrameRecord>> records) {
  return records.first(parts != nullptr ? parts->scenes.driven().size() : 0);
}

std::array<double, 4> between(const std::array<double, 4>& a, const std::array<double, 4>& b,
                              double share) {
  using Turn = Eigen::Quaternion<double, Eigen::DontAlign>;
  const Turn q = Turn(a[3], a[0], a[1], a[2]).slerp(share, Turn(b[3], b[0], b[1], b[2]));
  return {q.x(), q.y(), q.z(), q.w()};
}

}  // namespace

// A fault is let go of for a moment before the next press, and a press is given one to take effect.
bool GuidedHand::presses(std::uint64_t hold, double t_s) noexcept {
  constexpr double kMoment_s = 0.05;
  if (hold == HAPTIC_RELEASE) return false;
  const bool stopped = stopped_.load(std::memory_order_relaxed);
  const bool again = hold == HAPTIC_HOLD_AGAIN && !stopped;
  if (!now_.deadman) {
    // Also a press that was ordered before the stop must not undo it.
    if (stopped || t_s < released_s_ + kMoment_s) return false;
    pressed_s_ = t_s;
    return true;
  }
  if (!again || !faulted_.load(std::memory_order_relaxed) || t_s < pressed_s_ + kMoment_s)
    return true;
  released_s_ = t_s;
  return false;
}

HandWish GuidedHand::wish(double t_s) noexcept {
  const HandOrder& order = reader_.newest();
  if (order.number != number_) {
    number_ = order.number;
    from_ = now_;
    from_s_ = t_s;
  }
  now_.deadman = presses(order.hold, t_s);
  holds_.store(now_.deadman, std::memory_order_relaxed);
  if (order.number == 0) return now_;
  const double x = std::clamp((t_s - from_s_) / order.seconds, 0.0, 1.0);
  const double share = x * x * x * (10 - 15 * x + 6 * x * x);  // smallest jerk
  for (std::size_t k = 0; k < 3; ++k) {
    now_.position_m[k] = from_.position_m[k] + share * (order.pose_dh[k] - from_.position_m[k]);
  }
  const double* q = order.pose_dh + 3;
  now_.q_xyzw = between(from_.q_xyzw, {q[0], q[1], q[2], q[3]}, share);
  // Release: who sees the number sees a wish that is there.
  if (x >= 1.0) reached_.store(order.number, std::memory_order_release);
  return now_;
}

SimulatedSession::SimulatedSession(std::span<const std::byte> scene,
                                   const SessionSettings& settings)
    : settings_(settings),
      scene_(
          rendered_scene(scene, settings.period_ns, asked_n_per_m_, asked_nm_per_rad_, lowered_)),
      history_memory_(FlightRecorder::bytes_for(recorded_ticks(settings))),
      view_(view_of(scene_)),
      parts_(parts_in(view_)),
      core_(core_in(core_memory_, view_, parts_.get())),
      parameters_(servo_parameters(view_, driver_, settings.period_ns)),
      peer_(SimulatedPeerSettings{settings.period_ns, parameters_.switches.deadman}, hand_),
      link_(driver_, mailbox_, peer_, link_settings(parameters_)),
      link_thread_(link_, thread_settings(settings)),
      recorder_(history_memory_.span()),
      tick_(tick_over(core_, parts_.get(), view_, parameters_, recorder_)),
      loop_(tick_, mailbox_, loop_settings(settings, frames_, driven_in(parts_.get(), driven_))),
      judge_(view_) {
  for (std::size_t k = 0; k < driven_.size(); ++k) driven_streams_[k].writer.emplace(driven_[k]);
  loop_.watch(&SimulatedSession::watch, this);
}

int SimulatedSession::start() {
  opened_ns_ = hal::monotonic_ns();
  try {
    servo_ = std::thread([this] {
      hal::ThreadSettings thread;
      thread.priority = settings_.priority;
      int refused = 0;
      for (const hal::StepGrant& grant : hal::start_realtime_thread(thread)) {
        if (grant.step == hal::StartStep::kPriority && grant.asked) refused = grant.error;
      }
      begun_.store(refused);
      begun_.notify_one();
      if (refused == 0) (void)loop_.run(stop_);
    });
  } catch (const std::system_error&) {
    closed_.store(true);
    return HAPTIC_ERROR_SYSTEM;
  }
  begun_.wait(-1);
  if (begun_.load() != 0 || link_thread_.start().create_error != 0) {
    close();
    return HAPTIC_ERROR_SYSTEM;
  }
  // A switch that is held from the start arms nothing: it is pressed once the device is ready.
  if (settings_.hold != HAPTIC_RELEASE) {
    constexpr std::int64_t kLongestStart_ns = 2'000'000'000;
    haptic_state now = HAPTIC_STATE_INIT;
    while (now.link != static_cast<std::uint32_t>(LinkState::kReady) &&
           hal::monotonic_ns() - opened_ns_ < kLongestStart_ns) {
      (void)hal::sleep_until(hal::monotonic_ns() + settings_.period_ns);
      state(now);
    }
    hold(settings_.hold);
  }
  return HAPTIC_OK;
}

void SimulatedSession::close() noexcept {
  if (closed_.exchange(true)) return;
  link_thread_.stop();  // ramps to zero by itself, while the loop still ticks
  stop_.store(true);
  if (servo_.joinable()) servo_.join();
}

void SimulatedSession::watch(void* self, const ServoInput& input, const ServoResult& result) {
  static_cast<SimulatedSession*>(self)->note(input, result);
}

// On the servo thread. The counters of the loop are those of the tick before.
void SimulatedSession::note(const ServoInput& input, const ServoResult& result) noexcept {
  if (result.rendered_new) judge_.take(result.rendered);
  NewestTick record{HAPTIC_STATE_INIT, judge_.verdict(), {}};
  haptic_state& s = record.state;
  const StepResult& rendered = result.rendered;
  const hal::ServoLoopCounters& counters = loop_.counters();
  s.link = static_cast<std::uint32_t>(input.state.link);
  s.tick = counters.ticks;
  s.time_s = 1e-9 * static_cast<double>(input.now_ns - opened_ns_);
  write_numbers(mesh_pose(parameters_.map, pose_of(input.state.pose_dh)), s.hand_pose);
  const Pose& frame = result.frame_wf;
  const Pose& felt = rendered.proxy_pose_wa;
  write_numbers(Pose{frame.p_wa + frame.q_wa * felt.p_wa, frame.q_wa * felt.q_wa}, s.felt_pose);
  write_numbers(frame, record.held.frame_pose);
  if (parts_ != nullptr) note_holds(parts_->hands, record.held);
  if (parts_ != nullptr) note_driven(parts_->hand(), record.held);
  write_numbers(
      Wrench{frame.q_wa * rendered.wrench_w.force_w, frame.q_wa * rendered.wrench_w.torque_w},
      s.wrench);
  write_numbers(scene_wrench(parameters_.map, wrench_of(result.command.wrench_d)), s.sent_wrench);
  s.gap_m = static_cast<double>(rendered.proxy_gap_m);
  s.state_hash = rendered.state_hash;
  s.situation = static_cast<std::uint32_t>(rendered.situation);
  s.flags = rendered.flags;
  s.arming = static_cast<std::uint32_t>(result.arming);
  s.safety_faults = result.faults;
  s.device_faults = input.state.faults;
  s.hand_held = hand_.holds() ? 1 : 0;
  s.goals_reached = hand_.reached();
  s.late_ticks = counters.late;
  s.missed_periods = counters.missed_periods;
  s.longest_tick_s = 1e-9 * static_cast<double>(counters.largest_tick_ns);
  s.armings = result.command.arming;
  hand_.note_fault(result.arming == ArmingState::kFaulted);
  newest_writer_.publish(record);
}

void SimulatedSession::state(haptic_state& state) const noexcept {
  NewestReader<NewestTick> reader(newest_);
  bool found = false;
  const NewestTick& record = reader.newest(&found);
  state = HAPTIC_STATE_INIT;
  if (found) state = record.state;
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

int SimulatedSession::hold_part(std::uint32_t part) {
  if (parts_ == nullptr || part >= parts_->scenes.count() || !parts_->scenes.may_be_taken(part))
    return HAPTIC_ERROR_PART;
  constexpr std::int64_t kLongestRamp_ns = 2'000'000'000;
  const std::int64_t until_ns = hal::monotonic_ns() + kLongestRamp_ns;
  while (true) {
    if (const int error = go_on_to(part); error != HAPTIC_ERROR_BUSY) return error;
    if (closed() || hal::monotonic_ns() >= until_ns) return HAPTIC_ERROR_BUSY;
    (void)hal::sleep_until(hal::monotonic_ns() + settings_.period_ns);
  }
}

/// Does what can be done now on the way to holding `part`. HAPTIC_ERROR_BUSY: it is not all.
int SimulatedSession::go_on_to(std::uint32_t part) {
  const std::lock_guard lock(part_mutex_);
  PartHand& hand = parts_->hand();
  switch (hand.phase()) {
    case PartHand::Phase::kEmpty:
      // Its scene was opened before, and a pose that was felt is a pose.
      return hand.prepare(part) == RtStatus::kOk ? HAPTIC_OK : HAPTIC_ERROR_INTERNAL;
    case PartHand::Phase::kHolding:
      if (hand.part() == part) return HAPTIC_OK;
      hand.release();
      break;
    case PartHand::Phase::kLettingGo:
    case PartHand::Phase::kPrepared:
      break;
  }
  return HAPTIC_ERROR_BUSY;
}

int SimulatedSession::release_part() {
  if (parts_ == nullptr || parts_->scenes.holds_throughout()) return HAPTIC_ERROR_PART;
  const std::lock_guard lock(part_mutex_);
  parts_->hand().release();
  return HAPTIC_OK;
}

std::size_t SimulatedSession::bodies(std::span<haptic_body> bodies) const {
  if (parts_ == nullptr) return 0;
  const std::lock_guard lock(part_mutex_);
  NewestReader<NewestTick> reader(newest_);
  return write_bodies(parts_->scenes, parts_->hand(), reader.newest().held, bodies);
}

SessionVerdict SimulatedSession::verdict() const noexcept {
  NewestReader<NewestTick> reader(newest_);
  bool found = false;
  const NewestTick& record = reader.newest(&found);
  return found ? record.verdict : SessionVerdict{};
}

std::size_t SimulatedSession::history(std::span<haptic_tick> ticks) const {
  std::vector<StepTrace> records(std::min(ticks.size(), recorder_.capacity()));
  const std::size_t count = FlightRecorder::copy_newest(history_memory_.span(), records);
  for (std::size_t k = 0; k < count; ++k) {
    const StepTrace& from = records[k];
    haptic_tick& to = ticks[k];
    to = haptic_tick{};
    to.tick = from.tick;
    to.time_s = 1e-9 * static_cast<double>(from.now_ns - opened_ns_);
    double pose[7];
    std::copy_n(from.pose_p_m, 3, pose);
    std::copy_n(from.pose_q_xyzw, 4, pose + 3);
    write_numbers(mesh_pose(parameters_.map, pose_of_numbers(pose)), to.hand_pose);
    std::copy_n(from.rendered_force_n, 3, to.wrench);
    std::copy_n(from.rendered_torque_nm, 3, to.wrench + 3);
    WrenchRecord sent;
    for (int i = 0; i < 3; ++i) {
      sent.force_n[i] = static_cast<Real>(from.command_force_n[i]);
      sent.torque_nm[i] = static_cast<Real>(from.command_torque_nm[i]);
    }
    write_numbers(scene_wrench(parameters_.map, wrench_of(sent)), to.sent_wrench);
    to.situation = from.situation;
    to.flags = from.step_flags;
    to.arming = from.arming;
    to.safety_faults = from.faults;
  }
  return count;
}

std::uint64_t SimulatedSession::move_hand(const double* pose, double seconds) noexcept {
  Pose pose_wa = pose_of_numbers(pose);
  pose_wa.q_wa.normalize();
  order_.number += 1;
  order_.seconds = seconds;
  write_numbers(handle_pose(parameters_.map, pose_wa), order_.pose_dh);
  hand_.order(order_);
  return order_.number;
}

void SimulatedSession::hold(haptic_hold hold) noexcept {
  order_.hold = hold;
  hand_.allow_presses();
  hand_.order(order_);
}

void SimulatedSession::move_fixed(const haptic_frame& frame) noexcept {
  frame_ = next_record(frame_, frame, hal::monotonic_ns());
  frame_writer_.publish(frame_);
}

bool SimulatedSession::drive(std::uint32_t part, const haptic_frame& frame) noexcept {
  const std::uint32_t k = parts_ != nullptr ? driven_of(parts_->scenes, part) : kMostDriven;
  if (k == kMostDriven || !is_owned(parts_->scenes, part)) return false;
  DrivenStream& stream = driven_streams_[k];
  stream.last = next_record(stream.last, frame, hal::monotonic_ns());
  stream.writer->publish(stream.last);
  return true;
}

std::size_t SimulatedSession::driven(std::span<haptic_driven> driven) const noexcept {
  NewestReader<NewestTick> reader(newest_);
  return write_driven(reader.newest().held, driven);
}

void SimulatedSession::stop() noexcept {
  hand_.stop_presses();
  loop_.emergency_stop();
  link_.emergency_stop();
}

}  // namespace haptic::tools
