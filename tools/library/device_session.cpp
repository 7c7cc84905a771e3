// SPDX-License-Identifier: Apache-2.0
#include "tools/library/device_session.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "hal/clock/linux_process.hpp"
#include "hal/clock/servo_clock.hpp"
#include "tools/library/bodies.hpp"
#include "tools/library/call.hpp"
#include "tools/library/tick_history.hpp"

extern char** environ;

namespace haptic::tools {
namespace {

constexpr int kSessionSocket = 3;  // in run_device
/// Its set-up, its measurement of the machine, and the thread of the link.
constexpr int kLongestStart_ms = 30'000;
/// The ramp, the end of the processes and their memory.
constexpr int kLongestEnd_ms = 5'000;
constexpr const char* kProgram = "run_device";

std::string words(int error) { return std::generic_category().message(error); }

bool is_program(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error) && access(path.c_str(), X_OK) == 0;
}

/// The folder of this library; empty: not known.
std::filesystem::path own_folder() {
  Dl_info found{};
  if (dladdr(reinterpret_cast<const void*>(&haptic_version), &found) == 0 ||
      found.dli_fname == nullptr)
    return {};
  std::error_code error;
  const auto path = std::filesystem::canonical(found.dli_fname, error);
  return error ? std::filesystem::path() : path.parent_path();
}

/// The parts of a record that a side gone wild may have left in it, within their ranges.
void make_sound(SessionTick& tick) noexcept {
  tick.situation = std::min(tick.situation, 6u);
  tick.arming = std::min(tick.arming, 4u);
  tick.link = std::min(tick.link, 2u);
  SessionVerdict& v = tick.verdict;
  if (v.outcome >= Outcome::kCount) v.outcome = Outcome::kNoTicks;
  unsigned char inside = 0;  // as a byte: another value is no bool
  std::memcpy(&inside, &v.started_inside, 1);
  v.started_inside = inside == 1;
  std::memcpy(&inside, &v.has_device, 1);
  v.has_device = inside == 1;
}

bool fits(const SessionRange& range, std::size_t memory, std::size_t least) noexcept {
  return range.begin % alignof(std::max_align_t) == 0 && range.bytes >= least &&
         range.begin <= memory && range.bytes <= memory - range.begin;
}

/// Kernel's list of words that it changes when a thread dies, for the time of this object: the
/// thread is told of first of all, before its memory is given back, which takes a large program
/// tens of milliseconds (Linux, Documentation/locking/robust-futex-ABI.rst).
class DyingWord {
 public:
  explicit DyingWord(std::atomic<std::uint32_t>& word) noexcept : word_(word) {
    entry_.next = &head_.list;
    head_.list.next = &entry_;
    head_.futex_offset = reinterpret_cast<char*>(&word) - reinterpret_cast<char*>(&entry_);
    head_.list_op_pending = nullptr;
    (void)syscall(SYS_get_robust_list, 0, &before_, &before_bytes_);
    // As one that is waited for: the kernel wakes nobody else.
    word_.store(static_cast<std::uint32_t>(syscall(SYS_gettid)) | FUTEX_WAITERS);
    (void)syscall(SYS_set_robust_list, &head_, sizeof head_);
  }
  ~DyingWord() { (void)syscall(SYS_set_robust_list, before_, before_bytes_); }
  DyingWord(const DyingWord&) = delete;
  DyingWord& operator=(const DyingWord&) = delete;

 private:
  std::atomic<std::uint32_t>& word_;
  robust_list_head head_{};
  robust_list entry_{};
  robust_list_head* before_ = nullptr;
  std::size_t before_bytes_ = 0;
};

}  // namespace

