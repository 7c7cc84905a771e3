// SPDX-License-Identifier: Apache-2.0
// The cost of a tick of several bodies, as a ratio to that of one.
#include <cstdio>

#include "host_sim/lab/bodies_study/cost_cases.hpp"
#include "host_sim/lab/bodies_study/cost_figures.hpp"
#include "host_sim/lab/bodies_study/study_bench.hpp"
#include "host_sim/session/child_run.hpp"

namespace haptic::sim {
namespace {

TickCounts instructions_of(const BodiesCostCase& of, std::size_t number, const BodiesCostRun& run,
                           bool is_short) {
  InstructionQuestion question;
  question.program = program_beside("host_lab");
  question.arguments = {"bodies", "--once", std::to_string(number)};
  if (is_short) question.arguments.emplace_back("--short");
  question.state_hash = run.state_hash;
  question.ticks = run.ticks.size();
  question.tick = of.of_one_part ? kLawOfOne : kLawOfSeveral;
  question.run = "haptic::sim::run_bodies_cost(*";
  return pressed_instructions(of.name, question);
}

/// The same motion under the law of several, judged.
StudyFigure depth_of(const BodiesCostCase& of, std::size_t ticks,
                     std::optional<BodiesFault> fault) {
  StudyBench bench(of.scene, of.friction, of.goals(0), fault);
  for (std::size_t t = 0; t < ticks; ++t)
    static_cast<void>(bench.tick(of.goals(1e-3 * static_cast<double>(t))));
  return bench.depth_figure();
}

StudyRow cost_row(const BodiesCostCase& of, std::size_t number, const BodiesStudySize& size) {
  const std::size_t ticks = bodies_cost_ticks(size.is_short);
  const BodiesCostRun run = run_bodies_cost(of, ticks);
  const auto counts = [&](std::uint64_t BodiesWork::*field) {
    TickCounts of_ticks;
    for (const BodiesWork& work : run.ticks) of_ticks.push_back(work.*field);
    return pressed_counts(of_ticks);
  };
  StudyRow row;
  row.name = of.name;
  add_spread(row, "units", "units", counts(&BodiesWork::units));
  add_spread(row, "dual_steps", "dual steps", counts(&BodiesWork::dual_steps));
  add_spread(row, "programs", "programs", counts(&BodiesWork::programs));
  add_spread(row, "rows", "rows", counts(&BodiesWork::rows));
  TickCounts instructions;
  if (size.instructions) instructions = instructions_of(of, number, run, size.is_short);
  add_spread(row, "instructions", "instructions", instructions);
  row.figures.push_back(depth_of(of, ticks, size.fault));
  return row;
}

/// Means over those of one body under the law of several, with the same friction.
void add_ratios(std::vector<StudyRow>& rows, const std::vector<BodiesCostCase>& cases) {
  for (std::size_t k = 0; k < rows.size(); ++k) {
    std::size_t one = 0;
    while (cases[one].of_one_part || cases[one].friction != cases[k].friction) ++one;
    for (const char* of : {"units", "instructions"}) {
      const std::string mean = std::string(of) + "_mean";
      rows[k].figures.push_back({std::string(of) + "_ratio", "to one body: units / instructions",
                                 rows[k].find(mean)->value / rows[one].find(mean)->value});
    }
  }
}

}  // namespace

BodiesStudy bodies_cost_study(const BodiesStudySize& size) {
  BodiesStudy study;
  study.name = "cost";
  study.title = "Cost";
  study.about =
      "A tick of the law alone: a box of 30 mm that a hand presses 2 mm deep and slides, on a "
      "table, on a\nplate that is driven, or on one in the other hand; on another box, which lies "
      "on the table, with a\ndriver against both; in the air. Rows: of the largest program of a "
      "tick.\n";
  const std::vector<BodiesCostCase> cases = bodies_cost_cases();
  for (std::size_t k = 0; k < cases.size(); ++k) {
    if (size.instructions) std::fprintf(stderr, "cost: %s\n", cases[k].name.c_str());
    study.rows.push_back(cost_row(cases[k], k, size));
  }
  add_ratios(study.rows, cases);
  return study;
}

}  // namespace haptic::sim
