// SPDX-License-Identifier: Apache-2.0
// batch_against_cpp SCENE.rtscene POSES: what a program over the core's C++ interface takes for a
// batch of poses, seven doubles each (x y z, quaternion x y z w). Keeps of every tick what the
// Python package keeps. Prints wall time, time of the processor [s], and the hash of all ticks.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>
#include <memory>
#include <span>
#include <vector>

#include "rt_core/haptic_core.hpp"

namespace {

std::vector<char> read(const char* path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::span<std::byte> aligned_bytes(std::size_t size) {
  const std::size_t rounded = (size + 63) / 64 * 64;
  return {static_cast<std::byte*>(std::aligned_alloc(haptic::kStateAlignment, rounded)), rounded};
}

/// A row for each tick.
struct Results {
  explicit Results(std::size_t count)
      : wrenches(std::make_unique_for_overwrite<double[]>(6 * count)),
        felt_poses(std::make_unique_for_overwrite<double[]>(7 * count)),
        gaps_m(std::make_unique_for_overwrite<double[]>(count)),
        situations(std::make_unique_for_overwrite<std::uint32_t[]>(count)),
        flags(std::make_unique_for_overwrite<std::uint32_t[]>(count)),
        hashes(std::make_unique_for_overwrite<std::uint64_t[]>(count)) {}
  std::unique_ptr<double[]> wrenches, felt_poses, gaps_m;
  std::unique_ptr<std::uint32_t[]> situations, flags;
  std::unique_ptr<std::uint64_t[]> hashes;
};

void keep(const haptic::StepResult& result, std::size_t k, Results& to) {
  for (int i = 0; i < 3; ++i) {
    const auto at = 6 * k + static_cast<std::size_t>(i);
    to.wrenches[at] = static_cast<double>(result.wrench_w.force_w[i]);
    to.wrenches[at + 3] = static_cast<double>(result.wrench_w.torque_w[i]);
    to.felt_poses[at + k] = static_cast<double>(result.proxy_pose_wa.p_wa[i]);
  }
  for (int i = 0; i < 4; ++i)
    to.felt_poses[7 * k + 3 + static_cast<std::size_t>(i)] =
        static_cast<double>(result.proxy_pose_wa.q_wa.coeffs()[i]);
  to.gaps_m[k] = static_cast<double>(result.proxy_gap_m);
  to.situations[k] = static_cast<std::uint32_t>(result.situation);
  to.flags[k] = result.flags;
  to.hashes[k] = result.state_hash;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return std::fputs("usage: batch_against_cpp SCENE.rtscene POSES\n", stderr), 2;
  const std::vector<char> scene = read(argv[1]), numbers = read(argv[2]);
  const std::size_t count = numbers.size() / (7 * sizeof(double));
  std::vector<double> poses(7 * count);
  std::memcpy(poses.data(), numbers.data(), poses.size() * sizeof(double));
  const std::span<std::byte> blob = aligned_bytes(scene.size() + 1).first(scene.size());
  std::memcpy(blob.data(), scene.data(), scene.size());
  haptic::SceneView view;
  haptic::HapticCore* core = nullptr;
  if (count == 0 || haptic::SceneView::open(blob, view) != haptic::RtStatus::kOk ||
      haptic::HapticCore::create(aligned_bytes(haptic::HapticCore::state_bytes(view)), view,
                                 core) != haptic::RtStatus::kOk)
    return std::fputs("batch_against_cpp: no scene, or no poses\n", stderr), 3;

  const auto begin = std::chrono::steady_clock::now();
  const std::clock_t begin_cpu = std::clock();
  Results results(count);
  for (std::size_t k = 0; k < count; ++k) {
    const double* p = poses.data() + 7 * k;
    const auto real = [](double x) { return static_cast<haptic::Real>(x); };
    haptic::StepInput input;
    input.sequence = k;
    input.stamp_ns = std::llround(1e9 * (static_cast<double>(k) / view.parameters().rate_hz));
    input.pose_wa = {haptic::Vec3(real(p[0]), real(p[1]), real(p[2])),
                     haptic::Quat(real(p[6]), real(p[3]), real(p[4]), real(p[5]))};
    const haptic::StepResult result = core->step(input);
    if (result.status != haptic::RtStatus::kOk) return 1;
    keep(result, k, results);
  }
  const double cpu_s = static_cast<double>(std::clock() - begin_cpu) / CLOCKS_PER_SEC;
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
  std::printf("%.6f %.6f %llu\n", wall.count(), cpu_s,
              static_cast<unsigned long long>(results.hashes[count - 1]));
  return 0;
}
