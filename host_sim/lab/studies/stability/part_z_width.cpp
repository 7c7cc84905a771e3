// SPDX-License-Identifier: Apache-2.0
// Part 1: Z-width. Where the loop is stable over stiffness and damping, on a wall and in a hole,
// by law, rate, delay and hand: the core in the closed loop against the spectral radius of the
// linear loop and the closed forms.
#include <algorithm>
#include <cmath>
#include <vector>

#include "host_sim/lab/stability/stability_report.hpp"
#include "host_sim/lab/stability/stability_trial.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"
#include "host_sim/report/shard_run.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {
namespace {

constexpr double kAgreement = 0.03;  ///< simulated boundary against the spectral radius
constexpr double kOverBudget = 1.5;
constexpr const char* kRateColours[] = {"#d55e00", "#0072b2", "#009e73"};

struct WallCell {
  TrialSetting setting;
  double theory = 0, simulated = 0, closed_form = 0;
  bool budget_stable = false, over_budget_unstable = false;
  bool over_budget_tried = false;

  [[nodiscard]] bool agrees() const { return std::abs(simulated / theory - 1) <= kAgreement; }
  [[nodiscard]] bool holds() const {
    return agrees() && budget_stable && (!over_budget_tried || over_budget_unstable);
  }
};

struct PegCell {
  TrialSetting setting;
  double limit = 0, rest_s = 0;
};

std::vector<double> rates(const StabilityOptions& o) {
  return o.quick ? std::vector<double>{1000} : std::vector<double>{1000, 2000, 4000};
}

/// Coupling dampings of a law: the direct laws have none.
std::vector<double> dampings(LawId law, bool quick) {
  if (law != LawId::kProxy) return {0};
  return quick ? std::vector<double>{0, 1} : std::vector<double>{0, 0.5, 1, 2, 4};
}

/// All settings of the laws that are served.
std::vector<TrialSetting> settings(const StabilityOptions& o, bool with_nobody) {
  std::vector<TrialSetting> list;
  for (const double rate : rates(o)) {
    for (const unsigned delay : {0u, 1u}) {
      for (const std::string& hand : hand_names()) {
        if (hand == "none" && !with_nobody) continue;
        if (o.quick && hand == "light") continue;
        for (const LawId law : o.laws) {
          if (!law_served(law)) continue;
          for (const double damping : dampings(law, o.quick))
            list.push_back({law, rate, delay, hand, damping});
        }
      }
    }
  }
  return list;
}

WallCell wall_cell(const TrialSetting& setting, double seconds) {
  WallCell cell;
  cell.setting = setting;
  const LinearLoop loop = linear_loop(setting);
  cell.theory = stiffness_limit(loop, setting.damping_ns_per_m);
  // The budget knows the device alone: the hand may let go.
  const double budget =
      closed_form_stiffness(loop.damping_ns_per_m, loop.period_s, loop.delay_samples);
  cell.closed_form = closed_form_stiffness(loop.damping_ns_per_m + loop.hand_damping, loop.period_s,
                                           loop.delay_samples);
  // Sought from the closed form, so that the spectral radius has no part in it.
  cell.simulated = wall_limit(setting, cell.closed_form, seconds);
  cell.budget_stable = wall_is_stable(setting, budget, seconds);
  cell.over_budget_tried = setting.hand == "none" && setting.damping_ns_per_m == 0;
  if (cell.over_budget_tried)
    cell.over_budget_unstable = !wall_is_stable(setting, kOverBudget * budget, seconds);
  return cell;
}

/// Least that the proxy must reach in the hole at 1 kHz with one sample of delay [N/m]; 0: nothing
/// is stated.
double stated_peg(const TrialSetting& s) {
  if (s.law != LawId::kProxy || s.rate_hz != 1000 || s.delay_samples != 1) return 0;
  struct StatedRow {
    double damping, loose, light, firm;
  };
  // Damping along the pull must not cost what the bare spring holds.
  constexpr StatedRow kRows[] = {
      {0, 700, 2000, 5000}, {0.5, 700, 2000, 5000}, {1, 700, 2000, 5000}};
  for (const StatedRow& row : kRows) {
    if (row.damping != s.damping_ns_per_m) continue;
    return s.hand == "loose" ? row.loose : s.hand == "light" ? row.light : row.firm;
  }
  return 0;
}

std::string csv_of(const std::vector<WallCell>& walls, const std::vector<PegCell>& pegs) {
  ReportTable table(
      "scene,law,rate_hz,delay_samples,hand,damping_ns_per_m,simulated_n_per_m,"
      "spectral_radius_n_per_m,closed_form_n_per_m,holds");
  const auto add = [&table](const char* scene, const TrialSetting& s, double simulated,
                            const Cell& theory, const Cell& closed_form, bool holds) {
    table.add({scene, law_name(s.law), s.rate_hz, s.delay_samples, s.hand, s.damping_ns_per_m,
               simulated, theory, closed_form, yes_or_no(holds)});
  };
  for (const WallCell& c : walls)
    add("wall", c.setting, c.simulated, c.theory, c.closed_form, c.holds());
  for (const PegCell& c : pegs)
    add("peg", c.setting, c.limit, {}, {}, c.limit >= stated_peg(c.setting));
  return table.csv();
}

std::vector<std::string> setting_cells(const TrialSetting& s) {
  return {law_name(s.law), fixed(s.rate_hz, 0), std::to_string(s.delay_samples), s.hand,
          short_number(s.damping_ns_per_m, 4)};
}

std::string wall_table(const std::vector<WallCell>& cells) {
  std::string text =
      table_head({"law", "rate, Hz", "delay", "hand", "B, N s/m", "simulated", "spectral radius",
                  "ratio", "closed form", "at the budget", "at 1.5 of it"});
  for (const WallCell& c : cells) {
    std::vector<std::string> row = setting_cells(c.setting);
    for (const std::string& cell :
         {short_number(c.simulated, 4), short_number(c.theory, 4), fixed(c.simulated / c.theory, 4),
          short_number(c.closed_form, 4), std::string(c.budget_stable ? "stable" : "UNSTABLE"),
          std::string(!c.over_budget_tried     ? "-"
                      : c.over_budget_unstable ? "unstable"
                                               : "STABLE")})
      row.push_back(cell);
    text += table_row(row);
  }
  return text;
}

std::string peg_table(const std::vector<PegCell>& cells) {
  std::string text = table_head({"law", "rate, Hz", "delay", "hand", "B, N s/m",
                                 "largest stable, N/m", "at rest after, s", "stated, N/m"});
  for (const PegCell& c : cells) {
    std::vector<std::string> row = setting_cells(c.setting);
    const double stated = stated_peg(c.setting);
    row.push_back(c.limit > 0 ? short_number(c.limit, 4)
                              : "< " + short_number(peg_stiffnesses().front(), 4));
    row.push_back(c.limit > 0 ? short_number(c.rest_s, 4) : "-");
    row.push_back(stated > 0 ? short_number(stated, 4) : "-");
    text += table_row(row);
  }
  return text;
}

/// Largest damping of the pictures [N s/m].
constexpr double kPictureDamping = 8;

/// Boundary over B: theory as curves by rate, the core as marks. One panel per hand and delay.
std::string picture(const std::vector<WallCell>& cells, const StabilityOptions& options) {
  std::string svg = heading_at(80, 28, "Stable region on a wall: stiffness over coupling damping");
  std::vector<double> axis;
  for (double b = 0; b <= kPictureDamping; b += 0.1) axis.push_back(b);
  for (std::size_t h = 0; h < hand_names().size(); ++h) {
    for (const unsigned delay : {0u, 1u}) {
      std::vector<std::vector<double>> curves;
      double top = 0;
      for (const double rate : rates(options)) {
        const LinearLoop loop = linear_loop({LawId::kProxy, rate, delay, hand_names()[h], 0.0});
        std::vector<double> limits;
        for (const double b : axis) limits.push_back(1e-3 * stiffness_limit(loop, b));
        top = std::max(top, *std::max_element(limits.begin(), limits.end()));
        curves.push_back(limits);
      }
      const Panel panel{90 + 310 * static_cast<double>(h),
                        70 + 300.0 * delay,
                        240,
                        220,
                        0,
                        kPictureDamping,
                        0,
                        1.08 * top};
      svg += panel_frame(panel, h == 0 ? "K (kN/m)" : " ", true);
      svg += text_at(panel.left + 120, panel.top - 8,
                     (h == 0 ? "nobody holding" : hand_names()[h] + " hand") + ", delay " +
                         std::to_string(delay),
                     "middle", 13);
      svg += text_at(panel.left + 240, panel.top + 252, "B (N s/m)", "end", 12);
      for (std::size_t r = 0; r < curves.size(); ++r)
        svg += curve(panel, axis, curves[r], kRateColours[r], 1.6);
      for (const WallCell& c : cells) {
        if (c.setting.hand != hand_names()[h] || c.setting.delay_samples != delay) continue;
        const std::size_t r = c.setting.rate_hz > 3000 ? 2 : c.setting.rate_hz > 1500 ? 1 : 0;
        svg += "<circle cx=\"" + pixel(panel.x_of(c.setting.damping_ns_per_m)) + "\" cy=\"" +
               pixel(panel.y_of(std::min(1e-3 * c.simulated, panel.high))) +
               "\" r=\"4\" fill=\"none\" stroke-width=\"1.6\" stroke=\"" + kRateColours[r] +
               "\"/>\n";
      }
    }
  }
  const char* words[] = {"1 kHz", "2 kHz", "4 kHz"};
  for (std::size_t r = 0; r < rates(options).size(); ++r) {
    const double x = 90 + 110 * static_cast<double>(r);
    svg += legend_entry(x, 638, kRateColours[r], words[r]);
  }
  svg +=
      text_at(440, 642, "curves: spectral radius; circles: core in the closed loop", "start", 13);
  return svg_document(1320, 660, svg);
}

/// The whole region in units of the device, m/T and m/T^2: how damping helps at first and harms in
/// the end.
std::string region_picture() {
  constexpr double kMostDamping = 1.6, kMostStiffness = 0.8;
  const Panel panel{90, 60, 560, 340, 0, kMostDamping, 0, kMostStiffness};
  std::string svg = heading_at(90, 28, "Stable region of a virtual wall, nobody holding on") +
                    panel_frame(panel, "K T^2 / m", true);
  for (const unsigned delay : {0u, 1u, 2u}) {
    LinearLoop loop;
    loop.delay_samples = delay;
    const double unit_b = loop.mass_kg / loop.period_s, unit_k = unit_b / loop.period_s;
    std::vector<double> across, up;
    double limit = 1;
    for (double b = 0; b <= kMostDamping && limit > 0; b += 0.01) {
      limit = stiffness_limit(loop, b * unit_b) / unit_k;
      across.push_back(b);
      up.push_back(limit);
    }
    svg += curve(panel, across, up, kRateColours[delay], 2.0);
    const double y = 90 + 22.0 * delay;
    svg += legend_entry(520, y, kRateColours[delay], "delay " + std::to_string(delay));
  }
  svg += text_at(370, 440, "B T / m", "middle", 13);
  svg += text_at(90, 462, "device damping b T / m = 0.01", "start", 12);
  return svg_document(700, 480, svg);
}

void add_findings(const std::vector<WallCell>& walls, const std::vector<PegCell>& pegs,
                  const StabilityOptions& options, PartReport& report) {
  const auto add = [&](const std::string& topic, const std::string& stated,
                       const std::string& found, bool holds, const std::string& remark) {
    report.passed = report.passed && holds;
    report.findings.push_back({topic, stated, found, yes_or_no(holds), remark});
  };
  for (const LawId law : options.laws) {
    if (!law_served(law)) {
      add(std::string("law ") + law_name(law), "rendered", "refused by the core", false, "");
      continue;
    }
    double largest = 0;
    std::size_t cells = 0, budget = 0, over = 0, over_tried = 0;
    for (const WallCell& c : walls) {
      if (c.setting.law != law) continue;
      ++cells;
      largest = std::max(largest, std::abs(c.simulated / c.theory - 1));
      budget += c.budget_stable ? 1u : 0u;
      over_tried += c.over_budget_tried ? 1u : 0u;
      over += c.over_budget_tried && c.over_budget_unstable ? 1u : 0u;
    }
    const std::string name = std::string("wall, ") + law_name(law) + ": ";
    add(name + "boundary against the spectral radius", "within 3 %",
        "within " + fixed(100 * largest, 2) + " %", largest <= kAgreement,
        std::to_string(cells) + " cells");
    add(name + "at the passivity budget b / (T (1/2 + d))", "stable in every cell",
        std::to_string(budget) + " of " + std::to_string(cells), budget == cells, "");
    add(name + "at 1.5 of the budget, nobody holding on", "unstable",
        std::to_string(over) + " of " + std::to_string(over_tried), over == over_tried, "");
  }
  for (const PegCell& c : pegs) {
    const double stated = stated_peg(c.setting);
    if (stated == 0) continue;
    add("peg, 0.1 mm, 1 kHz, one sample of delay, " + c.setting.hand + " hand, B " +
            short_number(c.setting.damping_ns_per_m, 4),
        "at least " + short_number(stated, 4) + " N/m", short_number(c.limit, 4) + " N/m",
        c.limit >= stated, "at rest after " + short_number(c.rest_s, 4) + " s");
  }
}

}  // namespace

