// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/unit_guess.hpp"

#include <algorithm>
#include <limits>

#include "tools/common/formatted.hpp"

namespace haptic::tools {
namespace {

/// How sizes speak for a unit.
struct Habit {
  FileUnit unit;
  double least_m, most_m;
  double rarity;  ///< factor on how far off the worst part is
  double beyond;  ///< factor where a part is larger than `most_m`
};

constexpr double kMillimetre_m = 0.001;
constexpr Habit kHabits[] = {{{"millimetres", kMillimetre_m}, 0.010, kMostHeld_m, 1.0, 1.0},
                             {{"metres", 1.0}, kLeastHeld_m, kMostHeld_m, 1.0, 10.0},
                             {{"inches", 0.0254}, 0.010, 0.5, 2.1, 1.0},
                             {{"micrometres", 1e-6}, kLeastHeld_m, kMostHeld_m, 1.0, 1.0}};

/// A size in another unit is worth telling between these.
constexpr double kLeastTold_m = 0.002, kMostTold_m = 0.6;

/// Sizes of small parts in millimetres: from the smallest on, one is this large at least, or all
/// are so large as is 2 mm along each axis.
constexpr double kLeastSmall_m = 0.002, kLeastLargest_m = kLeastHeld_m, kLeastAll_m = 0.0034;

/// Parts within this of each other in size go together.
constexpr double kAlike = 3.0;
/// A fixed part may be much larger than the one in the hand, not much smaller.
constexpr double kMuchSmaller = 8.0;

double off_of(const Habit& habit, double diagonal) {
  const double size_m = diagonal * habit.unit.scale_to_m;
  if (size_m < habit.least_m) return habit.least_m / size_m;
  return size_m > habit.most_m ? habit.beyond * size_m / habit.most_m : 1.0;
}

}  // namespace

FileUnit guessed_unit(std::span<const double> diagonals) {
  FileUnit best = kHabits[0].unit;
  double best_off = std::numeric_limits<double>::infinity();
  for (Habit habit : kHabits) {
    const auto [least, most] = std::ranges::minmax(diagonals);
    const bool may_be_small = diagonals.size() == 1 || most * kMillimetre_m >= kLeastLargest_m ||
                              least * kMillimetre_m >= kLeastAll_m;
    if (habit.unit.scale_to_m == kMillimetre_m && may_be_small) habit.least_m = kLeastSmall_m;
    double off = 0.0;
    for (const double diagonal : diagonals) off = std::max(off, off_of(habit, diagonal));
    if (habit.rarity * off < best_off) {
      best_off = habit.rarity * off;
      best = habit.unit;
    }
  }
  return best;
}

FileUnit guessed_unit(double diagonal) { return guessed_unit(std::span(&diagonal, 1)); }

std::string spoken_length(double length_m) {
  return length_m < 1.0 ? short_number(1e3 * length_m, 3) + " mm"
                        : short_number(length_m, 3) + " m";
}

std::string other_units_text(double diagonal, const FileUnit& guessed) {
  std::string text;
  for (const Habit& habit : kHabits) {
    const double size_m = diagonal * habit.unit.scale_to_m;
    if (habit.unit.scale_to_m == guessed.scale_to_m || size_m < kLeastTold_m ||
        size_m > kMostTold_m) {
      continue;
    }
    text += (text.empty() ? " (in " : ", in ") + std::string(habit.unit.name) + ", " +
            short_number(habit.unit.scale_to_m, 4) + ", " + spoken_length(size_m);
  }
  return text.empty() ? text : text + ")";
}

std::optional<FileUnit> fitting_unit(double size_m, double scale_to_m, double other_m) {
  const bool odd = size_m * kMuchSmaller < other_m || size_m > kMuchSmaller * other_m;
  if (!odd) return std::nullopt;
  for (const Habit& habit : kHabits) {
    const double would_m = size_m * (habit.unit.scale_to_m / scale_to_m);
    if (would_m < other_m * kAlike && other_m < would_m * kAlike) return habit.unit;
  }
  return std::nullopt;
}

}  // namespace haptic::tools
