// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Time that a computation took of a processor: what others do on the machine does not count.

#include <ctime>

namespace haptic::sim {

/// Of the calling thread, in s.
[[nodiscard]] inline double thread_processor_s() {
  timespec now{};
  static_cast<void>(::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now));
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Of the whole process, in s.
[[nodiscard]] inline double process_processor_s() {
  timespec now{};
  static_cast<void>(::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now));
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace haptic::sim
