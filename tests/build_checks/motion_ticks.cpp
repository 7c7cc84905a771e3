// SPDX-License-Identifier: Apache-2.0
// Writes a motion as the poses that linker/image_run.hpp takes, one per tick. Usage:
// motion_ticks SCRIPT.toml|MOTION.csv OUT

#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "host_sim/session/motion_csv.hpp"
#include "host_sim/session/motion_script.hpp"
#include "rt_core/base/scalar.hpp"
#include "tools/common/files.hpp"
#include "tools/common/run_main.hpp"

namespace {

int write_ticks(const std::string& from, const std::string& to) {
  namespace sim = haptic::sim;
  const bool is_script = from.size() > 5 && from.substr(from.size() - 5) == ".toml";
  const std::vector<sim::MotionSample> motion =
      is_script ? sim::make_motion(sim::read_motion_script(from)) : sim::read_motion_csv(from);
  std::vector<haptic::Real> poses;
  for (const sim::MotionSample& sample : motion) {
    const double* const q = sample.q_wxyz;
    for (const double x : {sample.p[0], sample.p[1], sample.p[2], q[1], q[2], q[3], q[0]}) {
      poses.push_back(static_cast<haptic::Real>(x));
    }
  }
  haptic::tools::write_files({{to, std::as_bytes(std::span(poses))}});
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("usage: motion_ticks SCRIPT.toml|MOTION.csv OUT\n", stderr);
    return 2;
  }
  return haptic::tools::run_main("motion_ticks", [&] { return write_ticks(argv[1], argv[2]); });
}
