// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/verification/verification.hpp"

#include <nlohmann/json.hpp>

#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

namespace {

std::string count(std::uint64_t n) { return std::to_string(n); }
std::string metres(Wide value) { return value == 0 ? "0" : number_text(value); }
std::string orientation_of(const VerdictRow& row) {
  return row.aligned ? "aligned, noise " + number_text(widen(row.noise_rad)) + " rad" : "generic";
}

std::vector<std::string> verdict_cells(const std::string& name, const VerdictTotals& t) {
  return {name,
          count(t.queries),
          count(t.separated),
          count(t.colliding),
          count(t.touching),
          count(t.undecided),
          count(t.bad_certificates()),
          count(t.judged),
          count(t.wrong_verdicts + t.wrong_boundaries),
          count(t.by_slack),
          metres(t.largest_excess_m)};
}

std::string verdict_table(const char* first, const Groups<std::string, VerdictTotals>& groups) {
  std::string table =
      table_head({first, "queries", "separated", "colliding", "touching", "undecided",
                  "bad certificates", "judged", "wrong", "by slack", "largest distance, m"});
  for (const auto& [name, totals] : groups.list()) table += table_row(verdict_cells(name, totals));
  return table;
}

std::string verdict_section(const VerificationResult& result) {
  Groups<std::string, VerdictTotals> pairs, modes, orientations;
  for (const VerdictRow& row : result.verdicts) {
    pairs.at(row.pair).add(row.totals);
    modes.at(name_of(row.mode)).add(row.totals);
    orientations.at(orientation_of(row)).add(row.totals);
  }
  pairs.at("all").add(result.verdict_totals());
  return "## Verdicts\n\nEvery certificate is checked again in long double from the vertices "
         "alone. "
         "Separated: along the reported direction the smallest height of all vertices of A is "
         "above "
         "the largest of all of B, by at least the reported bound. Colliding: x is in the "
         "tetrahedron of c = mean(B) - R mean(A) and three points b - R a, or no farther from it "
         "than " +
         number_text(certificate_slack_of_real()) +
         " of the largest coordinate (\"by slack\"; largest such distance in the last column). "
         "Judged: by the exhaustive search; touching and undecided answers always.\n\n" +
         verdict_table("pair", pairs) + "\n" + verdict_table("state of the core", modes) + "\n" +
         verdict_table("orientation", orientations);
}

std::string depth_section(const VerificationResult& result) {
  std::string text =
      "\n## D_near\n\nCoherent 1 kHz paths at up to 1 m/s and 10 rad/s with jumps; inside and up "
      "to "
      "5 mm outside, against the exhaustive search. Allowed: " +
      number_text(precision_of_real().relative_depth) + " of the size.\n\n" +
      table_head({"pair", "ticks", "inside", "within 5 mm", "wrong", "wrong bounds beyond",
                  "largest error inside, m", "outside, m", "D_near a range", "said inexact"});
  const auto line = [&](const std::string& name, const DepthTotals& t) {
    text += table_row({name, count(t.ticks), count(t.inside), count(t.near), count(t.wrong),
                       count(t.wrong_bounds), metres(t.largest_inside_m), metres(t.largest_near_m),
                       count(t.ranges), count(t.said_inexact)});
  };
  for (const DepthRow& row : result.depths) line(row.pair, row.totals);
  line("all", result.depth_totals());
  return text;
}

std::string near_section(const VerificationResult& result) {
  std::string text =
      "\n## Near sets\n\nAgainst the definition evaluated for every node. Ambiguous: within "
      "rounding "
      "of a bound of the definition, either answer is right. Subset: nodes with |f - D| + (f - "
      "s(n)) "
      "< epsilon, s over both full supports.\n\n" +
      table_head({"pair", "epsilon, m", "poses", "with several", "members", "missing", "extra",
                  "subset missing", "ambiguous", "largest set", "cut"});
  const auto line = [&](const std::string& name, const std::string& epsilon, const NearTotals& t) {
    text += table_row({name, epsilon, count(t.poses), count(t.several), count(t.members),
                       count(t.missing), count(t.extra), count(t.subset_missing),
                       count(t.ambiguous), count(t.largest_set), count(t.cut)});
  };
  for (const NearRow& row : result.near_sets)
    line(row.pair, number_text(widen(row.epsilon_m)), row.totals);
  line("all", "", result.near_totals());
  return text;
}

std::string failure_section(const VerificationResult& result) {
  std::string text;
  for (const FailureLog& failures :
       {result.verdict_totals().failures, result.depth_totals().failures,
        result.near_totals().failures}) {
    for (const std::string& line : failures.lines()) text += "- " + line + "\n";
  }
  return text.empty() ? text : "\n## First failures\n\n" + text;
}

nlohmann::ordered_json json_of(const VerdictTotals& t) {
  return {{"queries", t.queries},
          {"separated", t.separated},
          {"colliding", t.colliding},
          {"touching", t.touching},
          {"undecided", t.undecided},
          {"far_answers", t.far_answers},
          {"inexact", t.inexact},
          {"refused", t.refused},
          {"bad_separations", t.bad_separations},
          {"bad_bounds", t.bad_bounds},
          {"bad_collisions", t.bad_collisions},
          {"judged", t.judged},
          {"wrong_verdicts", t.wrong_verdicts},
          {"wrong_boundaries", t.wrong_boundaries},
          {"by_slack", t.by_slack},
          {"largest_excess_m", static_cast<double>(t.largest_excess_m)},
          {"largest_thickness_m", static_cast<double>(t.largest_thickness_m)},
          {"failures", t.failures.lines()}};
}

nlohmann::ordered_json json_of(const DepthTotals& t) {
  return {{"ticks", t.ticks},
          {"inside", t.inside},
          {"near", t.near},
          {"jumps", t.jumps},
          {"wrong", t.wrong},
          {"wrong_bounds", t.wrong_bounds},
          {"said_inexact", t.said_inexact},
          {"ranges", t.ranges},
          {"largest_inside_m", static_cast<double>(t.largest_inside_m)},
          {"largest_near_m", static_cast<double>(t.largest_near_m)},
          {"failures", t.failures.lines()}};
}

nlohmann::ordered_json json_of(const NearTotals& t) {
  return {{"poses", t.poses},         {"several", t.several}, {"members", t.members},
          {"missing", t.missing},     {"extra", t.extra},     {"subset_missing", t.subset_missing},
          {"ambiguous", t.ambiguous}, {"cut", t.cut},         {"largest_set", t.largest_set},
          {"beyond", t.beyond},       {"ranges", t.ranges},   {"failures", t.failures.lines()}};
}

/// One line of values under a header of the names in `row`, numbers and words alone.
std::string csv_of(const std::vector<nlohmann::ordered_json>& rows) {
  std::string text;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    std::string names, values;
    for (const auto& [name, value] : rows[k].items()) {
      if (value.is_array()) continue;
      names += (names.empty() ? "" : ",") + name;
      values += (values.empty() ? "" : ",") + value.dump();
    }
    if (k == 0) text += names + "\n";
    text += values + "\n";
  }
  return text;
}