PartReport z_width_part(const StabilityOptions& options) {
  constexpr double kPegSeconds = 5;
  const double wall_seconds = options.quick ? 3 : 5;
  const RunOptions run{options.threads, options.progress};
  const auto no_worker = [] { return 0; };
  const std::vector<TrialSetting> wall_settings = settings(options, true);
  std::vector<WallCell> walls(wall_settings.size());
  run_shards(walls.size(), run, "wall", no_worker,
             [&](int, std::size_t k) { walls[k] = wall_cell(wall_settings[k], wall_seconds); });
  const std::vector<TrialSetting> peg_settings = settings(options, false);
  std::vector<PegCell> pegs(peg_settings.size());
  run_shards(pegs.size(), run, "peg", no_worker, [&](int, std::size_t k) {
    const PegLimit limit = peg_limit(peg_settings[k], kPegSeconds);
    pegs[k] = {peg_settings[k], limit.stiffness_n_per_m, limit.rest_s};
  });

  PartReport report;
  report.title = "1. Z-width";
  add_findings(walls, pegs, options, report);
  report.markdown =
      "Device 0.1 kg and 1 N s/m, rotor 1e-4 kg m^2 and 1e-3 N m s, zero-order hold, no Coulomb "
      "friction; k_r = k_t (15 mm)^2; no passivity controller. Hands: loose 100 N/m and 0.2 N s/m, "
      "light 300 and 3, firm 800 and 10.\n\nA cube pressed into a wall, largest stable stiffness "
      "(N/m) by bisection to 0.1 %, against the spectral radius of the linear loop with the hand "
      "and "
      "the closed form (b + b_h) / (T (1/2 + d)), which is of first order in the damping and knows "
      "neither B nor the hand's spring. The budget is b / (T (1/2 + d)) of the device "
      "alone.\n\n" +
      wall_table(walls) + "\n" +
      picture_line("z_width.svg", "Stable region over stiffness and damping") +
      picture_line("z_region.svg", "The whole region, by delay") +
      "\nA square peg in its hole, 0.1 mm of clearance per side, pressed sideways and turned "
      "within a "
      "second, then 5 s of rest: "
      "largest of 500, 700, 1000, 1400, 2000, 3000, 4000, 5000 N/m up to which all come to rest "
      "(in the hole, below 0.5 mm/s and 0.05 rad/s in the last tenth). Next to the boundary a "
      "stable loop "
      "settles slowly: while what is left still falls by a tenth every 5 s it is waited for, up to "
      "40 s, and the time is given.\n\n" +
      peg_table(pegs);
  report.files = {{"z_width.csv", csv_of(walls, pegs)},
                  {"z_width.md", "# " + report.title + "\n\n" + report.markdown},
                  {"z_width.svg", picture(walls, options)},
                  {"z_region.svg", region_picture()}};
  return report;
}

}  // namespace haptic::sim
