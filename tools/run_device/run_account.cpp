// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/run_account.hpp"

#include <cstring>

#include "hal/realtime/flight_report.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/run_device/arming_words.hpp"
#include "tools/run_device/run_events.hpp"
#include "tools/verdict/verdict_json.hpp"

namespace haptic::tools {
namespace {

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

/// "Inverse3, serial 049D, 0.5 ms of latency"; empty: the device says nothing of itself.
std::string stated_text(const StatedDevice& d) {
  std::string text = d.name;
  const auto add = [&text](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
  if (!d.serial.empty()) add("serial " + d.serial);
  if (d.latency_s > 0) add(short_number(1e3 * d.latency_s, 3) + " ms of latency");
  if (text.empty()) return text;
  add(d.is_displacement ? "measures displacement" : "measures its pose");
  add(d.gives_force ? "gives force" : "gives no force");
  return text;
}

ordered_json stated_json(const StatedDevice& d) {
  return {{"name", d.name},
          {"serial", d.serial},
          {"latency_ms", 1e3 * d.latency_s},
          {"measures", d.is_displacement ? "displacement" : "pose"},
          {"gives_force", d.gives_force}};
}

std::string device_text(const DeviceAccount& d) {
  const TickCounts& c = d.counts;
  const std::string stated = stated_text(d.stated);
  std::string text = stated.empty() ? "" : "  device      " + stated + "\n";
  text +=
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

/// The keys of one device, in two halves: between them stand those of the loop.
ordered_json device_json(const DeviceAccount& d) {
  const TickCounts& c = d.counts;
  return {{"stated", stated_json(d.stated)},
          {"armed_ticks", c.armed_ticks},
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

}  // namespace

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
  if (s.gap_m) line += formatted("  gap %.1f mm", 1e3 * *s.gap_m);
  if (!faults.empty()) line += "  " + faults;
  if (const std::string stated = stated_text(s.stated); !stated.empty()) line += "  " + stated;
  const std::string wait = wait_text(s.servo.arming_news);
  if (!wait.empty()) line += "\n           not armed: " + wait;
  if (!s.trouble.empty()) line += "\n         " + s.trouble;
  return line;
}

ordered_json line_json(const char* kind, unsigned device) {
  ordered_json json = {{"kind", kind}};
  if (device > 0) json["device"] = device;
  return json;
}

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
                           {"sent", s.counters.sent},
                           {"stated", stated_json(s.stated)}});
  if (s.gap_m) json["gap_m"] = *s.gap_m;
  return json;
}

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

std::string summary_text(const RunAccount& a) {
  const TickCounts& c = a.loop();
  std::string drivers;
  for (const DeviceAccount& d : a.devices) drivers += (drivers.empty() ? "" : " and ") + d.driver;
  std::string text = drivers + " on " + a.scene + formatted(", %.1f s: ", a.seconds) + a.why + "\n";
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

}  // namespace haptic::tools
