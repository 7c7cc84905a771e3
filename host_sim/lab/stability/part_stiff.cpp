// SPDX-License-Identifier: Apache-2.0
// Part 2: stiff walls and light tools. How far each integrator of a virtual tool carries the loop,
// against the direct spring.
#include <algorithm>
#include <cmath>
#include <vector>

#include "host_sim/lab/stability/stability_report.hpp"
#include "host_sim/lab/stability/virtual_tool.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"

namespace haptic::sim {
namespace {

constexpr double kRatio = 0.7;  ///< damping ratio of the coupling
constexpr const char* kStiffColours[] = {"#d55e00", "#e69f00", "#0072b2", "#009e73"};
constexpr double kToolInertias_kg_m2[] = {1e-4, 1e-5, 1e-6};
constexpr double kRotorInertia_kg_m2 = 1e-4, kRotorDamping_nms = 1e-3;

/// One cell: the largest stable coupling.
struct StiffCell {
  bool rotation = false;
  double rate_hz = 0;
  unsigned delay = 0;
  Integrator integrator = Integrator::kExplicit;
  double wall = 0;  ///< N/m, or N m/rad
  double tool = 0;  ///< kg, or kg m^2
  double limit = 0;
};

std::vector<double> walls(bool rotation, bool quick) {
  // In rotation the wall stands at a lever of 15 mm.
  const double lever = rotation ? 0.015 * 0.015 : 1.0;
  std::vector<double> list;
  for (double exponent = 2; exponent <= 6; exponent += quick ? 2 : 0.5)
    list.push_back(lever * std::pow(10.0, exponent));
  return list;
}

LinearLoop device_loop(bool rotation, double rate_hz, unsigned delay) {
  LinearLoop loop;
  loop.period_s = 1 / rate_hz;
  loop.delay_samples = delay;
  if (rotation) {
    loop.mass_kg = kRotorInertia_kg_m2;
    loop.damping_ns_per_m = kRotorDamping_nms;
  }
  return loop;
}

/// In rotation the search is made in units in which the rotor weighs 0.1 kg, so that its first gain
/// is as small as in translation.
double limit_of(const StiffCell& cell) {
  const LinearLoop loop = device_loop(cell.rotation, cell.rate_hz, cell.delay);
  const double scale = 0.1 / loop.mass_kg;
  LinearLoop scaled = loop;
  scaled.mass_kg *= scale;
  scaled.damping_ns_per_m *= scale;
  const double limit =
      coupling_limit(scaled, {cell.integrator, cell.tool * scale}, cell.wall * scale, kRatio);
  return limit == kNoLimit ? limit : limit / scale;
}

std::vector<StiffCell> all_cells(const StabilityOptions& options) {
  std::vector<StiffCell> cells;
  const std::vector<double> rates =
      options.quick ? std::vector<double>{1000} : std::vector<double>{1000, 2000, 4000};
  for (const bool rotation : {false, true}) {
    std::vector<double> tools{0.1};
    if (rotation) tools.assign(std::begin(kToolInertias_kg_m2), std::end(kToolInertias_kg_m2));
    for (const double rate : rates) {
      for (const unsigned delay : {0u, 1u}) {
        for (const double tool : tools) {
          for (const Integrator integrator : kIntegrators) {
            for (const double wall : walls(rotation, options.quick)) {
              StiffCell cell{rotation, rate, delay, integrator, wall, tool, 0};
              cell.limit = limit_of(cell);
              cells.push_back(cell);
            }
          }
        }
      }
    }
  }
  return cells;
}

std::string stiffness_text(double value) {
  if (value == kNoLimit) return "no limit";
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

std::string csv_of(const std::vector<StiffCell>& cells) {
  ReportTable table("axis,rate_hz,delay_samples,integrator,wall,tool,largest_coupling");
  for (const StiffCell& c : cells) {
    table.add({c.rotation ? "rotation" : "translation", c.rate_hz, c.delay, to_text(c.integrator),
               c.wall, c.tool, c.limit == kNoLimit ? Cell("none") : Cell(c.limit)});
  }
  return table.csv();
}

/// Limits of the tool alone, on k_s T^2 / m_t.
std::string alone_table() {
  std::string text = table_head({"integrator", "zeta 0", "0.1", "0.5", "1"});
  for (const Integrator integrator : kIntegrators) {
    std::vector<std::string> row{to_text(integrator)};
    for (const double ratio : {0.0, 0.1, 0.5, 1.0}) {
      const double limit = tool_limit(integrator, ratio);
      // Undamped, the exact step has modulus 1 and only rounding decides.
      row.push_back(limit < 1e-3 ? "0" : limit > 1e6 ? "no limit" : stiffness_text(limit));
    }
    text += table_row(row);
  }
  return text;
}

std::string coupled_table(const std::vector<StiffCell>& all, bool rotation) {
  std::vector<StiffCell> cells;
  std::vector<double> shown;
  for (const StiffCell& c : all) {
    if (c.rotation != rotation) continue;
    cells.push_back(c);
    if (std::find(shown.begin(), shown.end(), c.wall) == shown.end()) shown.push_back(c.wall);
  }
  std::vector<std::string> head{"rate, Hz", "delay", rotation ? "tool, kg m^2" : "tool, kg",
                                "integrator"};
  for (const double wall : shown) head.push_back(stiffness_text(wall));
  std::string text = table_head(head);
  for (std::size_t k = 0; k < cells.size(); k += shown.size()) {  // walls vary fastest
    const StiffCell& c = cells[k];
    std::vector<std::string> row{fixed(c.rate_hz, 0), std::to_string(c.delay),
                                 stiffness_text(c.tool), to_text(c.integrator)};
    for (std::size_t w = 0; w < shown.size(); ++w)
      row.push_back(stiffness_text(cells[k + w].limit));
    text += table_row(row);
  }
  return text;
}

/// Largest coupling over the wall, at 1 kHz, translation; a missing limit is drawn at the top.
std::string picture(const std::vector<StiffCell>& cells) {
  std::string svg = heading_at(70, 28, "Largest stable coupling of a virtual tool, 1 kHz");
  double left = 80;
  for (const unsigned delay : {0u, 1u}) {
    const LogPanel panel{left, 70, 400, 300, 1e2, 1e6, 1e1, 1e7};
    svg += log_panel_frame(panel, "delay " + std::to_string(delay) + ", tool 0.1 kg", "wall (N/m)",
                           delay == 0 ? "coupling (N/m)" : "", 1);
    for (std::size_t i = 0; i < kIntegrators.size(); ++i) {
      std::vector<Pixel> points;
      for (const StiffCell& c : cells) {
        if (c.rotation || c.rate_hz != 1000 || c.delay != delay || c.integrator != kIntegrators[i])
          continue;
        points.push_back({panel.x_of(c.wall), panel.y_of(std::clamp(c.limit, 1e1, 1e7))});
      }
      svg += polyline_of(points, kStiffColours[i], 2.2);
      if (delay == 0) {
        const double x = 120 + 190 * static_cast<double>(i);
        svg += legend_entry(x, 426, kStiffColours[i], to_text(kIntegrators[i]));
      }
    }
    left += 470;
  }
  svg += text_at(80, 456, "top edge: no limit; bottom edge: never stable", "start", 12);
  return svg_document(980, 470, svg);
}

void add_findings(const std::vector<StiffCell>& cells, PartReport& report) {
  struct Stated {
    double rate_hz;
    unsigned delay;
    Integrator integrator;
    double wall, limit;
  };
  // rt_core/METHOD.md section 9.
  constexpr Stated kStated[] = {{1000, 0, Integrator::kExplicit, 1e2, 992},
                                {1000, 0, Integrator::kSemiImplicit, 1e4, 6040},
                                {1000, 0, Integrator::kExponential, 1e6, 67400},
                                {1000, 0, Integrator::kBackward, 1e6, 65500},
                                {1000, 1, Integrator::kExponential, 1e6, 14300},
                                {1000, 1, Integrator::kBackward, 1e4, 14100},
                                {2000, 1, Integrator::kBackward, 1e6, 52400},
                                {4000, 1, Integrator::kBackward, 1e6, 197000}};
  for (const Stated& s : kStated) {
    for (const StiffCell& c : cells) {
      const bool same = !c.rotation && c.rate_hz == s.rate_hz && c.delay == s.delay &&
                        c.integrator == s.integrator && std::abs(c.wall / s.wall - 1) < 1e-9;
      if (!same) continue;
      const bool holds = std::abs(c.limit / s.limit - 1) <= 0.01;
      report.passed = report.passed && holds;
      report.findings.push_back({std::string("coupling, ") + to_text(s.integrator) + ", wall " +
                                     stiffness_text(s.wall) + " N/m, " + fixed(s.rate_hz, 0) +
                                     " Hz, delay " + std::to_string(s.delay),
                                 stiffness_text(s.limit) + " N/m", stiffness_text(c.limit) + " N/m",
                                 yes_or_no(holds), "within 1 %"});
    }
  }
  // A light tool on a stiff wall: only the implicit and exact steps carry it.
  constexpr double kStiffTool = 4;  // k T^2 / m_t, limit of the semi-implicit step
  bool carried = true, lost = true;
  for (const StiffCell& c : cells) {
    if (!c.rotation || c.wall < kStiffTool * c.tool * c.rate_hz * c.rate_hz) continue;
    const bool implicit =
        c.integrator == Integrator::kBackward || c.integrator == Integrator::kExponential;
    (implicit ? carried : lost) &= implicit ? c.limit > 0 : c.limit == 0;
  }
  report.passed = report.passed && carried && lost;
  report.findings.push_back(
      {"light tools in rotation, wall T^2 / m_t from 4 on (down to 1e-6 kg m^2)",
       "stable for backward Euler and matrix exponential, never for the explicit steps",
       std::string(carried ? "stable" : "NOT stable") + ", " + (lost ? "never" : "SOMETIMES"),
       yes_or_no(carried && lost), "some coupling for which the loop is stable"});
}

}  // namespace

PartReport stiff_part(const StabilityOptions& options) {
  const std::vector<StiffCell> cells = all_cells(options);
  PartReport report;
  report.title = "2. Stiff walls, light tools, integrators";
  add_findings(cells, report);
  report.markdown =
      "A virtual tool between device and wall, one axis, exactly discretised (spectral radius). "
      "Device 0.1 kg and 1 N s/m, in rotation 1e-4 kg m^2 and 1e-3 N m s; no hand; damping ratio "
      "of the coupling 0.7.\n\nThe tool alone, largest k_s T^2 / m_t:\n\n" +
      alone_table() + "\nLargest stable coupling (N/m) by wall (N/m):\n\n" +
      coupled_table(cells, false) + "\nIn rotation (N m/rad), wall at a lever of 15 mm:\n\n" +
      coupled_table(cells, true) + "\n" +
      picture_line("stiff.svg", "Largest stable coupling over the wall's stiffness");
  report.files = {{"stiff.csv", csv_of(cells)},
                  {"stiff.md", "# " + report.title + "\n\n" + report.markdown},
                  {"stiff.svg", picture(cells)}};
  return report;
}

}  // namespace haptic::sim
