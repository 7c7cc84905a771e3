// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/proxy_fuzz/proxy_campaign.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>

#include "host_sim/lab/proxy_fuzz/fuzz_run.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

namespace {

/// A budget by its share of the way from the least to the most, on a scale of logarithms.
std::uint32_t budget_at(double share) {
  constexpr double kLeast = kLeastWorkUnits, kMost = kMostFuzzUnits;
  return static_cast<std::uint32_t>(kLeast * std::pow(kMost / kLeast, share));
}

/// Ticks of a run; each begins at a free pose of its own.
constexpr std::uint64_t kShardTicks = 1000;

// proxy_fuzz.csv, .json and .md.

constexpr NamedCount<ProxyFuzzTotals> kFigures[] = {
    {"longest_still", &ProxyFuzzTotals::longest_still},
    {"longest_stall", &ProxyFuzzTotals::longest_stall},
    {"longest_rejected", &ProxyFuzzTotals::longest_rejected},
    {"rejected_passes", &ProxyFuzzTotals::rejected_passes},
    {"limited_ticks", &ProxyFuzzTotals::limited},
    {"anchored_ticks", &ProxyFuzzTotals::anchored},
    {"behind_ticks", &ProxyFuzzTotals::behind},
    {"longest_behind", &ProxyFuzzTotals::longest_behind},
    {"longest_arrival", &ProxyFuzzTotals::longest_arrival}};
constexpr struct {
  const char* name;
  std::uint32_t StepCounters::*field;
} kPeaks[] = {
    {"passes", &StepCounters::proxy_passes},   {"rounds", &StepCounters::proxy_rounds},
    {"rows", &StepCounters::proxy_rows},       {"qp_iterations", &StepCounters::qp_iterations},
    {"plane_gaps", &StepCounters::plane_gaps}, {"valid_nodes", &StepCounters::valid_nodes},
    {"work_units", &StepCounters::work_units}};

std::string csv(const ProxyFuzzResult& result) {
  std::string columns =
      "scene,friction,motion,passes,budget,ticks,held,worst_gap_m,worst_path_m,largest_rise_j,rise_"
      "share";
  columns += column_names(counts_of(kProxyMustBeZero, {}));
  columns += column_names(counts_of(kFigures, {}));
  for (const auto& p : kPeaks) columns += std::string(",peak_") + p.name;
  ReportTable table(columns);
  for (const ProxyFuzzRow& row : result.rows) {
    const ProxyFuzzTotals& t = row.totals;
    std::vector<Cell> cells{quoted(row.scene),
                            row.friction,
                            row.motion,
                            row.passes,
                            row.work_units,
                            t.ticks,
                            t.held,
                            number_text(t.worst_gap_m),
                            number_text(t.worst_path_m),
                            number_text(t.largest_rise_j),
                            number_text(t.largest_rise_share)};
    append_cells(cells, counts_of(kProxyMustBeZero, t));
    append_cells(cells, counts_of(kFigures, t));
    for (const auto& p : kPeaks) cells.emplace_back(t.peaks.*p.field);
    table.add(std::move(cells));
  }
  return table.csv();
}

nlohmann::ordered_json json(const ProxyFuzzResult& result) {
  const ProxyFuzzTotals t = result.totals();
  nlohmann::ordered_json j;
  j["seed"] = result.size.seed;
  j["ticks"] = t.ticks;
  j["held_ticks"] = t.held;
  j["passed"] = t.failed() == 0;
  for (const auto& [name, count] : counts_of(kProxyMustBeZero, t)) j["must_be_zero"][name] = count;
  j["worst_gap_m"] = static_cast<double>(t.worst_gap_m);
  j["worst_path_gap_m"] = static_cast<double>(t.worst_path_m);
  j["judged_paths"] = t.paths;
  j["largest_rise_j"] = static_cast<double>(t.largest_rise_j);
  j["largest_rise_share_of_bound"] = static_cast<double>(t.largest_rise_share);
  j["largest_wrench_error_of_rounding"] = static_cast<double>(t.largest_wrench_error);
  for (const auto& [name, count] : counts_of(kFigures, t)) j[name] = count;
  for (const auto& p : kPeaks) j["peaks"][p.name] = t.peaks.*p.field;
  j["failures"] = t.failures.lines();
  return j;
}

/// Rows of one scene and friction together.
std::string scene_table(const ProxyFuzzResult& result) {
  ReportTable table(
      "scene,friction,ticks,held,worst gap um,on the way um,largest rise J,longest still,stall,all "
      "rejected,"
      "rejected passes,rounds,rows,QP steps,plane gaps,valid nodes,failures");
  Groups<std::pair<std::string, double>, ProxyFuzzTotals> groups;
  for (const ProxyFuzzRow& row : result.rows) groups.at({row.scene, row.friction}).add(row.totals);
  for (const auto& [key, t] : groups.list()) {
    const std::uint64_t held = 100 * t.held / std::max<std::uint64_t>(t.ticks, 1);
    table.add({key.first, number_text(widen(key.second)), t.ticks, std::to_string(held) + " %",
               number_text(t.worst_gap_m * 1e6L), number_text(t.worst_path_m * 1e6L),
               number_text(t.largest_rise_j), t.longest_still, t.longest_stall, t.longest_rejected,
               t.rejected_passes, t.peaks.proxy_rounds, t.peaks.proxy_rows, t.peaks.qp_iterations,
               t.peaks.plane_gaps, t.peaks.valid_nodes, t.failed()});
  }
  return table.markdown();
}

}  // namespace

