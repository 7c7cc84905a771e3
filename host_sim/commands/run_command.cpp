// SPDX-License-Identifier: Apache-2.0
// host_sim run --scene S.rtscene [--out DIR] [--seconds N] [--hand H] [--rate HZ] [--delay N]
// [--device FILE] [--script FILE] [--script2 FILE] [--drive PART=MOTION].. [--carrier
// none|direct|usb]
// [--report-clocked] [--faults FILE]
// [--record FILE] [--html FILE] [--mcap FILE] [--serve [--port N] [--bind ADDRESS]
// [--allow-origin ORIGIN]] [--json]

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "hal/clock/servo_clock.hpp"
#include "hal/usb/bus_recorder.hpp"
#include "host_sim/commands/commands.hpp"
#include "host_sim/commands/run_account.hpp"
#include "host_sim/commands/run_arguments.hpp"
#include "host_sim/commands/two_hand_run.hpp"
#include "host_sim/device/device_fault.hpp"
#include "host_sim/device/pressing_script.hpp"
#include "host_sim/device/rest_judge.hpp"
#include "host_sim/device/simulated_device.hpp"
#include "host_sim/device/stack_run.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/session/counters_check.hpp"
#include "host_sim/session/other_motion.hpp"
#include "host_sim/session/replay_plot.hpp"
#include "host_sim/view/core_tape.hpp"
#include "host_sim/view/loop_ticks.hpp"
#include "host_sim/view/mcap_file.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/formatted.hpp"
#include "tools/live/live_session.hpp"
#include "tools/live/page_file.hpp"
#include "tools/verdict/verdict_json.hpp"

namespace haptic::sim {

namespace {

constexpr double kMostSeconds = 3600.0;

std::string title_of(const RunArguments& o, const CoreSession& session) {
  return scene_title(session.view()) + ", " + o.hand + " hand";
}

OtherMotion other_motion(const RunArguments& o, CoreSession& session, const HandWay& way) {
  OtherMotion others(session, way.holds, o.drives);
  if (!o.html.empty() || !o.mcap.empty() || o.serve) others.tape(!o.mcap.empty());
  return others;
}

/// The loop in real time, for those who watch. Stopped, it goes on as fast as it can.
std::vector<LoopRecord> run_watched(ClosedLoop& loop, std::span<const MotionSample> motion,
                                    OtherMotion& others, tools::LiveSession& live, double rate_hz) {
  live.begin();
  const std::int64_t begin_ns = hal::monotonic_ns();
  const auto after = [&](const LoopRecord& record) {
    others.after_tick(record.tick);
    tools::RecordedTick tick = recorded_tick(record, rate_hz);
    others.kept().mark(tick, record.tick.tick);
    live.publish(tick, others.shown(record.tick), others.kept().newest());
    const double due_s = static_cast<double>(record.tick.tick + 1) / rate_hz;
    if (!live.is_stopped()) (void)hal::sleep_until(begin_ns + std::llround(1e9 * due_s));
  };
  std::vector<LoopRecord> records =
      run_loop(loop, motion, after, [&](double t_s) { others.before_tick(t_s); });
  live.finish();
  return records;
}

bool run_alone(const RunArguments& o, CoreSession& session, const RunSubject& subject,
               const HandModel& hand) {
  const std::string page = o.html.empty() ? std::string() : tools::read_page();
  std::optional<tools::LiveSession> live;
  if (o.serve) live.emplace(o.live, session.view(), false);
  ClosedLoop loop(session, subject.device, hand, subject.rate_hz);
  const HandWay way = hand_way(o, o.script, session, subject.rate_hz);
  OtherMotion others = other_motion(o, session, way);
  const std::vector<LoopRecord> records =
      live
          ? run_watched(loop, way.motion, others, *live, subject.rate_hz)
          : run_loop(
                loop, way.motion, [&](const LoopRecord& record) { others.after_tick(record.tick); },
                [&](double t_s) { others.before_tick(t_s); });
  const LoopTotals totals = total(records);
  const RestOscillation rest =
      rest_oscillation(records, rest_allowance(session.view().parameters(), subject.device));
  tools::SessionJudge judge(session.view());
  if (o.is_made_to_press()) judge.expect_contact();
  std::vector<TickRecord> ticks;
  for (std::size_t k = 0; k < records.size(); ++k) {
    ticks.push_back(records[k].tick);
    judge.take(judged_tick(records[k].tick));
    judge.note_work(records[k].delivered_j - others.given_j()[k]);
  }
  RunEnd end{judge.verdict(), {}};
  add_loop_failures(end, totals, rest, within_bounds(session.core().peaks(), session.bounds()));
  const std::string of_others = others.failures();
  end.add_failure(!of_others.empty(), of_others);
  if (!o.mcap.empty()) write_whole_file(o.mcap, mcap_of(session.view(), records, others.driven()));
  if (!o.html.empty()) {
    std::vector<tools::RecordedTick> recorded;
    for (const LoopRecord& record : records) {
      recorded.push_back(recorded_tick(record, subject.rate_hz));
      others.kept().mark(recorded.back(), record.tick.tick);
    }
    write_whole_file(o.html,
                     tools::filled_page(page, session.view(), recorded, {}, others.kept().given()));
  }
  o.keep({{"run.csv", loop_csv(records, GuideLegs(session.view()))},
          {"run.svg",
           replay_plot(ticks, title_of(o, session), session.view().parameters().exact_band_m)}},
         loop_account(subject, totals, rest, told_by(others), end));
  o.keep_drives(others.drives());
  if (!o.json) print_loop(subject, totals, rest, told_by(others), end);
  if (live) stay(*live);
  return end.passed();
}

/// Everyone who looks at the servo ticks of a run.
struct StackWatchers {
  hal::BusRecorder* recorder = nullptr;
  CoreTape* tape = nullptr;
  std::optional<tools::RecordedTick> newest;  ///< of the tape, since it was last taken away

