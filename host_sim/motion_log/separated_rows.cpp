// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "host_sim/motion_log/log_header.hpp"
#include "host_sim/motion_log/log_number.hpp"
#include "host_sim/motion_log/log_rows.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

bool is_comment(std::string_view line) { return line.starts_with('#') || line.starts_with('%'); }

/// The separator of a line: of these the first that it has outside quotes; else blanks.
char separator_of(std::string_view line) {
  for (const char separator : {';', '\t', ','}) {
    bool quoted = false;
    for (const char c : line) {
      if (c == '"') quoted = !quoted;
      if (c == separator && !quoted) return separator;
    }
  }
  return ' ';
}

std::string name_of(char separator) {
  if (separator == ';') return "semicolons";
  if (separator == '\t') return "tabs";
  return separator == ',' ? "commas" : "blanks";
}

// A row of a log has a position and a turn at least.
constexpr std::size_t kLeastRow = 6;

class SeparatedRows : public LogRows {
 public:
  SeparatedRows(const std::string& path, std::string text, HoldsPose has_pose)
      : text_(std::move(text)), rest_(text_) {
    path_ = path;
    find_first_row(has_pose);
    form_ = "separated by " + name_of(separator_);
    plain_ = names_.empty() && separator_ == ' ';
    decimal_commas_ = separator_ == ';' || separator_ == '\t';
  }

  bool next() override {
    while (!rest_.empty()) {
      ++line_;
      const std::string_view line = trimmed_line(take_log_line(rest_));
      if (line.empty() || is_comment(line)) continue;
      split(line);
      require_width();
      return true;
    }
    return false;
  }

 private:
  struct Place {
    std::string_view rest;
    std::size_t line = 0;
    char separator = ',';
  };

  // A tab at the end separates; in a file of blanks it does not.
  [[nodiscard]] std::string_view trimmed_line(std::string_view line) const {
    return separator_ == '\t' && line.find_first_not_of(" \t") != std::string_view::npos
               ? line
               : trimmed(line);
  }

  // Names from the lines before the first row of numbers, or from a comment before them.
  void find_first_row(HoldsPose has_pose) {
    std::vector<std::string> commented;
    std::vector<std::vector<std::string>> lines;
    std::vector<Place> places;  // behind each of `lines`
    while (!rest_.empty() && lines.size() < kMostHeaderLines) {
      const Place before{rest_, line_, separator_};
      const std::string_view whole = take_log_line(rest_);
      std::string_view line = trimmed(whole);
      ++line_;
      if (line.empty() || line.starts_with("sep=")) continue;
      const bool comment = is_comment(line);
      if (comment) line.remove_prefix(1);
      separator_ = separator_of(line);
      split(comment ? trimmed(line) : trimmed_line(whole));
      std::vector<std::string> names(cells_.begin(), cells_.end());
      if (comment) {
        if (has_pose(names)) commented = std::move(names);
        continue;
      }
      const bool numbers = is_row_of_numbers();
      if (numbers && lines.empty()) {
        names_ = std::move(commented);
        rest_ = before.rest;  // read again as a row
        line_ = before.line;
        return;
      }
      // Numbers may stand above the names: a rate alone, identities behind an empty cell.
      if (numbers && names.size() >= kLeastRow && !names.front().empty()) break;
      lines.push_back(std::move(names));
      places.push_back({rest_, line_, separator_});
    }
    if (lines.empty()) {  // nothing but comments: one may be a header without rows
      names_ = std::move(commented);
      return;
    }
    take_header(header_among(lines, has_pose), places);
  }

  void take_header(LogHeader header, const std::vector<Place>& places) {
    names_ = std::move(header.names);
    length_unit_ = header.length_unit;
    const Place& behind = places[header.line];
    rest_ = behind.rest;
    line_ = behind.line;
    separator_ = behind.separator;
    drop_empty_tail();
    std::string_view after = rest_;
    const std::string_view below = take_log_line(after);
    if (trimmed(below).empty() || is_comment(trimmed(below))) return;
    split(trimmed_line(below));
    if (!is_unit_row(cells_)) return;
    add_units(cells_, names_);
    rest_ = after;
    ++line_;
  }

