// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Two parts of a scene whose files seem to be in different units, by their sizes.

#include <optional>
#include <string>

namespace haptic::tools {

/// A part that differs from the other by more than this in size was made in another unit.
inline constexpr double kOddRatio = 200.0;

struct SizedPart {
  std::string name;         ///< for people: the file
  double diagonal_m = 0.0;  ///< of its box
  /// By which the file was scaled; absent: the file states its unit, or there is no file.
  std::optional<double> scale_to_m{};
};

/// The question if the two look as if their files were in different units: "plate.stl is 45 times
/// smaller than peg.stl; are both in the same unit? plate.stl: in inches it would be 78 mm; then
/// give it scale_to_m = 0.0254 of its own"; else empty. A part in the hand may be much smaller than
/// a fixed one, so that this alone, up to kOddRatio, is no reason.
[[nodiscard]] std::string odd_sizes_text(const SizedPart& moving, const SizedPart& fixed);

}  // namespace haptic::tools
