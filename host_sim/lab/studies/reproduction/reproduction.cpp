// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/reproduction/reproduction.hpp"

#include <cstdio>
#include <functional>

#include "host_sim/lab/studies/reproduction/figures.hpp"
#include "host_sim/lab/studies/reproduction/graph_table.hpp"
#include "host_sim/lab/studies/reproduction/literal_table.hpp"
#include "host_sim/lab/studies/reproduction/timing_table.hpp"
#include "host_sim/report/part_report.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {

std::string index_page(std::span<const PartReport> parts, bool quick) {
  std::string page =
      "# The paper's tables and figures, reproduced\n\n"
      "*Haptic Rendering of Compliant Motions using Contact Tracking in C-space*: what it prints, "
      "and what this project's core gives. Made by `host_sim reproduce-paper --out DIR" +
      std::string(quick ? " --quick`: small counts, wide scatter" : "`") +
      ". All random draws are seeded; only the times differ from run to run.\n\n## Paper and "
      "project\n\n" +
      table_head({"", "the paper", "here", "same", "remark"});
  for (const PartReport& part : parts) {
    for (const Finding& finding : part.findings)
      page += table_row({finding.topic, finding.paper, finding.ours, finding.same, finding.reason});
  }
  page +=
      table_row({"Fig. 7", "photograph of the device", "-", "-",
                 "a photograph; motions here are computed, so that every tick can be repeated"});
  for (const PartReport& part : parts) {
    page += "\n## " + part.title + "\n\n" + part.markdown;
    if (!part.passed) page += "\n**A number that must hold does not: see the table above.**\n";
  }
  page += "\n## Files\n\n";
  for (const PartReport& part : parts) {
    for (const OutputText& file : part.files) page += "- [" + file.name + "](" + file.name + ")\n";
  }
  return page;
}

bool reproduce_paper(const std::string& folder, const ReproductionSize& size) {
  tools::claim_folder(folder, "--out", {});
  const std::vector<std::pair<const char*, std::function<PartReport()>>> makers = {
      {"graph and subgraphs", [&] { return graph_part(size); }},
      {"Fig. 1", [] { return guidance_part(); }},
      {"Fig. 2", [] { return motion_part(); }},
      {"Figs. 3 and 4", [] { return contacts_part(); }},
      {"Fig. 5", [] { return forces_part(); }},
      {"Fig. 6", [] { return insertion_part(); }},
      {"Fig. 8", [] { return neighbors_part(); }},
      {"time per tick", [&] { return timing_part(size); }},
      {"steps as printed", [&] { return literal_part(size); }}};
  std::vector<PartReport> parts;
  bool passed = true;
  for (const auto& [name, make] : makers) {
    if (size.progress)
      std::fprintf(stderr, "%zu / %zu: %s\n", parts.size() + 1, makers.size(), name);
    parts.push_back(make());
    for (const OutputText& file : parts.back().files)
      write_whole_file(folder + "/" + file.name, file.content);
    passed = passed && parts.back().passed;
  }
  write_whole_file(folder + "/README.md", index_page(parts, size.quick));
  return passed;
}

}  // namespace haptic::sim
