// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/planning/guide_limits.hpp"

#include <algorithm>
#include <utility>

#include "host_sim/lab/planning/guided_scene.hpp"
#include "host_sim/plan/plan_making.hpp"
#include "host_sim/plan/puzzles.hpp"
#include "host_sim/report/shard_run.hpp"
#include "tools/common/changed_scene.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr double kClearance_mm = 0.1, kLimitsPlanning_s = 120;
constexpr double kFaultStrength = 40, kFaultEnergy = 0.01;
/// Of the guide's pull, how far it may lead a hand that holds the peg on the way.
constexpr double kLed = 2;

struct Place {
  bool at_goal = false;
  tools::SceneBytes guided;
};

struct TrialScenes {
  tools::SceneBytes plain;
  std::vector<Place> places;
};

TrialScenes make_scenes(const GuideLimitsOptions& options) {
  const Puzzle puzzle = peg_puzzle(kClearance_mm);
  const tools::SceneFile file = tools::parse_scene_file(puzzle.scene, puzzle.name, ".");
  TrialScenes scenes{compiled_scene(file), {}};
  const SceneView view = opened_scene(scenes.plain);
  for (const bool at_goal : {true, false}) {
    const MadePlan made = make_plan_between(
        view, "start", at_goal ? "0,0,10mm,1,0,0,0" : puzzle.goal, 1, kLimitsPlanning_s);
    if (!made.search.found) throw tools::InputError("the peg of the trials was not planned");
    tools::SceneBytes guided = guided_scene(file, made.plan);
    if (options.fault == GuideFault::kStiff) {
      guided = with_changed_guide(guided, [](GuideRecord& guide, std::span<GuideStation>) {
        guide.pull_n *= kFaultStrength;
        guide.hold_n *= kFaultStrength;
        guide.energy_j *= kFaultStrength;
      });
    }
    scenes.places.push_back({at_goal, std::move(guided)});
  }
  return scenes;
}

double largest_at_rest(const tools::SceneBytes& scene, const TrialSetting& setting, double seconds,
                       const PegHold& hold) {
  const SceneView view = opened_scene(scene);
  double limit = 0;
  for (const double stiffness : peg_stiffnesses()) {
    const tools::SceneBytes trial =
        tools::changed_scene(view, [&](SceneParameters& p) { set_trial(p, setting, stiffness); });
    CoreSession session(trial.span(), "peg", GoalContact::kLeftOut);
    if (!peg_rest_in(session, setting, seconds, hold).at_rest()) break;
    limit = stiffness;
  }
  return limit;
}

std::vector<TrialSetting> trial_settings(bool quick) {
  std::vector<TrialSetting> list;
  for (const double rate : quick ? std::vector<double>{1000} : std::vector<double>{1000, 4000}) {
    for (const unsigned delay : {0u, 1u}) {
      for (const char* hand : {"loose", "light", "firm"}) {
        if (quick && std::string(hand) == "light") continue;
        for (const double damping : quick ? std::vector<double>{0} : std::vector<double>{0, 1, 4}) {
          list.push_back({LawId::kProxy, rate, delay, hand, damping});
        }
      }
    }
  }
  return list;
}

}  // namespace

bool GuideLimits::passed() const {
  const bool none_worse = std::ranges::none_of(cells, &GuideCell::worse);
  const bool some_rest =
      std::ranges::any_of(cells, [](const GuideCell& c) { return c.without_n_per_m > 0; });
  return none_worse && some_rest && hostile.on > hostile.ticks / 20 &&
         hostile.most_j <= hostile.stated_j;
}

GuideLimits run_guide_limits(const GuideLimitsOptions& options) {
  const TrialScenes scenes = make_scenes(options);
  const double seconds = options.quick ? 2 : 5;
  GuideLimits limits;
  std::vector<const tools::SceneBytes*> guided;
  for (const TrialSetting& setting : trial_settings(options.quick)) {
    for (const Place& place : scenes.places) {
      limits.cells.push_back({setting, place.at_goal});
      guided.push_back(&place.guided);
    }
  }
  run_shards(
      limits.cells.size(), RunOptions{options.threads, options.progress}, "guide-limits",
      [] { return 0; },
      [&](int, std::size_t k) {
        GuideCell& cell = limits.cells[k];
        PegHold hold;
        if (!cell.at_goal) {
          const double pull_n = opened_scene(*guided[k]).guide()->pull_n;
          hold.thrown_m += kLed * pull_n / hand_named(cell.setting.hand)->stiffness_n_per_m;
        }
        cell.without_n_per_m = largest_at_rest(scenes.plain, cell.setting, seconds, hold);
        cell.with_n_per_m = largest_at_rest(*guided[k], cell.setting, seconds, hold);
      });
  limits.hostile =
      run_hostile_hand(scenes.places.back().guided.span(), options.ticks, options.seed);
  if (options.fault == GuideFault::kEnergy) limits.hostile.stated_j *= kFaultEnergy;
  return limits;
}

std::vector<OutputText> guide_limits_files(const GuideLimits& limits,
                                           const GuideLimitsOptions& options) {
  ReportTable table(
      "rate_hz,delay_samples,hand,damping_ns_per_m,rests,without_n_per_m,with_n_per_m,"
      "holds");
  for (const GuideCell& c : limits.cells) {
    const TrialSetting& s = c.setting;
    table.add({shown_as("%g", s.rate_hz), s.delay_samples, s.hand,
               shown_as("%g", s.damping_ns_per_m), c.at_goal ? "at the goal" : "on the way",
               shown_as("%g", c.without_n_per_m), shown_as("%g", c.with_n_per_m),
               yes_or_no(!c.worse())});
  }
  const auto worse = std::ranges::count_if(limits.cells, &GuideCell::worse);
  const HostileRun& h = limits.hostile;
  const std::string page =
      "# Limits of a guide\n\n" + table_head({"limit", "stated", "found", "holds"}) +
      table_row({"cells of the loop that are worse with the guide", "0",
                 std::to_string(worse) + " of " + std::to_string(limits.cells.size()),
                 yes_or_no(worse == 0)}) +
      table_row({"most work of the guide in " + std::to_string(h.ticks) + " hostile ticks, mJ",
                 short_number(1e3 * h.stated_j, 4), short_number(1e3 * h.most_j, 4),
                 yes_or_no(h.most_j <= h.stated_j)}) +
      "\nThe guide led in " + std::to_string(h.on) +
      " of the hostile ticks: along its force and against it, to and fro, drifts, noise and jumps "
      "to the start.\n\nA square peg, 20 mm deep in a hole with 0.1 mm of clearance, is pressed "
      "sideways and turned within a second and then held (part 1 of `stability`): the largest "
      "stiffness of 500 to 5000 N/m up to which all come to rest within " +
      std::string(options.quick ? "2" : "5") +
      " s, or keep falling. No budget and no passivity layer. *At the goal*: the plan ends where "
      "the peg is held; *on the way*: it goes on to the end of the hole.\n\n" +
      table.markdown();
  return {{"guide_limits.md", page}, {"guide_limits.csv", table.csv()}};
}

}  // namespace haptic::sim
