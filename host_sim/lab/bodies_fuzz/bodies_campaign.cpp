// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/bodies_fuzz/bodies_campaign.hpp"

#include <algorithm>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "host_sim/lab/bodies_fuzz/bodies_cases.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_of_file.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_run.hpp"
#include "host_sim/lab/bodies_fuzz/hands_run.hpp"
#include "host_sim/report/part_report.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

/// Ticks of a run, without its rest; each begins at free places of its own.
constexpr std::uint64_t kBodiesRunTicks = 2000;

std::string csv_of(const BodiesFuzzResult& result) {
  std::string columns =
      "case,scene,friction,pairs,ticks,held,worst_gap_tolerances,worst_way_tolerances,"
      "largest_rise_j,largest_rise_share,largest_sum_n,largest_lever_m,largest_rest_n,largest_lag_"
      "m";
  columns += column_names(counts_of(kBodiesMustBeZero, {}));
  columns += column_names(counts_of(kBodiesFigures, {}));
  ReportTable table(columns);
  for (const BodiesFuzzRow& row : result.rows) {
    const BodiesTotals& t = row.totals;
    std::vector<Cell> cells{row.of_case,
                            quoted(row.scene),
                            row.friction,
                            row.pairs,
                            t.ticks,
                            t.held,
                            number_text(t.worst_gap_m),
                            number_text(t.worst_way_m),
                            number_text(t.largest_rise_j),
                            number_text(t.largest_rise_share),
                            number_text(t.largest_sum_n),
                            number_text(t.largest_lever_m),
                            number_text(t.largest_rest_n),
                            number_text(t.largest_lag_m)};
    append_cells(cells, counts_of(kBodiesMustBeZero, t));
    append_cells(cells, counts_of(kBodiesFigures, t));
    table.add(std::move(cells));
  }
  return table.csv();
}

/// In the order of the rows.
std::vector<std::pair<std::string, BodiesTotals>> totals_by_case(const BodiesFuzzResult& result) {
  std::vector<std::pair<std::string, BodiesTotals>> cases;
  for (const BodiesFuzzRow& row : result.rows) {
    if (cases.empty() || cases.back().first != row.of_case) cases.push_back({row.of_case, {}});
    cases.back().second.add(row.totals);
  }
  return cases;
}

nlohmann::ordered_json json_of(const BodiesFuzzResult& result) {
  const BodiesTotals t = result.totals();
  nlohmann::ordered_json j;
  j["seed"] = result.size.seed;
  j["ticks"] = t.ticks;
  j["held_ticks"] = t.held;
  j["passed"] = t.failed() == 0;
  for (const auto& [name, count] : counts_of(kBodiesMustBeZero, t)) j["must_be_zero"][name] = count;
  j["worst_gap_tolerances"] = static_cast<double>(t.worst_gap_m);
  j["worst_way_gap_tolerances"] = static_cast<double>(t.worst_way_m);
  j["largest_rise_j"] = static_cast<double>(t.largest_rise_j);
  j["largest_rise_share_of_bound"] = static_cast<double>(t.largest_rise_share);
  j["largest_sum_n"] = static_cast<double>(t.largest_sum_n);
  j["largest_lever_m"] = static_cast<double>(t.largest_lever_m);
  j["largest_rest_residual_n"] = static_cast<double>(t.largest_rest_n);
  j["largest_lag_m"] = static_cast<double>(t.largest_lag_m);
  for (const auto& [name, count] : counts_of(kBodiesFigures, t)) j[name] = count;
  for (const auto& [name, of] : totals_by_case(result)) {
    j["largest_ticks"][name] = {
        {"units", of.peak_units}, {"bound", of.units_bound}, {"ns", of.peak_ns}};
  }
  j["failures"] = t.failures.lines();
  return j;
}

std::string share_text(std::uint64_t part, std::uint64_t whole) {
  return number_text(100 * static_cast<Wide>(part) /
                     static_cast<Wide>(std::max<std::uint64_t>(whole, 1))) +
         " %";
}

