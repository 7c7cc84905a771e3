// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/faults/fault_report.hpp"

#include <algorithm>

#include "host_sim/lab/faults/fault_picture.hpp"

namespace haptic::sim {
namespace {

std::string csv_of(const std::vector<FaultVerdict>& verdicts) {
  std::string csv =
      "fault,state,holds,output,handed_before_n,handed_after_n,acting_before_n,acting_after_n,"
      "largest_n,limit_share,send_share,acting_share,dip_n,device_cuts,zero_after_s,zero_within_s,"
      "latched,reported,ramp_in_s,recovered_n,failures\n";
  for (const FaultVerdict& v : verdicts) {
    const FaultFigures& f = v.found;
    std::string why;
    for (const std::string& failure : v.failures) why += (why.empty() ? "" : "; ") + failure;
    csv += std::string(v.cell.fault->name) + "," + to_text(v.cell.state) + "," +
           yes_or_no(v.failures.empty()) + "," + to_text(v.expected.output) + ",";
    for (const double value :
         {f.handed_before_n, f.handed_after_n, f.acting_before_n, f.acting_after_n, f.largest_n,
          f.limit_share, f.send_share, f.acting_share, f.dip_n})
      csv += fixed(value, 5) + ",";
    csv += std::to_string(f.cuts) + "," + (f.zero_after_s < 0 ? "" : fixed(f.zero_after_s, 4)) +
           "," + fixed(v.expected.zero_within_s, 4) + "," + safety_fault_names(f.safety) + "," +
           device_fault_names(f.device) + "," + fixed(f.ramp_in_s, 4) + "," +
           fixed(f.recovered_n, 5) + ",\"" + why + "\"\n";
  }
  return csv;
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
    row.front() = fault->name;
    for (; k < verdicts.size() && verdicts[k].cell.fault == fault; ++k) {
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
      ". A cube of 20 mm is pressed on a wall by a simulated hand through the whole stack; virtual "
      "time, same bits each time. At each fault 300 ms are watched, then the cause is taken away, "
      "the deadman released and pressed again.\n\n";
  page += table_head({"stated for every cell", "limit", "largest found"});
  page += table_row({"change of force from one command to the next",
                     fixed(static_cast<double>(limits.slew_n_per_s), 0) + " N/s",
                     fixed(send, 4) + " of it"});
  page += table_row({"change of what acts on the hand, except for the device's own cuts",
                     fixed(static_cast<double>(limits.slew_n_per_s), 0) + " N/s",
                     fixed(acting, 4) + " of it"});
  page +=
      table_row({"ramp in after arming again", "50 ms at least", fixed(1e3 * ramp_s, 0) + " ms"});
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
      failures += "- " + std::string(v.cell.fault->name) + ", " + to_text(v.cell.state) + ": " +
                  failure + "\n";
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
