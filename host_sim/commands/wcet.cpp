// SPDX-License-Identifier: Apache-2.0
#include "host_sim/commands/wcet.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "host_sim/oracle/flat_pair.hpp"
#include "host_sim/report/tick_clock.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr double kApplicabilityTolerance_m =
    1e-9;  // of the exhaustive search; its value is not used for a check

/// Value at rank `share` (0 to 1) of an ascending list.
double rank(const std::vector<double>& sorted, double share) {
  const auto last = static_cast<double>(sorted.size() - 1);
  return sorted[static_cast<std::size_t>(std::ceil(share * last))];
}

double search_all(const SceneView& view, std::vector<FlatPair>& pairs, const Pose& pose) {
  const PlacedMoving moving = place_moving(view, pose);
  double least = std::numeric_limits<double>::infinity();
  for (FlatPair& pair : pairs) {
    pair.place(moving);
    least = std::min(least, pair.exhaustive_d_near_m(kApplicabilityTolerance_m));
  }
  return least;
}

}  // namespace

TimeFigures figures(std::vector<double> values) {
  TimeFigures f;
  f.count = values.size();
  if (values.empty()) return f;
  std::sort(values.begin(), values.end());
  f.median = rank(values, 0.5);
  f.p99 = rank(values, 0.99);
  f.p999 = rank(values, 0.999);
  f.largest = values.back();
  return f;
}

WcetResult measure(CoreSession& session, std::span<const MotionSample> motion,
                   std::uint32_t repeats) {
  if (motion.empty() || repeats == 0)
    throw tools::InputError("nothing to time: no ticks or no repeats");
  WcetResult result;
  result.repeats = repeats;
  const TickClock clock;
  result.clock_empty_ns = clock.empty_ns();
  std::vector<FlatPair> pairs;
  for (std::uint32_t k = 0; k < session.view().pairs().size(); ++k)
    pairs.emplace_back(session.view(), k);
  std::vector<std::byte> saved(session.state().size());
  std::vector<double> core, contact, free, exhaustive, noise, repeated(repeats);
  session.core().reset();
  volatile double sink = 0;
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const StepInput input = input_of(motion[i], i);
    std::memcpy(saved.data(), session.state().data(), saved.size());
    TickTime tick;
    StepResult step;
    for (std::uint32_t r = 0; r < repeats; ++r) {
      std::memcpy(session.state().data(), saved.data(), saved.size());
      const std::uint64_t begin = TickClock::now();
      step = session.core().step(input);
      const std::uint64_t end = TickClock::now();
      repeated[r] = clock.ns_between(begin, end);
    }
    tick.core_ns = *std::min_element(repeated.begin(), repeated.end());
    for (const double ns : repeated) noise.push_back(ns - tick.core_ns);
    tick.exhaustive_ns = std::numeric_limits<double>::infinity();
    for (std::uint32_t r = 0; r < repeats; ++r) {
      const std::uint64_t begin = TickClock::now();
      sink = search_all(session.view(), pairs, input.pose_wa);
      const std::uint64_t end = TickClock::now();
      tick.exhaustive_ns = std::min(tick.exhaustive_ns, clock.ns_between(begin, end));
    }
    tick.contact = step.status == RtStatus::kOk && step.d_near_m <= 0;
    tick.relocalised = step.counters.stale_pairs > 0;
    core.push_back(tick.core_ns);
    (tick.contact ? contact : free).push_back(tick.core_ns);
    exhaustive.push_back(tick.exhaustive_ns);
    result.ticks.push_back(tick);
  }
  static_cast<void>(sink);
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
  return result;
}

}  // namespace haptic::sim
