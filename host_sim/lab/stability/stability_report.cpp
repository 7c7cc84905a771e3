// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/stability/stability_report.hpp"

#include <algorithm>
#include <cstdio>

#include "host_sim/report/part_report.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

constexpr StabilityPart kParts[] = {
    {1, "z_width", z_width_part},
    {2, "stiff", stiff_part},
    {3, "extreme", [](const StabilityOptions& o) { return extreme_part(o.quick); }},
    {4, "continuity", continuity_part},
    {5, "energy", energy_part},
    {6, "clearance", [](const StabilityOptions& o) { return clearance_part(o.quick); }},
    {7, "divisions", divisions_part},
    {8, "defaults", defaults_part},
};

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

std::span<const StabilityPart> stability_parts() { return kParts; }

bool write_stability(const std::string& folder, const std::vector<int>& numbers,
                     const StabilityOptions& options) {
  for (const int number : numbers) {
    if (std::none_of(std::begin(kParts), std::end(kParts),
                     [&](const StabilityPart& part) { return part.number == number; })) {
      std::string known;
      for (const StabilityPart& part : kParts)
        known += (known.empty() ? "" : ", ") + std::to_string(part.number);
      throw tools::UsageError("--parts: there is no part " + std::to_string(number) +
                              "; the parts are " + known);
    }
  }
  tools::claim_folder(folder, "--out", {});
  std::vector<PartReport> reports;
  bool passed = true;
  for (const StabilityPart& part : kParts) {
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
