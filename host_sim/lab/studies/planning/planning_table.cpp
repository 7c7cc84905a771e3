// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/planning/planning_table.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <set>
#include <span>

#include "host_sim/lab/planning/processor_time.hpp"
#include "host_sim/lab/planning/sampled_plan.hpp"
#include "host_sim/report/kept_rows.hpp"
#include "host_sim/report/quantile.hpp"
#include "host_sim/session/child_run.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/session/moving_parts.hpp"
#include "host_sim/view/gallery.hpp"
#include "tools/c_space/pose_text.hpp"
#include "tools/common/files.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/plan/plan_check.hpp"
#include "tools/plan/search/plan_making.hpp"

namespace haptic::sim {
namespace {

constexpr const char* kOurs = "felt part";
constexpr double kClearances_mm[] = {2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01};

tools::SceneBytes compiled(const Puzzle& puzzle, const PlanningOptions& options) {
  if (!options.scene.empty()) return tools::read_scene_bytes(options.scene);
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.file("ell_insert"));
  write_whole_file(folder.file("ell_insert/insert.obj"), gallery_file("ell_insert", "insert.obj"));
  const tools::SceneFile file = tools::parse_scene_file(
      puzzle.scene, puzzle.name, std::filesystem::path(folder.file("scene.toml")).parent_path());
  return tools::SceneBytes(tools::compile_scene(file, {}).bytes);
}

struct Run {
  bool found = false;
  double seconds = 0, length_mm = 0;
  std::uint64_t steps = 0, certified = 0;
};

/// One puzzle with what its runs share.
class Bench {
 public:
  Bench(const Puzzle& puzzle, const PlanningOptions& options)
      : puzzle_(puzzle), bytes_(compiled(puzzle, options)) {
    const CoreSession session(bytes_.span(), puzzle.name, GoalContact::kLeftOut);  // checks it
    require_one_moving_part(session, puzzle.name, "planners",
                            "give a scene in which the others are of role fixed");
    static_cast<void>(SceneView::open(bytes_.span(), view_));
    check_ = std::make_unique<tools::PlanCheck>(view_);
    tolerance_m_ = tools::plan_tolerance_m(view_);
    const tools::SlidingPart part(view_);
    tools::StepProver prover(view_, tolerance_m_);
    if (!prover.is_free(start(part)))
      throw tools::InputError(puzzle.name + ": the start is not free; give the scene another");
    if (!prover.is_free(goal(part)))
      throw tools::InputError(puzzle.name + ": the goal is not free; give another pose");
  }

  [[nodiscard]] Run ours(const PlanningOptions& o, std::uint64_t seed) const {
    tools::SlidingPart part(view_);
    tools::StepProver prover(view_, tolerance_m_);
    tools::SearchLimits limits;
    limits.seconds = o.seconds;
    limits.seed = seed;
    limits.clock_s = thread_processor_s;
    const double began_s = thread_processor_s();
    const tools::SearchResult result = tools::search_plan(
        view_, part, prover, start(part), goal(part), limits, [](const tools::SearchState&) {});
    Run run{result.found, thread_processor_s() - began_s};
    if (result.found) judge(result.motion.corners, prover, part.radius_m(), run);
    return run;
  }

  [[nodiscard]] Run sampling(const std::string& name, const PlanningOptions& o,
                             std::uint64_t seed) const {
    const tools::SlidingPart part(view_);
    tools::StepProver prover(view_, tolerance_m_);
    const SamplingResult result =
        run_sampling_planner(name, sampling_problem(part, prover, start(part), goal(part)),
                             o.seconds, static_cast<std::uint32_t>(seed));
    Run run{result.solved, result.seconds};
    if (!result.solved) return run;
    judge(result.way, prover, part.radius_m(), run);
    return run;
  }

