// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The pictures of the reports: panels with linear or logarithmic axes, curves reduced per pixel
/// column, bands of states over time, legends, and a page of marks. Coordinates in pixels, y
/// downwards.

#include <span>
#include <string>
#include <vector>

#include "tools/common/svg.hpp"

namespace haptic::sim {

using tools::heading_at;
using tools::line_at;
using tools::Pixel;
using tools::pixel;
using tools::polygon_of;
using tools::polyline_of;
using tools::rectangle_at;
using tools::svg_document;
using tools::text_at;

/// Colours of the pictures; they stay apart for colour-blind readers (Okabe and Ito).
inline constexpr const char* kForceColour = "#d55e00";
inline constexpr const char* kTorqueColour = "#0072b2";
inline constexpr const char* kPointColour = "#000000";
inline constexpr const char* kRegionColour = "#009e73";
inline constexpr const char* kLitColour = "#e69f00";

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
  std::vector<double> values;  ///< one per time; a curve breaks where they are not finite
  double width = 1.5;          ///< wider below, finer above: curves that agree are all seen
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

/// A stroke of 24 pixels and its name.
[[nodiscard]] std::string legend_entry(double x, double y, const char* colour,
                                       const std::string& name, double width = 3,
                                       const char* dashes = "");

/// Frame, curves in their order, and a legend at the right.
[[nodiscard]] std::string curve_panel(const Panel& panel, const std::string& label,
                                      std::span<const double> times,
                                      std::span<const NamedCurve> curves, bool time_labels);

/// Lines of small words at the right of a panel.
[[nodiscard]] std::string panel_note(const Panel& panel, std::span<const std::string> lines);

/// One value of a band.
struct BandValue {
  const char* name;
  const char* colour;
};
/// The value that a pixel column shows where several fall into it.
enum class BandColumn {
  kMostFrequent,  ///< of the values after the first, so that short ones stay visible
  kLastOfTable,   ///< so that what is rare is not lost
};
/// A band of colours over time, its name at the left. `values`: places in the table, one per time.
[[nodiscard]] std::string band(const Panel& panel, const std::string& label, bool time_labels,
                               std::span<const double> times, std::span<const std::size_t> values,
                               std::span<const BandValue> table, BandColumn column);
/// The meaning of the colours of a band, in one line; values that do not occur are left out.
[[nodiscard]] std::string band_key(double x, double y, std::span<const std::size_t> values,
                                   std::span<const BandValue> table);

/// Two logarithmic axes. Both ranges positive, low < high; values outside are drawn at the edge.
struct LogPanel {
  double left, top, width, height;
  double x_low, x_high, y_low, y_high;

  [[nodiscard]] double x_of(double value) const;
  [[nodiscard]] double y_of(double value) const;
};

/// Box, grid at the powers of ten (every `y_step`th of the value axis labelled, none at 0), title
/// above, axis labels; empty labels are left out.
[[nodiscard]] std::string log_panel_frame(const LogPanel& panel, const std::string& title,
                                          const std::string& x_label, const std::string& y_label,
                                          int y_step);

/// "1 ns", "10 us" ...: a power of ten of nanoseconds.
[[nodiscard]] std::string time_label(double ns);

/// Colour and shape of a point.
struct MarkSign {
  const char* colour;
  char shape;  ///< o circle, s square, d diamond, t triangle, v triangle down, x, +
};
/// About 9 pixels wide.
[[nodiscard]] std::string mark_at(double x, double y, const MarkSign& sign);

/// Collects marks; `finish` gives the whole file.
class SvgPage {
 public:
  SvgPage(double width, double height, const std::string& title);

  void polygon(std::span<const Pixel> points, const std::string& fill, double opacity,
               const std::string& stroke, double stroke_width, const char* part = nullptr);
  void line(Pixel from, Pixel to, const std::string& colour, double width, bool dashed = false);
  void arrow(Pixel from, Pixel to, const std::string& colour, double width);
  void dot(Pixel at, double radius, const std::string& fill);
  void text(double x, double y, const std::string& words, const char* anchor, int size,
            const char* extra = "");
  /// Words over a light halo, readable on any ground.
  void label(Pixel at, const std::string& words, const std::string& colour, int size = 13,
             const char* anchor = "start");
  void raw(const std::string& svg) { body_ += svg; }
  void begin_group(const std::string& name);
  void end_group() { body_ += "</g>\n"; }
  [[nodiscard]] std::string finish() const { return svg_document(width_, height_, body_); }

 private:
  double width_, height_;
  std::string body_;
};

}  // namespace haptic::sim
