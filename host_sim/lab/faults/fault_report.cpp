// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/faults/fault_matrix.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"

namespace haptic::sim {

namespace {

// The picture: force against time, one row per course that it takes, one curve per state.

constexpr double kMargin = 60, kHead = 150, kPlotWidth = 340, kPlotHeight = 110;
constexpr double kPairGap = 46, kRowGap = 30, kTitleLine = 17;
constexpr double kBefore_s = 0.02, kAfter_s = 0.13, kHigh_n = 13.0;

/// Where states lie on each other the later ones are drawn finer.
struct StateStyle {
  const char* colour;
  double width;
};
constexpr StateStyle kStyles[] = {{"#bbbbbb", 6.0}, {"#8c6d31", 5.0}, {"#9467bd", 4.2},
                                  {"#2ca02c", 2.0}, {"#17becf", 3.4}, {"#d62728", 2.4},
                                  {"#e377c2", 2.6}, {"#1f77b4", 1.6}, {"#404040", 1.2}};
static_assert(std::size(kStyles) == static_cast<std::size_t>(FaultState::kCount));

const StateStyle& style_of(FaultState state) { return kStyles[static_cast<std::size_t>(state)]; }

/// Force by time about the fault.
struct ForceCurve {
  std::vector<double> t_s, force_n;
};

ForceCurve curve_of(const FaultTrace& trace, bool handed) {
  ForceCurve out;
  double last_n = 0;
  for (std::size_t k = 0; k < trace.samples.size(); ++k) {
    const FaultSample& sample = trace.samples[k];
    // The last sample without the fault is at 0.
    const double t_s =
        (static_cast<double>(k + 1) - static_cast<double>(trace.injected)) * trace.period_s;
    // A command stays until the next one, but not on a bus without a device.
    if (sample.link == LinkState::kAbsent) last_n = 0;
    if (!sample.sent.empty()) last_n = sample.sent.back().wrench.force_w.norm();
    if (t_s < -kBefore_s || t_s > kAfter_s) continue;
    out.t_s.push_back(t_s);
    out.force_n.push_back(handed ? last_n : sample.acting.force_w.norm());
  }
  return out;
}

bool ever_has_force(const FaultVerdict& verdict) {
  return std::ranges::any_of(std::array{true, false}, [&](bool handed) {
    return std::ranges::any_of(curve_of(verdict.trace, handed).force_n,
                               [](double f) { return f > 0; });
  });
}

std::string panel_of(double left, double top, std::span<const FaultVerdict> row, bool handed) {
  const Panel panel{left, top, kPlotWidth, kPlotHeight, -kBefore_s, kAfter_s, 0, kHigh_n};
  std::string svg;
  for (const double t : {0.0, 0.05, 0.1}) {
    svg += line_at({panel.x_of(t), top}, {panel.x_of(t), top + kPlotHeight}, "#e4e4e4", 1);
    svg += text_at(panel.x_of(t), top + kPlotHeight + 13, mark_label(1e3 * t, 50) + " ms", "middle",
                   11);
  }
  for (const double force_n : {0.0, 5.0, 10.0}) {
    svg += line_at({left, panel.y_of(force_n)}, {left + kPlotWidth, panel.y_of(force_n)}, "#e4e4e4",
                   1);
    svg += text_at(left - 5, panel.y_of(force_n) + 4, mark_label(force_n, 5) + " N", "end", 11);
  }
  svg += line_at({panel.x_of(0), top}, {panel.x_of(0), top + kPlotHeight}, "#000000", 1, "3 2");
  for (const FaultVerdict& v : row) {
    if (!ever_has_force(v)) continue;
    const ForceCurve c = curve_of(v.trace, handed);
    svg +=
        curve(panel, c.t_s, c.force_n, style_of(v.cell.state).colour, style_of(v.cell.state).width);
  }
  svg += panel_box(panel);
  return svg;
}

std::string legend_of(std::span<const FaultVerdict> verdicts) {
  std::vector<FaultState> states;
  for (const FaultVerdict& v : verdicts) {
    if (std::find(states.begin(), states.end(), v.cell.state) == states.end() && ever_has_force(v))
      states.push_back(v.cell.state);
  }
  std::sort(states.begin(), states.end());
  std::string svg;
  double x = kMargin;
  for (const FaultState state : states) {
    svg += line_at({x, 98}, {x + 26, 98}, style_of(state).colour, style_of(state).width);
    const std::string name = to_text(state);
    svg += text_at(x + 32, 102, name, "start", 13);
    x += 54 + 8 * static_cast<double>(name.size());
  }
  return svg;
}

using FaultRow = std::span<const FaultVerdict>;  ///< one fault, by state

/// Two courses that one panel can stand for differ by less than the width of a curve: in force, or
/// by this many samples in time.
constexpr double kSameForce_n = 0.25;
constexpr std::size_t kSameSamples = 2;

bool follows(const ForceCurve& l, const ForceCurve& r) {
  if (l.t_s.size() != r.t_s.size()) return false;
  for (std::size_t k = 0; k < l.t_s.size(); ++k) {
    const std::size_t first = k - std::min(k, kSameSamples);
    const std::size_t count = std::min(r.force_n.size(), k + kSameSamples + 1) - first;
    const std::span<const double> near = std::span(r.force_n).subspan(first, count);
    const auto [least, most] = std::ranges::minmax(near);
    if (l.force_n[k] < least - kSameForce_n || l.force_n[k] > most + kSameForce_n) return false;
  }
  return true;
}

bool same_course(const FaultTrace& l, const FaultTrace& r) {
  return std::ranges::all_of(std::array{true, false}, [&](bool handed) {
    const ForceCurve a = curve_of(l, handed), b = curve_of(r, handed);
    return follows(a, b) && follows(b, a);
  });
}

bool same_courses(FaultRow l, FaultRow r) {
  return std::ranges::equal(l, r, [](const FaultVerdict& a, const FaultVerdict& b) {
    return a.cell.state == b.cell.state && same_course(a.trace, b.trace);
  });
}

/// Faults whose force takes the same course, by the first of them. `verdicts` in the order of
/// run_fault_matrix.
std::vector<std::vector<FaultRow>> courses_of(const std::vector<FaultVerdict>& verdicts) {
  std::vector<std::vector<FaultRow>> courses;
  for (std::size_t k = 0, end = 0; k < verdicts.size(); k = end) {
    while (end < verdicts.size() && verdicts[end].cell.fault == verdicts[k].cell.fault) ++end;
    const FaultRow row(verdicts.data() + k, end - k);
    const auto like = std::ranges::find_if(
        courses, [&](const auto& course) { return same_courses(course.front(), row); });
    if (like != courses.end()) {
      like->push_back(row);
    } else {
      courses.push_back({row});
    }
  }
  return courses;
}

/// Names of the faults of a panel, in lines that fit above it.
std::vector<std::string> title_of(const std::vector<FaultRow>& course) {
  constexpr std::size_t kLineLetters = 92;
  std::vector<std::string> lines(1);
  for (std::size_t k = 0; k < course.size(); ++k) {
    const std::string name =
        course[k].front().cell.fault->name + std::string(k + 1 < course.size() ? "," : "");
    if (!lines.back().empty() && lines.back().size() + 1 + name.size() > kLineLetters)
      lines.emplace_back();
    lines.back() += (lines.back().empty() ? "" : " ") + name;
  }
  return lines;
}

/// Left what was handed to the bus, right what acted at the device, a row for each course that the
/// force takes.
std::string fault_picture(const std::vector<FaultVerdict>& verdicts) {
  const std::vector<std::vector<FaultRow>> courses = courses_of(verdicts);
  const SafetyLimits limits = reference_stack(StackCarrier::kDirect).limits;
  const double slew_n_per_ms = 1e-3 * static_cast<double>(limits.slew_n_per_s);
  std::string svg =
      text_at(kMargin, 32, "Courses of the force", "start", 20, "font-weight=\"bold\"");
  svg += text_at(kMargin, 56,
                 "|F| against time; dashed: the fault. Faults with the same course share a row, "
                 "states without force are left out.",
                 "start", 13);
  svg += text_at(kMargin, 74,
                 "faults.md has every cell. Slew limit " + mark_label(slew_n_per_ms, 1) +
                     " N per ms: nothing but the device's own cut is steeper.",
                 "start", 13);
  svg += legend_of(verdicts);
  const double right = kMargin + kPlotWidth + kPairGap;
  svg += text_at(kMargin, kHead - 12, "handed to the bus", "start", 13, "font-style=\"italic\"");
  svg += text_at(right, kHead - 12, "acting at the device", "start", 13, "font-style=\"italic\"");
  double top = kHead;
  for (const std::vector<FaultRow>& course : courses) {
    for (const std::string& line : title_of(course)) {
      top += kTitleLine;
      svg += text_at(kMargin, top, line, "start", 13, "font-weight=\"bold\"");
    }
    top += 8;
    svg += panel_of(kMargin, top, course.front(), true);
    svg += panel_of(right, top, course.front(), false);
    top += kPlotHeight + kRowGap;
  }
  return svg_document(right + kPlotWidth + kMargin, top, svg);
}

/// The fault, and at whose device where there are two.
std::string place_of(const FaultVerdict& v) {
  return std::string(v.cell.fault->name) + (v.hand > 0 ? " (second hand)" : "");
}

std::string csv_of(const std::vector<FaultVerdict>& verdicts) {
  ReportTable table(
      "fault,state,holds,output,handed_before_n,handed_after_n,acting_before_n,acting_after_n,"
      "largest_n,limit_share,send_share,acting_share,dip_n,device_cuts,zero_after_s,zero_within_s,"
      "latched,reported,ramp_in_s,recovered_n,failures");
  for (const FaultVerdict& v : verdicts) {
    const FaultFigures& f = v.found;
    table.add({place_of(v),
               to_text(v.cell.state),
               yes_or_no(v.failures.empty()),
               to_text(v.expected.output),
               fixed(f.handed_before_n, 5),
               fixed(f.handed_after_n, 5),
               fixed(f.acting_before_n, 5),
               fixed(f.acting_after_n, 5),
               fixed(f.largest_n, 5),
               fixed(f.limit_share, 5),
               fixed(f.send_share, 5),
               fixed(f.acting_share, 5),
               fixed(f.dip_n, 5),
               f.cuts,
               f.zero_after_s < 0 ? "" : fixed(f.zero_after_s, 4),
               fixed(v.expected.zero_within_s, 4),
               safety_fault_names(f.safety),
               device_fault_names(f.device),
               fixed(f.ramp_in_s, 4),
               fixed(f.recovered_n, 5),
               quoted(joined(v.failures))});
  }
  return table.csv();
}

/// What happened to the force in a cell, in a word or two.
std::string cell_text(const FaultVerdict& v) {
  if (!v.failures.empty()) return "**FAILS**";
  const FaultFigures& f = v.found;
  if (f.cuts > 0) return "cut " + fixed(1e3 * f.zero_after_s, 0) + " ms";
  if (f.acting_before_n == 0 && f.acting_after_n == 0) return "0";
  if (f.zero_after_s >= 0) return "0 in " + fixed(1e3 * f.zero_after_s, 0) + " ms";
  return fixed(f.acting_after_n, 1) + " N";
}

std::string matrix_of(const std::vector<FaultVerdict>& verdicts) {
  std::vector<std::string> head{"fault"};
  std::vector<FaultState> states;
  for (const FaultVerdict& v : verdicts) {
    if (std::find(states.begin(), states.end(), v.cell.state) != states.end()) continue;
    states.push_back(v.cell.state);
  }
  std::sort(states.begin(), states.end());
  for (const FaultState state : states) head.emplace_back(to_text(state));
  std::string table = table_head(head);
  for (std::size_t k = 0; k < verdicts.size();) {
    const Fault* fault = verdicts[k].cell.fault;
    std::vector<std::string> row(states.size() + 1);
    const std::size_t hand = verdicts[k].hand;
    row.front() = place_of(verdicts[k]);
    for (; k < verdicts.size() && verdicts[k].cell.fault == fault && verdicts[k].hand == hand;
         ++k) {
      const auto at = std::find(states.begin(), states.end(), verdicts[k].cell.state);
      row[static_cast<std::size_t>(at - states.begin()) + 1] = cell_text(verdicts[k]);
    }
    table += table_row(row);
  }
  return table;
}

std::string page_of(const std::vector<FaultVerdict>& verdicts, const FaultMatrixOptions& options) {
  const SafetyLimits limits = reference_stack(options.run.carrier).limits;
  const auto held = std::count_if(verdicts.begin(), verdicts.end(),
                                  [](const FaultVerdict& v) { return v.failures.empty(); });
  double send = 0, acting = 0, ramp_s = 1e9;
  for (const FaultVerdict& v : verdicts) {
    send = std::max(send, v.found.send_share);
    acting = std::max(acting, v.found.acting_share);
    ramp_s = std::min(ramp_s, v.found.ramp_in_s);
  }
  std::string page =
      "# Every fault in every state\n\nMade by `host_sim faults`" +
      std::string(options.quick ? " with `--quick`" : "") + ": carrier " +
      (options.run.carrier == StackCarrier::kUsb ? "usb" : "direct") +
      (options.run.hands > 1
           ? std::string(
                 ". Two hands press a cube of 20 mm each on a wall through the whole stack, "
                 "and the fault is at the device of one; the other must feel nothing of it "
                 "where it is not a fault of both. Virtual ")
           : std::string(". A cube of 20 mm is pressed on a wall by a simulated hand through the "
                         "whole stack; virtual ")) +
      "time, same bits each time. At each fault 300 ms are watched, then the cause is taken away, "
      "the deadman released and pressed again.\n\n";
  page += table_head({"stated for every cell", "limit", "largest found"});
  page += table_row({"change of force from one command to the next",
                     fixed(static_cast<double>(limits.slew_n_per_s), 0) + " N/s",
                     fixed(send, 4) + " of it"});
  page += table_row({"change of what acts on the hand, except for the device's own cuts",
                     fixed(static_cast<double>(limits.slew_n_per_s), 0) + " N/s",
                     fixed(acting, 4) + " of it"});
  if (options.run.hands == 1) {
    page +=
        table_row({"ramp in after arming again", "50 ms at least", fixed(1e3 * ramp_s, 0) + " ms"});
  }
  page += table_row({"cells that hold", std::to_string(verdicts.size()), std::to_string(held)});
  page +=
      "\nWhere a command did not arrive, the change counts from the last that did, and as much "
      "of the time since as is below 5 ms.\n\n## Expected\n\n" +
      failure_semantics() +
      "\n## Found\n\nForce on the hand after 300 ms, or the time until there was "
      "none.\n\n" +
      matrix_of(verdicts) + "\n" +
      picture_line("faults.svg", "force handed to the bus and force at the device");
  std::string failures;
  for (const FaultVerdict& v : verdicts) {
    for (const std::string& failure : v.failures)
      failures += "- " + place_of(v) + ", " + to_text(v.cell.state) + ": " + failure + "\n";
  }
  if (!failures.empty()) page += "\n## Cells that fail\n\n" + failures;
  return page;
}

}  // namespace

std::vector<OutputText> fault_files(const std::vector<FaultVerdict>& verdicts,
                                    const FaultMatrixOptions& options) {
  return {{"faults.csv", csv_of(verdicts)},
          {"faults.md", page_of(verdicts, options)},
          {"faults.svg", fault_picture(verdicts)}};
}

}  // namespace haptic::sim
