// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/wcet/wcet_report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "hal/realtime/wakeup_measurement.hpp"
#include "host_sim/lab/wcet/chrome_trace.hpp"
#include "host_sim/lab/wcet/core_stack.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"
#include "host_sim/timing/same_state_times.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {

namespace {

// The histograms of a worst-case test: time per tick and, apart from it, wake-ups of the machine.

constexpr double kWidth = 1200, kHeight = 800, kLeft = 90, kPlotWidth = 900;
constexpr double kBinsPerPower = 20;
constexpr double kFloor = 0.5;  // where a count of 0 is drawn

/// Counts over bins of equal width in the logarithm of time, from `low_ns` on.
struct Bins {
  double low_ns = 1;
  std::vector<double> counts;

  Bins(double low, double high)
      : low_ns(low),
        counts(static_cast<std::size_t>(std::ceil(kBinsPerPower * std::log10(high / low))), 0.0) {}
  void add(double ns, double count = 1) {
    const double at = kBinsPerPower * std::log10(std::max(ns, low_ns) / low_ns);
    counts[std::min(static_cast<std::size_t>(at), counts.size() - 1)] += count;
  }
  [[nodiscard]] double edge_ns(std::size_t bin) const {
    return low_ns * std::pow(10.0, static_cast<double>(bin) / kBinsPerPower);
  }
};

struct Series {
  const char* name;
  const char* colour;
  double width;
  Bins bins;
};

std::string steps(const LogPanel& panel, const Series& series) {
  std::vector<Pixel> points;
  const Bins& b = series.bins;
  for (std::size_t k = 0; k < b.counts.size(); ++k) {
    const double y = panel.y_of(std::max(b.counts[k], kFloor));
    points.push_back({panel.x_of(b.edge_ns(k)), y});
    points.push_back({panel.x_of(b.edge_ns(k + 1)), y});
  }
  return polyline_of(points, series.colour, series.width);
}

double power_below(double value) { return std::pow(10.0, std::floor(std::log10(value))); }
double power_above(double value) { return std::pow(10.0, std::ceil(std::log10(value * 1.001))); }

std::string panel_of(double top, double height, const std::string& title,
                     const std::string& x_label, double low_ns, double high_ns,
                     const std::vector<Series>& list) {
  double most = 1;
  for (const Series& s : list) most = std::max(most, *std::ranges::max_element(s.bins.counts));
  const LogPanel panel{kLeft, top, kPlotWidth, height, low_ns, high_ns, kFloor, power_above(most)};
  std::string svg = log_panel_frame(panel, title, x_label, "count", 0);
  for (double count = 1; count <= panel.y_high * 1.001; count *= 10) {
    const auto words = std::to_string(static_cast<long long>(std::llround(count)));
    svg += text_at(panel.left - 6, panel.y_of(count) + 4, words, "end", 12);
  }
  double y = top + 16;
  for (const Series& s : list) {
    svg += steps(panel, s) + legend_entry(kLeft + kPlotWidth + 14, y, s.colour, s.name);
    y += 20;
  }
  return svg;
}

std::string ticks_panel(const WcetResult& loop, const SameStateTimes& same_state) {
  double low = std::max(1.0, loop.core.median), high = low;
  const auto widen = [&](double ns) {
    low = std::min(low, std::max(ns, 1.0));
    high = std::max(high, ns);
  };
  for (const double ns : loop.raw_ns) widen(ns);
  for (const SameStateTick& t : same_state.ticks) widen(t.warm_ns), widen(t.flushed_ns);
  low = power_below(low);
  high = power_above(high);
  std::vector<Series> list{{"every repeat, raw", "#b0b0b0", 3.0, Bins(low, high)},
                           {"in the loop, least", "#0072b2", 1.8, Bins(low, high)},
                           {"flushed, least", "#d55e00", 1.8, Bins(low, high)}};
  for (const double ns : loop.raw_ns) list[0].bins.add(ns);
  for (const TickTime& t : loop.ticks) list[1].bins.add(t.core_ns);
  for (const SameStateTick& t : same_state.ticks) list[2].bins.add(t.flushed_ns);
  return panel_of(90, 270, "the code: one tick", "time of one tick", low, high, list);
}

std::string wakeups_panel(const hal::WakeupMeasurement& wakeups) {
  const hal::WakeupHistogram& h = wakeups.lateness;
  const double low = 1000;  // below, the histogram tells nothing apart
  const double high =
      power_above(std::max(1e5, static_cast<double>(std::max<std::int64_t>(h.largest_ns(), 1))));
  std::vector<Series> list{{"wake-up, lateness", "#009e73", 1.8, Bins(low, high)}};
  for (std::size_t us = 0; us < hal::WakeupHistogram::kBins; ++us) {
    if (h.bin(us) > 0)
      list[0].bins.add(1000.0 * (static_cast<double>(us) + 0.5), static_cast<double>(h.bin(us)));
  }
  if (h.overflows() > 0)
    list[0].bins.add(static_cast<double>(h.largest_ns()), static_cast<double>(h.overflows()));
  return panel_of(450, 270, "the machine: wake-up of a thread that does nothing",
                  "time after the deadline", low, high, list);
}

/// An SVG with two panels, counts and times logarithmic, twenty bins per power of ten: above the
/// least times of the ticks, in the loop and with flushed caches, and all repeats as they were;
/// below how late the machine woke a thread.
std::string wcet_plot(const WcetResult& loop, const SameStateTimes& same_state,
                      const hal::WakeupMeasurement& wakeups, const std::string& title) {
  std::string svg = heading_at(kLeft, 30, title);
  char words[200];
  std::snprintf(words, sizeof words,
                "largest of the least of %u repeats: %.0f ns in the loop (%zu inputs), %.0f ns "
                "flushed (%zu inputs)",
                loop.repeats, loop.core.largest, loop.core.count, same_state.flushed.largest,
                same_state.flushed.count);
  svg += text_at(kLeft, 52, words, "start", 13, "fill=\"#505050\"");
  svg += ticks_panel(loop, same_state);
  if (wakeups.lateness.count() > 0) svg += wakeups_panel(wakeups);
  return svg_document(kWidth, kHeight, svg);
}

using Json = nlohmann::ordered_json;

Json json_of(const TimeFigures& f) {
  return {{"count", f.count},
          {"median", f.median},
          {"p99", f.p99},
          {"p99.9", f.p999},
          {"largest", f.largest}};
}

Json json_of(const hal::WakeupMeasurement& m) {
  const hal::WakeupHistogram& h = m.lateness;
  return {{"count", h.count()},
          {"error", m.error},
          {"fifo_priority", m.priority},
          {"memory_locked", m.memory_locked},
          {"idle_states_held", m.idle_states_held},
          {"p50_ns", h.quantile_ns(0.5)},
          {"p99_ns", h.quantile_ns(0.99)},
          {"p99.9_ns", h.quantile_ns(0.999)},
          {"largest_ns", h.largest_ns()},
          {"periods_late", m.late_ticks}};
}

Json json_of(const AdversarialFinding& f, std::uint64_t seed) {
  return {{"goal", to_text(f.goal)},
          {"value", f.value},
          {"unit", unit_of(f.goal)},
          {"tick", f.tick},
          {"evaluations", f.evaluations},
          {"restarts", f.restarts},
          {"spring_part", f.cause.spring},
          {"damping_part", f.cause.damping},
          {"goal_moved_m", f.cause.goal_m},
          {"proxy_moved_m", f.cause.proxy_m},
          {"wrenches_not_finite", f.not_finite},
          {"final_state_hash", tools::hash_text(f.state_hash)},
          {"motion", motion_file_name(f, seed)}};
}

Json json_of(const std::vector<FunctionCost>& functions) {
  Json list = Json::array();
  for (const FunctionCost& f : functions)
    list.push_back({{"function", f.name}, {"self", f.self}, {"inclusive", f.inclusive}});
  return list;
}

Json json_of(const InstructionCounts& counts) {
  if (!counts.measured) return {{"measured", false}, {"why_not", counts.why_not}};
  const CallgrindProfile& p = counts.profile;
  return {{"measured", true},
          {"method", "callgrind"},
          {"ticks", p.per_tick.size()},
          {"median", counts.median},
          {"largest", counts.largest},
          {"dearest_tick", p.dearest_tick},
          {"total", p.total},
          {"by_function", json_of(p.whole)},
          {"by_function_of_dearest_tick", json_of(p.dearest)}};
}

Json json_of(const StackDepth& depth) {
  Json chain = Json::array();
  for (const StackFrame& frame : depth.chain)
    chain.push_back({{"function", frame.function}, {"bytes", frame.bytes}});
  return {{"bytes", depth.bytes}, {"chain", std::move(chain)}};
}

Json json_of(const CoreStack& stack) {
  if (!stack.measured) return {{"measured", false}, {"why_not", stack.why_not}};
  return {{"measured", true},
          {"limit_bytes", stack.limit_bytes},
          {"tick", json_of(stack.tick)},
          {"servo_tick", json_of(stack.core)}};
}

InstructionCounts counted(CoreSession& session, std::span<const MotionSample> motion,
                          InstructionQuestion question, GoalContact goal) {
  if (!question.program.empty()) {
    question.state_hash = run_once(session, motion, goal);
    question.ticks = motion.size();
  }
  return count_instructions(question);
}

hal::WakeupQuestion question_of(const SceneView& view, double seconds) {
  hal::WakeupQuestion question;
  question.period_ns = std::llround(1e9 / view.parameters().rate_hz);
  question.duration_ns = std::llround(1e9 * seconds);
  return question;
}

}  // namespace

