// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Strict reading of one TOML table: every value has a type, a range and a place, and every key
/// must be known.

#include <toml++/toml.h>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/common/file_place.hpp"

namespace haptic::tools {

/// Interval of allowed values [low, high], or (low, high] when `open_low`.
struct Range {
  double low, high;
  bool open_low = false;
};

/// Tolerance of the length of a quaternion as people type it, the same as host_sim has for motions:
/// beyond it one of the numbers is wrong.
inline constexpr double kQuaternionTolerance = 1.0e-3;

class TomlTable {
 public:
  /// @param name  for messages: "[moving]"; empty for the top level.
  /// @throws InputError "file:line:column: ..." for a key that is not in `known`, with the nearest
  /// known one.
  TomlTable(const toml::table& table, std::string file, std::string name,
            std::vector<std::string_view> known);

  /// True where the key holds a string.
  [[nodiscard]] bool is_text(std::string_view key) const;
  [[nodiscard]] bool has(std::string_view key) const { return table_->contains(key); }
  /// Place of the value, or of the table where the key is absent.
  [[nodiscard]] FilePlace place(std::string_view key) const;

  // Readers: absent keys give nullopt; a value of the wrong type or out of range throws InputError
  // with its place.
  [[nodiscard]] std::optional<double> number(std::string_view key, const Range& range) const;
  [[nodiscard]] std::optional<std::int64_t> integer(std::string_view key) const;
  [[nodiscard]] std::optional<std::string> text(std::string_view key) const;
  /// The name of a file: a text without control characters, which a backslash makes in double
  /// quotes.
  [[nodiscard]] std::optional<std::string> path(std::string_view key) const;
  [[nodiscard]] std::optional<bool> flag(std::string_view key) const;
  /// An array of two strings, neither empty.
  [[nodiscard]] std::optional<std::array<std::string, 2>> word_pair(std::string_view key) const;
  /// An array of such arrays; empty when absent.
  [[nodiscard]] std::vector<std::array<std::string, 2>> word_pairs(std::string_view key) const;
  [[nodiscard]] std::optional<std::array<double, 3>> vector3(std::string_view key,
                                                             const Range& range) const;
  /// One number for all three, or an array of three.
  [[nodiscard]] std::optional<std::array<double, 3>> scale3(std::string_view key,
                                                            const Range& range) const;
  /// An array of four numbers.
  [[nodiscard]] std::optional<std::array<double, 4>> vector4(std::string_view key,
                                                             const Range& range) const;
  /// { w, x, y, z } within 1e-6 of unit length, with `notes` within kQuaternionTolerance;
  /// normalised. One that is off by more than 1e-6, as numbers of four digits are, is noted.
  [[nodiscard]] std::optional<std::array<double, 4>> quaternion_wxyz(
      std::string_view key, std::vector<std::string>* notes = nullptr) const;
  /// The same of numbers that were read: `q` becomes of unit length. @throws InputError
  void normalise(std::string_view key, std::array<double, 4>& q,
                 std::vector<std::string>* notes) const;
  [[nodiscard]] std::optional<TomlTable> table(std::string_view key,
                                               std::vector<std::string_view> known) const;
  /// The tables of `[[key]]`; empty when absent.
  [[nodiscard]] std::vector<TomlTable> tables(std::string_view key,
                                              std::vector<std::string_view> known) const;

  [[noreturn]] void fail(std::string_view key, const std::string& defect_and_mend) const;
  [[noreturn]] void fail_missing(std::string_view key, const std::string& fix) const;

 private:
  /// `what`: of the node, for messages.
  [[nodiscard]] std::array<std::string, 2> words_of(const toml::node& node,
                                                    const std::string& what) const;
  [[nodiscard]] double number_of(const toml::node& node, const std::string& what,
                                 const Range& range) const;
  template <std::size_t kCount>
  [[nodiscard]] std::optional<std::array<double, kCount>> numbers(std::string_view key,
                                                                  const char* wanted,
                                                                  const Range& range) const;
  [[nodiscard]] std::string full_name(std::string_view key) const;
  [[noreturn]] void fail_at(const toml::source_region& region, const std::string& text) const;

  const toml::table* table_;
  std::string file_, name_;
};

/// Known word with the fewest edits from `word`, or empty when none is near.
std::string nearest_word(std::string_view word, const std::vector<std::string_view>& known);

}  // namespace haptic::tools
