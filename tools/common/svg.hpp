// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Marks of an SVG picture: text, lines and shapes. Coordinates in pixels, y downwards.

#include <span>
#include <string>
#include <string_view>

namespace haptic::tools {

struct Pixel {
  double x = 0, y = 0;
};

/// Text made safe for XML: control characters and bytes that are not UTF-8 become question marks.
[[nodiscard]] std::string xml_escaped(std::string_view text);

/// A pixel coordinate with one decimal.
[[nodiscard]] std::string pixel(double value);

/// A whole document of this size with a white ground.
[[nodiscard]] std::string svg_document(double width, double height, std::string_view content);

/// `extra`: more attributes.
[[nodiscard]] std::string text_at(double x, double y, const std::string& text, const char* anchor,
                                  int size, const char* extra = "");
/// The heading of a picture.
[[nodiscard]] std::string heading_at(double x, double y, const std::string& text);

[[nodiscard]] std::string line_at(Pixel from, Pixel to, const std::string& colour, double width = 1,
                                  const char* dashes = "");
[[nodiscard]] std::string rectangle_at(Pixel corner, double width, double height,
                                       const std::string& fill, const char* extra = "");
/// `style`: its attributes.
[[nodiscard]] std::string polygon_of(std::span<const Pixel> points, const std::string& style);
[[nodiscard]] std::string polyline_of(std::span<const Pixel> points, const std::string& colour,
                                      double width, const char* dashes = "");

}  // namespace haptic::tools