bool WcetReport::passed() const {
  const bool finite =
      std::ranges::all_of(findings, [](const AdversarialFinding& f) { return f.not_finite == 0; });
  return all_held(bounds) && finite && same_state.same_result;
}

std::string motion_file_name(const AdversarialFinding& finding, std::uint64_t seed) {
  return "adversarial_" + std::string(to_text(finding.goal)) + "_seed" + std::to_string(seed) +
         ".csv";
}

WcetReport measure_wcet(CoreSession& session, std::span<const MotionSample> motion,
                        const WcetPlan& plan) {
  const SceneView& view = session.view();
  SceneCapacity capacity = view.header().capacity;
  if (!plan.fault.empty()) capacity = damaged_bounds(capacity, plan.fault);
  WcetReport report;
  report.plan = plan;
  report.loop = measure(session, motion, plan.repeats, plan.exhaustive, plan.goal);
  report.same_state =
      same_state_times(session, motion, telling_ticks(report.loop, plan.most_same_state),
                       std::max(plan.repeats, kLeastRepeats), plan.goal);
  report.instructions = counted(session, motion, plan.instructions, plan.goal);
  report.findings = adversarial_search(session, motion, plan.adversarial);
  StepCounters peaks = report.loop.peaks;
  for (const AdversarialFinding& f : report.findings) raise_peaks(f.peaks, peaks);
  report.bounds = counter_bounds(peaks, capacity);
  report.work_bound = work_bound(capacity);
  report.proxy_bound = proxy_bound(capacity);
  report.wakeups = std::make_unique<hal::WakeupMeasurement>();
  if (plan.wakeup_seconds > 0)
    hal::measure_wakeups(question_of(view, plan.wakeup_seconds), *report.wakeups);
  return report;
}