  static void watch(void* self, const ServoInput& input, const ServoResult& result) {
    auto& watchers = *static_cast<StackWatchers*>(self);
    if (watchers.recorder != nullptr) hal::BusRecorder::watch(watchers.recorder, input, result);
    if (watchers.tape == nullptr) return;
    const std::optional<tools::RecordedTick> tick = watchers.tape->take(input, result);
    if (tick) watchers.newest = tick;
  }
};

/// In real time, for those who watch. Stopped, it goes on as fast as it can.
std::vector<StackRecord> run_stack_watched(DeviceStack& stack, std::span<const MotionSample> motion,
                                           OtherMotion& others, tools::LiveSession& live,
                                           StackWatchers& watchers) {
  const std::int64_t begin_ns = hal::monotonic_ns();
  const auto after = [&](const StackRecord& record) {
    others.after_tick(record.loop.tick);
    if (watchers.newest) live.publish(*watchers.newest, others.shown(record.loop.tick));
    watchers.newest.reset();
    const double due_s = static_cast<double>(record.loop.tick.tick + 1) * stack.period_s();
    if (!live.is_stopped()) (void)hal::sleep_until(begin_ns + std::llround(1e9 * due_s));
  };
  std::vector<StackRecord> records =
      run_stack(stack, motion, after, [&](double t_s) { others.give(stack, t_s); });
  live.finish();
  return records;
}

/// The run, and its session in a file where that is asked for.
std::vector<StackRecord> run_recorded(const RunArguments& o, CoreSession& session,
                                      DeviceStack& stack, std::span<const MotionSample> motion,
                                      OtherMotion& others, StackWatchers& watchers,
                                      tools::LiveSession* live) {
  std::optional<hal::BusRecorder> kept;
  if (!o.record.empty()) {
    watchers.recorder = &kept.emplace(o.record, stack.bus_session(), hal::RecorderDrain::kCaller);
    if (session.hand() != nullptr) kept->follow(*session.hand());
  }
  stack.record(watchers.recorder, &StackWatchers::watch, &watchers);
  const auto after = [&](const StackRecord& record) {
    others.after_tick(record.loop.tick);
    if (kept) static_cast<void>(kept->drain());
  };
  std::vector<StackRecord> records =
      live != nullptr
          ? run_stack_watched(stack, motion, others, *live, watchers)
          : run_stack(stack, motion, after, [&](double t_s) { others.give(stack, t_s); });
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
  const bool has_driven = session.parts() != nullptr && !session.parts()->driven().empty();
  if (has_driven && (!o.html.empty() || o.serve))
    throw tools::UsageError(
        "--carrier: a page computes the ticks of a scene with driven parts again only without a "
        "carrier; leave it out, or --html and --serve: --mcap and --out DIR have the driven parts");
  const bool usb = o.carrier == "usb";
  const SceneParameters& parameters = session.view().parameters();
  StackSettings settings =
      stack_over(usb ? StackCarrier::kUsb : StackCarrier::kDirect, run.device,
                 o.device.empty() ? parameters.device : DeviceParameters{}, hand, run.rate_hz);
  settings.report_clocked = o.report_clocked;
  std::vector<DeviceFaultEvent> events;
  if (!o.faults.empty()) events = read_fault_script(o.faults, run.rate_hz);
  const HandWay way = hand_way(o, o.script, session, run.rate_hz);
  const std::vector<MotionSample>& motion = way.motion;
  const std::string page = o.html.empty() ? std::string() : tools::read_page();
  std::optional<tools::LiveSession> live;
  if (o.serve) {
    live.emplace(o.live, session.view(), false);
    live->begin();
  }
  DeviceStack stack(session, settings, scripted_hand(session, motion, run.rate_hz));
  for (const DeviceFaultEvent& event : events) stack.bus().add(event);
  OtherMotion others = other_motion(o, session, way);
  std::optional<CoreTape> tape;
  StackWatchers watchers;
  if (live || !o.html.empty())
    watchers.tape = &tape.emplace(session.view(), stack.bus_session().servo);
  const std::vector<StackRecord> records =
      run_recorded(o, session, stack, motion, others, watchers, live ? &*live : nullptr);
  if (!o.html.empty())
    write_whole_file(o.html, tools::filled_page(page, session.view(), tape->ticks()));

  const StackTotals totals = total(records);
  const hal::LinkCounters link = stack.link_counters();
  tools::SessionJudge judge(session.view());
  if (o.is_made_to_press()) judge.expect_contact();
  std::vector<LoopRecord> felt;
  for (std::size_t k = 0; k < records.size(); ++k) {
    const LoopRecord& record = records[k].loop;
    felt.push_back(record);
    if (records[k].rendered_new) judge.take(judged_tick(record.tick));
    judge.note_work(record.delivered_j - others.given_j()[k]);
  }
  if (!o.mcap.empty()) write_whole_file(o.mcap, mcap_of(session.view(), felt, others.driven()));
  const RestOscillation rest = rest_oscillation(felt, rest_allowance(parameters, run.device));
  RunEnd end{judge.verdict(), {}};
  add_loop_failures(end, totals.loop, rest,
                    within_bounds(session.core().peaks(), session.bounds()));
  const std::string of_others = others.failures();
  end.add_failure(!of_others.empty(), of_others);
  if (events.empty()) {
    end.add_failure(totals.faults != 0,
                    tools::formatted("a fault at %.4f s: ", totals.first_fault_at_s) +
                        fault_words(totals.faults));
    end.add_failure(!totals.ended_ready, "the link is not ready at the end");
  }
  end.add_failure(!totals.ended_at_zero, "the last wrench handed over is not zero");
  const StackSubject subject{run, o.carrier, o.faults, o.report_clocked, settings.limits};
  const std::string title = title_of(o, session) + ", carrier " + o.carrier;
  o.keep({{"run.csv", stack_csv(records, GuideLegs(session.view()))},
          {"run.svg", stack_plot(records, title, session.view().parameters().exact_band_m)}},
         stack_account(subject, totals, rest, told_by(others), link, end));
  o.keep_drives(others.drives());
  if (!o.json) print_stack(subject, totals, rest, told_by(others), link, end);
  if (live) stay(*live);
  return end.passed();
}

int do_run(const RunArguments& o) {
  const std::optional<HandModel> hand = hand_named(o.hand);
  if (!hand) throw tools::InputError("no hand is called '" + o.hand + "'");
  CoreSession session(o.scene);
  tools::claim_folder(o.out, "--out",
                      {"run.csv", "run.svg", "run2.csv", "run2.svg", "run.json", "driven.csv"});
  tools::claim_output(o.record, "--record", {tools::FileFormat::kRecording, {}});
  tools::claim_output(o.html, "--html", {tools::FileFormat::kHtml, {}});
  tools::claim_output(o.mcap, "--mcap", {tools::FileFormat::kMcap, {}});
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
  const bool has_two = session.hands() != nullptr && session.hands()->count() > 1;
  if (!has_two && !o.script2.empty())
    throw tools::UsageError(
        "--script2: " + o.scene +
        " has one hand; leave it out, or give a [[part]] of the scene role = \"hand2\"");
  const bool passed = has_two               ? run_two_hands(o, session, subject, *hand)
                      : o.carrier == "none" ? run_alone(o, session, subject, *hand)
                                            : run_device(o, session, subject, *hand);
  return passed ? tools::kExitDone : tools::kExitCheckFailed;
}

/// Checks that CLI11 cannot make. @throws tools::UsageError.
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
  tools::add_serve_options(*app, o->live);
  app->add_option("--seconds", o->seconds, "length of the run; default: of the script, or 6")
      ->check(CLI::Range(0.01, kMostSeconds));
  app->add_option("--hand", o->hand, "none, loose, light (default) or firm")
      ->check(CLI::IsMember(hand_names()));
  app->add_option("--rate", o->rate_hz, "rate of the loop [Hz]; default: the scene's")
      ->check(tools::number_within(10.0, 20000.0));
  app->add_option("--delay", o->delay, "samples between a pose and its wrench; default: device's")
      ->check(CLI::Range(0u, kMaxDelaySamples));
  app->add_option("--device", o->device, "device model (TOML); default: the scene's [device]");
  app->add_option("--script", o->script,
                  "motion script of the hand's target (TOML); default: press on the nearest part");
  app->add_option("--script2", o->script2,
                  "of the second hand, in a scene with role \"hand2\"; default: it holds still");
  app->add_option("--drive", o->drives, kDriveHelp);
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
  return {app,
          [o] { return do_run(*o); },
          "host_sim run --scene peg.rtscene --out run",
          {{"--motion",
            "in a run a hand follows way points: --script MOTION.toml; 'host_sim replay' plays a "
            "motion"}}};
}

}  // namespace haptic::sim
