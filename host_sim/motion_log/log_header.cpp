// SPDX-License-Identifier: Apache-2.0
#include "host_sim/motion_log/log_header.hpp"

#include <algorithm>
#include <array>
#include <set>

#include "host_sim/motion_log/column_name.hpp"

namespace haptic::sim {
namespace {

using Lines = std::span<const std::vector<std::string>>;

std::size_t filled(const std::vector<std::string>& cells) {
  return static_cast<std::size_t>(
      std::ranges::count_if(cells, [](const std::string& cell) { return !cell.empty(); }));
}

/// A letter that means nothing without what stands above it.
bool is_bare_axis(const std::string& name) {
  const ColumnName read = column_name(name);
  return read.axis != 0 && read.stem.empty();
}

/// The names of `line` with those of up to `levels` lines above before bare axes, and for no name.
std::vector<std::string> with_above(Lines lines, std::size_t line, std::size_t levels) {
  std::vector<std::string> names = lines[line];
  for (std::size_t k = 0; k < names.size(); ++k) {
    const bool bare = is_bare_axis(lines[line][k]);
    for (std::size_t up = 1; up <= levels; ++up) {
      const std::vector<std::string>& above = lines[line - up];
      if (k >= above.size() || above[k].empty()) continue;
      if (bare) names[k] = above[k] + " " + names[k];
      if (names[k].empty()) names[k] = above[k];
    }
  }
  return names;
}

bool has_axis_twice(const std::vector<std::string>& names) {
  std::set<std::string_view> seen;
  return std::ranges::any_of(names, [&](const std::string& name) {
    return column_name(name).axis != 0 && !seen.insert(name).second;
  });
}

/// "Length Units,Millimeters" in a line above.
std::string stated_length_unit(Lines lines) {
  for (const std::vector<std::string>& cells : lines) {
    for (std::size_t k = 0; k + 1 < cells.size(); ++k) {
      if (column_name(cells[k]).whole == "lengthunits") return column_name(cells[k + 1]).whole;
    }
  }
  return {};
}

constexpr std::array<std::string_view, 12> kOtherUnits = {
    "rad", "deg", "degrees", "n", "nm", "m/s", "mm/s", "rad/s", "hz", "-", "1", "count"};

std::string unit_in(std::string_view cell) {
  std::string text(cell);
  if (text.size() > 2 && (text.front() == '[' || text.front() == '(')) {
    text.erase(0, 1);
    text.pop_back();
  }
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 32);
  return text;
}

}  // namespace

LogHeader header_among(Lines lines, HoldsPose holds_pose) {
  for (std::size_t line = 0; line < lines.size(); ++line) {
    for (std::size_t levels = 0; levels <= line; ++levels) {
      std::vector<std::string> names = with_above(lines, line, levels);
      if (!holds_pose(names) || (levels < line && has_axis_twice(names))) continue;
      return {line, std::move(names), stated_length_unit(lines.first(line))};
    }
  }
  const auto widest = std::ranges::max_element(lines, {}, &filled);
  const auto line = static_cast<std::size_t>(widest - lines.begin());
  return {line, *widest, stated_length_unit(lines.first(line))};
}

bool is_unit_row(std::span<const std::string_view> cells) {
  bool any = false;
  for (const std::string_view cell : cells) {
    if (cell.empty()) continue;
    const std::string unit = unit_in(cell);
    const bool length_or_time = length_unit_m(unit).has_value() || time_unit_s(unit).has_value();
    if (!length_or_time && std::ranges::find(kOtherUnits, unit) == kOtherUnits.end()) return false;
    any = any || length_or_time;
  }
  return any;
}

void add_units(std::span<const std::string_view> cells, std::vector<std::string>& names) {
  for (std::size_t k = 0; k < std::min(cells.size(), names.size()); ++k) {
    const std::string unit = unit_in(cells[k]);
    const bool known = length_unit_m(unit).has_value() || time_unit_s(unit).has_value();
    if (known && column_name(names[k]).unit.empty()) names[k] += " [" + unit + "]";
  }
}

}  // namespace haptic::sim
