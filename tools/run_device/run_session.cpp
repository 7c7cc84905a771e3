// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/run_session.hpp"

#include <fcntl.h>
#include <linux/futex.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <ctime>
#include <system_error>

#include "hal/clock/linux_process.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/formatted.hpp"
#include "tools/run_device/core_in_memory.hpp"
#include "tools/run_device/servo_program.hpp"

namespace haptic::tools {
namespace {

/// Memory that the history of a run may take, all of it locked.
constexpr std::size_t kMostHistoryBytes = std::size_t{1} << 30;
constexpr std::size_t kProcesses = 2;  // the first and its spare

void put(const Pose& pose, double (&to)[7]) noexcept {
  for (int k = 0; k < 3; ++k) to[k] = static_cast<double>(pose.p_wa[k]);
  for (int k = 0; k < 4; ++k) to[3 + k] = static_cast<double>(pose.q_wa.coeffs()[k]);
}
void put(const Wrench& wrench, double (&to)[6]) noexcept {
  for (int k = 0; k < 3; ++k) {
    to[k] = static_cast<double>(wrench.force_w[k]);
    to[3 + k] = static_cast<double>(wrench.torque_w[k]);
  }
}

/// Where `part` lies in `memory`.
SessionRange range_in(std::span<const std::byte> memory, const void* part, std::size_t bytes) {
  const auto begin = static_cast<std::size_t>(static_cast<const std::byte*>(part) - memory.data());
  return {begin, bytes};
}

[[noreturn]] void fail_os(const std::string& what) {
  throw OsError(what + ": " + std::generic_category().message(errno));
}

}  // namespace

void SessionTaker::take(const ServoInput& input, const ServoResult& result,
                        const SessionVerdict& verdict) noexcept {
  const DeviceState& state = input.state;
  const Pose sensed_dh = pose_of(state.pose_dh);
  const Vec3 arm_d = handle_arm(map_, sensed_dh.q_wa);
  SessionTick& t = tick_;
  if (result.began) {
    map_ = begun_map(map_, start_, at_handle_point(sensed_dh, arm_d));
    t.began_tick = result.command.tick;
  }
  const StepResult& rendered = result.rendered;
  const Pose& frame = result.frame_wf;
  const Pose& felt = rendered.proxy_pose_wa;
  t.tick = result.command.tick;
  t.now_ns = input.now_ns;
  put(mesh_pose(map_, at_handle_point(sensed_dh, arm_d)), t.hand_pose);
  put(Pose{frame.p_wa + frame.q_wa * felt.p_wa, frame.q_wa * felt.q_wa}, t.felt_pose);
  put(Wrench{frame.q_wa * rendered.wrench_w.force_w, frame.q_wa * rendered.wrench_w.torque_w},
      t.wrench);
  put(scene_wrench(map_, about_handle_point(wrench_of(result.command.wrench_d), arm_d)),
      t.sent_wrench);
  t.gap_m = static_cast<double>(rendered.proxy_gap_m);
  t.state_hash = rendered.state_hash;
  t.link = static_cast<std::uint32_t>(state.link);
  t.situation = static_cast<std::uint32_t>(rendered.situation);
  t.flags = rendered.flags;
  t.arming = static_cast<std::uint32_t>(result.arming);
  t.safety_faults = result.faults;
  t.device_faults = state.faults;
  t.is_held = (state.switches & switches_.deadman) == switches_.deadman ? 1 : 0;
  t.armings = result.command.arming;
  t.map = record_of(map_);
  t.verdict = verdict;
}

RunSession::RunSession(int socket)
    : socket_(socket), up_(sizeof(SessionUp), hal::SharedMemory::Readers::kByDescriptor) {
  (void)fcntl(socket, F_SETFD, FD_CLOEXEC);
  if (!waits_for_message(socket, kMostRequest_ms))
    throw UsageError("--session: nothing comes from descriptor " + std::to_string(socket) +
                     "; only the library starts a run with it");
  SessionMessage message = take_message(socket, std::as_writable_bytes(std::span(&ask_, 1)));
  if (const std::string defect = defect_of(message, ask_); !defect.empty())
    throw InputError("--session: " + defect);
  program_ = std::move(message.descriptors[1]);
  if (down_.map(message.descriptors[0], sizeof(SessionDown)) != 0)
    throw InputError("--session: the memory that came with the request cannot be used");
  if (up_.bytes().empty()) throw OsError("no memory for what a session reads");
  auto* const up = new (up_.bytes().data()) SessionUp{};
  status_writer_ = std::make_unique<NewestWriter<SessionStatus>>(up->status);
  events_ = std::make_unique<EventWriter>(up->events);
  gone_ = Descriptor(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  all_ = Descriptor(epoll_create1(EPOLL_CLOEXEC));
  if (!gone_.is_open() || !all_.is_open()) fail_os("no descriptors for a session");
  for (const int watched : {socket_.get(), program_.get(), gone_.get()}) {
    epoll_event event{};
    event.events = EPOLLIN;
    if (epoll_ctl(all_.get(), EPOLL_CTL_ADD, watched, &event) != 0) fail_os("epoll of a session");
  }
}

RunSession::~RunSession() { end_listening(); }

void RunSession::end_listening() noexcept {
  done_.store(true);
  if (listener_.joinable()) listener_.join();
}

void RunSession::fit(DeviceConfig& config) const {
  const std::string file = config.file.string();
  const SceneBytes scene = read_scene_bytes(config.scene);
  if (hash_of_scene(scene.span()) != ask_.scene_sha256)
    throw InputError(file + ": its scene, " + config.scene.string() +
                     ", is not the one that the session was opened with; open it with the bytes of "
                     "that file, or name the file of those bytes as scene");
  if (ask_.hands != 0 && ask_.hands != config.devices.size())
    throw InputError(file + ": has " + std::to_string(config.devices.size()) +
                     " devices, and the session leads " + std::to_string(ask_.hands) +
                     " hands; give the option 'hands' that number, or leave it 0");
  config.flight_seconds = std::max(config.flight_seconds, ask_.history_s);
  const std::size_t bytes =
      kProcesses * config.devices.size() * FlightRecorder::bytes_for(flight_records(config));
  if (bytes > kMostHistoryBytes)
    throw InputError(file + formatted(": a history of %.0f s takes %.1f GB at this rate, more than "
                                      "1 GB; ask for less",
                                      config.flight_seconds, 1e-9 * static_cast<double>(bytes)));
  config.in_session = true;
  config.frames =
      &reinterpret_cast<const SessionDown*>(down_.bytes().data())->frames;  // sized by `map`
}

void RunSession::begin(const hal::DeviceGuardian& guardian, const DeviceConfig& config,
                       const SceneBytes& scene) {
  CoreInMemory own;
  // It was opened before: read_usable_scene.
  if (own.open(scene.span()) != RtStatus::kOk) throw OsError("the scene cannot be opened again");
  SessionHello hello;
  hello.devices = static_cast<std::uint32_t>(config.devices.size());
  hello.processes = std::min<std::uint32_t>(guardian.seats(), kSessionProcesses);
  hello.period_ns = config.loop.period_ns;
  const SceneParameters& p = own.view.parameters();
  const bool is_proxy = p.law == LawId::kProxy;
  hello.stiffness_n_per_m = is_proxy ? p.coupling.k_t_n_per_m : p.k_f_n_per_m;
  hello.stiffness_nm_per_rad = is_proxy ? p.coupling.k_r_nm_per_rad : 0.0;
  const hal::ServoReports first = guardian.reports(0);
  const auto* const board = reinterpret_cast<const ServoBoard*>(first.report.data());
  for (std::size_t k = 0; k < config.devices.size(); ++k) {
    SessionHello::Device& device = hello.of[k];
    const ServoParameters of_scene = with_scene(config.devices[k].servo, own.view_of(k));
    device.map = record_of(of_scene.map);
    device.finds_place = of_scene.start.place ? 1 : 0;
    device.finds_turn = of_scene.start.turn ? 1 : 0;
    put(of_scene.start.pose_wa, device.start_pose);
    device.flight = range_in(first.memory, first.flights[k].data(), first.flights[k].size());
    device.tick = range_in(first.memory, &board->session[k], sizeof board->session[k]);
  }
  std::array<int, SessionHello::kMostDescriptors> descriptors{up_.descriptor()};
  for (unsigned k = 0; k < hello.processes; ++k)
    descriptors[1 + k] = guardian.reports(k).descriptor;
  publish();
  errno = send_message(socket_.get(), std::as_bytes(std::span(&hello, 1)),
                       std::span(descriptors).first(1 + hello.processes));
  if (errno != 0) fail_os("the program with the session cannot be answered");
}

bool RunSession::is_alive() const noexcept {
  const auto& life = reinterpret_cast<const SessionDown*>(down_.bytes().data())->life;
  return (life.load(std::memory_order_acquire) & FUTEX_TID_MASK) != 0;
}

void RunSession::listen(std::function<void()> gone, int priority) {
  when_gone_ = std::move(gone);
  listener_ = std::thread([this, priority] {
    if (priority > 0) (void)hal::set_fifo_priority(priority);  // refused: as the others are
    wait_for_end();
  });
}

// The word may be anything: a program that changes it all the time has us look once a millisecond.
void RunSession::wait_for_end() noexcept {
  constexpr timespec kLongest{0, 50'000'000}, kPause{0, 1'000'000};
  const auto& life = reinterpret_cast<const SessionDown*>(down_.bytes().data())->life;
  while (!done_.load()) {
    const std::uint32_t word = life.load(std::memory_order_acquire);
    if (!is_alive()) {
      when_gone_();
      (void)eventfd_write(gone_.get(), 1);
      return;
    }
    const long error =
        syscall(SYS_futex, &life, FUTEX_WAIT, word, &kLongest, nullptr, 0) == 0 ? 0 : errno;
    if (is_alive() && error != ETIMEDOUT) (void)nanosleep(&kPause, nullptr);
  }
}

RunSession::Call RunSession::take() noexcept {
  Call call = Call::kNone;
  for (int k = 0; k < kMostCalls; ++k) {
    std::array<std::byte, 8> bytes{};
    const SessionMessage message = take_message(socket_.get(), bytes);
    if (message.size == -EAGAIN || message.size == -EINTR) break;
    if (message.size == 0) return Call::kGone;
    const char said = message.size == 1 ? static_cast<char>(bytes[0]) : '\0';
    if (said == kSessionClose) return Call::kClose;
    if (said != kSessionStop) return Call::kWrong;
    call = Call::kStop;
  }
  std::array<pollfd, 2> ends{{{program_.get(), POLLIN, 0}, {gone_.get(), POLLIN, 0}}};
  return poll(ends.data(), ends.size(), 0) > 0 ? Call::kGone : call;
}

void RunSession::tell_begun() noexcept {
  has_begun_ = true;
  const std::array<std::byte, 1> begun{static_cast<std::byte>(kSessionBegun)};
  (void)send_message(socket_.get(), begun);  // gone: it is heard of otherwise
}

void RunSession::tell(const RunEvent& event) noexcept {
  SessionEvent record;
  record.t_s = event.t_s;
  record.device = event.device;
  record.level = static_cast<std::uint32_t>(event.level);
  put_text(event.event, record.name);
  put_text(event.text, record.text);
  events_->write(record);
}

}  // namespace haptic::tools
