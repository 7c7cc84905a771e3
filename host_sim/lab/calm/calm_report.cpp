// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/calm/calm_report.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host_sim/device/rest_judge.hpp"
#include "host_sim/report/picture.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/coupling/coupling_choice.hpp"

namespace haptic::sim {
namespace {

constexpr double kRate_hz = 1000;
constexpr double kPress_m = 0.008, kWithdraw_m_per_s = 0.1, kPressTime_s = 0.5, kHold_s = 2.0;
constexpr double kLookedAt_s = 0.5, kAfter_s = 0.3;
constexpr double kOff_m = 0.002;  ///< above the surface at the start
constexpr double kClearance_m = 1.0e-4, kHoleDepth_m = 0.040;
/// What is left of settling where the encoder is exact.
constexpr double kSettled_n = 1.0e-3;
/// Beyond the budget forces go up to 100 N: 2^-24 of it in single precision.
constexpr double kRounding_n = HAPTIC_REAL_IS_FLOAT ? 100 * 0x1p-24 : 1.0e-9;
const DeviceModel kDevice{};

struct Stage {
  PartAmongSolids solids;
  Vector press;  ///< of the part, from its start
};

Stage stage_of(const std::string& contact) {
  if (contact == "wall") return {cube_over_wall(kOff_m), Vector(0, 0, -kOff_m - kPress_m)};
  return {peg_in_hole(kClearance_m, kHoleDepth_m - kOff_m),
          Vector(0.003, 0.002, -kOff_m - kPress_m)};
}

SceneParameters parameters_of(const CalmCell& cell, const Stage& stage, bool& inside) {
  SceneParameters p = tools::default_parameters();
  p.rate_hz = kRate_hz;
  p.law = LawId::kProxy;
  p.k_f_n_per_m = cell.k_t_n_per_m;
  p.device.given = 1;
  p.device.mass_kg = kDevice.mass_kg;
  p.device.damping_ns_per_m = kDevice.damping_ns_per_m;
  p.device.encoder_step_m = cell.encoder_step_m;
  std::ranges::fill(p.device.rotor_inertia_kg_m2, kDevice.rotor_kg_m2);
  std::ranges::fill(p.device.rotor_damping_nms_per_rad, kDevice.rotor_damping_nms_per_rad);
  p.device.delay_s = cell.delay_samples / kRate_hz;
  p.device.encoder_step_rad = cell.encoder_step_m / kEncoderLever_m;
  tools::CouplingRequest request;
  if (cell.allow_active) {
    request.allow_active = true;
    request.k_t_n_per_m = cell.k_t_n_per_m;
  }
  p.coupling = tools::choose_coupling(p, request, stage.solids.radius_m).coupling;
  // The bound of an ideal damper is not what encoders leave of the coupling's: the device's alone.
  const double lag_s = (0.5 + cell.delay_samples) / kRate_hz;
  inside = p.coupling.k_t_n_per_m * lag_s < kDevice.damping_ns_per_m &&
           p.coupling.k_r_nm_per_rad * lag_s < kDevice.rotor_damping_nms_per_rad;
  return p;
}

HandTarget target_at(const Stage& stage, double t_s) {
  const double way = stage.press.norm();
  const double back_s = t_s - kPressTime_s - kHold_s;
  const double gone = back_s < 0 ? way * std::min(1.0, t_s / kPressTime_s)
                                 : std::max(0.0, way - kWithdraw_m_per_s * back_s);
  return {stage.solids.start + stage.press * (gone / way), Rotation::Identity()};
}

struct Traced {
  CalmRun run;
  std::vector<double> t_s, force_n;
  std::vector<Wrench> wrenches;
};

Traced run_once(const CalmCell& cell, const Stage& stage, const SceneParameters& parameters) {
  CoreSession session(scene_with(stage.solids.part, stage.solids.around, parameters), "calm");
  DeviceModel device = kDevice;
  device.encoder_step_m = cell.encoder_step_m;
  device.encoder_step_rad = cell.encoder_step_m / kEncoderLever_m;
  device.delay_samples = cell.delay_samples;
  const std::optional<HandModel> hand = hand_named(cell.hand);
  if (!hand) throw tools::InputError("no hand is called '" + cell.hand + "'");
  ClosedLoop loop(session, device, *hand, kRate_hz);
  loop.place({stage.solids.start, Rotation::Identity(), Vector::Zero(), Vector::Zero()});
  const double held_s = kPressTime_s + kHold_s;
  const double seconds = held_s + stage.press.norm() / kWithdraw_m_per_s + kAfter_s;
  Traced traced;
  Vector low = Vector::Constant(1e300), high = -low;
  unsigned relaxed = 0;
  for (int k = 0; k < static_cast<int>(seconds * kRate_hz); ++k) {
    const double t_s = k / kRate_hz;
    const LoopTick tick = loop.step({target_at(stage, t_s), target_at(stage, t_s + 1 / kRate_hz)});
    const Vector force = tick.result.wrench_w.force_w.cast<double>();
    const Vector spring = tick.result.spring_w.force_w.cast<double>();
    traced.t_s.push_back(t_s);
    traced.force_n.push_back(force.z());
    traced.wrenches.push_back(tick.result.wrench_w);
    traced.run.acted_ticks += (tick.result.flags & kFlagPassivity) != 0 ? 1 : 0;
    if (t_s >= held_s - kLookedAt_s && t_s < held_s) {
      low = low.cwiseMin(force);
      high = high.cwiseMax(force);
    }
    relaxed = tick.result.potential_j > 0 ? 0 : relaxed + 1;
    const double felt = std::max(force.norm(), tick.result.wrench_w.torque_w.cast<double>().norm());
    if (relaxed >= 2 && felt > 0) {
      ++traced.run.free_ticks;
      traced.run.free_n = std::max(traced.run.free_n, felt);
    }
    if (spring.norm() > 0) {
      traced.run.pull_n = std::max(traced.run.pull_n, -force.dot(spring) / spring.norm());
    }
  }
  traced.run.rest_pp_n = (high - low).maxCoeff();
  return traced;
}

bool equal_bits(const Wrench& a, const Wrench& b) {
  return a.force_w == b.force_w && a.torque_w == b.torque_w;
}

std::string encoder_text(double step_m) { return short_number(1e6 * step_m, 3); }

std::string cell_name(const CalmCell& c) {
  return std::string(c.allow_active ? "asked, " : "default, ") + c.contact + ", " +
         short_number(c.k_t_n_per_m, 4) + " N/m, delay " + std::to_string(c.delay_samples) + ", " +
         encoder_text(c.encoder_step_m) + " um, " + c.hand;
}

/// Force along the press of the worst cells, one panel each.
std::string calm_picture(std::span<const CalmResult> results) {
  constexpr std::size_t kPanels = 4;
  constexpr double kWidth = 900, kHeight = 130, kTop = 30;
  std::vector<const CalmResult*> worst;
  for (const CalmResult& r : results) worst.push_back(&r);
  std::ranges::stable_sort(worst, [](const CalmResult* a, const CalmResult* b) {
    return a->with.rest_pp_n > b->with.rest_pp_n;
  });
  worst.resize(std::min(worst.size(), kPanels));
  std::string body;
  double top = kTop;
  for (const CalmResult* r : worst) {
    Panel panel = time_panel(r->t_s, 70, top, kWidth - 90, kHeight);
    const NamedCurve curves[] = {{"force, N", kForceColour, r->force_n, 1.2}};
    fit_range(panel, curves);
    body += curve_panel(panel, cell_name(r->cell), r->t_s, curves, true);
    top += kHeight + 50;
  }
  return svg_document(kWidth, top, body);
}

}  // namespace

bool CalmResult::passed() const {
  const bool free = with.free_ticks == 0 && with.pull_n <= kRounding_n;
  if (cell.allow_active) return free;
  // Without delay the sampled spring generates nothing that the device's damping does not take.
  const bool silent = !inside || cell.delay_samples > 0 || same_bits;
  return free && with.rest_pp_n <= allowed_pp_n && silent;
}

LastResort last_resort(std::span<const CalmResult> results) {
  LastResort all;
  for (const CalmResult& r : results) {
    if (!r.cell.allow_active) continue;
    ++all.cells;
    all.without += r.without.rest_pp_n > r.allowed_pp_n ? 1u : 0u;
    all.with += r.with.rest_pp_n > r.allowed_pp_n ? 1u : 0u;
    all.largest_without_n = std::max(all.largest_without_n, r.without.rest_pp_n);
    all.largest_n = std::max(all.largest_n, r.with.rest_pp_n);
  }
  return all;
}

std::vector<CalmCell> calm_cells(bool quick) {
  using Doubles = std::vector<double>;
  std::vector<CalmCell> cells;
  for (const bool allow_active : {false, true}) {
    for (const char* contact : {"wall", "peg"}) {
      for (const double k_t : quick ? Doubles{1000, 5000} : Doubles{1000, 2000, 5000}) {
        for (const unsigned delay : {0u, 1u}) {
          for (const double um : quick ? Doubles{0, 60} : Doubles{0, 1, 10, 60}) {
            for (const char* hand : {"loose", "light", "firm"}) {
              cells.push_back({contact, k_t, allow_active, delay, 1e-6 * um, hand});
            }
          }
        }
      }
    }
  }
  return cells;
}

CalmResult run_calm(const CalmCell& cell) {
  const Stage stage = stage_of(cell.contact);
  CalmResult result;
  result.cell = cell;
  SceneParameters parameters = parameters_of(cell, stage, result.inside);
  const CouplingParameters& gains = parameters.coupling;
  result.k_t_n_per_m = gains.k_t_n_per_m;
  result.k_r_nm_per_rad = gains.k_r_nm_per_rad;
  result.damping_ns_per_m = gains.damping_ns_per_m;
  DeviceModel device = kDevice;
  device.encoder_step_m = cell.encoder_step_m;
  device.encoder_step_rad = cell.encoder_step_m / kEncoderLever_m;
  result.allowed_pp_n =
      kSettled_n +
      (cell.contact == "wall"
           ? kRestCounts * gains.k_t_n_per_m * cell.encoder_step_m
           : (cell.encoder_step_m > 0 ? rest_allowance(parameters, device).force_n : 0.0));
  const Traced with = run_once(cell, stage, parameters);
  parameters.coupling.passivity = 0;
  const Traced without = run_once(cell, stage, parameters);
  result.with = with.run;
  result.without = without.run;
  result.same_bits = std::ranges::equal(with.wrenches, without.wrenches, equal_bits);
  result.t_s = with.t_s;
  result.force_n = with.force_n;
  return result;
}

std::vector<OutputText> calm_files(std::span<const CalmResult> results) {
  ReportTable table(
      "gains,contact,asked_n_per_m,k_t_n_per_m,k_r_nm_per_rad,damping_ns_per_m,delay_samples,"
      "encoder_um,hand,inside,allowed_pp_n,rest_pp_n_without,"
      "rest_pp_n,free_ticks,free_n,pull_n,acted_ticks,same_bits,passed");
  for (const CalmResult& r : results) {
    const CalmCell& c = r.cell;
    table.add({c.allow_active ? "asked" : "default", c.contact, shown_as("%g", c.k_t_n_per_m),
               shown_as("%.5g", r.k_t_n_per_m), shown_as("%.4g", r.k_r_nm_per_rad),
               shown_as("%.4g", r.damping_ns_per_m), c.delay_samples,
               shown_as("%g", 1e6 * c.encoder_step_m), c.hand, yes_or_no(r.inside),
               shown_as("%.4f", r.allowed_pp_n), shown_as("%.4f", r.without.rest_pp_n),
               shown_as("%.4f", r.with.rest_pp_n), r.with.free_ticks,
               shown_as("%.4g", r.with.free_n), shown_as("%.4g", r.with.pull_n), r.with.acted_ticks,
               yes_or_no(r.same_bits), yes_or_no(r.passed())});
  }
  const LastResort beyond = last_resort(results);
  const std::string page =
      "# Calm\n\nMade by `host_lab calm`. A part is pressed 8 mm in, held for 2 s and withdrawn at "
      "0.1 m/s, by a device of 0.1 kg and 1 N s/m at 1 kHz, rotor 1e-4 kg m^2 and 1e-3 N m s. "
      "`default`: the compiler's gains for a scene that asks for this stiffness; `asked`: the "
      "stiffness itself, with `allow_active`. `inside`: K T (1/2 + d) < b. Force peak to peak over "
      "the last half second of the hold, largest axis, without the passivity layer and with it; "
      "ticks with a force in free space.\n\nBeyond the budget, where the layer is the last "
      "resort, " +
      std::to_string(beyond.without) + " of " + std::to_string(beyond.cells) +
      " cells do not rest without it (up to " + short_number(beyond.largest_without_n, 3) +
      " N), " + std::to_string(beyond.with) + " with it (up to " +
      short_number(beyond.largest_n, 3) + " N).\n\n" + table.markdown() +
      "\n![worst cells](calm.svg)\n";
  return {{"calm.csv", table.csv()},
          {"calm.json", table.json().dump(2) + "\n"},
          {"calm.md", page},
          {"calm.svg", calm_picture(results)}};
}

}  // namespace haptic::sim
