// SPDX-License-Identifier: Apache-2.0
#include "host_sim/timing/same_state_times.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>
#include <set>
#include <string>

#include "host_sim/session/counters_check.hpp"
#include "host_sim/session/tick_clock.hpp"
#include "host_sim/timing/cache_flush.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

/// The core's state as it was before a tick.
class Snapshot {
 public:
  explicit Snapshot(CoreSession& session) : session_(session), bytes_(session.state().size()) {}
  void take() { std::memcpy(bytes_.data(), session_.state().data(), bytes_.size()); }
  void restore() { std::memcpy(session_.state().data(), bytes_.data(), bytes_.size()); }

 private:
  CoreSession& session_;
  std::vector<std::byte> bytes_;
};

struct Raw {
  std::vector<double> warm, flushed;
};

class Repeater {
 public:
  Repeater(CoreSession& session, std::uint32_t repeats)
      : session_(session),
        snapshot_(session),
        flush_({session.view().blob(), session.state()}),
        repeats_(repeats) {}

  [[nodiscard]] std::size_t flushed_bytes() const { return flush_.byte_count(); }

  /// Repeats one tick from the state as it is, and leaves the state after it.
  SameStateTick run(const StepInput& input, std::size_t tick, Raw& raw, bool& same_result) {
    snapshot_.take();
    const std::uint64_t hash = session_.step(input).state_hash;  // warms
    SameStateTick result{tick, std::numeric_limits<double>::infinity(),
                         std::numeric_limits<double>::infinity()};
    for (std::uint32_t r = 0; r < repeats_; ++r) {
      snapshot_.restore();
      raw.warm.push_back(time(input, hash, same_result));
      result.warm_ns = std::min(result.warm_ns, raw.warm.back());
    }
    for (std::uint32_t r = 0; r < repeats_; ++r) {
      snapshot_.restore();
      flush_.run();
      raw.flushed.push_back(time(input, hash, same_result));
      result.flushed_ns = std::min(result.flushed_ns, raw.flushed.back());
    }
    return result;
  }

 private:
  double time(const StepInput& input, std::uint64_t hash, bool& same_result) {
    StepResult step;
    const double ns = clock_.ns_of([&] { step = session_.step(input); });
    same_result = same_result && step.state_hash == hash;
    return ns;
  }

  CoreSession& session_;
  Snapshot snapshot_;
  CacheFlush flush_;
  TickClock clock_;
  std::uint32_t repeats_;
};

}  // namespace

SameStateTimes same_state_times(CoreSession& session, std::span<const MotionSample> motion,
                                std::span<const std::size_t> chosen, std::uint32_t repeats,
                                GoalContact goal) {
  if (repeats < kLeastRepeats) {
    throw tools::InputError("the least of " + std::to_string(repeats) +
                            " repeats is still noise; take " + std::to_string(kLeastRepeats));
  }
  if (chosen.empty() || chosen.back() >= motion.size())
    throw tools::InputError("no ticks to repeat, or ticks that the motion does not have");
  SameStateTimes times;
  times.repeats = repeats;
  Repeater repeater(session, repeats);
  times.flushed_bytes = repeater.flushed_bytes();
  Raw raw;
  std::vector<double> warm, flushed;
  session.reset();
  std::size_t next = 0;
  for (std::size_t i = 0; i <= chosen.back(); ++i) {
    const StepInput input = input_of(motion[i], i, goal);
    if (chosen[next] != i) {
      static_cast<void>(session.step(input));
      continue;
    }
    ++next;
    times.ticks.push_back(repeater.run(input, i, raw, times.same_result));
    warm.push_back(times.ticks.back().warm_ns);
    flushed.push_back(times.ticks.back().flushed_ns);
  }
  const auto largest = [&](const std::vector<double>& values) {
    const auto at = std::ranges::max_element(values) - values.begin();
    return times.ticks[static_cast<std::size_t>(at)].tick;
  };
  times.worst_warm = largest(warm);
  times.worst_flushed = largest(flushed);
  times.warm = figures(std::move(warm));
  times.flushed = figures(std::move(flushed));
  times.warm_raw = figures(std::move(raw.warm));
  times.flushed_raw = figures(std::move(raw.flushed));
  return times;
}

std::vector<std::size_t> telling_ticks(const WcetResult& times, std::size_t most) {
  const std::size_t count = times.ticks.size();
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (count <= most) return order;
  std::set<std::size_t> chosen{0};
  const auto add_leading = [&](const auto& rank_of) {
    std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
      return rank_of(times.ticks[a]) > rank_of(times.ticks[b]);
    });
    chosen.insert(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(most / 4));
  };
  add_leading([](const TickTime& t) { return t.core_ns; });
  add_leading([](const TickTime& t) { return work_units(t.counters); });
  const std::size_t evenly = most - std::min(most, chosen.size());
  for (std::size_t k = 0; k < evenly; ++k) chosen.insert(k * count / evenly);
  return {chosen.begin(), chosen.end()};
}

}  // namespace haptic::sim
