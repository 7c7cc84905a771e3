// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/strangers/tried_scene.hpp"

#include "host_sim/lab/strangers/stranger_trial.hpp"
#include "host_sim/session/child_run.hpp"
#include "host_sim/session/tick_csv.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

namespace haptic::sim {

TriedScene::TriedScene(const std::string& text, const std::vector<OutputText>& files) {
  const TemporaryFolder folder;
  for (const OutputText& file : files) write_whole_file(folder.file(file.name), file.content);
  blob_ =
      tools::compile_scene(tools::parse_scene_file(text, "scene.toml", folder.file(".")), {}).bytes;
  session_ = std::make_unique<CoreSession>(blob_, "scene", GoalContact::kLeftOut);
}

HandSprings TriedScene::springs() const {
  const auto& coupling = session_->view().parameters().coupling;
  return {coupling.k_t_n_per_m, coupling.k_r_nm_per_rad,
          grip_in_part(session_->view()).cast<double>()};
}

std::vector<PlayedTick> TriedScene::play(const std::vector<MotionSample>& motion) {
  std::vector<PlayedTick> ticks;
  session_->core().reset();
  for (std::size_t k = 0; k < motion.size(); ++k) {
    const StepResult result = session_->core().step(input_of(motion[k], k));
    PlayedTick tick;
    tick.force_n = result.wrench_w.force_w.cast<double>();
    tick.torque_nm = result.wrench_w.torque_w.cast<double>();
    tick.touches = result.situation != ContactSituation::kNone;
    tick.flags = result.flags;
    const Quat& q = result.proxy_pose_wa.q_wa;
    tick.felt = sample_at(motion[k].t_s, result.proxy_pose_wa.p_wa.cast<double>(),
                          Rotation(q.w(), q.x(), q.y(), q.z()));
    ticks.push_back(tick);
  }
  return ticks;
}

std::string scene_of_pair(const StrangerPair& pair, double friction) {
  std::string text =
      "format = 1\nname = \"pair\"\n[moving]\nmesh = \"moving.stl\"\nscale_to_m = 0.001\n";
  for (std::size_t k = 0; k < pair.fixed.size(); ++k)
    text += "[[static]]\nmesh = \"fixed_" + std::to_string(k) + ".stl\"\nscale_to_m = 0.001\n";
  return placed_scene(text + "[rendering]\nk_f_n_per_m = 800\n", pair, false, friction);
}

std::vector<OutputText> files_of_pair(const StrangerPair& pair) {
  std::vector<OutputText> files{{"moving.stl", stl_file(pair.moving, false)}};
  for (std::size_t k = 0; k < pair.fixed.size(); ++k)
    files.push_back({"fixed_" + std::to_string(k) + ".stl", stl_file(pair.fixed[k], false)});
  return files;
}

}  // namespace haptic::sim
