// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Counters of a link: counted on the USB thread, read from any.

#include <atomic>
#include <cstdint>

namespace haptic::hal {

/// Since the link was made, for reports.
struct LinkCounters {
  std::uint64_t reports = 0, states = 0, bad_length = 0, bad_check = 0, bad_number = 0,
                not_advancing = 0, sent = 0, send_busy = 0, send_failed = 0, in_failed = 0,
                answers_late = 0, connects = 0, disconnects = 0, guard_held = 0;
};

/// Each counter has one writer; readers see each of them whole, not all of one moment.
inline void count_one(std::uint64_t& counter) noexcept {
  std::atomic_ref<std::uint64_t>(counter).fetch_add(1, std::memory_order_relaxed);
}

[[nodiscard]] LinkCounters snapshot(LinkCounters& live) noexcept;

}  // namespace haptic::hal
