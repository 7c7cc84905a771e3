// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/system_tree.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <iterator>

namespace haptic::hal {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

// A number of processors that no machine reaches: a damaged list must not fill the memory.
constexpr int kMostCpus = 65'536;

std::string trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return "";
  return std::string(text.substr(first, text.find_last_not_of(kBlanks) - first + 1));
}

bool parse_cpu(std::string_view text, int& cpu) {
  const auto result = std::from_chars(text.data(), text.data() + text.size(), cpu);
  return result.ec == std::errc{} && result.ptr == text.data() + text.size() && cpu >= 0 &&
         cpu < kMostCpus;
}

}  // namespace

std::filesystem::path SystemTree::below(const std::string& path) const {
  return root_ / std::filesystem::path(path).relative_path();
}

bool SystemTree::has(const std::string& path) const {
  std::error_code ignored;
  return std::filesystem::exists(below(path), ignored);
}

std::optional<std::string> SystemTree::text(const std::string& path) const {
  std::error_code ignored;
  // A folder opens, but has nothing to read.
  if (std::filesystem::is_directory(below(path), ignored)) return std::nullopt;
  std::ifstream stream(below(path), std::ios::binary);
  if (!stream) return std::nullopt;
  std::string all{std::istreambuf_iterator<char>(stream), {}};
  if (stream.bad()) return std::nullopt;
  const std::size_t last = all.find_last_not_of(kBlanks);
  all.resize(last == std::string::npos ? 0 : last + 1);
  return all;
}

std::optional<std::int64_t> SystemTree::number(const std::string& path) const {
  const std::optional<std::string> all = text(path);
  std::int64_t value = 0;
  if (!all || std::from_chars(all->data(), all->data() + all->size(), value).ec != std::errc{})
    return std::nullopt;
  return value;
}

std::vector<std::string> SystemTree::names(const std::string& folder) const {
  std::vector<std::string> found;
  std::error_code error;
  std::filesystem::directory_iterator entry(below(folder), error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error))
    found.push_back(entry->path().filename().string());
  std::sort(found.begin(), found.end());
  return found;
}

std::string value_after(const std::string& text, std::string_view key) {
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = std::string_view(text).substr(begin, end - begin);
    if (line.starts_with(key)) return trimmed(line.substr(key.size()));
    begin = end + 1;
  }
  return "";
}

bool has_word(std::string_view text, std::string_view word) {
  std::size_t begin = text.find_first_not_of(kBlanks);
  while (begin != std::string_view::npos) {
    const std::size_t end = std::min(text.find_first_of(kBlanks, begin), text.size());
    if (text.substr(begin, end - begin) == word) return true;
    begin = text.find_first_not_of(kBlanks, end);
  }
  return false;
}

std::vector<int> parse_cpu_list(const std::string& text) {
  std::vector<int> cpus;
  const std::string list = trimmed(text);
  std::size_t begin = 0;
  while (begin < list.size()) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    const std::string_view part = std::string_view(list).substr(begin, end - begin);
    const std::size_t dash = part.find('-');
    int first = 0, last = 0;
    if (!parse_cpu(part.substr(0, dash), first)) return {};
    last = first;
    if (dash != std::string_view::npos && !parse_cpu(part.substr(dash + 1), last)) return {};
    for (int cpu = first; cpu <= last; ++cpu) cpus.push_back(cpu);
    begin = end + 1;
  }
  return cpus;
}

std::string cpu_list_text(std::vector<int> cpus) {
  if (cpus.empty()) return "none";
  std::sort(cpus.begin(), cpus.end());
  cpus.erase(std::unique(cpus.begin(), cpus.end()), cpus.end());
  std::string text;
  for (std::size_t i = 0; i < cpus.size();) {
    std::size_t end = i + 1;
    while (end < cpus.size() && cpus[end] == cpus[end - 1] + 1) ++end;
    if (!text.empty()) text += ',';
    text += std::to_string(cpus[i]);
    if (end - i > 1) text += '-' + std::to_string(cpus[end - 1]);
    i = end;
  }
  return text;
}

std::vector<int> parse_cpu_mask(const std::string& text) {
  std::vector<int> cpus;
  int cpu = 0;
  for (std::size_t i = text.size(); i-- > 0;) {
    if (text[i] == ',') continue;
    unsigned digit = 0;
    const auto result = std::from_chars(&text[i], &text[i] + 1, digit, 16);
    if (result.ec != std::errc{} || cpu >= kMostCpus) return {};
    for (int bit = 0; bit < 4; ++bit, ++cpu) {
      if (((digit >> bit) & 1U) != 0) cpus.push_back(cpu);
    }
  }
  return cpus;
}

std::string cpu_mask_text(const std::vector<int>& cpus) {
  const int last = cpus.empty() ? 0 : *std::max_element(cpus.begin(), cpus.end());
  std::vector<std::uint32_t> words(static_cast<std::size_t>(last / 32 + 1));
  for (const int cpu : cpus) words[static_cast<std::size_t>(cpu / 32)] |= 1U << (cpu % 32);
  std::string text;
  for (std::size_t i = words.size(); i-- > 0;) {
    char digits[12];
    std::snprintf(digits, sizeof digits, text.empty() ? "%x" : ",%08x", words[i]);
    text += digits;
  }
  return text;
}

}  // namespace haptic::hal
