// SPDX-License-Identifier: Apache-2.0
// host_sim run --scene S.rtscene [--out DIR] [--seconds N] [--hand H] [--rate HZ] [--delay N]
// [--device FILE] [--script FILE] [--json]
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "host_sim/commands/commands.hpp"
#include "host_sim/commands/wcet.hpp"
#include "host_sim/device/device_file.hpp"
#include "host_sim/device/loop_run.hpp"
#include "host_sim/device/pressing_script.hpp"
#include "host_sim/report/output_file.hpp"
#include "host_sim/report/replay_plot.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr double kDefaultSeconds = 6.0, kMostSeconds = 3600.0;

struct Options {
  std::string scene, out, hand = "light", device, script;
  std::optional<double> seconds, rate_hz;
  std::optional<unsigned> delay;
  bool json = false;
};

const char* law_text(LawId law) {
  return law == LawId::kPaper            ? "paper"
         : law == LawId::kWeightedRegion ? "weighted_region"
                                         : "proxy";
}

/// The hand's motion at the loop's rate, `seconds` long when that is given: cut, or held at its
/// end.
std::vector<MotionSample> hand_motion(const Options& o, CoreSession& session, double rate_hz) {
  MotionScript script = o.script.empty()
                            ? pressing_script(session, rate_hz, o.seconds.value_or(kDefaultSeconds))
                            : read_motion_script(o.script);
  script.rate_hz = rate_hz;
  std::vector<MotionSample> motion = make_motion(script);
  if (o.seconds) {
    MotionSample last = motion.back();
    const auto ticks = static_cast<std::size_t>(std::llround(*o.seconds * rate_hz)) + 1;
    motion.resize(std::min(motion.size(), ticks));
    while (motion.size() < ticks) {
      last.t_s = motion.back().t_s + 1.0 / rate_hz;
      motion.push_back(last);
    }
  }
  return motion;
}

nlohmann::ordered_json account(const Options& o, const CoreSession& session,
                               const DeviceModel& device, double rate_hz, const LoopTotals& t,
                               bool passed) {
  nlohmann::ordered_json json;
  json["scene"] = o.scene;
  json["law"] = law_text(session.view().parameters().law);
  json["hand"] = o.hand;
  json["rate_hz"] = rate_hz;
  json["device"] = {{"mass_kg", device.mass_kg},
                    {"damping_ns_per_m", device.damping_ns_per_m},
                    {"rotor_kg_m2", device.rotor_kg_m2},
                    {"rotor_damping_nms_per_rad", device.rotor_damping_nms_per_rad},
                    {"coulomb_friction_n", device.coulomb_force_n},
                    {"coulomb_torque_nm", device.coulomb_torque_nm},
                    {"encoder_step_m", device.encoder_step_m},
                    {"encoder_step_rad", device.encoder_step_rad},
                    {"max_force_n", device.max_force_n},
                    {"max_torque_nm", device.max_torque_nm},
                    {"delay_samples", device.delay_samples}};
  json["ticks"] = t.ticks;
  json["duration_s"] = t.duration_s;
  json["contact_ticks"] = t.contact_ticks;
  json["refused_poses"] = t.refused_poses;
  json["largest_force_n"] = t.largest_force_n;
  json["largest_torque_nm"] = t.largest_torque_nm;
  json["largest_force_step_n"] = t.largest_force_step_n;
  json["largest_force_step_at_s"] = t.force_step_at_s;
  json["largest_torque_step_nm"] = t.largest_torque_step_nm;
  json["largest_torque_step_at_s"] = t.torque_step_at_s;
  json["largest_delivered_j"] = t.largest_delivered_j;
  json["delivered_j"] = t.delivered_j;
  json["least_observed_energy_j"] = t.least_energy_j;
  json["rest_speed_m_per_s"] = t.rest_speed_m_per_s;
  json["rest_turn_rad_per_s"] = t.rest_turn_rad_per_s;
  json["smallest_proxy_gap_m"] = t.smallest_gap_m;
  json["passed"] = passed;
  return json;
}