void ProxyFuzzTotals::add(const ProxyFuzzTotals& other) {
  using T = ProxyFuzzTotals;
  for (const auto field :
       {&T::ticks, &T::held, &T::deep, &T::dips, &T::paths, &T::rises, &T::stalls, &T::walls,
        &T::crossings, &T::wrenches, &T::goals, &T::over_caps, &T::recoveries, &T::rejected_passes,
        &T::limited, &T::anchored, &T::behind, &T::stuck}) {
    this->*field += other.*field;
  }
  for (const auto field : {&T::longest_still, &T::longest_stall, &T::longest_rejected,
                           &T::longest_behind, &T::longest_arrival}) {
    this->*field = std::max(this->*field, other.*field);
  }
  worst_gap_m = std::min(worst_gap_m, other.worst_gap_m);
  worst_path_m = std::min(worst_path_m, other.worst_path_m);
  for (const auto field : {&T::largest_rise_j, &T::largest_rise_share, &T::largest_wrench_error}) {
    this->*field = std::max(this->*field, other.*field);
  }
  raise_peaks(other.peaks, peaks);
  failures.add(other.failures);
}

ProxyFuzzResult run_proxy_fuzz(const ProxyFuzzSize& size, const RunOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const std::vector<FuzzScene> scenes = fuzz_scenes();
  // With one pass in a tick the way of the tick is the way of the pass.
  constexpr std::uint32_t kPasses[] = {kDefaultProxyPasses, 1};
  const std::size_t frictions = size.frictions.size(), kinds = std::size(kFuzzMotions);
  const std::size_t runs = size.paths ? std::size(kPasses) : 1;
  double shares = 0;
  for (const FuzzScene& scene : scenes) shares += scene.share;
  const double per_share =
      static_cast<double>(size.ticks) / (shares * static_cast<double>(frictions * runs * kinds));
  std::vector<std::uint32_t> units_of;  // by scene, friction and passes
  Campaign<ProxyFuzzRow> campaign;
  for (const FuzzScene& scene : scenes) {
    for (const double friction : size.frictions) {
      for (const std::uint32_t passes : std::span(kPasses).first(runs)) {
        // By equal steps of the logarithm, in an order that no other choice follows.
        const double share =
            std::fmod(0.618034 * static_cast<double>(units_of.size() + size.seed), 1);
        units_of.push_back(size.budgets ? budget_at(share) : 0);
        for (const FuzzMotionKind kind : kFuzzMotions) {
          campaign.add({scene.name, to_text(kind), friction, passes, units_of.back(), {}},
                       per_share * scene.share, kShardTicks);
        }
      }
    }
  }
  std::vector<std::vector<std::byte>> blobs(scenes.size() * frictions * runs);
  run_shards(
      blobs.size(), {options.threads, false}, "scenes", [] { return 0; },
      [&](int, std::size_t k) {
        blobs[k] = compiled(scenes[k / runs / frictions], size.frictions[k / runs % frictions],
                            kPasses[k % runs], units_of[k]);
      });
  campaign.run<FuzzRun>(options, "proxy", [&](auto& kept, const auto& shard, std::size_t number) {
    const std::size_t at = shard.row / kinds;
    std::unique_ptr<FuzzRun>& run = kept[at];
    if (!run) {
      run = std::make_unique<FuzzRun>(scenes[at / runs / frictions],
                                      size.frictions[at / runs % frictions], blobs[at], size.fault,
                                      size.budgets);
    }
    return run->run(kFuzzMotions[shard.row % kinds], shard.count, seed_of(size.seed, number));
  });
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  return {size, std::move(campaign.rows), elapsed.count()};
}

