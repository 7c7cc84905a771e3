// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The inputs of the core in each tick of a servo loop, reconstructed from what the servo tick saw
/// and made, so that a page can compute a session of the whole device stack. The servo tick itself
/// reports nothing more than it always does.

#include <optional>
#include <vector>

#include "host_sim/session/core_session.hpp"
#include "rt_core/servo_tick.hpp"
#include "tools/live/page_file.hpp"

namespace haptic::sim {

/// Runs a core of its own beside that of the servo tick. Where the servo tick dropped the history
/// of its core is seen by the state hash, which goes on from the tick before: a tick that does not
/// give it is taken again after a reset. Owner: one thread. Cost: a tick of the core each.
class CoreTape {
 public:
  /// `scene` outlives this.
  CoreTape(const SceneView& scene, const ServoParameters& parameters);

  /// A tick of the servo, in their order; its number 1 is that of a new servo process.
  /// @return what the core was given; nothing where it did not run.
  std::optional<tools::RecordedTick> take(const ServoInput& input, const ServoResult& result);

  [[nodiscard]] const std::vector<tools::RecordedTick>& ticks() const { return ticks_; }
  /// Ticks whose state hash was not met: the fixed parts were moved, which a page knows nothing of.
  [[nodiscard]] std::size_t unmet() const { return unmet_; }

 private:
  CoreSession core_;
  ServoParameters parameters_;
  Wrench sent_d_;  ///< the last command
  std::vector<tools::RecordedTick> ticks_;
  std::size_t unmet_ = 0;
};

}  // namespace haptic::sim
