// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The figures that the proxy law was designed to, each measured again: one row per case, with
/// bounds. "At most" figures may be passed by a factor of two, others hold within what is stated.

#include <functional>
#include <string>
#include <vector>

namespace haptic::sim {

/// A measured number against the one that the design gives, and where it must lie.
struct Figure {
  std::string what;  ///< with its unit
  double design = 0, measured = 0;
  double least = 0, most = 0;
  [[nodiscard]] bool ok() const { return measured >= least && measured <= most; }
};

/// |measured| may be up to twice the design figure.
[[nodiscard]] Figure at_most(std::string what, double design, double measured);
/// Within `tolerance` of the design figure.
[[nodiscard]] Figure near_to(std::string what, double design, double measured, double tolerance);

struct CaseRow {
  std::string name, title;
  std::function<std::vector<Figure>()> measure;
};

/// Slides, tilts, plates, seams, swings and the corner.
[[nodiscard]] std::vector<CaseRow> contact_rows();
/// Insertion, tilt and drop-in at three clearances.
[[nodiscard]] std::vector<CaseRow> peg_rows();
/// Force over depth of a single contact, k_eff = 1 / (1/k_t + rho^2/k_r), at several k_r.
[[nodiscard]] std::vector<CaseRow> stiffness_rows();
/// Start inside an obstacle, limits of the pull, jumps of the device.
[[nodiscard]] std::vector<CaseRow> limit_rows();
/// Sticking, sliding and jamming.
[[nodiscard]] std::vector<CaseRow> friction_rows();
/// A block whole against the same block cut, under the same motions.
[[nodiscard]] std::vector<CaseRow> division_rows();
/// Work round closed loops.
[[nodiscard]] std::vector<CaseRow> energy_rows();

/// All of them, in this order.
[[nodiscard]] std::vector<CaseRow> proxy_cases();

/// Markdown table of rows with their figures.
[[nodiscard]] std::string figures_head();
[[nodiscard]] std::string figures_rows(const CaseRow& row, const std::vector<Figure>& figures);

}  // namespace haptic::sim