template <typename Totals>
nlohmann::ordered_json named(nlohmann::ordered_json head, const Totals& totals) {
  head.update(json_of(totals));
  return head;
}

std::string verification_lines(const VerificationResult& result) {
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  const VerdictTotals v = result.verdict_totals();
  const DepthTotals d = result.depth_totals();
  const NearTotals n = result.near_totals();
  return tools::formatted(
             "verdicts   %llu queries (%llu separated, %llu colliding, %llu touching, %llu "
             "undecided): %llu bad certificates; %llu judged: %llu wrong\n",
             number(v.queries), number(v.separated), number(v.colliding), number(v.touching),
             number(v.undecided), number(v.bad_certificates()), number(v.judged),
             number(v.wrong_verdicts + v.wrong_boundaries)) +
         tools::formatted(
             "D_near     %llu ticks (%llu inside, %llu within 5 mm): %llu wrong, largest error "
             "%.2Lg m inside, %.2Lg m outside; %llu wrong bounds beyond\n",
             number(d.ticks), number(d.inside), number(d.near), number(d.wrong), d.largest_inside_m,
             d.largest_near_m, number(d.wrong_bounds)) +
         tools::formatted(
             "near sets  %llu poses, %llu members: %llu missing, %llu extra, %llu of the subset "
             "missing; %llu ambiguous, %llu cut\n",
             number(n.poses), number(n.members), number(n.missing), number(n.extra),
             number(n.subset_missing), number(n.ambiguous), number(n.cut));
}

}  // namespace

bool VerificationResult::passed() const {
  return verdict_totals().passed() && depth_totals().passed() && near_totals().passed();
}

VerificationResult run_verification(const VerificationSize& size, const RunOptions& options) {
  VerificationResult result;
  result.size = size;
  const std::vector<VerifiedBodies> classes = class_pairs();
  std::vector<VerifiedBodies> all = classes;
  for (VerifiedBodies& bodies : sliver_pairs()) all.push_back(std::move(bodies));
  if (size.queries > 0)
    result.verdicts = run_verdicts({size.queries, size.judged, size.seed}, all, options);
  if (size.ticks > 0) result.depths = run_depths({size.ticks, size.seed}, classes, options);
  if (size.near_poses > 0)
    result.near_sets = run_near_sets({size.near_poses, size.seed}, classes, options);
  return result;
}

std::string verification_page(const VerificationResult& result) {
  return "# Verification\n\nMade by `host_sim verify`. Seed " + count(result.size.seed) + ": " +
         (result.passed() ? "**every count that must be zero is zero.**"
                          : "**a count that must be zero is not.**") +
         "\n\n" + verdict_section(result) + depth_section(result) + near_section(result) +
         failure_section(result);
}

CampaignEnd verification_end(const VerificationResult& result, const std::string& folder) {
  std::vector<nlohmann::ordered_json> verdicts, depths, near_sets;
  for (const VerdictRow& row : result.verdicts) {
    verdicts.push_back(named({{"pair", row.pair},
                              {"state", name_of(row.mode)},
                              {"orientation", row.aligned ? "aligned" : "generic"},
                              {"noise_rad", row.noise_rad}},
                             row.totals));
  }
  for (const DepthRow& row : result.depths)
    depths.push_back(named({{"pair", row.pair}, {"size_m", row.size_m}}, row.totals));
  for (const NearRow& row : result.near_sets)
    near_sets.push_back(named({{"pair", row.pair}, {"epsilon_m", row.epsilon_m}}, row.totals));
  const nlohmann::ordered_json page = {
      {"passed", result.passed()},
      {"seed", result.size.seed},
      {"verdicts", {{"total", json_of(result.verdict_totals())}, {"rows", verdicts}}},
      {"d_near", {{"total", json_of(result.depth_totals())}, {"rows", depths}}},
      {"near_sets", {{"total", json_of(result.near_totals())}, {"rows", near_sets}}}};
  return {verification_lines(result) + folder + "/verify.md: " +
              (result.passed() ? "every count that must be zero is zero\n"
                               : "a count that must be zero is not\n"),
          {{"verify.json", page.dump(2) + "\n"},
           {"verify.md", verification_page(result)},
           {"verify_verdicts.csv", csv_of(verdicts)},
           {"verify_d_near.csv", csv_of(depths)},
           {"verify_near_sets.csv", csv_of(near_sets)}},
          result.passed()};
}

}  // namespace haptic::sim
