// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/device_run.hpp"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <memory>
#include <new>
#include <optional>
#include <system_error>

#include "hal/clock/linux_process.hpp"
#include "hal/clock/servo_clock.hpp"
#include "hal/local/local_link.hpp"
#include "hal/local/socket_peer.hpp"
#include "hal/realtime/process_hardening.hpp"
#include "rt_core/safety/safety_limits.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/formatted.hpp"
#include "tools/run_device/core_in_memory.hpp"
#include "tools/run_device/device_fit.hpp"
#include "tools/run_device/stop_key.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {
namespace {

constexpr unsigned kSpares = 1;
constexpr int kLook_ms = 20;
constexpr std::int64_t kLongestSetUp_ns = 10'000'000'000;

/// Stroke of the simulated hand straight down from where the part begins: 30 mm, or 10 mm farther
/// than where it touches first; 30 mm where it touches nothing within 300 mm. All at the device
/// [m]. Cost: a tick for each half millimetre. Not for the servo loop.
double press_stroke_m(const DeviceConfig& config, const SceneBytes& scene) {
  constexpr double kUsual_m = 0.03, kPress_m = 0.01, kFarthest_m = 0.3, kStep_m = 5.0e-4;
  CoreInMemory own;
  if (own.open(scene.span()) != RtStatus::kOk) return kUsual_m;
  const ServoParameters parameters = with_scene(config.servo, own.view);
  const WorkspaceMap map = begun_map(parameters.map, parameters.start, Pose{});
  const LawId law = own.view.parameters().law;
  Pose handle_dh;
  for (double down_m = 0; down_m <= kFarthest_m; down_m += kStep_m) {
    handle_dh.p_wa.z() = static_cast<Real>(-down_m);
    StepInput input;
    input.pose_wa = mesh_pose(map, handle_dh);
    if (felt_part_touches(own.core->step(input), law)) return std::max(kUsual_m, down_m + kPress_m);
  }
  return kUsual_m;
}

hal::GuardianSettings guardian_settings(const DeviceConfig& config, const RunLength& length,
                                        const RunWatch& watch) {
  hal::GuardianSettings settings;
  settings.spares = kSpares;
  settings.recorded_ticks = flight_records(config);
  settings.report_bytes = sizeof(ServoBoard);
  settings.order = length.ticks;
  settings.watcher = watch.watcher;
  settings.thread.period_ns = config.loop.period_ns;
  settings.thread.priority = config.loop.usb_priority;
  settings.thread.cpu = config.loop.usb_cpu;
  return settings;
}

hal::LinkSettings link_settings(const DeviceConfig& config) {
  hal::LinkSettings settings;
  settings.address = config.address;
  settings.deadman = config.servo.switches.deadman;
  settings.wake_servo = config.loop.report_clocked;
  settings.answer_wait_ns = config.loop.report_clocked ? config.loop.period_ns / 2 : 0;
  return settings;
}

template <std::size_t N>
void note_refusals(const char* who, const std::array<hal::StepGrant, N>& grants,
                   std::vector<Refusal>& refusals) {
  for (const hal::StepGrant& grant : grants) {
    if (grant.asked && grant.error != 0)
      refusals.push_back({std::string(who) + ": " + to_text(grant.step), grant.error});
  }
}

/// True if the link's thread will get its core and priority: known before the link has its limits.
/// Tried on this thread, which has neither afterwards.
bool grants_link_thread(const LoopConfig& loop) {
  cpu_set_t before;
  (void)pthread_getaffinity_np(pthread_self(), sizeof before, &before);
  bool granted = loop.usb_cpu < 0 || hal::tie_to_cpu(loop.usb_cpu) == 0;
  granted = (loop.usb_priority <= 0 || hal::set_fifo_priority(loop.usb_priority) == 0) && granted;
  const sched_param ordinary{};
  (void)pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
  (void)pthread_setaffinity_np(pthread_self(), sizeof before, &before);
  return granted;
}

void add(const TickCounts& from, TickCounts& to) {
  to.ticks += from.ticks;
  to.armed_ticks += from.armed_ticks;
  to.contact_ticks += from.contact_ticks;
  for (std::size_t k = 0; k < kLateDegrees; ++k) to.late[k] += from.late[k];
  for (std::size_t k = 0; k < hal::kLateCauses; ++k) to.causes[k] += from.causes[k];
  to.armings += from.armings;
  to.safety_faults |= from.safety_faults;
  to.device_faults |= from.device_faults;
  to.largest_force_n = std::max(to.largest_force_n, from.largest_force_n);
  to.largest_torque_nm = std::max(to.largest_torque_nm, from.largest_torque_nm);
}

/// All that a run consists of, made in the order in which it must be.
class Run {
 public:
  Run(const DeviceConfig& config, const SceneBytes& scene, const RunLength& length,
      const RunWatch& watch)
      : config_(config),
        scene_(scene),
        length_(length),
        watch_(watch),
        bus_(config.servo.limits, config.loop.period_ns),
        events_(watch.event),
        hand_(config.simulated ? press_stroke_m(config, scene) : 0.0),
        limits_(config.servo.limits),
        guardian_(guardian_settings(config, length, watch)) {}

