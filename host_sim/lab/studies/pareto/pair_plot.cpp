// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/pareto/pair_plot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace haptic::sim {
namespace {

constexpr double kErrorFloor_m = 1e-18;  // errors below, zero among them, are drawn here

/// Methods of the result except for the empty one, each once, in order; ours last, hence on top.
std::vector<std::string> drawn_methods(std::span<const PairMeasure> pairs) {
  std::vector<std::string> names;
  for (const PairMeasure& pair : pairs) {
    for (const MethodMeasure& m : pair.methods) {
      if (m.method != "empty" && std::find(names.begin(), names.end(), m.method) == names.end())
        names.push_back(m.method);
    }
  }
  const auto ours = std::find(names.begin(), names.end(), "ours");
  if (ours != names.end()) std::rotate(ours, ours + 1, names.end());
  return names;
}

/// The method's row in contact in its own setting; null when there is none.
const ParetoRow* contact_row(const MethodMeasure& m) {
  for (const ParetoRow& row : m.result.rows) {
    if (row.setting == m.setting && row.state == to_text(PairState::kContact)) return &row;
  }
  return nullptr;
}

double largest_error_m(const ParetoRow& row) {
  return std::fmax(row.max_error_m, row.max_error_deep_m);  // NaN when both are
}

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = 0;

