// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/faults/fault_picture.hpp"

#include <algorithm>

#include "host_sim/report/picture.hpp"

namespace haptic::sim {
namespace {

constexpr double kMargin = 60, kHead = 150, kPlotWidth = 300, kPlotHeight = 90;
constexpr double kPairGap = 46, kColumnGap = 90, kRowGap = 46;
constexpr std::size_t kColumns = 2;  ///< of faults
constexpr double kBefore_s = 0.02, kAfter_s = 0.13, kHigh_n = 13.0;

/// Where states lie on each other the later ones are drawn finer.
struct StateStyle {
  const char* colour;
  double width;
};
constexpr StateStyle kStyles[] = {{"#bbbbbb", 6.0}, {"#8c6d31", 5.0}, {"#9467bd", 4.2},
                                  {"#2ca02c", 2.0}, {"#17becf", 3.4}, {"#d62728", 2.4},
                                  {"#e377c2", 2.6}, {"#1f77b4", 1.6}, {"#404040", 1.2}};
static_assert(std::size(kStyles) == static_cast<std::size_t>(FaultState::kCount));

const StateStyle& style_of(FaultState state) { return kStyles[static_cast<std::size_t>(state)]; }

/// Force by time about the fault.
struct ForceCurve {
  std::vector<double> t_s, force_n;
};

ForceCurve curve_of(const FaultTrace& trace, bool handed) {
  ForceCurve out;
  double last_n = 0;
  for (std::size_t k = 0; k < trace.samples.size(); ++k) {
    const FaultSample& sample = trace.samples[k];
    // The last sample without the fault is at 0.
    const double t_s =
        (static_cast<double>(k + 1) - static_cast<double>(trace.injected)) * trace.period_s;
    // A command stays until the next one, but not on a bus without a device.
    if (sample.link == LinkState::kAbsent) last_n = 0;
    if (!sample.sent.empty()) last_n = sample.sent.back().wrench.force_w.norm();
    if (t_s < -kBefore_s || t_s > kAfter_s) continue;
    out.t_s.push_back(t_s);
    out.force_n.push_back(handed ? last_n : sample.acting.force_w.norm());
  }
  return out;
}

std::string panel_of(double left, double top, std::span<const FaultVerdict> row, bool handed,
                     bool time_labels) {
  const Panel panel{left, top, kPlotWidth, kPlotHeight, -kBefore_s, kAfter_s, 0, kHigh_n};
  std::string svg;
  for (const double t : {0.0, 0.05, 0.1}) {
    svg += line_at({panel.x_of(t), top}, {panel.x_of(t), top + kPlotHeight}, "#e4e4e4", 1);
    if (time_labels)
      svg += text_at(panel.x_of(t), top + kPlotHeight + 13, mark_label(1e3 * t, 50), "middle", 11);
  }
  for (const double force_n : {0.0, 5.0, 10.0}) {
    svg += line_at({left, panel.y_of(force_n)}, {left + kPlotWidth, panel.y_of(force_n)}, "#e4e4e4",
                   1);
    svg += text_at(left - 5, panel.y_of(force_n) + 4, mark_label(force_n, 5), "end", 11);
  }
  svg += line_at({panel.x_of(0), top}, {panel.x_of(0), top + kPlotHeight}, "#000000", 1, "3 2");
  for (const FaultVerdict& v : row) {
    const ForceCurve c = curve_of(v.trace, handed);
    svg +=
        curve(panel, c.t_s, c.force_n, style_of(v.cell.state).colour, style_of(v.cell.state).width);
  }
  svg += panel_box(panel);
  return svg;
}

std::string legend_of(std::span<const FaultVerdict> verdicts) {
  std::vector<FaultState> states;
  for (const FaultVerdict& v : verdicts) {
    if (std::find(states.begin(), states.end(), v.cell.state) == states.end())
      states.push_back(v.cell.state);
  }
  std::sort(states.begin(), states.end());
  std::string svg;
  double x = kMargin;
  for (const FaultState state : states) {
    svg += line_at({x, 92}, {x + 26, 92}, style_of(state).colour, style_of(state).width);
    svg += text_at(x + 32, 96, to_text(state), "start", 13);
    x += 150;
  }
  return svg;
}

}  // namespace

std::string fault_picture(const std::vector<FaultVerdict>& verdicts) {
  std::vector<std::span<const FaultVerdict>> rows;
  for (std::size_t k = 0, end = 0; k < verdicts.size(); k = end) {
    while (end < verdicts.size() && verdicts[end].cell.fault == verdicts[k].cell.fault) ++end;
    rows.emplace_back(verdicts.data() + k, end - k);
  }
  const std::size_t per_column = (rows.size() + kColumns - 1) / kColumns;
  const double column_width = 2 * kPlotWidth + kPairGap + kColumnGap;
  const double width = 2 * kMargin + kColumns * column_width - kColumnGap;
  const double height = kHead + static_cast<double>(per_column) * (kPlotHeight + kRowGap) + 20;
  std::string svg;
  const SafetyLimits limits = reference_stack(StackCarrier::kDirect).limits;
  const double slew_n_per_ms = 1e-3 * static_cast<double>(limits.slew_n_per_s);
  svg += text_at(kMargin, 32, "Every fault in every state", "start", 20, "font-weight=\"bold\"");
  svg += text_at(kMargin, 58,
                 "|F| in N against time in ms; dashed: the fault. Slew limit " +
                     mark_label(slew_n_per_ms, 1) +
                     " N per ms: nothing but the device's own cut is steeper.",
                 "start", 13);
  svg += legend_of(verdicts);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const std::size_t column = k / per_column, row = k % per_column;
    const double left = kMargin + static_cast<double>(column) * column_width;
    const double top = kHead + static_cast<double>(row) * (kPlotHeight + kRowGap);
    if (row == 0) {
      svg += text_at(left, top - 28, "handed to the bus", "start", 13, "font-style=\"italic\"");
      svg += text_at(left + kPlotWidth + kPairGap, top - 28, "acting at the device", "start", 13,
                     "font-style=\"italic\"");
    }
    svg += text_at(left, top - 6, rows[k].front().cell.fault->name, "start", 13,
                   "font-weight=\"bold\"");
    svg += text_at(
        left + kPlotWidth + kPairGap, top - 6,
        to_text(
            fault_rules()[static_cast<std::size_t>(rows[k].front().cell.fault - faults().data())]
                .output),
        "start", 12);
    svg += panel_of(left, top, rows[k], true, true);
    svg += panel_of(left + kPlotWidth + kPairGap, top, rows[k], false, true);
  }
  return svg_document(width, height, svg);
}

}  // namespace haptic::sim
