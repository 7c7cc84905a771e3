// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/planning/guide_study.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/device/loop_run.hpp"
#include "host_sim/lab/planning/guided_scene.hpp"
#include "host_sim/lab/planning/puzzles.hpp"
#include "host_sim/report/quantile.hpp"
#include "host_sim/report/shard_run.hpp"
#include "tools/c_space/pose_text.hpp"
#include "tools/common/error.hpp"
#include "tools/plan/search/harmonic_field.hpp"
#include "tools/plan/search/plan_making.hpp"
#include "tools/plan/search/translation_plan.hpp"

namespace haptic::sim {
namespace {

constexpr double kRate_hz = 1000;
/// The device of the study, as its scene states it.
constexpr const char* kDeviceText =
    "[device]\nmass_kg = 0.1\ndamping_ns_per_m = 1.0\nrotor_inertia_kg_m2 = 1.0e-4\n"
    "rotor_damping_nms_per_rad = 1.0e-3\n";
/// The start without its tilt; that of a plan that begins elsewhere; how far the hole of another
/// scene lies aside [m].
constexpr const char* kUprightStart = "6mm,4mm,55mm,1,0,0,0";
constexpr const char* kOtherStart = "-6mm,-6mm,50mm,1,0,0,0";
constexpr double kOtherHole_m[3] = {0.0024, 0.0018, 0};
/// The peg is in when it is this near to the goal, which is 1 mm above the floor.
constexpr double kArrived_m = 1e-3;
constexpr double kPlanning_s = 120;

tools::SceneFile scene_file(const Puzzle& puzzle) {
  return tools::parse_scene_file(puzzle.scene + kDeviceText, puzzle.name, ".");
}

/// The scene with the plan of one whose hole lies aside: the same stations, all moved by that.
tools::SceneBytes with_hole_aside(const tools::SceneBytes& scene) {
  return with_changed_guide(scene, [](GuideRecord&, std::span<GuideStation> stations) {
    for (GuideStation& station : stations) {
      for (int k = 0; k < 3; ++k) station.x0_m[k] += static_cast<Real>(kOtherHole_m[k]);
    }
  });
}

tools::Plan plan_of(const SceneView& view, const std::string& start, const std::string& goal,
                    std::uint64_t seed) {
  tools::MadePlan made = tools::make_plan_between(view, start, goal, seed, kPlanning_s);
  if (!made.search.found) throw tools::InputError("the study's task was not planned");
  return made.plan;
}

/// Down a harmonic function, by translations alone.
tools::Plan harmonic_plan_of(const SceneView& view, const std::string& goal, std::uint64_t seed) {
  tools::SlidingPart part(view);
  tools::StepProver prover(view, tools::plan_tolerance_m(view));
  const Pose start_wa = tools::pose_from_text(view, "start", kUprightStart);
  const tools::TranslationResult found = tools::plan_translation(
      view, prover, start_wa, part.grip_pose(start_wa),
      part.grip_pose(tools::pose_from_text(view, "goal", goal)), tools::plan_tolerance_m(view));
  if (found.verdict != tools::TranslationVerdict::kFound)
    throw tools::InputError("the study's task was not planned by translations: " + found.why);
  tools::ShorteningLimits shortening;
  shortening.seed = seed;
  const tools::CorneredMotion shortest =
      tools::shortened(found.motion, prover, part.radius_m(), shortening);
  return tools::plan_from(view, part, prover, tools::descend_about(found.space, shortest).motion,
                          seed);
}

HandTarget target_of(const tools::PlanPose& pose) {
  return {tools::place_of(pose), tools::turn_of(pose)};
}

/// Work of the hand's springs and dampers over one period, by the mean of their forces at its ends.
double hand_work_j(const HandModel& hand, const HandStroke& stroke, double period_s,
                   const DeviceState& before, const DeviceState& after) {
  const Vector pace = (stroke.to.x0_w - stroke.from.x0_w) / period_s;
  const Vector turn_pace =
      rotation_vector(stroke.to.q_wa * stroke.from.q_wa.conjugate()) / period_s;
  const auto load = [&](const HandTarget& target, const DeviceState& at) {
    return Load{hand.stiffness_n_per_m * (target.x0_w - at.x0_w) +
                    hand.damping_ns_per_m * (pace - at.velocity_w),
                hand.stiffness_nm_per_rad * rotation_vector(target.q_wa * at.q_wa.conjugate()) +
                    hand.damping_nms_per_rad * (turn_pace - at.angular_velocity_w)};
  };
  const Load a = load(stroke.from, before), b = load(stroke.to, after);
  return 0.5 *
         ((a.force_w + b.force_w).dot(after.x0_w - before.x0_w) +
          (a.torque_w + b.torque_w).dot(rotation_vector(after.q_wa * before.q_wa.conjugate())));
}

}  // namespace

GuideStudyBench guide_study_bench(const GuideStudyOptions& options) {
  const Puzzle puzzle = peg_puzzle(options.clearance_mm);
  GuideStudyBench bench;
  const tools::SceneFile file = scene_file(puzzle);
  tools::SceneBytes plain = compiled_scene(file);
  const SceneView view = opened_scene(plain);
  const tools::SlidingPart part(view);
  bench.task.start = target_of(part.grip_pose(tools::pose_from_text(view, "start", "start")));
  bench.task.goal = target_of(part.grip_pose(tools::pose_from_text(view, "goal", puzzle.goal)));
  bench.task.depth_m = kPegPuzzleDepth_m;
  bench.task.arrived_m = kArrived_m;
  bench.device = device_of(view.parameters(), kRate_hz);
  StudyGuide none{"none", false, {}}, right{"plan", false, {}}, harmonic{"harmonic", false, {}},
      start{"other start", true, {}}, hole{"other hole", true, {}};
  for (std::uint64_t seed = 1; seed <= options.plans; ++seed) {
    right.scenes.push_back(guided_scene(file, plan_of(view, "start", puzzle.goal, seed)));
    harmonic.scenes.push_back(guided_scene(file, harmonic_plan_of(view, puzzle.goal, seed)));
    start.scenes.push_back(guided_scene(file, plan_of(view, kOtherStart, puzzle.goal, seed)));
    hole.scenes.push_back(with_hole_aside(right.scenes.back()));
  }
  none.scenes.push_back(std::move(plain));
  for (StudyGuide* guide : {&none, &right, &harmonic, &start, &hole})
    bench.guides.push_back(std::move(*guide));
  return bench;
}

InsertionRun run_insertion(const GuideStudyBench& bench, const tools::SceneBytes& scene,
                           const HandModel& hand, std::uint64_t seed) {
  CoreSession session(scene.span(), "study", GoalContact::kLeftOut);
  ClosedLoop loop(session, bench.device, hand, kRate_hz);
  InsertionHand will(bench.task, hand, seed, loop.period_s());
  InsertionRun run;
  if (const GuideRecord* const guide = session.view().guide()) run.stated_j = guide->energy_j;
  HandStroke stroke{will.first(), {}};
  loop.place({stroke.from.x0_w, stroke.from.q_wa, Vector::Zero(), Vector::Zero()});
  const double in_m = bench.task.goal.x0_w.z() + bench.task.arrived_m;
  const auto ticks = static_cast<std::uint64_t>(std::lround(bench.task.limit_s * kRate_hz));
  double done_j = 0;
  for (std::uint64_t k = 0; k < ticks && run.sound && !run.inserted; ++k) {
    const DeviceState before = loop.device().state();
    stroke.to = will.next(before);
    const LoopTick tick = loop.step(stroke);
    const DeviceState& after = loop.device().state();
    run.peak_n = std::max(run.peak_n, static_cast<double>(tick.result.wrench_w.force_w.norm()));
    run.hand_j += hand_work_j(hand, stroke, loop.period_s(), before, after);
    const Wrench& led = tick.result.guidance.wrench_w;
    done_j +=
        led.force_w.cast<double>().dot(after.x0_w - before.x0_w) +
        led.torque_w.cast<double>().dot(rotation_vector(after.q_wa * before.q_wa.conjugate()));
    run.guide_j = std::max(run.guide_j, done_j);
    const HandTarget felt = loop.grip_of(tick.result.proxy_pose_wa.p_wa.cast<double>(),
                                         tick.result.proxy_pose_wa.q_wa.cast<double>());
    run.inserted = felt.x0_w.z() <= in_m;
    run.time_s = static_cast<double>(k + 1) * loop.period_s();
    run.sound = tick.result.status == RtStatus::kOk && std::isfinite(run.hand_j + run.peak_n) &&
                after.velocity_w.norm() < kRunawaySpeed_m_per_s &&
                after.angular_velocity_w.norm() < kRunawayTurn_rad_per_s;
    stroke.from = stroke.to;
  }
  return run;
}

double StudyCell::inserted_share() const {
  const auto in = std::ranges::count_if(runs, [](const InsertionRun& r) { return r.inserted; });
  return static_cast<double>(in) / static_cast<double>(runs.size());
}

std::vector<double> StudyCell::sorted(double InsertionRun::*figure) const {
  std::vector<double> values;
  for (const InsertionRun& run : runs) values.push_back(run.*figure);
  std::ranges::sort(values);
  return values;
}

std::vector<StudyCell> run_guide_study(const GuideStudyBench& bench,
                                       const GuideStudyOptions& options) {
  std::vector<StudyCell> cells;
  std::vector<const StudyGuide*> guide_of;
  for (const std::string& hand : hand_names()) {
    if (hand == "none") continue;
    for (const StudyGuide& guide : bench.guides) {
      cells.push_back({hand, guide.name, guide.wrong, std::vector<InsertionRun>(options.runs)});
      guide_of.push_back(&guide);
    }
  }
  run_shards(
      cells.size() * options.runs, RunOptions{options.threads, options.progress}, "guide-study",
      [] { return 0; },
      [&](int, std::size_t shard) {
        const std::size_t cell = shard / options.runs, run = shard % options.runs;
        const StudyGuide& guide = *guide_of[cell];
        cells[cell].runs[run] =
            run_insertion(bench, guide.scenes[run % guide.scenes.size()],
                          *hand_named(cells[cell].hand), seed_of(options.seed, run));
      });
  return cells;
}

StudyVerdict verdict_of(const std::vector<StudyCell>& cells) {
  constexpr double kAllowed = 0.01;
  StudyVerdict verdict;
  for (const StudyCell& cell : cells) {
    for (const InsertionRun& run : cell.runs) {
      verdict.sound = verdict.sound && run.sound;
      verdict.within_energy = verdict.within_energy && run.guide_j <= run.stated_j;
    }
    if (cell.wrong) continue;
    for (const StudyCell& other : cells) {
      if (other.hand != cell.hand || other.guide != "none") continue;
      const auto no_more = [&](double InsertionRun::*figure, double share) {
        return quantile(cell.sorted(figure), share) <= quantile(other.sorted(figure), share);
      };
      verdict.helps = verdict.helps && cell.inserted_share() >= other.inserted_share() - kAllowed;
      verdict.as_fast = verdict.as_fast && no_more(&InsertionRun::time_s, 0.5) &&
                        no_more(&InsertionRun::time_s, 0.9);
      verdict.as_gentle = verdict.as_gentle && no_more(&InsertionRun::peak_n, 0.5) &&
                          no_more(&InsertionRun::peak_n, 0.95);
    }
  }
  return verdict;
}

}  // namespace haptic::sim
