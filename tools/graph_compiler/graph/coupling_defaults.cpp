// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/coupling_defaults.hpp"

#include "rt_core/scene/capacity.hpp"

namespace haptic::tools {

void complete_coupling(SceneParameters& parameters, double radius_m) {
  CouplingParameters& c = parameters.coupling;
  if (c.k_t_n_per_m == 0) c.k_t_n_per_m = parameters.k_f_n_per_m;
  if (c.k_r_nm_per_rad == 0) {
    const double length_m = kDefaultLengthShare * radius_m;
    c.k_r_nm_per_rad = c.k_t_n_per_m * length_m * length_m;
  }
  if (c.max_rotation_error_rad == 0) c.max_rotation_error_rad = kDefaultRotationError_rad;
  if (c.passes == 0) c.passes = kDefaultProxyPasses;
  if (c.max_window_s == 0 && c.min_window_s == 0) {
    c.min_window_s = kDefaultMinWindow_s;
    c.max_window_s = kDefaultMaxWindow_s;
  }
}

}  // namespace haptic::tools
