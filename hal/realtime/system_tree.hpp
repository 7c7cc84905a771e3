// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Statements of Linux about itself in files: /sys and /proc below a root, which is "/" or, in
/// tests, a folder that stands for another machine.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace haptic::hal {

/// Reads only; keeps nothing. Paths are absolute ("/sys/kernel/realtime"). Not for a loop.
class SystemTree {
 public:
  explicit SystemTree(std::filesystem::path root = "/") : root_(std::move(root)) {}

  [[nodiscard]] bool has(const std::string& path) const;
  /// The whole file without blanks at its end; none where it cannot be read. Links are followed.
  [[nodiscard]] std::optional<std::string> text(const std::string& path) const;
  /// The decimal number that a file begins with.
  [[nodiscard]] std::optional<std::int64_t> number(const std::string& path) const;
  /// Names in a folder, sorted; empty where there is none.
  [[nodiscard]] std::vector<std::string> names(const std::string& folder) const;

 private:
  [[nodiscard]] std::filesystem::path below(const std::string& path) const;

  std::filesystem::path root_;
};

/// Text that follows `key` on the first line that begins with it, without blanks around; empty if
/// no line does.
[[nodiscard]] std::string value_after(const std::string& text, std::string_view key);

/// True if `word` is one of the blank-separated words of `text`.
[[nodiscard]] bool has_word(std::string_view text, std::string_view word);

/// "0-1,3" as the kernel writes lists of processors: {0, 1, 3}. Empty for what is no such list.
[[nodiscard]] std::vector<int> parse_cpu_list(const std::string& text);
/// The reverse, ranges joined: "0-1,3"; "none" for no processor.
[[nodiscard]] std::string cpu_list_text(std::vector<int> cpus);

/// A mask as the kernel writes it, "ff,ffff0000": its processors. Empty for what is none.
[[nodiscard]] std::vector<int> parse_cpu_mask(const std::string& text);
/// The reverse, as the kernel takes it: "c"; words of 32 bits with commas.
[[nodiscard]] std::string cpu_mask_text(const std::vector<int>& cpus);

}  // namespace haptic::hal
