// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Marks of an SVG plot: text, lines, axes, and curves reduced per pixel column. Coordinates in
/// pixels, y downwards.

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace haptic::sim {

/// Text made safe for XML: control characters become spaces.
[[nodiscard]] std::string xml_escaped(std::string_view text);

/// A pixel coordinate with one decimal.
[[nodiscard]] std::string pixel(double value);

/// Head of a document of this size [pixels] with a white ground; "</svg>" ends it.
[[nodiscard]] std::string svg_head(double width, double height);

/// Positions of axis marks: multiples of 1, 2 or 5 times a power of ten within [low, high], about
/// `wanted` of them.
[[nodiscard]] std::vector<double> nice_marks(double low, double high, int wanted);

/// Label of a mark: fixed digits that suit the distance between marks.
[[nodiscard]] std::string mark_label(double value, double step);

/// One panel of a plot: a box with a value axis, sharing the time axis with the others.
struct Panel {
  double left, top, width, height;
  double t_low, t_high, low, high;

  [[nodiscard]] double x_of(double t) const {
    return left + width * (t - t_low) / (t_high - t_low);
  }
  [[nodiscard]] double y_of(double value) const {
    return top + height * (high - value) / (high - low);
  }
};

/// A panel over all of `times`, ascending, one second where they are fewer than two; its values
/// reach from 0 to 1 until they are fitted.
[[nodiscard]] Panel time_panel(std::span<const double> times, double left, double top, double width,
                               double height);

struct NamedCurve {
  std::string name;
  const char* colour;
  std::vector<double> values;  ///< one per time
};

/// Gives the panel a range that holds all values and zero, with a margin; never empty. A range
/// below `floor` is widened to it, so that rounding noise is drawn as zero.
void fit_range(Panel& panel, std::span<const NamedCurve> curves, double floor = 0);

/// One curve's points after reduction: a polyline through the least and largest value of each
/// column, in their order. Values outside the panel are cut at its edge. `times` ascend; sizes
/// agree.
[[nodiscard]] std::string curve(const Panel& panel, std::span<const double> times,
                                std::span<const double> values, const char* colour,
                                double stroke_width);

/// Box, grid, marks and axis label of a panel; `time_labels`: write the times below it.
[[nodiscard]] std::string panel_frame(const Panel& panel, const std::string& label,
                                      bool time_labels);
/// The box alone, to close what was drawn over the grid.
[[nodiscard]] std::string panel_box(const Panel& panel);

[[nodiscard]] std::string text_at(double x, double y, const std::string& text, const char* anchor,
                                  int size, const char* extra = "");

}  // namespace haptic::sim
