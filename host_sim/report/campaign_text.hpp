// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Common parts of the reports of seeded campaigns: counts by their names in files, those that must
/// be zero, the failures, and the end of the command.

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/report/failure_log.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// A count of a campaign's totals, with its name in files: "not_free".
template <typename Totals>
struct NamedCount {
  const char* name;
  std::uint64_t Totals::*field;
};

using Counts = std::vector<std::pair<std::string, std::uint64_t>>;

template <typename Totals, std::size_t kCount>
[[nodiscard]] Counts counts_of(const NamedCount<Totals> (&fields)[kCount], const Totals& totals) {
  Counts counts;
  for (const NamedCount<Totals>& f : fields) counts.emplace_back(f.name, totals.*f.field);
  return counts;
}

/// ",not_free,passages": behind other columns of a CSV file.
[[nodiscard]] std::string column_names(const Counts& counts);
void append_cells(std::vector<Cell>& cells, const Counts& counts);
/// The table of a page.
[[nodiscard]] std::string zero_table(const Counts& must_be_zero);
/// "not free 0, passages 0": a line of the command's output.
[[nodiscard]] std::string zero_line(const Counts& must_be_zero);
/// The last section of a page; empty where nothing failed.
[[nodiscard]] std::string failure_section(const FailureLog& failures);
/// "seed 1: 1000 ticks (200 held), 51234 ticks/s"
[[nodiscard]] std::string campaign_line(std::uint64_t seed, std::uint64_t ticks, std::uint64_t held,
                                        double seconds);
/// How a campaign ends: what is said, its files, and whether all that must hold does.
struct CampaignEnd {
  std::string said;
  std::vector<OutputText> files;
  bool passed = true;
};

/// `stem`.csv, .json and .md.
[[nodiscard]] std::vector<OutputText> campaign_files(const std::string& stem, std::string csv,
                                                     const nlohmann::ordered_json& json,
                                                     std::string page);
/// "  kind: text" a line, behind what a campaign says.
[[nodiscard]] std::string failure_lines(const FailureLog& failures);
/// Prints what is said and writes the files into `folder` where one is given; @return the exit
/// code, as campaign_exit(). @throws tools::OsError a file cannot be written.
[[nodiscard]] int finish_campaign(const CampaignEnd& end, const std::string& folder, bool faulty);

/// Prints a study and writes its page, `name`.md, and its files into `folder` where one is given;
/// @return its exit code, as campaign_exit().
[[nodiscard]] int finish_study(const PartReport& report, const std::string& name,
                               const std::string& folder, bool faulty);
/// The exit code of a campaign; says it where a deliberate fault has passed.
[[nodiscard]] int campaign_exit(bool passed, bool faulty);

}  // namespace haptic::sim
