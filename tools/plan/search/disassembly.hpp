// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The order of an assembly, found by taking it apart: one part after the other goes out of what is
/// left, by a way whose every step is proved, to where it is to lie. Backwards that is the order in
/// which the parts are put together. Cheap ways are tried for every part before dear ones, and the
/// search, which is the dearest, has a budget that grows in rounds, so that one hard part does not
/// take the time while another is free.
///
/// One part is moved at a time: an assembly in which two parts must go out together is not taken
/// apart. Same scene, places and seed: same order and ways, unless the time ends the work.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "rt_core/scene/part_scenes.hpp"
#include "tools/plan/search/way_out.hpp"

namespace haptic::tools {

/// Parts that are taken out, at most.
inline constexpr std::size_t kMostTakenApart = 12;
/// A part that is to be taken out.
struct AssembledPart {
  std::uint32_t part = 0;         ///< its number
  std::optional<PartPlace> lies;  ///< where it is to lie; none: beside the assembly
};

struct DisassemblyLimits {
  double seconds = 120;
  double (*clock_s)() = wall_clock_s;  ///< what the seconds are of
  std::uint64_t seed = 1;
};

/// A part that was taken out.
struct TakenPart {
  std::uint32_t part = 0;
  PartPlace assembled, removed;
  OutWay way;  ///< from the one to the other
};

/// Something that holds a part, as it was pushed about where it is.
struct PartHold {
  std::uint32_t other = 0;  ///< the part that holds it
  HoldingPlane plane;
  std::uint32_t piece = 0, other_piece = 0;
};
struct StuckPart {
  std::uint32_t part = 0;
  bool no_translation = false;  ///< decided: no translation leads it out
  std::vector<PartHold> holds;
};

/// A part whose place in the assembly was moved, for it overlapped another.
struct SettledPart {
  std::uint32_t part = 0;
  double moved_m = 0;
};

struct Disassembly {
  std::vector<TakenPart> taken;  ///< in the order in which they go out
  std::vector<StuckPart> stuck;  ///< none: all are out
  std::vector<SettledPart> settled;
  bool timed_out = false;
  double seconds = 0;

  [[nodiscard]] bool is_whole() const { return stuck.empty(); }
};

/// @param places  of all parts, assembled. @param movable  those that are to go out.
/// @param say  is given a line from time to time.
/// @throws InputError where parts overlap by more than kSettleShare of the size, or lie in one
/// another, or there are more than kMostTakenApart.
[[nodiscard]] Disassembly take_apart(const PartScenes& parts, std::vector<PartPlace> places,
                                     const std::vector<AssembledPart>& movable,
                                     const DisassemblyLimits& limits,
                                     const std::function<void(const std::string&)>& say);

}  // namespace haptic::tools