  RunAccount go();

 private:
  void give_up_rights();
  void fork_servo();
  void judge_machine();
  void tell_notes();
  [[nodiscard]] bool wait_for_servo();
  void hold();
  void watch_until_end();
  [[nodiscard]] bool is_long_enough();
  void tell_status();
  [[nodiscard]] RunStatus status();
  void tell(const std::string& event, const std::string& text, LineLevel level) {
    events_.tell(held_ns_ == 0 ? 0 : seconds_held(), event, text, level);
  }
  [[nodiscard]] bool take_keeper_end();
  [[nodiscard]] bool take_end();
  void finish();
  [[nodiscard]] ServoBoard& board(unsigned number) {
    return *std::launder(reinterpret_cast<ServoBoard*>(guardian_.report(number).data()));
  }
  [[nodiscard]] ServoBoard& board() { return board(guardian_.number()); }
  [[nodiscard]] double seconds_held() const {
    return 1e-9 * static_cast<double>(hal::monotonic_ns() - held_ns_);
  }

  const DeviceConfig& config_;
  const SceneBytes& scene_;
  const RunLength& length_;
  const RunWatch& watch_;
  hal::RealtimeProcess process_;
  LinkWatch bus_;
  RunEvents events_;
  PressingHand hand_;  ///< of the peer
  std::unique_ptr<SimulatedPeer> peer_;
  std::unique_ptr<hal::SocketPeer> socket_;
  StopKey stop_key_;
  std::unique_ptr<hal::KeySwitch> deadman_;
  std::unique_ptr<hal::DeviceLink> link_;
  SafetyLimits limits_;             ///< the configuration's, lowered as the machine is not fit
  std::optional<DeviceGate> gate_;  ///< made with the link
  hal::DeviceGuardian guardian_;    ///< goes first: its thread works with all above
  std::int64_t held_ns_ = 0, next_status_ns_ = 0;
  bool at_work_ = true;  ///< the servo process that was begun last has not ended by itself
  RunAccount account_;
};

// Started by sudo, a run keeps what it uses: priority and locked memory, and the crash file where
// it is another user's.
void Run::give_up_rights() {
  const LoopConfig& loop = config_.loop;
  const hal::KeptCapabilities kept =
      hal::drop_capabilities({std::max(loop.servo_priority, loop.usb_priority), loop.lock_memory,
                              !config_.crash_file.empty()});
  if (kept.error != 0) account_.refusals.push_back({"giving up capabilities", kept.error});
}

void Run::fork_servo() {
  const int error =
      guardian_.start([this](const hal::ServoSeat& seat) { return serve(config_, scene_, seat); });
  if (error != 0)
    throw OsError("the servo process cannot be started: " + std::generic_category().message(error));
  if (watch_.forked) watch_.forked();
}

// False: it ended, or was not ready in time.
bool Run::wait_for_servo() {
  const std::int64_t end_ns = hal::monotonic_ns() + kLongestSetUp_ns;
  while (!board().ready.load(std::memory_order_acquire)) {
    const hal::GuardianNews news = guardian_.wait(1);
    if (news == hal::GuardianNews::kStopAsked) {
      account_.why = "stopped before the loop began";
      return false;
    }
    at_work_ = news != hal::GuardianNews::kServoEnded;
    if (!at_work_ || hal::monotonic_ns() > end_ns) {
      account_.exit_code = kExitDeviceOrOs;
      account_.why = "the servo process did not come up";
      return false;
    }
  }
  note_refusals("servo process", board().grants.process, account_.refusals);
  note_refusals("servo thread", board().grants.thread, account_.refusals);
  // A sanitizer makes calls of its own; there is no filter then.
  const int filter = board().grants.filter;
  if (filter != 0 && filter != ENOTSUP)
    account_.refusals.push_back({"servo process: system call filter", filter});
  return true;
}

void Run::hold() {
  hal::LinkSettings settings = link_settings(config_);
  settings.zero_holder = &guardian_.keeper();
  settings.limits = limits_;
  gate_.emplace(fit_question(config_, scene_), limits_);
  if (config_.has_motors)
    settings.accept = [this](const hal::DeviceCapabilities& c) {
      bus_.expect_reports_every(hal::report_interval_ns(c));
      return gate_->admit(c);
    };
  if (!config_.deadman_input.path.empty()) {
    deadman_ = std::make_unique<hal::KeySwitch>(config_.deadman_input);
    settings.switches = deadman_.get();
  }
  hal::Driver& driver = *config_.driver;
  if (config_.simulated) {
    peer_ = std::make_unique<SimulatedPeer>(
        SimulatedPeerSettings{config_.loop.period_ns, config_.servo.switches.deadman}, hand_);
    link_ = std::make_unique<hal::LocalLink>(driver, guardian_.mailbox(), *peer_, settings);
  } else if (!config_.socket_path.empty()) {
    socket_ = std::make_unique<hal::SocketPeer>(config_.socket_path);
    link_ = std::make_unique<hal::LocalLink>(driver, guardian_.mailbox(), *socket_, settings);
  } else {
    link_ = std::make_unique<hal::UsbLink>(driver, guardian_.mailbox(), settings);
  }
  bus_.follow(board().window);
  link_->observe(&bus_);
  const hal::UsbThreadGrant grant = guardian_.hold(*link_);
  if (grant.create_error != 0)
    throw OsError("no thread for the link: " + std::generic_category().message(grant.create_error));
  if (grant.affinity_error != 0)
    account_.refusals.push_back({"USB thread: core affinity", grant.affinity_error});
  if (grant.priority_error != 0)
    account_.refusals.push_back({"USB thread: SCHED_FIFO priority", grant.priority_error});
  held_ns_ = hal::monotonic_ns();
}

// How late the servo thread was woken before anything arms; what it may exert for that.
void Run::judge_machine() {
  if (!config_.has_motors) return;
  const bool granted = account_.refusals.empty() && grants_link_thread(config_.loop);
  const MachineFit machine = machine_fit(board().wakeups, config_.loop.period_ns, granted);
  std::vector<std::string> notes = {machine.found};
  if (!machine.fit && config_.loop.strict) {
    account_.refused = true;
  } else if (!machine.fit) {
    account_.share = machine.share;
    limits_ = lowered(config_.servo.limits, machine.share);
    notes.push_back("degraded: force and torque are lowered to " + short_number(machine.share, 3) +
                    " of the device's");
  }
  watch_.notes(notes);
}

void Run::tell_notes() {
  const std::vector<std::string> notes = gate_->take_notes();
  if (!notes.empty()) watch_.notes(notes);
}

void Run::tell_status() {
  const auto every_ns = static_cast<std::int64_t>(1e9 * watch_.status_every_s);
  const RunStatus now = status();
  events_.look(now);
  if (watch_.status_every_s <= 0 || hal::monotonic_ns() < next_status_ns_) return;
  next_status_ns_ = std::max(next_status_ns_ + every_ns, hal::monotonic_ns());
  watch_.status(now);
}

RunStatus Run::status() {
  RunStatus s;
  s.t_s = seconds_held();
  s.force_n = bus_.force_n();
  s.torque_nm = bus_.torque_nm();
  s.link_faults = bus_.faults();
  s.silence_ns = guardian_.silence_ns();
  s.servo = status_of(board());
  s.link = link_->state();
  s.counters = link_->counters();
  s.trouble = link_->trouble();
  return s;
}

// Reports a servo process that nobody asked to end. @return whether a spare goes on.
bool Run::take_end() {
  const hal::ServoEnd& end = guardian_.servo_end();
  tell("servo ended",
       "servo process " + std::to_string(end.number) + " (pid " + std::to_string(end.pid) +
           "): " + hal::to_text(end),
       LineLevel::kError);
  watch_.crash({end.number, end.pid, hal::to_text(end), end.records});
  const ServoStatus last_word = status_of(board(end.number));
  add(last_word.counts, account_.counts);
  add(last_word.verdict, account_.verdict);
  account_.processes += 1;
  if (end.end.signal != 0) {
    account_.exit_code = kExitCheckFailed;
    if (length_.ticks > 0) {
      const std::uint64_t left = length_.ticks - std::min(account_.counts.ticks, length_.ticks);
      for (unsigned k = 0; k <= kSpares; ++k)
        guardian_.order(k, std::max<std::uint64_t>(left, 1));  // 0 asks for all
    }
    if (guardian_.take_over()) {
      bus_.follow(board().window);
      tell("spare begins",
           "spare " + std::to_string(guardian_.number()) + " (pid " +
               std::to_string(guardian_.pid()) +
               ") begins; no force until the deadman switch is released and pressed",
           LineLevel::kWarning);
      return true;
    }
    at_work_ = false;
    account_.why = "the last servo process was " + hal::to_text(end) + "; there is no spare";
    return false;
  }
  at_work_ = false;
  const bool known = end.end.exit_code >= kExitDone && end.end.exit_code <= kExitDeviceOrOs;
  account_.exit_code = known ? end.end.exit_code : kExitCheckFailed;
  account_.why = "the servo process returned by itself: " + hal::to_text(end.end);
  return false;
}

bool Run::is_long_enough() {
  if (length_.ticks > 0 && board().window.load(std::memory_order_acquire) == CountWindow::kOver) {
    account_.why = "the ticks asked for are done";
    return true;
  }
  if (length_.seconds <= 0 || seconds_held() < length_.seconds) return false;
  account_.why = "the time asked for is over";
  if (link_->counters().connects == 0) {
    account_.why += "; the device was never there";
    account_.exit_code = kExitDeviceOrOs;
  } else if (length_.ticks > 0) {
    account_.why += "; the ticks asked for are not done";
    account_.exit_code = kExitCheckFailed;
  }
  return true;
}

// @return whether the run goes on: not where nothing else would take the force away.
bool Run::take_keeper_end() {
  const std::string text = "the zero-keeper: " + hal::to_text(guardian_.keeper_end());
  tell("keeper ended", text, LineLevel::kError);
  const hal::DeviceCapabilities& device = config_.driver->capabilities();
  if (device.watchdog_ns > 0 || device.driven_dof == 0) return true;
  account_.exit_code = kExitCheckFailed;
  account_.why = text + "; the device has no watchdog of its own";
  return false;
}

void Run::watch_until_end() {
  next_status_ns_ = held_ns_ + static_cast<std::int64_t>(1e9 * watch_.status_every_s);
  for (;;) {
    const hal::GuardianNews news = guardian_.wait(kLook_ms);
    if (news == hal::GuardianNews::kServoEnded && !take_end()) return;
    if (news == hal::GuardianNews::kKeeperEnded && !take_keeper_end()) return;
    if (news == hal::GuardianNews::kStopAsked) {
      account_.why = "stopped by " + hal::signal_text(guardian_.stop_signal());
      tell("stopping", account_.why, LineLevel::kNotice);
      return;
    }
    tell_notes();
    if (link_->counters().connects == 0 && !gate_->refusal().empty()) {
      account_.why = "the device is refused: " + gate_->refusal();
      account_.exit_code = kExitDeviceOrOs;
      return;
    }
    if (stop_key_.pressed()) link_->emergency_stop();
    if (is_long_enough()) return;
    tell_status();
  }
}

void Run::finish() {
  bus_.begin_ending();
  account_.seconds = held_ns_ == 0 ? 0 : seconds_held();
  account_.trouble = link_ == nullptr ? "" : link_->trouble();
  account_.waits_for = wait_text(status_of(board()).arming_news);
  if (!guardian_.stop() && account_.exit_code == kExitDone) {
    account_.exit_code = kExitCheckFailed;
    account_.why += "; a servo process had to be killed";
  }
  ServoBoard& last = board();
  if (at_work_) {
    const ServoStatus last_word = status_of(last);
    add(last_word.counts, account_.counts);
    add(last_word.verdict, account_.verdict);
    account_.processes += 1;
  }
  account_.times = last.times;
  if (last.close.told.load(std::memory_order_acquire)) {
    account_.page_faults = last.close.faults;
    account_.heap_grown_bytes = last.close.heap_grown_bytes;
  }
  if (link_ != nullptr) account_.link = link_->counters();
  if (peer_ != nullptr) account_.peer = peer_->counters();
  account_.link_times = bus_.times();
  account_.ending = bus_.ending();
  account_.failed_by_verdict = account_.exit_code == kExitDone && account_.verdict.failed();
  if (account_.failed_by_verdict) account_.exit_code = kExitCheckFailed;
}

RunAccount Run::go() {
  account_.driver = config_.driver_name;
  account_.scene = config_.scene.string();
  give_up_rights();
  fork_servo();
  (void)hal::refuse_attachment();
  note_refusals("device process",
                start_process(process_, {.lock_memory = config_.loop.lock_memory}),
                account_.refusals);
  if (wait_for_servo()) {
    judge_machine();
    account_.refused = account_.refused || (config_.loop.strict && !account_.refusals.empty());
    if (!account_.refused) hold();
    account_.refused = account_.refused || (config_.loop.strict && !account_.refusals.empty());
    if (!account_.refusals.empty()) watch_.refusals(account_.refusals);
    if (account_.refused) {
      account_.exit_code = kExitDeviceOrOs;
      account_.why =
          account_.refusals.empty()
              ? "strict, and the machine wakes the loop too late; --allow-degraded runs it with "
                "less force"
              : "strict, and the machine does not grant what the loop asks for; --allow-degraded "
                "runs it with less force";
    } else {
      watch_until_end();
    }
  }
  finish();
  return account_;
}

}  // namespace

RunAccount run_device_of(const DeviceConfig& config, const SceneBytes& scene,
                         const RunLength& length, const RunWatch& watch) {
  return std::make_unique<Run>(config, scene, length, watch)->go();
}

}  // namespace haptic::tools
