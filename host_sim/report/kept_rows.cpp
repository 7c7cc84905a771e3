// SPDX-License-Identifier: Apache-2.0
#include "host_sim/report/kept_rows.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <utility>

#include "host_sim/report/part_report.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

/// Numbers behind the first comma of a line. @return false: a word is no number.
bool read_numbers(const std::string& line, std::size_t at, std::vector<double>& numbers) {
  while (at < line.size()) {
    const std::size_t end = std::min(line.find(',', at + 1), line.size());
    double number = 0;
    const auto [last, error] = std::from_chars(line.data() + at + 1, line.data() + end, number);
    if (error != std::errc{} || last != line.data() + end) return false;
    numbers.push_back(number);
    at = end;
  }
  return true;
}

}  // namespace

KeptRows::KeptRows(std::string path, std::string about, bool resume)
    : path_(std::move(path)), text_(std::move(about) + "\n") {
  if (path_.empty() || !resume || !std::filesystem::exists(path_)) return;
  // It is written again: no input of the run that an output must not replace.
  std::ifstream lines(path_);
  std::string line;
  std::getline(lines, line);
  if (line + "\n" != text_) {
    throw tools::InputError(path_ + ":1: the rows are of a run with '" + line +
                            "'; give the same options, or leave --resume out");
  }
  for (std::size_t number = 2; std::getline(lines, line); ++number) {
    const std::size_t key = line.find(',');
    std::vector<double> numbers;
    if (key == std::string::npos || !read_numbers(line, key, numbers)) {
      throw tools::InputError(path_ + ":" + std::to_string(number) +
                              ": is no row of numbers; take the line out, or leave --resume out");
    }
    done_[line.substr(0, key)] = numbers;
    text_ += line + "\n";
  }
}

const std::vector<double>* KeptRows::find(const std::string& key) const {
  const auto found = done_.find(key);
  return found == done_.end() ? nullptr : &found->second;
}

void KeptRows::keep(const std::string& key, const std::vector<double>& numbers) {
  if (path_.empty()) return;
  const std::lock_guard lock(mutex_);
  text_ += key;
  for (const double number : numbers) text_ += "," + Cell(number).shown;
  text_ += "\n";
  write_whole_file(path_, text_);
}

}  // namespace haptic::sim
