// SPDX-License-Identifier: Apache-2.0
// proxy_fuzz.csv, .json and .md.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "host_sim/lab/proxy_fuzz/proxy_campaign.hpp"
#include "host_sim/report/output_file.hpp"
#include "host_sim/report/report_table.hpp"

namespace haptic::sim {
namespace {

struct Count {
  const char* name;
  std::uint64_t ProxyFuzzTotals::*field;
};
constexpr Count kMustBeZero[] = {
    {"not_free", &ProxyFuzzTotals::deep},        {"energy_rises", &ProxyFuzzTotals::rises},
    {"stalled_ticks", &ProxyFuzzTotals::stalls}, {"invisible_walls", &ProxyFuzzTotals::walls},
    {"crossings", &ProxyFuzzTotals::crossings},  {"wrong_wrenches", &ProxyFuzzTotals::wrenches},
    {"wrong_goals", &ProxyFuzzTotals::goals},    {"over_caps", &ProxyFuzzTotals::over_caps},
    {"recoveries", &ProxyFuzzTotals::recoveries}};
constexpr Count kFigures[] = {{"longest_still", &ProxyFuzzTotals::longest_still},
                              {"longest_stall", &ProxyFuzzTotals::longest_stall},
                              {"longest_rejected", &ProxyFuzzTotals::longest_rejected},
                              {"rejected_passes", &ProxyFuzzTotals::rejected_passes},
                              {"limited_ticks", &ProxyFuzzTotals::limited},
                              {"anchored_ticks", &ProxyFuzzTotals::anchored}};
constexpr struct {
  const char* name;
  std::uint32_t StepCounters::*field;
} kPeaks[] = {
    {"passes", &StepCounters::proxy_passes},   {"rounds", &StepCounters::proxy_rounds},
    {"rows", &StepCounters::proxy_rows},       {"qp_iterations", &StepCounters::qp_iterations},
    {"plane_gaps", &StepCounters::plane_gaps}, {"valid_nodes", &StepCounters::valid_nodes}};

std::string csv(const ProxyFuzzResult& result) {
  std::string columns = "scene,friction,motion,ticks,held,worst_gap_m,largest_rise_j,rise_share";
  for (const Count& c : kMustBeZero) columns += std::string(",") + c.name;
  for (const Count& c : kFigures) columns += std::string(",") + c.name;
  for (const auto& p : kPeaks) columns += std::string(",peak_") + p.name;
  ReportTable table(columns);
  for (const ProxyFuzzRow& row : result.rows) {
    const ProxyFuzzTotals& t = row.totals;
    std::vector<Cell> cells{quoted(row.scene),
                            row.friction,
                            row.motion,
                            t.ticks,
                            t.held,
                            number_text(t.worst_gap_m),
                            number_text(t.largest_rise_j),
                            number_text(t.largest_rise_share)};
    for (const Count& c : kMustBeZero) cells.emplace_back(t.*c.field);
    for (const Count& c : kFigures) cells.emplace_back(t.*c.field);
    for (const auto& p : kPeaks) cells.emplace_back(t.peaks.*p.field);
    table.add(std::move(cells));
  }
  return table.csv();
}

std::string json(const ProxyFuzzResult& result) {
  const ProxyFuzzTotals t = result.totals();
  nlohmann::ordered_json j;
  j["seed"] = result.size.seed;
  j["ticks"] = t.ticks;
  j["held_ticks"] = t.held;
  j["passed"] = t.failed() == 0;
  for (const Count& c : kMustBeZero) j["must_be_zero"][c.name] = t.*c.field;
  j["worst_gap_m"] = static_cast<double>(t.worst_gap_m);
  j["largest_rise_j"] = static_cast<double>(t.largest_rise_j);
  j["largest_rise_share_of_bound"] = static_cast<double>(t.largest_rise_share);
  j["largest_wrench_error_of_rounding"] = static_cast<double>(t.largest_wrench_error);
  for (const Count& c : kFigures) j[c.name] = t.*c.field;
  for (const auto& p : kPeaks) j["peaks"][p.name] = t.peaks.*p.field;
  j["failures"] = t.failures.lines();
  return j.dump(2) + "\n";
}

/// Rows of one scene and friction together.
std::string scene_table(const ProxyFuzzResult& result) {
  ReportTable table(
      "scene,friction,ticks,held,worst gap um,largest rise J,longest still,stall,all rejected,"
      "rejected passes,rounds,rows,QP steps,plane gaps,valid nodes,failures");
  for (std::size_t k = 0; k < result.rows.size();) {
    const ProxyFuzzRow& first = result.rows[k];
    ProxyFuzzTotals t;
    for (; k < result.rows.size() && result.rows[k].scene == first.scene &&
           result.rows[k].friction == first.friction;
         ++k) {
      t.add(result.rows[k].totals);
    }
    const std::uint64_t held = 100 * t.held / std::max<std::uint64_t>(t.ticks, 1);
    table.add({first.scene, number_text(widen(first.friction)), t.ticks,
               std::to_string(held) + " %", number_text(t.worst_gap_m * 1e6L),
               number_text(t.largest_rise_j), t.longest_still, t.longest_stall, t.longest_rejected,
               t.rejected_passes, t.peaks.proxy_rounds, t.peaks.proxy_rows, t.peaks.qp_iterations,
               t.peaks.plane_gaps, t.peaks.valid_nodes, t.failed()});
  }
  return table.markdown();
}

}  // namespace

std::string proxy_fuzz_page(const ProxyFuzzResult& result) {
  const ProxyFuzzTotals t = result.totals();
  std::string text = "# Invariants of the proxy\n\n";
  text += std::to_string(t.ticks) + " ticks, seed " + std::to_string(result.size.seed) +
          "; every tick judged in long double from poses and vertices alone. Lengths are for a "
          "part of 50 mm.\n\n| must be zero | count |\n|---|---|\n";
  for (const Count& c : kMustBeZero) {
    text += std::string("| ") + c.name + " | " + std::to_string(t.*c.field) + " |\n";
  }
  text += "\nWorst gap " + number_text(t.worst_gap_m * 1e6L) +
          " um (allowed: twice the tolerance of \"free\" of its scene" +
          (sizeof(Real) == sizeof(double) ? ", -0.2" : "") + "). Largest rise of the energy " +
          number_text(t.largest_rise_j) + " J; at most " + number_text(100 * t.largest_rise_share) +
          " % of its bound. Longest run of ticks without a move that was possible: " +
          std::to_string(t.longest_stall) + " (looked for from the 6th on; allowed 10).\n\n";
  text += scene_table(result);
  if (!t.failures.empty()) text += "\n## Failures\n\n";
  for (const std::string& line : t.failures.lines()) text += "- " + line + "\n";
  return text;
}

void write_proxy_fuzz(const std::string& folder, const ProxyFuzzResult& result) {
  write_whole_file(folder + "/proxy_fuzz.csv", csv(result));
  write_whole_file(folder + "/proxy_fuzz.json", json(result));
  write_whole_file(folder + "/proxy_fuzz.md", proxy_fuzz_page(result));
}

}  // namespace haptic::sim
