// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/cost/cost_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "host_sim/report/picture.hpp"
#include "host_sim/report/quantile.hpp"
#include "host_sim/timing/tick_times.hpp"

namespace haptic::sim {
namespace {

using tools::append_line;
using CostJson = nlohmann::ordered_json;

/// Of the functions of a scene, those with the largest own share go into the JSON file.
constexpr std::size_t kJsonFunctions = 16;

bool finite_tick(const CostTick& tick) {
  const auto all = [](const auto& values) {
    return std::ranges::all_of(values, [](double v) { return std::isfinite(v); });
  };
  return all(tick.force_n) && all(tick.torque_nm) && all(tick.proxy_m) && all(tick.proxy_wxyz);
}

// The picture: one curve per scene over a logarithmic axis, in two panels.

/// Okabe and Ito's colours without yellow, which is too light for a curve, and grey; dashes keep
/// neighbours apart where curves cross.
struct CurveStyle {
  const char* colour;
  const char* dashes;
};
constexpr CurveStyle kStyles[] = {{"#000000", ""}, {"#0072b2", ""},   {"#d55e00", ""},
                                  {"#009e73", ""}, {"#cc79a7", ""},   {"#e69f00", ""},
                                  {"#56b4e9", ""}, {"#7f7f7f", "6 4"}};
constexpr double kWidth = 1060, kHeight = 860, kLeft = 90, kTop = 80, kPlotWidth = 720,
                 kPlotHeight = 320, kBelow = 90;

struct EcdfCurve {
  std::string name;
  std::vector<double> ascending;  ///< all positive
};

/// Values of a curve, ascending; nothing below 1, where the axis would have no end.
EcdfCurve curve_of(const CostRun& run, bool counted) {
  EcdfCurve curve{run.name, {}};
  for (const CostTick& tick : run.ticks) {
    const double value = counted ? static_cast<double>(tick.instructions) : tick.time_ns;
    curve.ascending.push_back(std::max(value, 1.0));
  }
  std::ranges::sort(curve.ascending);
  return curve;
}

/// What a panel shows over the value of a tick.
enum class ShareShown {
  kAtMost,  ///< share of the ticks with at most that much, linear from 0
  kMore     ///< share with more, logarithmic: the few largest ticks
};

double height_of(const LogPanel& panel, ShareShown shown, double share) {
  return shown == ShareShown::kAtMost ? panel.top + panel.height * (1 - share)
                                      : panel.y_of(1 - share);
}

/// The steps of a curve, those narrower than a third of a pixel left out. No tick has more than the
/// last, which a logarithmic axis cannot show: there the curve ends before it falls.
std::vector<Pixel> share_points(const LogPanel& panel, ShareShown shown,
                                const std::vector<double>& ascending) {
  const auto count = static_cast<double>(ascending.size());
  std::vector<Pixel> points{{panel.x_of(ascending.front()), height_of(panel, shown, 0)}};
  for (std::size_t i = 0; i < ascending.size(); ++i) {
    const bool last = i + 1 == ascending.size();
    const double x = panel.x_of(ascending[i]), before = points.back().y;
    const double y = last && shown == ShareShown::kMore
                         ? before
                         : height_of(panel, shown, static_cast<double>(i + 1) / count);
    if (!last && x - points.back().x < 0.33 && std::abs(before - y) < 0.33) continue;
    points.push_back({x, before});
    points.push_back({x, y});
  }
  return points;
}

/// A number of instructions or a time: "98.3 k", "4.54 M"; "17.2 us".
std::string amount_text(double value, bool counted) {
  if (!counted && value >= 999.5e3) return tools::short_number(value / 1e6, 3) + " ms";
  if (!counted) return tools::short_number(value / 1e3, 3) + " us";
  if (value >= 999.5e6) return tools::short_number(value / 1e9, 3) + " G";
  if (value >= 999.5e3) return tools::short_number(value / 1e6, 3) + " M";
  if (value >= 999.5) return tools::short_number(value / 1e3, 3) + " k";
  return tools::short_number(value, 3);
}

std::string share_frame(const LogPanel& panel, ShareShown shown, bool counted) {
  const double bottom = panel.top + panel.height, right = panel.left + panel.width;
  std::string svg;
  for (double power = panel.x_low; power <= panel.x_high * 1.001; power *= 10) {
    const double x = panel.x_of(power);
    for (int k = 2; k < 10 && power * k < panel.x_high; ++k)
      svg +=
          line_at({panel.x_of(power * k), panel.top}, {panel.x_of(power * k), bottom}, "#eeeeee");
    svg += line_at({x, panel.top}, {x, bottom}, "#c8c8c8");
    svg += text_at(x, bottom + 18, counted ? amount_text(power, true) : time_label(power), "middle",
                   12);
  }
  std::vector<double> shares{0, 0.25, 0.5, 0.75, 1};
  if (shown == ShareShown::kMore) {
    shares.clear();
    for (double more = 1; more >= 0.999 * panel.y_low; more /= 10) shares.push_back(1 - more);
  }
  for (const double share : shares) {
    const double y = height_of(panel, shown, share);
    const double percent = 100 * (shown == ShareShown::kMore ? 1 - share : share);
    svg += line_at({panel.left, y}, {right, y}, "#c8c8c8");
    svg += text_at(panel.left - 8, y + 4, tools::short_number(percent, 3) + " %", "end", 12);
  }
  svg += rectangle_at({panel.left, panel.top}, panel.width, panel.height, "none",
                      "stroke=\"#404040\"");
  svg += text_at(panel.left + panel.width / 2, bottom + 40,
                 counted ? "instructions of one tick" : "time of one tick", "middle", 13);
  return svg + text_at(panel.left, panel.top - 10,
                       shown == ShareShown::kMore ? "share of the ticks above this value"
                                                  : "share of the ticks up to this value",
                       "start", 13);
}

std::string share_panel(const LogPanel& panel, ShareShown shown, bool counted,
                        const std::vector<EcdfCurve>& curves) {
  std::string svg = share_frame(panel, shown, counted);
  for (std::size_t k = 0; k < curves.size(); ++k) {
    const CurveStyle& style = kStyles[k % std::size(kStyles)];
    const std::vector<Pixel> points = share_points(panel, shown, curves[k].ascending);
    svg += polyline_of(points, style.colour, 2, style.dashes);
    svg += mark_at(points.back().x, points.back().y, {style.colour, 'o'});
  }
  return svg;
}

CostJson instruction_json(const CostRun& run, const CostFigures& f) {
  CostJson json;
  json["measured"] = run.instructions.measured;
  if (!run.instructions.measured) {
    json["why_not"] = run.instructions.why_not;
    return json;
  }
  json["mean"] = f.mean_instructions;
  json["p50"] = f.p50_instructions;
  json["p99"] = f.p99_instructions;
  json["largest"] = f.most_instructions;
  const auto list = [](const std::vector<FunctionCost>& functions) {
    CostJson all = CostJson::array();
    for (std::size_t k = 0; k < std::min(kJsonFunctions, functions.size()); ++k) {
      const FunctionCost& each = functions[k];
      all.push_back({{"name", each.name}, {"self", each.self}, {"with_calls", each.inclusive}});
    }
    return all;
  };
  json["functions_of_all_ticks"] = list(run.instructions.profile.whole);
  json["functions_of_largest_tick"] = list(run.instructions.profile.dearest);
  return json;
}

CostJson scene_json(const CostRun& run) {
  const CostFigures f = figures_of(run);
  CostJson json;
  json["scene"] = run.name;
  json["is"] = run.words;
  json["pairs"] = run.pairs;
  json["ticks"] = run.ticks.size();
  json["contact_ticks"] = f.contact_ticks;
  json["state_bytes"] = run.state_bytes;
  json["blob_bytes"] = run.blob_bytes;
  json["instructions"] = instruction_json(run, f);
  json["time_us"] = {{"median", f.median_us}, {"p99", f.p99_us}, {"largest", f.largest_us}};
  json["cold_us"] = {{"ticks", f.cold_ticks},
                     {"warm_median", f.same_warm_median_us},
                     {"median", f.cold_median_us},
                     {"largest", f.cold_largest_us},
                     {"largest_tick", f.cold_largest_tick}};
  json["work"] = {{"largest", f.most_work}, {"bound", f.work_bound}};
  json["least_gap_m"] = f.least_gap_m;
  CostJson& largest = json["largest_tick"];
  largest["tick"] = f.largest_tick;
  largest["t_s"] = run.ticks[f.largest_tick].t_s;
  for (const CounterBound& c : counter_bounds(run.ticks[f.largest_tick].counters, run.capacity))
    largest["counters"][c.name] = c.peak;
  for (const CounterBound& b : f.bounds) {
    json["counters"][b.name] = {{"largest", b.peak}, {"bound", b.bound}, {"held", b.held()}};
  }
  json["passed"] = f.passed();
  return json;
}

CostJson difference_json(const CostDifference& d) {
  const auto figures_json = [](const DifferenceFigures& f) {
    return CostJson{{"largest", f.largest}, {"p99", f.p99}};
  };
  CostJson json;
  json["scene"] = d.scene;
  json["missing"] = d.missing;
  json["ticks"] = d.ticks;
  json["differing"] = d.differing;
  json["force_n"] = figures_json(d.force_n);
  json["torque_nm"] = figures_json(d.torque_nm);
  json["proxy_m"] = figures_json(d.proxy_m);
  json["proxy_rad"] = figures_json(d.proxy_rad);
  return json;
}

}  // namespace

CostFigures figures_of(const CostRun& run) {
  CostFigures f;
  f.work_bound = proxy_bound(run.capacity);
  StepCounters peaks;
  std::vector<std::uint64_t> counts;
  std::vector<double> times_us;
  std::uint64_t most = 0;
  f.least_gap_m = run.ticks.front().gap_m;
  for (std::size_t i = 0; i < run.ticks.size(); ++i) {
    const CostTick& tick = run.ticks[i];
    raise_peaks(tick.counters, peaks);
    counts.push_back(tick.instructions);
    times_us.push_back(1e-3 * tick.time_ns);
    const std::uint64_t work = proxy_units(tick.counters);
    f.most_work = std::max(f.most_work, work);
    f.contact_ticks += tick.situation != ContactSituation::kNone ? 1u : 0u;
    f.not_finite += finite_tick(tick) ? 0u : 1u;
    f.least_gap_m = std::min(f.least_gap_m, tick.gap_m);
    const std::uint64_t size = run.instructions.measured ? tick.instructions : work;
    if (size > most) f.largest_tick = i;
    most = std::max(most, size);
  }
  f.bounds = counter_bounds(peaks, run.capacity);
  const TimeFigures times = figures(std::move(times_us));
  f.median_us = times.median;
  f.p99_us = times.p99;
  f.largest_us = times.largest;
  f.cold_ticks = run.cold.ticks.size();
  f.same_warm_median_us = 1e-3 * run.cold.warm.median;
  f.cold_median_us = 1e-3 * run.cold.flushed.median;
  f.cold_largest_us = 1e-3 * run.cold.flushed.largest;
  f.cold_largest_tick = run.cold.worst_flushed;
  f.same_result = run.cold.same_result;
  if (!run.instructions.measured) return f;
  std::ranges::sort(counts);
  f.mean_instructions =
      std::accumulate(counts.begin(), counts.end(), 0.0) / static_cast<double>(counts.size());
  f.p50_instructions = quantile(counts, 0.5);
  f.p99_instructions = quantile(counts, 0.99);
  f.most_instructions = counts.back();
  return f;
}

std::string cost_ticks_csv(const CostRun& run) {
  std::string columns = "tick,t_s,instructions,state,flags,status";
  for (const CounterBound& c : counter_bounds({}, run.capacity))
    columns += "," + std::string(c.name);
  columns += ",fx_n,fy_n,fz_n,tx_nm,ty_nm,tz_nm,px_m,py_m,pz_m,qw,qx,qy,qz,gap_m";
  ReportTable table(columns);
  for (std::size_t i = 0; i < run.ticks.size(); ++i) {
    const CostTick& tick = run.ticks[i];
    std::vector<Cell> row{i,
                          shown_as("%.6f", tick.t_s),
                          run.instructions.measured ? Cell(tick.instructions) : Cell(),
                          to_text(tick.situation),
                          tick.flags,
                          to_text(tick.status)};
    for (const CounterBound& c : counter_bounds(tick.counters, run.capacity)) row.push_back(c.peak);
    for (const double v : tick.force_n) row.push_back(v);
    for (const double v : tick.torque_nm) row.push_back(v);
    for (const double v : tick.proxy_m) row.push_back(v);
    for (const double v : tick.proxy_wxyz) row.push_back(v);
    row.push_back(tick.gap_m);
    table.add(std::move(row));
  }
  return table.csv();
}

std::string cost_csv(std::span<const CostRun> runs) {
  std::string columns =
      "scene,pairs,ticks,contact_ticks,instructions_mean,instructions_p50,instructions_p99,"
      "instructions_largest,time_median_us,time_p99_us,time_largest_us,cold_ticks,"
      "cold_warm_median_us,cold_median_us,cold_largest_us,cold_largest_tick,state_bytes,blob_bytes,"
      "work_largest,work_bound,bound_over_largest,least_gap_m,largest_tick";
  for (const CounterBound& c : counter_bounds({}, SceneCapacity{}))
    columns += ",largest_tick_" + std::string(c.name);
  ReportTable table(columns);
  for (const CostRun& run : runs) {
    const CostFigures f = figures_of(run);
    const bool counted = run.instructions.measured;
    std::vector<Cell> row{run.name,
                          run.pairs,
                          run.ticks.size(),
                          f.contact_ticks,
                          counted ? shown_as("%.1f", f.mean_instructions) : Cell(),
                          counted ? Cell(f.p50_instructions) : Cell(),
                          counted ? Cell(f.p99_instructions) : Cell(),
                          counted ? Cell(f.most_instructions) : Cell(),
                          shown_as("%.3f", f.median_us),
                          shown_as("%.3f", f.p99_us),
                          shown_as("%.3f", f.largest_us),
                          f.cold_ticks,
                          shown_as("%.3f", f.same_warm_median_us),
                          shown_as("%.3f", f.cold_median_us),
                          shown_as("%.3f", f.cold_largest_us),
                          f.cold_largest_tick,
                          run.state_bytes,
                          run.blob_bytes,
                          f.most_work,
                          f.work_bound,
                          f.most_work > 0 ? shown_as("%.1f", static_cast<double>(f.work_bound) /
                                                                 static_cast<double>(f.most_work))
                                          : Cell(),
                          shown_as("%.3g", f.least_gap_m),
                          f.largest_tick};
    for (const CounterBound& c : counter_bounds(run.ticks[f.largest_tick].counters, run.capacity))
      row.push_back(c.peak);
    table.add(std::move(row));
  }
  return table.csv();
}

std::string cost_json(std::span<const CostRun> runs, std::span<const CostDifference> differences) {
  CostJson json;
  json["scenes"] = CostJson::array();
  for (const CostRun& run : runs) json["scenes"].push_back(scene_json(run));
  if (!differences.empty()) json["comparison"] = CostJson::array();
  for (const CostDifference& d : differences) json["comparison"].push_back(difference_json(d));
  return json.dump(2, ' ', false, CostJson::error_handler_t::replace) + "\n";
}

std::string cost_picture(std::span<const CostRun> runs) {
  const bool counted =
      std::ranges::all_of(runs, [](const CostRun& run) { return run.instructions.measured; });
  std::vector<EcdfCurve> curves;
  double low = 1e300, high = 0;
  std::size_t ticks = 0;
  for (const CostRun& run : runs) {
    curves.push_back(curve_of(run, counted));
    low = std::min(low, curves.back().ascending.front());
    high = std::max(high, curves.back().ascending.back());
    ticks = std::max(ticks, run.ticks.size());
  }
  LogPanel panel{kLeft, kTop, kPlotWidth, kPlotHeight, 1, 10, 1, 1};
  panel.x_low = std::pow(10.0, std::floor(std::log10(low)));
  panel.x_high = std::pow(10.0, std::ceil(std::log10(high * 1.001)));
  panel.y_low = std::pow(10.0, std::floor(-std::log10(static_cast<double>(ticks) * 1.001)));
  std::string svg = heading_at(kLeft, 32, "Work of a tick");
  svg += share_panel(panel, ShareShown::kAtMost, counted, curves);
  panel.top += kPlotHeight + kBelow;
  svg += share_panel(panel, ShareShown::kMore, counted, curves);
  double y = kTop + 10;
  for (std::size_t k = 0; k < curves.size(); ++k) {
    const CurveStyle& style = kStyles[k % std::size(kStyles)];
    const std::vector<double>& v = curves[k].ascending;
    svg += legend_entry(kLeft + kPlotWidth + 16, y, style.colour, curves[k].name, 3, style.dashes);
    svg += text_at(kLeft + kPlotWidth + 46, y + 20,
                   "p99 " + amount_text(quantile(v, 0.99), counted) + ", largest " +
                       amount_text(v.back(), counted),
                   "start", 11, "fill=\"#505050\"");
    y += 44;
  }
  return svg_document(kWidth, kHeight, svg);
}

std::string cost_table(std::span<const CostRun> runs) {
  std::string text;
  append_line(text, "instructions per tick inside HapticCore::step, exact; least time of the runs");
  append_line(text, "  %-10s %7s %6s %8s %9s %9s %9s %10s %8s %8s %8s", "scene", "pairs", "ticks",
              "contact", "mean", "p50", "p99", "largest", "p50 us", "p99 us", "most us");
  const auto whole = [](std::uint64_t n) { return std::to_string(n); };
  for (const CostRun& run : runs) {
    const CostFigures f = figures_of(run);
    const bool counted = run.instructions.measured;
    const auto count = [&](std::uint64_t n) { return counted ? whole(n) : std::string("-"); };
    append_line(text, "  %-10s %7llu %6zu %8zu %9s %9s %9s %10s %8.2f %8.2f %8.2f",
                run.name.c_str(), static_cast<unsigned long long>(run.pairs), run.ticks.size(),
                f.contact_ticks,
                count(static_cast<std::uint64_t>(std::llround(f.mean_instructions))).c_str(),
                count(f.p50_instructions).c_str(), count(f.p99_instructions).c_str(),
                count(f.most_instructions).c_str(), f.median_us, f.p99_us, f.largest_us);
  }
  append_line(text, "time from the same state in us, least of 7: warm, and caches flushed (cold)");
  append_line(text, "  %-10s %7s %9s %9s %7s %9s %7s", "scene", "ticks", "warm p50", "cold p50",
              "ratio", "cold most", "tick");
  for (const CostRun& run : runs) {
    const CostFigures f = figures_of(run);
    append_line(text, "  %-10s %7zu %9.2f %9.2f %7.1f %9.2f %7zu%s", run.name.c_str(), f.cold_ticks,
                f.same_warm_median_us, f.cold_median_us,
                f.same_warm_median_us > 0 ? f.cold_median_us / f.same_warm_median_us : 0.0,
                f.cold_largest_us, f.cold_largest_tick,
                f.same_result ? "" : "  REPEATS OF A TICK ENDED IN DIFFERENT STATES");
  }
  append_line(text,
              "memory, the proxy's work against its bound in the header, and the largest tick");
  append_line(text, "  %-10s %11s %9s %8s %10s %7s %7s %8s %9s %7s %8s %8s %7s", "scene", "state B",
              "scene B", "work", "bound", "ratio", "tick", "gaps", "nodes", "full", "searched",
              "programs", "steps");
  for (const CostRun& run : runs) {
    const CostFigures f = figures_of(run);
    const StepCounters& c = run.ticks[f.largest_tick].counters;
    append_line(text, "  %-10s %11s %9s %8s %10s %7.1f %7zu %8u %9u %7u %8u %8u %7u",
                run.name.c_str(), whole(run.state_bytes).c_str(), whole(run.blob_bytes).c_str(),
                whole(f.most_work).c_str(), whole(f.work_bound).c_str(),
                static_cast<double>(f.work_bound) /
                    static_cast<double>(std::max<std::uint64_t>(f.most_work, 1)),
                f.largest_tick, c.plane_gaps, c.valid_nodes, c.full_searches, c.search_work,
                c.qp_programs, c.qp_steps);
    if (!run.instructions.measured)
      append_line(text, "    instructions: %s", run.instructions.why_not.c_str());
    if (f.not_finite > 0) append_line(text, "    RESULT NOT FINITE in %zu ticks", f.not_finite);
    for (const CounterBound& b : f.bounds) {
      if (!b.held()) append_line(text, "    OVER ITS BOUND: %s, %u > %u", b.words, b.peak, b.bound);
    }
  }
  return text;
}

}  // namespace haptic::sim
