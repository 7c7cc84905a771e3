// SPDX-License-Identifier: Apache-2.0
#include "host_sim/report/picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using tools::formatted;

constexpr const char* kGridColour = "#e4e4e4";

std::string turned_label(double x, double y, const std::string& label) {
  const std::string turn = "transform=\"rotate(-90 " + pixel(x) + " " + pixel(y) + ")\"";
  return text_at(x, y, label, "middle", 13, turn.c_str());
}

double log_share(double value, double low, double high) {
  const double inside = std::clamp(value, low, high);
  return std::log10(inside / low) / std::log10(high / low);
}

std::vector<int> powers_within(double low, double high) {
  std::vector<int> list;
  for (int k = static_cast<int>(std::ceil(std::log10(low) - 1e-9));
       std::pow(10.0, k) <= high * 1.0001; ++k)
    list.push_back(k);
  return list;
}

}  // namespace

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
  return formatted("%.*f", digits, std::abs(value) < 1e-9 * step ? 0.0 : value);
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
      if (!std::isfinite(v)) continue;
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
  std::string svg;
  std::vector<Pixel> points;
  const auto close = [&] {
    if (!points.empty()) svg += polyline_of(points, colour, stroke_width);
    points.clear();
  };
  const auto add = [&](std::size_t i) {
    points.push_back(
        {panel.x_of(times[i]), panel.y_of(std::clamp(values[i], panel.low, panel.high))});
  };
  for (std::size_t i = 0; i < times.size();) {
    if (!std::isfinite(values[i])) {
      close();
      ++i;
      continue;
    }
    const double column = std::floor(panel.x_of(times[i]));
    std::size_t least = i, largest = i, end = i;
    for (; end < times.size() && std::floor(panel.x_of(times[end])) == column &&
           std::isfinite(values[end]);
         ++end) {
      if (values[end] < values[least]) least = end;
      if (values[end] > values[largest]) largest = end;
    }
    add(std::min(least, largest));
    if (least != largest) add(std::max(least, largest));
    i = end;
  }
  close();
  return svg;
}

std::string panel_box(const Panel& p) {
  return rectangle_at({p.left, p.top}, p.width, p.height, "none", "stroke=\"#404040\"");
}

std::string panel_frame(const Panel& p, const std::string& label, bool time_labels) {
  std::string svg;
  const double bottom = p.top + p.height;
  const std::vector<double> times = nice_marks(p.t_low, p.t_high, 10);
  const double t_step = times.size() > 1 ? times[1] - times[0] : 1.0;
  for (const double t : times) {
    svg += line_at({p.x_of(t), p.top}, {p.x_of(t), bottom}, kGridColour);
    if (time_labels) svg += text_at(p.x_of(t), bottom + 16, mark_label(t, t_step), "middle", 12);
  }
  if (p.high > p.low && !label.empty()) {
    const std::vector<double> marks = nice_marks(p.low, p.high, 5);
    const double step = marks.size() > 1 ? marks[1] - marks[0] : 1.0;
    for (const double m : marks) {
      svg += line_at({p.left, p.y_of(m)}, {p.left + p.width, p.y_of(m)},
                     m == 0.0 ? "#909090" : kGridColour);
      svg += text_at(p.left - 6, p.y_of(m) + 4, mark_label(m, step), "end", 12);
    }
  }
  svg += panel_box(p);
  if (!label.empty()) svg += turned_label(p.left - 62, p.top + p.height / 2, label);
  return svg;
}

std::string legend_entry(double x, double y, const char* colour, const std::string& name,
                         double width, const char* dashes) {
  return line_at({x, y}, {x + 24, y}, colour, width, dashes) +
         text_at(x + 30, y + 4, name, "start", 13);
}

std::string curve_panel(const Panel& panel, const std::string& label, std::span<const double> times,
                        std::span<const NamedCurve> curves, bool time_labels) {
  std::string svg = panel_frame(panel, label, time_labels);
  double y = panel.top + 16;
  for (const NamedCurve& c : curves) {
    svg += curve(panel, times, c.values, c.colour, c.width);
    svg += legend_entry(panel.left + panel.width + 14, y, c.colour, c.name, c.width);
    y += 20;
  }
  return svg;
}

