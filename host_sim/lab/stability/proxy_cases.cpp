// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/stability/proxy_cases.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "host_sim/report/part_report.hpp"
#include "host_sim/shapes/contact_case.hpp"

namespace haptic::sim {
namespace {

/// Depth that a free proxy may show.
constexpr double kProxyFree_m = -2e-7;
/// A change of the wrench beyond this is a release, not a slope of the slow paths.
constexpr double kRelease_n = 0.05, kRelease_nm = 0.005;

std::vector<Figure> step_figures(const ContactCase& c, double force_n, double torque_nm,
                                 Trace* trace_out = nullptr) {
  Trace trace = run_trace(c.scene, LawId::kProxy, c.path);
  const WrenchSteps steps = largest_steps(trace.path());
  std::vector<Figure> figures = {at_most("dF (N)", force_n, steps.force_n),
                                 at_most("dtau (N m)", torque_nm, steps.torque_nm),
                                 {"gap (m)", 0, worst_gap_m(trace.ticks), kProxyFree_m, 1}};
  if (trace_out != nullptr) *trace_out = std::move(trace);
  return figures;
}

/// Steps before the hold is lost, and while it is.
std::vector<Figure> release_figures(const ContactCase& c, double force_n, double torque_nm,
                                    double release_n, double release_nm) {
  const Trace trace = run_trace(c.scene, LawId::kProxy, c.path);
  const auto path = trace.path();
  const std::size_t at = first_jump(path, kRelease_n, kRelease_nm);
  const WrenchSteps before = largest_steps(path.first(at));
  const WrenchSteps after = largest_steps(path.subspan(at > 0 ? at - 1 : 0));
  return {at_most("dF before release (N)", force_n, before.force_n),
          at_most("dtau before release (N m)", torque_nm, before.torque_nm),
          at_most("dF of the release (N)", release_n, after.force_n),
          at_most("dtau of the release (N m)", release_nm, after.torque_nm),
          near_to("force after it (N)", 0, path.back().force_n.norm(), 1e-6),
          {"gap (m)", 0, worst_gap_m(trace.ticks), kProxyFree_m, 1}};
}

std::vector<Figure> push_figures(double depth_m, double force_n) {
  const ContactCase c = push_case(depth_m);
  Trace trace;
  std::vector<Figure> figures = step_figures(c, 0.014, 1e-12, &trace);
  figures.push_back(near_to("F at the end (N)", force_n, trace.ticks.back().force_n.z(), 0.005));
  return figures;
}

std::vector<Figure> seam_figures() {
  std::vector<Figure> figures;
  double ripple_n = 0, torque_nm = 0, flat_n = 0;
  for (const double speed : {0.02, 0.1, 1.0}) {
    for (const double tilt : {0.0, 0.02, 0.3}) {
      const ContactCase c = seam_case(speed, tilt, false);
      const Trace trace = run_trace(c.scene, LawId::kProxy, c.path);
      const ContactCase whole = seam_case(speed, tilt, true);
      const Trace uncut = run_trace(whole.scene, LawId::kProxy, whole.path);
      for (std::size_t k = trace.begin; k < trace.ticks.size(); ++k) {
        const TraceTick &a = trace.ticks[k], &b = uncut.ticks[k];
        ripple_n = std::max(ripple_n, (a.force_n - b.force_n).norm());
        torque_nm = std::max(torque_nm, (a.torque_nm - b.torque_nm).norm());
        if (tilt == 0) flat_n = std::max(flat_n, std::abs(a.force_n.norm() - 3));
      }
      ripple_n = std::max(ripple_n, force_ripple_n(trace.path()));
    }
  }
  figures.push_back(at_most("ripple (N)", 5e-5, ripple_n));  // twice this is k_t tol
  figures.push_back(at_most("torque against the uncut plate (N m)", 6e-6, torque_nm));
  figures.push_back(near_to("|F - 3| at no tilt (N)", 0, flat_n, 1e-4));
  return figures;
}

/// 1 m/s and 10 rad/s into a plate of 1 mm, six directions.
std::vector<Figure> fast_figures() {
  double step_n = 0, gap_m = 1, lowest_m = 1;
  Seeded random(20260601);
  for (int k = 0; k < 6; ++k) {
    CoupledScene scene;
    scene.moving = sample_box();
    scene.statics.push_back(thin_plate(1e-3, 0.3));
    const Rotation start = random.rotation();
    const Vector axis = random.direction();
    Vector way = random.direction();
    way.z() = -std::abs(way.z()) - 0.3;
    way.normalize();
    TimedPath path;
    path.pose = [=](double t) -> PathPose {
      return {Vector(0, 0, 0.052) + t * way, turn_about(10 * t, axis) * start};
    };
    path.duration_s = 0.08;
    path.approach_s = 0.001;
    path.retreat_w = -0.001 * way;
    const Trace trace = run_trace(scene, LawId::kProxy, path);
    step_n = std::max(step_n, largest_steps(trace.path()).force_n);
    gap_m = std::min(gap_m, worst_gap_m(trace.ticks));
    for (const TraceTick& tick : trace.ticks) lowest_m = std::min(lowest_m, tick.proxy.p.z());
  }
  return {at_most("dF (N)", 1.03, step_n),
          {"gap (m)", 0, gap_m, kProxyFree_m, 1},
          {"lowest grip point (m)", 0.024, lowest_m, 0.024 - 1e-6, 1}};
}

std::vector<Figure> corner_figures() {
  const ContactCase c = corner_case();
  const Trace trace = run_trace(c.scene, LawId::kProxy, c.path);
  double off_m = 0, torque_nm = 0;
  for (const TraceTick& tick : trace.path()) {
    off_m = std::max(off_m, (tick.proxy.p - corner_place()).norm());
    torque_nm = std::max(torque_nm, tick.torque_nm.norm());
  }
  const Vector wanted(-4, -3, 4);
  // The tolerance of a plane, 1e-7 m, is what the proxy may keep of a smaller violation.
  return {
      {"from the ideal point (m)", 1e-9, off_m, 0, 2e-9},
      near_to("F against (-4, -3, 4) (N)", 0, (trace.ticks.back().force_n - wanted).norm(), 2e-6),
      {"tau (N m)", 1e-16, torque_nm, 0, 1e-12}};
}

}  // namespace

Figure at_most(std::string what, double design, double measured) {
  return {std::move(what), design, measured, -2 * design, 2 * design};
}

Figure near_to(std::string what, double design, double measured, double tolerance) {
  return {std::move(what), design, measured, design - tolerance, design + tolerance};
}

std::vector<CaseRow> contact_rows() {
  return {
      {"slide_off", slide_off_case().title,
       [] { return release_figures(slide_off_case(), 0.0012, 6e-5, 1.32, 0.028); }},
      {"tilt", tilt_case().title, [] { return step_figures(tilt_case(), 0.0018, 1.6e-4); }},
      {"roll_tilt_yaw", roll_case().title, [] { return step_figures(roll_case(), 0.026, 3e-4); }},
      {"edge_off", edge_case().title,
       [] { return release_figures(edge_case(), 0.006, 1e-4, 0.47, 0.0028); }},
      {"push_2", "plate of 0.5 mm, pushed 2 mm", [] { return push_figures(0.002, 2); }},
      {"push_25", "plate of 0.5 mm, pushed 25 mm", [] { return push_figures(0.025, 25); }},
      {"seams", "five-piece plate, 0.02 to 1 m/s, tilt 0 to 0.3 rad", seam_figures},
      {"fast_plate", "plate of 1 mm, 1 m/s, 10 rad/s, six directions", fast_figures},
      {"swing_0.5", "bar swung into an edge, 0.5 rad/s",
       [] { return step_figures(swing_case(0.5), 0.008, 1); }},
      {"swing_2", "bar swung into an edge, 2 rad/s",
       [] { return step_figures(swing_case(2), 0.033, 1); }},
      {"swing_10", "bar swung into an edge, 10 rad/s",
       [] { return step_figures(swing_case(10), 0.166, 1); }},
      {"edge_swing", "bar swung edge into edge, 2 rad/s",
       [] { return step_figures(edge_swing_case(), 0.022, 9e-4); }},
      {"corner", "corner of three planes", corner_figures}};
}

std::vector<CaseRow> proxy_cases() {
  std::vector<CaseRow> all;
  for (const auto& group : {contact_rows(), peg_rows(), stiffness_rows(), limit_rows(),
                            friction_rows(), division_rows(), energy_rows()}) {
    all.insert(all.end(), group.begin(), group.end());
  }
  return all;
}

std::string figures_head() { return table_head({"case", "figure", "design", "measured", "holds"}); }

std::string figures_rows(const CaseRow& row, const std::vector<Figure>& figures) {
  std::string text;
  for (const Figure& f : figures) {
    text += table_row({row.title, f.what, short_number(f.design, 6), short_number(f.measured, 6),
                       yes_or_no(f.ok())});
  }
  return text;
}

}  // namespace haptic::sim
