// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/continuity/path_run.hpp"

#include <algorithm>

#include "host_sim/session/core_session.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {

PathRun run_path(const ContactPath& path, LawId law, std::uint32_t steps) {
  const std::vector<std::byte> scene =
      scene_of(path.a, {&path.b, 1}, kPathStiffness_n_per_m, kPathEpsilon_m, law);
  CoreSession session(scene, path.name);
  PathRun run;
  run.law = law;
  run.steps = steps;
  Vector last_force = Vector::Zero(), last_torque = Vector::Zero();
  for (std::uint32_t k = 0; k <= steps; ++k) {
    const double s = static_cast<double>(k) / steps;
    const PathPose pose = path.pose(s);
    StepInput input;
    input.sequence = k;
    input.pose_wa = pose_at(pose.p, pose.q);
    const StepResult result = session.core().step(input);
    if (result.status != RtStatus::kOk)
      throw tools::InputError(path.name + ": a pose is refused: " + to_text(result.status));
    const Vector force = result.wrench_w.force_w.cast<double>();
    const Vector torque = result.wrench_w.torque_w.cast<double>();
    if (k > 0) {
      run.largest_force_step_n = std::max(run.largest_force_step_n, (force - last_force).norm());
      const double torque_step_nm = (torque - last_torque).norm();
      if (torque_step_nm > run.largest_torque_step_nm) {
        run.largest_torque_step_nm = torque_step_nm;
        run.largest_torque_step_at = s;
        run.largest_torque_step_w = torque - last_torque;
      }
    }
    last_force = force;
    last_torque = torque;
    run.parameter.push_back(s);
    run.torque_w.push_back(torque);
  }
  return run;
}

std::vector<PathResult> run_paths(bool quick) {
  std::vector<PathResult> results;
  for (const ContactPath& path : contact_paths()) {
    std::vector<std::uint32_t> steps = {250, 1000, 4000, 16000};
    if (quick) steps = {path.fine_steps / 4, path.fine_steps};
    PathResult result{path, {}, {}};
    for (const std::uint32_t count : steps) {
      result.paper.push_back(run_path(path, LawId::kPaper, count));
      result.weighted.push_back(run_path(path, LawId::kWeightedRegion, count));
    }
    results.push_back(std::move(result));
  }
  return results;
}

double ratio_to_previous(std::span<const PathRun> runs, std::size_t k) {
  if (k == 0 || runs[k].largest_torque_step_nm < kStillTorque_nm) return 0;
  return runs[k - 1].largest_torque_step_nm / runs[k].largest_torque_step_nm;
}

bool settles(std::span<const PathRun> runs, std::uint32_t fine_steps) {
  bool looked = false, settled = true;
  for (std::size_t k = 1; k < runs.size(); ++k) {
    if (runs[k].steps < fine_steps) continue;
    looked = true;
    settled = settled && (runs[k].largest_torque_step_nm < kStillTorque_nm ||
                          ratio_to_previous(runs, k) >= kLeastRatio);
  }
  return looked && settled;
}

}  // namespace haptic::sim
