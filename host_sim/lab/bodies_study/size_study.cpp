// SPDX-License-Identifier: Apache-2.0
// A tick by the number of bodies and of their contacts: by the law of several, and by MuJoCo on the
// same boxes, springs and goals.
#include <algorithm>
#include <cstdio>

#include "host_sim/lab/bodies_study/cost_figures.hpp"
#include "host_sim/lab/bodies_study/peer_run.hpp"
#include "host_sim/lab/bodies_study/study_bench.hpp"
#include "host_sim/report/quantile.hpp"
#include "host_sim/session/child_run.hpp"

namespace haptic::sim {
namespace {

constexpr double kSizeMicrometres = 1e6;
constexpr double kNsInUs = 1e-3;
constexpr std::size_t kTimedRuns = 3;
constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

/// The least time of each pressed tick over several runs of one motion, ascending.
class LeastTimes {
 public:
  void add(const std::vector<double>& ns) {
    if (least_ns_.empty()) least_ns_ = ns;
    for (std::size_t k = 0; k < least_ns_.size(); ++k) least_ns_[k] = std::min(least_ns_[k], ns[k]);
  }
  [[nodiscard]] std::vector<double> ascending() const {
    std::vector<double> pressed_ns(least_ns_.begin() + static_cast<std::ptrdiff_t>(kPressedTick),
                                   least_ns_.end());
    std::ranges::sort(pressed_ns);
    return pressed_ns;
  }

