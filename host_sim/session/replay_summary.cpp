// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/replay_summary.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>

#include "tools/common/formatted.hpp"
#include "tools/verdict/verdict_json.hpp"

namespace haptic::sim {
namespace {

double distance(const double (&a)[3], const double (&b)[3]) {
  const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return length_of(d);
}

using tools::append_line;
using ull = unsigned long long;

double percent(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

void check_text(std::string& text, const CheckTotals& c) {
  append_line(text, "check against the exhaustive search in long double:");
  append_line(
      text,
      "  wrong verdicts        %llu ticks, %llu pair-ticks (%llu false, %llu missed collisions)",
      ull{c.wrong_verdict_ticks}, ull{c.wrong_verdict_pairs}, ull{c.false_collision_pairs},
      ull{c.missed_collision_pairs});
  append_line(text, "  wrong d_near          %llu ticks, %llu pair-ticks of %llu",
              ull{c.wrong_depth_ticks}, ull{c.wrong_depth_pairs}, ull{c.pair_ticks});
  append_line(text, "  largest error         %.3Lg m (tolerance there %.3Lg m)", c.largest_error_m,
              c.tolerance_at_largest_m);
  append_line(text, "  longest wrong run     %llu ticks (verdict: %llu)", ull{c.longest_wrong_run},
              ull{c.longest_wrong_verdict_run});
  append_line(text, "  either verdict right  %llu pair-ticks within the tolerance of touching",
              ull{c.touching_pairs});
  append_line(text, "  apart by a bound      %llu pair-ticks (verdict checked)", ull{c.far_pairs});
  append_line(text, "  depth is a bound      %llu pair-ticks, flagged (verdict and bound checked)",
              ull{c.bounded_pairs});
  append_line(text, "  d_near is a range     %llu pair-ticks (nearly parallel edges, separated)",
              ull{c.widened_pairs});
  if (!c.passed()) {
    append_line(text, "  first wrong           tick %llu, pair %llu", ull{c.first_wrong_tick},
                ull{c.first_wrong_pair});
  }
  append_line(text, "  result                %s", c.passed() ? "passed" : "FAILED");
}

/// Failures of a replay besides its verdict; empty: none.
std::string other_failures(const ReplayReport& report) {
  std::string text;
  const auto add = [&text](bool failed, const std::string& what) {
    if (failed) text += (text.empty() ? "" : "; ") + what;
  };
  add(!report.bounded || !report.totals.within_bounds(), "a count of work is over its bound");
  add(report.check && !report.check->passed(), "the exhaustive search finds other contacts");
  add(report.reference && report.reference->wrong > 0,
      "overlap at the device's pose is not that of the reference");
  add(!report.lost.empty(), report.lost);
  return text;
}

/// The last line.
std::string verdict_text(const ReplayReport& report) {
  const std::string other = other_failures(report);
  if (report.verdict) return std::string(tools::verdict_line(*report.verdict, other).view());
  return (other.empty() ? "" : "FAILED: " + other + "; ") +
         "the literal steps of the paper are not judged";
}

}  // namespace

ReplayTotals total(std::span<const TickRecord> ticks, const SceneCapacity& capacity) {
  ReplayTotals t;
  t.ticks = ticks.size();
  t.pair_count = capacity.pair_count;
  t.nodes_bound = static_cast<std::uint32_t>(std::min<std::uint64_t>(
      std::uint64_t{capacity.max_feature_evaluations} + capacity.max_edge_pairs, UINT32_MAX));
  t.support_pairs_bound = capacity.max_support_pairs;
  t.smallest_d_near_m = std::numeric_limits<double>::infinity();
  double nodes = 0;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const TickRecord& r = ticks[i];
    t.largest_force_n = std::max(t.largest_force_n, length_of(r.force_n));
    t.largest_torque_nm = std::max(t.largest_torque_nm, length_of(r.torque_nm));
    if (r.status != RtStatus::kOk) {
      ++t.refused_poses;
    } else {
      t.smallest_d_near_m = std::min(t.smallest_d_near_m, r.d_near_m);
      t.contact_ticks += r.in_contact ? 1u : 0u;
      ++t.situation_ticks[r.situation.code];
    }
    nodes += r.nodes_evaluated;
    t.nodes_largest = std::max(t.nodes_largest, r.nodes_evaluated);
    t.support_pairs_largest = std::max(t.support_pairs_largest, r.support_pairs);
    for (std::size_t bit = 0; bit < t.flag_ticks.size(); ++bit)
      t.flag_ticks[bit] += (r.flags >> bit) & 1u;
    if (i == 0) continue;
    t.pair_ticks += capacity.pair_count;
    t.relocalised_pair_ticks += r.relocalised_pairs;
    t.situation_changes += r.situation != ticks[i - 1].situation ? 1u : 0u;
    t.largest_force_change_n =
        std::max(t.largest_force_change_n, distance(r.force_n, ticks[i - 1].force_n));
    t.largest_torque_change_nm =
        std::max(t.largest_torque_change_nm, distance(r.torque_nm, ticks[i - 1].torque_nm));
  }
  if (!ticks.empty()) {
    t.nodes_mean = nodes / static_cast<double>(ticks.size());
    t.duration_s = ticks.back().t_s - ticks.front().t_s;
    t.final_hash = ticks.back().state_hash;
  }
  return t;
}

bool ReplayReport::passed() const {
  return other_failures(*this).empty() && !(verdict && verdict->failed());
}

std::string text_summary(const ReplayReport& report) {
  const ReplayTotals& t = report.totals;
  std::string text;
  append_line(text, "replay of %s on %s (%s)", report.motion.c_str(), report.scene.c_str(),
              report.mode.c_str());
  append_line(text, "  ticks                 %llu (%.3f s), in contact %llu (%.1f %%)",
              ull{t.ticks}, t.duration_s, ull{t.contact_ticks}, percent(t.contact_ticks, t.ticks));
  std::string situations;
  for (std::size_t s = 1; s < t.situation_ticks.size(); ++s) {
    if (t.situation_ticks[s] == 0) continue;
    situations += (situations.empty() ? "" : ", ") +
                  std::string(to_text(static_cast<ContactSituation>(s))) + " " +
                  std::to_string(t.situation_ticks[s]);
  }
  append_line(text, "  situation changes     %llu%s%s", ull{t.situation_changes},
              situations.empty() ? "" : "; ticks: ", situations.c_str());
  append_line(text, "  largest force         %.6g N, change per tick %.6g N", t.largest_force_n,
              t.largest_force_change_n);
  append_line(text, "  largest torque        %.6g N m, change per tick %.6g N m",
              t.largest_torque_nm, t.largest_torque_change_nm);
  if (std::isfinite(t.smallest_d_near_m)) {  // the goal pose was searched
    append_line(text, "  smallest d_near       %.6g m", t.smallest_d_near_m);
    append_line(text, "  nodes evaluated       mean %.1f, largest %u, bound %u%s", t.nodes_mean,
                t.nodes_largest, t.nodes_bound,
                t.nodes_largest <= t.nodes_bound ? "" : "  OVER ITS BOUND");
    append_line(text, "  support pairs         largest %u, bound %u%s", t.support_pairs_largest,
                t.support_pairs_bound,
                t.support_pairs_largest <= t.support_pairs_bound ? "" : "  OVER ITS BOUND");
    append_line(text,
                "  re-localised          %llu of %llu pair-ticks after the first tick (%.4f %%)",
                ull{t.relocalised_pair_ticks}, ull{t.pair_ticks},
                percent(t.relocalised_pair_ticks, t.pair_ticks));
  }
  std::string flags;
  for (std::size_t bit = 0; bit < t.flag_ticks.size(); ++bit) {
    if (t.flag_ticks[bit] == 0) continue;
    flags += (flags.empty() ? "" : ", ") + std::string(flag_name(bit)) + " " +
             std::to_string(t.flag_ticks[bit]);
  }
  append_line(text, "  flags (ticks)         %s", flags.empty() ? "none" : flags.c_str());
  if (t.refused_poses > 0) append_line(text, "  refused poses         %llu", ull{t.refused_poses});
  append_line(text, "  final state hash      %016llx", ull{t.final_hash});
  if (report.check) check_text(text, *report.check);
  if (report.reference) {
    const ReferenceTotals& r = *report.reference;
    append_line(text,
                "reference, overlap at the device's pose: yes %llu, no %llu, undecided %llu, "
                "without a tick "
                "%llu, wrong %llu%s",
                ull{r.contact}, ull{r.free}, ull{r.undecided}, ull{r.unmatched}, ull{r.wrong},
                r.wrong > 0 ? "  FAILED" : "");
    if (r.wrong > 0) append_line(text, "  first wrong           t = %.3f s", r.first_wrong_t_s);
  }
  return text + driven_text(report.driven) + verdict_text(report) + "\n";
}

std::string json_summary(const ReplayReport& report) {
  using OrderedJson = nlohmann::ordered_json;
  const ReplayTotals& t = report.totals;
  OrderedJson json;
  json["scene"] = report.scene;
  json["motion"] = report.motion;
  json["mode"] = report.mode;
  json["ticks"] = t.ticks;
  json["duration_s"] = t.duration_s;
  json["contact_ticks"] = t.contact_ticks;
  json["situation_changes"] = t.situation_changes;
  for (std::size_t s = 0; s < t.situation_ticks.size(); ++s) {
    json["situation_ticks"][to_text(static_cast<ContactSituation>(s))] = t.situation_ticks[s];
  }
  json["largest_force_n"] = t.largest_force_n;
  json["largest_torque_nm"] = t.largest_torque_nm;
  json["largest_force_change_n"] = t.largest_force_change_n;
  json["largest_torque_change_nm"] = t.largest_torque_change_nm;
  json["smallest_d_near_m"] = t.smallest_d_near_m;
  json["nodes_evaluated"] = {
      {"mean", t.nodes_mean}, {"largest", t.nodes_largest}, {"bound", t.nodes_bound}};
  json["support_pairs"] = {{"largest", t.support_pairs_largest}, {"bound", t.support_pairs_bound}};
  json["within_bounds"] = t.within_bounds();
  json["relocalised_pair_ticks"] = t.relocalised_pair_ticks;
  json["pair_ticks"] = t.pair_ticks;
  json["relocalised_percent"] = percent(t.relocalised_pair_ticks, t.pair_ticks);
  for (std::size_t bit = 0; bit < t.flag_ticks.size(); ++bit)
    json["flag_ticks"][flag_name(bit)] = t.flag_ticks[bit];
  json["refused_poses"] = t.refused_poses;
  json["final_state_hash"] = tools::hash_text(t.final_hash);
  if (!report.driven.empty()) json["driven"] = driven_json(report.driven);
  if (report.check) {
    const CheckTotals& c = *report.check;
    json["check"] = {
        {"passed", c.passed()},
        {"wrong_verdict_ticks", c.wrong_verdict_ticks},
        {"wrong_verdict_pair_ticks", c.wrong_verdict_pairs},
        {"false_collision_pair_ticks", c.false_collision_pairs},
        {"missed_collision_pair_ticks", c.missed_collision_pairs},
        {"wrong_d_near_ticks", c.wrong_depth_ticks},
        {"wrong_d_near_pair_ticks", c.wrong_depth_pairs},
        {"pair_ticks", c.pair_ticks},
        {"largest_error_m", static_cast<double>(c.largest_error_m)},
        {"tolerance_at_largest_error_m", static_cast<double>(c.tolerance_at_largest_m)},
        {"longest_wrong_run_ticks", c.longest_wrong_run},
        {"longest_wrong_verdict_run_ticks", c.longest_wrong_verdict_run},
        {"touching_pair_ticks", c.touching_pairs},
        {"far_pair_ticks", c.far_pairs},
        {"bounded_depth_pair_ticks", c.bounded_pairs},
        {"d_near_range_pair_ticks", c.widened_pairs}};
  }
  if (report.reference) {
    const ReferenceTotals& r = *report.reference;
    json["reference"] = {{"contact", r.contact},
                         {"free", r.free},
                         {"undecided", r.undecided},
                         {"unmatched", r.unmatched},
                         {"wrong", r.wrong}};
  }
  if (report.verdict) json["verdict"] = tools::verdict_json(*report.verdict, verdict_text(report));
  return json.dump(2) + "\n";
}

}  // namespace haptic::sim
