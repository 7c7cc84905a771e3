// SPDX-License-Identifier: Apache-2.0
#include "host_sim/report/part_report.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <span>

#include "tools/common/files.hpp"

namespace haptic::sim {

Cell::Cell(const std::string& text)
    : shown(text),
      json(nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)) {}

Cell::Cell(double number) {
  append_number(shown, number);
  if (std::isfinite(number)) json = nlohmann::json(number).dump();
}

Cell shown_as(const char* format, double number) {
  Cell cell(number);
  char buffer[48] = "";
  if (!std::isnan(number)) std::snprintf(buffer, sizeof buffer, format, number);
  cell.shown = tools::unsigned_zero(std::string(buffer));
  return cell;
}

ReportTable::ReportTable(std::string_view columns) {
  std::size_t end = columns.find(',');
  for (; end != std::string_view::npos; end = columns.find(',')) {
    columns_.emplace_back(columns.substr(0, end));
    columns.remove_prefix(end + 1);
  }
  columns_.emplace_back(columns);
}

std::string ReportTable::csv(Names without) const {
  std::string text;
  const auto add_line = [&](const auto& shown) {
    std::string line;
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      if (std::ranges::find(without, columns_[k]) == without.end()) line += "," + shown(k);
    }
    text += line.substr(1) + "\n";
  };
  add_line([this](std::size_t k) { return columns_[k]; });
  for (const auto& row : rows_) add_line([&row](std::size_t k) { return row.at(k).shown; });
  return text;
}

nlohmann::ordered_json ReportTable::json(Names without) const {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const auto& row : rows_) {
    nlohmann::ordered_json& object = list.emplace_back(nlohmann::ordered_json::object());
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      if (std::ranges::find(without, columns_[k]) == without.end())
        object[columns_[k]] = nlohmann::ordered_json::parse(row.at(k).json);
    }
  }
  return list;
}

std::string ReportTable::markdown() const {
  std::string text = table_head(columns_);
  for (const auto& row : rows_) {
    std::vector<std::string> shown;
    for (const Cell& cell : row) shown.push_back(cell.shown);
    text += table_row(shown);
  }
  return text;
}

void write_whole_file(const std::string& path, std::string_view content) {
  tools::write_files({{path, std::as_bytes(std::span(content))}});
}

void append_number(std::string& text, double value) {
  char buffer[40];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, tools::unsigned_zero(value),
                                 std::chars_format::general, 17);
  text.append(buffer, end.ptr);
}

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
