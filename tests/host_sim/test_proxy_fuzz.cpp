// SPDX-License-Identifier: Apache-2.0
// The invariants of the proxy on random, jittering and jumping devices, and proof that their checks
// can fail.
#include <doctest/doctest.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/lab/proxy_fuzz/fuzz_run.hpp"
#include "host_sim/lab/proxy_fuzz/proxy_campaign.hpp"
#include "tests/support/all_checks.hpp"
#include "tests/support/program_run.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;
using haptic::test::all_checks;
using haptic::test::trials;

namespace {

const auto kTicks = trials<std::uint64_t>(10000, 20000);

ProxyFuzzResult run(std::uint64_t ticks, std::uint64_t seed, std::uint32_t threads,
                    std::optional<ProxyFault> fault = std::nullopt,
                    std::vector<double> frictions = {0.0, 0.3}) {
  ProxyFuzzSize size;
  size.frictions = std::move(frictions);
  size.ticks = ticks;
  size.seed = seed;
  size.fault = fault;
  return run_proxy_fuzz(size, {threads, false});
}

void check_invariants(const ProxyFuzzResult& result) {
  const ProxyFuzzTotals t = result.totals();
  INFO("seed " << result.size.seed << "\n" << proxy_fuzz_page(result));
  CHECK(t.ticks >= result.size.ticks);
  CHECK(t.held > t.ticks / 3);  // the obstacles were met
  CHECK(t.deep == 0);
  CHECK(t.rises == 0);
  CHECK(t.stalls == 0);
  CHECK(t.walls == 0);
  CHECK(t.crossings == 0);
  CHECK(t.wrenches == 0);
  CHECK(t.goals == 0);
  CHECK(t.over_caps == 0);
  CHECK(t.recoveries == 0);
  CHECK(t.failures.empty());
  MESSAGE(t.ticks << " ticks, " << t.held << " held: worst gap "
                  << static_cast<double>(t.worst_gap_m) << " m, largest rise "
                  << static_cast<double>(t.largest_rise_j) << " J, longest stall "
                  << t.longest_stall << ", rejected passes " << t.rejected_passes << ", rows "
                  << t.peaks.proxy_rows << ", iterations " << t.peaks.qp_iterations);
}

FuzzScene two_boxes() {
  FuzzScene scene;
  scene.name = "boxes";
  scene.part = centred_box("box", 0.01, 0.01, 0.01);
  scene.pieces = {centred_box("box", 0.02, 0.02, 0.02)};
  return scene;
}

/// A box of 20 mm at a box of 40 mm, judged.
struct TwoBoxes {
  FuzzScene scene = two_boxes();
  CoreSession session{compiled(scene, 0.0), scene.name};
  ProxyJudge judge{scene, session.view()};
};

}  // namespace

