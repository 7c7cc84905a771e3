// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Between the device and its bus: turns each report into what really goes out in that period,
/// which may be nothing, several, or damaged bytes.

#include <cstdint>
#include <span>
#include <vector>

#include "host_sim/device/device_fault.hpp"

namespace haptic::sim {

/// Owner: one thread. The result depends on the events and on the reports alone.
class ReportFaultFilter {
 public:
  /// For kinds of reports; others are ignored. Event times must not lie in the past.
  void add(const DeviceFaultEvent& event);

  /// `period` counts from 1 and grows by one with each call.
  [[nodiscard]] std::vector<std::vector<std::uint8_t>> pass(std::uint64_t period,
                                                            std::span<const std::uint8_t> report);

 private:
  using Bytes = std::vector<std::uint8_t>;
  struct Entry {
    DeviceFaultEvent event;
    Bytes held;
  };
  void damage(const Entry& entry, std::uint64_t period, Bytes& bytes) const;
  void freeze(Bytes& bytes);
  static void delay(Entry& entry, std::uint64_t since, std::vector<Bytes>& sent);
  static void reorder(Entry& entry, std::uint64_t since, std::vector<Bytes>& sent);

  std::vector<Entry> entries_;
  std::uint32_t sequence_ = 0;  ///< of the last report that was not frozen
};

}  // namespace haptic::sim