void print_summary(const Options& o, const CoreSession& session, const DeviceModel& device,
                   double rate_hz, const LoopTotals& t, bool passed) {
  std::printf("closed loop on %s: law %s, %s hand, %g Hz, delay %u\n", o.scene.c_str(),
              law_text(session.view().parameters().law), o.hand.c_str(), rate_hz,
              device.delay_samples);
  std::printf("  ticks            %llu (%.3f s), in contact %llu\n",
              static_cast<unsigned long long>(t.ticks), t.duration_s,
              static_cast<unsigned long long>(t.contact_ticks));
  std::printf("  largest wrench   %.4g N, %.4g N m\n", t.largest_force_n, t.largest_torque_nm);
  std::printf("  largest step     %.4g N at %.4f s, %.4g N m at %.4f s\n", t.largest_force_step_n,
              t.force_step_at_s, t.largest_torque_step_nm, t.torque_step_at_s);
  std::printf(
      "  energy           given out %.4g J at most, %.4g J at the end; observer's least "
      "%.4g J\n",
      t.largest_delivered_j, t.delivered_j, t.least_energy_j);
  std::printf("  in the last tenth %.4g m/s, %.4g rad/s at most\n", t.rest_speed_m_per_s,
              t.rest_turn_rad_per_s);
  std::printf("  result           %s\n", passed ? "passed" : "FAILED");
}

int run(const Options& o) {
  if (!o.out.empty()) {
    std::error_code error;
    std::filesystem::create_directories(o.out, error);
    require_writable_folder(o.out + "/run.csv");
  }
  const std::optional<HandModel> hand = hand_named(o.hand);
  if (!hand) throw tools::InputError("no hand is called '" + o.hand + "'");
  CoreSession session(o.scene);
  const SceneParameters& parameters = session.view().parameters();
  const double rate_hz = o.rate_hz.value_or(parameters.rate_hz);
  DeviceModel device =
      o.device.empty() ? device_of(parameters, rate_hz) : read_device_file(o.device, rate_hz);
  if (o.delay) device.delay_samples = *o.delay;

  ClosedLoop loop(session, device, *hand, rate_hz);
  const std::vector<MotionSample> motion = hand_motion(o, session, rate_hz);
  const std::vector<LoopRecord> records = run_loop(loop, motion);
  const LoopTotals totals = total(records);
  const bool passed = totals.finite && totals.refused_poses == 0 &&
                      within_bounds(session.core().peaks(), session.view().header().capacity);
  const nlohmann::ordered_json json = account(o, session, device, rate_hz, totals, passed);
  if (!o.out.empty()) {
    std::vector<TickRecord> ticks;
    for (const LoopRecord& record : records) ticks.push_back(record.tick);
    const std::string name(session.view().text(parameters.name_offset, parameters.name_bytes));
    write_whole_file(o.out + "/run.csv", loop_csv(records));
    write_whole_file(o.out + "/run.svg", replay_plot(ticks, name + ", " + o.hand + " hand"));
    write_whole_file(o.out + "/run.json", json.dump(2) + "\n");
  }
  if (o.json) {
    std::printf("%s\n", json.dump(2).c_str());
  } else {
    print_summary(o, session, device, rate_hz, totals, passed);
  }
  return passed ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_run_command(CLI::App& program) {
  const auto o = std::make_shared<Options>();
  CLI::App* app = program.add_subcommand(
      "run", "Closes the haptic loop with a simulated device and a simulated hand.");
  app->add_option("--scene", o->scene, "compiled scene (.rtscene)")->required();
  app->add_option("--out", o->out, "folder for run.csv, run.svg and run.json");
  app->add_option("--seconds", o->seconds, "length of the run; default: of the script, or 6")
      ->check(CLI::Range(0.01, kMostSeconds));
  app->add_option("--hand", o->hand, "none, loose, light (default) or firm")
      ->check(CLI::IsMember(hand_names()));
  app->add_option("--rate", o->rate_hz, "rate of the loop [Hz]; default: the scene's")
      ->check(CLI::Range(10.0, 20000.0));
  app->add_option("--delay", o->delay, "samples between a pose and its wrench; default: device's")
      ->check(CLI::Range(0u, kMaxDelaySamples));
  app->add_option("--device", o->device, "device model (TOML); default: the scene's [device]");
  app->add_option("--script", o->script,
                  "motion script of the hand's target (TOML); default: press on the nearest part");
  app->add_flag("--json", o->json, "account as JSON on stdout");
  return {app, [o] { return run(*o); }};
}

}  // namespace haptic::sim
