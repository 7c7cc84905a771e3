// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/guide_legs.hpp"

#include <algorithm>

#include "rt_core/scene/part_scenes.hpp"

namespace haptic::tools {
namespace {

std::string number_word(unsigned count) {
  constexpr const char* kWords[] = {"no", "one", "two", "three", "four", "five", "six"};
  return count < std::size(kWords) ? kWords[count] : std::to_string(count);
}

/// One of a kind, and several.
struct TouchWords {
  const char *one, *several;
};
constexpr TouchWords kTouch[] = {{"face on face", "faces"},
                                 {"edge on face", "edges on faces"},
                                 {"vertex on face", "vertices on faces"},
                                 {"edge on edge", "pairs of edges"}};

std::string touch_words(const GuideStation& station) {
  std::string text;
  for (std::size_t kind = 0; kind < std::size(kTouch); ++kind) {
    const unsigned count = station.touching[kind];
    if (count == 0) continue;
    if (!text.empty()) text += " and ";
    text += count == 1 ? std::string(kTouch[kind].one)
                       : number_word(count) + " " + kTouch[kind].several;
  }
  return text.empty() ? "free" : text;
}

}  // namespace

const char* to_text(GuideState state) {
  constexpr const char* kTexts[] = {"", "off", "lost", "on"};
  const auto k = static_cast<std::size_t>(state);
  return k < std::size(kTexts) ? kTexts[k] : "";
}

GuideLegs::GuideLegs(const SceneView& scene) {
  PartScenes parts;
  if (PartScenes::open(scene, parts) == RtStatus::kOk && parts.count() > 0) {
    // Each part has a guide of its own, and a tick does not say which part is held.
    for (std::uint32_t k = 0; k < parts.count(); ++k) {
      SceneView held;
      if (parts.may_be_held(k) && SceneView::open(parts.scene_of(k), held) == RtStatus::kOk &&
          held.guide() != nullptr) {
        words_ = {"on the way"};
        leg_of_ = {0};
        is_of_parts_ = true;
      }
    }
    return;
  }
  if (scene.guide() == nullptr) return;
  const std::uint8_t* before = nullptr;
  for (const GuideStation& station : scene.guide_stations()) {
    const std::uint8_t* const now = station.touching;
    if (before == nullptr || !std::equal(now, now + std::size(station.touching), before)) {
      words_.push_back(touch_words(station));
    }
    leg_of_.push_back(static_cast<std::uint16_t>(words_.size() - 1));
    before = now;
  }
}

std::uint32_t GuideLegs::leg_of(std::uint32_t station) const {
  return empty() ? 0u : leg_of_[std::min<std::size_t>(station, leg_of_.size() - 1)];
}

std::string GuideLegs::place(GuideState state, std::uint32_t station) const {
  if (empty() || state == GuideState::kNone) return {};
  if (state == GuideState::kOff) return "the guide is off";
  if (state == GuideState::kLost) return "off the way: the guide looks for a station";
  if (is_of_parts_) return words_.front();
  const std::uint32_t leg = leg_of(station);
  return std::to_string(leg + 1) + " of " + std::to_string(count()) + ": " + words(leg) +
         ", then " + (leg + 1 < count() ? words(leg + 1) : std::string("the goal"));
}

}  // namespace haptic::tools
