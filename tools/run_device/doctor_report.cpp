// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/doctor_report.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

namespace haptic::tools {
namespace {

using hal::DoctorLevel;
using hal::DoctorLine;

constexpr std::size_t kLevelColumns = 9;  // the longest level and a blank

std::string padded(std::string text, std::size_t columns) {
  text.resize(std::max(columns, text.size()), ' ');
  return text;
}

// `text` in lines of at most `columns`, broken at blanks; a longer word has a line of its own.
std::vector<std::string> wrapped(const std::string& text, std::size_t columns) {
  std::vector<std::string> lines;
  std::istringstream words(text);
  std::string word, line;
  while (words >> word) {
    if (!line.empty() && line.size() + 1 + word.size() > columns) {
      lines.push_back(line);
      line.clear();
    }
    line += (line.empty() ? "" : " ") + word;
  }
  lines.push_back(line);
  return lines;
}

void append_mend(std::string& text, const std::string& mend, std::size_t indent) {
  std::istringstream parts(mend);
  std::string part;
  const char* lead = "fix: ";
  while (std::getline(parts, part)) {
    if (part.starts_with("    ")) {
      text += part + "\n";
      continue;
    }
    for (const std::string& line : wrapped(lead + part, kReportColumns - indent))
      text += std::string(indent, ' ') + line + "\n";
    lead = "";
  }
}

std::string verdict_text(const std::vector<DoctorLine>& lines, bool strict) {
  std::size_t counts[static_cast<std::size_t>(DoctorLevel::kCount)] = {};
  std::size_t refusing = 0;
  for (const DoctorLine& line : lines) {
    counts[static_cast<std::size_t>(line.level)] += 1;
    refusing += line.level == DoctorLevel::kWarning && line.refuses_in_strict ? 1u : 0u;
  }
  std::string text;
  for (const DoctorLevel level :
       {DoctorLevel::kPass, DoctorLevel::kWarning, DoctorLevel::kFailure, DoctorLevel::kSkipped}) {
    text += (text.empty() ? "" : ", ") + std::to_string(counts[static_cast<std::size_t>(level)]) +
            " " + hal::to_text(level);
  }
  text += "; " + std::to_string(refusing) + " of the warnings refuse with --strict\n";
  text += hal::is_fit(lines, strict) ? "fit" : "NOT FIT";
  return text + (strict ? " (strict)\n" : "\n");
}

}  // namespace

std::string doctor_text(const std::vector<DoctorLine>& lines, bool strict) {
  std::size_t name_columns = 0;
  for (const DoctorLine& line : lines) name_columns = std::max(name_columns, line.name.size() + 2);
  const std::size_t indent = name_columns + kLevelColumns;
  std::string text;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const DoctorLine& line = lines[i];
    std::string head =
        padded(line.name, name_columns) + padded(hal::to_text(line.level), kLevelColumns);
    for (const std::string& part : wrapped(line.found, kReportColumns - indent)) {
      text += head + part + "\n";
      head = std::string(indent, ' ');
    }
    // Lines that were skipped for one reason have their fix once, below the last.
    const bool repeated = line.level == DoctorLevel::kSkipped && i + 1 < lines.size() &&
                          lines[i + 1].mend == line.mend;
    if (line.level != DoctorLevel::kPass && !repeated) append_mend(text, line.mend, indent);
  }
  return text + "\n" + verdict_text(lines, strict);
}

nlohmann::json doctor_json(const std::vector<DoctorLine>& lines, bool strict,
                           const hal::WakeupMeasurement* measurement) {
  nlohmann::json found = nlohmann::json::array();
  for (const DoctorLine& line : lines) {
    found.push_back({{"name", line.name},
                     {"level", hal::to_text(line.level)},
                     {"refuses_in_strict", line.refuses_in_strict},
                     {"found", line.found},
                     {"fix", line.mend}});
  }
  nlohmann::json wakeups;
  if (measurement != nullptr && measurement->error == 0) {
    const hal::WakeupHistogram& h = measurement->lateness;
    wakeups = {{"ticks", h.count()},
               {"p50_ns", h.quantile_ns(0.5)},
               {"p99_ns", h.quantile_ns(0.99)},
               {"p99_9_ns", h.quantile_ns(0.999)},
               {"largest_ns", h.largest_ns()},
               {"late_ticks", measurement->late_ticks},
               {"missed_periods", measurement->missed_periods},
               {"fifo_priority", measurement->priority},
               {"minor_faults", measurement->faults.minor},
               {"major_faults", measurement->faults.major}};
  }
  return {{"strict", strict},
          {"fit", hal::is_fit(lines, strict)},
          {"lines", std::move(found)},
          {"wakeups", std::move(wakeups)}};
}

}  // namespace haptic::tools