std::string proxy_fuzz_page(const ProxyFuzzResult& result) {
  const ProxyFuzzTotals t = result.totals();
  std::string text = "# Invariants of the proxy\n\n";
  text += std::to_string(t.ticks) + " ticks, seed " + std::to_string(result.size.seed) +
          "; every tick judged in long double from poses and vertices alone. Lengths are for a "
          "part of 50 mm.\n\n";
  text += zero_table(counts_of(kProxyMustBeZero, t));
  text +=
      "\nWorst gap " + number_text(t.worst_gap_m * 1e6L) + " um at the ends of ticks, " +
      number_text(t.worst_path_m * 1e6L) + " um on the straight ways of " +
      std::to_string(t.paths) + " passes (allowed: the tolerance of \"free\" of its scene" +
      (sizeof(Real) == sizeof(double) ? ", -0.1" : "") + "). Largest rise of the energy " +
      number_text(t.largest_rise_j) + " J; at most " + number_text(100 * t.largest_rise_share) +
      " % of what rounding makes of it. Longest run of ticks without a move that was possible: " +
      std::to_string(t.longest_stall) + " (looked for from the 6th on; allowed 10).\n\n";
  if (result.size.budgets) {
    text += "Budgets of " + std::to_string(kLeastWorkUnits) + " to " +
            std::to_string(kMostFuzzUnits) + " units of work: " + std::to_string(t.behind) +
            " ticks ended for want of it, " + std::to_string(t.longest_behind) +
            " in a row at most. Where the device stood still the part had arrived after " +
            std::to_string(t.longest_arrival) + " ticks at most.\n\n";
  }
  return text + scene_table(result) + failure_section(t.failures);
}

CampaignEnd proxy_fuzz_end(const ProxyFuzzResult& result) {
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  const ProxyFuzzTotals t = result.totals();
  std::string said = campaign_line(result.size.seed, t.ticks, t.held, result.seconds) + "\n" +
                     zero_line(counts_of(kProxyMustBeZero, t)) + "\n";
  said += tools::formatted(
      "worst gap %.4Lg um, on the ways of %llu passes %.4Lg um, largest rise %.3Lg J (%.3Lg of "
      "rounding), longest stall %llu, all "
      "passes rejected for %llu ticks, %llu passes in all\n",
      t.worst_gap_m * 1e6L, number(t.paths), t.worst_path_m * 1e6L, t.largest_rise_j,
      t.largest_rise_share, number(t.longest_stall), number(t.longest_rejected),
      number(t.rejected_passes));
  said +=
      tools::formatted("peaks: rounds %u, rows %u, QP steps %u, plane gaps %u, valid nodes %u\n",
                       t.peaks.proxy_rounds, t.peaks.proxy_rows, t.peaks.qp_iterations,
                       t.peaks.plane_gaps, t.peaks.valid_nodes);
  if (result.size.budgets) {
    said += tools::formatted(
        "ended for want of budget: %llu ticks, %llu in a row at most; arrived %llu ticks after the "
        "device at most\n",
        number(t.behind), number(t.longest_behind), number(t.longest_arrival));
  }
  return {said + failure_lines(t.failures),
          campaign_files("proxy_fuzz", csv(result), json(result), proxy_fuzz_page(result)),
          t.failed() == 0};
}

}  // namespace haptic::sim
