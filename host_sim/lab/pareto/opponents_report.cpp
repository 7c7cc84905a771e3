// SPDX-License-Identifier: Apache-2.0
// Table and page of the opponents.
#include "host_sim/lab/pareto/opponents.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

constexpr double kTorqueScale = 1e3;  // mN m
constexpr double kDepthScale = 1e6;   // um

std::string three(double median, double p99, double largest, double scale) {
  return tools::formatted("%.3g / %.3g / %.3g", scale * median, scale * p99, scale * largest);
}

std::string three(const Spread& spread, double scale) {
  return three(spread.median, spread.p99, spread.largest, scale);
}

}  // namespace

ReportTable opponent_table(const std::vector<OpponentMeasure>& measures) {
  ReportTable table(
      "scene,friction,method,setting,ticks_in_contact,median_ns,p99_ns,max_ns,"
      "median_force_error_n,p99_force_error_n,max_force_error_n,p99_torque_error_mnm,"
      "force_step_n,median_depth_um,p99_depth_um,max_depth_um,flawed_ticks,k_r_nm_per_rad,"
      "own_inertia_kgm2,most_k_r_nm_per_rad,least_inertia_kgm2,used_inertia_kgm2");
  for (const OpponentMeasure& measure : measures) {
    for (const OpponentRow& row : measure.rows) {
      const HeadlineMethod& m = row.method;
      std::vector<Cell> cells{measure.scene.name,
                              measure.scene.friction,
                              m.name,
                              quoted(row.setting),
                              m.ns.size(),
                              shown_as("%.1f", m.time_ns.median),
                              shown_as("%.1f", m.time_ns.p99),
                              shown_as("%.1f", m.time_ns.largest),
                              shown_as("%.4g", m.force_n.median),
                              shown_as("%.4g", m.force_n.p99),
                              shown_as("%.4g", m.force_n.largest),
                              shown_as("%.4g", kTorqueScale * m.torque_nm.p99),
                              shown_as("%.4g", m.force_step_n),
                              shown_as("%.4g", kDepthScale * row.depth_m.median),
                              shown_as("%.4g", kDepthScale * row.depth_m.p99),
                              shown_as("%.4g", kDepthScale * row.depth_m.largest),
                              m.flawed_ticks,
                              shown_as("%.4g", measure.scene.gains.k_r_nm_per_rad)};
      if (row.limit) {
        cells.push_back(shown_as("%.3g", row.limit->own_inertia_kgm2));
        cells.push_back(shown_as("%.3g", row.limit->most_k_r_nm_per_rad));
        cells.push_back(shown_as("%.3g", row.limit->least_inertia_kgm2));
        cells.push_back(shown_as("%.3g", row.limit->used_inertia_kgm2));
      } else {
        cells.resize(cells.size() + 4);
      }
      table.add(std::move(cells));
    }
  }
  return table;
}

std::string opponent_markdown(const std::vector<OpponentMeasure>& measures) {
  if (measures.empty()) return {};
  std::string text =
      "## Opponents that draw a part by a spring\n\nMedian / 99 % / largest. Depth: of the part "
      "that the method shows.\n\n";
  for (const OpponentMeasure& measure : measures) {
    const OpponentScene& scene = measure.scene;
    text += "### " + scene.title +
            tools::formatted("\n\nk_t %.0f N/m, k_r %.3g N m/rad, %zu ticks in contact.\n\n",
                             scene.gains.k_t_n_per_m, scene.gains.k_r_nm_per_rad,
                             measure.reference.in_contact.size());
    text += table_head({"method", "us", "error of force, N", "torque error, 99 %, mN m",
                        "largest step of the force, N", "depth, um"});
    for (const OpponentRow& row : measure.rows) {
      const HeadlineMethod& m = row.method;
      text += table_row(
          {m.title + (row.setting.empty() ? "" : " (" + row.setting + ")"), three(m.time_ns, 1e-3),
           three(m.force_n, 1), tools::formatted("%.3g", kTorqueScale * m.torque_nm.p99),
           tools::formatted("%.3g", m.force_step_n), three(row.depth_m, kDepthScale)});
    }
    text += "\n";
    for (const OpponentRow& row : measure.rows) {
      if (!row.limit) continue;
      text += tools::formatted(
          "- %s: its own inertia of %.2g kg m2 is stable up to k_r = %.3g N m/rad; at %.3g it "
          "needs "
          "%.2g, and was given %.2g.\n",
          row.method.title.c_str(), row.limit->own_inertia_kgm2, row.limit->most_k_r_nm_per_rad,
          scene.gains.k_r_nm_per_rad, row.limit->least_inertia_kgm2, row.limit->used_inertia_kgm2);
    }
    for (const std::string& words : measure.skipped) text += "- skipped: " + words + ".\n";
    text += "\n";
  }
  return text;
}

}  // namespace haptic::sim