 private:
  [[nodiscard]] tools::PlanPose start(const tools::SlidingPart& part) const {
    return part.grip_pose(tools::pose_from_text(view_, "start", "start"));
  }
  [[nodiscard]] tools::PlanPose goal(const tools::SlidingPart& part) const {
    return part.grip_pose(tools::pose_from_text(view_, "goal", puzzle_.goal));
  }
  /// Every straight way again, and each of its steps in long double.
  void judge(const std::vector<tools::PlanPose>& way, tools::StepProver& prover, double turn_m,
             Run& run) const {
    for (std::size_t k = 1; k < way.size() && run.found; ++k) {
      tools::ProvedMotion motion;
      run.found = prover.prove(way[k - 1], way[k], kWayHalvings, tools::ProofSearch::kAny, motion);
      run.length_mm += 1e3 * tools::step_length_m(way[k - 1], way[k], turn_m);
      tools::PlanPose at = way[k - 1];
      for (std::size_t j = 0; j < motion.poses.size(); ++j) {
        run.certified += check_->step(at, motion.poses[j], motion.steps[j], tolerance_m_).holds;
        at = motion.poses[j];
      }
      run.steps += motion.poses.size();
    }
  }

  const Puzzle& puzzle_;
  tools::SceneBytes bytes_;
  SceneView view_;
  std::unique_ptr<tools::PlanCheck> check_;
  double tolerance_m_ = 0;
};

}  // namespace

std::vector<Puzzle> planning_puzzles(const PlanningOptions& options) {
  if (!options.scene.empty())
    return {{std::filesystem::path(options.scene).stem().string(), "", options.goal}};
  std::vector<Puzzle> puzzles;
  if (options.quick) {
    puzzles = {peg_puzzle(0.1), corner_puzzle(1), window_puzzle(1)};
  } else {
    for (const auto make :
         {peg_puzzle, corner_puzzle, window_puzzle, slot_puzzle, ring_puzzle, twist_puzzle}) {
      for (const double clearance_mm : kClearances_mm) puzzles.push_back(make(clearance_mm));
    }
    puzzles.push_back(cage_puzzle());
  }
  std::erase_if(puzzles, [&](const Puzzle& p) { return p.name.find(options.puzzles) != 0; });
  return puzzles;
}

namespace {

PlanningRow run_row(const Bench& bench, const PlanningOptions& options, PlanningRow row) {
  std::vector<double> seconds;
  for (std::uint64_t seed = 1; seed <= options.seeds; ++seed) {
    const Run run = row.planner == kOurs ? bench.ours(options, seed)
                                         : bench.sampling(row.planner, options, seed);
    row.runs += 1;
    row.found += run.found ? 1 : 0;
    row.steps += run.steps;
    row.certified += run.certified;
    seconds.push_back(run.seconds);
    if (run.found && (row.found == 1 || run.length_mm < row.length_mm))
      row.length_mm = run.length_mm;
  }
  std::ranges::sort(seconds);
  row.median_s = quantile(seconds, 0.5);
  row.most_s = seconds.back();
  return row;
}

/// A planner on a puzzle of any clearance.
std::string planner_on(const Puzzle& puzzle, const std::string& planner) {
  return puzzle.name.substr(0, puzzle.name.rfind('_')) + " " + planner;
}

std::vector<double> numbers_of(const PlanningRow& row) {
  return {static_cast<double>(row.runs),
          static_cast<double>(row.found),
          row.median_s,
          row.most_s,
          row.length_mm,
          static_cast<double>(row.steps),
          static_cast<double>(row.certified)};
}

/// @return false: these are not the numbers of a row.
bool take_numbers(const std::vector<double>& numbers, PlanningRow& row) {
  if (numbers.size() != numbers_of(row).size()) return false;
  const auto count = [&](std::size_t k) { return static_cast<std::uint64_t>(numbers[k]); };
  row.runs = count(0);
  row.found = count(1);
  row.median_s = numbers[2];
  row.most_s = numbers[3];
  row.length_mm = numbers[4];
  row.steps = count(5);
  row.certified = count(6);
  return true;
}

}  // namespace

