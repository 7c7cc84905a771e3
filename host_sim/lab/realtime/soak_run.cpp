// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/realtime/soak_run.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <malloc.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <memory>
#include <numeric>
#include <stdexcept>

#include "hal/clock/servo_clock.hpp"
#include "host_sim/lab/faults/fault_run.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {

namespace {

unsigned open_descriptors() {
  DIR* folder = ::opendir("/proc/self/fd");
  if (folder == nullptr) throw std::runtime_error("/proc/self/fd cannot be read");
  unsigned count = 0;
  while (const dirent* entry = ::readdir(folder)) count += entry->d_name[0] != '.' ? 1u : 0u;
  ::closedir(folder);
  return count - 1;  // the folder's own
}

constexpr unsigned kMostRuns = 8;  ///< of a cell that the machine spoils
/// Periods from taking force until the hold is looked at, and between plugs of the warm-up.
constexpr std::size_t kSettle = 200, kPlug = 60;
constexpr std::size_t kLeakBytes = 64 * 1024;  ///< a second

// Records of a fault come and go within a slot, and the soak's own are made beforehand: what is
// left over is what the bus and libusb keep of one connection or another.
constexpr double kHeapTolerance = 64.0 * 1024;
// The kernel counts resident pages per processor and adds them up in batches of 64 or more; pages
// of the heap between those in use stay with the process.
constexpr double kResidentTolerance = 1024.0 * 1024;

constexpr std::array kStates = {FaultState::kArming,   FaultState::kDisarming,
                                FaultState::kClutched, FaultState::kArmedFree,
                                FaultState::kDisarmed, FaultState::kFaulted};

bool breaks_a_limit(const FaultFigures& found) {
  return found.limit_share > 1 || found.send_share > 1 || found.acting_share > 1;
}

class Soak {
 public:
  Soak(std::span<const std::byte> scene, const FaultPlace& place, const SoakSettings& settings,
       const std::function<void(const SoakAccount&)>& progress)
      : scene_(scene),
        settings_(settings),
        progress_(progress),
        stack_(fault_stack(run_settings_, place)) {}

  SoakAccount run();

 private:
  void make_stage();
  void warm_up();
  void sees(const FaultSample& sample);
  void take_sample(double t_s, double force_n);
  void leak();
  void play_slot(const FaultCase& cell, double end_s);
  /// False: the machine spoiled it.
  bool play_cell(const FaultCase& cell, SoakCell& result);
  void hold_force(double end_s);
  void watch_hold(double end_s);
  void judge_levels();
  void pass(std::size_t periods) {
    for (std::size_t k = 0; k < periods; ++k) static_cast<void>(stage_->step());
  }
  [[nodiscard]] const FaultTrace& unharmed(FaultState state);
  [[nodiscard]] std::int64_t spoiled_ns() const {
    return std::llround(kSpoiledPeriods * 1e9 * stage_->period_s());
  }
  void fail(const std::string& text) { account_.failures.push_back(text); }

