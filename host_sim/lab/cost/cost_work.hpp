// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Makes a scene of the cost report, compiles it, and counts and times every tick of its motion.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host_sim/lab/cost/cost_scenes.hpp"
#include "host_sim/lab/wcet/instruction_counts.hpp"
#include "host_sim/timing/same_state_times.hpp"

namespace haptic::sim {

struct CostPlan {
  std::string folder;         ///< of all outputs; it exists
  bool quick = false;         ///< motions four times as fast, for tests
  bool instructions = true;   ///< count them under valgrind
  std::uint32_t repeats = 5;  ///< of the whole motion, for the times; at least 1
};

/// Where the files of a scene are. The motion is the one that was written: what is run here, what
/// is counted under valgrind and what anyone replays are the same digits.
struct PreparedScene {
  CostScene scene;
  std::string blob_path, motion_path;  ///< FOLDER/NAME.rtscene, FOLDER/NAME_motion.csv
  std::vector<MotionSample> motion;
};

/// Writes the files of the scene to FOLDER/scenes/NAME and compiles them with the graph_compiler
/// next to this program. @throws tools::InputError: no such program, or it refuses the scene.
[[nodiscard]] PreparedScene prepare_cost_scene(const CostScene& scene, const CostPlan& plan);

/// A compiled scene and a motion of the user's. @throws tools::InputError: as read_played_motion
/// does.
[[nodiscard]] PreparedScene prepared_by_user(const std::string& blob_path,
                                             const std::string& motion_path);

/// What one tick did, and what came out of it.
struct CostTick {
  double t_s = 0;
  std::uint64_t instructions = 0;  ///< inside HapticCore::step; 0: not counted
  double time_ns = 0;              ///< least of the repeats
  StepCounters counters;
  ContactSituation situation = ContactSituation::kNone;
  double force_n[3] = {}, torque_nm[3] = {};   ///< on the hand, W axes
  double proxy_m[3] = {}, proxy_wxyz[4] = {};  ///< pose of the part as it is felt
  double gap_m = 0;                            ///< proxy_gap_m
  std::uint32_t flags = 0;                     ///< StepFlag
  RtStatus status = RtStatus::kOk;
};

/// A scene with all of its ticks.
struct CostRun {
  std::string name, words;
  std::uint64_t pairs = 0;
  std::uint64_t state_bytes = 0, blob_bytes = 0;
  SceneCapacity capacity{};  ///< bounds in the scene's header
  std::vector<CostTick> ticks;
  InstructionCounts instructions;
  SameStateTimes cold;  ///< of cold_ticks: warm, and with the caches flushed before
};

/// Ticks of a motion that are timed with cold caches too: the first and every 50th, ascending;
/// fewer, evenly, where a flush of a core's `flushed_bytes` and a copy of its state take long.
[[nodiscard]] std::vector<std::size_t> cold_ticks(std::size_t ticks, std::uint64_t flushed_bytes);

/// @throws tools::InputError: the scene is refused by the core, or there is nothing to run.
/// Cost: `repeats` + 1 runs of the motion, fifteen more steps, copies of the state and seven
/// flushes of each of its cold_ticks, and some fifty runs where instructions are counted.
[[nodiscard]] CostRun measure_cost(const PreparedScene& scene, const CostPlan& plan);

}  // namespace haptic::sim
