// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Shared by the fuzz targets of the carrier's halves: wild bytes over a half, and a look at the
/// descriptors that a run leaves open.

#include <sys/mman.h>
#include <unistd.h>

#include <cstring>
#include <string>

#include "hal/local/carrier_memory.hpp"
#include "tests/fuzz/report_stream.hpp"

namespace haptic::fuzz {

/// The half that the other side writes, mapped by who misuses it.
class WildHalf {
 public:
  explicit WildHalf(int descriptor)
      : half_(static_cast<hal::CarrierHalf*>(mmap(nullptr, sizeof(hal::CarrierHalf),
                                                  PROT_READ | PROT_WRITE, MAP_SHARED, descriptor,
                                                  0))) {
    require(half_ != MAP_FAILED, "the half of its own can be written");
  }
  ~WildHalf() { munmap(half_, sizeof(hal::CarrierHalf)); }
  WildHalf(const WildHalf&) = delete;
  WildHalf& operator=(const WildHalf&) = delete;

  /// As memory that nobody has written to.
  void clear() { std::memset(static_cast<void*>(half_), 0, sizeof(hal::CarrierHalf)); }
  /// As the protocol has it, with any bytes, any size and any time.
  void publish(ReportStream& input, std::int64_t stamp_ns) {
    hal::CarriedBytes wild;
    const std::uint8_t kind = input.byte();
    wild.stamp_ns = stamp_ns;
    wild.size = kind % 8 == 0 ? number(input) : kind;
    wild.bytes = input.bytes<hal::kMaxReportBytes>();
    publish(wild);
  }
  /// The next number after the one that is there, also where that was scribbled.
  void publish(const hal::CarriedBytes& wild) {
    hal::CarrierHalf& half = *half_;
    RecordWord stamp = half.newest.load() + 1;
    if (stamp == hal::CarrierHalf::Record::kNoStamp) ++stamp;
    half.ring[hal::CarrierHalf::slot_of(stamp)].record.write(
        stamp, std::bit_cast<hal::CarrierHalf::Words>(wild));
    half.newest.store(stamp);
  }
  /// Bytes anywhere in it; every eighth time over all of it.
  void scribble(ReportStream& input) {
    auto* const bytes = reinterpret_cast<std::uint8_t*>(half_);
    const std::uint8_t kind = input.byte();
    if (kind % 8 == 0) std::memset(bytes, input.byte(), sizeof(hal::CarrierHalf));
    for (int k = 0; k < kind % 8; ++k)
      bytes[number(input) % sizeof(hal::CarrierHalf)] = input.byte();
  }

 private:
  static std::uint32_t number(ReportStream& input) {
    const auto b = input.bytes<4>();
    return std::uint32_t{b[0]} | std::uint32_t{b[1]} << 8 | std::uint32_t{b[2]} << 16 |
           std::uint32_t{b[3]} << 24;
  }
  hal::CarrierHalf* half_;
};

/// The lowest number that a new descriptor gets: equal before and after a run that leaves none.
[[nodiscard]] inline int lowest_descriptor() {
  const int next = dup(STDERR_FILENO);
  close(next);
  return next;
}

/// A socket of this process, for a target that is run once at a time.
[[nodiscard]] inline std::string carrier_path() {
  return "/tmp/haptic_fuzz_" + std::to_string(getpid()) + ".sock";
}

}  // namespace haptic::fuzz
