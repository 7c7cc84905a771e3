// SPDX-License-Identifier: Apache-2.0
// The invariants of several moving bodies under random hands and drivers, and proof that their
// checks can fail.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/lab/bodies_fuzz/bodies_campaign.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_cases.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_judge.hpp"
#include "tests/support/all_checks.hpp"
#include "tests/support/program_run.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;
using haptic::test::trials;

namespace {

BodiesFuzzResult run(const std::vector<std::string>& cases, std::uint64_t ticks, std::uint64_t seed,
                     std::uint32_t threads, std::optional<BodiesFault> fault = std::nullopt,
                     std::vector<double> frictions = {0.0, 0.3}) {
  BodiesFuzzSize size;
  size.cases = cases;
  size.ticks = ticks;
  size.seed = seed;
  size.fault = fault;
  size.frictions = std::move(frictions);
  return run_bodies_fuzz(size, {threads, false});
}

void check_invariants(const BodiesFuzzResult& result) {
  const BodiesTotals t = result.totals();
  INFO(bodies_fuzz_page(result));
  CHECK(t.ticks >= result.size.ticks);
  CHECK(t.held > t.ticks / 4);  // the bodies met
  CHECK(t.ways > t.ticks / 4);
  CHECK(t.rests > 0);
  for (const auto& [name, count] : counts_of(kBodiesMustBeZero, t)) {
    INFO(name);
    CHECK(count == 0);
  }
  CHECK(t.failures.empty());
  MESSAGE(t.ticks << " ticks, " << t.held << " held: worst gap "
                  << static_cast<double>(t.worst_gap_m) << " tolerances, on the way "
                  << static_cast<double>(t.worst_way_m) << ", largest rise "
                  << static_cast<double>(t.largest_rise_j) << " J, rejected in " << t.rejected_ticks
                  << " ticks, longest arrival " << t.longest_arrival << ", peak units "
                  << t.peak_units << ", rows " << t.peak_rows);
}

const auto kBodiesTicks = trials<std::uint64_t>(8000, 20000);

/// Two boxes of 20 and 40 mm that two hands hold.
CompiledBodies two_boxes() {
  BodiesScene scene;
  scene.name = "boxes";
  for (const double half : {0.01, 0.02}) {
    FuzzBody body;
    body.name = "box";
    body.pieces = {centred_box("box", half, half, half)};
    scene.bodies.push_back(std::move(body));
  }
  return compiled_bodies(std::move(scene), 0);
}

WidePose wide_at(const Vector& p, const Rotation& q) { return wide_pose(pose_at(p, q)); }

/// The totals of one case with a fault, without friction. Few ticks show it: deep ways, and ways
/// right at the allowed depth, take the judge a hundred times as long as others.
BodiesTotals totals_with(BodiesFault fault, const std::string& name, std::uint64_t ticks,
                         std::uint64_t seed) {
  return run({name}, ticks, seed, 2, fault, {0.0}).totals();
}

}  // namespace

