// SPDX-License-Identifier: Apache-2.0
#include "host_sim/report/svg_canvas.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace haptic::sim {

std::string xml_escaped(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return safe;
}

std::string pixel(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.1f", value);
  return buffer;
}

std::vector<double> nice_marks(double low, double high, int wanted) {
  const double raw = (high - low) / wanted;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10 * power;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * power >= raw) step = factor * power;
  }
  std::vector<double> marks;
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1.0)
    marks.push_back(k * step);
  return marks;
}

std::string mark_label(double value, double step) {
  const int digits = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 9);
  char buffer[48];
  std::snprintf(buffer, sizeof buffer, "%.*f", digits, std::abs(value) < 1e-9 * step ? 0.0 : value);
  return buffer;
}

std::string text_at(double x, double y, const std::string& text, const char* anchor, int size,
                    const char* extra) {
  return "<text x=\"" + pixel(x) + "\" y=\"" + pixel(y) + "\" text-anchor=\"" + anchor +
         "\" font-size=\"" + std::to_string(size) + "\" " + extra + ">" + xml_escaped(text) +
         "</text>\n";
}

std::string svg_head(double width, double height) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
         "width=\"" +
         pixel(width) + "\" height=\"" + pixel(height) + "\" viewBox=\"0 0 " + pixel(width) + " " +
         pixel(height) + "\" font-family=\"sans-serif\">\n<rect width=\"" + pixel(width) +
         "\" height=\"" + pixel(height) + "\" fill=\"#ffffff\"/>\n";
}

Panel time_panel(std::span<const double> times, double left, double top, double width,
                 double height) {
  const double low = times.empty() ? 0.0 : times.front();
  const double high = times.size() < 2 ? low + 1.0 : times.back();
  return {left, top, width, height, low, high, 0, 1};
}

void fit_range(Panel& panel, std::span<const NamedCurve> curves, double floor) {
  double low = 0, high = 0;
  for (const NamedCurve& c : curves) {
    for (const double v : c.values) {
      low = std::min(low, v);
      high = std::max(high, v);
    }
  }
  if (high - low < floor) high = low + floor;
  const double margin = high > low ? 0.06 * (high - low) : 1.0;
  panel.low = low - (low < 0 || high == 0 ? margin : 0);
  panel.high = high + margin;
}

std::string curve(const Panel& panel, std::span<const double> times, std::span<const double> values,
                  const char* colour, double stroke_width) {
  std::string points;
  const auto add = [&](std::size_t i) {
    const double value = std::clamp(values[i], panel.low, panel.high);
    points += pixel(panel.x_of(times[i])) + "," + pixel(panel.y_of(value)) + " ";
  };
  std::size_t i = 0;
  while (i < times.size()) {
    const double column = std::floor(panel.x_of(times[i]));
    std::size_t least = i, largest = i, end = i;
    for (; end < times.size() && std::floor(panel.x_of(times[end])) == column; ++end) {
      if (values[end] < values[least]) least = end;
      if (values[end] > values[largest]) largest = end;
    }
    add(std::min(least, largest));
    if (least != largest) add(std::max(least, largest));
    i = end;
  }
  return "<polyline fill=\"none\" stroke=\"" + std::string(colour) + "\" stroke-width=\"" +
         pixel(stroke_width) + "\" points=\"" + points + "\"/>\n";
}

std::string panel_box(const Panel& p) {
  return "<rect x=\"" + pixel(p.left) + "\" y=\"" + pixel(p.top) + "\" width=\"" + pixel(p.width) +
         "\" height=\"" + pixel(p.height) +
         "\" fill=\"none\" stroke=\"#404040\" stroke-width=\"1\"/>\n";
}

std::string panel_frame(const Panel& p, const std::string& label, bool time_labels) {
  std::string svg;
  const auto rule = [&](double x1, double y1, double x2, double y2, const char* colour) {
    svg += "<line x1=\"" + pixel(x1) + "\" y1=\"" + pixel(y1) + "\" x2=\"" + pixel(x2) +
           "\" y2=\"" + pixel(y2) + "\" stroke=\"" + colour + "\" stroke-width=\"1\"/>\n";
  };
  const std::vector<double> times = nice_marks(p.t_low, p.t_high, 10);
  const double t_step = times.size() > 1 ? times[1] - times[0] : 1.0;
  for (const double t : times) {
    rule(p.x_of(t), p.top, p.x_of(t), p.top + p.height, "#e4e4e4");
    if (time_labels)
      svg += text_at(p.x_of(t), p.top + p.height + 16, mark_label(t, t_step), "middle", 12);
  }
  if (p.high > p.low && !label.empty()) {
    const std::vector<double> marks = nice_marks(p.low, p.high, 5);
    const double step = marks.size() > 1 ? marks[1] - marks[0] : 1.0;
    for (const double m : marks) {
      rule(p.left, p.y_of(m), p.left + p.width, p.y_of(m), m == 0.0 ? "#909090" : "#e4e4e4");
      svg += text_at(p.left - 6, p.y_of(m) + 4, mark_label(m, step), "end", 12);
    }
  }
  svg += panel_box(p);
  if (!label.empty()) {
    const double x = p.left - 62, y = p.top + p.height / 2;
    const std::string turn = "transform=\"rotate(-90 " + pixel(x) + " " + pixel(y) + ")\"";
    svg += text_at(x, y, label, "middle", 13, turn.c_str());
  }
  return svg;
}

}  // namespace haptic::sim
