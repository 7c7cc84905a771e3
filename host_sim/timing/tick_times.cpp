// SPDX-License-Identifier: Apache-2.0
#include "host_sim/timing/tick_times.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host_sim/report/quantile.hpp"
#include "host_sim/session/counters_check.hpp"
#include "host_sim/session/tick_clock.hpp"
#include "tools/c_space/flat_pair.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {

using tools::FlatPair;
using tools::place_moving;
using tools::PlacedMoving;
namespace {

constexpr double kApplicabilityTolerance_m =
    1e-9;  // of the exhaustive search; its value is not used for a check

double search_all(const SceneView& view, std::vector<FlatPair>& pairs, const Pose& pose) {
  const PlacedMoving moving = place_moving(view, pose);
  double least = std::numeric_limits<double>::infinity();
  for (FlatPair& pair : pairs) {
    pair.place(moving);
    least = std::min(least, pair.exhaustive_d_near_m(kApplicabilityTolerance_m));
  }
  return least;
}

/// The largest time over work. A tick with little work costs its fixed part, which says nothing
/// about a unit.
double dearest_unit(const std::vector<double>& times, const std::vector<std::uint64_t>& work) {
  const std::uint64_t most = *std::max_element(work.begin(), work.end());
  double dearest = 0;
  for (std::size_t k = 0; k < work.size(); ++k) {
    if (work[k] > 0 && 2 * work[k] >= most)
      dearest = std::max(dearest, times[k] / static_cast<double>(work[k]));
  }
  return dearest;
}

/// Every kStaleStride-th pose as a first tick.
constexpr std::size_t kStaleStride = 10;

template <typename TimeCore>
void measure_stale(CoreSession& session, std::size_t ticks, std::uint32_t repeats,
                   const TimeCore& time_core, WcetResult& result) {
  std::vector<double> times;
  std::vector<std::uint64_t> work;
  for (std::size_t i = 0; i < ticks; i += kStaleStride) {
    double least = std::numeric_limits<double>::infinity();
    StepResult step;
    for (std::uint32_t r = 0; r < repeats; ++r) {
      session.reset();
      least = std::min(least, time_core(i, step));
    }
    times.push_back(least);
    work.push_back(work_units(step.counters));
    raise_peaks(step.counters, result.peaks);
  }
  result.dearest_unit_ns = dearest_unit(times, work);
  result.stale = figures(std::move(times));
}

}  // namespace

TimeFigures figures(std::vector<double> values) {
  TimeFigures f;
  f.count = values.size();
  if (values.empty()) return f;
  std::sort(values.begin(), values.end());
  f.median = quantile(values, 0.5);
  f.p99 = quantile(values, 0.99);
  f.p999 = quantile(values, 0.999);
  f.largest = values.back();
  return f;
}

WcetResult measure(CoreSession& session, std::span<const MotionSample> motion,
                   std::uint32_t repeats, bool exhaustive_too, GoalContact goal) {
  if (motion.empty() || repeats == 0)
    throw tools::InputError("nothing to time: no ticks or no repeats");
  WcetResult result;
  result.repeats = repeats;
  const TickClock clock;
  result.clock_empty_ns = clock.empty_ns();
  std::vector<FlatPair> pairs;
  // A scene that lists no pairs has too many to search, or surfaces, which have no depth.
  exhaustive_too = exhaustive_too && session.view().lists_pairs();
  for (std::uint32_t k = 0; exhaustive_too && k < session.view().pair_count(); ++k)
    pairs.emplace_back(session.view(), k);
  const auto time_core = [&](std::size_t i, StepResult& step) {
    const StepInput input = input_of(motion[i], i, goal);
    return clock.ns_of([&] { step = session.step(input); });
  };
  measure_stale(session, motion.size(), repeats, time_core, result);
  std::vector<double> core, contact, free, exhaustive, noise;
  std::vector<std::vector<double>> repeated(repeats, std::vector<double>(motion.size()));
  result.ticks.resize(motion.size());
  for (std::uint32_t r = 0; r < repeats; ++r) {
    session.reset();
    for (std::size_t i = 0; i < motion.size(); ++i) {
      StepResult step;
      repeated[r][i] = time_core(i, step);
      result.ticks[i].contact = step.situation != ContactSituation::kNone;
      result.ticks[i].relocalised = step.counters.stale_pairs > 0;
      result.ticks[i].situation = step.situation;
      result.ticks[i].flags = step.flags;
      result.ticks[i].counters = step.counters;
    }
  }
  raise_peaks(session.core().peaks(), result.peaks);
  session.reset();
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const StepResult step = session.step(input_of(motion[i], i, GoalContact::kAsked));
    result.ticks[i].d_near_m = static_cast<double>(step.d_near_m);
  }
  raise_peaks(session.core().peaks(), result.peaks);
  volatile double sink = 0;
  for (std::size_t i = 0; i < motion.size(); ++i) {
    TickTime& tick = result.ticks[i];
    tick.core_ns = std::numeric_limits<double>::infinity();
    for (const auto& run : repeated) tick.core_ns = std::min(tick.core_ns, run[i]);
    for (const auto& run : repeated) {
      result.raw_ns.push_back(run[i]);
      noise.push_back(run[i] - tick.core_ns);
    }
    core.push_back(tick.core_ns);
    (tick.contact ? contact : free).push_back(tick.core_ns);
    if (!exhaustive_too) continue;
    const Pose pose = pose_of(motion[i]);
    tick.exhaustive_ns = std::numeric_limits<double>::infinity();
    for (std::uint32_t r = 0; r < repeats; ++r) {
      const double ns = clock.ns_of([&] { sink = search_all(session.view(), pairs, pose); });
      tick.exhaustive_ns = std::min(tick.exhaustive_ns, ns);
    }
    exhaustive.push_back(tick.exhaustive_ns);
  }
  static_cast<void>(sink);
  std::vector<std::uint64_t> proxy_work;
  for (const TickTime& tick : result.ticks) proxy_work.push_back(proxy_units(tick.counters));
  result.dearest_proxy_unit_ns = dearest_unit(core, proxy_work);
  result.first_tick_ns = core.front();
  if (core.size() > 1) {
    result.worst_tick =
        static_cast<std::size_t>(std::max_element(core.begin() + 1, core.end()) - core.begin());
  }
  result.core_after_first = figures({core.begin() + 1, core.end()});
  result.core = figures(std::move(core));
  result.core_contact = figures(std::move(contact));
  result.core_free = figures(std::move(free));
  result.exhaustive = figures(std::move(exhaustive));
  result.noise = figures(std::move(noise));
  result.raw = figures(result.raw_ns);
  return result;
}

}  // namespace haptic::sim
