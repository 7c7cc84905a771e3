// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A minute of work for a device: the peg taken into its hole and out again, over and over, with a
/// hand that never releases the deadman switch; and what a tick of it must have in common with the
/// same tick of another carrier.

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "host_sim/device/stack_run.hpp"
#include "host_sim/session/motion_script.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

namespace haptic::test {

inline std::filesystem::path peg_folder() {
  return std::filesystem::path(HAPTIC_SCENES_DIR) / "square_peg_five";
}

/// Compiled once in a test program.
inline const std::vector<std::byte>& peg_scene() {
  static const std::vector<std::byte> bytes =
      tools::compile_scene(tools::read_scene_file(peg_folder() / "scene.toml"), {}).bytes;
  return bytes;
}

/// The scene's two motions in turn, straight into the hole and over the rim, with a second between
/// the end of one and the begin of the other: `ticks`, and the sample that they start from.
inline std::vector<sim::MotionSample> peg_motion(std::size_t ticks) {
  constexpr double kBetween_s = 1.0;
  const sim::MotionScript scripts[] = {
      sim::read_motion_script((peg_folder() / "insert.toml").string()),
      sim::read_motion_script((peg_folder() / "motion.toml").string())};
  sim::MotionScript all = scripts[0];
  const auto end_s = [&all] { return all.waypoints.back().t_s; };
  for (std::size_t turn = 1; end_s() * all.rate_hz < static_cast<double>(ticks); ++turn) {
    const double from_s = end_s() + kBetween_s;
    for (sim::WayPoint point : scripts[turn % 2].waypoints) {
      point.t_s += from_s;
      all.waypoints.push_back(point);
    }
  }
  std::vector<sim::MotionSample> motion = sim::make_motion(all);
  motion.resize(ticks + 1);
  return motion;
}

inline sim::StackSettings peg_settings(sim::StackCarrier carrier, bool report_clocked) {
  const sim::HandModel hand = *sim::hand_named("firm");
  sim::StackSettings settings = sim::stack_over(carrier, {}, {}, hand, 1000);
  settings.report_clocked = report_clocked;
  return settings;
}

/// Numbers of one tick, to be compared bit by bit.
struct TickBits {
  std::array<Real, 12> wrenches{};  ///< of the command, and as rendered
  std::array<Real, 7> pose{};       ///< of the handle, as the tick saw it
  std::uint64_t sequence = 0, state_hash = 0;

  friend bool operator==(const TickBits& l, const TickBits& r) {
    return std::memcmp(l.wrenches.data(), r.wrenches.data(), sizeof l.wrenches) == 0 &&
           std::memcmp(l.pose.data(), r.pose.data(), sizeof l.pose) == 0 &&
           l.sequence == r.sequence && l.state_hash == r.state_hash;
  }
};

inline TickBits bits_of(const DeviceState& state, const ServoResult& result) noexcept {
  TickBits bits;
  const WrenchRecord& command = result.command.wrench_d;
  const Wrench& rendered = result.rendered.wrench_w;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    bits.wrenches[k] = command.force_n[k];
    bits.wrenches[3 + k] = command.torque_nm[k];
    bits.wrenches[6 + k] = rendered.force_w[axis];
    bits.wrenches[9 + k] = rendered.torque_w[axis];
    bits.pose[k] = state.pose_dh.p_m[k];
  }
  for (std::size_t k = 0; k < 4; ++k) bits.pose[3 + k] = state.pose_dh.q_xyzw[k];
  bits.sequence = state.sequence;
  bits.state_hash = result.rendered.state_hash;
  return bits;
}

}  // namespace haptic::test
