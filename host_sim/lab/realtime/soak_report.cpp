// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/realtime/soak_run.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"

namespace haptic::sim {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kSoakWidth = 1200, kSoakLeft = 90, kPlotWidth = 1070, kHeight = 860;
constexpr double kMega = 1024.0 * 1024;
constexpr const char *kForce = "#0072b2", *kHolds = "#009e73", *kFails = "#d55e00",
                     *kSpoiled = "#e69f00", *kHeap = "#cc79a7";

std::string samples_csv(const SoakAccount& account) {
  ReportTable table("t_s,resident_bytes,heap_bytes,descriptors,threads,force_n,late_ms");
  for (const SoakSample& s : account.samples) {
    table.add({fixed(s.t_s, 3), s.process.resident_bytes, s.process.heap_bytes,
               s.process.descriptors, s.process.threads, fixed(s.force_n, 4),
               fixed(1e-6 * static_cast<double>(s.late_ns), 3)});
  }
  return table.csv();
}

std::string faults_csv(const SoakAccount& account) {
  ReportTable table(
      "t_s,fault,state,holds,runs,late_ms,acting_before_n,acting_after_n,largest_n,send_share,"
      "zero_after_s,latched,reported,ramp_in_s,recovered_n,failures");
  for (const SoakCell& c : account.cells) {
    const FaultFigures& f = c.found;
    table.add({fixed(c.t_s, 3), c.cell.fault->name, to_text(c.cell.state),
               yes_or_no(c.failures.empty()), c.runs,
               fixed(1e-6 * static_cast<double>(c.late_ns), 3), fixed(f.acting_before_n, 4),
               fixed(f.acting_after_n, 4), fixed(f.largest_n, 4), fixed(f.send_share, 4),
               f.zero_after_s < 0 ? "" : fixed(f.zero_after_s, 4), safety_fault_names(f.safety),
               device_fault_names(f.device), fixed(f.ramp_in_s, 4), fixed(f.recovered_n, 4),
               quoted(joined(c.failures))});
  }
  return table.csv();
}

Json json_of(const SoakLevel& level) {
  return {{"reference", level.reference},
          {"least", level.least},
          {"largest", level.largest},
          {"tolerance", level.tolerance}};
}

std::string account_json(const std::string& scene, const SoakSettings& settings,
                         const SoakAccount& a) {
  Json json;
  json["scene"] = scene;
  json["time"] = settings.virtual_time ? "virtual" : "real";
  json["minutes"] = settings.minutes;
  json["wall_s"] = a.wall_s;
  json["faults"] = a.cells.size();
  json["answered_as_stated"] = std::count_if(a.cells.begin(), a.cells.end(),
                                             [](const SoakCell& c) { return c.failures.empty(); });
  json["runs_spoiled_by_the_machine"] = a.repeated;
  json["latched_by_the_machine_between_faults"] = a.machine_faults;
  json["largest_lateness_ms"] = 1e-6 * static_cast<double>(a.largest_late_ns);
  json["heap_in_use_bytes"] = json_of(a.heap);
  json["resident_bytes"] = json_of(a.resident);
  json["descriptors"] = json_of(a.descriptors);
  json["threads"] = json_of(a.threads);
  if (!settings.virtual_time) {
    json["heap_calls_of_servo_thread"] = a.servo_heap_calls;
    json["heap_calls_of_usb_thread_beside_libusb"] = a.usb_heap_calls;
    json["refused"] = {{"servo_priority", a.grants.servo_priority},
                       {"usb_priority", a.grants.usb_priority},
                       {"device_priority", a.grants.device_priority},
                       {"memory_lock", a.grants.memory_lock},
                       {"idle_states", a.grants.idle_states}};
  }
  json["failures"] = a.failures;
  json["passed"] = a.failures.empty();
  return json.dump(2) + "\n";
}

Panel panel_at(double top, double height, double end_s, double high) {
  return {kSoakLeft, top, kPlotWidth, height, 0, end_s, 0, high > 0 ? 1.1 * high : 1};
}

std::string force_panel(const SoakAccount& account, double end_s) {
  std::vector<double> times, force;
  double high = 0;
  const double step_s =
      end_s / static_cast<double>(std::max<std::size_t>(1, account.force_n.size()));
  for (std::size_t k = 0; k < account.force_n.size(); ++k) {
    times.push_back(step_s * static_cast<double>(k));
    force.push_back(static_cast<double>(account.force_n[k]));
    high = std::max(high, force.back());
  }
  const Panel panel = panel_at(90, 300, end_s, high);
  std::string svg = panel_frame(panel, "|force| acting (N)", false);
  svg += curve(panel, times, force, kForce, 1.0);
  for (const SoakCell& c : account.cells) {
    const double x = panel.x_of(c.t_s);
    const char* colour = !c.failures.empty() ? kFails : c.runs > 1 ? kSpoiled : kHolds;
    svg += "<path d=\"M" + pixel(x - 4) + " 78L" + pixel(x + 4) + " 78L" + pixel(x) +
           " 88Z\" fill=\"" + colour + "\"/>\n";
  }
  return svg;
}

std::string level_panel(const SoakAccount& account, double top, double end_s, const char* label,
                        bool last, const char* colour, double (*of)(const SoakSample&)) {
  std::vector<double> times, values;
  double high = 0;
  for (const SoakSample& s : account.samples) {
    times.push_back(s.t_s);
    values.push_back(of(s));
    high = std::max(high, values.back());
  }
  const Panel panel = panel_at(top, 90, end_s, high);
  return panel_frame(panel, label, last) + curve(panel, times, values, colour, 1.6);
}

std::string picture(const SoakSettings& settings, const SoakAccount& a) {
  const double end_s = a.samples.empty() ? 1 : a.samples.back().t_s;
  std::string svg =
      heading_at(kSoakLeft, 30, "Soak: a fault every " + mark_label(settings.every_s, 1) + " s");
  svg += text_at(kSoakLeft, 54,
                 std::string("Marks: a fault, answered as stated (green), so in a repeated run "
                             "(yellow), otherwise (red). Time: ") +
                     (settings.virtual_time ? "virtual." : "real."),
                 "start", 13);
  svg += force_panel(a, end_s);
  svg += level_panel(a, 410, end_s, "resident (MiB)", false, kForce, [](const SoakSample& s) {
    return static_cast<double>(s.process.resident_bytes) / kMega;
  });
  svg += level_panel(a, 520, end_s, "heap in use (MiB)", false, kHeap, [](const SoakSample& s) {
    return static_cast<double>(s.process.heap_bytes) / kMega;
  });
  svg += level_panel(a, 630, end_s, "descriptors", settings.virtual_time, kHolds,
                     [](const SoakSample& s) { return double{1} * s.process.descriptors; });
  if (!settings.virtual_time) {
    svg += level_panel(a, 740, end_s, "lateness (ms)", true, kFails,
                       [](const SoakSample& s) { return 1e-6 * static_cast<double>(s.late_ns); });
  }
  const double height = settings.virtual_time ? kHeight - 110 : kHeight;
  svg += text_at(kSoakLeft + kPlotWidth, height - 4, "time of the device (s)", "end", 13);
  return svg_document(kSoakWidth, height, svg);
}

}  // namespace

std::vector<OutputText> soak_files(const std::string& scene, const SoakSettings& settings,
                                   const SoakAccount& account) {
  return {{"soak.csv", samples_csv(account)},
          {"soak_faults.csv", faults_csv(account)},
          {"soak.json", account_json(scene, settings, account)},
          {"soak.svg", picture(settings, account)}};
}

}  // namespace haptic::sim
