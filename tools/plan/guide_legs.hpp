// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Where on the plan of a scene's guide the part is, in words for the operator. A leg of the plan
/// is a run of stations at which the part touches in the same way. In a scene whose parts are held
/// one after another all the plans are one leg, "on the way": a tick does not say which part it is
/// of.

#include <cstdint>
#include <string>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "rt_core/tick/guide.hpp"

namespace haptic::tools {

/// "off", "lost" or "on"; empty where the scene has no guide.
[[nodiscard]] const char* to_text(GuideState state);

class GuideLegs {
 public:
  /// No legs: a scene without a guide.
  GuideLegs() = default;
  explicit GuideLegs(const SceneView& scene);

  [[nodiscard]] bool empty() const { return words_.empty(); }
  [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(words_.size()); }
  /// The leg of a station, from 0 on.
  [[nodiscard]] std::uint32_t leg_of(std::uint32_t station) const;
  /// How the part touches on a leg: "free", "face on face", "two faces and an edge on a face".
  [[nodiscard]] const std::string& words(std::uint32_t leg) const { return words_[leg]; }

  /// For the operator: "3 of 7: face on face, then two faces"; that the guide is off, or looks for
  /// its way. Empty where the scene has no guide.
  [[nodiscard]] std::string place(GuideState state, std::uint32_t station) const;

 private:
  std::vector<std::string> words_;     ///< of each leg
  std::vector<std::uint16_t> leg_of_;  ///< of each station
  bool is_of_parts_ = false;
};

}  // namespace haptic::tools
