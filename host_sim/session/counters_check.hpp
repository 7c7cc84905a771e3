// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Counted work of ticks against the bounds in the scene's header. Exact, the same on every
/// machine: this is what may fail a check; times are not.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rt_core/haptic_core.hpp"

namespace haptic::sim {

/// A counter of the core, the most that was seen of it in one tick, and what one tick may do.
struct CounterBound {
  const char* name;   ///< of the header's field, without "max_"
  const char* words;  ///< for people
  std::uint32_t peak = 0, bound = 0;
  bool proxy_only = false;  ///< counts nothing under the other laws

  [[nodiscard]] bool held() const { return peak <= bound; }
};

/// Every counter that has a bound in the header.
[[nodiscard]] std::vector<CounterBound> counter_bounds(const StepCounters& peaks,
                                                       const SceneCapacity& capacity);
[[nodiscard]] bool all_held(const std::vector<CounterBound>& bounds);

/// A copy of the header's bounds with one of them 0, for a check that must fail. `name` as in
/// CounterBound. @throws tools::InputError: no such bound.
[[nodiscard]] SceneCapacity damaged_bounds(const SceneCapacity& capacity, std::string_view name);

/// Counted work of the contact search in a tick: pair visits, faces and edges, pairs of edges,
/// support pairs, near nodes. The proxy's is counted in units of its own, proxy_units.
[[nodiscard]] std::uint64_t work_units(const StepCounters& counters);
/// The most work that a tick of this scene can do, by the bounds in its header.
[[nodiscard]] std::uint64_t work_bound(const SceneCapacity& capacity);
/// Counted work of the proxy in a tick: gaps along planes, nodes of valid sets, what its searches
/// without history evaluate, quadratic programs and all their iterations. 0 under other laws. Such
/// a unit and one of the contact search do not cost the same; their sums are never added.
[[nodiscard]] std::uint64_t proxy_units(const StepCounters& counters);
/// The most of it that a tick of this scene can do, by the bounds in its header.
[[nodiscard]] std::uint64_t proxy_bound(const SceneCapacity& capacity);
/// True if every peak is within its bound in the header.
[[nodiscard]] bool within_bounds(const StepCounters& peaks, const SceneCapacity& capacity);

/// One line per counter: peak, bound, and in capitals where it is exceeded.
[[nodiscard]] std::string counters_text(const std::vector<CounterBound>& bounds, bool proxy);

}  // namespace haptic::sim
