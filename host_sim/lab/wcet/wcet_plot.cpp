// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/wcet/wcet_plot.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "host_sim/report/picture.hpp"

namespace haptic::sim {
namespace {

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

}  // namespace

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

}  // namespace haptic::sim