TEST_SUITE("host_sim.proxy_fuzz") {
  TEST_CASE("no friction: free, no rise, stall, wall, crossing or cap passed, in every tick") {
    check_invariants(run(kTicks, 1, 2, std::nullopt, {0.0}));
  }

  TEST_CASE("friction: free, no rise, stall, wall, crossing or cap passed, in every tick") {
    check_invariants(run(kTicks, 1, 2, std::nullopt, {0.3}));
  }

  TEST_CASE("[long] no friction: the same over a million ticks and another seed") {
    check_invariants(run(1000000, 2, 2, std::nullopt, {0.0}));
  }

  TEST_CASE("[long] friction: the same over a million ticks and another seed") {
    check_invariants(run(1000000, 2, 2, std::nullopt, {0.3}));
  }

  TEST_CASE("the result does not depend on the number of threads") {
    const ProxyFuzzResult one = run(4000, 3, 1), three = run(4000, 3, 3);
    CHECK(proxy_fuzz_page(one) == proxy_fuzz_page(three));
    CHECK(proxy_fuzz_page(one) != proxy_fuzz_page(run(4000, 4, 3)));
  }

  TEST_CASE("a certificate that is too generous leaves the part inside") {
    const ProxyFuzzTotals t = run(kTicks, 5, 2, ProxyFault::kCertificate).totals();
    CHECK(t.deep > 0);
  }

  TEST_CASE("a spring with another stiffness gives another wrench") {
    CHECK(run(5000, 5, 2, ProxyFault::kSpring).totals().wrenches > 1000);
  }

  TEST_CASE("a vertex in the wrong place: inside obstacles, and through plates") {
    const ProxyFuzzTotals t = run(6000, 1, 2, ProxyFault::kVertex).totals();
    CHECK(t.deep > 0);
    CHECK(t.crossings > 0);
  }

  TEST_CASE("judge: the gap of two boxes in every position is the closed form's") {
    TwoBoxes boxes;
    const auto gap = [&](const Vector& p) {
      return static_cast<double>(
          boxes.judge.exact_gap_m(wide_pose(pose_at(p, Rotation::Identity())), 1.0L));
    };
    CHECK(gap({0, 0, 0.0305}) == doctest::Approx(5e-4));
    CHECK(gap({0.0302, 0.01, 0}) == doctest::Approx(2e-4));
    CHECK(gap({0, 0, 0.029}) == doctest::Approx(-1e-3));
    CHECK(gap({-0.0299, 0.0295, 0}) == doctest::Approx(-1e-4));
  }

  TEST_CASE("judge: what could follow and what could not") {
    TwoBoxes boxes;
    const auto at = [](const Vector& p) { return wide_pose(pose_at(p, Rotation::Identity())); };
    CHECK_FALSE(
        boxes.judge.could_follow(at({0, 0, 0.025}), at({0, 0, 0.03})));        // pressed on a face
    CHECK(boxes.judge.could_follow(at({0.002, 0, 0.025}), at({0, 0, 0.03})));  // pulled along it
    CHECK(boxes.judge.could_follow(at({0, 0, 0.035}), at({0, 0, 0.03})));      // pulled off
    CHECK(boxes.judge.could_follow(at({0, 0, 0.035}), at({0, 0, 0.04})));      // nothing there
  }

  TEST_CASE("program: exit 0 and three files; a fault is exit 1 with seed, scene, tick and poses") {
    const std::string out = "proxy_fuzz_out";
    const ProgramResult sound =
        run_program(HAPTIC_HOST_SIM, "proxy-fuzz --ticks 2000 --seed 7 --out " + out);
    INFO(sound.out << sound.err);
    CHECK(sound.exit_code == 0);
    CHECK(std::filesystem::exists(out + "/proxy_fuzz.md"));
    CHECK(std::filesystem::exists(out + "/proxy_fuzz.csv"));
    CHECK(std::filesystem::exists(out + "/proxy_fuzz.json"));
    std::filesystem::remove_all(out);
    for (const std::string fault : {"spring", "vertex", "certificate"}) {
      if (fault != "spring" && !all_checks()) continue;  // ten times as long
      const ProgramResult damaged = run_program(
          HAPTIC_HOST_SIM, "proxy-fuzz --ticks 4000 --seed 7 --friction 0 --fault " + fault);
      INFO(fault << ": " << damaged.out << damaged.err);
      CHECK(damaged.exit_code == 1);
      CHECK(damaged.out.find(", seed ") != std::string::npos);
      CHECK(damaged.out.find(", tick ") != std::string::npos);
      CHECK(damaged.out.find("part at p = (") != std::string::npos);
      CHECK(damaged.out.find("goal at p = (") != std::string::npos);
    }
    CHECK(run_program(HAPTIC_HOST_SIM, "proxy-fuzz --ticks 0").exit_code == 2);
  }

  TEST_CASE("program: crossings and hold write three files, one of them runs alone, a fault is 1") {
    const ScratchFolder folder("proxy_campaigns");
    struct Row {
      const char *words, *stem, *fault;
    };
    for (const Row& row : {Row{"crossings --crossings 4", "crossings", "certificate"},
                           Row{"hold --poses 30", "hold", "restless"}}) {
      INFO(row.words);
      const std::string out = folder.file(row.stem);
      CHECK(run_program(HAPTIC_HOST_SIM, std::string(row.words) + " --out " + out).exit_code == 0);
      for (const char* end : {".csv", ".json", ".md"})
        CHECK(std::filesystem::file_size(out + "/" + row.stem + end) > 100);
      const ProgramResult one = run_program(HAPTIC_HOST_SIM, std::string(row.words) + " --only 1");
      CHECK(one.exit_code == 0);
      CHECK(
          one.out.find("1 " + std::string(row.stem == std::string("hold") ? "pose" : "crossing")) !=
          std::string::npos);
      const ProgramResult damaged = run_program(
          HAPTIC_HOST_SIM, std::string(row.words) + " --fault " + std::string(row.fault));
      CHECK(damaged.exit_code == 1);
      CHECK(damaged.out.find("## Failures") != std::string::npos);
    }
    const ProgramResult none = run_program(HAPTIC_HOST_SIM, "crossings --crossings 10 --only 14");
    CHECK(none.exit_code == 3);
    CHECK(none.err.find("no crossing 14; there are 14, from 0") != std::string::npos);
  }
}
