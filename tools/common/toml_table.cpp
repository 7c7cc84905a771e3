// SPDX-License-Identifier: Apache-2.0
#include "tools/common/toml_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::tools {
namespace {

std::string type_name(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return "a string";
    case toml::node_type::integer:
      return "an integer";
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "a boolean";
    default:
      return "a date or time";
  }
}

std::string range_text(const Range& range) {
  const bool bounded = std::isfinite(range.high);
  if (!bounded) return (range.open_low ? "above " : "at least ") + short_number(range.low, 9);
  return (range.open_low ? "above " : "from ") + short_number(range.low, 9) +
         (range.open_low ? " and at most " : " to ") + short_number(range.high, 9);
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row.back();
}

std::string bracketed(const char* open, std::string_view key, const char* close) {
  std::string text(open);
  text.append(key).append(close);
  return text;
}

std::string list_of(const std::vector<std::string_view>& words) {
  std::string text;
  for (const std::string_view word : words) text += (text.empty() ? "" : ", ") + std::string(word);
  return text;
}

}  // namespace

std::string nearest_word(std::string_view word, const std::vector<std::string_view>& known) {
  std::string best;
  std::size_t least = std::max<std::size_t>(2, word.size() / 2) + 1;
  for (const std::string_view candidate : known) {
    // A key without its unit ("grip" for "grip_m") is as near as a misprint.
    const bool prefix = candidate.size() > word.size() && word.size() >= 3 &&
                        candidate.substr(0, word.size()) == word;
    const std::size_t distance = prefix ? 1 : edit_distance(word, candidate);
    if (distance < least) {
      least = distance;
      best = candidate;
    }
  }
  return best;
}

TomlTable::TomlTable(const toml::table& table, std::string file, std::string name,
                     std::vector<std::string_view> known)
    : table_(&table), file_(std::move(file)), name_(std::move(name)) {
  for (const auto& [key, value] : table) {
    if (std::find(known.begin(), known.end(), key.str()) != known.end()) continue;
    const std::string nearest = nearest_word(key.str(), known);
    fail_at(key.source(), "unknown key '" + std::string(key.str()) + "'" +
                              (name_.empty() ? "" : " in " + name_) + "; " +
                              (nearest.empty() ? "the known keys are " + list_of(known)
                                               : "did you mean '" + nearest + "'?"));
  }
}

void TomlTable::fail_at(const toml::source_region& region, const std::string& text) const {
  throw InputError(file_ + ":" + std::to_string(region.begin.line) + ":" +
                   std::to_string(region.begin.column) + ": " + text);
}

std::string TomlTable::full_name(std::string_view key) const {
  return (name_.empty() ? "" : name_ + " ") + std::string(key);
}

void TomlTable::fail(std::string_view key, const std::string& defect_and_mend) const {
  const toml::node* node = table_->get(key);
  fail_at(node != nullptr ? node->source() : table_->source(),
          full_name(key) + ": " + defect_and_mend);
}

void TomlTable::fail_missing(std::string_view key, const std::string& fix) const {
  fail_at(table_->source(), full_name(key) + " is missing; " + fix);
}

FilePlace TomlTable::place(std::string_view key) const {
  const toml::node* node = table_->get(key);
  const toml::source_position at = (node != nullptr ? node->source() : table_->source()).begin;
  return {at.line, at.column};
}

double TomlTable::number_of(const toml::node& node, const std::string& what,
                            const Range& range) const {
  if (!node.is_number()) {
    fail_at(node.source(), what + " is " + type_name(node) + "; give a number");
  }
  const double x = node.is_integer() ? static_cast<double>(node.as_integer()->get())
                                     : node.as_floating_point()->get();
  const bool inside = range.open_low ? x > range.low : x >= range.low;
  if (!std::isfinite(x) || !inside || x > range.high) {
    fail_at(node.source(),
            what + " is " + short_number(x, 9) + "; give a number " + range_text(range));
  }
  return x;
}

std::optional<double> TomlTable::number(std::string_view key, const Range& range) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr) return std::nullopt;
  return number_of(*node, full_name(key), range);
}

std::optional<std::int64_t> TomlTable::integer(std::string_view key) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_integer()) fail(key, "is " + type_name(*node) + "; give an integer");
  return node->as_integer()->get();
}

std::optional<std::string> TomlTable::text(std::string_view key) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_string()) fail(key, "is " + type_name(*node) + "; give a string in quotes");
  return node->as_string()->get();
}

std::optional<std::string> TomlTable::path(std::string_view key) const {
  std::optional<std::string> name = text(key);
  if (name && std::ranges::any_of(*name, [](unsigned char c) { return c < 0x20; })) {
    fail(key,
         "a backslash has made a control character in it, as \\t makes a tab in double quotes; put "
         "the path in single quotes, or write / for each backslash");
  }
  return name;
}

std::optional<bool> TomlTable::flag(std::string_view key) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_boolean()) fail(key, "is " + type_name(*node) + "; give true or false");
  return node->as_boolean()->get();
}

