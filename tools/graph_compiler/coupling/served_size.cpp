// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/coupling/served_size.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "rt_core/proxy/proxy_law.hpp"

namespace haptic::tools {
namespace {

constexpr double kRounding = static_cast<double>(kRealEpsilon);
constexpr const char* kScalar = sizeof(Real) == sizeof(double) ? "double" : "single";

double length(const double* x) { return std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

}  // namespace

ServedSize served_size(const SceneView& scene) {
  ServedSize size;
  double statics = 0.0;
  for (std::uint32_t i = 0; i < scene.pieces().size(); ++i) {
    const PieceRecord& piece = *scene.piece(i).record;
    if (piece.body == 0) {
      size.radius_m = std::max(size.radius_m, piece.reach_m);
    } else {
      statics = std::max(statics, length(scene.bodies()[piece.body].reference_m) + piece.reach_m);
    }
  }
  const SceneParameters& p = scene.parameters();
  size.coordinate_m = std::max(statics, length(p.start_p_wa_m)) + size.radius_m;
  size.length_scale = size.radius_m / kReferenceRadius_m;
  const double scaled = kReferenceTolerance_m * size.length_scale;
  const double floor = kToleranceRoundings * kRounding * size.coordinate_m;
  size.floored = floor > scaled;
  size.tolerance_m = std::max(scaled, floor);
  size.climb_m = static_cast<double>(proxy_scale(scene).climb_m);
  size.largest_offset_m =
      kLargestToleranceShare * size.radius_m / (kToleranceRoundings * kRounding);
  const CouplingParameters& c = p.coupling;
  size.stiffness_share =
      1.0 / (1.0 + c.k_t_n_per_m / c.k_r_nm_per_rad * size.radius_m * size.radius_m);
  return size;
}

std::string size_refusal(const ServedSize& size) {
  char text[512];
  if (size.radius_m < kLeastRadius_m || size.radius_m > kLargestRadius_m) {
    std::snprintf(text, sizeof text,
                  "the moving part reaches %.3g m from its grip, law proxy serves %.0e to %.0e m; "
                  "check scale_to_m and grip_m, or name another law",
                  size.radius_m, kLeastRadius_m, kLargestRadius_m);
    return text;
  }
  if (size.coordinate_m <= size.largest_offset_m) return "";
  std::snprintf(text, sizeof text,
                "coordinates reach %.3g m from the origin of W, where %s precision resolves too "
                "little for a moving part that reaches %.3g m from its grip: law proxy serves it "
                "within %.3g m; move the scene to the origin%s, or name another law",
                size.coordinate_m, kScalar, size.radius_m, size.largest_offset_m,
                sizeof(Real) == sizeof(double) ? "" : ", build for double precision");
  return text;
}

}  // namespace haptic::tools
