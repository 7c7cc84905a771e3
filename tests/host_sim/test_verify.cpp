// SPDX-License-Identifier: Apache-2.0
// The verification of the core in its short form; its long form under the label `long`.
#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "host_sim/lab/verification/contact_poses.hpp"
#include "host_sim/lab/verification/verification.hpp"
#include "tests/support/program_run.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

std::vector<VerifiedBodies> small_pairs() {
  return {class_pair(0), class_pair(1), sliver_pairs()[0]};
}

bool equal(const VerdictTotals& l, const VerdictTotals& r) {
  return l.queries == r.queries && l.separated == r.separated && l.colliding == r.colliding &&
         l.touching == r.touching && l.judged == r.judged &&
         l.largest_excess_m == r.largest_excess_m;
}

void check_all(const VerificationResult& result) {
  const VerdictTotals v = result.verdict_totals();
  CHECK(v.bad_certificates() == 0);
  CHECK(v.wrong_verdicts == 0);
  CHECK(v.wrong_boundaries == 0);
  CHECK(v.undecided == 0);
  const DepthTotals d = result.depth_totals();
  CHECK(d.wrong == 0);
  CHECK(d.wrong_bounds == 0);
  const NearTotals n = result.near_totals();
  CHECK(n.missing == 0);
  CHECK(n.extra == 0);
  CHECK(n.subset_missing == 0);
  CHECK(n.cut == 0);
  INFO("seed " << result.size.seed << "\n" << verification_page(result));
  CHECK(result.passed());
}

}  // namespace

TEST_SUITE("host_sim.verify") {
  TEST_CASE("verdicts: every certificate holds, in every state and orientation") {
    const std::vector<VerdictRow> rows = run_verdicts({6000, 2000, 5}, small_pairs(), {2, false});
    VerdictTotals totals;
    for (const VerdictRow& row : rows) {
      totals.add(row.totals);
      CHECK(row.totals.queries > 0);
      INFO("seed 5, " << row.pair << ", " << name_of(row.mode) << ", noise " << row.noise_rad);
      for (const std::string& line : row.totals.failures.lines()) MESSAGE(line);
      CHECK(row.totals.passed());
    }
    CHECK(rows.size() == 3 * 15 * 3);
    // The queries are worth something: all answers occur, a good part is judged.
    CHECK(totals.colliding > totals.queries / 5);
    CHECK(totals.separated > totals.queries / 5);
    CHECK(totals.touching > 20);
    CHECK(totals.judged > 1500);
  }

  TEST_CASE("verdicts: totals do not depend on the number of threads, but on the seed") {
    const std::vector<VerifiedBodies> pairs = small_pairs();
    const auto sum = [&](std::uint64_t seed, std::uint32_t threads) {
      VerdictTotals totals;
      for (const VerdictRow& row : run_verdicts({3000, 300, seed}, pairs, {threads, false}))
        totals.add(row.totals);
      return totals;
    };
    CHECK(equal(sum(1, 1), sum(1, 3)));
    CHECK_FALSE(equal(sum(1, 1), sum(2, 1)));
  }

  TEST_CASE("D_near: exact inside and within 5 mm, on paths with jumps") {
    DepthTotals totals;
    for (const DepthRow& row :
         run_depths({7500, 3}, {class_pair(0), class_pair(1), class_pair(3)}, {2, false})) {
      INFO("seed 3, " << row.pair);
      for (const std::string& line : row.totals.failures.lines()) MESSAGE(line);
      CHECK(row.totals.passed());
      CHECK(row.totals.inside > 20);
      CHECK(row.totals.near > 20);
      totals.add(row.totals);
    }
    CHECK(totals.jumps > 60);
    CHECK(totals.said_inexact == 0);
  }

  TEST_CASE("near sets: nothing missing, nothing extra") {
    NearTotals totals;
    for (const NearRow& row :
         run_near_sets({3000, 4}, {class_pair(0), class_pair(1), class_pair(2)}, {2, false})) {
      INFO("seed 4, " << row.pair << ", epsilon " << row.epsilon_m);
      for (const std::string& line : row.totals.failures.lines()) MESSAGE(line);
      CHECK(row.totals.passed());
      totals.add(row.totals);
    }
    CHECK(totals.poses >= 3000);
    CHECK(totals.several > 1500);
    CHECK(totals.members > 3 * totals.poses);
  }

  TEST_CASE("a wrong answer is counted: near sets with a node too many and a node too few") {
    const VerifiedBodies bodies = class_pair(1);
    VerifiedPair pair(bodies, 1e-4);
    const ContactPoses poses(bodies.a, bodies.b);
    Seeded random(9);
    StepInput input;
    input.report_goal_contact = true;
    input.pose_wa =
        poses.meet(FeatureKind::kFace, FeatureKind::kFace, false, 0, -1e-3, random).pose();
    static_cast<void>(pair.core().step(input));
    const std::span<const NearNode> near = pair.core().pair_report(0).near;
    std::vector<NearNode> nodes(near.begin(), near.end());
    REQUIRE(nodes.size() > 1);
    NearTotals right, few, many;
    CHECK(check_near_set(pair, input.pose_wa, nodes, right));
    CHECK(right.passed());
    NearNode last = nodes.back();
    nodes.pop_back();
    CHECK(check_near_set(pair, input.pose_wa, nodes, few));
    CHECK(few.missing == 1);
    nodes.push_back(last);
    last.node = last.node == 0 ? 1 : 0;
    while (std::any_of(nodes.begin(), nodes.end(),
                       [&](const NearNode& n) { return n.node == last.node; })) {
      ++last.node;
    }
    nodes.push_back(last);
    CHECK(check_near_set(pair, input.pose_wa, nodes, many));
    CHECK(many.extra == 1);
  }

  TEST_CASE("program: quick run writes every file; usage 2; bad folder 4") {
    const ScratchFolder scratch("verify");
    const std::string out = scratch.file("new/folder");
    const ProgramResult run = run_program(HAPTIC_HOST_SIM, "verify --quick --out '" + out + "'");
    CHECK(run.exit_code == 0);
    const auto json = nlohmann::json::parse(text_of_file(out + "/verify.json"));
    CHECK(json.at("passed") == (run.exit_code == 0));
    CHECK(json.at("verdicts").at("total").at("queries") >= 12000);
    CHECK(json.at("d_near").at("rows").size() == kClassCount);
    CHECK(json.at("near_sets").at("total").at("missing") == 0);
    CHECK(text_of_file(out + "/verify.md").find("| hull 200, hull 200 |") != std::string::npos);
    const std::string csv = text_of_file(out + "/verify_verdicts.csv");
    CHECK(std::count(csv.begin(), csv.end(), '\n') == 1 + 12 * 15 * 3);
    CHECK(text_of_file(out + "/verify_d_near.csv").starts_with("pair,size_m,ticks,"));
    CHECK(text_of_file(out + "/verify_near_sets.csv").starts_with("pair,epsilon_m,poses,"));
    CHECK(run_program(HAPTIC_HOST_SIM, "verify").exit_code == 2);
    CHECK(run_program(HAPTIC_HOST_SIM, "verify --fault nothing").exit_code == 2);
    std::ofstream(scratch.file("file")) << "x";
    CHECK(run_program(HAPTIC_HOST_SIM, "verify --quick --out '" + scratch.file("file") + "'")
              .exit_code == 4);
  }

  TEST_CASE("[long] ten million verdicts, a million ticks, half a million near sets") {
    VerificationSize size{10000000, 500000, 1000000, 500000, 2};
    check_all(run_verification(size, {2, true}));
  }
}
