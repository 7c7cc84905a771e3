// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/reproduction/figures.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "host_sim/lab/studies/reproduction/drawing.hpp"
#include "host_sim/report/picture.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {
namespace {

constexpr double kTilt_rad = -0.2, kGap_m = 0.010, kDepth_m = 0.002;
constexpr double kEnd_s = 2.6;
const Vector kCorner_w(0.02, 0.01, 0.0);    // the vertex of B under App_1
const Vector kCorner_a(0.02, 0.01, -0.05);  // and where it meets the lower face of A

/// Minimum-jerk blend from 0 at `from` to 1 at `to`.
double blend(double t, double from, double to) {
  const double s = std::clamp((t - from) / (to - from), 0.0, 1.0);
  return s * s * s * (10 + s * (-15 + 6 * s));
}

/// A over the obstacle so that f of the contact (lower face of A, corner of B) is the given value
/// at any tilt: the face turns about the corner.
MotionSample pose_of_run(double t) {
  const double f = kGap_m + (-kDepth_m - kGap_m) * blend(t, 0.0, 0.6);
  const double about_x = kTilt_rad * (1 - blend(t, 0.8, 1.4));
  const double about_y = kTilt_rad * (1 - blend(t, 1.6, 2.2));
  const Rotation q = Rotation(Eigen::AngleAxisd(about_y, Vector::UnitY())) *
                     Rotation(Eigen::AngleAxisd(about_x, Vector::UnitX()));
  return sample_at(t, kCorner_w - q * (kCorner_a - Vector(0, 0, f)), q);
}

const char* stage_name(ContactSituation situation) {
  switch (situation) {
    case ContactSituation::kNone:
      return "no contact";
    case ContactSituation::kFaceVertex:
      return "App1";
    case ContactSituation::kEdgeFace:
      return "App1, App2";
    case ContactSituation::kFaceFace:
      return "App1 to App4";
    default:
      return "other";
  }
}

void draw_stages(SvgPage& page, const Panel& panel, const ForceRun& run) {
  constexpr const char* kGrounds[2] = {"#f2f2f2", "#ffffff"};
  std::size_t begin = 0, number = 0;
  for (std::size_t i = 1; i <= run.ticks.size(); ++i) {
    if (i < run.ticks.size() && run.ticks[i].situation == run.ticks[begin].situation) continue;
    const double x0 = panel.x_of(run.ticks[begin].t_s), x1 = i < run.ticks.size()
                                                                 ? panel.x_of(run.ticks[i].t_s)
                                                                 : panel.left + panel.width;
    const Pixel ground[4] = {{x0, panel.top},
                             {x1, panel.top},
                             {x1, panel.top + panel.height},
                             {x0, panel.top + panel.height}};
    page.polygon(ground, kGrounds[number++ % 2], 1.0, "none", 0, "stage");
    page.text((x0 + x1) / 2, panel.top - 8, stage_name(run.ticks[begin].situation), "middle", 12);
    begin = i;
  }
}

void draw_curves(SvgPage& page, Panel panel, const ForceRun& run, const std::string& label,
                 const double (TickRecord::*vector)[3], double factor,
                 const std::array<const char*, 4>& names) {
  constexpr const char* kColours[4] = {"#d55e00", "#009e73", "#0072b2", "#000000"};
  std::array<std::vector<double>, 4> values;
  std::vector<double> times;
  for (const TickRecord& tick : run.ticks) {
    const double* v = tick.*vector;
    times.push_back(tick.t_s);
    for (std::size_t k = 0; k < 3; ++k) values[k].push_back(factor * v[k]);
    values[3].push_back(factor * std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
  }
  for (const auto& list : values) {
    panel.low = std::min(panel.low, *std::min_element(list.begin(), list.end()));
    panel.high = std::max(panel.high, *std::max_element(list.begin(), list.end()));
  }
  const double margin = 0.08 * (panel.high - panel.low);
  panel.low -= margin;
  panel.high += margin;
  draw_stages(page, panel, run);
  page.raw(panel_frame(panel, label, true));
  for (const std::size_t k : {std::size_t{3}, std::size_t{0}, std::size_t{1}, std::size_t{2}})
    page.raw(curve(panel, times, values[k], kColours[k], k == 3 ? 3.2 : 1.8));
  double x = panel.left + 10;
  const double y = panel.top + panel.height + 44;
  for (std::size_t k = 0; k < 4; ++k, x += 90) {
    page.raw(legend_entry(x, y - 4, kColours[k], names[k], k == 3 ? 3.2 : 1.8));
  }
  page.text(panel.left + panel.width, y, "time (s)", "end", 13);
}

std::string picture(const ForceRun& run) {
  SvgPage page(1240, 470, "Force and torque while the contacts are attained, as Fig. 5");
  draw_curves(page, {90, 80, 500, 310, 0, kEnd_s, 0, 0}, run, "force (N)", &TickRecord::force_n, 1,
              {"Fx", "Fy", "Fz", "|F|"});
  draw_curves(page, {720, 80, 500, 310, 0, kEnd_s, 0, 0}, run, "torque (mN m)",
              &TickRecord::torque_nm, 1e3, {"Tx", "Ty", "Tz", "|T|"});
  page.text(90, 460,
            "On the hand, W axes, torque about x0; k_F = 1000 N/m, depth 2 mm from 0.6 s on; A "
            "turns about App1 by 0.2 rad twice",
            "start", 12, "fill=\"#505050\"");
  return page.finish();
}

}  // namespace

ForceRun make_force_run() {
  const Solid obstacle = box_solid("obstacle", {0.02, -0.12, -0.04}, {0.12, 0.01, 0});
  const std::vector<std::byte> bytes =
      scene_of(centred_box("box", 0.05, 0.05, 0.05), {&obstacle, 1}, 1000.0, 1e-4);
  CoreSession session(bytes, "box on obstacle");
  ForceRun run;
  for (std::uint64_t tick = 0; tick <= 2600; ++tick) {
    const MotionSample sample = pose_of_run(static_cast<double>(tick) * 1e-3);
    const StepResult result = session.core().step(input_of(sample, tick, GoalContact::kAsked));
    run.ticks.push_back(record_of(tick, sample.t_s, result, session.view().parameters().law));
    run.contacts.push_back(
        static_cast<std::uint32_t>(session.core().pair_report(0).contact_nodes.size()));
    if (run.sequence.empty() || run.sequence.back() != result.situation)
      run.sequence.push_back(result.situation);
  }
  return run;
}

PartReport forces_part() {
  const ForceRun run = make_force_run();
  PartReport report;
  report.title = "Force and torque on the way to a face-face contact (Fig. 5)";
  report.markdown = table_head(
      {"stage", "K", "force (N)", "torque (mN m), end of stage", "torque by hand (mN m)"});
  std::string stages;
  double least = 1e9, largest = 0;
  constexpr const char* kByHand[4] = {"0", "44.7 = 2 N x 22.36 mm, length of (20, 10)",
                                      "40 = 2 N x 20 mm", "70 = 2 N x 35 mm"};
  std::size_t stage = 0;
  for (std::size_t i = 0; i < run.ticks.size(); ++i) {
    const TickRecord& tick = run.ticks[i];
    if (tick.t_s > 0.6) {  // the depth is constant from here on
      least = std::min(least, length_of(tick.force_n));
      largest = std::max(largest, length_of(tick.force_n));
    }
    // A stage ends where the contacts change; the label follows a little later.
    if (i + 1 < run.ticks.size() && run.contacts[i + 1] == run.contacts[i]) continue;
    report.markdown +=
        table_row({stage_name(tick.situation), std::to_string(run.contacts[i]),
                   fixed(length_of(tick.force_n), 3), fixed(1e3 * length_of(tick.torque_nm), 1),
                   stage < 4 ? kByHand[stage] : "-"});
    stages += (stage == 0 ? "" : " -> ") + std::string(stage_name(tick.situation)) +
              " (K = " + std::to_string(run.contacts[i]) + ")";
    ++stage;
  }
  report.markdown += "\n" + picture_line("fig5.svg", "Force and torque curves");
  const std::vector<ContactSituation> wanted = {
      ContactSituation::kNone, ContactSituation::kFaceVertex, ContactSituation::kEdgeFace,
      ContactSituation::kFaceFace};
  const double band = HAPTIC_REAL_IS_FLOAT ? 1e-3 : 1e-9;
  const double end_torque = length_of(run.ticks.back().torque_nm);
  report.passed = run.sequence == wanted && largest - least < band &&
                  std::abs(end_torque - 0.070) < band && run.contacts.back() == 4;
  report.findings.push_back({"Fig. 5, stages",
                             "no contact -> App1 -> (App1, App2) -> (App1 ... App4)", stages,
                             yes_or_no(run.sequence == wanted), ""});
  report.findings.push_back(
      {"Fig. 5, curves", "one force throughout the contact, a step of the torque at each stage",
       "force " + fixed(least, 3) + " N throughout; torque 44.7, 40 and 70 mN m", "in shape",
       "the paper prints neither dimensions nor k_F; the published rule jumps by design where a "
       "contact enters"});
  report.files = {{"fig5.svg", picture(run)}, {"fig5.csv", tick_csv(run.ticks)}};
  return report;
}

}  // namespace haptic::sim
