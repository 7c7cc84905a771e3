// SPDX-License-Identifier: Apache-2.0
// Part 8 of the stability report: what a user gets. The gains that the compiler chooses for a
// [device], every encoder, rotor and friction, the passivity layer as shipped: does the hand feel
// rest where it rests? And gains far beyond the budget, which no cell may call rest.
#include <algorithm>
#include <array>
#include <cmath>

#include "host_sim/device/loop_run.hpp"
#include "host_sim/device/rest_judge.hpp"
#include "host_sim/lab/stability/spectral_radius.hpp"
#include "host_sim/lab/stability/stability_report.hpp"
#include "host_sim/report/picture.hpp"
#include "host_sim/report/shard_run.hpp"
#include "host_sim/shapes/contact_case.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/coupling/coupling_choice.hpp"

namespace haptic::sim {
namespace {

constexpr double kLoopRate_hz = 1000;
constexpr double kLever_m = 0.050;  ///< one count of rotation is one of translation at this lever
constexpr double kPressing_s = 1.0, kHolding_s = 3.0;
constexpr double kWantedStiffness_n_per_m = 5000;
/// Gains beyond the budget, as a multiple of the loop's own boundary.
constexpr double kFarBeyond = 2.0;
/// Loops whose state grows faster than this per sample oscillate within the run.
constexpr double kGrows = 1.01;
constexpr double kStageGap_m = 0.001, kStageClearance_m = 1.0e-4, kStageDepth_m = 0.020;

/// A device as its scene states it and as it is.
struct DefaultDevice {
  const char* name;
  double mass_kg, damping_ns_per_m, rotor_kg_m2, rotor_damping_nms_per_rad;
  double coulomb_n, coulomb_nm, max_force_n, max_torque_nm;
  bool states_rotor;
};

/// The reference device (hal/drivers/PROTOCOL.md); the same with a rotor that its scene does not
/// state; with Coulomb friction; and two of other sizes.
constexpr DefaultDevice kDevices[] = {
    {"reference", 0.1, 1.0, 1e-4, 1e-3, 0, 0, 12, 0.3, true},
    {"rotor unstated", 0.1, 1.0, 1e-5, 1e-4, 0, 0, 12, 0.3, false},
    {"rubs", 0.1, 1.0, 1e-4, 1e-3, 0.1, 1e-3, 12, 0.3, true},
    {"light", 0.045, 0.3, 2e-5, 1e-4, 0.03, 0, 3.3, 0.05, true},
    {"heavy", 0.35, 3.0, 1e-3, 6e-3, 0.2, 5e-3, 20, 1.0, true},
};

struct DefaultSetting {
  const DefaultDevice* device = nullptr;
  const char* contact = "wall";
  double encoder_m = 0;
  unsigned delay_samples = 0;
  std::string hand = "light";
  bool beyond = false;  ///< without a budget and without the passivity layer
};

struct DefaultCell {
  DefaultSetting setting;
  double k_t = 0, k_r = 0, damping = 0;
  double radius = 0;  ///< spectral radius of the worse axis, with the hand
  RestOscillation rest;
  RestAllowance allowed;

