// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A table of a report: columns by name, with their unit, and typed cells; written as CSV, JSON
/// and Markdown.

#include <concepts>
#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace haptic::sim {

/// Nothing, text, a whole number, or a number: how it is shown, and its value in JSON.
struct Cell {
  Cell() = default;
  Cell(const std::string& text);
  Cell(const char* text) : Cell(std::string(text)) {}
  Cell(std::integral auto number) : shown(std::to_string(number)), json(shown) {}
  /// 17 digits: it reads back as itself.
  Cell(double number);

  std::string shown, json = "null";
};

/// Shown by a printf format; as nothing where the number is not known (NaN).
[[nodiscard]] Cell shown_as(const char* format, double number);
/// In quotation marks, for words that may hold commas.
[[nodiscard]] inline Cell quoted(const std::string& words) { return "\"" + words + "\""; }

class ReportTable {
 public:
  /// Names of the columns, as the header of a CSV file has them: "path,law,force_n".
  explicit ReportTable(std::string_view columns);

  void add(std::vector<Cell> row) { rows_.push_back(std::move(row)); }

  using Names = std::initializer_list<std::string_view>;
  /// Header and one line per row, but for the columns `without`.
  [[nodiscard]] std::string csv(Names without = {}) const;
  /// An object per row; what is not known is null.
  [[nodiscard]] nlohmann::ordered_json json(Names without = {}) const;
  [[nodiscard]] std::string markdown() const;

 private:
  std::vector<std::string> columns_;
  std::vector<std::vector<Cell>> rows_;
};

}  // namespace haptic::sim
