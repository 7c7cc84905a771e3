// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Simplification before the decomposition: bevels, fillets and small rounds below a distance are
/// removed by extending the planes next to them, and what that changed is measured on the result.

#include <string>
#include <vector>

#include "tools/graph_compiler/polyhedron/flatten.hpp"
#include "tools/graph_compiler/simplify/surface_distance.hpp"

namespace haptic::tools {

struct SimplifyOptions {
  /// Largest Hausdorff distance [m] between the surface of the part and that of the result.
  double distance_m = 0.0;
  /// Part of the distance that single steps may use, in (0, 1]: smaller values keep more.
  double share = 1.0;
};

/// Result of a simplification. Before: the surface cleaned and fitted as without simplification.
struct SimplifyAccount {
  double limit_m = 0.0;  ///< the distance asked for
  double share = 1.0;    ///< of it, which was left to single steps
  /// Distance of the cleaned surface and the result. Proved: no point of either is farther from the
  /// other; and a point of one of them that is that far. At most 1e-3 of the distance apart, or
  /// 1e-3 of the plane tolerance, unless the work limit of the measurement is exceeded.
  double hausdorff_m = 0.0, hausdorff_at_least_m = 0.0;
  std::size_t planes_before = 0, planes_after = 0;
  std::size_t reflex_before = 0, reflex_after = 0;
  double volume_before_m3 = 0.0, volume_after_m3 = 0.0;
  bool changed = false;
};

struct Simplified {
  FlatBody body;
  SimplifyAccount account;
};

/// The flat body of a simplified surface. The result goes through the same exact realisation and
/// certificate as any other part. It has the shells, cavities and holes of the original.
/// @throws InputError naming file and fix: no simplification stays within the distance; too many
/// reflex edges are left; any refusal of `flatten`.
/// Cost: about 1 ms per 100 faces for the merging, 2 us per part of a triangle for the distance.
Simplified simplify(const Surface& surface, const SimplifyOptions& options,
                    const FlattenLimits& limits);

/// One sentence for people: what was removed and how far the surface is from the original.
std::string simplify_text(const SimplifyAccount& account);

}  // namespace haptic::tools