std::string find_run_device(std::string& text) {
  const char* const named = secure_getenv("HAPTIC_RUN_DEVICE");
  if (named != nullptr && *named != '\0') {
    if (is_program(named)) return named;
    text = "HAPTIC_RUN_DEVICE is '" + std::string(named) +
           "', which is no program; give the path of run_device, or unset it";
    return {};
  }
  const std::filesystem::path folder = own_folder();
  std::string looked;
  // lib/libhaptic.so.0, lib/x86_64-linux-gnu/libhaptic.so.0, and the tree of a build.
  for (const char* const way : {"../bin", "../../bin"}) {
    if (folder.empty()) break;
    const std::filesystem::path there = (folder / way / kProgram).lexically_normal();
    if (is_program(there)) return there.string();
    looked += there.string() + ", ";
  }
  const char* const path = std::getenv("PATH");
  std::string_view left = path != nullptr ? path : "";
  while (!left.empty()) {
    const std::size_t end = std::min(left.find(':'), left.size());
    const std::filesystem::path there = std::filesystem::path(left.substr(0, end)) / kProgram;
    if (end > 0 && is_program(there)) return there.string();
    left.remove_prefix(std::min(end + 1, left.size()));
  }
  text = "no run_device: it is not at " + looked +
         "HAPTIC_RUN_DEVICE is not set, and PATH does not have it; install the programs beside the "
         "library, or set HAPTIC_RUN_DEVICE";
  return {};
}

DeviceSession::DeviceSession(std::span<const std::byte> scene, const SceneView& view,
                             const DeviceSettings& settings)
    : settings_(settings),
      scene_hash_(hash_of_scene(scene)),
      opened_ns_(hal::monotonic_ns()),
      down_(sizeof(SessionDown), hal::SharedMemory::Readers::kByDescriptor) {
  const SceneParameters& p = view.parameters();
  const bool is_proxy = p.law == LawId::kProxy;
  asked_n_per_m_ = is_proxy ? p.coupling.k_t_n_per_m : p.k_f_n_per_m;
  asked_nm_per_rad_ = is_proxy ? p.coupling.k_r_nm_per_rad : 0.0;
  if (down_.bytes().empty()) throw std::bad_alloc();
  to_program_ = new (down_.bytes().data()) SessionDown{};
  frame_writer_ = std::make_unique<NewestWriter<FrameRecord>>(to_program_->frames);
  (void)madvise(down_.bytes().data(), down_.bytes().size(), MADV_DONTFORK);
}

DeviceSession::~DeviceSession() { close(); }

/// @return 0 or an errno.
int DeviceSession::spawn(const std::string& program, int socket) {
  // An address that begins with a dash is no option.
  std::string config = std::filesystem::absolute(settings_.config).string();
  std::string name = program, run = "run", option = "--session";
  std::string number = std::to_string(kSessionSocket);
  std::array<char*, 6> arguments{name.data(),   run.data(),    config.data(),
                                 option.data(), number.data(), nullptr};
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  (void)posix_spawn_file_actions_init(&files);
  (void)posix_spawnattr_init(&attributes);
  // Its own ends of these may have the numbers that are wanted.
  (void)posix_spawn_file_actions_adddup2(&files, said_.get(), STDERR_FILENO);
  (void)posix_spawn_file_actions_adddup2(&files, socket, kSessionSocket);
  (void)posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  (void)posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  (void)posix_spawnattr_setsigmask(&attributes, &none);
  (void)posix_spawnattr_setsigdefault(&attributes, &all);
  // A session of its own: a Ctrl-C is this program's to follow.
  (void)posix_spawnattr_setflags(
      &attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSID);
  const int error =
      posix_spawn(&pid_, program.c_str(), &files, &attributes, arguments.data(), environ);
  (void)posix_spawnattr_destroy(&attributes);
  (void)posix_spawn_file_actions_destroy(&files);
  if (error != 0) {
    pid_ = -1;
    return error;
  }
  program_ = Descriptor(static_cast<int>(syscall(SYS_pidfd_open, pid_, 0)));
  if (program_.is_open()) return 0;
  const int refused = errno;
  end_unwatched();
  return refused;
}

// Without a thread that takes its end: killed and waited for here, so that nothing is left of it.
// It has no device yet, which it asks for once the request has come.
void DeviceSession::end_unwatched() noexcept {
  (void)kill(pid_, SIGKILL);  // not reaped before: the number is its own
  while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
}

