// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A log of another program, a row at a time: text with a separator, or JSON with an object a line.
/// Cells stay text; which of them are numbers is decided by their column.

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace haptic::sim {

/// Largest log that is read: hours of a kilohertz.
inline constexpr std::size_t kMostLogBytes = std::size_t{1} << 29;
/// Most columns of a log, and longest line.
inline constexpr std::size_t kMostLogColumns = 4096, kMostLogLineBytes = std::size_t{1} << 20;

class LogRows {
 public:
  LogRows() = default;
  virtual ~LogRows() = default;
  LogRows(const LogRows&) = delete;
  LogRows& operator=(const LogRows&) = delete;

  /// To the next row; false at the end. @throws tools::InputError with the line.
  virtual bool next() = 0;

  /// Names of the columns, as the file has them; empty where the file has none.
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  /// Cells of the row; at least as many as there are names. An absent member of JSON is empty.
  [[nodiscard]] std::span<const std::string_view> cells() const { return cells_; }
  /// Line of the row in the file, from 1.
  [[nodiscard]] std::size_t line() const { return line_; }
  [[nodiscard]] const std::string& path() const { return path_; }
  /// For a person: "separated by commas", "JSON, an object a line".
  [[nodiscard]] const std::string& form() const { return form_; }
  /// Separated by blanks and without names, as TUM's trajectories are.
  [[nodiscard]] bool is_plain() const { return plain_; }
  /// A comma inside a number stands before the decimals.
  [[nodiscard]] bool has_decimal_commas() const { return decimal_commas_; }

  /// Unit of all lengths, where the file states it beside the names ("millimeters"); empty: it does
  /// not.
  [[nodiscard]] const std::string& length_unit() const { return length_unit_; }

  /// Refuses the row. @throws tools::InputError "PATH:LINE: DEFECT".
  [[noreturn]] void refuse(const std::string& defect) const;

 protected:
  std::string path_, form_, length_unit_;
  std::vector<std::string> names_;
  std::vector<std::string_view> cells_;
  std::size_t line_ = 0;
  bool plain_ = false, decimal_commas_ = false;
};

/// Opens a log, by its first bytes as text or JSON. @throws tools::InputError when it cannot be
/// read, is no text, or holds nothing.
[[nodiscard]] std::unique_ptr<LogRows> open_log(const std::string& path);

/// The same from text. `has_pose`: whether these names hold a pose; a comment at the top that does
/// is the header. Of a header of several lines: log_header.hpp.
using HoldsPose = bool (*)(std::span<const std::string> names);
[[nodiscard]] std::unique_ptr<LogRows> separated_rows(const std::string& path, std::string text,
                                                      HoldsPose has_pose);
[[nodiscard]] std::unique_ptr<LogRows> json_rows(const std::string& path, std::string text);

/// The next line off `rest`, without its end: LF, CR LF or CR alone.
[[nodiscard]] std::string_view take_log_line(std::string_view& rest);
/// Without blanks and tabs at both ends.
[[nodiscard]] std::string_view trimmed(std::string_view text);

}  // namespace haptic::sim