std::string bodies_table(const BodiesFuzzResult& result) {
  ReportTable table(
      "case,scene,friction,ticks,held,worst gap,on the way,largest lag um,rejected,limited,"
      "longest arrival,peak units,their bound,peak rows,failures");
  for (const BodiesFuzzRow& row : result.rows) {
    const BodiesTotals& t = row.totals;
    if (t.ticks == 0) continue;
    table.add({row.of_case, row.scene, number_text(widen(row.friction)), t.ticks,
               share_text(t.held, t.ticks), number_text(t.worst_gap_m), number_text(t.worst_way_m),
               number_text(t.largest_lag_m * 1e6L), share_text(t.rejected_ticks, t.ticks),
               share_text(t.limited_ticks, t.ticks), t.longest_arrival, t.peak_units, t.units_bound,
               t.peak_rows, t.failed()});
  }
  return table.markdown();
}

}  // namespace

BodiesFuzzResult run_bodies_fuzz(const BodiesFuzzSize& size, const RunOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  // The scenes of a file are compiled already.
  std::optional<CompiledBodies> of_file;
  std::vector<double> file_friction;
  if (!size.scene.empty()) {
    of_file = bodies_of_file(size.scene);
    const bool is_of_hands = size.fault == BodiesFault::kBound || size.fault == BodiesFault::kGoal;
    if (of_file->takes_turns() && size.fault && !is_of_hands)
      throw tools::InputError(size.scene +
                              ": loose parts take turns in it, which the law by itself "
                              "does not; of the faults it takes bound and goal");
    file_friction = {friction_of(*of_file)};
  }
  const std::vector<BodiesScene> scenes =
      of_file ? std::vector{of_file->scene} : bodies_scenes(size.cases);
  const std::vector<double>& used = of_file ? file_friction : size.frictions;
  const std::size_t frictions = used.size();
  double shares = 0;
  for (const BodiesScene& scene : scenes) shares += scene.share;
  const double per_share =
      static_cast<double>(size.ticks) / (shares * static_cast<double>(frictions));
  Campaign<BodiesFuzzRow> campaign;
  for (const BodiesScene& scene : scenes) {
    for (const double friction : used) {
      campaign.add({scene.of_case, scene.name, friction, 0, {}}, per_share * scene.share,
                   kBodiesRunTicks);
    }
  }
  if (size.only && *size.only >= campaign.shards.size()) {
    throw tools::InputError("no run " + std::to_string(*size.only) + "; there are " +
                            std::to_string(campaign.shards.size()) + ", from 0");
  }
  const auto wanted = [&](std::size_t row) {
    return !size.only || campaign.shards[*size.only].row == row;
  };
  std::vector<CompiledBodies> compiled(campaign.rows.size());
  run_shards(
      compiled.size(), {options.threads, false}, "scenes", [] { return 0; },
      [&](int, std::size_t row) {
        if (!wanted(row)) return;
        compiled[row] =
            of_file ? *of_file : compiled_bodies(scenes[row / frictions], used[row % frictions]);
        campaign.rows[row].pairs = compiled[row].pairs.size();
      });
  campaign.run<BodiesRun>(
      options, "bodies", [&](auto& kept, const auto& shard, std::size_t number) {
        if (size.only && number != *size.only) return BodiesTotals{};
        if (of_file && of_file->takes_turns())
          return run_hands(size.scene, *of_file, shard.count, size.seed, number, size.fault);
        std::unique_ptr<BodiesRun>& run = kept[shard.row];
        if (!run) {
          const BodiesFuzzRow& row = campaign.rows[shard.row];
          run = std::make_unique<BodiesRun>(
              compiled[shard.row],
              row.of_case + ": " + row.scene + ", friction " + number_text(widen(row.friction)),
              size.work_units, size.fault);
        }
        BodiesTotals totals = run->run(shard.count, size.seed, number);
        if (of_file)
          totals.add(run_hands(size.scene, *of_file, shard.count, size.seed, number, size.fault));
        return totals;
      });
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  return {size, std::move(campaign.rows), elapsed.count()};
}

