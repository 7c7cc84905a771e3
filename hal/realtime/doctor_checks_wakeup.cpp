// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "hal/realtime/doctor_checks.hpp"

namespace haptic::hal {
namespace {

constexpr const char* kWakeups = "wake-ups";
constexpr const char* kPageFaults = "page faults";
constexpr const char* kCulprit = "late by";

std::int64_t limit_of(const DoctorQuestions& q) {
  return q.wakeup_limit_ns > 0 ? q.wakeup_limit_ns : q.period_ns / 4;
}

std::string microseconds(std::int64_t ns) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f", static_cast<double>(ns) * 1.0e-3);
  return text;
}

std::string conditions_text(const WakeupMeasurement& m) {
  std::string text = m.priority > 0 ? "SCHED_FIFO " + std::to_string(m.priority)
                                    : std::string("an ordinary thread");
  text += m.cpu >= 0 ? " on core " + std::to_string(m.cpu) : std::string(" on any core");
  text += m.memory_locked ? ", memory locked" : ", memory not locked";
  text += m.idle_states_held ? ", idle states held" : ", idle states not held";
  return text;
}

DoctorLine wakeup_line(const DoctorQuestions& q, const WakeupMeasurement& m) {
  const std::int64_t limit_ns = limit_of(q);
  const WakeupHistogram& h = m.lateness;
  const std::string found =
      "p50 " + microseconds(h.quantile_ns(0.5)) + ", p99 " + microseconds(h.quantile_ns(0.99)) +
      ", p99.9 " + microseconds(h.quantile_ns(0.999)) + ", largest " +
      microseconds(h.largest_ns()) + " us late; " + std::to_string(m.late_ticks) + " of " +
      std::to_string(h.count()) + " ticks a period late or more (" +
      std::to_string(m.missed_periods) + " periods missed); " + conditions_text(m);
  if (h.largest_ns() <= limit_ns) return passed(kWakeups, found);
  return refused(kWakeups, found + "; limit " + microseconds(limit_ns) + " us",
                 "fix the lines above, PREEMPT_RT first; then see who is late (line \"late by\"), "
                 "and whether the hardware itself is (Debian package rt-tests):\n"
                 "    sudo hwlatdetect --duration=60");
}

// Stops at the first wake-up later than the limit and says what held it up.
std::vector<std::string> rtla_command(const DoctorQuestions& q) {
  const std::string limit_us = microseconds(limit_of(q));
  std::vector<std::string> command = {"rtla", "timerlat", "top",    "-q", "-d",
                                      "30s",  "-T",       limit_us, "-s", limit_us};
  if (!q.cpus.empty()) {
    command.emplace_back("-c");
    command.push_back(std::to_string(q.cpus.front()));
  }
  return command;
}

std::string spoken(const std::vector<std::string>& command) {
  std::string text;
  for (const std::string& word : command) text += (text.empty() ? "" : " ") + word;
  return text;
}

// The analysis alone, without the table before it; all of it where there is no analysis.
std::string analysis_of(const std::string& text) {
  const std::size_t begin = text.find("## CPU");
  std::string analysis = begin == std::string::npos ? text : text.substr(begin);
  constexpr std::size_t kMost = 2000;
  if (analysis.size() > kMost) analysis.resize(kMost);
  return analysis;
}

DoctorLine culprit_line(const Examination& e, const WakeupMeasurement& m) {
  const DoctorQuestions& q = e.questions;
  if (m.lateness.largest_ns() <= limit_of(q)) return passed(kCulprit, "nobody: wake-ups pass");
  const std::vector<std::string> command = rtla_command(q);
  const std::string shown = "\n    sudo " + spoken(command);
  if (!e.probes.has_program("rtla")) {
    return warned(kCulprit, "not known: rtla, which names who held a wake-up up, is not installed",
                  "install it (Debian package rtla; part of the kernel's tools/tracing) and ask:\n"
                  "    sudo apt-get install rtla" +
                      shown);
  }
  if (!q.name_culprit) {
    return warned(kCulprit, "not asked",
                  "let rtla name who held the wake-up up, as root:\n"
                  "    sudo run_device doctor --culprit" +
                      shown);
  }
  const std::string said = analysis_of(e.probes.run_program(command));
  return warned(kCulprit, said.empty() ? "rtla said nothing" : said,
                "move what is named off the core, or see it in the kernel's own words:" + shown);
}

DoctorLine fault_line(const WakeupMeasurement& m) {
  const std::string found = std::to_string(m.faults.minor) + " minor, " +
                            std::to_string(m.faults.major) + " major while the loop ran";
  if (m.faults == PageFaults{}) return passed(kPageFaults, found);
  const std::string fix =
      "memory must be locked and touched before the loop: see the line "
      "\"memory lock\"";
  return m.faults.major > 0 ? failed(kPageFaults, found, fix) : refused(kPageFaults, found, fix);
}

}  // namespace

std::vector<DoctorLine> check_wakeups(const Examination& e, WakeupMeasurement& measurement) {
  const DoctorQuestions& q = e.questions;
  if (!q.measure) {
    const std::string fix = "measure: leave out --no-measure";
    return {skipped(kWakeups, "not measured", fix), skipped(kCulprit, "not measured", fix),
            skipped(kPageFaults, "not measured", fix)};
  }
  WakeupQuestion question;
  question.period_ns = q.period_ns;
  question.duration_ns = q.measure_ns;
  question.priority = q.servo_priority;
  if (!q.cpus.empty()) question.cpu = q.cpus.front();
  e.probes.measure(question, measurement);
  if (measurement.error != 0) {
    const std::string fix = "fix the lines above";
    return {failed(kWakeups, "could not be measured: " + errno_text(measurement.error), fix),
            skipped(kCulprit, "not measured", fix), skipped(kPageFaults, "not measured", fix)};
  }
  return {wakeup_line(q, measurement), culprit_line(e, measurement), fault_line(measurement)};
}

}  // namespace haptic::hal
