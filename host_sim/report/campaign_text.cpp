// SPDX-License-Identifier: Apache-2.0
#include "host_sim/report/campaign_text.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {

std::string column_names(const Counts& counts) {
  std::string names;
  for (const auto& [name, count] : counts) names += "," + name;
  return names;
}

void append_cells(std::vector<Cell>& cells, const Counts& counts) {
  for (const auto& [name, count] : counts) cells.emplace_back(count);
}

std::string zero_table(const Counts& must_be_zero) {
  std::string text = table_head({"must be zero", "count"});
  for (const auto& [name, count] : must_be_zero) text += table_row({name, std::to_string(count)});
  return text;
}

std::string zero_line(const Counts& must_be_zero) {
  std::string line;
  for (const auto& [name, count] : must_be_zero) {
    line += (line.empty() ? "" : ", ") + name + " " + std::to_string(count);
  }
  std::ranges::replace(line, '_', ' ');
  return line;
}

std::string failure_section(const FailureLog& failures) {
  if (failures.empty()) return "";
  std::string text = "\n## Failures\n\n";
  for (const std::string& line : failures.lines()) text += "- " + line + "\n";
  return text;
}

std::string campaign_line(std::uint64_t seed, std::uint64_t ticks, std::uint64_t held,
                          double seconds) {
  return tools::formatted(
      "seed %llu: %llu ticks (%llu held), %.0f ticks/s", static_cast<unsigned long long>(seed),
      static_cast<unsigned long long>(ticks), static_cast<unsigned long long>(held),
      static_cast<double>(ticks) / seconds);
}

std::vector<OutputText> campaign_files(const std::string& stem, std::string csv,
                                       const nlohmann::ordered_json& json, std::string page) {
  return {{stem + ".csv", std::move(csv)},
          {stem + ".json", json.dump(2) + "\n"},
          {stem + ".md", std::move(page)}};
}

std::string failure_lines(const FailureLog& failures) {
  std::string text;
  for (const std::string& line : failures.lines()) text += "  " + line + "\n";
  return text;
}

int finish_campaign(const CampaignEnd& end, const std::string& folder, bool faulty) {
  std::fputs(end.said.c_str(), stdout);
  if (!folder.empty()) {
    for (const OutputText& file : end.files)
      write_whole_file(folder + "/" + file.name, file.content);
  }
  return campaign_exit(end.passed, faulty);
}

int finish_study(const PartReport& report, const std::string& name, const std::string& folder,
                 bool faulty) {
  std::printf("# %s\n\n%s\n%s\n", report.title.c_str(), report.markdown.c_str(),
              report.passed ? "all right" : "NOT all right");
  if (!folder.empty()) {
    for (const OutputText& file : report.files) {
      write_whole_file(folder + "/" + file.name, file.content);
    }
    write_whole_file(folder + "/" + name + ".md", "# " + report.title + "\n\n" + report.markdown);
  }
  return campaign_exit(report.passed, faulty);
}

int campaign_exit(bool passed, bool faulty) {
  if (passed && faulty) std::printf("  the fault was not caught\n");
  return passed ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace haptic::sim
