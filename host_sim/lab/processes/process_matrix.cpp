// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/processes/process_matrix.hpp"

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <span>
#include <sstream>
#include <thread>

#include "hal/clock/linux_process.hpp"
#include "hal/clock/servo_clock.hpp"
#include "hal/device_limits.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "host_sim/lab/faults/fault_run.hpp"
#include "host_sim/lab/processes/device_program.hpp"
#include "host_sim/lab/processes/process_judge.hpp"
#include "host_sim/lab/processes/relay_bridge.hpp"
#include "rt_core/safety/arming.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"

namespace haptic::sim {
namespace {

// Heights of the hand's target about touch, as in the fault matrix.
constexpr double kAbove_m = 0.005, kLight_m = -0.004, kFirm_m = -0.0185;
constexpr std::uint32_t kDeadman = 1;
// Of the force that the hand reaches by pressing: what counts as pressed, light and firm.
constexpr double kLightly_n = 0.3, kFirmly_n = 1.0;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kPatience_ns = 20'000 * kMs, kSettle_ns = 400 * kMs;
constexpr double kSpoiled_ms = 4;  // of the device's thread: it is then that which was late
constexpr unsigned kTries = 12;
// Before a try the machine is to wake a thread of the loop's priority in time for so long; it is
// waited for so many times.
constexpr std::int64_t kQuiet_ns = 60 * kMs, kInTime_ns = 1 * kMs;
constexpr int kMostWaits = 100, kLoopPriority = 79, kUrgentPriority = 80;
constexpr double kFirstStep_n = 0.1;

void sleep_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

/// The machine wakes threads of the loop's priority in time now, or is not waited for any more.
void wait_for_quiet() {
  std::thread([] {
    (void)hal::set_fifo_priority(kLoopPriority);
    for (int k = 0; k < kMostWaits; ++k) {
      std::int64_t due_ns = hal::monotonic_ns();
      const std::int64_t end_ns = due_ns + kQuiet_ns;
      bool in_time = true;
      while (in_time && due_ns < end_ns) {
        due_ns += kMs;
        (void)hal::sleep_until(due_ns);
        in_time = hal::monotonic_ns() - due_ns < kInTime_ns;
      }
      if (in_time) return;
    }
  }).join();
}

template <class Condition>
bool comes(Condition holds, std::int64_t within_ns = kPatience_ns) {
  const std::int64_t end_ns = hal::monotonic_ns() + within_ns;
  while (!holds()) {
    if (hal::monotonic_ns() > end_ns) return false;
    sleep_ms(1);
  }
  return true;
}

ReferenceModelSettings device_settings(double max_force_n) {
  ReferenceModelSettings settings;
  settings.hand = *hand_named("firm");
  settings.max_force_n = max_force_n;
  return settings;
}

std::vector<std::byte> pattern_of(int number) {
  std::vector<std::byte> bytes(1009);
  std::mt19937_64 random(20'26);
  for (std::byte& byte : bytes)
    byte = static_cast<std::byte>(number >= 0 ? static_cast<unsigned>(number) : random() & 255U);
  return bytes;
}

/// A folder with a scene and a configuration, removed at the end.
class Bench {
 public:
  explicit Bench(const std::string& program)
      : program_(program.empty() ? device_program_path() : program),
        folder_(std::filesystem::temp_directory_path() /
                ("haptic_processes_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
    const std::vector<std::byte> scene = fault_scene();
    const std::string config =
        "scene = \"wall.rtscene\"\n[device]\ndriver = \"reference\"\n"
        "address = \"unix:device.sock\"\n[workspace]\noffset_m = [0, 0, 0]\n[recorder]\n"
        "crash_file = \"crash.csv\"\n";
    tools::write_files(
        {{file("wall.rtscene"), scene}, {file("run.toml"), std::as_bytes(std::span(config))}});
  }
  ~Bench() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  [[nodiscard]] std::string file(const std::string& name) const {
    return (folder_ / name).string();
  }
  [[nodiscard]] std::vector<std::string> arguments(const std::string& every_s) const {
    return {program_,         "run",   file("run.toml"),   "--json",
            "--status-every", every_s, "--allow-degraded", "--accept-unbudgeted"};
  }

 private:
  std::string program_;
  std::filesystem::path folder_;
};

/// Events since the fault, and the last status; a line that is not whole yet is left out.
void note_lines(const std::string& output, std::size_t from, ProcessVerdict& verdict) {
  std::istringstream lines(output.substr(std::min(from, output.size())));
  for (std::string line; std::getline(lines, line);) {
    const nlohmann::json json = nlohmann::json::parse(line, nullptr, false);
    if (!json.is_object()) continue;
    if (json.value("kind", "") == "event") verdict.events.push_back(json.value("event", ""));
    if (json.value("kind", "") == "status")
      verdict.status = json.value("arming", "") + " " + fixed(json.value("force_n", 0.0), 1) + " N";
  }
}

/// While it lives this thread comes before all that is tested but the device; what is forked does
/// not.
class Urgent {
 public:
  Urgent() {
    const sched_param param{kUrgentPriority};
    (void)sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &param);
  }
  ~Urgent() {
    const sched_param param{0};
    (void)sched_setscheduler(0, SCHED_OTHER, &param);
  }
  Urgent(const Urgent&) = delete;
  Urgent& operator=(const Urgent&) = delete;
};

/// One cell, played.
class ProcessPlay {
 public:
  /// `bridged`: a bridge is between the program and the device.
  ProcessPlay(const Bench& bench, const ProcessCase& cell, bool bridged,
              const ProcessMatrixOptions& options)
      : bench_(bench),
        cell_(cell),
        bridge_(bridged ? std::make_unique<RelayBridge>(bench.file("device.sock"),
                                                        bench.file("relayed.sock"))
                        : nullptr),
        device_(bench.file(bridged ? "relayed.sock" : "device.sock"),
                device_settings(kProcessDevice_n)) {
    std::filesystem::remove(bench.file("crash.csv"));
    const ProcessFault& fault = *cell.fault;
    const bool pipe = fault.victim == ProcessVictim::kLogReader;
    reader_ = fault.victim == ProcessVictim::kTerminal ? ProgramReader::kTerminal
              : pipe                                   ? ProgramReader::kNobody
                                                       : ProgramReader::kFile;
    program_ =
        std::make_unique<DeviceProgram>(bench.arguments("0.01"), bench.file("first"), reader_);
    device_.pass_on_after(static_cast<std::int64_t>(1e6 * options.stale_ms));
    tap_.begin(program_->pid(ProgramPart::kGuardian));
    if (reader_ == ProgramReader::kFile) tail_.begin(bench.file("first.out"));
  }

  /// False: the state was not reached; the machine let the servo be too late.
  [[nodiscard]] bool reach();
  void harm(ProcessVerdict& verdict);
  void watch(ProcessVerdict& verdict);
  [[nodiscard]] std::string said() const { return program_->said(); }
  /// The fault would have come when the ramp out was over.
  [[nodiscard]] bool missed_ramp() const { return missed_ramp_; }

 private:
  [[nodiscard]] bool arm_free();
  [[nodiscard]] bool press();
  [[nodiscard]] bool reaches(double force_n) {
    return comes([&] { return device_.handed_n() >= force_n; }, 1500 * kMs);
  }
  void send(int number);
  void be_deaf(bool deaf);

  const Bench& bench_;
  const ProcessCase& cell_;
  std::unique_ptr<RelayBridge> bridge_;  ///< forked before the device has its thread
  ServedDevice device_;
  ProgramReader reader_ = ProgramReader::kFile;
  std::size_t told_before_ = 0;
  bool missed_ramp_ = false;
  std::unique_ptr<DeviceProgram> program_, second_;
  CommandTap tap_;
  StatusTail tail_;
  std::unique_ptr<Urgent> urgent_;  ///< until the fault is over
};

bool ProcessPlay::arm_free() {
  device_.hold(kAbove_m, 0);
  sleep_ms(100);
  device_.hold(kAbove_m, kDeadman);
  sleep_ms(250);
  return true;
}

bool ProcessPlay::press() {
  (void)arm_free();
  device_.hold(kFirm_m, kDeadman);
  if (!reaches(kFirmly_n)) return false;
  // Until it no longer grows.
  double last_n = 0;
  return comes([&] {
    sleep_ms(60);
    const double now_n = device_.handed_n();
    const bool settled = now_n > kFirmly_n && now_n < 1.02 * last_n;
    last_n = now_n;
    return settled;
  });
}

bool ProcessPlay::reach() {
  // The bridge is the device's host before the program is, and asks for no drives by itself.
  const auto is_taken = [&] {
    return bridge_ == nullptr ? device_.hosts() == 1 : device_.is_asked_for_drives();
  };
  if (!comes(is_taken)) {
    throw tools::InputError("run_device does not take the device: " + program_->said());
  }
  sleep_ms(50);
  // All parts are known from here on, also when they have ended.
  for (const ProgramPart part :
       {ProgramPart::kServo, ProgramPart::kSpare, ProgramPart::kZeroKeeper}) {
    if (!comes([&] { return program_->pid(part) > 0; }))
      throw tools::InputError(std::string("run_device has no process ") + to_text(part));
  }
  told_before_ = program_->output().size();
  switch (cell_.state) {
    case OperatorState::kDisarmed:
      device_.hold(kFirm_m, 0);
      sleep_ms(250);
      return true;
    case OperatorState::kArming:
      device_.hold(kLight_m, 0);
      sleep_ms(250);
      device_.hold(kLight_m, kDeadman);
      return reaches(kLightly_n);
    case OperatorState::kArmedFree:
      return arm_free();
    default:
      break;
  }
  if (!press()) return false;
  const double full_n = device_.handed_n();
  told_before_ = program_->output().size();
  if (cell_.state == OperatorState::kDisarming) {
    // The ramp takes few milliseconds: this thread is to be there at its first step.
    urgent_ = std::make_unique<Urgent>();
    device_.hold(kFirm_m, 0);
    const std::int64_t end_ns = hal::monotonic_ns() + 200 * kMs;
    while (device_.handed_n() > full_n - kFirstStep_n && hal::monotonic_ns() < end_ns)
      (void)hal::sleep_until(hal::monotonic_ns() + kMs / 20);
    missed_ramp_ = device_.handed_n() <= kWireRounding_n;
    return !missed_ramp_;
  }
  if (cell_.state == OperatorState::kFaulted) {
    device_.press_emergency_stop(true);
    sleep_ms(100);
  }
  return true;
}

void ProcessPlay::send(int number) {
  switch (cell_.fault->victim) {
    case ProcessVictim::kServo:
      (void)program_->signal(ProgramPart::kServo, number);
      break;
    case ProcessVictim::kSpare:
      (void)program_->signal(ProgramPart::kSpare, number);
      break;
    case ProcessVictim::kServoAndSpare:
      (void)program_->signal(ProgramPart::kSpare, number);
      (void)program_->signal(ProgramPart::kServo, number);
      break;
    case ProcessVictim::kZeroKeeper:
      (void)program_->signal(ProgramPart::kZeroKeeper, number);
      break;
    case ProcessVictim::kGroup:
      (void)program_->signal_group(number);
      break;
    case ProcessVictim::kBridge:
      (void)kill(bridge_->pid(), number);
      break;
    default:
      (void)program_->signal(ProgramPart::kGuardian, number);
      break;
  }
}

void ProcessPlay::be_deaf(bool deaf) {
  if (cell_.fault->victim == ProcessVictim::kBridge) return bridge_->be_deaf(deaf);
  device_.be_deaf(deaf);
}

void ProcessPlay::harm(ProcessVerdict& verdict) {
  const ProcessFault& fault = *cell_.fault;
  verdict.found.before_n = device_.handed_n();
  verdict.fault_ns = hal::monotonic_ns();
  switch (fault.cause) {
    case ProcessCause::kNothing:
      break;
    case ProcessCause::kSignal:
      send(fault.number);
      break;
    case ProcessCause::kScribble: {
      if (fault.victim == ProcessVictim::kBridge) {
        verdict.found.scribbled = scribble_shared(bridge_->pid(), pattern_of(fault.number));
        if (verdict.found.scribbled == 0) verdict.failures.push_back("nothing was overwritten");
        break;
      }
      const bool spare = fault.victim == ProcessVictim::kSpare;
      const ProgramPart part = spare ? ProgramPart::kSpare : ProgramPart::kServo;
      verdict.found.scribbled = program_->scribble(part, pattern_of(fault.number));
      const std::size_t open = program_->writable_read_only(part);
      if (verdict.found.scribbled == 0) verdict.failures.push_back("nothing could be overwritten");
      if (open > 0)
        verdict.failures.push_back("what the guardian writes could be overwritten by its servo");
      break;
    }
    case ProcessCause::kClose:
      program_->close_reader();
      break;
    case ProcessCause::kStopReading:
      sleep_ms(500);  // the pipe is full by then
      verdict.fault_ns = hal::monotonic_ns();
      send(fault.number);
      break;
    case ProcessCause::kStart: {
      std::vector<std::string> arguments = bench_.arguments("0.1");
      arguments.insert(arguments.end(), {"--seconds", "1"});
      // A fork that is put off while it copies the memory map would hold up the device's thread.
      const Urgent urgent;
      second_ =
          std::make_unique<DeviceProgram>(arguments, bench_.file("second"), ProgramReader::kFile);
      break;
    }
    case ProcessCause::kReplace:
      device_.replace(device_settings(kOtherProcessDevice_n));
      break;
    case ProcessCause::kStopThenGo:
      send(SIGSTOP);
      sleep_ms(fault.number);
      send(SIGCONT);
      break;
    case ProcessCause::kDeaf:
      be_deaf(true);
      sleep_ms(fault.number);
      be_deaf(false);
      break;
    case ProcessCause::kDeafThenKill: {
      const bool is_bridge = fault.victim == ProcessVictim::kBridge;
      is_bridge ? send(SIGSTOP) : device_.be_deaf(true);
      sleep_ms(fault.number / 5);
      (void)program_->signal(ProgramPart::kGuardian, SIGKILL);
      sleep_ms(fault.number - fault.number / 5);
      is_bridge ? send(SIGCONT) : device_.be_deaf(false);
      break;
    }
  }
}

void ProcessPlay::watch(ProcessVerdict& verdict) {
  urgent_.reset();
  const ProcessFault& fault = *cell_.fault;
  // The last tick of a hung process is 250 ms old before it is killed.
  sleep_ms(static_cast<int>(kProcessWatch_ns / kMs));
  verdict.found.after_n = device_.handed_n();
  note_lines(program_->output(), told_before_, verdict);
  if (fault.cause == ProcessCause::kStart) {
    (void)comes([&] { return second_->exit_code().has_value(); });
    const bool is_refused = bridge_ != nullptr || device_.refused() > 0;
    if (second_->exit_code() != 4 || device_.hosts() != 1 || !is_refused)
      verdict.failures.push_back("the second program was not refused: " + second_->said());
  }
  if (fault.cause == ProcessCause::kReplace) {
    // Armed again, the new device's own limit holds.
    device_.hold(kAbove_m, 0);
    sleep_ms(300);
    const std::size_t from = device_.record().commands.size();
    (void)arm_free();
    device_.hold(kFirm_m, kDeadman);
    sleep_ms(500);
    double most_n = 0;
    const WireRecord record = device_.record();
    for (std::size_t k = from; k < record.commands.size(); ++k)
      most_n = std::max(most_n, record.commands[k].wrench.force_w.norm());
    if (most_n > kOtherProcessDevice_n + kWireRounding_n || most_n == 0) {
      verdict.failures.push_back("the second device of " + fixed(kOtherProcessDevice_n, 1) +
                                 " N was handed " + fixed(most_n, 3) + " N");
    }
  }
  verdict.wire = device_.record();
  verdict.tapped = tap_.end();
  verdict.stated = tail_.end();
  if (fault.exit_code >= 0) {
    (void)comes([&] { return program_->exit_code().has_value(); });
  } else if (fault.victim != ProcessVictim::kGuardian || fault.number != SIGSTOP) {
    if (program_->exit_code()) verdict.failures.push_back("the program has ended");
    (void)program_->signal(ProgramPart::kGuardian, SIGTERM);
    (void)comes([&] { return program_->exit_code().has_value(); });
  }
  verdict.found.exit_code = program_->exit_code().value_or(-1);
  if (fault.exit_code >= 0 && verdict.found.exit_code != fault.exit_code) {
    verdict.failures.push_back("exit code " + std::to_string(verdict.found.exit_code) +
                               " in place of " + std::to_string(fault.exit_code));
  }
  verdict.said = program_->said();
  const bool crashed = std::filesystem::exists(bench_.file("crash.csv"));
  const bool read = reader_ == ProgramReader::kFile;
  if (read && *fault.says != '\0' && verdict.said.find(fault.says) == std::string::npos)
    verdict.failures.push_back(std::string("it does not say '") + fault.says + "'");
  if (*fault.never != '\0' && verdict.said.find(fault.never) != std::string::npos)
    verdict.failures.push_back(std::string("it says '") + fault.never + "'");
  const bool orderly = std::string(fault.never) == "servo process 0";
  if (orderly && crashed) verdict.failures.push_back("it has written a crash file");
}

/// Whether one of the statuses counts a tick that came later than its period.
bool tells_late_ticks(const std::string& said) {
  for (const std::string key : {"\"held\":", "\"beyond\":"}) {
    for (std::size_t at = said.find(key); at != std::string::npos; at = said.find(key, at)) {
      at += key.size();
      if (at < said.size() && said[at] != '0') return true;
    }
  }
  return false;
}

/// The force that the machine's lateness leaves to a run that is allowed all the same [N]; the
/// device's where nothing is said of it.
double granted_n(const std::string& said) {
  const std::string key = "sent to this device: at most ";
  const std::size_t at = said.find(key);
  return at == std::string::npos ? kProcessDevice_n
                                 : std::strtod(said.c_str() + at + key.size(), nullptr);
}

/// Not the program's doing, in words; empty: it is. This process was late itself, or the servo was,
/// and let go or began to: the force rises again as it comes back. It is tried again, and one that
/// is spoiled each time fails.
std::string spoiled_by_machine(const ProcessVerdict& v) {
  if (v.failures.empty()) return "";
  if (granted_n(v.said) < kFirmly_n)
    return "its wake-ups were so late that a run gets " + fixed(granted_n(v.said), 2) +
           " N at most";
  if (v.found.largest_late_ms > kSpoiled_ms)
    return "the device's thread was late by " + fixed(v.found.largest_late_ms, 1) + " ms";
  if (tells_late_ticks(v.said)) return "the loop had late ticks";
  const bool let_go = v.said.find(fault_text(kFaultLateTick)) != std::string::npos ||
                      v.said.find(fault_text(kFaultStaleState)) != std::string::npos;
  const bool hung = v.cell.fault->number == SIGSTOP;
  return let_go && !hung ? "the loop let go because it was late" : "";
}

ProcessVerdict play(const Bench& bench, const ProcessCase& cell,
                    const ProcessMatrixOptions& options, double slew_n_per_s) {
  const bool bridged = options.bridged || cell.fault->victim == ProcessVictim::kBridge;
  ProcessVerdict verdict;
  for (unsigned k = 1; k <= kTries; ++k) {
    verdict = ProcessVerdict{};
    verdict.cell = cell;
    verdict.tries = k;
    wait_for_quiet();
    ProcessPlay stage(bench, cell, bridged, options);
    if (stage.reach()) {
      stage.harm(verdict);
      stage.watch(verdict);
      judge_wire(verdict, slew_n_per_s);
    } else {
      verdict.failures.push_back("the state was not reached");
      verdict.said = stage.said();
    }
    verdict.spoiled = stage.missed_ramp() ? "this process came when the ramp out was over"
                                          : spoiled_by_machine(verdict);
    if (verdict.spoiled.empty()) break;
  }
  if (!verdict.spoiled.empty()) {
    verdict.failures.push_back("not judged: in each of " + std::to_string(kTries) +
                               " tries the machine was late, the last time: " + verdict.spoiled);
  }
  return verdict;
}

}  // namespace

std::vector<ProcessVerdict> run_process_matrix(const ProcessMatrixOptions& options) {
  const Bench bench(options.program);
  const hal::DeviceCapabilities device = hal::reference_capabilities();
  const auto slew =
      static_cast<double>(hal::limits_of(device, device.report_period_ns).slew_n_per_s);
  std::vector<ProcessVerdict> verdicts;
  for (const ProcessFault& fault : process_faults()) {
    for (int k = 0; k < static_cast<int>(OperatorState::kCount); ++k) {
      const ProcessCase cell{static_cast<OperatorState>(k), &fault};
      if (options.quick && cell.state != OperatorState::kArmedContact) continue;
      if (options.wanted && !options.wanted(cell)) continue;
      verdicts.push_back(play(bench, cell, options, slew));
      if (options.told) options.told(verdicts.back());
    }
  }
  return verdicts;
}

bool all_hold(const std::vector<ProcessVerdict>& verdicts) {
  return std::all_of(verdicts.begin(), verdicts.end(),
                     [](const ProcessVerdict& v) { return v.failures.empty(); });
}

}  // namespace haptic::sim
