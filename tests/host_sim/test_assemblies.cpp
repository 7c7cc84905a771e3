// SPDX-License-Identifier: Apache-2.0
// Lids on bins, each of up to some twenty convex pieces, compiled with default options: every
// verdict and every depth of every pair against the exhaustive search, under every law, with more
// near pairs than a tick may search, and within limits of orientation and place.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "host_sim/session/counters_check.hpp"
#include "host_sim/session/replay.hpp"
#include "tests/host_sim/lid_and_bin.hpp"
#include "tests/support/program_run.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

/// Every `stride`-th sample of a motion: jumps of some tenths of a millimetre.
std::vector<MotionSample> thinned(const MotionScript& script, std::size_t stride) {
  const std::vector<MotionSample> all = make_motion(script);
  std::vector<MotionSample> samples;
  for (std::size_t i = 0; i < all.size(); i += stride) samples.push_back(all[i]);
  return samples;
}

/// Limits that the motion keeps.
void limit(const std::vector<MotionSample>& motion, tools::SceneFile& scene) {
  double turn_rad = 0;
  tools::WorkspaceBox box;
  box.min_m = box.max_m = {motion[0].p[0], motion[0].p[1], motion[0].p[2]};
  for (const MotionSample& s : motion) {
    turn_rad = std::max(turn_rad, 2 * std::acos(std::min(1.0, std::abs(s.q_wxyz[0]))));
    for (std::size_t k = 0; k < 3; ++k) {
      box.min_m[k] = std::min(box.min_m[k], s.p[k] - 0.001);
      box.max_m[k] = std::max(box.max_m[k], s.p[k] + 0.001);
    }
  }
  scene.orientation = tools::OrientationEnvelope{{0, 0, 0, 1}, turn_rad + 0.02};
  scene.workspace = box;
}

struct Seen {
  std::uint64_t pairs = 0, ticks = 0, pressed = 0, budget = 0;
};

bool has_force(const TickRecord& tick) {
  return std::ranges::any_of(tick.force_n, [](double f) { return f != 0; });
}

/// Compiles, replays and judges; `more` changes the scene first.
template <typename Change>
Seen judge(const LidAndBin& assembly, const std::vector<MotionSample>& motion,
           const Change& change) {
  tools::SceneFile scene = assembly.scene;
  change(scene);
  CoreSession session(tools::compile_scene(scene, tools::CompileOptions{}).bytes, assembly.name);
  ReplayOptions options;
  options.check = true;
  const ReplayResult result = replay(session, motion, options);
  const CheckTotals& check = *result.check;
  Seen seen;
  seen.pairs = session.view().pair_count();
  for (const TickRecord& tick : result.ticks) {
    seen.ticks += 1;
    seen.pressed += has_force(tick) ? 1u : 0u;
    seen.budget += (tick.flags & kFlagBudgetUsedUp) != 0 ? 1 : 0;
  }
  MESSAGE(assembly.name, ", law ", static_cast<int>(scene.parameters.law), ": ", seen.pairs,
          " pairs, ", seen.ticks, " ticks, ", seen.pressed, " with force, ", seen.budget,
          " over the budget, ", check.bounded_pairs,
          " pair-ticks of bounded depth; wrong verdicts ", check.wrong_verdict_pairs,
          ", wrong depths ", check.wrong_depth_pairs, ", by ",
          static_cast<double>(check.largest_error_m), " m");
  CHECK(check.wrong_verdict_pairs == 0);
  CHECK(check.wrong_depth_pairs == 0);
  CHECK(seen.pressed > 0);
  CHECK(seen.pressed < seen.ticks);
  if (seen.budget == 0) CHECK(check.bounded_pairs == 0);
  CHECK(within_bounds(session.core().peaks(), session.view().header().capacity));
  return seen;
}

constexpr LidForm kForms[] = {LidForm::kPlug, LidForm::kStep, LidForm::kCap, LidForm::kBoth};
constexpr Outline kOutlines[] = {Outline::kRectangle, Outline::kOctagon, Outline::kPolygon,
                                 Outline::kEll};
