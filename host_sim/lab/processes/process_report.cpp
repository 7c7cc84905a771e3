// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/processes/process_matrix.hpp"
#include "host_sim/report/picture.hpp"

namespace haptic::sim {
namespace {

constexpr double kPanelWidth = 360, kPanelHeight = 110, kLine = 46, kTop = 70, kSide = 84;
constexpr double kNamesWidth = 620;
constexpr std::size_t kNamesInLine = 90;
constexpr double kShownBefore_s = 0.02, kShownAfter_s = 0.12, kShownMost_n = 12;

std::string name_of(const ProcessVerdict& v) {
  return std::string(to_text(v.cell.fault->victim)) + ": " + v.cell.fault->name;
}

std::string csv_of_processes(const std::vector<ProcessVerdict>& verdicts) {
  ReportTable table(
      "process,fault,state,holds,output,before_n,after_n,largest_step_n,step_share,rise_n,"
      "above_zero_ms,device_late_ms,oldest_ms,dated,understated_n,stated,scribbled_bytes,"
      "exit_code,events,status,tries,failures");
  for (const ProcessVerdict& v : verdicts) {
    const ProcessFigures& f = v.found;
    table.add({to_text(v.cell.fault->victim),
               quoted(v.cell.fault->name),
               quoted(to_text(v.cell.state)),
               yes_or_no(v.failures.empty()),
               to_text(v.cell.fault->output),
               fixed(f.before_n, 3),
               fixed(f.after_n, 3),
               fixed(f.largest_step_n, 3),
               fixed(f.step_share, 3),
               fixed(f.rise_n, 3),
               fixed(f.above_zero_ms, 1),
               fixed(f.largest_late_ms, 2),
               fixed(f.oldest_ms, 2),
               f.dated,
               fixed(f.understated_n, 3),
               f.stated,
               f.scribbled,
               f.exit_code,
               quoted(joined(v.events)),
               v.status,
               v.tries,
               quoted(joined(v.failures))});
  }
  return table.csv();
}

std::string cell_of(const ProcessVerdict& v) {
  if (!v.failures.empty()) return "**FAILS**";
  const ProcessFigures& f = v.found;
  if (f.before_n < 0.01 && f.after_n < 0.01) return "0";
  if (v.cell.fault->output == ProcessOutput::kGoesOn) return fixed(f.after_n, 1) + " N";
  return fixed(f.largest_step_n, 1) + " N, " + fixed(f.above_zero_ms, 0) + " ms";
}

std::string matrix_of_processes(const std::vector<ProcessVerdict>& verdicts) {
  std::vector<std::string> head{"process", "fault"};
  std::vector<OperatorState> states;
  for (const ProcessVerdict& v : verdicts) {
    if (std::find(states.begin(), states.end(), v.cell.state) == states.end())
      states.push_back(v.cell.state);
  }
  std::sort(states.begin(), states.end());
  for (const OperatorState state : states) head.emplace_back(to_text(state));
  std::string table = table_head(head);
  for (std::size_t k = 0; k < verdicts.size();) {
    const ProcessFault* const fault = verdicts[k].cell.fault;
    std::vector<std::string> row(head.size());
    row[0] = to_text(fault->victim);
    row[1] = fault->name;
    for (; k < verdicts.size() && verdicts[k].cell.fault == fault; ++k) {
      const auto at = std::find(states.begin(), states.end(), verdicts[k].cell.state);
      row[static_cast<std::size_t>(at - states.begin()) + 2] = cell_of(verdicts[k]);
    }
    table += table_row(row);
  }
  return table;
}

std::string told_of(const std::vector<ProcessVerdict>& verdicts) {
  std::string table = table_head({"process", "fault", "events", "status"});
  for (const ProcessVerdict& v : verdicts) {
    if (v.cell.state != OperatorState::kArmedContact) continue;
    table +=
        table_row({to_text(v.cell.fault->victim), v.cell.fault->name, joined(v.events), v.status});
  }
  return table;
}

/// By time about the fault.
struct Course {
  std::vector<double> t_s, force_n;
};

Course acting_in(const ProcessVerdict& v) {
  Course course;
  for (const WirePeriod& p : v.wire.periods) {
    const double t_s = 1e-9 * static_cast<double>(p.stamp_ns - v.fault_ns);
    if (t_s < -kShownBefore_s || t_s > kShownAfter_s) continue;
    course.t_s.push_back(t_s);
    course.force_n.push_back(p.acting_n);
  }
  return course;
}

Course handed_in(const ProcessVerdict& v) {
  Course course;
  for (const WireCommand& c : v.wire.commands) {
    const double t_s = 1e-9 * static_cast<double>(c.stamp_ns - v.fault_ns);
    if (t_s < -kShownBefore_s || t_s > kShownAfter_s) continue;
    // A command stays until the next one.
    if (!course.t_s.empty()) {
      course.t_s.push_back(t_s);
      course.force_n.push_back(course.force_n.back());
    }
    course.t_s.push_back(t_s);
    course.force_n.push_back(c.drives_on ? c.wrench.force_w.norm() : 0);
  }
  return course;
}

/// One curve can stand for both: as shares of the force before (which is lower on a machine that
/// wakes late) they differ by less than its width, or by few milliseconds.
bool are_alike(const ProcessVerdict& left, const ProcessVerdict& right) {
  constexpr std::size_t kNear = 8;
  constexpr double kNearShare = 0.1;
  const Course l = acting_in(left), r = acting_in(right);
  const double l_n = std::max(left.found.before_n, 0.1), r_n = std::max(right.found.before_n, 0.1);
  for (std::size_t k = 0; k < std::min(l.t_s.size(), r.t_s.size()); ++k) {
    const std::size_t first = k - std::min(k, kNear);
    const std::size_t count = std::min(r.force_n.size(), k + kNear + 1) - first;
    const auto [least, most] = std::ranges::minmax(std::span(r.force_n).subspan(first, count));
    const double share = l.force_n[k] / l_n;
    if (share < least / r_n - kNearShare || share > most / r_n + kNearShare) return false;
  }
  return true;
}

struct AlikeCells {
  const ProcessVerdict* shown;
  std::vector<std::string> names;
};

std::string panel_of_process(const ProcessVerdict& v, double top) {
  const Panel panel{kSide,           top,           kPanelWidth, kPanelHeight,
                    -kShownBefore_s, kShownAfter_s, 0,           kShownMost_n};
  std::string svg = panel_frame(panel, "force (N)", true);
  const Course acting = acting_in(v), handed = handed_in(v);
  svg += curve(panel, acting.t_s, acting.force_n, kRegionColour, 4);
  svg += curve(panel, handed.t_s, handed.force_n, kForceColour, 1.5);
  svg += line_at({panel.x_of(0), top}, {panel.x_of(0), top + kPanelHeight}, "#000000", 1, "3 2");
  return svg + panel_box(panel);
}

std::string names_at(const std::vector<std::string>& names, double top) {
  std::string svg, line;
  double y = top + 14;
  for (const std::string& name : names) {
    if (!line.empty() && line.size() + name.size() > kNamesInLine) {
      svg += text_at(kSide + kPanelWidth + 24, y, line, "start", 12);
      y += 17;
      line.clear();
    }
    line += name + "; ";
  }
  return svg + text_at(kSide + kPanelWidth + 24, y, line, "start", 12);
}

/// A row for each course that differs, with the faults that take it.
std::string picture_of_processes(const std::vector<ProcessVerdict>& verdicts) {
  std::vector<AlikeCells> rows;
  for (const ProcessVerdict& v : verdicts) {
    if (v.cell.state != OperatorState::kArmedContact) continue;
    const auto alike = std::find_if(rows.begin(), rows.end(), [&](const AlikeCells& row) {
      return v.cell.fault->output == row.shown->cell.fault->output && are_alike(v, *row.shown);
    });
    if (alike != rows.end()) {
      alike->names.push_back(name_of(v));
    } else {
      rows.push_back({&v, {name_of(v)}});
    }
  }
  std::string svg = heading_at(kSide, 26, "Faults of processes, armed in contact");
  svg += line_at({kSide, 46}, {kSide + 26, 46}, kForceColour, 1.5);
  svg += text_at(kSide + 32, 50, "handed to the device", "start", 12);
  svg += line_at({kSide + 180, 46}, {kSide + 206, 46}, kRegionColour, 4);
  svg += text_at(kSide + 212, 50, "acting on the hand; seconds from the fault", "start", 12);
  double top = kTop + 20;
  for (const AlikeCells& row : rows) {
    svg += panel_of_process(*row.shown, top) + names_at(row.names, top);
    top += kPanelHeight + kLine;
  }
  return svg_document(2 * kSide + kPanelWidth + kNamesWidth, top, svg);
}

}  // namespace

std::vector<OutputText> process_files(const std::vector<ProcessVerdict>& verdicts) {
  double step_n = 0, share = 0, ramp_ms = 0, zero_ms = 0, oldest_ms = 0, understated_n = 0;
  std::size_t held = 0, dated = 0, stated = 0, tries = 0;
  std::string failures;
  for (const ProcessVerdict& v : verdicts) {
    held += v.failures.empty() ? 1u : 0u;
    step_n = std::max(step_n, v.found.largest_step_n);
    share = std::max(share, v.found.step_share);
    oldest_ms = std::max(oldest_ms, v.found.oldest_ms);
    understated_n = std::max(understated_n, v.found.understated_n);
    dated += v.found.dated;
    stated += v.found.stated;
    tries += v.tries;
    if (v.cell.fault->output == ProcessOutput::kRampsToZero)
      ramp_ms = std::max(ramp_ms, v.found.above_zero_ms);
    if (v.cell.fault->output == ProcessOutput::kZeroAtOnce)
      zero_ms = std::max(zero_ms, v.found.above_zero_ms);
    for (const std::string& failure : v.failures)
      failures += "- " + name_of(v) + ", " + to_text(v.cell.state) + ": " + failure + "\n";
  }
  std::string page =
      "# Every fault of every process\n\nMade by `host_lab faults --processes`: run_device itself, "
      "in real time, holds the reference device, which is another process with a simulated hand. "
      "All figures are of what came over the wire there.\n\n";
  page += table_head({"stated for every cell", "largest found"});
  page +=
      table_row({"largest step from one command to the next, but for those that are zero at once",
                 fixed(step_n, 2) + " N, " + fixed(share, 2) +
                     " of what the slew limit allows in two periods"});
  page += table_row({"time above zero, ramps", fixed(ramp_ms, 0) + " ms"});
  page += table_row({"time above zero, at once", fixed(zero_ms, 0) + " ms"});
  page += table_row({"age of a command that changes the force, when the device gets it",
                     fixed(oldest_ms, 2) + " ms, of " + std::to_string(dated)});
  page += table_row({"a status below what the device had, beyond one command",
                     fixed(understated_n, 2) + " N, of " + std::to_string(stated)});
  page += table_row({"runs, with those that the machine spoiled", std::to_string(tries)});
  page +=
      table_row({"cells that hold, of " + std::to_string(verdicts.size()), std::to_string(held)});
  page +=
      "\n## Expected\n\n" + process_semantics() +
      "\n## Found\n\nLargest step and time above zero; force after 600 ms where it goes on.\n\n" +
      matrix_of_processes(verdicts) +
      "\n## Told\n\nEvents within 600 ms from the fault, armed in contact, and the last status "
      "line; nothing where nobody read.\n\n" +
      told_of(verdicts) + "\n" +
      picture_line("processes.svg", "force handed to the device and force on the hand");
  if (!failures.empty()) page += "\n## Cells that fail\n\n" + failures;
  return {{"processes.csv", csv_of_processes(verdicts)},
          {"processes.md", page},
          {"processes.svg", picture_of_processes(verdicts)}};
}

}  // namespace haptic::sim
