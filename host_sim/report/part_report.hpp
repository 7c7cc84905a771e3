// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What each part of the reproduction hands back: its files, its section of the index, and its
/// findings next to the paper's.

#include <cstdint>
#include <string>
#include <vector>

#include "tools/common/formatted.hpp"

namespace haptic::sim {

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
