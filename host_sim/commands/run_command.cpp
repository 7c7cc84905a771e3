// SPDX-License-Identifier: Apache-2.0
// host_sim run --scene S.rtscene [--out DIR] [--seconds N] [--hand H] [--rate HZ] [--delay N]
// [--device FILE] [--script FILE] [--carrier none|direct|usb] [--report-clocked] [--faults FILE]
// [--record FILE] [--html FILE] [--mcap FILE] [--serve [--port N] [--bind ADDRESS]
// [--allow-origin ORIGIN]] [--json]

#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>

#include "hal/clock/servo_clock.hpp"
#include "hal/usb/bus_recorder.hpp"
#include "host_sim/commands/commands.hpp"
#include "host_sim/device/device_fault.hpp"
#include "host_sim/device/pressing_script.hpp"
#include "host_sim/device/rest_judge.hpp"
#include "host_sim/device/simulated_device.hpp"
#include "host_sim/device/stack_run.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/session/counters_check.hpp"
#include "host_sim/session/replay_plot.hpp"
#include "host_sim/view/core_tape.hpp"
#include "host_sim/view/mcap_file.hpp"
#include "host_sim/view/page_file.hpp"
#include "host_sim/view/server/live_session.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/formatted.hpp"
#include "tools/verdict/verdict_json.hpp"

namespace haptic::sim {

namespace {

// The account of `host_sim run`: as JSON, and as text for people.

/// What was run.
struct RunSubject {
  std::string scene, hand;
  LawId law = LawId::kProxy;
  double rate_hz = 0;
  DeviceModel device;
  CouplingParameters rendered{};  ///< the scene's, or what the device holds of it
  std::string lowered;            ///< which of them: a sentence; empty: the scene's
};

/// The whole stack: the same, and what happened between rendering and device.
struct StackSubject {
  RunSubject run;
  std::string carrier, faults_file;
  bool report_clocked = false;
  SafetyLimits limits;
};

/// Names of the bits of `faults`, lowest first.
std::vector<std::string> names_of(std::uint32_t faults) {
  std::vector<std::string> names;
  for (unsigned bit = 0; bit < 32; ++bit) {
    if ((faults >> bit & 1u) != 0) names.emplace_back(fault_text(1u << bit));
  }
  return names;
}

std::string fault_words(std::uint32_t faults) {
  std::string words;
  for (const std::string& name : names_of(faults)) words += (words.empty() ? "" : "; ") + name;
  return words;
}

/// The lines that both forms have.
void print_motion(const LoopTotals& t) {
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
  if (t.runs_away()) {
    std::printf("  RUNS AWAY        %.4g m/s, %.4g rad/s: this hand cannot hold the loop stable\n",
                t.largest_speed_m_per_s, t.largest_turn_rad_per_s);
  }
}

/// Whether the loop comes to rest where the hand does.
void print_rest(const RestOscillation& rest) {
  if (rest.windows == 0) {
    std::printf("  at rest          never: the hand moves all the time\n");
    return;
  }
  std::printf("  at rest          %.4g N, %.4g N m peak to peak, %s", rest.force_pp_n,
              rest.torque_pp_nm, rest.oscillates() ? "OSCILLATES" : "no oscillation");
  if (rest.oscillates()) std::printf(" at %.4g Hz by %.4f s", rest.frequency_hz, rest.at_s);
  std::printf("\n");
}

nlohmann::ordered_json rest_account(const RestOscillation& rest) {
  return {{"windows", rest.windows},
          {"force_peak_to_peak_n", rest.force_pp_n},
          {"torque_peak_to_peak_nm", rest.torque_pp_nm},
          {"share_of_allowed", rest.ratio},
          {"frequency_hz", rest.frequency_hz},
          {"at_s", rest.at_s},
          {"oscillates", rest.oscillates()}};
}

/// The verdict, and what fails a run besides it.
struct RunEnd {
  tools::SessionVerdict verdict;
  std::string other;

