// SPDX-License-Identifier: Apache-2.0
#include "host_sim/report/law_plot.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/report/svg_canvas.hpp"

namespace haptic::sim {
namespace {

constexpr double kWidth = 1200, kLeft = 90, kPlotWidth = 940;
constexpr double kTop = 56, kHeight = 170, kGap = 34;

/// Range that holds all values and zero, with a margin; never empty.
void fit(Panel& panel, const std::vector<NamedCurve>& curves) {
  double low = 0, high = 0;
  for (const NamedCurve& c : curves) {
    for (const double v : c.values) {
      low = std::min(low, v);
      high = std::max(high, v);
    }
  }
  const double margin = high > low ? 0.06 * (high - low) : 1.0;
  panel.low = low - (low < 0 || high == 0 ? margin : 0);
  panel.high = high + margin;
}

}  // namespace

std::string law_plot(const std::string& title, std::span<const double> times,
                     std::span<const CurvePanel> panels) {
  const double t_low = times.empty() ? 0.0 : times.front();
  const double t_high = times.size() < 2 ? t_low + 1.0 : times.back();
  const double height = kTop + static_cast<double>(panels.size()) * (kHeight + kGap) + 30;
  const std::string size = pixel(kWidth) + " " + pixel(height);
  std::string svg =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg "
      "xmlns=\"http://www.w3.org/2000/svg\" width=\"" +
      pixel(kWidth) + "\" height=\"" + pixel(height) + "\" viewBox=\"0 0 " + size +
      "\" font-family=\"sans-serif\">\n<rect width=\"" + pixel(kWidth) + "\" height=\"" +
      pixel(height) + "\" fill=\"#ffffff\"/>\n";
  svg += text_at(kLeft, 30, title, "start", 18, "font-weight=\"bold\"");
  double top = kTop;
  for (const CurvePanel& source : panels) {
    Panel panel{kLeft, top, kPlotWidth, kHeight, t_low, t_high, 0, 1};
    fit(panel, source.curves);
    svg += panel_frame(panel, source.label, &source == &panels.back());
    double y = top + 16;
    for (const NamedCurve& c : source.curves) {
      svg += curve(panel, times, c.values, c.colour, 1.5);
      const double x = kLeft + kPlotWidth + 14;
      svg += "<line x1=\"" + pixel(x) + "\" y1=\"" + pixel(y - 4) + "\" x2=\"" + pixel(x + 24) +
             "\" y2=\"" + pixel(y - 4) + "\" stroke=\"" + c.colour + "\" stroke-width=\"3\"/>\n";
      svg += text_at(x + 30, y, c.name, "start", 13);
      y += 20;
    }
    top += kHeight + kGap;
  }
  svg += text_at(kLeft + kPlotWidth / 2, height - 16, "time (s)", "middle", 13);
  return svg + "</svg>\n";
}

}  // namespace haptic::sim
