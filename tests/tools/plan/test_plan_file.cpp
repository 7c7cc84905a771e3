// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "tests/tools/plan/plan_bench.hpp"
#include "tools/common/error.hpp"
#include "tools/common/split_mix.hpp"
#include "tools/plan/plan_check.hpp"

using namespace haptic;
using namespace haptic::sim::test;
using tools::InputError;

namespace {

struct WrittenPlan {
  PlannedScene scene{"square_peg_five"};
  haptic::tools::MadePlan found = plan_to(scene.view, kPegGoal);
  std::string text = tools::plan_as_text(found.plan);
};

const WrittenPlan& written() {
  static const WrittenPlan the_one;
  return the_one;
}

std::string refusal_of(const std::string& text) {
  try {
    static_cast<void>(tools::parse_plan(text, "p.plan"));
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

/// One damage of many kinds: of bytes, of numbers, of lines.
std::string damaged(const std::string& text, tools::SplitMix64& words) {
  std::string bad = text;
  const auto any = [&](std::size_t below) {
    return static_cast<std::size_t>(words.next() % below);
  };
  const std::size_t at = any(bad.size());
  switch (words.next() % 6) {
    case 0:
      bad[at] = static_cast<char>(words.next() & 0xFF);
      break;
    case 1:
      bad.resize(at);
      break;
    case 2:
      bad.erase(at, 1 + any(40));
      break;
    case 3:
      bad.insert(at, bad.substr(any(bad.size()), 1 + any(80)));
      break;
    case 4: {  // a digit
      const std::size_t digit = bad.find_first_of("0123456789", at);
      if (digit != std::string::npos) bad[digit] = static_cast<char>('0' + words.next() % 10);
      break;
    }
    default: {  // two lines change places
      const std::size_t first = bad.find('\n', at);
      const std::size_t second = first == std::string::npos ? first : bad.find('\n', first + 1);
      const std::size_t third = second == std::string::npos ? second : bad.find('\n', second + 1);
      if (third == std::string::npos) break;
      const std::string a = bad.substr(first + 1, second - first),
                        b = bad.substr(second + 1, third - second);
      bad.replace(first + 1, third - first, b + a);
    }
  }
  return bad;
}

/// @return whether it was refused with a sentence; else it is proved, or says which step is not.
bool is_refused(const std::string& text, bool& proved) {
  proved = false;
  try {
    const tools::Plan plan = tools::parse_plan(text, "p.plan");
    const tools::PlanProof proof = tools::prove_plan(written().scene.view, plan, "p.plan");
    proved = proof.holds();
    if (!proved) CHECK(proof.failure.size() > 20);
    return !proved;
  } catch (const InputError& error) {
    CHECK(std::string(error.what()).find("p.plan:") == 0);
    return true;
  }
}

void damage_many(std::size_t count) {
  tools::SplitMix64 words(20);
  std::size_t refused = 0, proved_again = 0;
  for (std::size_t k = 0; k < count; ++k) {
    CAPTURE(k);
    // Every other one with a hash that fits, so that the reader and the proof see the damage.
    std::string bad = damaged(written().text, words);
    if (k % 2 == 1) bad = tools::resealed_plan(bad);
    bool proved = false;
    if (is_refused(bad, proved)) {
      refused += 1;
    } else {
      CHECK(proved);
      proved_again += 1;
      // Without the hash, nothing but the very text passes.
      if (k % 2 == 0) CHECK(bad == written().text);
    }
  }
  CHECK(refused + proved_again == count);
  MESSAGE(refused << " refused, " << proved_again << " proved again");
}

}  // namespace

TEST_SUITE("tools.plan") {
  TEST_CASE("plan file: what is written reads back the same, and is proved") {
    REQUIRE(written().found.search.found);
    const tools::Plan plan = tools::parse_plan(written().text, "p.plan");
    CHECK(plan == written().found.plan);
    CHECK(plan.stations.size() <= tools::kMostPlanStations);
    const tools::PlanProof proof = tools::prove_plan(written().scene.view, plan, "p.plan");
    CHECK(proof.failure == "");
    CHECK(proof.certified == plan.steps());
    CHECK(proof.least_m >= -plan.tolerance_m);
  }

  TEST_CASE("plan file: a refusal names line and defect") {
    const std::string& text = written().text;
    const auto has = [](const std::string& refusal, const char* part) {
      CAPTURE(refusal);
      CHECK(refusal.find(part) != std::string::npos);
      CHECK(refusal.find("make the plan again") != std::string::npos);
    };
    has(refusal_of(""), "p.plan:1: the file ends before 'haptic-plan'");
    has(refusal_of(replaced(text, "haptic-plan 2", "haptic-plan 1")), "another version");
    has(refusal_of(replaced(text, "seed 1", "seed x")), "p.plan:4: 'x' is no count");
    has(refusal_of(replaced(text, "seed 1", "seed 2")), "its hash differs");
    has(refusal_of(text + "x"), "more behind its end");
    has(refusal_of(replaced(text, "haptic-plan 2\n", "haptic-plan 2\r\n")), "end in CR LF");
    has(refusal_of(replaced(text, "\nscene ", "\nscene \x1b[31m")), "control character");
    const std::size_t first = text.find("\npose ") + 1, second = text.find('\n', first) + 1;
    const std::string pose = text.substr(first, second - first);
    has(refusal_of(std::string(text).insert(second, pose)), "once more");
    has(refusal_of(tools::resealed_plan(replaced(text, "tolerance ", "tolerance -"))),
        "not positive");
    has(refusal_of(tools::resealed_plan(replaced(text, "station 1 ", "station 2 "))), "station");
  }

  TEST_CASE("plan proof: a plan of another scene, and one that takes more for free, are refused") {
    const PlannedScene other("two_pins");
    CHECK_THROWS_AS((void)tools::prove_plan(other.view, written().found.plan, "p"), InputError);
    tools::Plan plan = written().found.plan;
    plan.tolerance_m *= 2;
    CHECK_THROWS_AS((void)tools::prove_plan(written().scene.view, plan, "p"), InputError);
  }

  TEST_CASE("plan proof: a step through a wall, a missing plane and a false clearance are found") {
    const SceneView& view = written().scene.view;
    tools::Plan plan = written().found.plan;
    const std::size_t last = plan.poses.size() - 1;
    plan.poses[last].x0_m[0] += 0.001;
    tools::PlanProof proof = tools::prove_plan(view, plan, "p");
    CHECK_FALSE(proof.holds());
    CHECK(proof.certified == plan.steps() - 1);
    CHECK(proof.failure.find("step " + std::to_string(last - 1)) == 0);
    plan = written().found.plan;
    for (tools::PlanPlane& plane : plan.planes) {
      std::erase_if(plane.runs,
                    [&](const tools::PlanRun& run) { return run.last + 1 == plan.steps(); });
    }
    proof = tools::prove_plan(view, plan, "p");
    CHECK(proof.failure.find("have no plane") != std::string::npos);
    plan = written().found.plan;
    plan.stations[2].clearance_m += 1e-6;
    proof = tools::prove_plan(view, plan, "p");
    CHECK(proof.failure.find("station 2: states a clearance") == 0);
  }

  TEST_CASE("plan file: planes that many steps share must be of these pairs and steps") {
    const std::string& text = written().text;
    const auto has = [](const std::string& refusal, const char* part) {
      CAPTURE(refusal);
      CHECK(refusal.find(part) != std::string::npos);
    };
    // The first run of the first plane, and the same once more, later, backwards and without end.
    const std::size_t at = text.find("\npair ");
    const std::string run = text.substr(at, text.find('\n', at + 1) - at);
    const tools::PlanRun first = written().found.plan.planes.front().runs.front();
    REQUIRE(first.last > first.first);
    const std::string pair =
        "\npair " + std::to_string(first.piece_a) + " " + std::to_string(first.piece_b) + " ";
    const auto with = [&](std::uint64_t from, std::uint64_t to) {
      const std::string other = pair + std::to_string(from) + " " + std::to_string(to);
      return refusal_of(tools::resealed_plan(replaced(text, run, other)));
    };
    has(with(first.last, first.first), "a run of steps does not exist");
    has(with(first.first, written().found.plan.steps()), "a run of steps does not exist");
    has(with(first.first, 1u << 30), "is more than");
    const std::string count = " " + std::to_string(written().found.plan.planes.front().runs.size());
    const std::string twice = replaced(replaced(text, run, run + run), count + run, " 2" + run);
    has(refusal_of(tools::resealed_plan(twice)), "runs of a plane are out of order");
    const std::string& planes = "planes " + std::to_string(written().found.plan.planes.size());
    const std::string more =
        "planes " + std::to_string(written().found.plan.planes.size() + 1) + "\nplane B 0 0 1 1";
    has(refusal_of(tools::resealed_plan(replaced(text, planes, more + run))),
        "a pair of pieces has two planes in one step");
  }

  TEST_CASE("plan proof: a plane is proved in every step of its run, and for each pair alone") {
    const SceneView& view = written().scene.view;
    const tools::Plan& good = written().found.plan;
    std::size_t shared = 0, failed = 0;
    for (std::size_t k = 0; k < good.planes.size(); ++k) {
      for (std::size_t j = 0; j < good.planes[k].runs.size(); ++j) {
        const tools::PlanRun run = good.planes[k].runs[j];
        if (run.last == run.first) continue;
        shared += 1;
        // Another pair's plane, over the same run: no step may pass by what is near.
        tools::Plan plan = good;
        for (double& x : plan.planes[k].direction.of_b) x = -x;
        for (double& x : plan.planes[k].direction.of_a) x = -x;
        const tools::PlanProof turned = tools::prove_plan(view, plan, "p");
        CHECK_FALSE(turned.holds());
        // One step less: its pair is not kept apart there, but where spheres do it.
        plan = good;
        plan.planes[k].runs[j].last -= 1;
        const tools::PlanProof proof = tools::prove_plan(view, plan, "p");
        if (proof.certified == proof.steps) continue;
        failed += 1;
        CHECK(proof.certified == proof.steps - 1);
        CHECK(proof.failure.find("step " + std::to_string(run.last) + ": ") == 0);
      }
    }
    CHECK(shared > 0);
    CHECK(failed > 0);
  }

  TEST_CASE("plan proof: edges without a direction across them keep nothing apart") {
    const SceneView& view = written().scene.view;
    tools::Plan plan = written().found.plan;
    for (tools::PlanPlane& plane : plan.planes) {
      plane.direction = {'C', {1, 0, 0}, {1, 0, 0}};
      for (tools::PlanPose& pose : plan.poses) pose.q_wxyz = {1, 0, 0, 0};
    }
    const tools::PlanProof proof = tools::prove_plan(view, plan, "p");
    CHECK_FALSE(proof.holds());
    CHECK(proof.failure.find("are not kept apart by their plane") != std::string::npos);
  }

  TEST_CASE("plan file: 200 damaged ones are refused with a sentence or proved again") {
    damage_many(200);
  }
  TEST_CASE("[long] plan file: 1000 damaged ones are refused with a sentence or proved again") {
    damage_many(1000);
  }
}
