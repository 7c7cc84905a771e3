// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/servo_program.hpp"

#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/clock/servo_clock.hpp"
#include "hal/realtime/process_hardening.hpp"
#include "rt_core/haptic_core.hpp"
#include "rt_core/scene/part_scenes.hpp"
#include "tools/common/changed_scene.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/simplified_bodies.hpp"
#include "tools/graph_compiler/coupling/served_size.hpp"
#include "tools/graph_compiler/coupling/simulated_gains.hpp"
#include "tools/graph_compiler/graph/part_tables.hpp"
#include "tools/run_device/core_in_memory.hpp"
#include "tools/run_device/run_session.hpp"
#include "tools/run_device/simulated_peer.hpp"

namespace haptic::tools {
namespace {

// More than thread stacks and libusb ask for later.
constexpr std::size_t kRoomToAllocate = std::size_t{16} << 20;
constexpr std::size_t kServoStackBytes = 256 * 1024;

bool may_allocate_locked() noexcept {
  void* const room =
      mmap(nullptr, kRoomToAllocate, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (room == MAP_FAILED) return false;
  munmap(room, kRoomToAllocate);
  return true;
}

/// On the servo thread, after each tick: what it was for one device. That of the first device goes
/// first, and counts what is of the loop.
class TickWatcher {
 public:
  TickWatcher(const hal::ServoLoop& loop, ServoBoard& board, std::uint64_t wanted,
              const DeviceConfig& config, std::size_t device, const ServoParameters& parameters,
              const SceneView& scene)
      : loop_(loop),
        board_(board),
        device_(device),
        devices_(config.devices.size()),
        said_(board.status[device]),
        wanted_(wanted),
        quarter_ns_(config.loop.period_ns / 4),
        lost_periods_(parameters.limits.lost_periods),
        late_judge_(config.loop.period_ns, config.loop.report_clocked),
        arming_(parameters, devices_ > 1 ? static_cast<std::uint32_t>(device) + 1 : 0),
        judge_(scene),
        law_(scene.parameters().law) {
    if (!config.in_session) return;
    session_.emplace(parameters);
    session_writer_.emplace(board.session[device]);
  }

  static void watch(void* self, const ServoInput& input, const ServoResult& result) {
    static_cast<TickWatcher*>(self)->take(input, result);
  }
  /// After the loop: the length of a tick is known once it is over.
  void finish() noexcept {
    close();
    said_.publish(status_);
  }

 private:
  void close() noexcept {
    if (!begun_) return;
    begun_ = false;
    const std::int64_t tick_ns = loop_.counters().last_tick_ns;
    const hal::LateCause cause = late_judge_.end(tick_ns);
    if (!counted_) return;
    if (device_ == 0) board_.times.ticks.add(tick_ns);
    status_.counts.causes[static_cast<std::size_t>(cause)] += 1;
    counted_ = false;
  }

  [[nodiscard]] LateDegree degree_of(std::uint32_t missed, std::int64_t late_ns) const noexcept {
    if (missed > lost_periods_) return LateDegree::kBeyond;
    if (missed > 0) return LateDegree::kHeld;
    return late_ns < quarter_ns_ ? LateDegree::kInTime : LateDegree::kWithinPeriod;
  }

  [[nodiscard]] bool any_armed() const noexcept {
    for (std::size_t k = 0; k < devices_; ++k)
      if (loop_.result(k).arming == ArmingState::kArmed) return true;
    return false;
  }

  void open_or_shut() noexcept {
    CountWindow window = board_.window.load(std::memory_order_relaxed);
    if (device_ == 0) {
      if (window == CountWindow::kNotYet && (wanted_ == 0 || any_armed()))
        window = CountWindow::kOpen;
      if (wanted_ != 0 && status_.counts.ticks == wanted_) window = CountWindow::kOver;
      board_.window.store(window, std::memory_order_release);
    }
    counted_ = window == CountWindow::kOpen;
  }

  void count(const ServoInput& input, const ServoResult& result, bool armed) noexcept {
    const std::int64_t late_ns = loop_.counters().last_lateness_ns;
    if (device_ == 0) board_.times.wakeups.add(late_ns);
    TickCounts& c = status_.counts;
    c.ticks += 1;
    c.armed_ticks += armed ? 1u : 0u;
    c.contact_ticks += armed && felt_part_touches(result.rendered, law_) ? 1u : 0u;
    c.late[static_cast<std::size_t>(degree_of(input.late_periods, late_ns))] += 1;
    c.safety_faults |= result.faults;
    c.device_faults |= input.state.faults;
    c.largest_force_n = std::max(c.largest_force_n, status_.force_n);
    c.largest_torque_nm = std::max(c.largest_torque_nm, status_.torque_nm);
  }

  void note_speed(const DeviceState& state, const ServoResult& result, bool armed) noexcept {
    const bool none = status_.force_n == 0 && status_.torque_nm == 0;
    if (!armed || !none || (result.limiter_flags & kLimiterSpeed) == 0) {
      status_.too_fast_ticks = 0;
      status_.stated_m_per_s = 0;
      return;
    }
    status_.too_fast_ticks += 1;
    if (!state.twist_valid) return;
    const auto stated = static_cast<double>(vec3_of(state.twist_d.linear_m_per_s).norm());
    status_.stated_m_per_s = std::max(status_.stated_m_per_s, stated);
  }

  void take(const ServoInput& input, const ServoResult& result) noexcept {
    const bool armed = result.arming == ArmingState::kArmed;
    close();  // the tick before
    open_or_shut();
    status_.counts.armings = result.command.arming;
    status_.force_n = static_cast<double>(vec3_of(result.command.wrench_d.force_n).norm());
    status_.torque_nm = static_cast<double>(vec3_of(result.command.wrench_d.torque_nm).norm());
    status_.arming = result.arming;
    status_.safety_faults = result.faults;
    status_.device_faults = input.state.faults;
    status_.d_near_m = static_cast<double>(result.rendered.d_near_m);
    note_speed(input.state, result, armed);
    arming_.take(input, result);
    status_.arming_news = arming_.news();
    if (counted_) count(input, result, armed);
    if (result.rendered_new) {
      judge_.take(result.rendered);
      status_.verdict = judge_.verdict();
    }
    late_judge_.begin(input, loop_.counters().last_lateness_ns);
    begun_ = true;
    said_.publish(status_);
    if (session_) tell_session(input, result);
  }

  void tell_session(const ServoInput& input, const ServoResult& result) noexcept {
    session_->take(input, result, status_.verdict);
    const hal::ServoLoopCounters& counters = loop_.counters();
    SessionTick& tick = session_->tick();
    tick.late_ticks = counters.late;
    tick.missed_periods = counters.missed_periods;
    tick.longest_tick_ns = counters.largest_tick_ns;
    session_writer_->publish(tick);
  }

  const hal::ServoLoop& loop_;
  ServoBoard& board_;
  std::size_t device_, devices_;
  NewestWriter<ServoStatus> said_;
  std::uint64_t wanted_;
  std::int64_t quarter_ns_;
  std::uint32_t lost_periods_;
  ServoStatus status_;
  hal::LateJudge late_judge_;
  ArmingNewsTaker arming_;
  SessionJudge judge_;
  LawId law_;
  bool begun_ = false, counted_ = false;  ///< the newest tick
  std::optional<SessionTaker> session_;
  std::optional<NewestWriter<SessionTick>> session_writer_;
};

/// Clocked by reports, a tick waits for one no longer.
std::int64_t report_wait_ns(const LoopConfig& loop) { return loop.period_ns + loop.period_ns / 2; }

hal::ServoLoopSettings loop_settings(const DeviceConfig& config) {
  const LoopConfig& loop = config.loop;
  hal::ServoLoopSettings settings;
  settings.frames = config.frames;
  settings.period_ns = loop.period_ns;
  settings.report_clocked = loop.report_clocked;
  settings.report_wait_ns = report_wait_ns(loop);
  return settings;
}

/// The tick of one device or of two, and the loop over it.
class ServoOfHands {
 public:
  ServoOfHands(const DeviceConfig& config, CoreInMemory& own, const hal::ServoSeat& seat) {
    for (std::size_t k = 0; k < config.devices.size(); ++k) {
      parameters_[k] = with_scene(config.devices[k].servo, own.view_of(k));
      recorders_[k].emplace(seat.flights[k]);
    }
    const hal::ServoLoopSettings settings = loop_settings(config);
    if (own.parts == nullptr) {
      one_.emplace(*own.core, parameters_[0], own.view.header().capacity, &*recorders_[0]);
      loop_.emplace(*one_, seat.mailboxes[0], settings);
    } else {
      two_.emplace(own.parts->hands, parameters_,
                   std::array<FlightRecorder*, kMostHands>{&*recorders_[0], &*recorders_[1]});
      loop_.emplace(*two_, std::array{&seat.mailboxes[0], &seat.mailboxes[1]}, settings);
    }
  }
  ServoOfHands(const ServoOfHands&) = delete;
  ServoOfHands& operator=(const ServoOfHands&) = delete;

  [[nodiscard]] hal::ServoLoop& loop() { return *loop_; }
  [[nodiscard]] const ServoParameters& parameters(std::size_t device) const {
    return parameters_[device];
  }

 private:
  std::array<ServoParameters, kMostHands> parameters_;
  std::array<std::optional<FlightRecorder>, kMostHands> recorders_;
  std::optional<ServoTick> one_;
  std::optional<TwoHandTick> two_;  ///< one of the two
  std::optional<hal::ServoLoop> loop_;
};

/// @throws InputError where the scene has another number of hands than there are devices.
void check_hands(const DeviceConfig& config, std::size_t hands) {
  if (hands == config.devices.size()) return;
  const std::string scene = config.scene.string();
  throw InputError(
      config.file.string() + ": " +
      (hands > 1
           ? scene + " has two hands, and there is one device; add the table [device2] with "
                     "driver, or give --device2 sim; for a second part that stands give it role = "
                     "\"fixed\" in the scene and compile that again"
           : "[device2] is of a second hand, and " + scene +
                 " has one; remove it, or give a part role = \"hand2\" in the scene and compile "
                 "that again"));
}

/// Says which part a hand holds, where it may hold several.
void tell_parts(const DeviceConfig& config, const SceneView& view) {
  PartScenes parts;
  if (PartScenes::open(view, parts) != RtStatus::kOk || parts.count() == 0) return;
  const std::string held(parts.name(0));
  if (parts.hands() > 1) {
    std::fprintf(stderr, "run_device: %s: device 1 holds '%s' and device 2 '%s'%s\n",
                 config.scene.c_str(), held.c_str(), std::string(parts.name(1)).c_str(),
                 parts.driven().empty() ? ""
                                        : "; driven parts stand where they start; to drive parts "
                                          "take host_sim run, C or Python");
    return;
  }
  const char* const others =
      parts.holds_throughout() ? "the other parts stand where they start; for loose parts take "
                                 "host_sim run, the page, C or Python"
      : parts.driven().empty()
          ? "the other parts stand; to hold one after another take host_sim run, the page, C or "
            "Python"
          : "the other parts stand, driven ones where they start; to hold one after another and "
            "to drive parts take host_sim run, C or Python";
  std::fprintf(stderr, "run_device: %s: the hand holds '%s' all through, and %s\n",
               config.scene.c_str(), held.c_str(), others);
}

/// With gains that a simulated handle and the hand on it hold.
SceneBytes held_scene(const DeviceConfig& config, const CoreInMemory& tried, std::size_t device) {
  const double period_s = 1e-9 * static_cast<double>(config.loop.period_ns);
  const auto scale = static_cast<double>(config.devices[device].servo.map.scale);
  SimulatedLoop loop{held_peer((clocks_loop(config, device) ? 1 : kPeerLatePeriods) * period_s),
                     1 / period_s, false};
  loop.device.mass_kg /= scale * scale;  // x_w = s x_d, F_w = F_d / s
  loop.device.damping_ns_per_m /= scale * scale;
  std::string lowered;
  const auto held = [&](const SceneView& of) {
    const auto gains = simulated_gains(of.parameters(), served_size(of).radius_m, loop);
    if (!gains) return SceneBytes(of.blob());
    if (lowered.empty()) lowered = gains->text;
    return changed_scene(of, [&](SceneParameters& changed) { gains->put(changed); });
  };
  SceneBytes bytes = tried.parts != nullptr ? with_changed(tried.view, held) : held(tried.view);
  if (!lowered.empty())
    std::fprintf(stderr, "run_device: %s%s\n", device_words(config, device).c_str(),
                 lowered.c_str());
  return bytes;
}

}  // namespace

ServoStatus status_of(const ServoBoard& board, std::size_t device) noexcept {
  return NewestReader<ServoStatus>(board.status[device]).newest();
}

bool clocks_loop(const DeviceConfig& config, std::size_t device) {
  return config.loop.report_clocked && device == 0;
}

std::array<hal::StepGrant, 3> start_process(hal::RealtimeProcess& process,
                                            const hal::ProcessSettings& settings) {
  std::array<hal::StepGrant, 3> grants = process.start(settings);
  for (hal::StepGrant& grant : grants) {
    if (grant.step != hal::StartStep::kMemoryLock || !grant.granted()) continue;
    if (may_allocate_locked()) continue;
    hal::unlock_all_memory();
    grant.error = ENOMEM;
  }
  return grants;
}

std::size_t flight_records(const DeviceConfig& config) {
  const double rate_hz = 1e9 / static_cast<double>(config.loop.period_ns);
  return static_cast<std::size_t>(std::ceil(config.flight_seconds * rate_hz));
}

FitQuestion fit_question(const DeviceConfig& config, const SceneBytes& scene, std::size_t device) {
  CoreInMemory own;
  // It was opened before: read_usable_scene.
  if (own.open(scene.span()) != RtStatus::kOk) return {};
  FitQuestion question =
      fit_question(own.view_of(device), static_cast<double>(config.devices[device].servo.map.scale),
                   config.loop.period_ns, clocks_loop(config, device), config.accept_unbudgeted);
  if (config.loop.report_clocked && !clocks_loop(config, device))
    question.longest_tick = static_cast<double>(report_wait_ns(config.loop)) /
                            static_cast<double>(config.loop.period_ns);
  return question;
}

SceneBytes read_usable_scene(const DeviceConfig& config) {
  SceneBytes bytes = read_scene_bytes(config.scene);
  CoreInMemory tried;
  const RtStatus status = tried.open(bytes.span());
  if (status != RtStatus::kOk)
    throw InputError(config.scene.string() + ": not a usable scene: " + to_text(status) +
                     "; compile it again");
  check_hands(config, tried.parts != nullptr ? tried.parts->hands.count() : 1);
  tell_simplification("run_device", config.scene.string(), tried.view);
  tell_parts(config, tried.view);
  for (std::size_t k = 0; k < config.devices.size(); ++k) {
    if (!config.devices[k].simulated) continue;
    bytes = held_scene(config, tried, k);
    // The second one may hold less than the first.
    if (tried.open(bytes.span()) != RtStatus::kOk)
      throw InputError(config.scene.string() + ": is refused with the gains that '" +
                       config.devices[k].driver_name + "' holds; report it");
  }
  return bytes;
}

int serve(const DeviceConfig& config, const SceneBytes& scene, const hal::ServoSeat& seat) {
  static constexpr int kKept[] = {STDERR_FILENO};  // for a failed assertion's last words
  (void)hal::close_inherited_descriptors(kKept);
  ServoBoard& board = *new (seat.report.data()) ServoBoard;  // placement, no heap
  CoreInMemory own;
  if (own.open(scene.span()) != RtStatus::kOk) return kExitBadInput;
  ServoOfHands servo(config, own, seat);
  hal::ServoLoop& loop = servo.loop();
  std::vector<TickWatcher> watchers;
  watchers.reserve(config.devices.size());  // the loop is given their addresses
  for (std::size_t k = 0; k < config.devices.size(); ++k) {
    watchers.emplace_back(loop, board, seat.order.load(std::memory_order_acquire), config, k,
                          servo.parameters(k), own.view_of(k));
    loop.watch(&TickWatcher::watch, &watchers[k], k);
  }

  hal::RealtimeProcess process;
  board.grants.process =
      start_process(process, {.lock_memory = config.loop.lock_memory, .hold_idle_states = false});
  hal::ThreadSettings thread;
  thread.priority = config.loop.servo_priority;
  thread.cpu = config.loop.servo_cpu;
  thread.prefault_bytes = kServoStackBytes;
  const std::size_t heap_before = mallinfo2().uordblks;
  board.grants.thread = hal::start_realtime_thread(thread);
  (void)hal::monotonic_ns();  // the first look at the clock maps its page
  // The first process speaks for its spare, whose loop is the same on the same core.
  if (config.has_motors() && seat.number == 0) {
    hal::WakeupQuestion question;
    question.period_ns = config.loop.period_ns;
    hal::count_wakeups(question, seat.stop, board.wakeups);
  }
  const hal::PageFaults before = hal::page_faults_of_thread();
  board.grants.filter = hal::confine_servo();
  board.ready.store(true, std::memory_order_release);

  const int error = loop.run(seat.stop);

  for (TickWatcher& watcher : watchers) watcher.finish();
  const hal::PageFaults after = hal::page_faults_of_thread();
  ServoClose& close = board.close;
  close.faults = {after.minor - before.minor, after.major - before.major};
  close.heap_grown_bytes =
      static_cast<std::int64_t>(mallinfo2().uordblks) - static_cast<std::int64_t>(heap_before);
  close.loop_error = error;
  close.told.store(true, std::memory_order_release);
  // Nothing is put away: that takes system calls.
  std::_Exit(error == 0 ? kExitDone : kExitDeviceOrOs);
}

}  // namespace haptic::tools
