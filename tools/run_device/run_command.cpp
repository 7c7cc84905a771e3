// SPDX-License-Identifier: Apache-2.0
// run_device run CONFIG.toml [--seconds N] [--ticks N] [--device NAME] [--status-every S]
// [--serve [--port N] [--bind ADDRESS] [--allow-origin ORIGIN]] [--json]

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "hal/realtime/flight_report.hpp"
#include "hal/realtime/process_hardening.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/formatted.hpp"
#include "tools/live/live_trace.hpp"
#include "tools/run_device/arming_words.hpp"
#include "tools/run_device/commands.hpp"
#include "tools/run_device/device_run.hpp"
#include "tools/run_device/run_events.hpp"
#include "tools/run_device/teller.hpp"
#include "tools/verdict/verdict_json.hpp"

namespace haptic::tools {
namespace {

// Summary of a run, for people and for programs.

using nlohmann::ordered_json;

constexpr const char* kDegreeNames[kLateDegrees] = {"in_time", "within_period", "held", "beyond"};

unsigned long long wide(std::uint64_t value) { return value; }

std::string errno_name(int error) {
  const char* name = strerrorname_np(error);
  const char* text = strerrordesc_np(error);
  return std::string(name != nullptr ? name : "errno " + std::to_string(error)) + " (" +
         (text != nullptr ? text : "unknown") + ")";
}

ordered_json late_json(const TickCounts& counts) {
  ordered_json late;
  for (std::size_t k = 0; k < kLateDegrees; ++k) late[kDegreeNames[k]] = counts.late[k];
  return late;
}

ordered_json causes_json(const TickCounts& counts) {
  ordered_json causes;
  for (std::size_t k = 0; k < hal::kLateCauses; ++k)
    causes[hal::to_text(static_cast<hal::LateCause>(k))] = counts.causes[k];
  return causes;
}

ordered_json link_json(const hal::LinkCounters& c) {
  return {{"connects", c.connects},         {"disconnects", c.disconnects},
          {"reports", c.reports},           {"states", c.states},
          {"bad_length", c.bad_length},     {"bad_check", c.bad_check},
          {"bad_number", c.bad_number},     {"not_advancing", c.not_advancing},
          {"in_failed", c.in_failed},       {"sent", c.sent},
          {"send_busy", c.send_busy},       {"send_failed", c.send_failed},
          {"answers_late", c.answers_late}, {"guard_held", c.guard_held}};
}

double us(std::int64_t ns) { return 1e-3 * static_cast<double>(ns); }

std::string times_text(const char* name, const hal::IntervalHistogram& h) {
  return formatted("  %-12sp50 %.1f, p99 %.1f, p99.9 %.1f, largest %.1f us\n", name,
                   us(h.quantile_ns(0.5)), us(h.quantile_ns(0.99)), us(h.quantile_ns(0.999)),
                   us(h.largest_ns()));
}

ordered_json times_json(const hal::IntervalHistogram& h) {
  ordered_json json = {{"count", h.count()},
                       {"sum_ns", h.sum_ns()},
                       {"p50_ns", h.quantile_ns(0.5)},
                       {"p99_ns", h.quantile_ns(0.99)},
                       {"p99_9_ns", h.quantile_ns(0.999)},
                       {"largest_ns", h.largest_ns()}};
  // From the first class with anything in it to the one that has all; the last is of what is
  // beyond.
  ordered_json& classes = json["histogram"] = ordered_json::array();
  std::uint64_t before = 0;
  for (unsigned k = 0; k <= hal::IntervalHistogram::kDoublings; ++k) {
    const std::uint64_t shorter = h.shorter_than(k);
    if (shorter > before)
      classes.push_back(
          {{"below_ns", hal::IntervalHistogram::kExactNs << k}, {"count", shorter - before}});
    before = shorter;
  }
  if (h.overflows() > 0) classes.push_back({{"below_ns", nullptr}, {"count", h.overflows()}});
  return json;
}

std::string ending_text(const RunEnding& e) {
  if (e.outputs == 0) return "no output after the end was asked for\n";
  return formatted("%.3g N when asked, then %llu outputs; the last %.3g N, %.3g N m\n", e.force_n,
                   wide(e.outputs), e.last_force_n, e.last_torque_nm);
}

/// One line, without its end: time, ticks, late ones by degree, link, arming, force, faults.
std::string status_text(const RunStatus& s) {
  const TickCounts& c = s.servo.counts;
  std::string line =
      formatted("%7.1f s  %llu ticks, late %llu/%llu/%llu  link %s  %s  %.2f N %.3f N m", s.t_s,
                wide(c.ticks), wide(c.late[1]), wide(c.late[2]), wide(c.late[3]), to_text(s.link),
                s.is_silent() ? "silent" : to_text(s.servo.arming), s.force_n, s.torque_nm);
  const std::string faults = faults_text(s.servo.safety_faults, s.device_faults());
  if (!faults.empty()) line += "  " + faults;
  const std::string wait = wait_text(s.servo.arming_news);
  if (!wait.empty()) line += "\n           not armed: " + wait;
  if (!s.trouble.empty()) line += "\n         " + s.trouble;
  return line;
}

/// {"kind": "status", ...}
ordered_json status_json(const RunStatus& s) {
  const TickCounts& c = s.servo.counts;
  return {{"kind", "status"},
          {"t_s", s.t_s},
          {"ticks", c.ticks},
          {"late", late_json(c)},
          {"link", to_text(s.link)},
          {"trouble", s.trouble},
          {"arming", s.is_silent() ? "silent" : to_text(s.servo.arming)},
          {"armings", c.armings},
          {"force_n", s.force_n},
          {"torque_nm", s.torque_nm},
          {"asked_force_n", s.servo.force_n},
          {"asked_torque_nm", s.servo.torque_nm},
          {"silent_s", 1e-9 * static_cast<double>(s.silence_ns)},
          {"d_near_m", s.servo.d_near_m},
          {"waits_for", wait_text(s.servo.arming_news)},
          {"inside_ticks", s.servo.arming_news.inside_ticks},
          {"safety_faults", hal::safety_fault_texts(s.servo.safety_faults)},
          {"device_faults", hal::device_fault_texts(s.device_faults())},
          {"reports", s.counters.reports},
          {"sent", s.counters.sent}};
}

/// A line for each, and one with the fix.
std::string refusals_text(const std::vector<Refusal>& refusals, bool strict) {
  std::string text;
  for (const Refusal& refusal : refusals)
    text += "not granted: " + refusal.what + ": " + errno_name(refusal.error) + "\n";
  text += strict ? "refused: without these the force may be late or held too long. "
                   "--allow-degraded runs all the same, a device with motors with half its force "
                   "or less. "
                 : "degraded: the loop runs without it; ticks will be late when the machine is "
                   "busy. ";
  return text + "Mend: run_device doctor says how\n";
}

/// The last line: the verdict, or why the run failed otherwise. That no force was ever given is
/// said too.
std::string verdict_text(const RunAccount& a) {
  std::string other;
  if (a.exit_code != kExitDone && !a.failed_by_verdict)
    other = (a.processes > 1 ? "a servo process crashed; " : "") + a.why;
  std::string text(verdict_line(a.verdict, other).view());
  if (a.counts.armings == 0) text += "; the device was never armed";
  return text;
}

/// Several lines.
std::string summary_text(const RunAccount& a) {
  const TickCounts& c = a.counts;
  std::string text =
      a.driver + " on " + a.scene + formatted(", %.1f s: ", a.seconds) + a.why + "\n";
  text += formatted("  ticks       %llu; late by less than a period %llu, held %llu, beyond %llu\n",
                    wide(c.ticks), wide(c.late[1]), wide(c.late[2]), wide(c.late[3]));
  const auto by = [&c](hal::LateCause cause) {
    return wide(c.causes[static_cast<std::size_t>(cause)]);
  };
  text += formatted(
      "  late by     the wake-up %llu, the tick's own time %llu, a report %llu, wake-up and tick "
      "together %llu\n",
      by(hal::LateCause::kWakeUp), by(hal::LateCause::kTick), by(hal::LateCause::kReport),
      by(hal::LateCause::kTogether));
  text += times_text("wake-ups", a.times.wakeups);
  text += times_text("tick", a.times.ticks);
  text +=
      formatted("  armed       %llu ticks, %u times; in contact %llu; largest %.3g N, %.3g N m\n",
                wide(c.armed_ticks), c.armings, wide(c.contact_ticks), c.largest_force_n,
                c.largest_torque_nm);
  if (c.armed_ticks == 0 && !a.waits_for.empty()) text += "  not armed   " + a.waits_for + "\n";
  text += formatted(
      "  link        %llu connects, %llu disconnects, %llu reports, %llu bad, %llu sent, %llu "
      "failed\n",
      wide(a.link.connects), wide(a.link.disconnects), wide(a.link.reports),
      wide(a.link.bad_length + a.link.bad_check + a.link.bad_number + a.link.not_advancing),
      wide(a.link.sent), wide(a.link.send_failed));
  text += times_text("reports off", a.link_times.report_jitter);
  text += times_text("sends off", a.link_times.send_jitter);
  text += times_text("answer", a.link_times.answer);
  if (!a.trouble.empty()) text += "  trouble     " + a.trouble + "\n";
  const std::string faults = faults_text(c.safety_faults, c.device_faults);
  text += "  faults      " + (faults.empty() ? "none" : faults) + "\n";
  if (a.page_faults) {
    text += formatted(
        "  memory      %lld minor and %lld major page faults in the loop; heap %+lld bytes\n",
        static_cast<long long>(a.page_faults->minor), static_cast<long long>(a.page_faults->major),
        static_cast<long long>(a.heap_grown_bytes));
  }
  text += "  end         " + ending_text(a.ending);
  return text + verdict_text(a);
}

/// {"kind": "summary", ...}
ordered_json summary_json(const RunAccount& a) {
  const TickCounts& c = a.counts;
  ordered_json json = {{"kind", "summary"},
                       {"exit_code", a.exit_code},
                       {"why", a.why},
                       {"driver", a.driver},
                       {"scene", a.scene},
                       {"seconds", a.seconds},
                       {"servo_processes", a.processes},
                       {"ticks", c.ticks},
                       {"late", late_json(c)},
                       {"late_by_cause", causes_json(c)},
                       {"armed_ticks", c.armed_ticks},
                       {"contact_ticks", c.contact_ticks},
                       {"armings", c.armings},
                       {"waits_for", a.waits_for},
                       {"largest_force_n", c.largest_force_n},
                       {"largest_torque_nm", c.largest_torque_nm},
                       {"safety_faults", hal::safety_fault_texts(c.safety_faults)},
                       {"device_faults", hal::device_fault_texts(c.device_faults)}};
  json["wakeups"] = times_json(a.times.wakeups);
  json["tick"] = times_json(a.times.ticks);
  json["report_jitter"] = times_json(a.link_times.report_jitter);
  json["send_jitter"] = times_json(a.link_times.send_jitter);
  json["answer"] = times_json(a.link_times.answer);
  if (a.page_faults) {
    json["page_faults"] = {{"minor", a.page_faults->minor}, {"major", a.page_faults->major}};
    json["heap_grown_bytes"] = a.heap_grown_bytes;
  }
  json["link"] = link_json(a.link);
  json["trouble"] = a.trouble;
  json["ending"] = {{"force_n", a.ending.force_n},
                    {"outputs", a.ending.outputs},
                    {"jumps", a.ending.jumps},
                    {"last_force_n", a.ending.last_force_n},
                    {"last_torque_nm", a.ending.last_torque_nm}};
  if (a.peer) {
    json["peer"] = {{"commands", a.peer->commands},
                    {"refused", a.peer->refused},
                    {"watchdog_cuts", a.peer->watchdog_cuts},
                    {"released", a.peer->released}};
  }
  json["refused"] = a.refused;
  json["force_share"] = a.share;
  json["refusals"] = ordered_json::array();
  for (const Refusal& refusal : a.refusals)
    json["refusals"].push_back({{"what", refusal.what}, {"error", errno_name(refusal.error)}});
  json["verdict"] = verdict_json(a.verdict, verdict_text(a));
  return json;
}

struct RunOptions {
  std::string config, device;
  RunLength length;
  double status_every_s = 1.0;
  bool json = false, allow_degraded = false, accept_unbudgeted = false, serve = false;
  ServeOptions live;
};

constexpr std::size_t kTicksShown = 20;

std::string line_of(const ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// {"kind": "event", ...}
ordered_json event_json(const RunEvent& e) {
  return {{"kind", "event"}, {"t_s", e.t_s}, {"event", e.event}, {"text", e.text}};
}

/// The first crash of a run has the name given, the next ones a number before its ending.
std::filesystem::path crash_path(const std::filesystem::path& file, unsigned number) {
  if (number == 0 || file.empty()) return file;
  std::filesystem::path numbered = file;
  numbered.replace_filename(file.stem().string() + "-" + std::to_string(number) +
                            file.extension().string());
  return numbered;
}

/// A run that is watched. The watcher has the scene, the address and the flight recorders, and no
/// way to the device.
struct LiveView {
  LiveView(const ServeOptions& options, const SceneBytes& scene) : door(options) {
    // It was opened before: read_usable_scene.
    if (SceneView::open(scene.span(), view) != RtStatus::kOk) view = {};
  }

  /// In the watching process.
  int serve(const DeviceConfig& config, std::span<const std::span<const std::byte>> flights) {
    const int kept[] = {STDERR_FILENO, door.descriptor()};
    const rlimit none{0, 0};
    if (hal::close_inherited_descriptors(kept) != 0 || hal::drop_capabilities({}).error != 0 ||
        setrlimit(RLIMIT_RTPRIO, &none) != 0 || setrlimit(RLIMIT_MEMLOCK, &none) != 0) {
      return kExitDeviceOrOs;
    }
    serve_trace(door, view, config.servo, {flights.begin(), flights.end()});
    return kExitDone;
  }

  LiveDoor door;
  SceneView view;
};

/// Prints the events of a run on threads of their own, which begin once the processes are forked.
class RunTeller {
 public:
  /// `view`: of a run that is watched, or nullptr.
  RunTeller(const RunOptions& options, const DeviceConfig& config, LiveView* view)
      : options_(options), config_(config), view_(view) {}

  [[nodiscard]] RunWatch watch() {
    RunWatch watch;
    const bool told = options_.json || isatty(STDERR_FILENO) == 1;
    watch.status_every_s = told ? options_.status_every_s : 0.0;
    watch.forked = [this] {
      teller_ = std::make_unique<Teller>();
      if (view_ == nullptr) return;
      view_->door.leave();
      for (const std::string& line : view_->door.words()) {
        if (options_.json) say(line_of({{"kind", "note"}, {"text", line}}));
        complain("run_device: " + line, LineLevel::kNotice);
      }
    };
    if (view_ != nullptr)
      watch.watcher = [this](std::span<const std::span<const std::byte>> flights) {
        return view_->serve(config_, flights);
      };
    watch.status = [this](const RunStatus& s) {
      options_.json ? say(line_of(status_json(s))) : complain(status_text(s), LineLevel::kPlain);
    };
    watch.refusals = [this](const std::vector<Refusal>& refusals) {
      complain(refusals_text(refusals, config_.loop.strict), LineLevel::kWarning);
    };
    watch.event = [this](const RunEvent& e) {
      if (options_.json) say(line_of(event_json(e)));
      complain("run_device: " + formatted("%.3f s: ", e.t_s) + e.text, e.level);
    };
    watch.notes = [this](const std::vector<std::string>& notes) {
      for (const std::string& note : notes) {
        if (options_.json) say(line_of({{"kind", "note"}, {"text", note}}));
        complain("run_device: " + note, LineLevel::kNotice);
      }
    };
    watch.crash = [this](const RunCrash& crash) { tell_crash(crash); };
    return watch;
  }

  /// @return the exit code: that of the account, or that its summary could not be written.
  [[nodiscard]] int finish(const RunAccount& account) {
    say(options_.json ? line_of(summary_json(account)) : summary_text(account));
    const bool whole = teller_ == nullptr || teller_->finish();
    return whole || account.exit_code != kExitDone ? account.exit_code : kExitDeviceOrOs;
  }

 private:
  void say(const std::string& text) const {
    if (teller_ != nullptr) teller_->say(Stream::kOut, text);
  }
  void complain(const std::string& text, LineLevel level) const {
    if (teller_ != nullptr) teller_->say(Stream::kError, text, level);
  }

  // The force is already on its way to zero.
  void tell_crash(const RunCrash& crash) {
    const std::string head = "run_device: servo process " + std::to_string(crash.number) +
                             " (pid " + std::to_string(crash.pid) + "): " + crash.end;
    complain(head + "; its last ticks:\n" + hal::flight_text(crash.records, kTicksShown),
             LineLevel::kError);
    const std::filesystem::path file = crash_path(config_.crash_file, crashes_++);
    if (!file.empty() && teller_ != nullptr)
      teller_->write_file(file, "# " + head + "\n" + hal::flight_csv(crash.records));
  }

  const RunOptions& options_;
  const DeviceConfig& config_;
  LiveView* view_;
  std::unique_ptr<Teller> teller_;
  unsigned crashes_ = 0;
};

// All memory will be locked, and a locked stack is there in full: 8 MiB for each thread by default.
// Its pages are what the end of a killed process takes longest for, and only after them does the
// zero-keeper hear of it.
void bound_thread_stacks() noexcept {
  constexpr std::size_t kThreadStackBytes = 512 * 1024;
  pthread_attr_t attributes;
  if (pthread_getattr_default_np(&attributes) != 0) return;
  (void)pthread_attr_setstacksize(&attributes, kThreadStackBytes);
  (void)pthread_setattr_default_np(&attributes);
  (void)pthread_attr_destroy(&attributes);
}

int run(const RunOptions& o) {
  bound_thread_stacks();
  DeviceConfig config = read_device_config(o.config, o.device);
  if (o.allow_degraded) config.loop.strict = false;
  config.accept_unbudgeted = o.accept_unbudgeted;
  const SceneBytes scene = read_usable_scene(config);
  std::unique_ptr<LiveView> view;
  if (o.serve) view = std::make_unique<LiveView>(o.live, scene);
  RunTeller teller(o, config, view.get());
  const RunAccount account = run_device_of(config, scene, o.length, teller.watch());
  return teller.finish(account);
}

std::string check_driver(const std::string& name) {
  return is_driver_name(name) ? "" : "no device '" + name + "'; " + driver_list();
}

}  // namespace

Command add_run_command(CLI::App& program) {
  const auto o = std::make_shared<RunOptions>();
  CLI::App* app = program.add_subcommand(
      "run",
      "Runs the servo loop on a device until a signal such as SIGINT or SIGTERM, which ramps the "
      "force down and closes it.");
  app->add_option("config", o->config, "TOML: scene, device, loop, workspace, limits")->required();
  app->add_option("--seconds", o->length.seconds, "end after this long; default: never")
      ->check(CLI::Range(0.01, 1.0e9));
  app->add_option("--ticks", o->length.ticks,
                  "end after so many from the first armed one on, and count and time these alone; "
                  "default: all are counted")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 40));
  app->add_option("--device", o->device,
                  "instead of the file's driver. sim: a handle in this process with a scripted "
                  "hand, for trying out the loop; not a model of any device")
      ->check(CLI::Validator(check_driver, "DRIVER"));
  app->add_option("--status-every", o->status_every_s,
                  "seconds between two status lines, on a terminal or with --json; default 1")
      ->check(CLI::Range(0.01, 3600.0));
  app->add_flag("--allow-degraded", o->allow_degraded,
                "run without what the machine does not grant, or although it wakes the loop too "
                "late; a device with motors then gets half of its force and torque or less");
  app->add_flag("--accept-unbudgeted", o->accept_unbudgeted,
                "run a scene whose gains are beyond the device's passivity budget, or for which "
                "none can be computed");
  app->add_flag("--serve", o->serve,
                "let the session be watched in a browser or viewer; nobody there moves anything");
  add_serve_options(*app, o->live);
  app->add_flag("--json", o->json, "status and summary as JSON, a line each, on stdout");
  app->footer(
      driver_help() +
      "\nExit codes: 0 ended in order, 1 the part did not follow the hand as it should (the last "
      "line\n"
      "says so), the servo process crashed or --seconds were over before --ticks, 2 usage, 3 bad\n"
      "configuration or scene, 4 the machine refused (with strict: anything asked for), or the "
      "device\n"
      "was not there within --seconds.");
  return {app, [o] { return run(*o); }, "run_device run device.toml"};
}

}  // namespace haptic::tools
