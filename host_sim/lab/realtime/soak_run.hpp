// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The stack kept running for long, with something going wrong every few seconds: cells of the
/// fault matrix one after another on the same stack, each judged as there, force taken again after
/// each, and what the process holds of the machine looked at every second.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/faults/fault_matrix.hpp"
#include "host_sim/lab/realtime/threaded_stage.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

// What this process holds of the machine: memory, heap, descriptors, threads.

struct ProcessState {
  std::uint64_t resident_bytes = 0;  ///< VmRSS, which the kernel counts in batches of pages
  std::uint64_t heap_bytes = 0;      ///< handed out by malloc and not yet freed; 0: not glibc's
  unsigned descriptors = 0;          ///< open
  unsigned threads = 0;
};

/// Of now. Takes some ten microseconds, and the locks of the heap for a part of them. @throws
/// std::runtime_error  there is no /proc.
[[nodiscard]] ProcessState process_state();

/// What is wrong with the soak itself: each must be found.
enum class SoakProbe : std::uint8_t { kNone = 0, kLeakMemory, kLeakDescriptor, kIgnoreFault };

struct SoakSettings {
  double minutes = 10, every_s = 5;
  bool virtual_time = false;  ///< one thread, as fast as it goes, the same bits each time
  SoakProbe probe = SoakProbe::kNone;
  std::uint64_t (*heap_calls)() = nullptr;  ///< of the calling thread so far; null: not counted
};

/// Every second of the device.
struct SoakSample {
  double t_s = 0;
  ProcessState process;
  double force_n = 0;        ///< acting on the hand
  std::int64_t late_ns = 0;  ///< largest lateness since the sample before
};

struct SoakCell {
  double t_s = 0;  ///< of the fault, device time
  FaultCase cell;
  unsigned runs = 0;         ///< until it could be judged
  std::int64_t late_ns = 0;  ///< largest in the run that was judged
  FaultFigures found;
  std::vector<std::string> failures;  ///< empty: answered as stated
};

/// A quantity that must stand still: the reference is that of the first slot after the warm-up.
struct SoakLevel {
  double reference = 0, least = 0, largest = 0, tolerance = 0;
  [[nodiscard]] bool holds() const {
    return least >= reference - tolerance && largest <= reference + tolerance;
  }
};

struct SoakAccount {
  std::vector<SoakSample> samples;
  std::vector<SoakCell> cells;
  std::vector<float> force_n;  ///< acting, every kForceEvery periods
  SoakLevel heap, resident, descriptors, threads;
  std::uint64_t servo_heap_calls = 0;
  std::int64_t usb_heap_calls = 0;   ///< beyond libusb's own, while reports flowed undisturbed
  std::uint64_t repeated = 0;        ///< runs of a cell that the machine spoiled
  std::uint64_t machine_faults = 0;  ///< latched by the machine's own lateness between cells
  std::int64_t largest_late_ns = 0;
  double wall_s = 0;
  LoopGrants grants;
  std::vector<std::string> failures;  ///< of all kinds, empty: the soak holds
};

/// Force is kept once in so many periods.
inline constexpr std::size_t kForceEvery = 20;
/// A run in which a thread was this late, in periods, need not show what the matrix states: a
/// command or report that comes this late is itself half of one that is missing.
inline constexpr double kSpoiledPeriods = 0.5;
/// The first slots are for memory to be touched and for all buses that are kept to be there.
inline constexpr std::size_t kWarmUpSlots = 3;

/// Cells that a running session can meet, in the order of a soak: in turn one in full contact and
/// one in another state. `count` of them, over again where there are not as many.
[[nodiscard]] std::vector<FaultCase> soak_plan(std::size_t count);

/// `progress` is called after each cell. @throws tools::InputError  the scene does not reach a
/// state; std::runtime_error  the operating system refused.
[[nodiscard]] SoakAccount run_soak(std::span<const std::byte> scene, const FaultPlace& place,
                                   const SoakSettings& settings,
                                   const std::function<void(const SoakAccount&)>& progress);

// A soak as files.

/// soak.csv (a line per second), soak_faults.csv (a line per fault), soak.json (the account),
/// soak.svg (force with the faults, memory, descriptors).
[[nodiscard]] std::vector<OutputText> soak_files(const std::string& scene,
                                                 const SoakSettings& settings,
                                                 const SoakAccount& account);

}  // namespace haptic::sim