  void add(double value) {
    if (!(value > 0)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  /// Out to the powers of ten; one decade at least.
  void widen_to_decades() {
    if (!(high > 0)) low = high = 1;
    low = std::pow(10.0, std::floor(std::log10(low)));
    high = std::pow(10.0, std::ceil(std::log10(high)));
    if (high <= low) high = 10 * low;
  }
};

std::string error_time_panel(const PairMeasure& pair, const LogPanel& panel) {
  std::string lines, marks;
  for (const std::string& method : drawn_methods({&pair, 1})) {
    std::vector<Pixel> points;
    for (const MethodMeasure& m : pair.methods) {
      const ParetoRow* row = m.method == method ? contact_row(m) : nullptr;
      if (row == nullptr || std::isnan(largest_error_m(*row))) continue;
      const double x = panel.x_of(row->median_ns), y = panel.y_of(largest_error_m(*row));
      points.push_back({x, y});
      marks += mark_at(x, y, sign_of(method));
    }
    if (points.size() > 1) lines += polyline_of(points, sign_of(method).colour, 1.2);
  }
  return lines + marks;
}

/// Share of the poses that take at least as long, against time: steps as a staircase of corners.
std::string latency_curve(const std::vector<double>& ascending_ns, const LogPanel& panel,
                          const MarkSign& sign) {
  const auto count = static_cast<double>(ascending_ns.size());
  std::vector<Pixel> points;
  double last_x = -1;
  for (std::size_t k = 0; k < ascending_ns.size(); ++k) {
    const double x = panel.x_of(ascending_ns[k]);
    if (k + 1 < ascending_ns.size() && x - last_x < 0.5) continue;  // one point per pixel or so
    last_x = x;
    points.push_back({x, panel.y_of((count - static_cast<double>(k)) / count)});
  }
  std::string svg = polyline_of(points, sign.colour, 1.8);
  if (!points.empty()) svg += mark_at(points.back().x, points.back().y, sign);
  return svg;
}

const PairMeasure* pair_named(const ParetoResult& result, const std::string& name) {
  for (const PairMeasure& pair : result.pairs) {
    if (pair.name == name) return &pair;
  }
  return nullptr;
}

std::string share_label(int power) {
  constexpr const char* kNames[] = {"all", "10 %", "1 %", "0.1 %", "0.01 %"};
  return kNames[std::clamp(-power, 0, 4)];
}

/// Sign and name of each method in one line from `x` on.
std::string legend_line(double x, double y, const std::vector<std::string>& methods) {
  constexpr double kLetter = 7.6, kGap = 34;  // pixels at the size of the words
  std::string svg;
  for (const std::string& method : methods) {
    svg += mark_at(x, y - 4, sign_of(method)) + text_at(x + 12, y, method, "start", 13);
    x += kGap + kLetter * static_cast<double>(method.size());
  }
  return svg;
}

}  // namespace

MarkSign sign_of(std::string_view method) {
  struct Entry {
    std::string_view method;
    MarkSign sign;
  };
  // Colours of Okabe and Ito, as in the other pictures; shapes for prints without colour.
  constexpr Entry kSigns[] = {
      {"exhaustive", {"#000000", 's'}},    {"ours", {"#d55e00", 'o'}},
      {"paper_literal", {"#999999", 'd'}}, {"libccd_mpr", {"#56b4e9", 't'}},
      {"libccd_epa", {"#0072b2", 'v'}},    {"fcl", {"#009e73", 'x'}},
      {"bullet_epa", {"#cc79a7", 'd'}},    {"ode_boxbox", {"#b8a000", '+'}}};
  for (const Entry& entry : kSigns) {
    if (entry.method == method) return entry.sign;
  }
  return {"#606060", 'o'};
}

std::string error_time_plot(const ParetoResult& result) {
  constexpr double kLeft = 84, kTop = 96, kWidth = 330, kHeight = 270, kRowStep = 350;
  constexpr double kColumnStep = 405;
  std::string svg;
  for (std::size_t k = 0; k < result.pairs.size(); ++k) {
    const PairMeasure& pair = result.pairs[k];
    Range time;
    for (const MethodMeasure& m : pair.methods) {
      const ParetoRow* row = m.method == "empty" ? nullptr : contact_row(m);
      if (row != nullptr) time.add(row->median_ns);
    }
    time.widen_to_decades();
    const LogPanel panel{kLeft + kColumnStep * static_cast<double>(k % 3),
                         kTop + kRowStep * static_cast<double>(k / 3),
                         kWidth,
                         kHeight,
                         time.low,
                         time.high,
                         kErrorFloor_m,
                         1e-1};
    svg += log_panel_frame(
               panel,
               pair.name + ": " + pair.content + ", " + std::to_string(pair.nodes) + " contacts",
               "time, median", k % 3 == 0 ? "largest error of the depth (m)" : "", 2) +
           error_time_panel(pair, panel);
  }
  const std::size_t columns = std::min<std::size_t>(3, result.pairs.size());
  const std::size_t rows = (result.pairs.size() + 2) / 3;
  const double width = std::max(1010.0, kLeft + kColumnStep * static_cast<double>(columns));
  svg += text_at(kLeft, 26, "Depth error against run time, poses in contact; marks: settings",
                 "start", 15) +
         legend_line(kLeft + 6, 52, drawn_methods(result.pairs));
  return svg_document(width, kTop + kRowStep * static_cast<double>(rows), svg);
}

std::string time_nodes_plot(const ParetoResult& result) {
  Range time, nodes;
  for (const PairMeasure& pair : result.pairs) {
    nodes.add(static_cast<double>(pair.nodes));
    for (const MethodMeasure& m : pair.methods) {
      const ParetoRow* row = m.drawn ? contact_row(m) : nullptr;
      if (row == nullptr) continue;
      time.add(row->median_ns);
      time.add(row->p999_ns);
    }
  }
  time.widen_to_decades();
  nodes.widen_to_decades();
  const LogPanel panel{100, 90, 860, 470, nodes.low, nodes.high, time.low, time.high};
  std::string svg =
      log_panel_frame(panel, "", "basic contacts of the pair", "time of one call", 1) +
      text_at(100, 30,
              "Time of one call in contact against the size of the pair; lines: "
              "median, dashed: 99.9 %",
              "start", 15) +
      legend_line(106, 58, drawn_methods(result.pairs));
  std::string marks;
  for (const std::string& method : drawn_methods(result.pairs)) {
    std::vector<Pixel> median, tail;
    for (const PairMeasure& pair : result.pairs) {
      for (const MethodMeasure& m : pair.methods) {
        const ParetoRow* row = m.drawn && m.method == method ? contact_row(m) : nullptr;
        if (row == nullptr) continue;
        const double x = panel.x_of(static_cast<double>(pair.nodes));
        median.push_back({x, panel.y_of(row->median_ns)});
        tail.push_back({x, panel.y_of(row->p999_ns)});
        marks += mark_at(x, panel.y_of(row->median_ns), sign_of(method));
      }
    }
    svg += polyline_of(median, sign_of(method).colour, 1.8) +
           polyline_of(tail, sign_of(method).colour, 1.1, "5 4");
  }
  return svg_document(990, 620, svg + marks);
}

std::string latency_plot(const ParetoResult& result) {
  std::vector<const PairMeasure*> shown;
  for (const char* name : {"W1", "W4"}) {
    if (const PairMeasure* pair = pair_named(result, name)) shown.push_back(pair);
  }
  if (shown.empty() && !result.pairs.empty()) shown.push_back(&result.pairs.front());
  std::string svg =
      text_at(100, 30,
              "Share of the contact poses that take at least as long; marks: the longest pose",
              "start", 15) +
      legend_line(106, 58, drawn_methods(result.pairs));
  for (std::size_t k = 0; k < shown.size(); ++k) {
    Range time;
    for (const MethodMeasure& m : shown[k]->methods) {
      if (!m.drawn || m.result.contact_ns.empty()) continue;
      time.add(m.result.contact_ns.front());
      time.add(m.result.contact_ns.back());
    }
    time.widen_to_decades();
    const LogPanel panel{
        100 + 490 * static_cast<double>(k), 100, 400, 360, time.low, time.high, 1e-4, 1};
    for (int power = -4; power <= 0; ++power) {
      const double y = panel.y_of(std::pow(10.0, power));
      svg += text_at(panel.left - 6, y + 4, share_label(power), "end", 12);
    }
    svg += log_panel_frame(panel, shown[k]->name + ": " + shown[k]->content, "time of one call", "",
                           0);
    for (const MethodMeasure& m : shown[k]->methods) {
      if (m.drawn && !m.result.contact_ns.empty())
        svg += latency_curve(m.result.contact_ns, panel, sign_of(m.method));
    }
  }
  return svg_document(1030, 520, svg);
}

std::vector<OutputText> pair_pictures(const ParetoResult& result) {
  if (result.pairs.empty()) return {};
  return {{"error_time.svg", error_time_plot(result)},
          {"time_nodes.svg", time_nodes_plot(result)},
          {"latency.svg", latency_plot(result)}};
}

}  // namespace haptic::sim
