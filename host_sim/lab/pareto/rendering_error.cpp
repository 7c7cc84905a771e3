// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/pareto/rendering_error.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host_sim/lab/peers/core_peer.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"
#include "host_sim/report/quantile.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/shapes/contact_case.hpp"

namespace haptic::sim {
namespace {

struct TickWrench {
  Vector force_n, torque_nm;
};

struct RenderingRun {
  std::vector<TickWrench> wrenches;
  std::vector<double> ns;
  double worst_gap_m = std::numeric_limits<double>::max();
  std::uint64_t heap_calls = 0;
};

/// Runs a case once; `substeps` of each tick, of which the last one's wrench is kept.
RenderingRun run_case(const ContactCase& contact, CoreSession& session, std::uint32_t substeps,
                      const MeasurePlan& plan, const TickClock& clock) {
  session.core().reset();
  const auto ticks = static_cast<std::size_t>(std::lround(contact.path.duration_s * 1e3));
  const auto approach = static_cast<std::size_t>(std::lround(contact.path.approach_s * 1e3));
  const PathPose first = contact.path.pose(0);
  RenderingRun run;
  StepInput input;
  for (std::size_t k = 0; k <= (approach + ticks) * substeps; ++k) {
    const double tick = static_cast<double>(k) / substeps;
    const double into = tick - static_cast<double>(approach);
    PathPose device = into < 0 ? first : contact.path.pose(into * 1e-3);
    if (into < 0) device.p += -into / static_cast<double>(approach) * contact.path.retreat_w;
    input.sequence = k;
    input.stamp_ns = std::llround(tick * 1e6);
    input.pose_wa = pose_at(device.p, device.q);
    const std::uint64_t heap = plan.heap_calls != nullptr ? plan.heap_calls() : 0;
    StepResult result;
    const double ns = clock.ns_of([&] { result = session.core().step(input); });
    if (plan.heap_calls != nullptr) run.heap_calls += plan.heap_calls() - heap;
    if (into < 0 || k % substeps != 0) continue;
    run.ns.push_back(ns);
    run.wrenches.push_back(
        {result.wrench_w.force_w.cast<double>(), result.wrench_w.torque_w.cast<double>()});
    run.worst_gap_m = std::min(run.worst_gap_m, static_cast<double>(result.proxy_gap_m));
  }
  return run;
}

RenderingRow measure_setting(const ContactCase& contact, std::uint32_t passes, double tolerance_m,
                             const RenderingRun& reference, const MeasurePlan& plan,
                             const TickClock& clock) {
  CoupledScene scene = contact.scene;
  scene.passes = passes;
  scene.tolerance_m = tolerance_m;
  CoreSession session(compiled(scene, LawId::kProxy), contact.name);
  RenderingRun best;
  for (std::uint32_t repeat = 0; repeat < std::max(1u, plan.passes); ++repeat) {
    RenderingRun run = run_case(contact, session, 1, plan, clock);
    if (repeat > 0) {
      for (std::size_t k = 0; k < run.ns.size(); ++k) run.ns[k] = std::min(run.ns[k], best.ns[k]);
    }
    best = std::move(run);
  }
  RenderingRow row;
  row.contact = contact.name;
  row.scalar = kRealName;
  row.passes = passes;
  row.tolerance_m = tolerance_m;
  row.ticks = best.ns.size();
  row.worst_gap_m = best.worst_gap_m;
  row.heap_calls = plan.heap_calls == nullptr
                       ? std::numeric_limits<double>::quiet_NaN()
                       : static_cast<double>(best.heap_calls) / static_cast<double>(row.ticks);
  std::vector<double> errors;
  for (std::size_t k = 0; k < best.wrenches.size(); ++k) {
    const TickWrench& l = best.wrenches[k];
    const TickWrench& r = reference.wrenches[k];
    errors.push_back((l.force_n - r.force_n).norm());
    row.max_torque_error_nm = std::max(row.max_torque_error_nm, (l.torque_nm - r.torque_nm).norm());
  }
  std::sort(errors.begin(), errors.end());
  std::sort(best.ns.begin(), best.ns.end());
  row.median_ns = quantile(best.ns, 0.5);
  row.p99_ns = quantile(best.ns, 0.99);
  row.max_ns = best.ns.back();
  row.median_force_error_n = quantile(errors, 0.5);
  row.p99_force_error_n = quantile(errors, 0.99);
  row.max_force_error_n = errors.back();
  return row;
}

std::vector<ContactCase> rendering_contacts(bool quick) {
  std::vector<ContactCase> contacts;
  contacts.push_back(tilt_case());
  contacts.push_back(roll_case());
  if (!quick) contacts.push_back(edge_case());
  if (!quick) contacts.push_back(seam_case(0.1, 0.02, false));
  contacts.push_back(insertion_case(1e-4));
  return contacts;
}

}  // namespace

std::vector<RenderingRow> measure_rendering(const MeasurePlan& plan, const TickClock& clock,
                                            bool quick) {
  struct Setting {
    std::uint32_t passes;
    double tolerance_m;
  };
  constexpr Setting kSettings[] = {{1, 0}, {2, 0}, {3, 0}, {5, 0}, {3, 1e-8}, {3, 1e-6}};
  std::vector<RenderingRow> rows;
  for (const ContactCase& contact : rendering_contacts(quick)) {
    CoupledScene exact = contact.scene;
    exact.passes = kReferencePasses;
    CoreSession session(compiled(exact, LawId::kProxy), contact.name);
    const RenderingRun reference = run_case(contact, session, kReferenceSubsteps, plan, clock);
    for (const Setting& s : kSettings)
      rows.push_back(measure_setting(contact, s.passes, s.tolerance_m, reference, plan, clock));
  }
  return rows;
}

ReportTable rendering_table(const std::vector<RenderingRow>& rows) {
  ReportTable table(
      "contact,passes,tolerance_m,scalar,ticks,median_ns,p99_ns,max_ns,median_force_error_n,"
      "p99_force_error_n,max_force_error_n,max_torque_error_nm,worst_gap_m,heap_calls");
  for (const RenderingRow& r : rows) {
    table.add({r.contact, r.passes, r.tolerance_m, r.scalar, r.ticks, r.median_ns, r.p99_ns,
               r.max_ns, r.median_force_error_n, r.p99_force_error_n, r.max_force_error_n,
               r.max_torque_error_nm, r.worst_gap_m, shown_as("%.17g", r.heap_calls)});
  }
  return table;
}

std::string rendering_plot(const std::vector<RenderingRow>& rows) {
  constexpr double kWidth = 250, kHeight = 220, kLeft = 70, kTop = 60, kGap = 70;
  constexpr double kLeastError_n = 1e-12;
  std::vector<std::string> contacts;
  for (const RenderingRow& row : rows) {
    if (contacts.empty() || contacts.back() != row.contact) contacts.push_back(row.contact);
  }
  std::string content;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const LogPanel panel{kLeft + static_cast<double>(c) * (kWidth + kGap),
                         kTop,
                         kWidth,
                         kHeight,
                         1e2,
                         1e5,
                         kLeastError_n,
                         1e1};
    content += log_panel_frame(panel, contacts[c], "time of one tick, median",
                               c == 0 ? "force error, p99 (N)" : "", 3);
    std::vector<Pixel> line;
    for (const RenderingRow& row : rows) {
      if (row.contact != contacts[c]) continue;
      const double x = panel.x_of(row.median_ns);
      const double y = panel.y_of(std::max(row.p99_force_error_n, kLeastError_n));
      content +=
          mark_at(x, y, row.tolerance_m > 0 ? MarkSign{"#b35806", 'x'} : MarkSign{"#1f5fa8", 'o'});
      if (row.tolerance_m > 0) continue;
      line.push_back({x, y});
      content += text_at(x + 7, y - 5, std::to_string(row.passes), "start", 11);
    }
    content += polyline_of(line, "#1f5fa8", 1);
  }
  content +=
      text_at(kLeft, 24,
              "Proxy law: circles 1, 2, 3, 5 passes; crosses three passes with a tolerance of "
              "10 nm and 1 um. Reference: 20 passes, quarter steps.",
              "start", 13);
  return svg_document(kLeft + static_cast<double>(contacts.size()) * (kWidth + kGap),
                      kTop + kHeight + 60, content);
}

}  // namespace haptic::sim
