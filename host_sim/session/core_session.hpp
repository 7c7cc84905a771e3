// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A compiled scene in aligned memory with a core over it: what every command of the simulator
/// starts from.

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host_sim/session/motion_csv.hpp"
#include "rt_core/haptic_core.hpp"
#include "rt_core/scene/laws.hpp"
#include "tools/common/held_parts.hpp"
#include "tools/common/scene_bytes.hpp"

namespace haptic::sim {

/// Says whether a tick of law proxy also searches the contact at the goal pose; the other laws
/// always do.
enum class GoalContact : bool { kLeftOut, kAsked };

/// Not movable: the core points into it.
class CoreSession {
 public:
  /// From a file; says on standard error which bodies were simplified. A scene of law proxy that
  /// does without the search at the goal pose gets it where that is `asked`: more state, the same
  /// forces. @throws tools::InputError when the file cannot be read or the scene is refused.
  explicit CoreSession(const std::string& scene_path, GoalContact asked = GoalContact::kAsked);
  /// From bytes; `name` is for messages.
  CoreSession(std::span<const std::byte> scene, const std::string& name,
              GoalContact asked = GoalContact::kAsked);
  CoreSession(const CoreSession&) = delete;
  CoreSession& operator=(const CoreSession&) = delete;

  /// The scene with other parameters from now on, and a core of its own; views and references of
  /// before are no longer valid. @throws tools::InputError when it is refused with them.
  void change(const std::function<void(SceneParameters&)>& change);

  /// In a scene with parts that of the one which is held at first.
  [[nodiscard]] const SceneView& view() const { return view_; }
  /// In a scene with parts that of the one which the first hand holds, or held last.
  [[nodiscard]] HapticCore& core() { return parts_ ? parts_->hand().core() : *core_; }
  /// One tick of it. Another hand holds its part still.
  [[nodiscard]] StepResult step(const StepInput& input) {
    return parts_ ? parts_->hands.step(input) : core_->step(input);
  }
  /// One tick of both hands, in a scene with two.
  [[nodiscard]] Hands::Each<StepResult> step_both(const Hands::Each<const StepInput*>& inputs) {
    return parts_->hands.step(inputs);
  }
  /// The scene in which a hand holds its part, or held its last one.
  [[nodiscard]] const SceneView& view_of(std::uint32_t hand) const {
    return parts_ && hand > 0 ? parts_->hands.hand(hand).scene() : view_;
  }
  /// Bounds of its work.
  [[nodiscard]] const SceneCapacity& bounds() const {
    return parts_ ? parts_->hands.bounds() : view_.header().capacity;
  }
  /// A fresh start; of a scene with parts with each of them at its start.
  void reset();
  /// Null: the scene has one moving part.
  [[nodiscard]] Hands* hands() { return parts_ ? &parts_->hands : nullptr; }
  /// The first of them.
  [[nodiscard]] PartHand* hand() { return parts_ ? &parts_->hand() : nullptr; }
  [[nodiscard]] const PartScenes* parts() const { return parts_ ? &parts_->scenes : nullptr; }
  /// The memory of the core: all of its mutable state.
  [[nodiscard]] std::span<std::byte> state() { return state_.span(); }

 private:
  void open(const std::string& name, GoalContact asked);
  void open_parts(const std::string& name);

  tools::SceneBytes blob_, state_;
  SceneView view_;
  HapticCore* core_ = nullptr;
  std::unique_ptr<tools::HeldParts> parts_;
};

/// Name, law and stiffness of a scene, as the head of a picture.
[[nodiscard]] std::string scene_title(const SceneView& view);

/// Numbers of the near nodes, and of the basic contacts whose point lies in both features, of a
/// pair in the last tick; ascending.
[[nodiscard]] std::vector<std::uint32_t> near_nodes(const HapticCore& core, std::uint32_t pair);
[[nodiscard]] std::vector<std::uint32_t> contact_nodes(const HapticCore& core, std::uint32_t pair);

/// The pose that the core is given for a sample: rounded to Real once.
[[nodiscard]] Pose pose_of(const MotionSample& sample);

/// Input of tick number `tick`.
[[nodiscard]] StepInput input_of(const MotionSample& sample, std::uint64_t tick,
                                 GoalContact goal = GoalContact::kLeftOut);

}  // namespace haptic::sim
