// SPDX-License-Identifier: Apache-2.0
#include "host_sim/report/part_report.hpp"

#include <cmath>
#include <cstdio>

namespace haptic::sim {

std::string table_row(const std::vector<std::string>& cells) {
  std::string line = "|";
  for (const std::string& cell : cells) line += " " + cell + " |";
  return line + "\n";
}

std::string table_head(const std::vector<std::string>& cells) {
  std::string rule = "|";
  for (std::size_t k = 0; k < cells.size(); ++k) rule += "---|";
  return table_row(cells) + rule + "\n";
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : "; ") + word;
  return text;
}

std::string fixed(double value, int digits) {
  char buffer[48];
  const double half = 0.5 * std::pow(10.0, -digits);
  std::snprintf(buffer, sizeof buffer, "%.*f", digits, std::abs(value) < half ? 0.0 : value);
  return buffer;
}

std::string picture_line(const std::string& file, const std::string& words) {
  return "![" + words + "](" + file + ")\n";
}

}  // namespace haptic::sim
