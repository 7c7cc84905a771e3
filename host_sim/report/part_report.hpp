// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Parts of reports: typed tables, whole files, and what each part hands back: its files, its
/// section of the index, and its findings next to what is stated.

#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/common/formatted.hpp"

namespace haptic::sim {

// A table of a report: columns by name, with their unit, and typed cells; written as CSV, JSON
// and Markdown.

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

// Files that appear whole or not at all.

/// tools::write_files (tools/common/files.hpp) of one file.
void write_whole_file(const std::string& path, std::string_view content);

/// Appends `value` with 17 significant digits (a double reads back as itself, -0 as 0); "nan",
/// "inf" as the C library has them.
void append_number(std::string& text, double value);

using tools::short_number;

/// How much work. All random draws are seeded: equal options give equal files, timing apart.
struct ReproductionSize {
  bool quick = false;     ///< small counts, for tests: the same tables with wider scatter
  bool progress = false;  ///< a line per part on stderr

  [[nodiscard]] std::uint32_t pick(std::uint32_t full, std::uint32_t small) const {
    return quick ? small : full;
  }
};

/// One number or fact of the paper next to ours.
struct Finding {
  std::string topic, paper, ours;
  std::string same;    ///< "yes", "no", or in what sense
  std::string reason;  ///< where it differs, or where the paper leaves it open
};

struct OutputText {
  std::string name;  ///< file name in the output folder
  std::string content;
};

struct PartReport {
  std::string title;
  std::string markdown;  ///< section of the index: tables, words, pictures by file name
  std::vector<OutputText> files;
  std::vector<Finding> findings;
  bool passed = true;  ///< false: something that must hold does not
};

[[nodiscard]] inline const char* yes_or_no(bool agrees) { return agrees ? "yes" : "no"; }

/// A line of a Markdown table.
[[nodiscard]] std::string table_row(const std::vector<std::string>& cells);
/// Header and rule of a Markdown table.
[[nodiscard]] std::string table_head(const std::vector<std::string>& cells);
/// "a; b; c".
[[nodiscard]] std::string joined(const std::vector<std::string>& words);

/// Fixed digits; no negative zero.
[[nodiscard]] std::string fixed(double value, int digits);
/// A picture in Markdown.
[[nodiscard]] std::string picture_line(const std::string& file, const std::string& words);

}  // namespace haptic::sim