int DeviceSession::start(std::string& text) {
  const auto refuse = [&text](const std::string& what, int error) {
    text = what + ": " + words(error);
    return HAPTIC_ERROR_SYSTEM;
  };
  const std::string program = find_run_device(text);
  if (program.empty()) return HAPTIC_ERROR_SYSTEM;
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0)
    return refuse("no socket for a session", errno);
  // Above the numbers that are given to the program.
  socket_ = Descriptor(fcntl(ends[0], F_DUPFD_CLOEXEC, kSessionSocket + 1));
  const Descriptor theirs(fcntl(ends[1], F_DUPFD_CLOEXEC, kSessionSocket + 1));
  (void)::close(ends[0]);
  (void)::close(ends[1]);
  const Descriptor said(memfd_create("haptic session", MFD_CLOEXEC));
  said_ = Descriptor(fcntl(said.get(), F_DUPFD_CLOEXEC, kSessionSocket + 1));
  if (!socket_.is_open() || !theirs.is_open() || !said_.is_open())
    return refuse("no descriptors for a session", errno);
  if (const int error = spawn(program, theirs.get()); error != 0) return refuse(program, error);
  try {
    const hal::SignalsHeld held;
    thread_ = std::thread([this] { live(); });
  } catch (const std::system_error& error) {
    end_unwatched();
    return refuse("no thread for a session", error.code().value());
  }
  lives_.wait(0);
  const int error = shake_hands(program, text);
  if (error != HAPTIC_OK) close();
  return error;
}

// The request goes once; what comes back, or the end of the program, is waited for.
int DeviceSession::shake_hands(const std::string& program, std::string& text) {
  SessionAsk ask;
  ask.history_s = settings_.history_s;
  ask.hands = settings_.hands;
  ask.scene_sha256 = scene_hash_;
  const Descriptor self(static_cast<int>(syscall(SYS_pidfd_open, getpid(), 0)));
  const std::array<int, SessionAsk::kDescriptors> given{down_.descriptor(), self.get()};
  int error = send_message(socket_.get(), std::as_bytes(std::span(&ask, 1)), given);
  // Gone already: its words say why.
  if (error != 0 && error != EPIPE && error != ECONNRESET) {
    text = "the request to " + program + ": " + words(error);
    return HAPTIC_ERROR_SYSTEM;
  }
  const std::int64_t until_ns = hal::monotonic_ns() + std::int64_t{kLongestStart_ms} * 1'000'000;
  bool has_hello = false;
  for (;;) {
    const std::int64_t left_ms = (until_ns - hal::monotonic_ns()) / 1'000'000;
    if (left_ms <= 0) {
      text = program + ": did not begin within " + std::to_string(kLongestStart_ms / 1000) +
             " s; try it by 'run_device run " + settings_.config + "'";
      return HAPTIC_ERROR_SYSTEM;
    }
    (void)waits_for_message(socket_.get(), static_cast<int>(std::min<std::int64_t>(left_ms, 100)));
    std::array<std::byte, sizeof(SessionHello)> bytes{};
    SessionMessage message = take_message(socket_.get(), bytes);
    if (message.size == -EAGAIN || message.size == -EINTR) {
      if (has_ended_.load()) return failure_of(program, text);
      continue;
    }
    if (message.size == 0) return failure_of(program, text);
    if (has_hello && message.size == 1 && static_cast<char>(bytes[0]) == kSessionBegun)
      return HAPTIC_OK;
    // An answer of another version: only its first words count.
    if (message.size == -EMSGSIZE) message.size = sizeof(SessionHello);
    std::memcpy(&hello_, bytes.data(), sizeof hello_);
    if (has_hello || message.size < 16 || hello_.magic != kHelloMagic) {
      hello_ = {};
      text = program + ": answers what no run_device answers";
      return HAPTIC_ERROR_VERSION;
    }
    error = take_hello(message, text);
    if (error != HAPTIC_OK) {
      hello_ = {};
      text = program + ": " + text;
      return error;
    }
    has_hello = true;
  }
}

