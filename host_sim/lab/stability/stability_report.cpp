// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/stability/stability_report.hpp"

#include <algorithm>
#include <cstdio>

#include "host_sim/lab/optional/studies.hpp"
#include "host_sim/report/part_report.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

constexpr StabilityPart kParts[] = {
    {3, "extreme", [](const StabilityOptions& o) { return extreme_part(o.quick); }},
    {8, "defaults", defaults_part},
};
/// The numbers of study_parts(), whether they are built or not.
constexpr int kStudyParts[] = {1, 4, 5, 6, 7};

void refuse_unknown(const std::vector<int>& numbers, const std::vector<StabilityPart>& parts) {
  for (const int number : numbers) {
    if (std::ranges::find(parts, number, &StabilityPart::number) != parts.end()) continue;
    if (std::ranges::find(kStudyParts, number) != std::end(kStudyParts))
      throw tools::UsageError("--parts: " + study_left_out("part " + std::to_string(number)));
    std::vector<int> known(std::begin(kStudyParts), std::end(kStudyParts));
    for (const StabilityPart& part : kParts) known.push_back(part.number);
    std::ranges::sort(known);
    std::string list;
    for (const int k : known) list += (list.empty() ? "" : ", ") + std::to_string(k);
    throw tools::UsageError("--parts: there is no part " + std::to_string(number) +
                            "; the parts are " + list);
  }
}

std::string index_page(std::span<const PartReport> reports, bool quick) {
  std::string page = "# Numerical stability\n\nMade by `host_sim stability --out DIR" +
                     std::string(quick ? " --quick`: fewer cells, shorter runs" : "`") +
                     ". Everything is seeded: equal options give equal files.\n\n" +
                     table_head({"limit", "stated", "found", "holds", "remark"});
  for (const PartReport& report : reports) {
    for (const Finding& f : report.findings)
      page += table_row({f.topic, f.paper, f.ours, f.same, f.reason});
  }
  for (const PartReport& report : reports) {
    page += "\n## " + report.title + "\n\n" + report.markdown;
    if (!report.passed) page += "\n**A stated limit is exceeded: see the table above.**\n";
  }
  return page;
}

}  // namespace

bool StabilityOptions::has(LawId law) const {
  return std::find(laws.begin(), laws.end(), law) != laws.end();
}

std::vector<StabilityPart> stability_parts() {
  std::vector<StabilityPart> parts(std::begin(kParts), std::end(kParts));
  parts.insert(parts.end(), study_parts().begin(), study_parts().end());
  std::ranges::sort(parts, {}, &StabilityPart::number);
  return parts;
}

bool write_stability(const std::string& folder, const std::vector<int>& numbers,
                     const StabilityOptions& options) {
  const std::vector<StabilityPart> parts = stability_parts();
  refuse_unknown(numbers, parts);
  tools::claim_folder(folder, "--out", {});
  std::vector<PartReport> reports;
  bool passed = true;
  for (const StabilityPart& part : parts) {
    if (!numbers.empty() && std::find(numbers.begin(), numbers.end(), part.number) == numbers.end())
      continue;
    if (options.progress) std::fprintf(stderr, "part %d: %s\n", part.number, part.name);
    reports.push_back(part.run(options));
    for (const OutputText& file : reports.back().files)
      write_whole_file(folder + "/" + file.name, file.content);
    passed = passed && reports.back().passed;
  }
  write_whole_file(folder + "/README.md", index_page(reports, options.quick));
  return passed;
}

}  // namespace haptic::sim
