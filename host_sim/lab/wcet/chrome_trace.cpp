// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/wcet/chrome_trace.hpp"

#include <nlohmann/json.hpp>

#include "host_sim/session/counters_check.hpp"
#include "host_sim/session/replay_summary.hpp"

namespace haptic::sim {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kProcess = 1, kThread = 1;

Json name_event(const char* kind, const std::string& name) {
  return {
      {"name", kind}, {"ph", "M"}, {"pid", kProcess}, {"tid", kThread}, {"args", {{"name", name}}}};
}

std::string flag_names(std::uint32_t flags) {
  std::string names;
  for (std::size_t bit = 0; bit < kFlagCount; ++bit) {
    if ((flags >> bit & 1u) != 0)
      names += (names.empty() ? "" : ", ") + std::string(flag_name(bit));
  }
  return names;
}

Json arguments(const TickTime& t, std::size_t tick) {
  const StepCounters& c = t.counters;
  return {{"tick", tick},
          {"d_near_m", t.d_near_m},
          {"situation", to_text(t.situation)},
          {"flags", flag_names(t.flags)},
          {"work_units", work_units(c)},
          {"pair_visits", c.pair_visits},
          {"support_pairs", c.support_pairs},
          {"feature_evaluations", c.feature_evaluations},
          {"edge_pairs", c.edge_pairs},
          {"near_nodes", c.near_nodes},
          {"stale_pairs", c.stale_pairs},
          {"proxy_passes", c.proxy_passes},
          {"plane_gaps", c.plane_gaps},
          {"valid_nodes", c.valid_nodes},
          {"full_searches", c.full_searches},
          {"proxy_units", proxy_units(c)},
          {"qp_steps", c.qp_steps}};
}

}  // namespace

std::string chrome_trace(std::span<const TickTime> ticks, std::span<const MotionSample> motion,
                         const std::string& scene) {
  Json events = Json::array();
  events.push_back(name_event("process_name", "servo ticks of " + scene));
  events.push_back(name_event("thread_name", "HapticCore::step"));
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const TickTime& t = ticks[i];
    events.push_back({{"name", t.contact ? "tick in contact" : "tick"},
                      {"cat", "tick"},
                      {"ph", "X"},
                      {"ts", 1e6 * motion[i].t_s},
                      {"dur", 1e-3 * t.core_ns},
                      {"pid", kProcess},
                      {"tid", kThread},
                      {"args", arguments(t, i)}});
  }
  Json trace;
  trace["displayTimeUnit"] = "ns";
  trace["traceEvents"] = std::move(events);
  // A name may hold bytes that are no UTF-8.
  return trace.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace haptic::sim
