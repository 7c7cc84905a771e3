// SPDX-License-Identifier: Apache-2.0
#include "tools/common/toml_file.hpp"

#include "tools/common/error.hpp"
#include "tools/common/files.hpp"

namespace haptic::tools {
namespace {

class TomlScan {
 public:
  TomlScan(std::string_view text, const std::string& file) : text_(text), file_(file) {
    if (text_.starts_with("\xEF\xBB\xBF")) text_.remove_prefix(3);
  }

  void run() {
    if (text_.starts_with("\xFF\xFE") || text_.starts_with("\xFE\xFF"))
      refuse("the file is UTF-16; save it as UTF-8");
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '#') {
        skip_until_line_end();
      } else if (c == '"' || c == '\'') {
        skip_string(c);
      } else {
        count_key_parts(c);
        follow_word(c);
        advance_ascii();
      }
    }
  }

 private:
  [[noreturn]] void refuse(const std::string& defect_and_mend) const {
    throw InputError(file_ + ":" + std::to_string(line_) + ":" + std::to_string(column_) + ": " +
                     defect_and_mend);
  }

  static bool ends_line(char c) { return c == '\n' || c == '\r' || c == '\v' || c == '\f'; }

  void advance() {
    const auto byte = static_cast<unsigned char>(text_[at_++]);
    if (byte == '\n') {
      ++line_;
      column_ = 1;
    } else if (at_ == text_.size() || (static_cast<unsigned char>(text_[at_]) & 0xC0U) != 0x80U) {
      ++column_;  // the next byte begins a character
    }
  }

  void advance_ascii() {
    if (static_cast<unsigned char>(text_[at_]) >= 0x80U) {
      refuse(
          "not valid TOML: a character beyond ASCII outside of a one-line string; "
          "put it in quotes");
    }
    advance();
  }

  void skip_until_line_end() {
    while (at_ < text_.size() && !ends_line(text_[at_])) advance();
  }

  void skip_string(char quote) {
    if (text_.substr(at_, 3) == std::string(3, quote)) {
      skip_long_string(quote);
      return;
    }
    advance();
    while (at_ < text_.size() && !ends_line(text_[at_]) && text_[at_] != quote) {
      const bool escape = quote == '"' && text_[at_] == '\\';
      in_word_ ? advance_ascii() : advance();
      if (escape && at_ < text_.size() && !ends_line(text_[at_])) {
        in_word_ ? advance_ascii() : advance();
      }
    }
    if (at_ < text_.size() && text_[at_] == quote) advance();
  }

  /// Up to two further quotes belong to the string: """a""""" ends after the fifth.
  void skip_long_string(char quote) {
    for (int i = 0; i < 3; ++i) advance();
    std::size_t quotes = 0;
    while (at_ < text_.size() && (quotes < 3 || (quotes < 5 && text_[at_] == quote))) {
      const char c = text_[at_];
      quotes = c == quote ? quotes + 1 : 0;
      advance_ascii();
      if (quote == '"' && c == '\\' && at_ < text_.size()) advance_ascii();
    }
  }

  /// A quote within a word opens no string: the library takes the whole of 0.5'x' for one bad
  /// value, up to a blank, comma or bracket's end, and looks for a blank beyond ASCII too. Equal
  /// signs end a word only where a key stands.
  void follow_word(char c) {
    const bool in_array = !brackets_.empty() && brackets_.back() == '[';
    if (c == ' ' || c == '\t') {
      in_word_ = false;
    } else if (ends_line(c) || c == ',') {
      in_word_ = false;
      in_value_ = in_array || (c != ',' && !brackets_.empty());
    } else if (c == '=' && !in_value_) {
      in_word_ = false;
      in_value_ = true;
    } else if ((c == '[' || c == '{') && !in_word_) {
      if (in_value_) brackets_ += c;
      in_value_ = in_value_ && c == '[';
    } else {
      in_word_ = true;
      if ((c == ']' || c == '}') && !brackets_.empty()) {
        brackets_.pop_back();
        in_value_ = true;
      }
    }
  }

  /// Dots since the last character that begins a key or a value; a number has one.
  void count_key_parts(char c) {
    if (c == '=' || c == ',' || c == '{' || c == '[' || ends_line(c)) {
      dots_ = 0;
    } else if (c == '.' && ++dots_ >= kMaxTomlKeyParts) {
      refuse("not valid here: a key of more than " + std::to_string(kMaxTomlKeyParts) +
             " parts; the known keys have at most two");
    }
  }

  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0, line_ = 1, column_ = 1, dots_ = 0;
  bool in_word_ = false;   ///< behind a character that begins no string
  bool in_value_ = false;  ///< behind an equal sign, or in an array
  std::string brackets_;   ///< open in values, innermost last
};

}  // namespace

void check_toml_text(std::string_view text, const std::string& file) { TomlScan(text, file).run(); }

toml::table parse_toml(std::string_view text, const std::string& file) {
  check_toml_text(text, file);
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    const toml::source_position at = error.source().begin;
    throw InputError(file + ":" + std::to_string(at.line) + ":" + std::to_string(at.column) +
                     ": not valid TOML: " + std::string(error.description()) + "; fix the line");
  }
}

toml::table read_toml_file(const std::string& path, std::size_t largest_bytes,
                           const std::string& role) {
  return parse_toml(read_text_file(path, largest_bytes, role), path);
}

}  // namespace haptic::tools