constexpr auto kAsItIs = [](tools::SceneFile&) {};

}  // namespace

TEST_SUITE("host_sim.assemblies") {
  TEST_CASE("default options: verdicts and depths of every pair are right") {
    const ScratchFolder folder("assemblies");
    std::uint64_t most_pairs = 0, budget = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      const LidAndBin assembly =
          make_lid_and_bin(folder.file("."), kOutlines[k % 4], kForms[(k + k / 4 + 2) % 4], k + 1);
      const Seen seen = judge(assembly, thinned(assembly.motion, 60), kAsItIs);
      most_pairs = std::max(most_pairs, seen.pairs);
      budget += seen.budget;
    }
    CHECK(most_pairs >= 19 * 19);
    CHECK(budget > 0);
  }

  TEST_CASE("laws that measure at the goal: verdicts and depths") {
    const ScratchFolder folder("assemblies_laws");
    const LidAndBin assembly =
        make_lid_and_bin(folder.file("."), Outline::kRectangle, LidForm::kCap, 4);
    judge(assembly, thinned(assembly.motion, 20),
          [&](tools::SceneFile& scene) { scene.parameters.law = LawId::kPaper; });
  }

  TEST_CASE("at 1 kHz, under every law: a force comes from a contact with a name") {
    const ScratchFolder folder("assemblies_names");
    const LidAndBin assembly =
        make_lid_and_bin(folder.file("."), Outline::kRectangle, LidForm::kCap, 4);
    const std::vector<MotionSample> motion = make_motion(assembly.motion);
    for (const LawId law : {LawId::kPaper, LawId::kProxy}) {
      tools::SceneFile scene = assembly.scene;
      scene.parameters.law = law;
      CoreSession session(tools::compile_scene(scene, tools::CompileOptions{}).bytes, "lid");
      int pressed = 0, unnamed = 0;
      double before_n = 0;
      for (const TickRecord& tick : replay(session, motion, {}).ticks) {
        pressed += has_force(tick) ? 1 : 0;
        // What is let go falls over several ticks.
        const double now_n = std::hypot(tick.force_n[0], tick.force_n[1], tick.force_n[2]);
        const bool let_go = now_n < before_n;
        before_n = now_n;
        unnamed += has_force(tick) && !let_go && tick.situation == ContactSituation::kNone ? 1 : 0;
      }
      MESSAGE("law ", static_cast<int>(law), ": ", pressed, " ticks with force, ", unnamed,
              " of them without a situation");
      CHECK(pressed > 1000);
      CHECK(unnamed == 0);
    }
  }

  TEST_CASE("a budget of three pairs: verdicts are right, depths flagged where not searched") {
    const ScratchFolder folder("assemblies_budget");
    const LidAndBin assembly =
        make_lid_and_bin(folder.file("."), Outline::kRectangle, LidForm::kStep, 5);
    for (const LawId law : {LawId::kProxy, LawId::kPaper}) {
      const Seen seen = judge(assembly, thinned(assembly.motion, 20), [&](tools::SceneFile& scene) {
        scene.parameters.law = law;
        scene.budget.pair_visits = 3;
      });
      CHECK(seen.budget > seen.pressed / 2);
    }
  }

  TEST_CASE("limits that the motion keeps: verdicts and depths as without") {
    const ScratchFolder folder("assemblies_limits");
    for (const Outline outline : {Outline::kRectangle, Outline::kPolygon}) {
      const LidAndBin assembly = make_lid_and_bin(folder.file("."), outline, LidForm::kBoth, 6);
      const std::vector<MotionSample> motion = thinned(assembly.motion, 40);
      judge(assembly, motion, [&](tools::SceneFile& scene) { limit(motion, scene); });
    }
  }

  TEST_CASE("[long] forty assemblies") {
    const ScratchFolder folder("assemblies_long");
    for (std::size_t k = 0; k < 40; ++k) {
      const LidAndBin assembly =
          make_lid_and_bin(folder.file("."), kOutlines[k % 4], kForms[k / 4 % 4], 100 + k);
      judge(assembly, thinned(assembly.motion, 8), kAsItIs);
    }
  }
}