  void add_failure(bool failed, const std::string& what) {
    if (failed) other += (other.empty() ? "" : "; ") + what;
  }
  [[nodiscard]] bool passed() const { return other.empty() && !verdict.failed(); }
  [[nodiscard]] std::string line() const {
    return std::string(tools::verdict_line(verdict, other).view());
  }
};

/// What fails the loop over any device.
void add_loop_failures(RunEnd& end, const LoopTotals& t, const RestOscillation& rest,
                       bool bounded) {
  end.add_failure(!t.finite, "a number is not finite");
  end.add_failure(t.runs_away(),
                  tools::formatted("the loop runs away, %.4g m/s and %.4g rad/s: this hand cannot "
                                   "hold it stable",
                                   t.largest_speed_m_per_s, t.largest_turn_rad_per_s));
  end.add_failure(t.refused_poses > 0, std::to_string(t.refused_poses) + " poses were refused");
  end.add_failure(rest.oscillates(),
                  tools::formatted("the loop does not come to rest, %.4g N to and fro at %.4g Hz",
                                   rest.force_pp_n, rest.frequency_hz));
  end.add_failure(!bounded, "a count of work is over its bound");
}

/// The loop that the core closes over the device alone.
nlohmann::ordered_json loop_account(const RunSubject& subject, const LoopTotals& t,
                                    const RestOscillation& rest, const RunEnd& end) {
  const DeviceModel& device = subject.device;
  nlohmann::ordered_json json;
  json["scene"] = subject.scene;
  json["law"] = law_name(subject.law);
  json["hand"] = subject.hand;
  json["rate_hz"] = subject.rate_hz;
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
  json["rendered"] = {{"k_t_n_per_m", subject.rendered.k_t_n_per_m},
                      {"k_r_nm_per_rad", subject.rendered.k_r_nm_per_rad},
                      {"damping_ns_per_m", subject.rendered.damping_ns_per_m},
                      {"lowered", subject.lowered}};
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
  json["largest_speed_m_per_s"] = t.largest_speed_m_per_s;
  json["largest_turn_rad_per_s"] = t.largest_turn_rad_per_s;
  json["runs_away"] = t.runs_away();
  json["rest"] = rest_account(rest);
  json["passed"] = end.passed();
  json["verdict"] = tools::verdict_json(end.verdict, end.line());
  return json;
}

void print_end(const RunEnd& end) {
  std::printf("  result           %s\n", end.passed() ? "passed" : "FAILED");
  std::printf("%s\n", end.line().c_str());
}

void print_loop(const RunSubject& subject, const LoopTotals& t, const RestOscillation& rest,
                const RunEnd& end) {
  std::printf("closed loop on %s: law %s, %s hand, %g Hz, delay %u\n", subject.scene.c_str(),
              law_name(subject.law), subject.hand.c_str(), subject.rate_hz,
              subject.device.delay_samples);
  print_motion(t);
  print_rest(rest);
  print_end(end);
}

nlohmann::ordered_json stack_account(const StackSubject& subject, const StackTotals& t,
                                     const RestOscillation& rest, const hal::LinkCounters& link,
                                     const RunEnd& end) {
  nlohmann::ordered_json json = loop_account(subject.run, t.loop, rest, end);
  const nlohmann::ordered_json verdict = json["verdict"];
  json.erase("passed");
  json.erase("verdict");
  json["carrier"] = subject.carrier;
  json["report_clocked"] = subject.report_clocked;
  json["fault_script"] = subject.faults_file;
  json["limits"] = {{"max_force_n", subject.limits.max_force_n},
                    {"max_torque_nm", subject.limits.max_torque_nm},
                    {"slew_n_per_s", subject.limits.slew_n_per_s},
                    {"slew_nm_per_s", subject.limits.slew_nm_per_s}};
  json["armings"] = t.armings;
  json["faults"] = names_of(t.faults);
  json["fault_bits"] = t.faults;
  json["device_fault_bits"] = t.device_faults;
  json["first_fault_at_s"] = t.first_fault_at_s;
  json["watchdog_cuts"] = t.cuts;
  json["sends"] = t.sends;
  json["largest_handed_force_n"] = t.largest_handed_n;
  json["largest_handed_torque_nm"] = t.largest_handed_nm;
  json["largest_handed_force_step_n"] = t.largest_handed_step_n;
  json["largest_handed_force_step_at_s"] = t.handed_step_at_s;
  json["largest_handed_torque_step_nm"] = t.largest_handed_step_nm;
  json["ended_ready"] = t.ended_ready;
  json["ended_at_zero"] = t.ended_at_zero;
  json["link"] = {{"reports", link.reports},
                  {"states", link.states},
                  {"bad_length", link.bad_length},
                  {"bad_check", link.bad_check},
                  {"bad_number", link.bad_number},
                  {"not_advancing", link.not_advancing},
                  {"sent", link.sent},
                  {"send_busy", link.send_busy},
                  {"send_failed", link.send_failed},
                  {"in_failed", link.in_failed},
                  {"answers_late", link.answers_late},
                  {"connects", link.connects},
                  {"disconnects", link.disconnects},
                  {"guard_held", link.guard_held}};
  json["passed"] = end.passed();
  json["verdict"] = verdict;
  return json;
}

void print_stack(const StackSubject& subject, const StackTotals& t, const RestOscillation& rest,
                 const hal::LinkCounters& link, const RunEnd& end) {
  const RunSubject& run = subject.run;
  std::printf("device stack on %s: carrier %s, %s-clocked, law %s, %s hand, %g Hz, delay %u\n",
              run.scene.c_str(), subject.carrier.c_str(),
              subject.report_clocked ? "report" : "timer", law_name(run.law), run.hand.c_str(),
              run.rate_hz, run.device.delay_samples);
  print_motion(t.loop);
  print_rest(rest);
  std::printf("  handed over      %llu commands, %.4g N, %.4g N m at most\n",
              static_cast<unsigned long long>(t.sends), t.largest_handed_n, t.largest_handed_nm);
  std::printf("  largest step     %.4g N at %.4f s, %.4g N m, of what was handed over\n",
              t.largest_handed_step_n, t.handed_step_at_s, t.largest_handed_step_nm);
  std::printf("  armed            %u times; the device's watchdog cut %u times\n", t.armings,
              t.cuts);
  if (subject.carrier == "usb") {
    const auto wrong = link.bad_length + link.bad_check + link.bad_number + link.not_advancing;
    std::printf(
        "  link             %llu reports, %llu wrong; %llu sent, %llu failed; lost %llu "
        "times\n",
        static_cast<unsigned long long>(link.reports), static_cast<unsigned long long>(wrong),
        static_cast<unsigned long long>(link.sent),
        static_cast<unsigned long long>(link.send_failed + link.in_failed),
        static_cast<unsigned long long>(link.disconnects));
  }
  const std::string faults = fault_words(t.faults);
  if (faults.empty()) {
    std::printf("  faults           none\n");
  } else {
    std::printf("  faults           first at %.4f s: %s\n", t.first_fault_at_s, faults.c_str());
  }
  print_end(end);
}

constexpr double kDefaultSeconds = 6.0, kMostSeconds = 3600.0;

struct RunArguments {
  std::string scene, out, html, mcap, hand = "light", device, script, carrier = "none", faults,
                                      record;
  std::optional<double> seconds, rate_hz;
  std::optional<unsigned> delay;
  bool report_clocked = false, json = false, serve = false;
  ServeOptions live;
};

/// The hand's motion at the loop's rate, `seconds` long when that is given: cut, or held at its
/// end.
std::vector<MotionSample> hand_motion(const RunArguments& o, CoreSession& session, double rate_hz) {
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

/// A hand that presses on the nearest part, in the time that this takes.
bool is_made_to_press(const RunArguments& o) {
  return o.script.empty() && !o.seconds && o.hand != "none";
}

std::string title_of(const RunArguments& o, const CoreSession& session) {
  return scene_title(session.view()) + ", " + o.hand + " hand";
}

/// Writes the files, and the account to stdout where that is asked for.
void keep(const RunArguments& o, const std::string& csv, const std::string& svg,
          const nlohmann::ordered_json& json) {
  if (!o.out.empty()) {
    write_whole_file(o.out + "/run.csv", csv);
    write_whole_file(o.out + "/run.svg", svg);
    write_whole_file(o.out + "/run.json", json.dump(2) + "\n");
  }
  if (o.json) std::printf("%s\n", json.dump(2).c_str());
}

void stay(LiveSession& live) {
  std::fflush(stdout);
  std::fprintf(stderr, "host_sim: the session stays to be seen until this is stopped (^C)\n");
  live.wait_for_stop();
}

/// The loop in real time, for those who watch. Stopped, it goes on as fast as it can.
std::vector<LoopRecord> run_watched(ClosedLoop& loop, std::span<const MotionSample> motion,
                                    LiveSession& live, double rate_hz) {
  live.begin();
  const std::int64_t begin_ns = hal::monotonic_ns();
  std::vector<LoopRecord> records = run_loop(loop, motion, [&](const LoopRecord& record) {
    live.publish(record, rate_hz);
    const double due_s = static_cast<double>(record.tick.tick + 1) / rate_hz;
    if (!live.is_stopped()) (void)hal::sleep_until(begin_ns + std::llround(1e9 * due_s));
  });
  live.finish();
  return records;
}

bool run_alone(const RunArguments& o, CoreSession& session, const RunSubject& subject,
               const HandModel& hand) {
  const std::string page = o.html.empty() ? std::string() : read_page();
  std::optional<LiveSession> live;
  if (o.serve) live.emplace(o.live, session.view(), false);
  ClosedLoop loop(session, subject.device, hand, subject.rate_hz);
  const std::vector<MotionSample> motion = hand_motion(o, session, subject.rate_hz);
  const std::vector<LoopRecord> records =
      live ? run_watched(loop, motion, *live, subject.rate_hz) : run_loop(loop, motion);
  const LoopTotals totals = total(records);
  const RestOscillation rest =
      rest_oscillation(records, rest_allowance(session.view().parameters(), subject.device));
  tools::SessionJudge judge(session.view());
  if (is_made_to_press(o)) judge.expect_contact();
  std::vector<TickRecord> ticks;
  for (const LoopRecord& record : records) {
    ticks.push_back(record.tick);
    judge.take(judged_tick(record.tick));
    judge.note_work(record.delivered_j);
  }
  RunEnd end{judge.verdict(), {}};
  add_loop_failures(end, totals, rest,
                    within_bounds(session.core().peaks(), session.view().header().capacity));
  if (!o.mcap.empty()) write_whole_file(o.mcap, mcap_of(session.view(), records));
  if (!o.html.empty()) {
    std::vector<RecordedTick> recorded;
    for (const LoopRecord& record : records)
      recorded.push_back(recorded_tick(record, subject.rate_hz));
    write_whole_file(o.html, filled_page(page, session.view(), recorded));
  }
  keep(o, loop_csv(records, GuideLegs(session.view())), replay_plot(ticks, title_of(o, session)),
       loop_account(subject, totals, rest, end));
  if (!o.json) print_loop(subject, totals, rest, end);
  if (live) stay(*live);
  return end.passed();
}

/// Everyone who looks at the servo ticks of a run.
struct StackWatchers {
  hal::BusRecorder* recorder = nullptr;
  CoreTape* tape = nullptr;
  std::optional<RecordedTick> newest;  ///< of the tape, since it was last taken away

  static void watch(void* self, const ServoInput& input, const ServoResult& result) {
    auto& watchers = *static_cast<StackWatchers*>(self);
    if (watchers.recorder != nullptr) hal::BusRecorder::watch(watchers.recorder, input, result);
    if (watchers.tape == nullptr) return;
    const std::optional<RecordedTick> tick = watchers.tape->take(input, result);
    if (tick) watchers.newest = tick;
  }
};

/// In real time, for those who watch. Stopped, it goes on as fast as it can.
std::vector<StackRecord> run_stack_watched(DeviceStack& stack, std::span<const MotionSample> motion,
                                           LiveSession& live, StackWatchers& watchers) {
  const std::int64_t begin_ns = hal::monotonic_ns();
  std::vector<StackRecord> records = run_stack(stack, motion, [&](const StackRecord& record) {
    if (watchers.newest) live.publish(*watchers.newest, record.loop);
    watchers.newest.reset();
    const double due_s = static_cast<double>(record.loop.tick.tick + 1) * stack.period_s();
    if (!live.is_stopped()) (void)hal::sleep_until(begin_ns + std::llround(1e9 * due_s));
  });
  live.finish();
  return records;
}

/// The run, and its session in a file where that is asked for.
std::vector<StackRecord> run_recorded(const RunArguments& o, DeviceStack& stack,
                                      std::span<const MotionSample> motion, StackWatchers& watchers,
                                      LiveSession* live) {
  std::optional<hal::BusRecorder> kept;
  if (!o.record.empty())
    watchers.recorder = &kept.emplace(o.record, stack.bus_session(), hal::RecorderDrain::kCaller);
  stack.record(watchers.recorder, &StackWatchers::watch, &watchers);
  std::vector<StackRecord> records = live != nullptr
                                         ? run_stack_watched(stack, motion, *live, watchers)
                                         : run_stack(stack, motion, [&kept](const StackRecord&) {
                                             if (kept) static_cast<void>(kept->drain());
                                           });
  stack.record(nullptr, nullptr, nullptr);
  if (!kept) return records;
  hal::BusRecorder& recorder = *kept;
  const hal::RecorderEnd end = recorder.finish();
  if (end.status != hal::HalStatus::kOk)
    throw std::system_error(end.os_error, std::generic_category(), o.record);
  if (!end.playable())
    std::fprintf(stderr,
                 "host_sim: %s: %llu events and %llu ticks were dropped; it cannot be played\n",
                 o.record.c_str(), static_cast<unsigned long long>(end.counts.dropped_events),
                 static_cast<unsigned long long>(end.counts.dropped_ticks));
  return records;
}

/// Without a fault script nothing may go wrong; with one, the hand must be let go in the end.
bool run_device(const RunArguments& o, CoreSession& session, const RunSubject& run,
                const HandModel& hand) {
  const bool usb = o.carrier == "usb";
  const SceneParameters& parameters = session.view().parameters();
  StackSettings settings =
      stack_over(usb ? StackCarrier::kUsb : StackCarrier::kDirect, run.device,
                 o.device.empty() ? parameters.device : DeviceParameters{}, hand, run.rate_hz);
  settings.report_clocked = o.report_clocked;
  std::vector<DeviceFaultEvent> events;
  if (!o.faults.empty()) events = read_fault_script(o.faults, run.rate_hz);
  const std::vector<MotionSample> motion = hand_motion(o, session, run.rate_hz);
  const std::string page = o.html.empty() ? std::string() : read_page();
  std::optional<LiveSession> live;
  if (o.serve) {
    live.emplace(o.live, session.view(), false);
    live->begin();
  }
  DeviceStack stack(session, settings, scripted_hand(session, motion, run.rate_hz));
  for (const DeviceFaultEvent& event : events) stack.bus().add(event);
  std::optional<CoreTape> tape;
  StackWatchers watchers;
  if (live || !o.html.empty())
    watchers.tape = &tape.emplace(session.view(), stack.bus_session().servo);
  const std::vector<StackRecord> records =
      run_recorded(o, stack, motion, watchers, live ? &*live : nullptr);
  if (!o.html.empty()) write_whole_file(o.html, filled_page(page, session.view(), tape->ticks()));

  const StackTotals totals = total(records);
  const hal::LinkCounters link = stack.link_counters();
  tools::SessionJudge judge(session.view());
  if (is_made_to_press(o)) judge.expect_contact();
  std::vector<LoopRecord> felt;
  for (const StackRecord& record : records) {
    felt.push_back(record.loop);
    if (record.rendered_new) judge.take(judged_tick(record.loop.tick));
    judge.note_work(record.loop.delivered_j);
  }
  if (!o.mcap.empty()) write_whole_file(o.mcap, mcap_of(session.view(), felt));
  const RestOscillation rest = rest_oscillation(felt, rest_allowance(parameters, run.device));
  RunEnd end{judge.verdict(), {}};
  add_loop_failures(end, totals.loop, rest,
                    within_bounds(session.core().peaks(), session.view().header().capacity));
  if (events.empty()) {
    end.add_failure(totals.faults != 0,
                    tools::formatted("a fault at %.4f s: ", totals.first_fault_at_s) +
                        fault_words(totals.faults));
    end.add_failure(!totals.ended_ready, "the link is not ready at the end");
  }
  end.add_failure(!totals.ended_at_zero, "the last wrench handed over is not zero");
  const StackSubject subject{run, o.carrier, o.faults, o.report_clocked, settings.limits};
  const std::string title = title_of(o, session) + ", carrier " + o.carrier;
  keep(o, stack_csv(records, GuideLegs(session.view())), stack_plot(records, title),
       stack_account(subject, totals, rest, link, end));
  if (!o.json) print_stack(subject, totals, rest, link, end);
  if (live) stay(*live);
  return end.passed();
}

int do_run(const RunArguments& o) {
  tools::claim_folder(o.out, "--out", {"run.csv", "run.svg", "run.json"});
  tools::claim_output(o.record, "--record");
  tools::claim_output(o.html, "--html");
  tools::claim_output(o.mcap, "--mcap");
  const std::optional<HandModel> hand = hand_named(o.hand);
  if (!hand) throw tools::InputError("no hand is called '" + o.hand + "'");
  CoreSession session(o.scene);
  const SceneParameters& parameters = session.view().parameters();
  RunSubject subject{o.scene, o.hand, parameters.law, o.rate_hz.value_or(parameters.rate_hz), {},
                     {},      {}};
  subject.device = o.device.empty() ? device_of(parameters, subject.rate_hz)
                                    : read_device_file(o.device, subject.rate_hz);
  if (o.delay) subject.device.delay_samples = *o.delay;
  // Through a carrier a command goes out with the next report.
  const bool waits = o.carrier != "none" && !o.report_clocked;
  subject.lowered =
      fit_to_device(session, subject.device, subject.rate_hz, waits ? 1 / subject.rate_hz : 0);
  subject.rendered = session.view().parameters().coupling;
  if (!subject.lowered.empty()) std::fprintf(stderr, "host_sim: %s\n", subject.lowered.c_str());
  const bool passed = o.carrier == "none" ? run_alone(o, session, subject, *hand)
                                          : run_device(o, session, subject, *hand);
  return passed ? tools::kExitDone : tools::kExitCheckFailed;
}

/// What CLI11 cannot say by itself. @throws tools::UsageError.
void check_carrier(const RunArguments& o) {
  if (o.carrier == "none" && o.report_clocked)
    throw tools::UsageError("--report-clocked: needs --carrier direct or usb");
  if (o.serve && o.json)
    throw tools::UsageError("--json: not with --serve, which says its address on stdout");
  if (o.serve && !o.record.empty())
    throw tools::UsageError("--record: not with --serve, whose waiting it would record");
  if (o.carrier != "usb" && !o.faults.empty())
    throw tools::UsageError("--faults: needs --carrier usb: they are of the bus");
  if (o.carrier != "usb" && !o.record.empty())
    throw tools::UsageError("--record: needs --carrier usb: it records the bus");
  if (o.carrier != "none" && o.rate_hz &&
      (*o.rate_hz < kLeastReportRate_hz || *o.rate_hz > kMostReportRate_hz)) {
    throw tools::UsageError("--rate: the device of a carrier reports at 50 to 10000 Hz");
  }
}

}  // namespace

Command add_run_command(CLI::App& program) {
  const auto o = std::make_shared<RunArguments>();
  CLI::App* app = program.add_subcommand(
      "run", "Closes the haptic loop with a simulated device and a simulated hand.");
  app->add_option("scene,--scene", o->scene, "compiled scene (.rtscene)")->required();
  app->add_option("-o,--out", o->out, "folder for run.csv, run.svg and run.json");
  app->add_option("--html", o->html,
                  "page to write: the session to see and to move in, checked tick by tick");
  app->add_option("--mcap", o->mcap,
                  "MCAP file to write, for Foxglove, Lichtblick and PlotJuggler");
  app->add_flag("--serve", o->serve,
                "run in real time, to be watched in a browser or viewer; stays until it is stopped "
                "(^C)");
  add_serve_options(*app, o->live);
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
  app->add_option("--carrier", o->carrier,
                  "none (default): the core alone closes the loop; direct: through the protocol, "
                  "guard and servo tick of a device; usb: through libusb as well")
      ->check(CLI::IsMember({"none", "direct", "usb"}));
  app->add_flag("--report-clocked", o->report_clocked,
                "a command answers the report that it was computed from; with a carrier");
  app->add_option("--faults", o->faults, "fault script of device and bus (TOML); carrier usb");
  app->add_option("--record", o->record,
                  "file for the session: every report, send and tick, for `play`; carrier usb");
  app->add_flag("--json", o->json, "account as JSON on stdout");
  app->final_callback([o] { check_carrier(*o); });
  return {app, [o] { return do_run(*o); }, "host_sim run --scene peg.rtscene --out run"};
}

}  // namespace haptic::sim
