// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The status lines of a run, dated by this machine's clock: what run_device states of the force
/// can then be laid beside what the device had.

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

namespace haptic::sim {

struct StatedForce {
  std::int64_t stamp_ns = 0;
  double force_n = 0;
};

/// Owner: one thread, which is not the one that it makes.
class StatusTail {
 public:
  StatusTail() = default;
  ~StatusTail() { (void)end(); }
  StatusTail(const StatusTail&) = delete;
  StatusTail& operator=(const StatusTail&) = delete;

  /// Reads `file` as it grows.
  void begin(const std::string& file);
  /// All so far; ends it. A line counts its seconds from a begin that is the run's own: the line
  /// that was read soonest after it was made says when that was.
  [[nodiscard]] std::vector<StatedForce> end();

 private:
  void follow(const std::string& file);

  struct Line {
    std::int64_t read_ns = 0;
    double t_s = 0, force_n = 0;
  };
  std::vector<Line> lines_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace haptic::sim
