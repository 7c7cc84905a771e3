// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/device_run.hpp"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <memory>
#include <new>
#include <string>
#include <system_error>
#include <vector>

#include "hal/clock/linux_process.hpp"
#include "hal/clock/servo_clock.hpp"
#include "hal/realtime/process_hardening.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/formatted.hpp"
#include "tools/run_device/arming_words.hpp"
#include "tools/run_device/device_fit.hpp"
#include "tools/run_device/press_strokes.hpp"
#include "tools/run_device/run_line.hpp"
#include "tools/run_device/stop_key.hpp"

namespace haptic::tools {
namespace {

constexpr unsigned kSpares = 1;
constexpr int kLook_ms = 20;
constexpr std::int64_t kLongestSetUp_ns = 10'000'000'000;

hal::GuardianSettings guardian_settings(const DeviceConfig& config, const RunLength& length,
                                        const RunWatch& watch) {
  hal::GuardianSettings settings;
  settings.spares = kSpares;
  settings.recorded_ticks = flight_records(config);
  settings.report_bytes = sizeof(ServoBoard);
  settings.devices = config.devices.size();
  settings.order = length.ticks;
  settings.watcher = watch.watcher;
  settings.has_reader = watch.session != nullptr;
  settings.thread.period_ns = config.loop.period_ns;
  settings.thread.priority = config.loop.usb_priority;
  settings.thread.cpu = config.loop.usb_cpu;
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

/// All that a run consists of, made in the order in which it must be.
class Run {
 public:
  Run(const DeviceConfig& config, const SceneBytes& scene, const RunLength& length,
      const RunWatch& watch)
      : config_(config),
        scene_(scene),
        length_(length),
        watch_(watch),
        events_(watch.event, 0),
        guardian_(guardian_settings(config, length, watch)) {
    std::vector<std::array<double, 3>> strokes_m(config.devices.size());
    if (std::ranges::any_of(config.devices, &HandDevice::simulated))
      strokes_m = press_strokes_m(config, scene);
    for (std::size_t k = 0; k < config.devices.size(); ++k)
      lines_.push_back(std::make_unique<RunLine>(config, k, strokes_m[k], watch));
  }

  ~Run() {
    if (watch_.session != nullptr) watch_.session->end_listening();
  }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  RunAccount go();

 private:
  void give_up_rights();
  void fork_servo();
  void judge_machine();
  [[nodiscard]] bool wait_for_servo();
  void hold();
  void watch_until_end();
  [[nodiscard]] bool is_long_enough();
  void tell_status();
  [[nodiscard]] bool is_refused();
  void begin_session();
  [[nodiscard]] bool goes_on_after_call();
  void tell_session(const std::vector<RunStatus>& now);
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
  RunEvents events_;  ///< of all devices
  StopKey stop_key_;
  std::vector<std::unique_ptr<RunLine>> lines_;  ///< by device
  hal::DeviceGuardian guardian_;                 ///< goes first: its threads work with the lines
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
  hal::block_stop_signals();  // for good: a second one does not cost the report
  const int error = guardian_.start([this](const hal::ServoSeat& seat) {
    if (watch_.session != nullptr) watch_.session->leave();
    return serve(config_, scene_, seat);
  });
  if (error != 0)
    throw OsError("the servo process cannot be started: " + std::generic_category().message(error));
  if (watch_.forked) watch_.forked();
  if (watch_.session != nullptr) begin_session();
}

void Run::begin_session() {
  RunSession& session = *watch_.session;
  session.begin(guardian_, config_, scene_);
  guardian_.listen(session.descriptor());
  // The links that there are then: called on a thread that hears of the program's end first.
  const auto stop = [this] {
    for (const auto& line : lines_) line->stop_if_held();
  };
  session.listen(stop, std::max(0, config_.loop.usb_priority - 1));
}

// Heeds the program with a session. @return whether the run goes on.
bool Run::goes_on_after_call() {
  const RunSession::Call call = watch_.session->take();
  if (call == RunSession::Call::kNone) return true;
  for (const auto& line : lines_) line->stop_if_held();
  if (call == RunSession::Call::kStop) return true;
  account_.why = call == RunSession::Call::kClose  ? "the session was closed"
                 : call == RunSession::Call::kGone ? "the program with the session has ended"
                                                   : "the session says what none says";
  if (call == RunSession::Call::kWrong) account_.exit_code = kExitBadInput;
  tell("stopping", account_.why, LineLevel::kNotice);
  return false;
}

void Run::tell_session(const std::vector<RunStatus>& now) {
  SessionStatus& status = watch_.session->status();
  status.phase = SessionPhase::kRunning;
  status.process = guardian_.number();
  status.is_silent = now.front().is_silent() ? 1 : 0;
  for (std::size_t k = 0; k < now.size(); ++k) {
    const RunStatus& from = now[k];
    SessionDeviceStatus& to = status.devices[k];
    to.link = static_cast<std::uint32_t>(from.link);
    to.link_faults = from.link_faults;
    to.connects = from.counters.connects;
    to.reports = from.counters.reports;
    to.force_n = from.force_n;
    to.torque_nm = from.torque_nm;
    put_text(wait_text(from.servo.arming_news), to.waits_for);
    put_text(from.trouble, to.trouble);
  }
  watch_.session->publish();
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
    if (news == hal::GuardianNews::kCalled && !goes_on_after_call()) return false;
    if (news == hal::GuardianNews::kKeeperEnded) {
      account_.exit_code = kExitDeviceOrOs;
      account_.why = "the process that keeps the device at zero ended before the loop began";
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
  for (std::size_t k = 0; k < lines_.size(); ++k) {
    RunLine& line = *lines_[k];
    line.make_link(guardian_.mailbox(k), guardian_.keeper(k), scene_);
    line.follow(board());
  }
  for (std::size_t k = 0; k < lines_.size(); ++k) {
    const std::string thread = lines_[k]->words() + "USB thread: ";
    const hal::UsbThreadGrant grant = guardian_.hold(lines_[k]->link(), k);
    if (grant.create_error != 0)
      throw OsError("no thread for the link: " +
                    std::generic_category().message(grant.create_error));
    if (grant.affinity_error != 0)
      account_.refusals.push_back({thread + "core affinity", grant.affinity_error});
    if (grant.priority_error != 0)
      account_.refusals.push_back({thread + "SCHED_FIFO priority", grant.priority_error});
  }
  held_ns_ = hal::monotonic_ns();
}

// How late the servo thread was woken before anything arms; what it may exert for that.
void Run::judge_machine() {
  if (!config_.has_motors()) return;
  const bool granted = account_.refusals.empty() && grants_link_thread(config_.loop);
  const MachineFit machine = machine_fit(board().wakeups, config_.loop.period_ns, granted);
  std::vector<std::string> notes = {machine.found};
  if (!machine.fit && config_.loop.strict) {
    account_.refused = true;
  } else if (!machine.fit) {
    account_.share = machine.share;
    for (const auto& line : lines_) line->lower(machine.share);
    notes.push_back("degraded: force and torque are lowered to " + short_number(machine.share, 3) +
                    (lines_.size() > 1 ? " of the devices'" : " of the device's"));
  }
  watch_.notes(notes);
}

void Run::tell_status() {
  const auto every_ns = static_cast<std::int64_t>(1e9 * watch_.status_every_s);
  std::vector<RunStatus> now;
  for (const auto& line : lines_) {
    now.push_back(line->status(seconds_held(), guardian_.silence_ns(), board()));
    line->look(now.back());
  }
  if (watch_.session != nullptr) tell_session(now);
  if (watch_.status_every_s <= 0 || hal::monotonic_ns() < next_status_ns_) return;
  next_status_ns_ = std::max(next_status_ns_ + every_ns, hal::monotonic_ns());
  for (const RunStatus& status : now) watch_.status(status);
}

// Reports a servo process that nobody asked to end. @return whether a spare goes on.
bool Run::take_end() {
  const hal::ServoEnd& end = guardian_.servo_end();
  tell("servo ended",
       "servo process " + std::to_string(end.number) + " (pid " + std::to_string(end.pid) +
           "): " + hal::to_text(end),
       LineLevel::kError);
  watch_.crash({end.number, end.pid, hal::to_text(end), end.records});
  for (const auto& line : lines_) line->add(board(end.number));
  account_.processes += 1;
  if (end.end.signal != 0) {
    account_.exit_code = kExitCheckFailed;
    if (length_.ticks > 0) {
      const std::uint64_t done = lines_.front()->account().counts.ticks;
      const std::uint64_t left = length_.ticks - std::min(done, length_.ticks);
      for (unsigned k = 0; k <= kSpares; ++k)
        guardian_.order(k, std::max<std::uint64_t>(left, 1));  // 0 asks for all
    }
    if (guardian_.take_over()) {
      for (const auto& line : lines_) line->follow(board());
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
  bool was_there = true;
  for (const auto& line : lines_) {
    if (line->was_there()) continue;
    was_there = false;
    account_.why += "; " + line->words() + "the device was never there";
  }
  if (!was_there) {
    account_.exit_code = kExitDeviceOrOs;
  } else if (length_.ticks > 0) {
    account_.why += "; the ticks asked for are not done";
    account_.exit_code = kExitCheckFailed;
  }
  return true;
}

// @return whether the run goes on: not where nothing else would take the force away.
bool Run::take_keeper_end() {
  const RunLine& line = *lines_[guardian_.ended_keeper()];
  const std::string text =
      line.words() + "the zero-keeper: " + hal::to_text(guardian_.keeper_end());
  tell("keeper ended", text, LineLevel::kError);
  if (!line.needs_keeper()) return true;
  account_.exit_code = kExitCheckFailed;
  account_.why = text + "; the device has no watchdog of its own";
  return false;
}

// A device that was found and does not fit.
bool Run::is_refused() {
  for (const auto& line : lines_) {
    const std::string refusal = line->refusal();
    if (refusal.empty()) continue;
    account_.why = line->words() + "the device is refused: " + refusal;
    account_.exit_code = kExitDeviceOrOs;
    return true;
  }
  return false;
}

void Run::watch_until_end() {
  if (watch_.session != nullptr) watch_.session->tell_begun();
  next_status_ns_ = held_ns_ + static_cast<std::int64_t>(1e9 * watch_.status_every_s);
  for (;;) {
    const hal::GuardianNews news = guardian_.wait(kLook_ms);
    if (news == hal::GuardianNews::kServoEnded && !take_end()) return;
    if (news == hal::GuardianNews::kKeeperEnded && !take_keeper_end()) return;
    if (news == hal::GuardianNews::kCalled && !goes_on_after_call()) return;
    if (news == hal::GuardianNews::kStopAsked) {
      account_.why = "stopped by " + hal::signal_text(guardian_.stop_signal());
      tell("stopping", account_.why, LineLevel::kNotice);
      return;
    }
    for (const auto& line : lines_) {
      line->tell_notes();
      line->look_at_bridge(seconds_held());
    }
    if (is_refused()) return;
    if (stop_key_.pressed()) {
      for (const auto& line : lines_) line->stop();
    }
    if (is_long_enough()) return;
    tell_status();
  }
}

void Run::finish() {
  for (const auto& line : lines_) line->begin_ending();
  account_.seconds = held_ns_ == 0 ? 0 : seconds_held();
  for (const auto& line : lines_) line->note_last(board());
  if (!guardian_.stop() && account_.exit_code == kExitDone) {
    account_.exit_code = kExitCheckFailed;
    account_.why += "; a servo process had to be killed";
  }
  ServoBoard& last = board();
  if (at_work_) {
    for (const auto& line : lines_) line->add(last);
    account_.processes += 1;
  }
  account_.times = last.times;
  if (last.close.told.load(std::memory_order_acquire)) {
    account_.page_faults = last.close.faults;
    account_.heap_grown_bytes = last.close.heap_grown_bytes;
  }
  bool failed = false;
  for (const auto& line : lines_) {
    line->finish();
    account_.devices.push_back(line->account());
    failed = failed || line->account().verdict.failed();
  }
  account_.failed_by_verdict = account_.exit_code == kExitDone && failed;
  if (account_.failed_by_verdict) account_.exit_code = kExitCheckFailed;
}

RunAccount Run::go() {
  account_.scene = config_.scene.string();
  give_up_rights();
  for (const auto& line : lines_) line->start_bridge();
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
  if (watch_.session != nullptr) {
    SessionStatus& status = watch_.session->status();
    status.phase = SessionPhase::kEnded;
    status.exit_code = account_.exit_code;
    for (SessionDeviceStatus& device : status.devices) {
      SessionDeviceStatus last;  // its counts go on being true
      last.connects = device.connects;
      last.reports = device.reports;
      device = last;
    }
    put_text(account_.why, status.why);
    watch_.session->publish();
  }
  return account_;
}

}  // namespace

RunAccount run_device_of(const DeviceConfig& config, const SceneBytes& scene,
                         const RunLength& length, const RunWatch& watch) {
  return std::make_unique<Run>(config, scene, length, watch)->go();
}

}  // namespace haptic::tools
