// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Lines, words and numbers of the text mesh formats, and the wording of what is wrong with them.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

/// Throws InputError "file:line: defect; fix".
[[noreturn]] void refuse_line(const std::string& file, std::size_t line, const std::string& defect,
                              const std::string& fix);
/// Throws InputError "file: byte N: defect; fix".
[[noreturn]] void refuse_byte(const std::string& file, std::size_t byte, const std::string& defect,
                              const std::string& fix);
/// Throws InputError "file: defect; fix".
[[noreturn]] void refuse_file(const std::string& file, const std::string& defect,
                              const std::string& fix);

/// @throws InputError  a mesh file that is empty or larger than `kMaxMeshBytes`.
void check_mesh_bytes(std::uintmax_t bytes, const std::string& file);

/// A word of the file, quoted for a message: cut to a readable length, unprintable bytes replaced.
std::string shown_word(std::string_view word);

/// A name, such as that of a file, quoted for a message: whole, so that it can be looked for.
std::string shown_name(std::string_view name);

/// Drops a UTF-8 byte order mark; refuses UTF-16 and bytes that no text holds.
/// @throws InputError
std::string_view checked_text(std::span<const char> bytes, const std::string& file);

/// Splits text into lines (LF, CRLF, CR) and lines into words. Comments start with `#` where
/// enabled. With `continuation`, a backslash at the end of a line joins the next one to it.
class LineScanner {
 public:
  struct Options {
    bool comments = true;
    bool continuation = false;
  };
  LineScanner(std::string_view text, Options options) : text_(text), options_(options) {}

  /// Words of the next line that has any. False at the end of the text. The words point into the
  /// text.
  bool next(std::vector<std::string_view>& words);
  /// 1-based number of the line where the last words began; after the end: of the last line.
  std::size_t line() const { return first_line_; }
  /// True if the last line of words reached the end of the text without a line end.
  bool at_unfinished_line() const { return unfinished_; }

 private:
  std::string_view next_physical_line();
  std::string_view text_;
  Options options_;
  std::size_t position_ = 0;
  std::size_t line_ = 0;
  std::size_t first_line_ = 0;
  bool unfinished_ = false;
};

/// Finest printed place of the coordinates: digits after the decimal point, less the exponent. The
/// numbers of one file are taken to be printed alike, hence the largest count.
struct PrintedDigits {
  int most = 0;
  bool any = false;
  /// 10^-most; 0 if no number was seen.
  double resolution() const;
};

/// A finite number in the C locale, the whole word. Sets the digits of `printed` if given.
/// @throws InputError (decimal comma, NaN, infinity, overflow, trailing characters).
double parse_number(std::string_view word, const std::string& file, std::size_t line,
                    const char* what, PrintedDigits* printed);

/// A decimal integer, the whole word. @throws InputError (not an integer, overflow).
std::int64_t parse_integer(std::string_view word, const std::string& file, std::size_t line,
                           const char* what);

/// Case-insensitive comparison with a lower-case ASCII word.
bool equals_lower(std::string_view word, std::string_view lower);

/// Parsers of the formats; `text` has passed checked_text.
RawMesh parse_obj(std::string_view text, const std::string& file);
RawMesh parse_off(std::string_view text, const std::string& file);
RawMesh parse_ply(std::span<const char> bytes, const std::string& file);
RawMesh parse_stl_text(std::string_view text, const std::string& file);
/// All of it, with what stands behind the last triangle; the first count has room in the file.
RawMesh parse_stl_binary(std::span<const char> bytes, const std::string& file);
/// Decides between the two forms of STL by the size that the triangle count announces.
/// @throws InputError for a count beyond the end of the file and a file too short for its header.
RawMesh parse_stl(std::span<const char> bytes, const std::string& file);

}  // namespace haptic::tools
