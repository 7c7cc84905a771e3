// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/planning/guide_limits.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "host_sim/lab/planning/guided_scene.hpp"
#include "host_sim/lab/planning/processor_time.hpp"
#include "host_sim/lab/planning/puzzles.hpp"
#include "host_sim/report/kept_rows.hpp"
#include "host_sim/report/shard_run.hpp"
#include "tools/common/changed_scene.hpp"
#include "tools/common/error.hpp"
#include "tools/plan/search/plan_making.hpp"

namespace haptic::sim {
namespace {

constexpr double kClearance_mm = 0.1, kLimitsPlanning_s = 120;
/// The hostile hand of some plans gets hold of a ten-thousandth of the energy stated.
constexpr double kFaultStrength = 40, kFaultEnergy = 1.0e-5;
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
    const tools::MadePlan made = tools::make_plan_between(
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

/// For each of some holds, which differ in how far along the hole counts as thrown alone, the
/// largest stiffness up to which all come to rest. One run judges them all.
std::vector<double> largest_at_rest(const tools::SceneBytes& scene, const TrialSetting& setting,
                                    double seconds, const std::vector<PegHold>& holds) {
  const SceneView view = opened_scene(scene);
  const auto thrown = [](const PegHold& hold) { return hold.thrown_m; };
  std::vector<double> limits(holds.size(), 0.0);
  std::vector<bool> at_rest(holds.size(), true);
  for (const double stiffness : peg_stiffnesses()) {
    PegHold widest;
    widest.thrown_m = 0;
    for (std::size_t k = 0; k < holds.size(); ++k)
      if (at_rest[k]) widest = std::ranges::max(widest, holds[k], {}, thrown);
    const tools::SceneBytes trial =
        tools::changed_scene(view, [&](SceneParameters& p) { set_trial(p, setting, stiffness); });
    CoreSession session(trial.span(), "peg", GoalContact::kLeftOut);
    const PegRest rest = peg_rest_in(session, setting, seconds, widest);
    for (std::size_t k = 0; k < holds.size(); ++k) {
      at_rest[k] = at_rest[k] && rest.at_rest() && rest.off_m < holds[k].thrown_m;
      if (at_rest[k]) limits[k] = stiffness;
    }
    if (std::ranges::none_of(at_rest, std::identity{})) break;
  }
  return limits;
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

namespace {

/// Options that decide a number, on a line.
std::string about(const GuideLimitsOptions& o) {
  return std::string("guide-limits") + (o.quick ? ", quick" : "") + ", ticks " +
         std::to_string(o.ticks) + ", seed " + std::to_string(o.seed) + ", fault " +
         std::to_string(static_cast<int>(o.fault));
}

std::string key_of(const TrialSetting& s) {
  return tools::short_number(s.rate_hz, 6) + " Hz " + std::to_string(s.delay_samples) + " late " +
         s.hand + " " + tools::short_number(s.damping_ns_per_m, 6);
}

std::vector<double> run_hostile(const Place& place, const GuideLimitsOptions& options) {
  const HostileRun run = run_hostile_hand(place.guided.span(), options.ticks, options.seed);
  return {run.stated_j, run.most_j, static_cast<double>(run.on), static_cast<double>(run.ticks)};
}

/// The cells of one setting, at the goal and on the way: without the guide they are one run.
std::vector<double> run_setting(const TrialScenes& scenes, const TrialSetting& setting,
                                double seconds) {
  const double began_s = thread_processor_s();
  std::vector<PegHold> holds;
  for (const Place& place : scenes.places) {
    PegHold hold;
    if (!place.at_goal) {
      const double pull_n = opened_scene(place.guided).guide()->pull_n;
      hold.thrown_m += kLed * pull_n / hand_named(setting.hand)->stiffness_n_per_m;
    }
    holds.push_back(hold);
  }
  std::vector<double> numbers = largest_at_rest(scenes.plain, setting, seconds, holds);
  for (std::size_t k = 0; k < holds.size(); ++k)
    numbers.push_back(largest_at_rest(scenes.places[k].guided, setting, seconds, {holds[k]})[0]);
  numbers.push_back(thread_processor_s() - began_s);
  return numbers;
}

}  // namespace

GuideLimits run_guide_limits(const GuideLimitsOptions& options) {
  const TrialScenes scenes = make_scenes(options);
  const double seconds = options.quick ? 2 : 5;
  const std::vector<TrialSetting> settings = trial_settings(options.quick);
  const std::size_t places = scenes.places.size();
  KeptRows kept(options.rows, about(options), options.resume);
  GuideLimits limits;
  limits.cells.resize(settings.size() * places);
  // The hostile ticks are the last shard, and have a row too.
  run_shards(
      settings.size() + 1, RunOptions{options.threads, options.progress}, "guide-limits",
      [] { return 0; },
      [&](int, std::size_t k) {
        const bool is_setting = k < settings.size();
        const std::string key = is_setting ? key_of(settings[k]) : "hostile";
        const std::vector<double>* const done = kept.find(key);
        std::vector<double> numbers;
        if (done != nullptr && done->size() == (is_setting ? 2 * places + 1 : 4)) {
          numbers = *done;
        } else {
          numbers = is_setting ? run_setting(scenes, settings[k], seconds)
                               : run_hostile(scenes.places.back(), options);
          kept.keep(key, numbers);
        }
        if (!is_setting) {
          limits.hostile = {numbers[0], numbers[1], static_cast<std::uint64_t>(numbers[2]),
                            static_cast<std::uint64_t>(numbers[3])};
          return;
        }
        for (std::size_t place = 0; place < places; ++place) {
          limits.cells[places * k + place] = {settings[k], scenes.places[place].at_goal,
                                              numbers[place], numbers[places + place],
                                              numbers.back() / static_cast<double>(places)};
        }
      });
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
  double took_s = 0;
  for (const GuideCell& c : limits.cells) took_s += c.seconds;
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
      "the peg is held; *on the way*: it goes on to the end of the hole. The cells took " +
      short_number(took_s, 4) + " s of one processor.\n\n" + table.markdown();
  return {{"guide_limits.md", page}, {"guide_limits.csv", table.csv()}};
}

}  // namespace haptic::sim