std::array<std::string, 2> TomlTable::words_of(const toml::node& node,
                                               const std::string& what) const {
  const toml::array* array = node.as_array();
  if (array == nullptr)
    fail_at(node.source(), what + " is " + type_name(node) + "; give an array of two strings");
  if (array->size() != 2) {
    fail_at(node.source(),
            what + " has " + std::to_string(array->size()) + " elements; give two strings");
  }
  std::array<std::string, 2> result;
  for (std::size_t k = 0; k < 2; ++k) {
    const toml::node& word = *array->get(k);
    if (!word.is_string() || word.as_string()->get().empty()) {
      fail_at(word.source(), what + "[" + std::to_string(k) + "] is " +
                                 (word.is_string() ? "empty" : type_name(word)) +
                                 "; give a name in quotes");
    }
    result[k] = word.as_string()->get();
  }
  return result;
}

std::optional<std::array<std::string, 2>> TomlTable::word_pair(std::string_view key) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr) return std::nullopt;
  return words_of(*node, full_name(key));
}

std::vector<std::array<std::string, 2>> TomlTable::word_pairs(std::string_view key) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr) return {};
  const toml::array* array = node->as_array();
  if (array == nullptr)
    fail(key, "is " + type_name(*node) + "; give an array of arrays of two strings");
  std::vector<std::array<std::string, 2>> pairs;
  for (const toml::node& pair : *array)
    pairs.push_back(words_of(pair, full_name(key) + "[" + std::to_string(pairs.size()) + "]"));
  return pairs;
}

template <std::size_t kCount>
std::optional<std::array<double, kCount>> TomlTable::numbers(std::string_view key,
                                                             const char* wanted,
                                                             const Range& range) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr) return std::nullopt;
  const toml::array* array = node->as_array();
  if (array == nullptr) {
    fail(key, "is " + type_name(*node) + "; give an array of " + wanted + " numbers");
  }
  if (array->size() != kCount) {
    fail(key, "has " + std::to_string(array->size()) + " elements; give " + wanted + " numbers");
  }
  std::array<double, kCount> result{};
  for (std::size_t k = 0; k < kCount; ++k) {
    result[k] = number_of(*array->get(k), full_name(key) + "[" + std::to_string(k) + "]", range);
  }
  return result;
}

std::optional<std::array<double, 3>> TomlTable::vector3(std::string_view key,
                                                        const Range& range) const {
  return numbers<3>(key, "three", range);
}

std::optional<std::array<double, 4>> TomlTable::vector4(std::string_view key,
                                                        const Range& range) const {
  return numbers<4>(key, "four", range);
}

bool TomlTable::is_text(std::string_view key) const {
  const toml::node* node = table_->get(key);
  return node != nullptr && node->is_string();
}

std::optional<std::array<double, 3>> TomlTable::scale3(std::string_view key,
                                                       const Range& range) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr || node->is_array()) return vector3(key, range);
  const double x = number_of(*node, full_name(key), range);
  return std::array<double, 3>{x, x, x};
}

void TomlTable::normalise(std::string_view key, std::array<double, 4>& q,
                          std::vector<std::string>* notes) const {
  constexpr double kExact = 1e-6;
  double square = 0.0;
  for (const double x : q) square += x * x;
  const double length = std::sqrt(square);
  const double off = std::abs(length - 1.0);
  if (!(off <= (notes != nullptr ? kQuaternionTolerance : kExact))) {
    fail(key, "has length " + short_number(length, 9) + "; divide its components by that");
  }
  if (off > kExact) {
    const FilePlace at = place(key);
    notes->push_back(file_ + ":" + std::to_string(at.line) + ":" + std::to_string(at.column) +
                     ": " + full_name(key) + " has length " + short_number(length, 9) +
                     "; its components were divided by that");
  }
  for (double& x : q) x /= length;
}

std::optional<std::array<double, 4>> TomlTable::quaternion_wxyz(
    std::string_view key, std::vector<std::string>* notes) const {
  const std::optional<TomlTable> q = table(key, {"w", "x", "y", "z"});
  if (!q) return std::nullopt;
  std::array<double, 4> result{};
  constexpr std::string_view kNames[4] = {"w", "x", "y", "z"};
  for (std::size_t k = 0; k < 4; ++k) {
    const auto value = q->number(kNames[k], {-2.0, 2.0});
    if (!value) q->fail_missing(kNames[k], "a quaternion is { w = 1, x = 0, y = 0, z = 0 }");
    result[k] = *value;
  }
  normalise(key, result, notes);
  return result;
}

std::optional<TomlTable> TomlTable::table(std::string_view key,
                                          std::vector<std::string_view> known) const {
  const toml::node* node = table_->get(key);
  if (node == nullptr) return std::nullopt;
  const std::string name = name_.empty() ? bracketed("[", key, "]") : full_name(key);
  if (!node->is_table()) {
    fail(key,
         "is " + type_name(*node) +
             (node->is_array_of_tables() ? " of tables; give it once, as " : "; give a table, ") +
             name);
  }
  return TomlTable(*node->as_table(), file_, name, std::move(known));
}

std::vector<TomlTable> TomlTable::tables(std::string_view key,
                                         std::vector<std::string_view> known) const {
  const toml::node* node = table_->get(key);
  std::vector<TomlTable> result;
  if (node == nullptr) return result;
  const std::string name = bracketed("[[", key, "]]");
  if (!node->is_array_of_tables()) {
    fail(key, "is " + type_name(*node) + "; write its heading as " + name);
  }
  for (const toml::node& element : *node->as_array()) {
    result.emplace_back(*element.as_table(), file_, name, known);
  }
  return result;
}

}  // namespace haptic::tools