std::string bodies_fuzz_page(const BodiesFuzzResult& result) {
  const BodiesTotals t = result.totals();
  std::string text = "# Invariants of several moving bodies\n\n";
  text += std::to_string(t.ticks) + " ticks, " + std::to_string(t.held) + " held, seed " +
          std::to_string(result.size.seed) +
          "; every tick judged in long double from poses and vertices alone. Gaps are in "
          "tolerances of \"free\" of their scene.\n\n";
  text += zero_table(counts_of(kBodiesMustBeZero, t));
  text += "\nWorst gap " + number_text(t.worst_gap_m) + " tolerances at the ends of ticks, " +
          number_text(t.worst_way_m) + " on the relative ways of " + std::to_string(t.ways) +
          " steps, all that there were (allowed: -1 and rounding). Largest rise of the sum of the "
          "energies " +
          number_text(t.largest_rise_j) + " J; at most " + number_text(100 * t.largest_rise_share) +
          " % of its bound. Contact forces between bodies cancel to " +
          number_text(t.largest_sum_n) + " N in " + std::to_string(t.summed) +
          " ticks in which nothing that stands pushes. In " + std::to_string(t.rests) +
          " rests contacts leave at most " + number_text(t.largest_rest_n) +
          " N of a spring's pull.\n\n";
  return text + bodies_table(result) + failure_section(t.failures);
}

CampaignEnd bodies_fuzz_end(const BodiesFuzzResult& result) {
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  const BodiesTotals t = result.totals();
  std::string said = campaign_line(result.size.seed, t.ticks, t.held, result.seconds) + "\n" +
                     zero_line(counts_of(kBodiesMustBeZero, t)) + "\n";
  said += tools::formatted(
      "worst gap %.4Lg tolerances, on the ways of %llu steps %.4Lg, largest rise %.3Lg J (%.3Lg of "
      "its bound), forces cancel to %.3Lg N in %llu ticks, at rest %.3Lg N are left in %llu "
      "rests\n",
      t.worst_gap_m, number(t.ways), t.worst_way_m, t.largest_rise_j, t.largest_rise_share,
      t.largest_sum_n, number(t.summed), t.largest_rest_n, number(t.rests));
  said += tools::formatted(
      "rejected in %llu ticks, %llu in a row without a step at most, limited in %llu, short of "
      "budget in %llu; arrived %llu ticks after the goals at most; a driver lagged by %.4Lg um\n",
      number(t.rejected_ticks), number(t.longest_rejected), number(t.limited_ticks),
      number(t.spent_ticks), number(t.longest_arrival), t.largest_lag_m * 1e6L);
  if (t.hand_ticks > 0) {
    said += tools::formatted("the hands of the scene, as its programs move them: %llu ticks%s\n",
                             number(t.hand_ticks),
                             t.ticks == 0 ? ", alone: loose parts take turns" : "");
  }
  said += tools::formatted("peaks: units %llu, rows %llu, rounds %llu, program steps %llu\n",
                           number(t.peak_units), number(t.peak_rows), number(t.peak_rounds),
                           number(t.peak_steps));
  for (const auto& [name, of] : totals_by_case(result)) {
    if (of.ticks == 0) continue;
    said += tools::formatted("%s: largest tick %llu units, bound %llu; by the clock %.1f us\n",
                             name.c_str(), number(of.peak_units), number(of.units_bound),
                             1e-3 * static_cast<double>(of.peak_ns));
  }
  said += failure_lines(t.failures);
  said += t.failed() == 0 ? "all right\n" : "NOT all right\n";
  return {said,
          campaign_files("bodies_fuzz", csv_of(result), json_of(result), bodies_fuzz_page(result)),
          t.failed() == 0};
}

}  // namespace haptic::sim