  std::span<const std::byte> scene_;
  SoakSettings settings_;
  const std::function<void(const SoakAccount&)>& progress_;
  FaultSettings run_settings_;
  StackSettings stack_;
  std::unique_ptr<FaultStage> stage_;
  ThreadedStage* threads_ = nullptr;  ///< of stage_, in real time
  std::map<FaultState, FaultTrace> unharmed_;
  SoakAccount account_;
  double begin_s_ = 0;
  std::uint64_t periods_ = 0, periods_per_sample_ = 0;
  std::int64_t late_ns_ = 0, late_since_sample_ns_ = 0;
  std::uint32_t latched_ = 0;  ///< SafetyFault of the last period
  ProcessState last_;
  struct SlotLevels {
    double heap = 0, resident = 0, descriptors = 0, threads = 0;
  };
  std::vector<SlotLevels> slots_;
  double slot_heap_ = 0, slot_resident_ = 0;  ///< least in this slot
  std::vector<std::unique_ptr<char[]>> leaked_;
};

void Soak::make_stage() {
  if (settings_.virtual_time) {
    stage_ = std::make_unique<StackStage>(scene_, stack_);
  } else {
    auto stage = std::make_unique<ThreadedStage>(scene_, stack_, settings_.heap_calls);
    threads_ = stage.get();
    stage_ = std::move(stage);
  }
}

const FaultTrace& Soak::unharmed(FaultState state) {
  const auto found = unharmed_.find(state);
  if (found != unharmed_.end()) return found->second;
  StackStage alone(scene_, stack_);
  return unharmed_[state] = play_fault(alone, {state, &faults().front()});
}

// The device keeps old buses until so many newer ones have come; with them all there no later plug
// adds one.
void Soak::warm_up() {
  for (std::size_t k = 0; k <= ReferenceUsb::kKeptCarriers + 1; ++k) {
    stage_->unplug();
    pass(kPlug);
    stage_->plug(false);
    pass(kPlug);
  }
}

void Soak::leak() {
  if (settings_.probe == SoakProbe::kLeakMemory) {
    leaked_.push_back(std::make_unique<char[]>(kLeakBytes));
    std::memset(leaked_.back().get(), 1, kLeakBytes);
  }
  if (settings_.probe == SoakProbe::kLeakDescriptor)
    static_cast<void>(::open("/dev/null", O_RDONLY | O_CLOEXEC));
}

void Soak::take_sample(double t_s, double force_n) {
  leak();
  last_ = process_state();
  slot_heap_ = std::min(slot_heap_, static_cast<double>(last_.heap_bytes));
  slot_resident_ = std::min(slot_resident_, static_cast<double>(last_.resident_bytes));
  account_.samples.push_back({t_s, last_, force_n, late_since_sample_ns_});
  late_since_sample_ns_ = 0;
}

void Soak::sees(const FaultSample& sample) {
  const double force_n = sample.acting.force_w.norm();
  latched_ = sample.safety;
  late_ns_ = std::max(late_ns_, sample.late_ns);
  late_since_sample_ns_ = std::max(late_since_sample_ns_, sample.late_ns);
  account_.largest_late_ns = std::max(account_.largest_late_ns, sample.late_ns);
  if (periods_ % kForceEvery == 0) account_.force_n.push_back(static_cast<float>(force_n));
  if (++periods_ % periods_per_sample_ == 0) take_sample(stage_->time_s() - begin_s_, force_n);
}

bool Soak::play_cell(const FaultCase& cell, SoakCell& result) {
  late_ns_ = 0;
  result.runs += 1;
  result.failures.clear();
  result.t_s = stage_->time_s() - begin_s_;
  const FaultCase played =
      settings_.probe == SoakProbe::kIgnoreFault ? FaultCase{cell.state, &faults().front()} : cell;
  FaultTrace trace;
  try {
    trace = play_fault(*stage_, played);
  } catch (const tools::InputError& error) {
    result.failures.emplace_back(error.what());
  }
  result.late_ns = late_ns_;
  rest_after(*stage_, played);
  // The device stands still while this is judged; nothing is armed now.
  if (result.failures.empty()) {
    result.t_s += static_cast<double>(trace.injected) * stage_->period_s();
    const FaultVerdict verdict =
        judge_fault(cell, std::move(trace), unharmed(cell.state), run_settings_);
    result.found = verdict.found;
    result.failures = verdict.failures;
  }
  if (threads_ != nullptr) threads_->restart();
  const bool was_spoiled = result.late_ns >= spoiled_ns();
  return result.failures.empty() || !was_spoiled || breaks_a_limit(result.found);
}

void Soak::play_slot(const FaultCase& cell, double end_s) {
  slot_heap_ = slot_resident_ = HUGE_VAL;
  SoakCell result;
  result.cell = cell;
  while (!play_cell(cell, result)) {
    account_.repeated += 1;
    if (result.runs == kMostRuns) {
      result.failures.emplace_back("the machine spoiled every run");
      break;
    }
  }
  for (const std::string& failure : result.failures)
    fail(std::string(cell.fault->name) + ", " + to_text(cell.state) + ": " + failure);
  account_.cells.push_back(std::move(result));
  hold_force(end_s);
  slots_.push_back({slot_heap_, slot_resident_, static_cast<double>(last_.descriptors),
                    static_cast<double>(last_.threads)});
  progress_(account_);
}

/// At least once, and again whenever the machine has taken it away.
void Soak::hold_force(double end_s) {
  do {
    late_ns_ = 0;
    take_force(*stage_);
    pass(kSettle);
    watch_hold(end_s);
    if (latched_ != 0) rest_after(*stage_, {});
  } while (stage_->time_s() - begin_s_ < end_s);
  take_sample(stage_->time_s() - begin_s_, static_cast<double>(account_.force_n.back()));
  if (threads_ != nullptr) threads_->restart();
  rest_after(*stage_, {});
}

/// Nothing fails here except what the machine does: nothing latches, and where every thread was
/// in time nobody allocates.
void Soak::watch_hold(double end_s) {
  const ThreadHeap before = threads_ != nullptr ? threads_->heap() : ThreadHeap{};
  while (stage_->time_s() - begin_s_ < end_s && latched_ == 0) pass(1);
  if (latched_ != 0) {
    if (late_ns_ < spoiled_ns()) {
      fail("between faults: latched " + safety_fault_names(latched_) + " without a cause");
    } else {
      account_.machine_faults += 1;
    }
    return;
  }
  if (threads_ == nullptr || late_ns_ >= spoiled_ns()) return;
  const ThreadHeap after = threads_->heap();
  account_.usb_heap_calls += after.usb_calls - before.usb_calls;
}

void Soak::judge_levels() {
  const std::size_t first = std::min(kWarmUpSlots, slots_.empty() ? 0 : slots_.size() - 1);
  const auto level = [&](double SlotLevels::*of, double tolerance) {
    SoakLevel result;
    if (slots_.empty()) return result;
    result.reference = result.least = result.largest = slots_[first].*of;
    result.tolerance = tolerance;
    for (std::size_t k = first; k < slots_.size(); ++k) {
      result.least = std::min(result.least, slots_[k].*of);
      result.largest = std::max(result.largest, slots_[k].*of);
    }
    return result;
  };
  account_.heap = level(&SlotLevels::heap, kHeapTolerance);
  account_.resident = level(&SlotLevels::resident, kResidentTolerance);
  account_.descriptors = level(&SlotLevels::descriptors, 0);
  account_.threads = level(&SlotLevels::threads, 0);
  // What is freed may be less than before; growth is what is wrong.
  if (account_.heap.largest > account_.heap.reference + kHeapTolerance)
    fail("the heap in use grows");
  if (account_.resident.largest > account_.resident.reference + kResidentTolerance)
    fail("the resident memory grows");
  if (!account_.descriptors.holds()) fail("the number of open descriptors changes");
  if (!account_.threads.holds()) fail("the number of threads changes");
  if (account_.servo_heap_calls != 0) fail("the servo thread allocates");
  if (account_.usb_heap_calls != 0) fail("the USB thread allocates apart from libusb");
}

SoakAccount Soak::run() {
  const auto slots = static_cast<std::size_t>(
      std::max(1.0, std::floor(60 * settings_.minutes / settings_.every_s)));
  for (const FaultState state : kStates) static_cast<void>(unharmed(state));
  static_cast<void>(unharmed(FaultState::kArmedContact));
  make_stage();
  periods_per_sample_ = static_cast<std::uint64_t>(std::llround(1.0 / stage_->period_s()));
  const auto seconds = static_cast<std::size_t>(60 * settings_.minutes);
  // All of a long run's records are made now, so that the heap stands still.
  account_.samples.reserve(4 * seconds + 4 * slots + 100);
  account_.cells.reserve(slots);
  slots_.reserve(slots);
  account_.force_n.reserve(4 * seconds * periods_per_sample_ / kForceEvery + 1000);
  warm_up();
  begin_s_ = stage_->time_s();
  const std::int64_t begin_ns = hal::monotonic_ns();
  stage_->watch([this](const FaultSample& sample) { sees(sample); });
  if (threads_ != nullptr) threads_->restart();
  const std::vector<FaultCase> plan = soak_plan(slots);
  for (std::size_t k = 0; k < slots; ++k)
    play_slot(plan[k], static_cast<double>(k + 1) * settings_.every_s);
  account_.wall_s = 1e-9 * static_cast<double>(hal::monotonic_ns() - begin_ns);
  if (threads_ != nullptr) {
    account_.servo_heap_calls = threads_->heap().servo_calls;
    account_.grants = threads_->grants();
    if (threads_->servo_error() != 0) fail("the servo loop ended");
  }
  judge_levels();
  stage_->watch({});
  stage_.reset();
  return std::move(account_);
}

}  // namespace