std::string wcet_csv(const WcetReport& report, std::span<const MotionSample> motion) {
  std::map<std::size_t, SameStateTick> same;
  for (const SameStateTick& t : report.same_state.ticks) same[t.tick] = t;
  ReportTable table(
      "tick,t_s,core_ns,exhaustive_ns,contact,relocalised,work,warm_ns,flushed_ns,proxy_work,"
      "instructions");
  const auto ns = [](double value) { return shown_as("%.1f", value); };
  for (std::size_t i = 0; i < report.loop.ticks.size(); ++i) {
    const TickTime& t = report.loop.ticks[i];
    const auto at = same.find(i);
    const bool repeated = at != same.end();
    table.add(
        {i, shown_as("%.6f", motion[i].t_s), ns(t.core_ns),
         report.plan.exhaustive ? ns(t.exhaustive_ns) : Cell(), t.contact ? 1 : 0,
         t.relocalised ? 1 : 0, work_units(t.counters), repeated ? ns(at->second.warm_ns) : Cell(),
         repeated ? ns(at->second.flushed_ns) : Cell(), proxy_units(t.counters),
         report.instructions.measured ? Cell(report.instructions.profile.per_tick[i]) : Cell()});
  }
  return table.csv();
}

std::string wcet_json(const WcetReport& r) {
  Json json;
  json["scene"] = r.plan.scene;
  json["motion"] = r.plan.motion;
  json["seed"] = r.plan.adversarial.seed;
  json["passed"] = r.passed();
  for (const CounterBound& b : r.bounds) {
    json["counters"][b.name] = {{"largest", b.peak}, {"bound", b.bound}, {"held", b.held()}};
  }
  json["work_bound"] = r.work_bound;
  json["dearest_unit_ns"] = r.loop.dearest_unit_ns;
  json["proxy_work_bound"] = r.proxy_bound;
  json["dearest_proxy_unit_ns"] = r.loop.dearest_proxy_unit_ns;
  json["instructions"] = json_of(r.instructions);
  json["stack"] = json_of(core_stack());
  Json& time = json["wall_time_ns"];
  time["repeats"] = r.loop.repeats;
  time["in_loop"] = json_of(r.loop.core);
  time["every_bound_stale"] = json_of(r.loop.stale);
  if (r.plan.exhaustive) time["exhaustive_search"] = json_of(r.loop.exhaustive);
  time["warm"] = json_of(r.same_state.warm);
  time["flushed"] = json_of(r.same_state.flushed);
  time["worst_tick_warm"] = r.same_state.worst_warm;
  time["worst_tick_flushed"] = r.same_state.worst_flushed;
  time["repeats_gave_same_result"] = r.same_state.same_result;
  Json& noise = json["machine_noise_ns"];
  noise["in_loop_raw"] = json_of(r.loop.raw);
  noise["warm_raw"] = json_of(r.same_state.warm_raw);
  noise["flushed_raw"] = json_of(r.same_state.flushed_raw);
  noise["repeat_less_the_least"] = json_of(r.loop.noise);
  if (r.plan.wakeup_seconds > 0) json["machine_wakeups"] = json_of(*r.wakeups);
  json["adversarial"] = Json::array();
  for (const AdversarialFinding& f : r.findings)
    json["adversarial"].push_back(json_of(f, r.plan.adversarial.seed));
  // A name may hold bytes that are no UTF-8.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void write_wcet(const std::string& folder, const WcetReport& report,
                std::span<const MotionSample> motion) {
  const std::string base = folder + "/";
  write_whole_file(base + "wcet.csv", wcet_csv(report, motion));
  write_whole_file(base + "wcet.json", wcet_json(report));
  write_whole_file(base + "trace.json", chrome_trace(report.loop.ticks, motion, report.plan.scene));
  const std::string title = "Worst case of " + report.plan.scene;
  write_whole_file(base + "wcet.svg",
                   wcet_plot(report.loop, report.same_state, *report.wakeups, title));
  if (report.wakeups->lateness.count() > 0)
    write_whole_file(base + "wakeups.txt", hal::cyclictest_text(report.wakeups->lateness));
  for (const AdversarialFinding& f : report.findings)
    write_motion_csv(base + motion_file_name(f, report.plan.adversarial.seed), f.motion);
}

}  // namespace haptic::sim
