// SPDX-License-Identifier: Apache-2.0
#include "host_sim/motion_log/column_name.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <utility>

namespace haptic::sim {
namespace {

using UnitNames = std::pair<std::string_view, double>;
constexpr std::array<UnitNames, 13> kLengths = {{{"m", 1},
                                                 {"metre", 1},
                                                 {"metres", 1},
                                                 {"meter", 1},
                                                 {"meters", 1},
                                                 {"cm", 1e-2},
                                                 {"mm", 1e-3},
                                                 {"millimetres", 1e-3},
                                                 {"millimeters", 1e-3},
                                                 {"millimeter", 1e-3},
                                                 {"centimetres", 1e-2},
                                                 {"centimeters", 1e-2},
                                                 {"um", 1e-6}}};
constexpr std::array<UnitNames, 17> kTimes = {{{"s", 1},
                                               {"sec", 1},
                                               {"secs", 1},
                                               {"second", 1},
                                               {"seconds", 1},
                                               {"ms", 1e-3},
                                               {"msec", 1e-3},
                                               {"millis", 1e-3},
                                               {"milliseconds", 1e-3},
                                               {"us", 1e-6},
                                               {"usec", 1e-6},
                                               {"micros", 1e-6},
                                               {"microseconds", 1e-6},
                                               {"ns", 1e-9},
                                               {"nsec", 1e-9},
                                               {"nanoseconds", 1e-9},
                                               {"nanos", 1e-9}}};

std::optional<double> unit_among(std::span<const UnitNames> units, std::string_view name) {
  for (const auto& [text, value] : units)
    if (text == name) return value;
  return std::nullopt;
}

bool is_alnum(char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'); }

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 32);
  return out;
}

std::string letters_of(std::string_view text) {
  std::string out;
  for (const char c : text)
    if (is_alnum(c)) out += c;
  return out;
}

/// Cuts a unit in brackets off `text`: "x [mm]", "time(s)". "q[0]" and "q_RS_w []" have none.
std::string bracketed_unit(std::string& text) {
  const std::size_t open = text.find_first_of("[(");
  if (open == std::string::npos) return {};
  const std::size_t close = text.find_first_of("])", open);
  if (close == std::string::npos) return {};
  const std::string inside = text.substr(open + 1, close - open - 1);
  const bool number = !inside.empty() && std::all_of(inside.begin(), inside.end(),
                                                     [](char c) { return c >= '0' && c <= '9'; });
  if (number) return {};
  text.erase(open, close - open + 1);
  const std::size_t begin = inside.find_first_not_of(' ');
  if (begin == std::string::npos || inside == "-" || inside == "1") return {};
  return inside.substr(begin, inside.find_last_not_of(' ') - begin + 1);
}

/// Cuts a unit of length off the end: "x_mm", "pos.x.m".
std::string trailing_length(std::string& text) {
  std::size_t end = text.size();
  while (end > 0 && is_alnum(text[end - 1])) --end;
  const std::string last = text.substr(end);
  if (end == 0 || last.empty() || !length_unit_m(last)) return {};
  text.erase(end);
  return last;
}

bool is_axis(char c) { return (c >= 'w' && c <= 'z') || (c >= '0' && c <= '9'); }

/// The place of `stem` among `exact`; 10 where it ends with one of `ends`.
std::optional<int> rank_among(std::string_view stem, std::span<const std::string_view> exact,
                              std::span<const std::string_view> ends) {
  const auto found = std::find(exact.begin(), exact.end(), stem);
  if (found != exact.end()) return static_cast<int>(found - exact.begin());
  for (const std::string_view end : ends)
    if (stem.ends_with(end)) return 10;
  return std::nullopt;
}

}  // namespace

ColumnName column_name(std::string_view name) {
  ColumnName read;
  std::string text = lower(name);
  read.unit = bracketed_unit(text);
  read.whole = letters_of(text);
  if (read.unit.empty()) read.unit = trailing_length(text);
  std::string stem = letters_of(text);
  // An index above 9 is no axis.
  const bool single =
      stem.size() < 2 || !(stem[stem.size() - 2] >= '0' && stem[stem.size() - 2] <= '9');
  if (!stem.empty() && is_axis(stem.back()) && single) {
    read.axis = stem.back();
    stem.pop_back();
  }
  // "pos_mm_x"
  if (read.axis != 0 && read.unit.empty() && stem.size() > 2 && stem.ends_with("mm")) {
    stem.resize(stem.size() - 2);
    read.unit = "mm";
  }
  read.stem = stem;
  return read;
}

std::optional<double> length_unit_m(std::string_view unit) { return unit_among(kLengths, unit); }
std::optional<double> time_unit_s(std::string_view unit) { return unit_among(kTimes, unit); }

std::optional<int> position_rank(std::string_view stem) {
  static constexpr std::array<std::string_view, 6> kExact = {"",         "p",    "pos",
                                                             "position", "prsr", "translation"};
  static constexpr std::array<std::string_view, 6> kEnds = {"position", "translation", "pos",
                                                            "location", "pose",        "posep"};
  // Torques have this name too: the last choice.
  if (stem == "t" || stem == "trans") return 20;
  return rank_among(stem, kExact, kEnds);
}

std::optional<int> quaternion_rank(std::string_view stem) {
  static constexpr std::array<std::string_view, 7> kExact = {
      "q", "quat", "quaternion", "orientation", "rotation", "qrs", "rot"};
  static constexpr std::array<std::string_view, 6> kEnds = {"orientation", "rotation", "quaternion",
                                                            "quat",        "poseq",    "rot"};
  if (const auto rank = rank_among(stem, kExact, kEnds)) return rank;
  if (stem.ends_with("q")) return 11;
  return std::nullopt;
}

std::optional<TimeName> time_name(const ColumnName& name) {
  static constexpr std::array<std::string_view, 8> kExact = {
      "t", "headerstamp", "timestamp", "stamp", "time", "ts", "elapsed", "elapsedtime"};
  static constexpr std::array<std::string_view, 2> kEnds = {"timestamp", "stamp"};
  const auto rank_of = [](std::string_view whole) {
    const std::optional<int> rank = rank_among(whole, kExact, kEnds);
    return whole.ends_with("headerstamp") ? std::optional<int>(1) : rank;
  };
  if (const auto rank = rank_of(name.whole)) return TimeName{*rank, name.unit};
  std::optional<TimeName> found;
  for (const auto& [unit, seconds] : kTimes) {
    (void)seconds;
    if (!name.whole.ends_with(unit)) continue;
    const auto rank =
        rank_of(std::string_view(name.whole).substr(0, name.whole.size() - unit.size()));
    // Takes that of "ms" and "s" which leaves the better name.
    if (rank && (!found || *rank < found->rank)) found = TimeName{*rank, std::string(unit)};
  }
  return found;
}

}  // namespace haptic::sim