int DeviceSession::take_hello(SessionMessage& message, std::string& text) {
  if (message.size != sizeof(SessionHello) || !(hello_.layout == SessionLayout{})) {
    text = "is of another version than this library (session record version " +
           std::to_string(hello_.layout.version) + " against " +
           std::to_string(SessionLayout{}.version) +
           "); install both of one version, or set HAPTIC_RUN_DEVICE to the one that fits";
    return HAPTIC_ERROR_VERSION;
  }
  text = "answers with numbers or memory that cannot be";
  if (hello_.devices < 1 || hello_.devices > kSessionDevices || hello_.processes < 1 ||
      hello_.processes > kSessionProcesses || hello_.period_ns < 1000 ||
      message.descriptor_count != 1 + hello_.processes)
    return HAPTIC_ERROR_INTERNAL;
  if (up_.map(message.descriptors[0], sizeof(SessionUp)) != 0) return HAPTIC_ERROR_INTERNAL;
  up_.keep_from_children();
  for (std::size_t p = 0; p < hello_.processes; ++p) {
    if (ticks_[p].map(message.descriptors[1 + p], sizeof(SessionTick)) != 0)
      return HAPTIC_ERROR_INTERNAL;
    ticks_[p].keep_from_children();
    const std::size_t bytes = ticks_[p].bytes().size();
    for (std::size_t k = 0; k < hello_.devices; ++k) {
      const SessionHello::Device& device = hello_.of[k];
      if (!fits(device.flight, bytes, 0) ||
          !fits(device.tick, bytes, sizeof(NewestRecord<SessionTick>)))
        return HAPTIC_ERROR_INTERNAL;
    }
  }
  text.clear();
  return HAPTIC_OK;
}

/// The words of a program that has ended, or will, and an error number by its exit code.
int DeviceSession::failure_of(const std::string& program, std::string& text) {
  if (!waits_for_end(kLongestEnd_ms)) {
    kill_program();
    text = program + ": refused, but did not end within " + std::to_string(kLongestEnd_ms / 1000) +
           " s and was killed; try it by 'run_device run " + settings_.config + "'";
    return HAPTIC_ERROR_SYSTEM;
  }
  constexpr std::size_t kMostWords = 4000;
  std::string said(kMostWords, '\0');
  const ssize_t size = pread(said_.get(), said.data(), said.size(), 0);
  said.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
  while (!said.empty() && (said.back() == '\n' || said.back() == ' ')) said.pop_back();
  const int code = exit_status_.load();
  text = said.empty() ? program + ": ended at once, with exit code " + std::to_string(code) : said;
  if (said.find("different versions") != std::string::npos) return HAPTIC_ERROR_VERSION;
  constexpr int kUsage = 2, kBadInput = 3;
  if (code == kUsage) {
    text += "; is " + program + " of the version of this library?";
    return HAPTIC_ERROR_VERSION;
  }
  return code == kBadInput ? HAPTIC_ERROR_INPUT : HAPTIC_ERROR_DEVICE;
}

/// On the thread of the session, which lives as long as its program.
void DeviceSession::live() noexcept {
  const DyingWord word(to_program_->life);
  lives_.store(1);
  lives_.notify_all();
  pollfd watched{program_.get(), POLLIN, 0};
  while (poll(&watched, 1, -1) < 0 && errno == EINTR) {
  }
  siginfo_t how{};
  // Nobody's, where the program ignores its children or waits for any of them.
  const bool is_ours = waitid(static_cast<idtype_t>(P_PIDFD), static_cast<id_t>(program_.get()),
                              &how, WEXITED | WNOHANG) == 0 &&
                       how.si_pid == pid_;
  if (is_ours) exit_status_.store(how.si_code == CLD_EXITED ? how.si_status : 128 + how.si_status);
  {
    const std::lock_guard lock(end_mutex_);
    has_ended_.store(true);
  }
  end_.notify_all();
}

bool DeviceSession::waits_for_end(int timeout_ms) noexcept {
  std::unique_lock lock(end_mutex_);
  return end_.wait_for(lock, std::chrono::milliseconds(timeout_ms),
                       [this] { return has_ended_.load(); });
}

void DeviceSession::kill_program() noexcept {
  if (program_.is_open()) (void)syscall(SYS_pidfd_send_signal, program_.get(), SIGKILL, nullptr, 0);
}