std::vector<PlanningRow> run_planning(const PlanningOptions& options, const PlanningDone& done) {
  std::vector<std::string> planners{kOurs};
  if (!options.ours_only)
    planners.insert(planners.end(), sampling_planners().begin(), sampling_planners().end());
  KeptRows kept(options.rows,
                "planners, seconds " + tools::short_number(options.seconds, 9) + ", seeds " +
                    std::to_string(options.seeds) + (options.until_failed ? ", until failed" : "") +
                    (options.scene.empty() ? "" : ", to " + options.goal),
                options.resume);
  std::vector<PlanningRow> rows;
  std::set<std::string> failed;
  for (const Puzzle& puzzle : planning_puzzles(options)) {
    std::unique_ptr<Bench> bench;
    for (const std::string& planner : planners) {
      PlanningRow row{puzzle.name, planner, puzzle.clearance_mm, puzzle.solvable};
      const std::string key = puzzle.name + " " + planner;
      const std::vector<double>* const numbers = kept.find(key);
      if (failed.contains(planner_on(puzzle, planner))) {
        rows.push_back(row);
        continue;
      }
      if (numbers == nullptr || !take_numbers(*numbers, row)) {
        if (bench == nullptr) bench = std::make_unique<Bench>(puzzle, options);
        row = run_row(*bench, options, row);
        kept.keep(key, numbers_of(row));
        if (options.progress)
          std::fprintf(stderr, "%s, %s: %llu of %llu, %.3g s\n", row.puzzle.c_str(),
                       row.planner.c_str(), static_cast<unsigned long long>(row.found),
                       static_cast<unsigned long long>(row.runs), row.median_s);
      }
      if (options.until_failed && puzzle.clearance_mm > 0 && planner != kOurs && row.found == 0)
        failed.insert(planner_on(puzzle, planner));
      rows.push_back(row);
      if (done) done(rows);
    }
  }
  return rows;
}

std::vector<OutputText> planning_files(const std::vector<PlanningRow>& rows,
                                       const PlanningOptions& options) {
  ReportTable table(
      "puzzle,clearance_mm,planner,found,runs,median_s,most_s,limit_s,seeds,length_mm,"
      "certified_percent");
  for (const PlanningRow& row : rows) {
    const bool any = row.steps > 0;
    table.add(
        {row.puzzle, row.clearance_mm > 0 ? shown_as("%g", row.clearance_mm) : Cell{}, row.planner,
         row.found, row.runs, row.runs > 0 ? shown_as("%.3g", row.median_s) : Cell{},
         row.runs > 0 ? shown_as("%.3g", row.most_s) : Cell{}, shown_as("%g", options.seconds),
         row.runs > 0 ? "1 to " + std::to_string(row.runs) : Cell{},
         any ? shown_as("%.4g", row.length_mm) : Cell{},
         any ? shown_as("%.5g",
                        100.0 * static_cast<double>(row.certified) / static_cast<double>(row.steps))
             : Cell{}});
  }
  const std::string head =
      "# Planners\n\nAt most " + tools::short_number(options.seconds, 4) +
      " s of a processor a run. `felt part` is `host_sim plan` without its shortening; the others "
      "are OMPL's, "
      "with our "
      "verdict of poses and straight ways, in a box of 2.5 radii of the part about start and goal. "
      "A turn of 1 rad counts as the part's radius. The clearance is what is left on either side "
      "where "
      "a place is tightest. `cage` has no solution. A run that finds nothing takes its time. A "
      "planner with 0 runs had "
      "failed where the clearance is larger.\n\n";
  return {{"planning.md", head + table.markdown()}, {"planning.csv", table.csv()}};
}

bool planning_passed(const std::vector<PlanningRow>& rows) {
  return std::ranges::all_of(rows, [](const PlanningRow& row) {
    const bool right = row.planner != kOurs || row.found == (row.solvable ? row.runs : 0);
    return right && row.certified == row.steps && (row.solvable || row.found == 0);
  });
}

}  // namespace haptic::sim
