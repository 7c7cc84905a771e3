// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Curves of several runs over one time axis, panel under panel.

#include <span>
#include <string>
#include <vector>

#include "host_sim/report/svg_canvas.hpp"

namespace haptic::sim {

struct CurvePanel {
  std::string label;  ///< with its unit
  std::vector<NamedCurve> curves;
};

/// A complete SVG document. Curves are reduced per pixel column to their least and largest value:
/// no peak is lost. All panels share `times`, which ascend. Deterministic.
[[nodiscard]] std::string law_plot(const std::string& title, std::span<const double> times,
                                   std::span<const CurvePanel> panels);

}  // namespace haptic::sim
