// SPDX-License-Identifier: Apache-2.0
// run_device run CONFIG.toml [--seconds N] [--ticks N] [--device NAME] [--status-every S] [--json]

#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "hal/realtime/flight_report.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/formatted.hpp"
#include "tools/run_device/commands.hpp"
#include "tools/run_device/device_run.hpp"

namespace haptic::tools {
namespace {

// Summary of a run, for people and for programs.

using nlohmann::ordered_json;

constexpr const char* kDegreeNames[kLateDegrees] = {"in_time", "within_period", "held", "beyond"};

unsigned long long wide(std::uint64_t value) { return value; }

const char* to_text(ArmingState arming) {
  constexpr const char* kTexts[] = {"disarmed", "arming", "armed", "disarming", "faulted"};
  const auto at = static_cast<std::size_t>(arming);
  return at < std::size(kTexts) ? kTexts[at] : "?";
}

const char* to_text(LinkState link) {
  constexpr const char* kTexts[] = {"absent", "starting", "ready"};
  const auto at = static_cast<std::size_t>(link);
  return at < std::size(kTexts) ? kTexts[at] : "?";
}

std::string errno_name(int error) {
  const char* name = strerrorname_np(error);
  const char* text = strerrordesc_np(error);
  return std::string(name != nullptr ? name : "errno " + std::to_string(error)) + " (" +
         (text != nullptr ? text : "unknown") + ")";
}

std::string faults_text(std::uint32_t safety, std::uint32_t device) {
  const std::string first = hal::safety_fault_texts(safety);
  const std::string second = hal::device_fault_texts(device);
  return first + (first.empty() || second.empty() ? "" : "; ") + second;
}

ordered_json late_json(const TickCounts& counts) {
  ordered_json late;
  for (std::size_t k = 0; k < kLateDegrees; ++k) late[kDegreeNames[k]] = counts.late[k];
  return late;
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
                to_text(s.servo.arming), s.servo.force_n, s.servo.torque_nm);
  const std::string faults = faults_text(s.servo.safety_faults, s.servo.device_faults);
  if (!faults.empty()) line += "  " + faults;
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
          {"arming", to_text(s.servo.arming)},
          {"armings", c.armings},
          {"force_n", s.servo.force_n},
          {"torque_nm", s.servo.torque_nm},
          {"d_near_m", s.servo.d_near_m},
          {"safety_faults", hal::safety_fault_texts(s.servo.safety_faults)},
          {"device_faults", hal::device_fault_texts(s.servo.device_faults)},
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

/// Several lines.
std::string summary_text(const RunAccount& a) {
  const TickCounts& c = a.counts;
  std::string text =
      a.driver + " on " + a.scene + formatted(", %.1f s: ", a.seconds) + a.why + "\n";
  text += formatted("  ticks       %llu; late by less than a period %llu, held %llu, beyond %llu\n",
                    wide(c.ticks), wide(c.late[1]), wide(c.late[2]), wide(c.late[3]));
  text += times_text("wake-ups", a.times.wakeups);
  text += times_text("tick", a.times.ticks);
  text +=
      formatted("  armed       %llu ticks, %u times; in contact %llu; largest %.3g N, %.3g N m\n",
                wide(c.armed_ticks), c.armings, wide(c.contact_ticks), c.largest_force_n,
                c.largest_torque_nm);
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
  return text;
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
                       {"armed_ticks", c.armed_ticks},
                       {"contact_ticks", c.contact_ticks},
                       {"armings", c.armings},
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
                    {"watchdog_cuts", a.peer->watchdog_cuts}};
  }
  json["refused"] = a.refused;
  json["force_share"] = a.share;
  json["refusals"] = ordered_json::array();
  for (const Refusal& refusal : a.refusals)
    json["refusals"].push_back({{"what", refusal.what}, {"error", errno_name(refusal.error)}});
  return json;
}

struct RunOptions {
  std::string config, device;
  RunLength length;
  double status_every_s = 1.0;
  bool json = false, allow_degraded = false, accept_unbudgeted = false;
};

constexpr std::size_t kTicksShown = 20;

void write_line(std::FILE* stream, const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stream);
  std::fputc('\n', stream);
  std::fflush(stream);
}

void write_json(const nlohmann::ordered_json& json) {
  write_line(stdout, json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

// The force is already on its way to zero.
void tell_crash(const RunCrash& crash, const std::filesystem::path& file) {
  const std::string head = "run_device: servo process " + std::to_string(crash.number) + " (pid " +
                           std::to_string(crash.pid) + "): " + crash.end;
  write_line(stderr, head + "; its last ticks:\n" + hal::flight_text(crash.records, kTicksShown));
  if (file.empty()) return;
  const std::string text = "# " + head + "\n" + hal::flight_csv(crash.records);
  // A file that cannot be written must not end the hold of the device.
  try {
    write_files({{file, std::as_bytes(std::span(text))}});
  } catch (const OsError& error) {
    write_line(stderr, std::string("run_device: ") + error.what());
  }
}

int run(const RunOptions& o) {
  DeviceConfig config = read_device_config(o.config, o.device);
  if (o.allow_degraded) config.loop.strict = false;
  config.accept_unbudgeted = o.accept_unbudgeted;
  const SceneBytes scene = read_usable_scene(config);
  const bool told = o.json || isatty(STDERR_FILENO) == 1;
  RunWatch watch;
  watch.status_every_s = told ? o.status_every_s : 0.0;
  watch.status = [&o](const RunStatus& status) {
    o.json ? write_json(status_json(status)) : write_line(stderr, status_text(status));
  };
  watch.refusals = [&config](const std::vector<Refusal>& refusals) {
    const std::string text = refusals_text(refusals, config.loop.strict);
    std::fwrite(text.data(), 1, text.size(), stderr);
  };
  watch.notes = [&o](const std::vector<std::string>& notes) {
    for (const std::string& note : notes)
      o.json ? write_json({{"kind", "note"}, {"text", note}})
             : write_line(stderr, "run_device: " + note);
  };
  watch.crash = [&config](const RunCrash& crash) { tell_crash(crash, config.crash_file); };
  const RunAccount account = run_device_of(config, scene, o.length, watch);
  if (o.json) {
    write_json(summary_json(account));
  } else {
    const std::string text = summary_text(account);
    std::fwrite(text.data(), 1, text.size(), stdout);
  }
  return account.exit_code;
}

std::string check_driver(const std::string& name) {
  return is_driver_name(name) ? "" : "no device '" + name + "'; see [device] driver";
}

}  // namespace

Command add_run_command(CLI::App& program) {
  const auto o = std::make_shared<RunOptions>();
  CLI::App* app = program.add_subcommand(
      "run",
      "Runs the servo loop on a device until SIGINT or SIGTERM, which ramp the force down and "
      "close it.");
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
  app->add_flag("--json", o->json, "status and summary as JSON, a line each, on stdout");
  app->footer(
      "Exit codes: 0 ended in order, 1 the servo process crashed or --seconds were over before\n"
      "--ticks, 2 usage, 3 bad configuration or scene, 4 the machine refused (with strict: "
      "anything\n"
      "asked for), or the device was not there within --seconds.");
  return {app, [o] { return run(*o); }, "run_device run device.toml"};
}

}  // namespace haptic::tools
