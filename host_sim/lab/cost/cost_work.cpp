// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/cost/cost_work.hpp"

#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <limits>

#include "host_sim/session/child_run.hpp"
#include "host_sim/session/motion_csv.hpp"
#include "host_sim/session/moving_parts.hpp"
#include "host_sim/session/tick_clock.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

/// How much faster a quick run moves.
constexpr double kQuickFactor = 4;

/// One of so many ticks is timed with cold caches.
constexpr std::size_t kColdStride = 50;
/// Bytes of scene and state of all ticks so timed: at 7 flushes of some 50 ps a byte and as many
/// copies, a few seconds.
constexpr std::uint64_t kMostColdBytes = std::uint64_t{4} << 30;

void compile_cost_scene(const std::string& scene_file, const std::string& blob) {
  const TemporaryFolder folder;
  const std::vector<std::string> command = {program_beside("graph_compiler"), scene_file, "-o",
                                            blob, "--quiet"};
  const int status = run_to_end(command, folder.file("out"), folder.file("err"));
  if (status == -1) throw tools::InputError(command[0] + ": " + std::strerror(errno));
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw tools::InputError(
        scene_file + ": the compiler refuses it: " + last_line(file_text(folder.file("err"))));
  }
}

CostTick tick_of(double t_s, const StepResult& step) {
  CostTick tick;
  tick.t_s = t_s;
  tick.counters = step.counters;
  tick.situation = step.situation;
  for (int i = 0; i < 3; ++i) {
    tick.force_n[i] = static_cast<double>(step.wrench_w.force_w[i]);
    tick.torque_nm[i] = static_cast<double>(step.wrench_w.torque_w[i]);
    tick.proxy_m[i] = static_cast<double>(step.proxy_pose_wa.p_wa[i]);
  }
  const auto& q = step.proxy_pose_wa.q_wa;
  const Real wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
  for (int i = 0; i < 4; ++i) tick.proxy_wxyz[i] = static_cast<double>(wxyz[i]);
  tick.gap_m = static_cast<double>(step.proxy_gap_m);
  tick.flags = step.flags;
  tick.status = step.status;
  return tick;
}

/// The program on the scene's files, one tick after another.
InstructionQuestion question_for(const PreparedScene& scene) {
  InstructionQuestion question;
  question.program = program_beside("host_lab");
  question.arguments = {"wcet",          "--once",   "--scene",
                        scene.blob_path, "--motion", scene.motion_path};
  question.ticks = scene.motion.size();
  return question;
}

}  // namespace

PreparedScene prepare_cost_scene(const CostScene& scene, const CostPlan& plan) {
  PreparedScene prepared;
  prepared.scene = scene;
  const std::string folder = plan.folder + "/scenes/" + scene.name;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw tools::OsError(folder + ": the folder cannot be made: " + error.message());
  for (const OutputText& file : scene.files)
    write_whole_file(folder + "/" + file.name, file.content);
  prepared.blob_path = plan.folder + "/" + scene.name + ".rtscene";
  compile_cost_scene(folder + "/scene.toml", prepared.blob_path);
  MotionScript script = read_motion_script(folder + "/motion.toml");
  if (plan.quick) {
    for (WayPoint& point : script.waypoints) point.t_s /= kQuickFactor;
  }
  prepared.motion_path = plan.folder + "/" + scene.name + "_motion.csv";
  write_motion_csv(prepared.motion_path, make_motion(script));
  prepared.motion = read_played_motion(prepared.motion_path);
  return prepared;
}

PreparedScene prepared_by_user(const std::string& blob_path, const std::string& motion_path) {
  PreparedScene prepared;
  prepared.scene.name = std::filesystem::path(blob_path).stem().string();
  prepared.scene.words = "with " + motion_path;
  prepared.blob_path = blob_path;
  prepared.motion_path = motion_path;
  prepared.motion = read_played_motion(motion_path);
  require_one_moving_part(CoreSession(blob_path, GoalContact::kLeftOut), blob_path, "cost",
                          kJudgeBodies);
  return prepared;
}

std::vector<std::size_t> cold_ticks(std::size_t ticks, std::uint64_t flushed_bytes) {
  const std::uint64_t affordable = kMostColdBytes / std::max<std::uint64_t>(flushed_bytes, 1);
  const std::size_t most = std::max<std::size_t>(1, static_cast<std::size_t>(affordable));
  const std::size_t stride = std::max(kColdStride, (ticks + most - 1) / most);
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < ticks; i += stride) chosen.push_back(i);
  return chosen;
}

CostRun measure_cost(const PreparedScene& scene, const CostPlan& plan) {
  CoreSession session(scene.blob_path, GoalContact::kLeftOut);
  const std::vector<MotionSample>& motion = scene.motion;
  CostRun run;
  run.name = scene.scene.name;
  run.words = scene.scene.words;
  run.capacity = session.view().header().capacity;
  run.pairs = session.view().pair_count();
  run.state_bytes = run.capacity.state_bytes;
  run.blob_bytes = session.view().header().byte_count;
  if (motion.empty() || plan.repeats == 0)
    throw tools::InputError(run.name + ": nothing to run: no ticks or no repeats");
  const TickClock clock;
  std::vector<double> least_ns(motion.size(), std::numeric_limits<double>::infinity());
  InstructionQuestion question;
  if (plan.instructions) question = question_for(scene);
  for (std::uint32_t r = 0; r < plan.repeats; ++r) {
    session.core().reset();
    for (std::size_t i = 0; i < motion.size(); ++i) {
      const StepInput input = input_of(motion[i], i);
      StepResult step;
      least_ns[i] = std::min(least_ns[i], clock.ns_of([&] { step = session.core().step(input); }));
      if (r > 0) continue;  // what a guide has done stays done, so a later run is another one
      run.ticks.push_back(tick_of(motion[i].t_s, step));
      question.state_hash = step.state_hash;
    }
  }
  for (std::size_t i = 0; i < motion.size(); ++i) run.ticks[i].time_ns = least_ns[i];
  run.cold = same_state_times(
      session, motion, cold_ticks(motion.size(), run.state_bytes + run.blob_bytes), kLeastRepeats);
  run.instructions = count_instructions(question);
  if (run.instructions.measured) {
    for (std::size_t i = 0; i < motion.size(); ++i)
      run.ticks[i].instructions = run.instructions.profile.per_tick[i];
  }
  return run;
}

}  // namespace haptic::sim
