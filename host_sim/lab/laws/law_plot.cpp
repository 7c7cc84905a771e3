// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/laws/law_plot.hpp"

namespace haptic::sim {
namespace {

constexpr double kWidth = 1200, kLeft = 90, kPlotWidth = 940;
constexpr double kTop = 56, kHeight = 170, kGap = 34;
/// Below it a force in N, a torque in mN m or a length in mm is rounding noise.
constexpr double kFloor = 1.0e-3;

}  // namespace

std::string law_plot(const std::string& title, std::span<const double> times,
                     std::span<const CurvePanel> panels) {
  const double height = kTop + static_cast<double>(panels.size()) * (kHeight + kGap) + 30;
  std::string svg = svg_head(kWidth, height);
  svg += text_at(kLeft, 30, title, "start", 18, "font-weight=\"bold\"");
  double top = kTop;
  for (const CurvePanel& source : panels) {
    Panel panel = time_panel(times, kLeft, top, kPlotWidth, kHeight);
    fit_range(panel, source.curves, kFloor);
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
