// SPDX-License-Identifier: Apache-2.0
#include "tools/common/toml_file.hpp"

#include <algorithm>

#include "tools/common/error.hpp"
#include "tools/common/files.hpp"

namespace haptic::tools {
namespace {

/// Characters that editors, web pages and word processors put where TOML wants ASCII.
constexpr struct {
  std::string_view utf8;
  const char* what_and_fix;
} kLookAlikes[] = {{"\xE2\x80\x9C", "a typographic quote; write straight ones: \"text\""},
                   {"\xE2\x80\x9D", "a typographic quote; write straight ones: \"text\""},
                   {"\xE2\x80\x9E", "a typographic quote; write straight ones: \"text\""},
                   {"\xE2\x80\x98", "a typographic quote; write straight ones: 'text'"},
                   {"\xE2\x80\x99", "a typographic quote; write straight ones: 'text'"},
                   {"\xC2\xAB", "a typographic quote; write straight ones: \"text\""},
                   {"\xC2\xBB", "a typographic quote; write straight ones: \"text\""},
                   {"\xE2\x88\x92", "a typographic minus; write -"},
                   {"\xE2\x80\x93", "a dash; write -"},
                   {"\xE2\x80\x94", "a dash; write -"},
                   {"\xC2\xA0", "a no-break space; type a plain one"},
                   {"\xE2\x80\xAF", "a no-break space; type a plain one"},
                   {"\xE2\x80\x8B", "a space without width; delete it"},
                   {"\xEF\xBB\xBF", "a byte order mark in the middle of the text; delete it"}};

class TomlScan {
 public:
  TomlScan(std::string_view text, const std::string& file) : text_(text), file_(file) {
    if (text_.starts_with("\xEF\xBB\xBF")) text_.remove_prefix(3);
  }

  void run() {
    if (text_.starts_with("\xFF\xFE") || text_.starts_with("\xFE\xFF"))
      refuse("the file is UTF-16; save it as UTF-8");
    if (text_.starts_with(std::string_view("RTSCENE", 8)))  // with the zero byte of its magic
      throw InputError(file_ + ": is a compiled scene; give the TOML file that this is to be");
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
      for (const auto& [utf8, what_and_fix] : kLookAlikes) {
        if (text_.substr(at_).starts_with(utf8))
          refuse(std::string("not valid TOML: ") + what_and_fix);
      }
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
    const std::size_t begin = at_;
    while (at_ < text_.size() && !ends_line(text_[at_]) && text_[at_] != quote) {
      const bool escape = quote == '"' && text_[at_] == '\\';
      if (escape && !in_word_) check_escape(begin);
      in_word_ ? advance_ascii() : advance();
      if (escape && at_ < text_.size() && !ends_line(text_[at_])) {
        in_word_ ? advance_ascii() : advance();
      }
    }
    if (at_ < text_.size() && text_[at_] == quote) advance();
  }

  /// A backslash of a path in double quotes, `begin` its first character.
  void check_escape(std::size_t begin) const {
    const std::string_view after = text_.substr(at_ + 1);
    if (after.empty() || ends_line(after[0])) return;  // the library says that it is open
    constexpr std::string_view kHex = "0123456789abcdefABCDEF";
    const std::size_t digits = after[0] == 'u' ? 4 : after[0] == 'U' ? 8 : 0;
    const bool known = std::string_view("btnfr\"\\").find(after[0]) != std::string_view::npos;
    if (known || (digits > 0 && after.size() > digits &&
                  after.substr(1, digits).find_first_not_of(kHex) == std::string_view::npos))
      return;
    const std::string_view rest = text_.substr(begin);
    const std::string path(rest.substr(0, rest.find_first_of("\"\r\n")));
    refuse("not valid TOML: in double quotes a backslash begins an escape, and " +
           std::string(text_.substr(at_, 2)) + " is none; put a path in single quotes, '" + path +
           "', or write / for each backslash");
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
  std::string lines;
  if (text.find('\r') != std::string_view::npos && text.find('\n') == std::string_view::npos) {
    lines = text;
    std::ranges::replace(lines, '\r', '\n');
    text = lines;
  }
  check_toml_text(text, file);
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    const toml::source_position at = error.source().begin;
    throw InputError(file + ":" + std::to_string(at.line) + ":" + std::to_string(at.column) +
                     ": not valid TOML: " + std::string(error.description()) +
                     (error.description().ends_with("saw ','")
                          ? "; write decimals with a point, and several numbers in brackets"
                          : "; fix the line"));
  }
}

toml::table read_toml_file(const std::string& path, std::size_t largest_bytes,
                           const std::string& role) {
  return parse_toml(read_text_file(path, largest_bytes, role), path);
}

}  // namespace haptic::tools