std::string panel_note(const Panel& panel, std::span<const std::string> lines) {
  std::string svg;
  double y = panel.top + 20;
  for (const std::string& line : lines) {
    svg += text_at(panel.left + panel.width + 14, y, line, "start", 12);
    y += 16;
  }
  return svg;
}

std::string band(const Panel& panel, const std::string& label, bool time_labels,
                 std::span<const double> times, std::span<const std::size_t> values,
                 std::span<const BandValue> table, BandColumn rule) {
  std::string svg = panel_frame(panel, "", time_labels);  // the grid lies below the band
  double begin = 0;
  std::size_t shown = table.size();
  const auto fill_to = [&](double end) {
    if (shown < table.size() && end > begin)
      svg += rectangle_at({panel.left + begin, panel.top}, end - begin, panel.height,
                          table[shown].colour);
    begin = end;
  };
  for (std::size_t i = 0, end = 0; i < times.size(); i = end) {
    const auto column_of = [&](double t) {
      return std::clamp(std::floor(panel.x_of(t) - panel.left), 0.0, panel.width - 1);
    };
    const double column = column_of(times[i]);
    std::vector<std::size_t> counts(table.size(), 0);
    for (; end < times.size() && column_of(times[end]) == column; ++end) ++counts[values[end]];
    std::size_t chosen = 0;
    for (std::size_t c = 1; c < counts.size(); ++c) {
      if (counts[c] > 0 &&
          (rule == BandColumn::kLastOfTable || chosen == 0 || counts[c] > counts[chosen]))
        chosen = c;
    }
    if (chosen == shown) continue;
    fill_to(column);
    shown = chosen;
  }
  fill_to(panel.width);
  svg += panel_box(panel);
  return svg + text_at(panel.left - 8, panel.top + panel.height / 2 + 4, label, "end", 13);
}

std::string band_key(double x, double y, std::span<const std::size_t> values,
                     std::span<const BandValue> table) {
  std::string svg;
  for (std::size_t c = 0; c < table.size(); ++c) {
    if (std::ranges::find(values, c) == values.end()) continue;
    svg += rectangle_at({x, y}, 16, 12, table[c].colour, "stroke=\"#404040\"");
    svg += text_at(x + 22, y + 11, table[c].name, "start", 13);
    x += 130;
  }
  return svg;
}

double LogPanel::x_of(double value) const { return left + width * log_share(value, x_low, x_high); }
double LogPanel::y_of(double value) const {
  return top + height * (1 - log_share(value, y_low, y_high));
}

std::string time_label(double ns) {
  const int power = static_cast<int>(std::lround(std::log10(ns)));
  constexpr const char* kUnits[] = {"ns", "us", "ms", "s"};
  constexpr const char* kFactors[] = {"1 ", "10 ", "100 "};
  if (power < 0 || power > 11) return "1e" + std::to_string(power) + " ns";
  return std::string(kFactors[power % 3]) + kUnits[power / 3];
}

std::string log_panel_frame(const LogPanel& p, const std::string& title, const std::string& x_label,
                            const std::string& y_label, int y_step) {
  std::string svg;
  const double bottom = p.top + p.height;
  const auto words_of = [](int power, bool time) {
    return time ? time_label(std::pow(10.0, power)) : "1e" + std::to_string(power);
  };
  const std::vector<int> across = powers_within(p.x_low, p.x_high);
  const int x_step = across.size() > 9 ? 2 : 1;  // room for the labels
  for (const int k : across) {
    const double x = p.x_of(std::pow(10.0, k));
    svg += line_at({x, p.top}, {x, bottom}, kGridColour);
    if (!x_label.empty() && k % x_step == 0)
      svg += text_at(x, bottom + 16, words_of(k, x_label.starts_with("time")), "middle", 12);
  }
  for (const int k : powers_within(p.y_low, p.y_high)) {
    const double y = p.y_of(std::pow(10.0, k));
    svg += line_at({p.left, y}, {p.left + p.width, y}, kGridColour);
    if (y_step > 0 && k % y_step == 0)
      svg += text_at(p.left - 6, y + 4, words_of(k, y_label.starts_with("time")), "end", 12);
  }
  svg += rectangle_at({p.left, p.top}, p.width, p.height, "none", "stroke=\"#404040\"");
  svg += text_at(p.left + p.width / 2, p.top - 8, title, "middle", 14);
  if (!x_label.empty()) svg += text_at(p.left + p.width / 2, bottom + 36, x_label, "middle", 13);
  if (!y_label.empty()) svg += turned_label(p.left - 56, p.top + p.height / 2, y_label);
  return svg;
}

