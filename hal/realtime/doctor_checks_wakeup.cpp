// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "hal/realtime/doctor_checks.hpp"

namespace haptic::hal {
namespace {

constexpr const char* kWakeups = "wake-ups";
constexpr const char* kPageFaults = "page faults";

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
  const std::int64_t limit_ns = q.wakeup_limit_ns > 0 ? q.wakeup_limit_ns : q.period_ns / 4;
  const WakeupHistogram& h = m.lateness;
  const std::string found =
      "p50 " + microseconds(h.quantile_ns(0.5)) + ", p99 " + microseconds(h.quantile_ns(0.99)) +
      ", p99.9 " + microseconds(h.quantile_ns(0.999)) + ", largest " +
      microseconds(h.largest_ns()) + " us late; " + std::to_string(m.late_ticks) + " of " +
      std::to_string(h.count()) + " ticks a period late or more (" +
      std::to_string(m.missed_periods) + " periods missed); " + conditions_text(m);
  if (h.largest_ns() <= limit_ns) return passed(kWakeups, found);
  return refused(kWakeups, found + "; limit " + microseconds(limit_ns) + " us",
                 "fix the lines above, PREEMPT_RT first; then look for the kernel's own "
                 "latencies:\n    sudo hwlatdetect --duration=60");
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
    return {skipped(kWakeups, "not measured", fix), skipped(kPageFaults, "not measured", fix)};
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
            skipped(kPageFaults, "not measured", fix)};
  }
  return {wakeup_line(q, measurement), fault_line(measurement)};
}

}  // namespace haptic::hal