void DeviceSession::close() noexcept {
  if (closed_.exchange(true) || !is_of_this_process()) return;
  if (!thread_.joinable()) return;
  const std::array<std::byte, 1> end{static_cast<std::byte>(kSessionClose)};
  (void)send_message(socket_.get(), end);
  (void)shutdown(socket_.get(), SHUT_WR);  // heard also where the message found no room
  // It does not end: the process that keeps its device at zero does what is left to do.
  if (!waits_for_end(kLongestEnd_ms)) {
    was_killed_.store(true);
    kill_program();
  }
  thread_.join();
}

void DeviceSession::stop() noexcept {
  const std::array<std::byte, 1> stop{static_cast<std::byte>(kSessionStop)};
  (void)send_message(socket_.get(), stop);  // full: so many stops are on their way
}

int DeviceSession::move_fixed(const haptic_frame& frame) {
  if (has_ended_.load()) return HAPTIC_ERROR_DEVICE;
  frame_ = next_record(frame_, frame, hal::monotonic_ns());
  frame_writer_->publish(frame_);
  return HAPTIC_OK;
}

SessionStatus DeviceSession::status() const noexcept {
  const auto& up = *reinterpret_cast<const SessionUp*>(up_.bytes().data());
  SessionStatus found = NewestReader<SessionStatus>(up.status).newest();
  found.process = std::min(found.process, hello_.processes - 1);
  return found;
}

SessionTick DeviceSession::tick(std::size_t process, std::size_t hand) const noexcept {
  const std::byte* const at =
      ticks_[process].bytes().data() + static_cast<std::size_t>(hello_.of[hand].tick.begin);
  const auto& record = *reinterpret_cast<const NewestRecord<SessionTick>*>(at);
  SessionTick found = NewestReader<SessionTick>(record).newest();
  make_sound(found);
  return found;
}

void DeviceSession::state(std::size_t hand, haptic_state& state) const noexcept {
  const bool is_over = has_ended_.load();
  const std::size_t process = status().process;
  const SessionTick from = tick(process, hand);
  state = HAPTIC_STATE_INIT;
  state.tick = from.tick;
  if (from.tick > 0) state.time_s = 1e-9 * static_cast<double>(from.now_ns - opened_ns_);
  std::copy_n(from.hand_pose, 7, state.hand_pose);
  std::copy_n(from.felt_pose, 7, state.felt_pose);
  std::copy_n(from.wrench, 6, state.wrench);
  state.gap_m = from.gap_m;
  state.state_hash = from.state_hash;
  state.situation = from.situation;
  state.flags = from.flags;
  state.safety_faults = from.safety_faults;
  state.device_faults = from.device_faults;
  state.armings = from.armings;
  state.late_ticks = from.late_ticks;
  state.missed_periods = from.missed_periods;
  state.longest_tick_s = 1e-9 * static_cast<double>(from.longest_tick_ns);
  // Counts are of the session: a spare that has taken over counts from 1 on.
  for (std::size_t p = 0; p < process; ++p) {
    const SessionTick before = tick(p, hand);
    state.tick += before.tick;
    state.armings += before.armings;
    state.late_ticks += before.late_ticks;
    state.missed_periods += before.missed_periods;
    state.longest_tick_s =
        std::max(state.longest_tick_s, 1e-9 * static_cast<double>(before.longest_tick_ns));
  }
  // The newest tick of a run that has ended is not what the device has.
  if (is_over) return;
  std::copy_n(from.sent_wrench, 6, state.sent_wrench);
  state.link = from.link;
  state.arming = from.arming;
  state.hand_held = from.is_held;
}

SessionVerdict DeviceSession::verdict(std::size_t hand) const noexcept {
  SessionVerdict sum = tick(0, hand).verdict;
  for (std::size_t p = 1; p <= status().process; ++p) add(tick(p, hand).verdict, sum);
  return sum;
}

void DeviceSession::gains(haptic_gains& gains) const noexcept {
  gains = HAPTIC_GAINS_INIT;
  gains.stiffness_n_per_m = hello_.stiffness_n_per_m;
  gains.stiffness_nm_per_rad = hello_.stiffness_nm_per_rad;
  gains.asked_n_per_m = asked_n_per_m_;
  gains.asked_nm_per_rad = asked_nm_per_rad_;
  if (!(gains.stiffness_n_per_m < asked_n_per_m_)) return;
  gains.lowered = 1;
  const std::string text = "the scene is rendered with " + std::to_string(gains.stiffness_n_per_m) +
                           " N/m instead of " + std::to_string(asked_n_per_m_) +
                           ": what driver 'sim' and the hand on it hold; give the scene a [device]";
  text.copy(gains.text, sizeof gains.text - 1);
}

