// SPDX-License-Identifier: Apache-2.0
// press_down SCENE.rtscene: lowers the part from its start pose by 60 mm within a second, and
// prints the largest force and the hash of all ticks. Equal builds print equal hashes.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <span>
#include <vector>

#include "rt_core/haptic_core.hpp"

namespace {

/// Memory of the alignment that scene and core ask for.
std::span<std::byte> aligned_bytes(std::size_t size) {
  const std::size_t rounded = (size + 63) / 64 * 64;
  return {static_cast<std::byte*>(std::aligned_alloc(haptic::kStateAlignment, rounded)), rounded};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::fputs("usage: press_down SCENE.rtscene\n", stderr), 2;
  std::ifstream file(argv[1], std::ios::binary);
  const std::vector<char> read{std::istreambuf_iterator<char>(file), {}};
  const std::span<std::byte> blob = aligned_bytes(read.size() + 1).first(read.size());
  for (std::size_t k = 0; k < read.size(); ++k) blob[k] = static_cast<std::byte>(read[k]);

  haptic::SceneView scene;
  haptic::RtStatus status = haptic::SceneView::open(blob, scene);
  if (status != haptic::RtStatus::kOk)
    return std::fprintf(stderr, "%s: %s\n", argv[1], haptic::to_text(status)), 3;
  haptic::HapticCore* core = nullptr;
  status = haptic::HapticCore::create(aligned_bytes(haptic::HapticCore::state_bytes(scene)), scene,
                                      core);
  if (status != haptic::RtStatus::kOk) return 3;

  const haptic::SceneParameters& p = scene.parameters();
  const auto real = [](double x) { return static_cast<haptic::Real>(x); };
  haptic::StepInput input;
  input.pose_wa.q_wa = haptic::Quat(real(p.start_q_wa_xyzw[3]), real(p.start_q_wa_xyzw[0]),
                                    real(p.start_q_wa_xyzw[1]), real(p.start_q_wa_xyzw[2]));
  double largest_n = 0;
  haptic::StepResult result;
  for (int tick = 0; tick < 1000; ++tick) {
    const double down_m = 0.060 * tick / 1000;
    input.pose_wa.p_wa = haptic::Vec3(real(p.start_p_wa_m[0]), real(p.start_p_wa_m[1]),
                                      real(p.start_p_wa_m[2] - down_m));
    result = core->step(input);
    if (result.status != haptic::RtStatus::kOk) return 1;
    largest_n = std::fmax(largest_n, static_cast<double>(result.wrench_w.force_w.norm()));
  }
  std::printf("largest force %.9g N, hash %016llx\n", largest_n,
              static_cast<unsigned long long>(result.state_hash));
  return largest_n > 0 ? 0 : 1;
}
