// SPDX-License-Identifier: Apache-2.0
#include "tools/common/svg.hpp"

#include <algorithm>

#include "tools/common/formatted.hpp"

namespace haptic::tools {
namespace {

/// Bytes of the UTF-8 character at the head of `text`; 0 where its bytes are none.
std::size_t utf8_bytes(std::string_view text) {
  const auto head = static_cast<unsigned char>(text.front());
  const std::size_t bytes = head < 0x80   ? 1
                            : head < 0xc2 ? 0
                            : head < 0xe0 ? 2
                            : head < 0xf0 ? 3
                            : head < 0xf5 ? 4
                                          : 0;
  if (bytes == 0 || bytes > text.size()) return 0;
  const auto follows = [](char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; };
  return std::ranges::all_of(text.substr(1, bytes - 1), follows) ? bytes : 0;
}

std::string points_of(std::span<const Pixel> points) {
  std::string list;
  for (const Pixel& p : points) list += pixel(p.x) + "," + pixel(p.y) + " ";
  return list;
}

}  // namespace

std::string xml_escaped(std::string_view text) {
  std::string safe;
  while (!text.empty()) {
    const std::size_t bytes = utf8_bytes(text);
    switch (const char c = text.front()) {
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
        if (bytes == 0 || static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
          safe += '?';
        } else {
          safe += text.substr(0, bytes);
        }
    }
    text.remove_prefix(std::max<std::size_t>(1, bytes));
  }
  return safe;
}

std::string pixel(double value) { return formatted("%.1f", value); }

std::string svg_document(double width, double height, std::string_view content) {
  const std::string w = pixel(width), h = pixel(height);
  std::string svg =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
      "width=\"" +
      w + "\" height=\"" + h + "\" viewBox=\"0 0 " + w + " " + h +
      "\" font-family=\"sans-serif\">\n<rect width=\"" + w + "\" height=\"" + h +
      "\" fill=\"#ffffff\"/>\n";
  svg += content;
  return svg + "</svg>\n";
}

std::string text_at(double x, double y, const std::string& text, const char* anchor, int size,
                    const char* extra) {
  return "<text x=\"" + pixel(x) + "\" y=\"" + pixel(y) + "\" text-anchor=\"" + anchor +
         "\" font-size=\"" + std::to_string(size) + "\" " + extra + ">" + xml_escaped(text) +
         "</text>\n";
}

std::string heading_at(double x, double y, const std::string& text) {
  return text_at(x, y, text, "start", 18, "font-weight=\"bold\"");
}

std::string line_at(Pixel from, Pixel to, const std::string& colour, double width,
                    const char* dashes) {
  return formatted("<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"%s\" ", from.x,
                   from.y, to.x, to.y, colour.c_str()) +
         formatted("stroke-width=\"%.2f\"", width) +
         (*dashes != 0 ? formatted(" stroke-dasharray=\"%s\"/>\n", dashes) : "/>\n");
}

std::string rectangle_at(Pixel corner, double width, double height, const std::string& fill,
                         const char* extra) {
  return formatted("<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"%s\" %s/>\n",
                   corner.x, corner.y, width, height, fill.c_str(), extra);
}

std::string polygon_of(std::span<const Pixel> points, const std::string& style) {
  return "<polygon points=\"" + points_of(points) + "\" " + style + "/>\n";
}

std::string polyline_of(std::span<const Pixel> points, const std::string& colour, double width,
                        const char* dashes) {
  return "<polyline fill=\"none\" stroke=\"" + colour + "\" stroke-width=\"" + pixel(width) + "\"" +
         (*dashes != 0 ? formatted(" stroke-dasharray=\"%s\"", dashes) : "") + " points=\"" +
         points_of(points) + "\"/>\n";
}

}  // namespace haptic::tools