void DeviceSession::device(std::size_t hand, haptic_device_status& to) const noexcept {
  to = HAPTIC_DEVICE_STATUS_INIT;
  const bool is_over = has_ended_.load();
  const SessionStatus from = status();
  const SessionDeviceStatus& device = from.devices[hand];
  const SessionTick newest = tick(from.process, hand);
  to.phase = is_over                                 ? HAPTIC_DEVICE_ENDED
             : from.process == 0 && newest.tick == 0 ? HAPTIC_DEVICE_STARTS
                                                     : HAPTIC_DEVICE_RUNS;
  to.connects = device.connects;
  to.reports = device.reports;
  if (is_over) {
    to.exit_code = from.phase == SessionPhase::kEnded ? from.exit_code : exit_status_.load();
    const std::string_view why =
        from.phase == SessionPhase::kEnded ? text_in(from.why)
        : was_killed_.load() ? "run_device did not end within 5 s of the close and was "
                               "killed; the process that keeps its device at zero takes the "
                               "force away"
                             : "run_device ended without a word; the process that keeps "
                               "its device at zero takes the force away";
    why.copy(to.why, sizeof to.why - 1);
    return;
  }
  to.link = std::min(device.link, 2u);
  to.faults = device.link_faults | newest.device_faults;
  to.is_silent = from.is_silent;
  to.force_n = device.force_n;
  to.torque_nm = device.torque_nm;
  text_in(device.waits_for).copy(to.waits_for, sizeof to.waits_for - 1);
  text_in(device.trouble).copy(to.trouble, sizeof to.trouble - 1);
}

std::size_t DeviceSession::events(std::span<haptic_event> events) const noexcept {
  const EventRing& ring = reinterpret_cast<const SessionUp*>(up_.bytes().data())->events;
  const std::uint64_t last = ring.newest.load(std::memory_order_acquire);
  const std::uint64_t most = std::min<std::uint64_t>({last, events.size(), EventRing::kEvents});
  std::size_t count = 0;
  for (std::uint64_t k = 0; k < most; ++k) {
    const std::uint64_t number = last - most + 1 + k;
    SessionEvent from;
    if (number == 0 || !copy_event(ring, number, from)) continue;
    haptic_event& to = events[count++];
    to = haptic_event{};
    to.number = number;
    to.time_s = from.t_s;
    to.device = from.device;
    to.level = from.level;
    text_in(from.name).copy(to.name, sizeof to.name - 1);
    text_in(from.text).copy(to.text, sizeof to.text - 1);
  }
  return count;
}

/// Ticks of each process that has rendered, oldest first.
std::size_t DeviceSession::history(std::size_t hand, std::span<haptic_tick> ticks) const {
  const SessionHello::Device& device = hello_.of[hand];
  HistoryPlace place;
  place.map = map_of(device.map);
  place.start.place = device.finds_place != 0;
  place.start.turn = device.finds_turn != 0;
  place.start.pose_wa = pose_of_numbers(device.start_pose);
  place.opened_ns = opened_ns_;
  std::vector<haptic_tick> all;
  for (std::size_t p = 0; p <= status().process; ++p) {
    const std::span<const std::byte> flight =
        ticks_[p].bytes().subspan(static_cast<std::size_t>(device.flight.begin),
                                  static_cast<std::size_t>(device.flight.bytes));
    std::vector<StepTrace> records(std::min(ticks.size(), flight.size() / sizeof(StepTrace)));
    records.resize(FlightRecorder::copy_newest(flight, records));
    const SessionTick newest = tick(p, hand);
    place.begun = map_of(newest.map);
    place.began_tick = newest.began_tick;
    append_ticks(records, place, all);
    place.ticks_before += newest.tick;
  }
  const std::size_t count = std::min(all.size(), ticks.size());
  std::copy(all.end() - static_cast<std::ptrdiff_t>(count), all.end(), ticks.begin());
  return count;
}

}  // namespace haptic::tools
