// SPDX-License-Identifier: Apache-2.0
/// Any bytes as a motion: read, and then perhaps fit to be played; or refused with file and line.
#include <cmath>

#include "host_sim/session/motion_csv.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tools/common/error.hpp"

namespace {

using haptic::fuzz::MemoryFile;
using haptic::fuzz::require;
using haptic::sim::MotionSample;

void check_motion(const std::vector<MotionSample>& motion) {
  require(!motion.empty(), "a motion has a sample");
  for (std::size_t k = 0; k < motion.size(); ++k) {
    double square = 0;
    for (const double x : motion[k].q_wxyz) square += x * x;
    require(std::abs(square - 1) < 1e-12, "quaternions have length 1");
    for (const double x : motion[k].p) require(std::isfinite(x), "positions are finite");
    require(std::isfinite(motion[k].t_s), "times are finite");
    require(k == 0 || motion[k].t_s > motion[k - 1].t_s, "times increase");
  }
}

void check_played(const std::vector<MotionSample>& motion) {
  for (std::size_t k = 0; k < motion.size(); ++k) {
    for (const double x : motion[k].p) require(std::abs(x) <= 10, "the part is near");
    if (k == 0) continue;
    const double step_s = motion[k].t_s - motion[k - 1].t_s;
    require(step_s >= 0.1e-3 && step_s <= 3e-3, "one sample in each millisecond");
    for (std::size_t i = 0; i < 3; ++i)
      require(std::abs(motion[k].p[i] - motion[k - 1].p[i]) <= 0.5, "no jump");
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static MemoryFile file;
  file.set({reinterpret_cast<const char*>(data), size});
  bool read = false;
  try {
    const std::vector<MotionSample> motion = haptic::sim::read_motion_csv(file.path());
    check_motion(motion);
    read = true;
    const std::vector<MotionSample> played = haptic::sim::read_played_motion(file.path());
    require(played.size() == motion.size(), "a motion is played whole");
    check_played(played);
  } catch (const haptic::tools::InputError& error) {
    const bool with_line = haptic::fuzz::names_place(error.what(), file.path(), 1);
    const bool of_all = haptic::fuzz::names_place(error.what(), file.path(), 0);
    require(with_line || of_all, "a refusal begins with the file, and a line where one is wrong");
    require(read || with_line || size < 8 || of_all, "unreadable lines are named");
  }
  return 0;
}