  /// Coulomb friction, which the radius does not know, holds many of them.
  [[nodiscard]] bool must_grow() const {
    return setting.beyond && radius > kGrows && setting.device->coulomb_n == 0;
  }
  [[nodiscard]] bool holds() const {
    return setting.beyond ? !must_grow() || rest.oscillates() : !rest.oscillates() && radius <= 1;
  }
  [[nodiscard]] const char* verdict() const { return rest.oscillates() ? "oscillates" : "rests"; }
};

struct Setup {
  PartAmongSolids solids;
  Vector press;  ///< of the part, from its start
};

Setup setup_of(const std::string& contact) {
  if (contact == "wall") return {cube_over_wall(kStageGap_m), Vector(0.002, 0, -0.004)};
  return {peg_in_hole(kStageClearance_m, kStageDepth_m), Vector(0.003, 0.002, 0)};
}

DeviceModel model_of(const DefaultSetting& s) {
  DeviceModel m;
  m.mass_kg = s.device->mass_kg;
  m.damping_ns_per_m = s.device->damping_ns_per_m;
  m.rotor_kg_m2 = s.device->rotor_kg_m2;
  m.rotor_damping_nms_per_rad = s.device->rotor_damping_nms_per_rad;
  m.coulomb_force_n = s.device->coulomb_n;
  m.coulomb_torque_nm = s.device->coulomb_nm;
  m.encoder_step_m = s.encoder_m;
  m.encoder_step_rad = s.encoder_m / kLever_m;
  m.max_force_n = s.device->max_force_n;
  m.max_torque_nm = s.device->max_torque_nm;
  m.delay_samples = s.delay_samples;
  return m;
}

/// One axis of device and hand, for the eigenvalues.
LinearLoop axis_of(const DefaultSetting& s, const HandModel& hand, bool rotation) {
  LinearLoop loop;
  loop.mass_kg = rotation ? s.device->rotor_kg_m2 : s.device->mass_kg;
  loop.damping_ns_per_m =
      rotation ? s.device->rotor_damping_nms_per_rad : s.device->damping_ns_per_m;
  loop.hand_stiffness = rotation ? hand.stiffness_nm_per_rad : hand.stiffness_n_per_m;
  loop.hand_damping = rotation ? hand.damping_nms_per_rad : hand.damping_ns_per_m;
  loop.period_s = 1 / kLoopRate_hz;
  loop.delay_samples = s.delay_samples;
  return loop;
}

/// The scene's parameters as the compiler makes them from its [device] table, or far beyond.
SceneParameters parameters_of(const DefaultSetting& s, const HandModel& hand, double radius_m) {
  SceneParameters p = tools::default_parameters();
  p.rate_hz = kLoopRate_hz;
  p.law = LawId::kProxy;
  p.k_f_n_per_m = kWantedStiffness_n_per_m;
  DeviceParameters& d = p.device;
  d.given = 1;
  d.mass_kg = s.device->mass_kg;
  d.damping_ns_per_m = s.device->damping_ns_per_m;
  if (s.device->states_rotor) {
    std::ranges::fill(d.rotor_inertia_kg_m2, s.device->rotor_kg_m2);
    std::ranges::fill(d.rotor_damping_nms_per_rad, s.device->rotor_damping_nms_per_rad);
  }
  d.coulomb_friction_n = s.device->coulomb_n;
  d.coulomb_torque_nm = s.device->coulomb_nm;
  d.encoder_step_m = s.encoder_m;
  d.encoder_step_rad = s.encoder_m / kLever_m;
  d.delay_s = s.delay_samples / kLoopRate_hz;
  d.max_force_n = s.device->max_force_n;
  d.max_torque_nm = s.device->max_torque_nm;
  tools::CouplingRequest request;
  if (s.beyond) {
    request.allow_active = true;
    request.passivity = false;
    request.damping_ns_per_m = 0;
    request.k_t_n_per_m = kFarBeyond * stiffness_limit(axis_of(s, hand, false), 0);
    request.k_r_nm_per_rad = 0.2 * stiffness_limit(axis_of(s, hand, true), 0);
  }
  p.coupling = tools::choose_coupling(p, request, radius_m).coupling;
  return p;
}

std::vector<MotionSample> motion_of(const Setup& setup) {
  std::vector<MotionSample> motion;
  const int ticks = static_cast<int>((kPressing_s + kHolding_s) * kLoopRate_hz);
  for (int k = 0; k <= ticks; ++k) {
    const double t_s = k / kLoopRate_hz, u = std::min(1.0, t_s / kPressing_s);
    const double way = u * u * u * (10 + u * (6 * u - 15));  // minimum jerk
    motion.push_back(sample_at(t_s, setup.solids.start + way * setup.press,
                               rotation_of(way * Vector(0.02, 0.05, 0))));
  }
  return motion;
}

DefaultCell default_cell(const DefaultSetting& setting) {
  const std::optional<HandModel> hand = hand_named(setting.hand);
  if (!hand) throw tools::InputError("no hand is called '" + setting.hand + "'");
  const Setup setup = setup_of(setting.contact);
  const DeviceModel model = model_of(setting);
  const SceneParameters parameters = parameters_of(setting, *hand, setup.solids.radius_m);
  const CouplingParameters& c = parameters.coupling;
  DefaultCell cell;
  cell.setting = setting;
  cell.k_t = c.k_t_n_per_m;
  cell.k_r = c.k_r_nm_per_rad;
  cell.damping = c.damping_ns_per_m;
  const double b_r = c.damping_ns_per_m * c.k_r_nm_per_rad / c.k_t_n_per_m;
  cell.radius =
      std::max(spectral_radius(wall_matrix(axis_of(setting, *hand, false), cell.k_t, cell.damping)),
               spectral_radius(wall_matrix(axis_of(setting, *hand, true), cell.k_r, b_r)));
  CoreSession session(scene_with(setup.solids.part, setup.solids.around, parameters), "defaults");
  ClosedLoop loop(session, model, *hand, kLoopRate_hz);
  const std::vector<LoopRecord> records = run_loop(loop, motion_of(setup));
  cell.allowed = rest_allowance(parameters, model);
  cell.rest = rest_oscillation(records, cell.allowed);
  return cell;
}

std::vector<DefaultSetting> default_settings(bool quick) {
  std::vector<DefaultSetting> list;
  const std::vector<double> encoders =
      quick ? std::vector<double>{0, 60e-6} : std::vector<double>{0, 1e-6, 10e-6, 60e-6};
  for (const bool beyond : {false, true}) {
    for (const DefaultDevice& device : kDevices) {
      for (const char* contact : {"wall", "peg"}) {
        for (const double encoder : encoders) {
          for (const unsigned delay : {0u, 1u}) {
            for (const char* hand : {"loose", "light", "firm"}) {
              list.push_back({&device, contact, encoder, delay, hand, beyond});
            }
          }
        }
      }
    }
  }
  return list;
}

ReportTable table_of(const std::vector<DefaultCell>& cells) {
  ReportTable table(
      "gains,device,contact,encoder_um,delay_samples,hand,k_t_n_per_m,k_r_nm_per_rad,"
      "damping_ns_per_m,spectral_radius,force_pp_n,torque_pp_nm,allowed_n,share_of_allowed,"
      "frequency_hz,verdict,holds");
  for (const DefaultCell& c : cells) {
    const DefaultSetting& s = c.setting;
    table.add({s.beyond ? "beyond" : "default", s.device->name, s.contact,
               shown_as("%g", 1e6 * s.encoder_m), s.delay_samples, s.hand, shown_as("%.5g", c.k_t),
               shown_as("%.4g", c.k_r), shown_as("%.4g", c.damping), shown_as("%.6f", c.radius),
               shown_as("%.4g", c.rest.force_pp_n), shown_as("%.4g", c.rest.torque_pp_nm),
               shown_as("%.4g", c.allowed.force_n), shown_as("%.3g", c.rest.ratio),
               shown_as("%.4g", c.rest.frequency_hz), c.verdict(), yes_or_no(c.holds())});
  }
  return table;
}

/// Share of what encoders may make of rest, over the spectral radius: rest and oscillation apart.
std::string defaults_picture(const std::vector<DefaultCell>& cells) {
  const Panel panel{90, 60, 720, 340, 0.9, 1.4, -4, 4};
  std::string svg =
      heading_at(90, 28, "Swing at rest over what encoders explain, by spectral radius") +
      panel_frame(panel, "log10 of the share", true);
  for (const DefaultCell& c : cells) {
    const double share = std::clamp(std::log10(std::max(c.rest.ratio, 1e-4)), -4.0, 4.0);
    svg += "<circle cx=\"" + pixel(panel.x_of(std::clamp(c.radius, 0.9, 1.4))) + "\" cy=\"" +
           pixel(panel.y_of(share)) + "\" r=\"3\" fill=\"none\" stroke=\"" +
           (c.setting.beyond ? kForceColour : kTorqueColour) + "\"/>\n";
  }
  svg += text_at(450, 440, "spectral radius of device and hand on the spring", "middle", 13);
  svg += legend_entry(100, 464, kTorqueColour, "default gains") +
         legend_entry(300, 464, kForceColour, "twice the boundary, no passivity layer");
  return svg_document(860, 480, svg);
}

}  // namespace

PartReport defaults_part(const StabilityOptions& options) {
  const std::vector<DefaultSetting> settings = default_settings(options.quick);
  std::vector<DefaultCell> cells(settings.size());
  run_shards(
      cells.size(), RunOptions{options.threads, options.progress}, "defaults", [] { return 0; },
      [&](int, std::size_t k) { cells[k] = default_cell(settings[k]); });

  PartReport report;
  report.title = "8. Default gains";
  std::size_t shipped = 0, rest = 0, stable = 0, growing = 0, called = 0;
  double worst = 0;
  for (const DefaultCell& c : cells) {
    report.passed = report.passed && c.holds();
    if (c.setting.beyond) {
      growing += c.must_grow() ? 1u : 0u;
      called += c.must_grow() && c.rest.oscillates() ? 1u : 0u;
      continue;
    }
    ++shipped;
    rest += c.rest.oscillates() ? 0u : 1u;
    stable += c.radius <= 1 ? 1u : 0u;
    worst = std::max(worst, c.rest.ratio);
  }
  const auto add = [&](const char* topic, const char* stated, const std::string& found, bool holds,
                       const std::string& remark) {
    report.findings.push_back({topic, stated, found, yes_or_no(holds), remark});
  };
  const auto of = [](std::size_t part, std::size_t whole) {
    return std::to_string(part) + " of " + std::to_string(whole);
  };
  add("default gains: swing at rest", "at most what 1.5 counts explain", of(rest, shipped),
      rest == shipped, "largest share " + short_number(worst, 3));
  add("default gains: spectral radius", "at most 1", of(stable, shipped), stable == shipped, "");
  report.passed = report.passed && growing > 0;
  add("twice the boundary: called an oscillation", "every loop that grows", of(called, growing),
      called == growing && growing > 0, "");
  report.markdown =
      "What a scene with a `[device]` gets when it asks for 5000 N/m and leaves the rest open: the "
      "compiler's gains, coupling damping, passivity layer. A part is pressed and turned within a "
      "second and held for three, by every hand, with encoders of 0, 1, 10, 60 um (per 50 mm in "
      "rotation), 0 and 1 sample of delay, at 1 kHz. *Rests*: the wrench swings by no more than "
      "1.5 counts times the stiffness on every axis, or dies out "
      "(`host_sim/device/rest_judge.hpp`). "
      "The spectral radius is that of device and hand on the springs, the worse of translation and "
      "rotation, without Coulomb friction. The same with twice the boundary's stiffness and no "
      "passivity layer shows that the judge tells an oscillation.\n\n" +
      picture_line("defaults.svg", "Swing at rest by spectral radius") + "\n" +
      table_of(cells).markdown();
  report.files = {{"defaults.csv", table_of(cells).csv()},
                  {"defaults.md", "# " + report.title + "\n\n" + report.markdown},
                  {"defaults.svg", defaults_picture(cells)}};
  return report;
}

}  // namespace haptic::sim