 private:
  std::vector<double> least_ns_;
};

/// Figures of a row, by the law or by MuJoCo.
struct SizeMeasured {
  std::string name;
  TickCounts units, instructions;
  double units_bound = kNotMeasured, spent_share = kNotMeasured;
  LeastTimes times;
  StudyFigure depth;  ///< um
};

void ask(SizeMeasured& measured, std::size_t number, std::uint64_t hash, std::size_t ticks,
         const char* tick, const char* run, const std::string& peer, bool is_short) {
  InstructionQuestion question;
  question.program = program_beside("host_lab");
  question.arguments = {"bodies", "--once", std::to_string(number)};
  if (is_short) question.arguments.emplace_back("--short");
  if (!peer.empty()) question.arguments.insert(question.arguments.end(), {"--peer", peer});
  question.state_hash = hash;
  question.ticks = ticks;
  question.tick = tick;
  question.run = run;
  measured.instructions = pressed_instructions(measured.name, question);
}

SizeMeasured law_measured(const BodiesCostCase& of, std::size_t number,
                          const BodiesStudySize& size) {
  const std::size_t ticks = bodies_size_ticks(size.is_short);
  SizeMeasured measured;
  measured.name = of.name;
  BodiesCostRun run;
  for (std::size_t k = 0; k < kTimedRuns; ++k) {
    run = run_bodies_cost(of, ticks);
    measured.times.add(run.ns);
  }
  TickCounts units;
  std::size_t spent = 0;
  for (const BodiesWork& work : run.ticks) {
    units.push_back(work.units);
    spent += work.spent ? 1u : 0u;
  }
  measured.units = pressed_counts(units);
  measured.units_bound = static_cast<double>(run.units_bound);
  measured.spent_share = 100.0 * static_cast<double>(spent) / static_cast<double>(ticks);
  StudyBench bench(of.scene, of.friction, of.goals(0), size.fault, of.work_units);
  for (std::size_t t = 0; t < ticks; ++t)
    static_cast<void>(bench.tick(of.goals(1e-3 * static_cast<double>(t))));
  measured.depth = bench.depth_figure();
  measured.depth.value /= 1e3;
  measured.depth.most /= 1e3;
  if (size.instructions) {
    ask(measured, number, run.state_hash, ticks, kLawOfSeveral, "haptic::sim::run_bodies_cost(*",
        "", size.is_short);
  }
  return measured;
}

/// How deep two bodies are in each other at the end of a tick, at most [um].
double judged_depth_um(const BodiesCostCase& of, const BodiesPeerRun& run) {
  const CompiledBodies compiled = compiled_bodies(of.scene, of.friction);
  BodiesJudge judge(compiled);
  Wide least_m = 0;
  for (const std::vector<BodyPlace>& places : run.places) {
    std::vector<WidePose> poses;
    for (const BodyPlace& place : places)
      poses.push_back(wide_pose(pose_of(grip_pose_at(place.p, place.q))));
    least_m = std::min(least_m, judge.end_gap(poses, least_m).gap_m);
  }
  return std::max(0.0, -kSizeMicrometres * static_cast<double>(least_m));
}

SizeMeasured peer_measured(const BodiesCostCase& of, std::size_t number, const BodiesPeerWay& way,
                           const BodiesStudySize& size) {
  const std::size_t ticks = bodies_size_ticks(size.is_short);
  SizeMeasured measured;
  measured.name = of.name + ": " + way.words;
  BodiesPeerRun run;
  for (std::size_t k = 0; k < kTimedRuns; ++k) {
    run = run_bodies_peer(of, way.name, ticks);
    measured.times.add(run.ns);
  }
  measured.depth = {"", "", judged_depth_um(of, run)};
  if (size.instructions) {
    ask(measured, number, run.state_hash, ticks,
        "haptic::sim::peer_tick(haptic::sim::BodiesPeer&, haptic::sim::PeerPlaces const&)",
        "haptic::sim::run_bodies_peer(*", way.name, size.is_short);
  }
  return measured;
}

double mean_or_none(const TickCounts& counts) {
  StudyRow row;
  add_spread(row, "", "", counts);
  return row.figures[0].value;
}

StudyRow size_row(const BodiesCostCase& of, const SizeMeasured& measured, const SizeMeasured& law) {
  StudyRow row;
  row.name = measured.name;
  const auto add = [&](const char* name, const char* words, double value) -> StudyFigure& {
    row.figures.push_back({name, words, value});
    return row.figures.back();
  };
  add("bodies", "bodies", static_cast<double>(of.scene.bodies.size()));
  add("contacts", "contacts", static_cast<double>(of.contacts));
  add_spread(row, "units", "units", measured.units);
  if (!measured.units.empty()) row.figures.back().most = measured.units_bound;
  add("units_bound", "their bound", measured.units_bound);
  add("spent_percent", "ticks short of budget, %", measured.spent_share);
  add_spread(row, "instructions", "instructions", measured.instructions);
  const std::vector<double> ns = measured.times.ascending();
  constexpr const char* kTimes = "time of a tick, us, median / 99 % / largest";
  add("us_median", kTimes, kNsInUs * quantile(ns, 0.5));
  add("us_p99", kTimes, kNsInUs * quantile(ns, 0.99));
  add("us_largest", kTimes, kNsInUs * ns.back());
  constexpr const char* kRatio = "to the law's: median time / mean instructions";
  add("time_ratio", kRatio, quantile(ns, 0.5) / quantile(law.times.ascending(), 0.5));
  add("instructions_ratio", kRatio,
      mean_or_none(measured.instructions) / mean_or_none(law.instructions));
  StudyFigure& depth = add("depth_um", "deepest overlap, um", measured.depth.value);
  depth.least = measured.depth.least;
  depth.most = measured.depth.most;
  return row;
}

}  // namespace

BodiesStudy bodies_size_study(const BodiesStudySize& size) {
  BodiesStudy study;
  study.name = "size";
  study.title = "Number of bodies and contacts";
  study.about =
      "Boxes of 30 x 24 x 20 mm, each drawn by a hand's spring of 1000 N/m that presses it 2 mm "
      "deeper than\nthere is room and slides it: in the air, side by side on a table, one on the "
      "other, and so against a\nwall too. A tick of the law alone, with the budget that a scene "
      "file has by default; and a millisecond\nof " +
      bodies_peer_words() +
      " with the same boxes, springs and goals, bodies of 0.1 kg and critical\ndamping: with its "
      "defaults, one step; with contacts as stiff as it takes, one step and ten. The deepest\n"
      "overlap of all ticks is judged from vertices; where a budget is short a body is behind, "
      "never inside.\nTimes: the least of three runs.\n";
  const std::vector<BodiesCostCase> cases = bodies_size_cases();
  const std::size_t first = bodies_cost_cases().size();
  for (std::size_t k = 0; k < cases.size(); ++k) {
    if (size.is_short && cases[k].scene.bodies.size() > 2) continue;
    if (size.instructions) std::fprintf(stderr, "size: %s\n", cases[k].name.c_str());
    const SizeMeasured law = law_measured(cases[k], first + k, size);
    study.rows.push_back(size_row(cases[k], law, law));
    for (const BodiesPeerWay& way : bodies_peer_ways()) {
      const SizeMeasured peer = peer_measured(cases[k], first + k, way, size);
      study.rows.push_back(size_row(cases[k], peer, law));
    }
  }
  return study;
}

}  // namespace haptic::sim
