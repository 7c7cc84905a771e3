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
#include <utility>

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
#include "tools/run_device/core_in_memory.hpp"
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

/// On the servo thread, after each tick.
class TickWatcher {
 public:
  TickWatcher(const hal::ServoLoop& loop, ServoBoard& board, std::uint64_t wanted,
              const DeviceConfig& config, const ServoParameters& parameters, const SceneView& scene)
      : loop_(loop),
        board_(board),
        said_(board.status),
        wanted_(wanted),
        quarter_ns_(config.loop.period_ns / 4),
        lost_periods_(config.servo.limits.lost_periods),
        late_judge_(config.loop.period_ns, config.loop.report_clocked),
        arming_(parameters),
        judge_(scene),
        law_(scene.parameters().law) {}

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
    board_.times.ticks.add(tick_ns);
    status_.counts.causes[static_cast<std::size_t>(cause)] += 1;
    counted_ = false;
  }

  [[nodiscard]] LateDegree degree_of(std::uint32_t missed, std::int64_t late_ns) const noexcept {
    if (missed > lost_periods_) return LateDegree::kBeyond;
    if (missed > 0) return LateDegree::kHeld;
    return late_ns < quarter_ns_ ? LateDegree::kInTime : LateDegree::kWithinPeriod;
  }

  void open_or_shut(bool armed) noexcept {
    CountWindow window = board_.window.load(std::memory_order_relaxed);
    if (window == CountWindow::kNotYet && (armed || wanted_ == 0)) window = CountWindow::kOpen;
    if (wanted_ != 0 && status_.counts.ticks == wanted_) window = CountWindow::kOver;
    counted_ = window == CountWindow::kOpen;
    board_.window.store(window, std::memory_order_release);
  }

  void count(const ServoInput& input, const ServoResult& result, bool armed) noexcept {
    const std::int64_t late_ns = loop_.counters().last_lateness_ns;
    board_.times.wakeups.add(late_ns);
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

  void take(const ServoInput& input, const ServoResult& result) noexcept {
    const bool armed = result.arming == ArmingState::kArmed;
    close();  // the tick before
    open_or_shut(armed);
    status_.counts.armings = result.command.arming;
    status_.force_n = static_cast<double>(vec3_of(result.command.wrench_d.force_n).norm());
    status_.torque_nm = static_cast<double>(vec3_of(result.command.wrench_d.torque_nm).norm());
    status_.arming = result.arming;
    status_.safety_faults = result.faults;
    status_.device_faults = input.state.faults;
    status_.d_near_m = static_cast<double>(result.rendered.d_near_m);
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
  }

  const hal::ServoLoop& loop_;
  ServoBoard& board_;
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
};

hal::ServoLoopSettings loop_settings(const LoopConfig& loop) {
  hal::ServoLoopSettings settings;
  settings.period_ns = loop.period_ns;
  settings.report_clocked = loop.report_clocked;
  settings.report_wait_ns = loop.period_ns + loop.period_ns / 2;
  return settings;
}

/// Says which part the hand holds, where it may hold several.
void tell_parts(const DeviceConfig& config, const SceneView& view) {
  PartScenes parts;
  if (PartScenes::open(view, parts) != RtStatus::kOk || parts.count() == 0) return;
  const std::string held(parts.name(0));
  const char* const others =
      parts.holds_throughout() ? "the other parts stand where they start; for two hands and loose "
                                 "parts take host_sim run, "
                                 "the page, C or Python"
      : parts.driven().empty()
          ? "the other parts stand; to hold one after another take host_sim run, the page, C or "
            "Python"
          : "the other parts stand, driven ones where they start; to hold one after another and "
            "to drive parts take host_sim run, C or Python";
  std::fprintf(stderr, "run_device: %s: the hand holds '%s' all through, and %s\n",
               config.scene.c_str(), held.c_str(), others);
}

/// With gains that the simulated handle and the hand on it hold.
SceneBytes held_scene(const DeviceConfig& config, const SceneView& view, SceneBytes bytes) {
  const double period_s = 1e-9 * static_cast<double>(config.loop.period_ns);
  const auto scale = static_cast<double>(config.servo.map.scale);
  SimulatedLoop loop{held_peer((config.loop.report_clocked ? 1 : kPeerLatePeriods) * period_s),
                     1 / period_s, false};
  loop.device.mass_kg /= scale * scale;  // x_w = s x_d, F_w = F_d / s
  loop.device.damping_ns_per_m /= scale * scale;
  const auto gains = simulated_gains(view.parameters(), served_size(view).radius_m, loop);
  if (!gains) return bytes;
  std::fprintf(stderr, "run_device: %s\n", gains->text.c_str());
  return changed_scene(view, [&](SceneParameters& changed) { gains->put(changed); });
}

}  // namespace

ServoStatus status_of(const ServoBoard& board) noexcept {
  return NewestReader<ServoStatus>(board.status).newest();
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

FitQuestion fit_question(const DeviceConfig& config, const SceneBytes& scene) {
  SceneView view;
  // It was opened before: read_usable_scene.
  if (SceneView::open(scene.span(), view) != RtStatus::kOk) return {};
  return fit_question(view, static_cast<double>(config.servo.map.scale), config.loop.period_ns,
                      config.loop.report_clocked, config.accept_unbudgeted);
}

SceneBytes read_usable_scene(const DeviceConfig& config) {
  SceneBytes bytes = read_scene_bytes(config.scene);
  CoreInMemory tried;
  const RtStatus status = tried.open(bytes.span());
  if (status != RtStatus::kOk)
    throw InputError(config.scene.string() + ": not a usable scene: " + to_text(status) +
                     "; compile it again");
  tell_simplification("run_device", config.scene.string(), tried.view);
  tell_parts(config, tried.view);
  return config.simulated ? held_scene(config, tried.view, std::move(bytes)) : std::move(bytes);
}

int serve(const DeviceConfig& config, const SceneBytes& scene, const hal::ServoSeat& seat) {
  static constexpr int kKept[] = {STDERR_FILENO};  // for a failed assertion's last words
  (void)hal::close_inherited_descriptors(kKept);
  ServoBoard& board = *new (seat.report.data()) ServoBoard;  // placement, no heap
  CoreInMemory own;
  if (own.open(scene.span()) != RtStatus::kOk) return kExitBadInput;
  FlightRecorder recorder(seat.flight);
  const ServoParameters parameters = with_scene(config.servo, own.view);
  ServoTick tick(*own.core, parameters, own.view.header().capacity, &recorder);
  hal::ServoLoop loop(tick, seat.mailbox, loop_settings(config.loop));
  TickWatcher watcher(loop, board, seat.order.load(std::memory_order_acquire), config, parameters,
                      own.view);
  loop.watch(&TickWatcher::watch, &watcher);

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
  if (config.has_motors && seat.number == 0) {
    hal::WakeupQuestion question;
    question.period_ns = config.loop.period_ns;
    hal::count_wakeups(question, seat.stop, board.wakeups);
  }
  const hal::PageFaults before = hal::page_faults_of_thread();
  board.grants.filter = hal::confine_servo();
  board.ready.store(true, std::memory_order_release);

  const int error = loop.run(seat.stop);

  watcher.finish();
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
