// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/stack_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

#include "host_sim/report/svg_canvas.hpp"

namespace haptic::sim {
namespace {

constexpr double kStackWidth = 1200, kStackHeight = 820, kStackLeft = 90, kStackRight = 170;
constexpr double kStackPlotWidth = kStackWidth - kStackLeft - kStackRight;

// Colours that stay apart for colour-blind readers (Okabe and Ito).
struct Stroke {
  const char* name;
  const char* colour;
  double width;
};
constexpr std::array<Stroke, 3> kStages = {Stroke{"rendered", "#b0b0b0", 3.5},
                                           Stroke{"handed over", "#0072b2", 2.2},
                                           Stroke{"acting", "#d55e00", 1.2}};

/// A value that a lane can have; where several fall into one pixel column the last of the table
/// shows, so that what is rare is not lost.
struct LaneValue {
  const char* name;
  const char* colour;
  int code;
};
constexpr std::array<LaneValue, 5> kArmings = {
    LaneValue{"armed", "#009e73", static_cast<int>(ArmingState::kArmed)},
    LaneValue{"disarmed", "#ffffff", static_cast<int>(ArmingState::kDisarmed)},
    LaneValue{"arming", "#f0e442", static_cast<int>(ArmingState::kArming)},
    LaneValue{"disarming", "#56b4e9", static_cast<int>(ArmingState::kDisarming)},
    LaneValue{"faulted", "#d55e00", static_cast<int>(ArmingState::kFaulted)}};
constexpr std::array<LaneValue, 3> kLinks = {
    LaneValue{"ready", "#009e73", static_cast<int>(LinkState::kReady)},
    LaneValue{"starting", "#f0e442", static_cast<int>(LinkState::kStarting)},
    LaneValue{"absent", "#d55e00", static_cast<int>(LinkState::kAbsent)}};

double length(const double (&v)[3]) { return std::hypot(v[0], v[1], v[2]); }

using StageValues = std::array<std::vector<double>, kStages.size()>;

/// `floor`: what stays below it is rounding noise.
std::string stage_panel(Panel panel, std::span<const double> times, const char* label,
                        const StageValues& stages, double floor) {
  double high = 0;
  for (const std::vector<double>& values : stages) {
    for (const double v : values) high = std::max(high, std::isfinite(v) ? v : 0.0);
  }
  panel.low = 0;
  panel.high = 1.06 * std::max(high, floor);
  std::string svg = panel_frame(panel, label, false);
  for (std::size_t k = 0; k < kStages.size(); ++k) {
    const double x = panel.left + panel.width + 14,
                 y = panel.top + 16 + 20 * static_cast<double>(k);
    svg += curve(panel, times, stages[k], kStages[k].colour, kStages[k].width);
    svg += "<line x1=\"" + pixel(x) + "\" y1=\"" + pixel(y) + "\" x2=\"" + pixel(x + 24) +
           "\" y2=\"" + pixel(y) + "\" stroke=\"" + kStages[k].colour + "\" stroke-width=\"3\"/>\n";
    svg += text_at(x + 30, y + 4, kStages[k].name, "start", 13);
  }
  return svg;
}

/// The axis ends a few penetrations above zero: far free motion would flatten what happens in
/// contact.
std::string depth_panel(Panel panel, std::span<const double> times,
                        std::span<const StackRecord> records) {
  std::vector<double> mm;
  double low = 0, high = 0;
  for (const StackRecord& r : records) {
    const double d_mm = 1e3 * r.loop.tick.d_near_m;
    mm.push_back(std::isfinite(d_mm) ? d_mm : high);
    low = std::min(low, mm.back());
    high = std::max(high, mm.back());
  }
  const double top = low < 0 ? std::min(high, -6 * low) : high;
  const double margin = top > low ? 0.08 * (top - low) : 1.0;
  panel.low = low - margin;
  panel.high = top + margin;
  std::string svg = panel_frame(panel, "d_near (mm)", false);
  const double y_zero = panel.y_of(0.0);
  svg += "<rect x=\"" + pixel(panel.left) + "\" y=\"" + pixel(y_zero) + "\" width=\"" +
         pixel(panel.width) + "\" height=\"" + pixel(panel.top + panel.height - y_zero) +
         "\" fill=\"#d55e00\" fill-opacity=\"0.08\"/>\n";
  svg += curve(panel, times, mm, "#000000", 1.4);
  return svg +
         text_at(panel.left + panel.width + 14, panel.top + 20, "shaded: collision", "start", 12);
}

std::string rectangle(double x, double y, double width, double height, const char* colour,
                      const char* extra = "") {
  return "<rect x=\"" + pixel(x) + "\" y=\"" + pixel(y) + "\" width=\"" + pixel(width) +
         "\" height=\"" + pixel(height) + "\" fill=\"" + colour + "\" " + extra + "/>\n";
}

/// A band of colours over time, its name at the left, and at `key_y` what the colours mean.
std::string lane(const Panel& panel, const char* label, bool time_labels, double key_y,
                 std::span<const LaneValue> table, std::span<const StackRecord> records,
                 const std::function<int(const StackRecord&)>& code_of) {
  const auto columns = static_cast<std::size_t>(panel.width);
  std::vector<std::size_t> shown(columns, table.size());
  std::size_t filled = 0;
  for (const StackRecord& r : records) {
    const int code = code_of(r);
    std::size_t rank = 0;
    while (rank + 1 < table.size() && table[rank].code != code) ++rank;
    const double x = panel.x_of(r.loop.tick.t_s) - panel.left;
    const std::size_t column = std::min(static_cast<std::size_t>(std::max(x, 0.0)), columns - 1);
    // Fewer periods than pixels: the last value lasts until the next.
    for (; filled < column; ++filled) {
      if (shown[filled] == table.size()) shown[filled] = filled > 0 ? shown[filled - 1] : rank;
    }
    shown[column] = shown[column] == table.size() ? rank : std::max(shown[column], rank);
  }
  std::string svg = panel_frame(panel, "", time_labels);  // the grid lies below the band
  for (std::size_t begin = 0, end = 0; begin < columns; begin = end) {
    while (end < columns && shown[end] == shown[begin]) ++end;
    if (shown[begin] == table.size()) continue;
    svg += rectangle(panel.left + static_cast<double>(begin), panel.top,
                     static_cast<double>(end - begin), panel.height, table[shown[begin]].colour);
  }
  svg += panel_box(panel);
  svg += text_at(panel.left - 8, panel.top + panel.height / 2 + 4, label, "end", 13);
  svg += text_at(panel.left, key_y + 11, label, "start", 13);
  double x = panel.left + 70;
  for (const LaneValue& value : table) {
    svg += rectangle(x, key_y, 16, 12, value.colour, "stroke=\"#404040\"");
    svg += text_at(x + 22, key_y + 11, value.name, "start", 13);
    x += 120;
  }
  return svg;
}

}  // namespace

std::string stack_plot(std::span<const StackRecord> records, const std::string& title) {
  std::vector<double> times;
  StageValues force, torque;
  std::size_t contact = 0;
  for (const StackRecord& r : records) {
    times.push_back(r.loop.tick.t_s);
    contact += r.loop.tick.d_near_m <= 0 ? 1u : 0u;
    force[0].push_back(length(r.loop.tick.force_n));
    // Without a device nothing is handed over, with any last command.
    const Wrench handed_d = r.link == LinkState::kAbsent ? Wrench{} : r.handed_d;
    force[1].push_back(static_cast<double>(handed_d.force_w.norm()));
    force[2].push_back(r.acting_w.force_w.norm());
    torque[0].push_back(length(r.loop.tick.torque_nm));
    torque[1].push_back(static_cast<double>(handed_d.torque_w.norm()));
    torque[2].push_back(r.acting_w.torque_w.norm());
  }
  const auto panel = [&](double top, double height) {
    return time_panel(times, kStackLeft, top, kStackPlotWidth, height);
  };
  std::string svg = svg_head(kStackWidth, kStackHeight);
  svg += text_at(kStackLeft, 28, title, "start", 18, "font-weight=\"bold\"");
  svg += text_at(kStackLeft, 48,
                 std::to_string(records.size()) + " periods, " + std::to_string(contact) +
                     " in contact; from the core to the handle",
                 "start", 13, "fill=\"#505050\"");
  svg += stage_panel(panel(62, 210), times, "|force| (N)", force, 1.0e-3);
  svg += stage_panel(panel(290, 190), times, "|torque| (N m)", torque, 1.0e-4);
  svg += depth_panel(panel(498, 130), times, records);
  svg += lane(panel(646, 24), "arming", false, 758, kArmings, records,
              [](const StackRecord& r) { return static_cast<int>(r.arming); });
  svg += lane(panel(680, 24), "link", true, 782, kLinks, records,
              [](const StackRecord& r) { return static_cast<int>(r.link); });
  svg += text_at(kStackLeft + kStackPlotWidth / 2, 746, "time (s)", "middle", 13);
  return svg + "</svg>\n";
}

}  // namespace haptic::sim
