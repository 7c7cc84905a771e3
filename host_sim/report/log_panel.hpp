// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A box of a picture with two logarithmic axes, its marks, and the signs of the methods.

#include <string>
#include <string_view>
#include <vector>

namespace haptic::sim {

/// Both ranges positive, low < high; values outside are drawn at the edge. Pixels.
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

/// Colour and shape of a method, the same in all pictures.
struct MethodSign {
  const char* colour;
  char shape;  ///< o circle, s square, d diamond, t triangle, v triangle down, x, +
};
[[nodiscard]] MethodSign sign_of(std::string_view method);

/// The mark of a method, about 9 pixels wide.
[[nodiscard]] std::string mark_at(double x, double y, const MethodSign& sign);

/// Sign and name of each method in one line from `x` on.
[[nodiscard]] std::string legend_line(double x, double y, const std::vector<std::string>& methods);

/// Polyline through points given in pixels, alternating x and y.
[[nodiscard]] std::string polyline(const std::vector<double>& points, const char* colour,
                                   double width, const char* dashes = "");

/// A whole picture on white.
[[nodiscard]] std::string svg_document(double width, double height, const std::string& content);

}  // namespace haptic::sim