  // A separator at the end of the header makes no column.
  void drop_empty_tail() {
    while (!names_.empty() && names_.back().empty()) names_.pop_back();
  }

  // Most of its fields are numbers; a frame's name may be among them.
  [[nodiscard]] bool is_row_of_numbers() const {
    const bool commas = separator_ == ';' || separator_ == '\t';
    std::size_t numbers = 0, texts = 0;
    for (const std::string_view cell : cells_) {
      const bool number = log_number(cell, commas).has_value() || is_not_finite_word(cell);
      if (!cell.empty()) ++(number ? numbers : texts);
    }
    return numbers >= texts;
  }

  void require_width() {
    const std::size_t width = names_.empty() ? first_width_ : names_.size();
    if (names_.empty() && first_width_ == 0) {
      while (!cells_.empty() && cells_.back().empty()) cells_.pop_back();
      first_width_ = cells_.size();
      return;
    }
    if (cells_.size() < width) {
      refuse("has " + std::to_string(cells_.size()) + " fields where the rows have " +
             std::to_string(width) + "; complete or remove the line");
    }
    for (std::size_t k = width; k < cells_.size(); ++k) {
      if (cells_[k].empty()) continue;
      refuse("has more than " + std::to_string(width) +
             " fields; quote texts that hold the separator, write numbers with a point");
    }
    cells_.resize(width);
  }

  void split(std::string_view line) {
    if (line.size() > kMostLogLineBytes) {
      refuse("the line has more than " + std::to_string(kMostLogLineBytes) +
             " bytes; give a log with a pose a line");
    }
    cells_.clear();
    unquoted_.clear();
    unquoted_.reserve(line.size());  // views into it must stay
    std::string_view rest = line;
    bool more = true;
    while (more) {
      if (cells_.size() == kMostLogColumns)
        refuse("has more than " + std::to_string(kMostLogColumns) + " fields; leave some out");
      rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
      if (separator_ == ' ' && rest.empty() && !cells_.empty()) return;
      more = rest.starts_with('"') ? take_quoted(rest) : take_bare(rest);
    }
  }

  // Both take a field and its separator off `rest`; true where there was a separator.
  bool take_bare(std::string_view& rest) {
    const std::size_t end = separator_ == ' ' ? rest.find_first_of(" \t") : rest.find(separator_);
    cells_.push_back(trimmed(rest.substr(0, end)));
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    return end != std::string_view::npos;
  }

  bool take_quoted(std::string_view& rest) {
    const std::size_t begin = unquoted_.size();
    std::size_t at = 1;
    for (;; ++at) {
      if (at >= rest.size()) refuse("a quote does not end; close it on its line");
      if (rest[at] != '"') {
        unquoted_ += rest[at];
      } else if (at + 1 < rest.size() && rest[at + 1] == '"') {
        unquoted_ += rest[at++];
      } else {
        break;
      }
    }
    cells_.push_back(trimmed(std::string_view(unquoted_).substr(begin)));
    rest.remove_prefix(at + 1);
    const std::size_t after = std::min(rest.find_first_not_of(' '), rest.size());
    if (after == rest.size()) {
      rest = {};
      return false;
    }
    const bool apart = separator_ == ' ' ? after > 0 : rest[after] == separator_;
    if (!apart) refuse("text follows a closed quote; separate the fields");
    rest.remove_prefix(separator_ == ' ' ? after : after + 1);
    return true;
  }

  std::string text_, unquoted_;
  std::string_view rest_;
  char separator_ = ',';
  std::size_t first_width_ = 0;
};

}  // namespace

std::unique_ptr<LogRows> separated_rows(const std::string& path, std::string text,
                                        HoldsPose has_pose) {
  return std::make_unique<SeparatedRows>(path, std::move(text), has_pose);
}

}  // namespace haptic::sim
