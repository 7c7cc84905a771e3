// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/odd_sizes.hpp"

#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/program/unit_guess.hpp"

namespace haptic::tools {
namespace {

/// The unit in which `part` would go with another of this size; empty where there is none, or the
/// unit is known.
std::string fix_text(const SizedPart& part, double other_m) {
  if (!part.scale_to_m) return {};
  const auto unit = fitting_unit(part.diagonal_m, *part.scale_to_m, other_m);
  if (!unit) return {};
  const double would_m = part.diagonal_m * (unit->scale_to_m / *part.scale_to_m);
  return part.name + ": in " + unit->name + " it would be " + spoken_length(would_m) +
         "; then give it scale_to_m = " + short_number(unit->scale_to_m, 4) + " of its own";
}

}  // namespace

std::string odd_sizes_text(const SizedPart& moving, const SizedPart& fixed) {
  const double ratio = fixed.diagonal_m / moving.diagonal_m;
  // The smaller was taken in too small a unit, or the larger in too large a one.
  std::string fix = fix_text(fixed, moving.diagonal_m);
  if (fix.empty()) fix = fix_text(moving, fixed.diagonal_m);
  const bool is_odd = ratio > kOddRatio || ratio < 1.0 / kOddRatio;
  const bool is_suspect = !fix.empty() && (ratio < 1.0 || moving.diagonal_m < kLeastHeld_m);
  if (!is_odd && !is_suspect) return {};
  return fixed.name + " is " +
         (ratio > 1.0 ? short_number(ratio, 3) + " times as large as "
                      : short_number(1.0 / ratio, 3) + " times smaller than ") +
         moving.name + "; are both in the same unit?" + (fix.empty() ? "" : " " + fix);
}

}  // namespace haptic::tools
