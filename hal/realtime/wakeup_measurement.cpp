// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/wakeup_measurement.hpp"

#include <pthread.h>

#include "hal/clock/servo_clock.hpp"

namespace haptic::hal {
namespace {

// Ticks before anything counts: the thread's first sleep and first clock read fault in what they
// need.
constexpr std::int64_t kTicksBefore = 10;

// Small: under a limit of locked memory the usual 8 MB of a thread would not be granted.
constexpr std::size_t kStackBytes = std::size_t{1024} * 1024;

struct Run {
  const WakeupQuestion& question;
  WakeupMeasurement& measurement;
};

int sleep_and_count(const WakeupQuestion& question, WakeupMeasurement& m,
                    const std::atomic<bool>& stop) noexcept {
  DeadlineSchedule schedule(monotonic_ns(), question.period_ns);
  for (std::int64_t i = 0; i < kTicksBefore; ++i) {
    const int error = sleep_until(schedule.next_deadline_ns());
    if (error != 0) return error;
    schedule.advance(monotonic_ns());
  }
  const std::uint64_t missed_before = schedule.missed_periods();
  const PageFaults before = page_faults_of_thread();
  const std::int64_t end_ns = schedule.next_deadline_ns() + question.duration_ns;
  while (schedule.next_deadline_ns() < end_ns && !stop.load(std::memory_order_relaxed)) {
    const int error = sleep_until(schedule.next_deadline_ns());
    if (error != 0) return error;
    if (schedule.advance(monotonic_ns()) > 0) m.late_ticks += 1;
    m.lateness.add(schedule.last_lateness_ns());
  }
  const PageFaults after = page_faults_of_thread();
  m.faults = {after.minor - before.minor, after.major - before.major};
  m.missed_periods = schedule.missed_periods() - missed_before;
  return 0;
}

void* measuring_thread(void* argument) {
  const Run& run = *static_cast<Run*>(argument);
  ThreadSettings settings;
  settings.priority = run.question.priority;
  settings.cpu = run.question.cpu;
  for (const StepGrant& grant : start_realtime_thread(settings)) {
    if (grant.step == StartStep::kPriority && grant.granted())
      run.measurement.priority = settings.priority;
    if (grant.step == StartStep::kAffinity && grant.granted()) run.measurement.cpu = settings.cpu;
  }
  const std::atomic<bool> never{false};
  run.measurement.error = sleep_and_count(run.question, run.measurement, never);
  return nullptr;
}

}  // namespace

void count_wakeups(const WakeupQuestion& question, const std::atomic<bool>& stop,
                   WakeupMeasurement& measurement) noexcept {
  measurement = WakeupMeasurement();
  measurement.error = sleep_and_count(question, measurement, stop);
}

void measure_wakeups(const WakeupQuestion& question, WakeupMeasurement& measurement) noexcept {
  measurement = WakeupMeasurement();
  RealtimeProcess process;
  ProcessSettings settings;
  settings.keep_heap = false;  // it could not be undone
  for (const StepGrant& grant : process.start(settings)) {
    if (grant.step == StartStep::kMemoryLock) measurement.memory_locked = grant.granted();
    if (grant.step == StartStep::kIdleStates) measurement.idle_states_held = grant.granted();
  }
  Run run{question, measurement};
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  (void)pthread_attr_setstacksize(&attributes, kStackBytes);
  pthread_t thread{};
  measurement.error = pthread_create(&thread, &attributes, measuring_thread, &run);
  pthread_attr_destroy(&attributes);
  if (measurement.error == 0) pthread_join(thread, nullptr);
}

}  // namespace haptic::hal
