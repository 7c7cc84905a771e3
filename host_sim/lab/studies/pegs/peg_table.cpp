// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/pegs/peg_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "host_sim/report/picture.hpp"
#include "host_sim/session/core_session.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/coupling/coupling_choice.hpp"

namespace haptic::sim {
namespace {

constexpr double kPegTick_s = 1e-3;
/// Stiffness where no device bounds it.
constexpr double kPegFace_n_per_m = 1000;
/// A part this far from the hand is held, as a share of its radius.
constexpr double kHeldShare = 1e-3;
/// Forces below are none.
constexpr double kNoForce_n = 1e-3;
constexpr std::size_t kPictures = 4;

/// A device with its limits, as a scene's [device] states them.
PegDevice device_row(const char* name, double force_n, double torque_nm, double stiffness_n_per_m,
                     double rotary_nm_per_rad) {
  PegDevice row{name, {}};
  row.device.given = 1;
  row.device.max_force_n = force_n;
  row.device.max_torque_nm = torque_nm;
  row.device.max_stiffness_n_per_m = stiffness_n_per_m;
  row.device.max_rotary_stiffness_nm_per_rad = rotary_nm_per_rad;
  return row;
}

double median_of(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<std::byte> scene_for(const PegTask& task, const PegDevice& device, LawId law,
                                 double length_share) {
  tools::SceneDescription scene = task.scene;
  SceneParameters& parameters = scene.parameters;
  parameters = tools::default_parameters();
  parameters.k_f_n_per_m = kPegFace_n_per_m;
  parameters.device = device.device;
  // The paper's law is not coupled: its stiffness is the one that the proxy's spring gets.
  parameters.law = LawId::kProxy;
  tools::CouplingRequest request;
  if (length_share > 0 && device.device.given == 0) {
    request.length_m = length_share * task.radius_m;
  }
  parameters.coupling = tools::choose_coupling(parameters, request, task.radius_m).coupling;
  parameters.law = law;
  parameters.k_f_n_per_m = parameters.coupling.k_t_n_per_m;
  return tools::write_scene(scene);
}

Cell law_cell(LawId law) { return law_name(law); }

ReportTable table_of(const std::vector<PegResult>& results) {
  ReportTable table(
      "task,device,law,k_t_n_per_m,k_r_nm_per_rad,force_step_n,torque_step_mnm,median_n,largest_n,"
      "longest_hold_ticks,hold_n,outlasts,plane_gaps_per_tick");
  for (const PegResult& r : results) {
    table.add({r.task, r.device, law_cell(r.law), shown_as("%.4g", r.k_t_n_per_m),
               shown_as("%.4g", r.k_r_nm_per_rad), shown_as("%.4g", r.force_step_n),
               shown_as("%.4g", 1e3 * r.torque_step_nm), shown_as("%.4g", r.median_n),
               shown_as("%.4g", r.largest_n), r.longest_hold, shown_as("%.4g", r.hold_n),
               r.outlasts ? "yes" : "no", shown_as("%.4g", r.plane_gaps)});
  }
  return table;
}

/// Force, torque and distance of one task without a device, a curve per law.
std::string peg_picture(const PegResult& paper, const PegResult& proxy) {
  std::vector<double> times;
  for (const PegRunTick& tick : proxy.ticks) times.push_back(tick.t_s);
  const struct {
    const char* label;
    double PegRunTick::*value;
    double scale;
  } rows[] = {{"|F| (N)", &PegRunTick::force_n, 1},
              {"|T| (mN m)", &PegRunTick::torque_nm, 1e3},
              {"part from hand (mm)", &PegRunTick::off_m, 1e3}};
  std::string body = heading_at(70, 24, proxy.task);
  double top = 50;
  for (const auto& row : rows) {
    std::vector<NamedCurve> curves = {{"paper", kForceColour, {}, 2.5},
                                      {"proxy", kTorqueColour, {}, 1.2}};
    for (const PegRunTick& t : paper.ticks) curves[0].values.push_back(row.scale * (t.*row.value));
    for (const PegRunTick& t : proxy.ticks) curves[1].values.push_back(row.scale * (t.*row.value));
    Panel panel = time_panel(times, 80, top, 780, 170);
    fit_range(panel, curves, 1e-3);
    body += curve_panel(panel, row.label, times, curves, top > 400);
    top += 200;
  }
  return svg_document(1000, top + 20, body);
}

}  // namespace

std::vector<PegDevice> peg_devices() {
  // The reference device (hal/drivers/PROTOCOL.md) states what moves as well.
  PegDevice reference = device_row("reference", 12, 0.3, 0, 0);
  reference.device.mass_kg = 0.1;
  reference.device.damping_ns_per_m = 1;
  std::ranges::fill(reference.device.rotor_inertia_kg_m2, 1e-4);
  std::ranges::fill(reference.device.rotor_damping_nms_per_rad, 1e-3);
  reference.device.encoder_step_m = 1e-6;
  reference.device.encoder_step_rad = 1e-5;
  // The others as CHAI3D lists them (CDeltaDevices.cpp, CPhantomDevices.cpp), without their mass.
  return {{"none", {}},
          reference,
          device_row("falcon", 8, 0, 3000, 0),
          device_row("sigma_7", 12, 0.2, 4000, 1),
          device_row("premium_15", 8.5, 0.188, 800, 0.3)};
}

PegResult run_peg_task(const PegTask& task, const PegDevice& device, LawId law,
                       double length_share) {
  const std::vector<std::byte> scene = scene_for(task, device, law, length_share);
  CoreSession session(scene, task.name);
  const CouplingParameters& coupling = session.view().parameters().coupling;
  PegResult run;
  run.task = task.name;
  run.device = device.name;
  run.law = law;
  run.k_t_n_per_m = coupling.k_t_n_per_m;
  run.k_r_nm_per_rad = coupling.k_r_nm_per_rad;
  const auto ticks = static_cast<std::uint32_t>(std::lround(duration_s(task) / kPegTick_s));
  Vector last_force = Vector::Zero(), last_torque = Vector::Zero();
  std::uint32_t hold = 0;
  std::vector<double> forces_n;
  for (std::uint32_t k = 0; k <= ticks; ++k) {
    const PathPose hand = hand_of(task, k * kPegTick_s);
    StepInput input;
    input.sequence = k;
    input.stamp_ns = static_cast<std::int64_t>(k) * 1000000;
    input.pose_wa = pose_at(hand.p, hand.q);
    input.report_goal_contact = true;
    const StepResult result = session.core().step(input);
    if (result.status != RtStatus::kOk)
      throw tools::InputError(task.name + ": a pose is refused: " + to_text(result.status));
    const Vector force = result.wrench_w.force_w.cast<double>();
    const Vector torque = result.wrench_w.torque_w.cast<double>();
    if (k > 0) {
      run.force_step_n = std::max(run.force_step_n, (force - last_force).norm());
      run.torque_step_nm = std::max(run.torque_step_nm, (torque - last_torque).norm());
    }
    last_force = force;
    last_torque = torque;
    PegRunTick tick{k * kPegTick_s, force.norm(), torque.norm(), 0, false};
    const Rotation q = result.proxy_pose_wa.q_wa.cast<double>();
    tick.off_m = (result.proxy_pose_wa.p_wa.cast<double>() - hand.p).norm() +
                 task.radius_m * q.angularDistance(hand.q);
    tick.held = result.d_near_m >= 0 && tick.off_m > kHeldShare * task.radius_m;
    hold = tick.held ? hold + 1 : 0;
    run.longest_hold = std::max(run.longest_hold, hold);
    if (tick.held) run.hold_n = std::max(run.hold_n, tick.force_n);
    if (tick.force_n > kNoForce_n) forces_n.push_back(tick.force_n);
    run.largest_n = std::max(run.largest_n, tick.force_n);
    run.plane_gaps += result.counters.plane_gaps;
    run.ticks.push_back(tick);
  }
  run.outlasts = run.ticks.back().held;
  run.plane_gaps /= ticks + 1.0;
  run.median_n = median_of(forces_n);
  return run;
}

std::vector<PegResult> run_pegs(bool quick, bool progress, double length_share) {
  std::vector<PegResult> results;
  for (const PegTask& task : peg_tasks(quick)) {
    for (const PegDevice& device : peg_devices()) {
      for (const LawId law : {LawId::kPaper, LawId::kProxy}) {
        if (device.device.given != 0 && law == LawId::kPaper) continue;
        results.push_back(run_peg_task(task, device, law, length_share));
        const PegResult& r = results.back();
        if (device.device.given != 0) results.back().ticks.clear();
        if (!progress) continue;
        std::fprintf(stderr, "%-28s %-9s %-5s step %.3g N %.3g mN m, median %.3g N, hold %u\n",
                     r.task.c_str(), r.device.c_str(), law_name(law), r.force_step_n,
                     1e3 * r.torque_step_nm, r.median_n, r.longest_hold);
      }
    }
  }
  return results;
}

PegVerdict verdict_of(const std::vector<PegResult>& results) {
  PegVerdict v;
  std::vector<double> paper, proxy;
  for (const PegResult& r : results) {
    if (r.law == LawId::kProxy && r.outlasts) ++v.outlasting;
    if (r.device != "none") continue;
    const bool ours = r.law == LawId::kProxy;
    double& step_n = ours ? v.proxy_step_n : v.paper_step_n;
    double& step_nm = ours ? v.proxy_step_nm : v.paper_step_nm;
    step_n = std::max(step_n, r.force_step_n);
    step_nm = std::max(step_nm, r.torque_step_nm);
    (ours ? proxy : paper).push_back(r.median_n);
  }
  v.paper_median_n = median_of(paper);
  v.proxy_median_n = median_of(proxy);
  return v;
}

std::vector<OutputText> peg_files(const std::vector<PegResult>& results) {
  const ReportTable table = table_of(results);
  const PegVerdict v = verdict_of(results);
  std::string page =
      "# Pegs\n\nWithout a device, over all tasks:\n\n" +
      table_head({"", "paper", "proxy", "holds"}) +
      table_row({"largest step of force, N", short_number(v.paper_step_n, 4),
                 short_number(v.proxy_step_n, 4), yes_or_no(v.steps_hold())}) +
      table_row({"of torque, mN m", short_number(1e3 * v.paper_step_nm, 4),
                 short_number(1e3 * v.proxy_step_nm, 4), yes_or_no(v.steps_hold())}) +
      table_row({"median of the tasks' median forces, N", short_number(v.paper_median_n, 4),
                 short_number(v.proxy_median_n, 4), yes_or_no(v.median_holds())}) +
      "\nTasks in which a hold outlasts the push: " + std::to_string(v.outlasting) +
      ".\n\nA hold is a run of ticks in which the hand's pose is free of obstacles "
      "and the part is more than 0.001 radii off it.\n\n" +
      table.markdown();
  std::vector<OutputText> files = {{"pegs.csv", table.csv()},
                                   {"pegs.json", table.json().dump(1) + "\n"}};
  std::vector<std::size_t> order;
  for (std::size_t k = 1; k < results.size(); ++k) {
    if (results[k].law == LawId::kProxy && !results[k].ticks.empty()) order.push_back(k);
  }
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
    return results[a].force_step_n > results[b].force_step_n;
  });
  order.resize(std::min(order.size(), kPictures));
  for (const std::size_t k : order) {
    const std::string name = "peg_" + results[k].task + ".svg";
    files.push_back({name, peg_picture(results[k - 1], results[k])});
    page += "\n" + picture_line(name, results[k].task);
  }
  files.push_back({"pegs.md", page});
  return files;
}

}  // namespace haptic::sim
