// SPDX-License-Identifier: Apache-2.0
/// Any bytes as the log of another program, after one byte for the options: read as a motion that
/// can be resampled and judged; or refused with the file, and a line where one is wrong.
#include <cmath>

#include "host_sim/motion_log/log_judgement.hpp"
#include "host_sim/motion_log/motion_log.hpp"
#include "host_sim/motion_log/resampled.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tools/common/error.hpp"

namespace {

using haptic::fuzz::MemoryFile;
using haptic::fuzz::require;
using haptic::sim::LogOptions;
using haptic::sim::MotionLog;
using haptic::sim::MotionSample;

constexpr double kMostResampled = 4096;

LogOptions options_of(std::uint8_t bits, const std::string& path) {
  LogOptions options;
  options.path = path;
  if ((bits & 1U) != 0) options.order = haptic::sim::QuaternionOrder::kXyzw;
  if ((bits & 2U) != 0) options.key = "state";
  if ((bits & 4U) != 0) options.unit_m = 1e-3;
  if ((bits & 8U) != 0) options.rows_hz = 100;
  if ((bits & 16U) != 0) options.columns = {"t", "x", "y", "z", "qw", "qx", "qy", "qz"};
  if ((bits & 32U) != 0) options.columns = {"x=a", "t=stamp"};
  return options;
}

void check_samples(const std::vector<MotionSample>& samples) {
  for (std::size_t k = 0; k < samples.size(); ++k) {
    double square = 0;
    for (const double x : samples[k].q_wxyz) square += x * x;
    require(std::abs(square - 1) < 1e-9, "quaternions have length 1");
    for (const double x : samples[k].p) require(std::isfinite(x), "positions are finite");
    require(std::isfinite(samples[k].t_s), "times are finite");
    require(k == 0 || samples[k].t_s > samples[k - 1].t_s, "times increase");
  }
}

void check_log(MotionLog log) {
  require(log.samples.size() >= 2, "a log has two samples");
  require(log.samples.size() == log.lines.size(), "each sample has its line");
  require(log.samples.front().t_s == 0, "times begin at 0");
  check_samples(log.samples);
  const auto figures = haptic::sim::log_figures(log);
  for (const std::string& text : haptic::sim::log_warnings(log, figures, std::nullopt))
    require(!text.empty(), "a warning says something");
  (void)haptic::sim::order_warning(log, std::nullopt);
  if (haptic::sim::resampled_count(log.samples, 1000) > kMostResampled) return;
  const std::vector<MotionSample> even = haptic::sim::resampled(log.samples, 1000);
  require(!even.empty(), "a motion has a sample");
  check_samples(even);
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static MemoryFile file;
  file.set({reinterpret_cast<const char*>(data + 1), size - 1});
  try {
    check_log(haptic::sim::read_motion_log(options_of(data[0], file.path())));
  } catch (const haptic::tools::InputError& error) {
    require(haptic::fuzz::names_place(error.what(), file.path(), 1) ||
                haptic::fuzz::names_place(error.what(), file.path(), 0),
            "a refusal begins with the file, and a line where one is wrong");
  } catch (const haptic::tools::UsageError&) {
    require(data[0] != 0, "without options none is wrong");
  }
  return 0;
}
