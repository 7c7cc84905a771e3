// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/planning/planning_table.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>

#include "host_sim/lab/planning/sampling_planners.hpp"
#include "host_sim/plan/plan_making.hpp"
#include "host_sim/report/quantile.hpp"
#include "host_sim/session/child_run.hpp"
#include "host_sim/view/gallery.hpp"
#include "tools/c_space/pose_text.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/plan/plan_check.hpp"

namespace haptic::sim {
namespace {

constexpr const char* kOurs = "felt part";
/// Room about start and goal for the sampling planners, in radii of the part.
constexpr double kRoom = 2.5;
/// Halvings of a straight way of theirs.
constexpr int kHalvings = 12;

tools::SceneBytes compiled(const Puzzle& puzzle) {
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
  explicit Bench(const Puzzle& puzzle) : puzzle_(puzzle), bytes_(compiled(puzzle)) {
    if (SceneView::open(bytes_.span(), view_) != RtStatus::kOk)
      throw tools::InputError(puzzle.name + ": the puzzle just compiled does not open");
    check_ = std::make_unique<tools::PlanCheck>(view_);
    tolerance_m_ = plan_tolerance_m(view_);
  }

  [[nodiscard]] Run ours(const PlanningOptions& o, std::uint64_t seed) const {
    SlidingPart part(view_);
    StepProver prover(view_, tolerance_m_);
    SearchLimits limits;
    limits.seconds = o.seconds;
    limits.seed = seed;
    const SearchResult result = search_plan(view_, part, prover, start(part), goal(part), limits,
                                            [](const SearchState&) {});
    Run run{result.found, result.state.seconds};
    if (result.found) judge(result.start, result.motion, part.radius_m(), run);
    return run;
  }

  [[nodiscard]] Run sampling(const std::string& name, const PlanningOptions& o,
                             std::uint64_t seed) const {
    const SlidingPart part(view_);
    StepProver prover(view_, tolerance_m_);
    SamplingProblem problem;
    problem.start = start(part);
    problem.goal = goal(part);
    problem.turn_m = part.radius_m();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(problem.start.x0_m[k], problem.goal.x0_m[k]);
      problem.low_m[k] = low - kRoom * part.radius_m();
      problem.high_m[k] = high + kRoom * part.radius_m();
    }
    problem.is_free = [&](const PlanPose& pose) { return prover.is_free(pose); };
    problem.is_way_free = [&](const PlanPose& from, const PlanPose& to) {
      ProvedMotion motion;
      return prover.prove(from, to, kHalvings, ProofSearch::kAny, motion);
    };
    const SamplingResult result =
        run_sampling_planner(name, problem, o.seconds, static_cast<std::uint32_t>(seed));
    Run run{result.solved, result.seconds};
    if (!result.solved) return run;
    ProvedMotion motion;
    for (std::size_t k = 1; k < result.way.size() && run.found; ++k) {
      run.found =
          prover.prove(result.way[k - 1], result.way[k], kHalvings, ProofSearch::kAny, motion);
    }
    if (run.found) judge(result.way.front(), motion, part.radius_m(), run);
    return run;
  }

 private:
  [[nodiscard]] PlanPose start(const SlidingPart& part) const {
    return part.grip_pose(tools::pose_from_text(view_, "start", "start"));
  }
  [[nodiscard]] PlanPose goal(const SlidingPart& part) const {
    return part.grip_pose(tools::pose_from_text(view_, "goal", puzzle_.goal));
  }
  /// Every step again, in long double.
  void judge(const PlanPose& start, const ProvedMotion& motion, double turn_m, Run& run) const {
    PlanPose at = start;
    for (std::size_t k = 0; k < motion.poses.size(); ++k) {
      run.length_mm += 1e3 * tools::step_length_m(at, motion.poses[k], turn_m);
      run.certified += check_->step(at, motion.poses[k], motion.steps[k], tolerance_m_).holds;
      at = motion.poses[k];
    }
    run.steps = motion.poses.size();
  }

  const Puzzle& puzzle_;
  tools::SceneBytes bytes_;
  SceneView view_;
  std::unique_ptr<tools::PlanCheck> check_;
  double tolerance_m_ = 0;
};

}  // namespace

std::vector<Puzzle> planning_puzzles(bool quick) {
  if (quick) return {peg_puzzle(0.1), corner_puzzle(64), window_puzzle(24)};
  std::vector<Puzzle> puzzles;
  for (const double clearance_mm : {2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01})
    puzzles.push_back(peg_puzzle(clearance_mm));
  for (const double long_mm : {50.0, 64.0, 68.0}) puzzles.push_back(corner_puzzle(long_mm));
  for (const double wide_mm : {44.0, 24.0, 20.0, 17.0}) puzzles.push_back(window_puzzle(wide_mm));
  for (const double clearance_mm : {1.0, 0.2}) puzzles.push_back(slot_puzzle(clearance_mm));
  puzzles.push_back(cage_puzzle());
  return puzzles;
}

std::vector<PlanningRow> run_planning(const PlanningOptions& options) {
  std::vector<std::string> planners{kOurs};
  if (!options.ours_only)
    planners.insert(planners.end(), sampling_planners().begin(), sampling_planners().end());
  std::vector<PlanningRow> rows;
  for (const Puzzle& puzzle : planning_puzzles(options.quick)) {
    const Bench bench(puzzle);
    for (const std::string& planner : planners) {
      PlanningRow row{puzzle.name, planner, puzzle.solvable};
      std::vector<double> seconds;
      for (std::uint64_t seed = 1; seed <= options.seeds; ++seed) {
        const Run run =
            planner == kOurs ? bench.ours(options, seed) : bench.sampling(planner, options, seed);
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
      if (options.progress)
        std::fprintf(stderr, "%s, %s: %llu of %llu, %.3g s\n", row.puzzle.c_str(),
                     row.planner.c_str(), static_cast<unsigned long long>(row.found),
                     static_cast<unsigned long long>(row.runs), row.median_s);
      rows.push_back(row);
    }
  }
  return rows;
}

std::vector<OutputText> planning_files(const std::vector<PlanningRow>& rows,
                                       const PlanningOptions& options) {
  ReportTable table("puzzle,planner,found,runs,median_s,length_mm,certified_percent");
  for (const PlanningRow& row : rows) {
    const bool any = row.steps > 0;
    table.add({row.puzzle, row.planner, row.found, row.runs, shown_as("%.3g", row.median_s),
               any ? shown_as("%.4g", row.length_mm) : Cell{},
               any ? shown_as("%.5g", 100.0 * static_cast<double>(row.certified) /
                                          static_cast<double>(row.steps))
                   : Cell{}});
  }
  const std::string head =
      "# Planners\n\nAt most " + tools::short_number(options.seconds, 4) +
      " s a run. `felt part` is `host_sim plan` without its shortening; the others are OMPL's, "
      "with our "
      "verdict of poses and straight ways, in a box of 2.5 radii of the part about start and goal. "
      "A turn of 1 rad counts as the part's radius. `cage` has no solution.\n\n";
  return {{"planning.md", head + table.markdown()}, {"planning.csv", table.csv()}};
}

bool planning_passed(const std::vector<PlanningRow>& rows) {
  return std::ranges::all_of(rows, [](const PlanningRow& row) {
    const bool right = row.planner != kOurs || row.found == (row.solvable ? row.runs : 0);
    return right && row.certified == row.steps && (row.solvable || row.found == 0);
  });
}

}  // namespace haptic::sim
