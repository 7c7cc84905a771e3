// SPDX-License-Identifier: Apache-2.0
#include "host_sim/motion_log/log_clock.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

struct TimeUnit {
  const char* name;
  const char* words;
  double seconds;
};
constexpr std::array<TimeUnit, 4> kUnits = {{{"s", "seconds", 1},
                                             {"ms", "milliseconds", 1e-3},
                                             {"us", "microseconds", 1e-6},
                                             {"ns", "nanoseconds", 1e-9}}};
// Between the fastest servo loop and the slowest recorder.
constexpr double kLeastStep_s = 20e-6, kMostStep_s = 0.5;
// Range of seconds since 1970, from 1973 on, in which an instant is recognised by its size.
constexpr double kLeastEpoch_s = 1e8, kMostEpoch_s = 1e11;

bool plausible(double step_s) { return step_s >= kLeastStep_s && step_s <= kMostStep_s; }

const TimeUnit* epoch_unit(double first) {
  for (const TimeUnit& unit : kUnits) {
    const double seconds = first * unit.seconds;
    if (seconds >= kLeastEpoch_s && seconds < kMostEpoch_s) return &unit;
  }
  return nullptr;
}

double median_step(std::span<const LogTime> times) {
  std::vector<double> steps;
  for (std::size_t k = 1; k < times.size(); ++k)
    steps.push_back(difference(times[k], times[k - 1]));
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

void require_increase(const std::string& path, std::span<const LogTime> times,
                      std::span<const std::size_t> lines) {
  for (std::size_t k = 1; k < times.size(); ++k) {
    const double step = difference(times[k], times[k - 1]);
    if (step > 0) continue;
    throw tools::InputError(
        path + ":" + std::to_string(lines[k]) +
        (step < 0 ? ": the time runs backwards, from that of line " + std::to_string(lines[k - 1]) +
                        "; sort the samples, or cut the log where it starts again"
                  : ": the time is that of line " + std::to_string(lines[k - 1]) +
                        "; drop one of the two samples"));
  }
}

[[noreturn]] void refuse_step(const std::string& path, double step, const TimeUnit& assumed) {
  std::string others;
  for (const TimeUnit& unit : kUnits) {
    if (plausible(step * unit.seconds))
      others += (others.empty() ? "--time-unit " : " or ") + std::string(unit.name);
  }
  throw tools::InputError(
      path + ": has a sample every " + tools::short_number(step * assumed.seconds, 4) +
      " s with times in " + assumed.words + "; say " +
      (others.empty()
           ? "--time-unit " + std::string(assumed.name) + " where that is right, or another unit"
           : others + ", or " + assumed.name + " where that is right"));
}

}  // namespace

LogClock clock_of(const std::string& path, std::span<const LogTime> times,
                  std::span<const std::size_t> lines, const LogColumns& columns,
                  const LogOptions& options) {
  LogClock clock;
  if (times.empty()) return clock;
  require_increase(path, times, lines);
  double seconds = 1;
  if (options.time_unit_s) {
    seconds = *options.time_unit_s;
    clock.text = "unit as --time-unit says";
  } else if (columns.time_unit_s) {
    seconds = *columns.time_unit_s;
    clock.text = "unit as the name says";
  } else {
    const double first = static_cast<double>(times.front().whole) + times.front().part;
    const TimeUnit* const epoch = epoch_unit(first);
    const TimeUnit& unit = epoch != nullptr ? *epoch : kUnits.front();
    seconds = unit.seconds;
    clock.text = unit.words + std::string(epoch != nullptr ? " since 1970, by their size" : "");
    if (times.size() > 1) {
      const double step = median_step(times);
      if (!plausible(step * seconds)) refuse_step(path, step, unit);
    }
  }
  clock.t_s.reserve(times.size());
  for (const LogTime& time : times) clock.t_s.push_back(seconds * difference(time, times.front()));
  for (std::size_t k = 1; k < clock.t_s.size(); ++k) {
    if (clock.t_s[k] > clock.t_s[k - 1]) continue;
    throw tools::InputError(path + ":" + std::to_string(lines[k]) +
                            ": the time does not increase by what a double holds; drop the sample");
  }
  return clock;
}

}  // namespace haptic::sim
