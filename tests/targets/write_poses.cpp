// SPDX-License-Identifier: Apache-2.0
// write_poses MOTION POSES: a scripted motion (.toml) or a recorded one (.csv) as the poses that a
// drive is fed with (linker/pose_drive.hpp).

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <span>
#include <vector>

#include "host_sim/session/motion_csv.hpp"
#include "host_sim/session/motion_script.hpp"
#include "linker/pose_drive.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/run_main.hpp"

namespace {

using namespace haptic;

int write_poses(const std::filesystem::path& motion, const std::filesystem::path& out) {
  const std::vector<sim::MotionSample> samples =
      motion.extension() == ".toml" ? sim::make_motion(sim::read_motion_script(motion.string()))
                                    : sim::read_motion_csv(motion.string());
  std::vector<DrivePose> poses;
  poses.reserve(samples.size());
  for (const sim::MotionSample& sample : samples) {
    DrivePose pose;
    pose.stamp_ns = std::llround(sample.t_s * 1e9);
    for (int axis = 0; axis < 3; ++axis) pose.p_wa_m[axis] = sample.p[axis];
    for (int k = 0; k < 4; ++k) pose.q_wa_wxyz[k] = sample.q_wxyz[k];
    poses.push_back(pose);
  }
  tools::write_files({{out, std::as_bytes(std::span(poses))}});
  return tools::kExitDone;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("usage: write_poses MOTION.toml|MOTION.csv POSES\n", stderr);
    return tools::kExitUsage;
  }
  return tools::run_main("write_poses", [&] { return write_poses(argv[1], argv[2]); });
}
