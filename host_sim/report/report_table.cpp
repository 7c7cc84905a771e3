// SPDX-License-Identifier: Apache-2.0
#include "host_sim/report/report_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "host_sim/report/output_file.hpp"
#include "host_sim/report/part_report.hpp"

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
  cell.shown = buffer;
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

}  // namespace haptic::sim
