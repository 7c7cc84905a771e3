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
  std::string line = formatted("%7.1f s  ", s.t_s);
  if (s.device <= 1)
    line += formatted("%llu ticks, late %llu/%llu/%llu  ", wide(c.ticks), wide(c.late[1]),
                      wide(c.late[2]), wide(c.late[3]));
  if (s.device > 0) line += formatted("device %u  ", s.device);
  line += formatted("link %s  %s  %.2f N %.3f N m", to_text(s.link),
                    s.is_silent() ? "silent" : to_text(s.servo.arming), s.force_n, s.torque_nm);
  const std::string faults = faults_text(s.servo.safety_faults, s.device_faults());
  if (!faults.empty()) line += "  " + faults;
  const std::string wait = wait_text(s.servo.arming_news);
  if (!wait.empty()) line += "\n           not armed: " + wait;
  if (!s.trouble.empty()) line += "\n         " + s.trouble;
  return line;
}

/// `kind`, and of which of two devices.
ordered_json line_json(const char* kind, unsigned device) {
  ordered_json json = {{"kind", kind}};
  if (device > 0) json["device"] = device;
  return json;
}

/// {"kind": "status", ...}
ordered_json status_json(const RunStatus& s) {
  const TickCounts& c = s.servo.counts;
  ordered_json json = line_json("status", s.device);
  json.update(ordered_json{{"t_s", s.t_s},
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
          {"sent", s.counters.sent}});
  return json;
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

/// Why the run failed besides what its verdict says; empty: it did not.
std::string other_failure(const RunAccount& a) {
  if (a.exit_code == kExitDone || a.failed_by_verdict) return "";
  return (a.processes > 1 ? "a servo process crashed; " : "") + a.why;
}

/// The verdict of a device. That no force was ever given is said too.
std::string verdict_text(const DeviceAccount& d, const std::string& other) {
  std::string text(verdict_line(d.verdict, other).view());
  if (d.counts.armings == 0) text += "; the device was never armed";
  return text;
}

/// The last line: the verdict, or why the run failed otherwise; of two devices that of each.
std::string verdict_text(const RunAccount& a) {
  const std::string other = other_failure(a);
  if (a.devices.size() == 1) return verdict_text(a.devices[0], other);
  std::string text;
  for (std::size_t k = 0; k < a.devices.size(); ++k)
    text += (k > 0 ? "; device " : "device ") + std::to_string(k + 1) + ": " +
            verdict_text(a.devices[k], "");
  if (a.exit_code == kExitDone) return text;
  return "FAILED: " + (other.empty() ? text : other + "; " + text);
}

std::string device_text(const DeviceAccount& d) {
  const TickCounts& c = d.counts;
  std::string text =
      formatted("  armed       %llu ticks, %u times; in contact %llu; largest %.3g N, %.3g N m\n",
                wide(c.armed_ticks), c.armings, wide(c.contact_ticks), c.largest_force_n,
                c.largest_torque_nm);
  if (c.armed_ticks == 0 && !d.waits_for.empty()) text += "  not armed   " + d.waits_for + "\n";
  text += formatted(
      "  link        %llu connects, %llu disconnects, %llu reports, %llu bad, %llu sent, %llu "
      "failed\n",
      wide(d.link.connects), wide(d.link.disconnects), wide(d.link.reports),
      wide(d.link.bad_length + d.link.bad_check + d.link.bad_number + d.link.not_advancing),
      wide(d.link.sent), wide(d.link.send_failed));
  text += times_text("reports off", d.link_times.report_jitter);
  text += times_text("sends off", d.link_times.send_jitter);
  text += times_text("answer", d.link_times.answer);
  if (!d.trouble.empty()) text += "  trouble     " + d.trouble + "\n";
  const std::string faults = faults_text(c.safety_faults, c.device_faults);
  text += "  faults      " + (faults.empty() ? "none" : faults) + "\n";
  return text + "  end         " + ending_text(d.ending);
}

std::string memory_text(const RunAccount& a) {
  if (!a.page_faults) return "";
  return formatted(
      "  memory      %lld minor and %lld major page faults in the loop; heap %+lld bytes\n",
      static_cast<long long>(a.page_faults->minor), static_cast<long long>(a.page_faults->major),
      static_cast<long long>(a.heap_grown_bytes));
}

/// Several lines.
std::string summary_text(const RunAccount& a) {
  const TickCounts& c = a.loop();
  std::string drivers;
  for (const DeviceAccount& d : a.devices) drivers += (drivers.empty() ? "" : " and ") + d.driver;
  std::string text =
      drivers + " on " + a.scene + formatted(", %.1f s: ", a.seconds) + a.why + "\n";
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
  text += memory_text(a);
  for (std::size_t k = 0; k < a.devices.size(); ++k) {
    if (a.devices.size() > 1) text += "device " + std::to_string(k + 1) + "\n";
    text += device_text(a.devices[k]);
  }
  return text + verdict_text(a);
}

/// The keys of one device, in two halves: between them stand those of the loop.
ordered_json device_json(const DeviceAccount& d) {
  const TickCounts& c = d.counts;
  return {{"armed_ticks", c.armed_ticks},
          {"contact_ticks", c.contact_ticks},
          {"armings", c.armings},
          {"waits_for", d.waits_for},
          {"largest_force_n", c.largest_force_n},
          {"largest_torque_nm", c.largest_torque_nm},
          {"safety_faults", hal::safety_fault_texts(c.safety_faults)},
          {"device_faults", hal::device_fault_texts(c.device_faults)}};
}

ordered_json device_link_json(const DeviceAccount& d) {
  ordered_json json;
  json["report_jitter"] = times_json(d.link_times.report_jitter);
  json["send_jitter"] = times_json(d.link_times.send_jitter);
  json["answer"] = times_json(d.link_times.answer);
  json["link"] = link_json(d.link);
  json["trouble"] = d.trouble;
  json["ending"] = {{"force_n", d.ending.force_n},
                    {"outputs", d.ending.outputs},
                    {"jumps", d.ending.jumps},
                    {"last_force_n", d.ending.last_force_n},
                    {"last_torque_nm", d.ending.last_torque_nm}};
  if (d.peer) {
    json["peer"] = {{"commands", d.peer->commands},
                    {"refused", d.peer->refused},
                    {"watchdog_cuts", d.peer->watchdog_cuts},
                    {"released", d.peer->released}};
  }
  return json;
}

/// {"kind": "summary", ...}; with one device its keys are among them, of two they are in `devices`.
ordered_json summary_json(const RunAccount& a) {
  const TickCounts& c = a.loop();
  const bool has_two = a.devices.size() > 1;
  const DeviceAccount& first = a.devices.front();
  ordered_json json = {{"kind", "summary"}, {"exit_code", a.exit_code}, {"why", a.why}};
  if (!has_two) json["driver"] = first.driver;
  json.update(ordered_json{{"scene", a.scene},
                           {"seconds", a.seconds},
                           {"servo_processes", a.processes},
                           {"ticks", c.ticks},
                           {"late", late_json(c)},
                           {"late_by_cause", causes_json(c)}});
  if (!has_two) json.update(device_json(first));
  json["wakeups"] = times_json(a.times.wakeups);
  json["tick"] = times_json(a.times.ticks);
  if (!has_two) json.update(device_link_json(first));
  if (a.page_faults) {
    json["page_faults"] = {{"minor", a.page_faults->minor}, {"major", a.page_faults->major}};
    json["heap_grown_bytes"] = a.heap_grown_bytes;
  }
  json["refused"] = a.refused;
  json["force_share"] = a.share;
  json["refusals"] = ordered_json::array();
  for (const Refusal& refusal : a.refusals)
    json["refusals"].push_back({{"what", refusal.what}, {"error", errno_name(refusal.error)}});
  if (!has_two) {
    json["verdict"] = verdict_json(first.verdict, verdict_text(a));
    return json;
  }
  json["devices"] = ordered_json::array();
  for (const DeviceAccount& d : a.devices) {
    ordered_json& device = json["devices"].emplace_back(ordered_json{{"driver", d.driver}});
    device.update(device_json(d));
    device.update(device_link_json(d));
    device["verdict"] = verdict_json(d.verdict, verdict_text(d, ""));
  }
  json["verdict"] = {{"text", verdict_text(a)}};
  return json;
}

struct RunOptions {
  std::string config, device, device2;
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
  ordered_json json = line_json("event", e.device);
  json.update(ordered_json{{"t_s", e.t_s}, {"event", e.event}, {"text", e.text}});
  return json;
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
    serve_trace(door, view, config.devices[0].servo, {flights.begin(), flights.end()});
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
    const unsigned number = crashes_++;
    for (std::size_t k = 0; k < config_.devices.size(); ++k) {
      const std::string device = device_words(config_, k);
      complain(head + "; " + device + "its last ticks:\n" +
                   hal::flight_text(crash.records[k], kTicksShown),
               LineLevel::kError);
      const std::filesystem::path file =
          crash_path(crash_file_of(config_.crash_file, k), number);
      if (!file.empty() && teller_ != nullptr)
        teller_->write_file(file, "# " + head + "\n" + hal::flight_csv(crash.records[k]));
    }
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
  DeviceConfig config = read_device_config(o.config, o.device, o.device2);
  if (o.allow_degraded) config.loop.strict = false;
  config.accept_unbudgeted = o.accept_unbudgeted;
  if (o.serve && config.has_two())
    throw UsageError(
        "--serve: shows one device, and this run has two; leave it out, or 'host_sim run --serve' "
        "shows two hands");
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
  app->add_option("config", o->config, "TOML: scene, device or two, loop, workspace, limits")->required();
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
  app->add_option("--device2", o->device2,
                  "the same of the second device, of a scene with two hands; the file need not "
                  "have [device2] then")
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