TEST_SUITE("host_sim.bodies_fuzz") {
  TEST_CASE("driver: a hand's part, a driver and a table") {
    check_invariants(run({"driver"}, kBodiesTicks, 1, 2));
  }

  TEST_CASE("hands: two hands' parts and a table; their forces cancel in the air") {
    const BodiesFuzzResult result = run({"hands"}, kBodiesTicks, 1, 2);
    check_invariants(result);
    CHECK(result.totals().summed > result.totals().ticks / 10);
  }

  TEST_CASE("three: a driver, hands and a loose part") {
    check_invariants(run({"three"}, kBodiesTicks, 1, 2));
  }

  TEST_CASE("assembly: peg, ring and hole, held, driven and loose") {
    const BodiesFuzzResult result = run({"assembly"}, kBodiesTicks, 1, 2);
    check_invariants(result);
    CHECK(result.totals().summed > result.totals().ticks / 4);
  }

  TEST_CASE("with a budget ticks end early, and all the rest holds") {
    BodiesFuzzSize size;
    size.ticks = kBodiesTicks;
    size.seed = 4;
    size.work_units = 6000;
    const BodiesFuzzResult result = run_bodies_fuzz(size, {2, false});
    check_invariants(result);
    CHECK(result.totals().spent_ticks > 20);
  }

  TEST_CASE("[long] all cases: the same over a million ticks and another seed") {
    check_invariants(run({}, 1000000, 2, 2));
  }

  TEST_CASE("the result does not depend on the number of threads") {
    const auto page = [](std::uint64_t seed, std::uint32_t threads) {
      return bodies_fuzz_page(run({"driver"}, 3000, seed, threads, std::nullopt, {0.0}));
    };
    CHECK(page(3, 1) == page(3, 3));
    CHECK(page(3, 1) != page(4, 3));
  }

  TEST_CASE("a certificate that is too generous leaves bodies in each other") {
    const BodiesTotals t = totals_with(BodiesFault::kCertificate, "driver", 2000, 2);
    CHECK(t.deep > 0);
    CHECK(t.dips > 0);
  }

  TEST_CASE("springs with another stiffness have other wrenches") {
    const BodiesTotals t = totals_with(BodiesFault::kSpring, "hands", 1000, 5);
    CHECK(t.springs > 1000);
  }

  TEST_CASE("a contact force that acts on one body more than on the other is found") {
    const BodiesTotals t = totals_with(BodiesFault::kReaction, "hands", 4000, 5);
    CHECK(t.sums > 100);
    CHECK(t.deep + t.springs == 0);
  }

  TEST_CASE("a tick with more units of work than its bound is found") {
    const BodiesTotals t = totals_with(BodiesFault::kBound, "hands", 500, 5);
    CHECK(t.over > 100);
    CHECK(t.failed() == t.over);
  }

  TEST_CASE("a body that moves by itself raises the energy and does not stop") {
    const BodiesTotals t = totals_with(BodiesFault::kRestless, "hands", 2000, 5);
    CHECK(t.rises > 100);
    CHECK(t.stuck > 0);
  }

  TEST_CASE("goals go through each other, at ends of ticks and on the ways") {
    const BodiesTotals t = totals_with(BodiesFault::kGoal, "driver", 400, 4);
    CHECK(t.deep > 50);
    CHECK(t.dips > 50);
  }

  TEST_CASE("judge: the gap of two boxes is that of one seen from the other, however both turn") {
    const CompiledBodies boxes = two_boxes();
    BodiesJudge judge(boxes);
    const Rotation turn(Eigen::AngleAxisd(0.7, Vector(1, 2, 3).normalized()));
    const Vector at(0.1, -0.2, 0.05);
    for (const Vector& between : {Vector(0, 0, 0.0305), Vector(0.0302, 0.01, 0),
                                  Vector(0, 0, 0.029), Vector(-0.0299, 0.0295, 0)}) {
      const Vector off = between.cwiseAbs() - Vector(0.03, 0.03, 0.03);
      const WidePose poses[] = {wide_at(at + turn * between, turn), wide_at(at, turn)};
      CHECK(static_cast<double>(judge.end_gap(poses, 1).gap_m) ==
            doctest::Approx(off.maxCoeff()).epsilon(1e-9));
    }
  }

  TEST_CASE("judge: two that turn together keep their gap, two that swap places pass through") {
    const CompiledBodies boxes = two_boxes();
    BodiesJudge judge(boxes);
    const Rotation still = Rotation::Identity();
    const Rotation half(Eigen::AngleAxisd(3.1, Vector::UnitZ()));
    const Vector beside(0.031, 0, 0);
    const WidePose apart[] = {wide_at(beside, still), wide_at(Vector::Zero(), still)};
    const WidePose together[] = {wide_at(half * beside, half), wide_at(Vector::Zero(), half)};
    CHECK(judge.way_gap(apart, together).gap_m > 0);
    const WidePose across[] = {wide_at(-beside, still), wide_at(Vector::Zero(), still)};
    CHECK(judge.way_gap(apart, across).gap_m < -judge.allowed_depth_m());
  }

  TEST_CASE("cases: every one has a surface, and starts where nothing touches") {
    for (const std::string& name : bodies_case_names()) {
      INFO(name);
      const std::vector<BodiesScene> scenes = bodies_scenes({name});
      CHECK(scenes.size() >= 2);
      CHECK(std::ranges::any_of(scenes, [](const BodiesScene& scene) {
        return std::ranges::any_of(scene.bodies, &FuzzBody::is_surface);
      }));
      for (const BodiesScene& scene : scenes) {
        INFO(scene.name);
        const CompiledBodies compiled = compiled_bodies(scene, 0);
        BodiesJudge judge(compiled);
        std::vector<WidePose> poses;
        for (const FuzzBody& body : scene.bodies) {
          Vector start = body.start;
          if (body.range.carrier != kNoCarrier) start += scene.bodies[body.range.carrier].start;
          poses.push_back(wide_at(start, Rotation::Identity()));
        }
        for (std::size_t k = 0; k < poses.size(); ++k)
          CHECK(judge.clear_m(k, poses, 5e-5L) >= 5e-5L);
      }
    }
  }

  TEST_CASE("program: exit 0 and three files; a fault is exit 1 with case, seed, tick and poses") {
    const ScratchFolder folder("bodies_fuzz");
    const std::string out = folder.file("out");
    const ProgramResult sound =
        run_program(HAPTIC_HOST_SIM,
                    "bodies-fuzz --case hands --case driver --ticks 2000 --seed 7 --out " + out);
    INFO(sound.out << sound.err);
    CHECK(sound.exit_code == 0);
    CHECK(sound.out.ends_with("\nall right\n"));
    for (const char* end : {".csv", ".json", ".md"})
      CHECK(std::filesystem::file_size(out + "/bodies_fuzz" + end) > 100);
    const ProgramResult damaged = run_program(
        HAPTIC_HOST_SIM, "bodies-fuzz --case hands --ticks 2000 --friction 0 --fault spring");
    CHECK(damaged.exit_code == 1);
    for (const char* words : {"hands: hand ", ", seed 1, run ", ", tick ", " at p = (",
                              "its goal at p = (", "NOT all right"}) {
      INFO(words << " in " << damaged.out);
      CHECK(damaged.out.find(words) != std::string::npos);
    }
    const ProgramResult one =
        run_program(HAPTIC_HOST_SIM, "bodies-fuzz --case driver --ticks 2000 --only 1");
    CHECK(one.exit_code == 0);
    CHECK(run_program(HAPTIC_HOST_SIM, "bodies-fuzz --case driver --ticks 2000 --only 999")
              .exit_code == 3);
    CHECK(run_program(HAPTIC_HOST_SIM, "bodies-fuzz --case nothing").exit_code == 2);
    CHECK(run_program(HAPTIC_HOST_SIM, "bodies-fuzz --ticks 0").exit_code == 2);
  }
}