ProcessState process_state() {
  ProcessState state;
  std::FILE* file = std::fopen("/proc/self/status", "r");
  if (file == nullptr) throw std::runtime_error("/proc/self/status cannot be read");
  char line[256];
  while (std::fgets(line, sizeof line, file) != nullptr) {
    unsigned long value = 0;
    if (std::sscanf(line, "VmRSS: %lu kB", &value) == 1) state.resident_bytes = 1024ull * value;
    if (std::sscanf(line, "Threads: %lu", &value) == 1)
      state.threads = static_cast<unsigned>(value);
  }
  std::fclose(file);
  state.descriptors = open_descriptors();
#if defined(__GLIBC__) && __GLIBC_PREREQ(2, 33)
  const struct mallinfo2 heap = ::mallinfo2();
  state.heap_bytes = heap.uordblks + heap.hblkhd;
#endif
  return state;
}

std::vector<FaultCase> soak_plan(std::size_t count) {
  const std::span<const Fault> all = faults().subspan(1);  // the first is none
  std::vector<FaultCase> plan;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t turn = k / 2;
    // Where the pairs would come again, the states move on by one: all pairs are met.
    const std::size_t other = (turn + turn / std::lcm(all.size(), kStates.size())) % kStates.size();
    plan.push_back({k % 2 == 0 ? FaultState::kArmedContact : kStates[other],
                    &all[(turn + (k % 2 == 0 ? 0 : all.size() / 2)) % all.size()]});
  }
  return plan;
}

SoakAccount run_soak(std::span<const std::byte> scene, const FaultPlace& place,
                     const SoakSettings& settings,
                     const std::function<void(const SoakAccount&)>& progress) {
  return Soak(scene, place, settings, progress).run();
}

}  // namespace haptic::sim
