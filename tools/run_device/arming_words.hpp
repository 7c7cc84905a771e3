// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Words about arming: why it does not come about, what to do about each fault, and where the part
/// begins, with the keys of the configuration and of the scene that change it.

#include <cstdint>
#include <string>

#include "rt_core/servo_tick.hpp"

namespace haptic::tools {

/// State of arming in the newest tick of a servo process.
struct ArmingNews {
  std::uint32_t waits = 0;         ///< ArmingWait
  std::uint32_t present = 0;       ///< SafetyFault: causes that are there now
  std::uint32_t begins = 0;        ///< ticks in which the part began, so far
  std::uint32_t deadman = 1;       ///< [switches] deadman
  std::uint32_t finds_place = 0;   ///< 1: [workspace] offset_m is found; 0: given
  std::uint32_t device = 0;        ///< 1 and 2 of two, whose parts go on from where they are
  std::uint64_t inside_ticks = 0;  ///< in a row that the part is led out of an obstacle
  double offset_m[3] = {};         ///< with which the handle, where it stood when the
                                   ///< part began, has it where the scene has it start
  double part_rotation_wxyz[4] = {1, 0, 0, 0};  ///< and turned as there
};

/// Makes them of the servo's ticks.
class ArmingNewsTaker {
 public:
  /// `parameters`: of the tick, its grip point and start from the scene. `device`: as in
  /// ArmingNews.
  explicit ArmingNewsTaker(const ServoParameters& parameters, std::uint32_t device = 0) noexcept;
  /// Takes one tick, in order. Servo thread; cost: a constant.
  void take(const ServoInput& input, const ServoResult& result) noexcept;
  [[nodiscard]] const ArmingNews& news() const noexcept { return news_; }

 private:
  WorkspaceMap map_;
  StartPlace start_;  ///< with place and turn
  ArmingNews news_;
};

/// The next condition for arming: "the part starts inside an obstacle, for 12 ticks so far; ...".
/// Empty: none, it is armed or arming.
[[nodiscard]] std::string wait_text(const ArmingNews& news);

/// The fixes for faults (SafetyFault), a clause for each bit of `faults`, and how to arm then.
/// Empty where there is none.
[[nodiscard]] std::string fix_text(std::uint32_t faults, const ArmingNews& news);

/// "[workspace] offset_m = [0.01, 0, 0.04]", and part_rotation where the part is turned in the
/// handle: lines of the configuration that give what was found.
[[nodiscard]] std::string place_keys(const ArmingNews& news);

}  // namespace haptic::tools
