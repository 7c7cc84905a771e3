// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The unit of files that state none, guessed from the sizes of the parts, and what else it could
/// be.

#include <optional>
#include <span>
#include <string>

namespace haptic::tools {

/// A unit of length that files have.
struct FileUnit {
  const char* name;
  double scale_to_m;
};

/// Sizes of a part that a hand holds.
inline constexpr double kLeastHeld_m = 0.005, kMostHeld_m = 2.0;

/// The unit in which parts of these diagonals, in file units, are most like parts that a hand works
/// with: 10 mm to 2 m in millimetres, 5 mm to 2 m in metres and micrometres, 10 mm to 0.5 m in
/// inches. Small parts from 2 mm on are parts in millimetres too, such as screws M2, where one of
/// them is 5 mm or more, all are 3.4 mm or more (2 mm along each axis), or there is one alone: the
/// others of the scene state their unit then. The
/// worst of the parts counts, by the ratio to the nearest of these bounds; inches, which are rarer,
/// must be 2.1 times as good as the others, and metres beyond 2 m are hardly taken. Of units that
/// are as good as each other the first of millimetres, metres, inches and micrometres.
[[nodiscard]] FileUnit guessed_unit(std::span<const double> diagonals);
[[nodiscard]] FileUnit guessed_unit(double diagonal);

/// "12 mm", "1.2 m" as people say it.
[[nodiscard]] std::string spoken_length(double length_m);

/// " (in inches, 0.0254, 95 mm)": other units in which a hand could hold the part, with their
/// metres; empty where there are none.
[[nodiscard]] std::string other_units_text(double diagonal, const FileUnit& guessed);

/// Where a part of `size_m`, from a file without a unit that was taken in `scale_to_m`, does not go
/// with another of `other_m`: the unit in which it would.
[[nodiscard]] std::optional<FileUnit> fitting_unit(double size_m, double scale_to_m,
                                                   double other_m);

}  // namespace haptic::tools
