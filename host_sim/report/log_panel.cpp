// SPDX-License-Identifier: Apache-2.0
#include "host_sim/report/log_panel.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/report/svg_canvas.hpp"

namespace haptic::sim {
namespace {

double share(double value, double low, double high) {
  const double inside = std::clamp(value, low, high);
  return std::log10(inside / low) / std::log10(high / low);
}

std::string rule(double x1, double y1, double x2, double y2) {
  return "<line x1=\"" + pixel(x1) + "\" y1=\"" + pixel(y1) + "\" x2=\"" + pixel(x2) + "\" y2=\"" +
         pixel(y2) + "\" stroke=\"#e4e4e4\" stroke-width=\"1\"/>\n";
}

std::string filled(const std::string& points, const char* colour) {
  return "<polygon points=\"" + points + "\" fill=\"" + colour +
         "\" stroke=\"#ffffff\" stroke-width=\"0.7\"/>\n";
}

std::string at(double x, double y) { return pixel(x) + "," + pixel(y) + " "; }

}  // namespace

double LogPanel::x_of(double value) const { return left + width * share(value, x_low, x_high); }
double LogPanel::y_of(double value) const {
  return top + height * (1 - share(value, y_low, y_high));
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
  const auto powers = [](double low, double high) {
    std::vector<int> list;
    for (int k = static_cast<int>(std::ceil(std::log10(low) - 1e-9));
         std::pow(10.0, k) <= high * 1.0001; ++k)
      list.push_back(k);
    return list;
  };
  const bool time_up = p.y_low >= 1e-3;  // errors stay below 1 m, times above 1 ns
  for (const int k : powers(p.x_low, p.x_high)) {
    const double x = p.x_of(std::pow(10.0, k));
    svg += rule(x, p.top, x, p.top + p.height);
    if (!x_label.empty()) {
      const std::string words =
          x_label.starts_with("time") ? time_label(std::pow(10.0, k)) : "1e" + std::to_string(k);
      svg += text_at(x, p.top + p.height + 16, words, "middle", 12);
    }
  }
  for (const int k : powers(p.y_low, p.y_high)) {
    const double y = p.y_of(std::pow(10.0, k));
    svg += rule(p.left, y, p.left + p.width, y);
    if (y_step > 0 && k % y_step == 0) {
      const std::string words = time_up ? time_label(std::pow(10.0, k)) : "1e" + std::to_string(k);
      svg += text_at(p.left - 6, y + 4, words, "end", 12);
    }
  }
  svg += "<rect x=\"" + pixel(p.left) + "\" y=\"" + pixel(p.top) + "\" width=\"" + pixel(p.width) +
         "\" height=\"" + pixel(p.height) +
         "\" fill=\"none\" stroke=\"#404040\" stroke-width=\"1\"/>\n";
  svg += text_at(p.left + p.width / 2, p.top - 8, title, "middle", 14);
  if (!x_label.empty())
    svg += text_at(p.left + p.width / 2, p.top + p.height + 36, x_label, "middle", 13);
  if (!y_label.empty()) {
    const double x = p.left - 56, y = p.top + p.height / 2;
    const std::string turn = "transform=\"rotate(-90 " + pixel(x) + " " + pixel(y) + ")\"";
    svg += text_at(x, y, y_label, "middle", 13, turn.c_str());
  }
  return svg;
}

MethodSign sign_of(std::string_view method) {
  struct Entry {
    std::string_view method;
    MethodSign sign;
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

std::string mark_at(double x, double y, const MethodSign& sign) {
  constexpr double r = 4.5;
  const std::string stroke =
      "<path stroke=\"" + std::string(sign.colour) + "\" stroke-width=\"2.2\" fill=\"none\" d=\"";
  switch (sign.shape) {
    case 's':
      return filled(at(x - r, y - r) + at(x + r, y - r) + at(x + r, y + r) + at(x - r, y + r),
                    sign.colour);
    case 'd':
      return filled(
          at(x, y - 1.3 * r) + at(x + 1.3 * r, y) + at(x, y + 1.3 * r) + at(x - 1.3 * r, y),
          sign.colour);
    case 't':
      return filled(at(x, y - 1.2 * r) + at(x + 1.1 * r, y + r) + at(x - 1.1 * r, y + r),
                    sign.colour);
    case 'v':
      return filled(at(x, y + 1.2 * r) + at(x + 1.1 * r, y - r) + at(x - 1.1 * r, y - r),
                    sign.colour);
    case 'x':
      return stroke + "M" + at(x - r, y - r) + "L" + at(x + r, y + r) + "M" + at(x - r, y + r) +
             "L" + at(x + r, y - r) + "\"/>\n";
    case '+':
      return stroke + "M" + at(x - 1.2 * r, y) + "L" + at(x + 1.2 * r, y) + "M" +
             at(x, y - 1.2 * r) + "L" + at(x, y + 1.2 * r) + "\"/>\n";
    default:
      return "<circle cx=\"" + pixel(x) + "\" cy=\"" + pixel(y) + "\" r=\"5\" fill=\"" +
             sign.colour + "\" stroke=\"#ffffff\" stroke-width=\"0.7\"/>\n";
  }
}

std::string legend_line(double x, double y, const std::vector<std::string>& methods) {
  constexpr double kLetter = 7.6, kGap = 34;  // pixels at the size of the words
  std::string svg;
  for (const std::string& method : methods) {
    svg += mark_at(x, y - 4, sign_of(method)) + text_at(x + 12, y, method, "start", 13);
    x += kGap + kLetter * static_cast<double>(method.size());
  }
  return svg;
}

std::string polyline(const std::vector<double>& points, const char* colour, double width,
                     const char* dashes) {
  std::string list;
  for (std::size_t k = 0; k + 1 < points.size(); k += 2) list += at(points[k], points[k + 1]);
  return "<polyline fill=\"none\" stroke=\"" + std::string(colour) + "\" stroke-width=\"" +
         pixel(width) + "\" stroke-dasharray=\"" + dashes + "\" points=\"" + list + "\"/>\n";
}

std::string svg_document(double width, double height, const std::string& content) {
  const std::string size = "width=\"" + pixel(width) + "\" height=\"" + pixel(height) + "\"";
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" " + size +
         " font-family=\"sans-serif\" fill=\"#202020\">\n<rect " + size + " fill=\"#ffffff\"/>\n" +
         content + "</svg>\n";
}

}  // namespace haptic::sim