std::string mark_at(double x, double y, const MarkSign& sign) {
  constexpr double r = 4.5;
  const std::string fill =
      formatted("fill=\"%s\" stroke=\"#ffffff\" stroke-width=\"0.7\"", sign.colour);
  const auto filled = [&](const std::vector<Pixel>& corners) { return polygon_of(corners, fill); };
  const auto cross = [&](double dx, double dy) {
    return line_at({x - dx, y - dy}, {x + dx, y + dy}, sign.colour, 2.2) +
           line_at({x - dy, y + dx}, {x + dy, y - dx}, sign.colour, 2.2);
  };
  switch (sign.shape) {
    case 's':
      return filled({{x - r, y - r}, {x + r, y - r}, {x + r, y + r}, {x - r, y + r}});
    case 'd':
      return filled({{x, y - 1.3 * r}, {x + 1.3 * r, y}, {x, y + 1.3 * r}, {x - 1.3 * r, y}});
    case 't':
      return filled({{x, y - 1.2 * r}, {x + 1.1 * r, y + r}, {x - 1.1 * r, y + r}});
    case 'v':
      return filled({{x, y + 1.2 * r}, {x + 1.1 * r, y - r}, {x - 1.1 * r, y - r}});
    case 'x':
      return cross(r, r);
    case '+':
      return cross(1.2 * r, 0);
    default:
      return formatted("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"5\" %s/>\n", x, y, fill.c_str());
  }
}

SvgPage::SvgPage(double width, double height, const std::string& title)
    : width_(width), height_(height), body_(heading_at(24, 30, title)) {}

void SvgPage::polygon(std::span<const Pixel> points, const std::string& fill, double opacity,
                      const std::string& stroke, double stroke_width, const char* part) {
  body_ += polygon_of(
      points, (part != nullptr ? formatted("class=\"%s\" ", part) : "") +
                  formatted("fill=\"%s\" fill-opacity=\"%.2f\" stroke=\"%s\" stroke-width=\"%.2f\" "
                            "stroke-linejoin=\"round\"",
                            fill.c_str(), opacity, stroke.c_str(), stroke_width));
}

void SvgPage::line(Pixel from, Pixel to, const std::string& colour, double width, bool dashed) {
  body_ += line_at(from, to, colour, width, dashed ? "4 3" : "");
}

void SvgPage::arrow(Pixel from, Pixel to, const std::string& colour, double width) {
  const double dx = to.x - from.x, dy = to.y - from.y, length = std::hypot(dx, dy);
  if (length < 1e-6) return;
  const double ux = dx / length, uy = dy / length;
  const double head = std::min(length, 4.0 + 3.0 * width), half = 0.42 * head;
  const Pixel neck{to.x - head * ux, to.y - head * uy};
  line(from, {neck.x + 0.3 * head * ux, neck.y + 0.3 * head * uy}, colour, width);
  const Pixel tip[3] = {
      to, {neck.x - half * uy, neck.y + half * ux}, {neck.x + half * uy, neck.y - half * ux}};
  polygon(tip, colour, 1.0, "none", 0);
}

void SvgPage::dot(Pixel at, double radius, const std::string& fill) {
  body_ += "<circle cx=\"" + pixel(at.x) + "\" cy=\"" + pixel(at.y) + "\" r=\"" + pixel(radius) +
           "\" fill=\"" + fill + "\" stroke=\"#ffffff\" stroke-width=\"1\"/>\n";
}

void SvgPage::text(double x, double y, const std::string& words, const char* anchor, int size,
                   const char* extra) {
  body_ += text_at(x, y, words, anchor, size, extra);
}

void SvgPage::label(Pixel at, const std::string& words, const std::string& colour, int size,
                    const char* anchor) {
  const std::string extra = "fill=\"" + colour +
                            "\" stroke=\"#ffffff\" stroke-width=\"3\" paint-order=\"stroke\" "
                            "stroke-linejoin=\"round\" font-weight=\"bold\"";
  body_ += text_at(at.x, at.y, words, anchor, size, extra.c_str());
}

void SvgPage::begin_group(const std::string& name) {
  body_ += "<g id=\"" + tools::xml_escaped(name) + "\">\n";
}

}  // namespace haptic::sim
