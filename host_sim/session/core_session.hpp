// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A compiled scene in aligned memory with a core over it: what every command of the simulator
/// starts from.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "host_sim/session/motion_csv.hpp"
#include "rt_core/haptic_core.hpp"

namespace haptic::sim {

/// Bytes whose first one is aligned to 64.
class AlignedBytes {
 public:
  explicit AlignedBytes(std::size_t count = 0) : chunks_(count / 64 + 1), count_(count) {}
  [[nodiscard]] std::span<std::byte> bytes() { return {chunks_.data()->bytes, count_}; }
  [[nodiscard]] std::span<const std::byte> bytes() const { return {chunks_.data()->bytes, count_}; }

 private:
  struct alignas(64) Chunk {
    std::byte bytes[64];
  };
  std::vector<Chunk> chunks_;
  std::size_t count_;
};
static_assert(kStateAlignment <= 64 && kSceneAlignment <= 64);

/// Not movable: the core points into it.
class CoreSession {
 public:
  /// From a file; says on standard error which bodies were simplified. @throws tools::InputError
  /// when the file cannot be read or the scene is refused.
  explicit CoreSession(const std::string& scene_path);
  /// From bytes; `name` is for messages.
  CoreSession(std::span<const std::byte> scene, const std::string& name);
  CoreSession(const CoreSession&) = delete;
  CoreSession& operator=(const CoreSession&) = delete;

  [[nodiscard]] const SceneView& view() const { return view_; }
  [[nodiscard]] HapticCore& core() { return *core_; }
  /// The memory of the core: all of its mutable state.
  [[nodiscard]] std::span<std::byte> state() { return state_.bytes(); }

 private:
  void open(const std::string& name);

  AlignedBytes blob_, state_;
  SceneView view_;
  HapticCore* core_ = nullptr;
};

/// "proxy", "weighted_region" or "paper".
[[nodiscard]] const char* law_name(LawId law);

/// Name, law and stiffness of a scene, as the head of a picture.
[[nodiscard]] std::string scene_title(const SceneView& view);

/// Numbers of the near nodes, and of the basic contacts whose point lies in both features, of a
/// pair in the last tick; ascending.
[[nodiscard]] std::vector<std::uint32_t> near_nodes(const HapticCore& core, std::uint32_t pair);
[[nodiscard]] std::vector<std::uint32_t> contact_nodes(const HapticCore& core, std::uint32_t pair);

/// The pose that the core is given for a sample: rounded to Real once.
[[nodiscard]] Pose pose_of(const MotionSample& sample);

/// Whether a tick of law proxy also searches the contact at the goal pose; the other laws always
/// do.
enum class GoalContact : bool { kLeftOut, kAsked };

/// Input of tick number `tick`.
[[nodiscard]] StepInput input_of(const MotionSample& sample, std::uint64_t tick,
                                 GoalContact goal = GoalContact::kLeftOut);

}  // namespace haptic::sim
