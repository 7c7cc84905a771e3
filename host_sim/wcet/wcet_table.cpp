// SPDX-License-Identifier: Apache-2.0
#include "host_sim/wcet/wcet_table.hpp"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>

#include "host_sim/wcet/cache_flush.hpp"

namespace haptic::sim {
namespace {

[[gnu::format(printf, 2, 3)]] void line(std::string& text, const char* format, ...) {
  char buffer[320];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  text += buffer;
  text += "\n";
}

using ull = unsigned long long;

void row(std::string& text, const char* name, const TimeFigures& f) {
  if (f.count == 0) return;
  line(text, "  %-32s %8zu %10.0f %10.0f %10.0f %10.0f", name, f.count, f.median, f.p99, f.p999,
       f.largest);
}

void columns(std::string& text) {
  line(text, "  %-32s %8s %10s %10s %10s %10s", "", "inputs", "median", "p99", "p99.9", "largest");
}

void add_work(std::string& text, const WcetReport& r, const SceneView& view) {
  const SceneCapacity& c = view.header().capacity;
  text += counters_text(r.bounds, view.parameters().law == LawId::kProxy);
  const double period_ns = 1e9 / view.parameters().rate_hz;
  const double bound_ns = r.loop.dearest_unit_ns * static_cast<double>(r.work_bound);
  line(text, "  %u pairs, %llu bytes of state, %llu bytes of scene; %s", c.pair_count,
       ull{c.state_bytes}, ull{view.header().byte_count},
       c.unproven == 0 ? "exact at every pose" : "a tick may have to give up exactness, flagged");
  line(text,
       "  bound %llu units of work, dearest unit %.1f ns: at most %.0f ns, %.1f %% of the period "
       "of %.0f ns%s",
       ull{r.work_bound}, r.loop.dearest_unit_ns, bound_ns, 100 * bound_ns / period_ns, period_ns,
       view.parameters().law == LawId::kProxy ? ", of the contact search" : "");
  if (view.parameters().law == LawId::kProxy) {
    line(text,
         "  (the proxy's work is no part of these units: see the times that the search found)");
  }
}

void add_times(std::string& text, const WcetReport& r, std::span<const MotionSample> motion) {
  const WcetResult& loop = r.loop;
  line(text,
       "time per tick in ns: least of %u runs from the same state and input, then over the inputs",
       loop.repeats);
  columns(text);
  row(text, "core, all ticks", loop.core);
  row(text, "core, without the first", loop.core_after_first);
  row(text, "core, in contact", loop.core_contact);
  row(text, "core, free", loop.core_free);
  row(text, "core, every bound stale", loop.stale);
  row(text, "exhaustive search, double", loop.exhaustive);
  row(text, "core, same state, warm", r.same_state.warm);
  row(text, "core, same state, caches flushed", r.same_state.flushed);
  line(text, "  first tick %.0f ns; worst later tick %zu (t = %.3f s, %.0f ns%s)",
       loop.first_tick_ns, loop.worst_tick, motion[loop.worst_tick].t_s,
       loop.ticks[loop.worst_tick].core_ns,
       loop.ticks[loop.worst_tick].relocalised ? ", re-localised" : "");
  line(text, "  worst flushed tick %zu; %u repeats; flushed by %s, %zu bytes",
       r.same_state.worst_flushed, r.same_state.repeats, CacheFlush::method(),
       r.same_state.flushed_bytes);
  if (loop.core.median > 0 && loop.exhaustive.count > 0) {
    line(text, "  exhaustive / core: median %.2f, largest %.2f",
         loop.exhaustive.median / loop.core.median, loop.exhaustive.largest / loop.core.largest);
  }
  line(text, "  empty measurement %.1f ns, subtracted", loop.clock_empty_ns);
  if (!r.same_state.same_result) line(text, "  REPEATS OF A TICK ENDED IN DIFFERENT STATES");
  line(text, "noise of this machine in ns: every repeat as it was, nothing about the code");
  columns(text);
  row(text, "in the loop, raw", loop.raw);
  row(text, "same state, warm, raw", r.same_state.warm_raw);
  row(text, "same state, flushed, raw", r.same_state.flushed_raw);
  row(text, "noise: repeat less the least", loop.noise);
}

void add_wakeups(std::string& text, const WcetReport& r) {
  if (!(r.plan.wakeup_seconds > 0)) return;
  const hal::WakeupMeasurement& m = *r.wakeups;
  if (m.error != 0 || m.lateness.count() == 0) {
    line(text, "wake-ups of this machine: not measured: %s", std::strerror(m.error));
    return;
  }
  const auto us = [&](double q) { return 1e-3 * static_cast<double>(m.lateness.quantile_ns(q)); };
  line(text, "wake-ups of this machine in us (%llu, %s, memory %s), to be added by the user",
       ull{m.lateness.count()}, m.priority > 0 ? "SCHED_FIFO" : "ORDINARY PRIORITY",
       m.memory_locked ? "locked" : "not locked");
  line(text, "  p50 %.0f, p99 %.0f, p99.9 %.0f, largest %.0f; a period late or more: %llu", us(0.5),
       us(0.99), us(0.999), 1e-3 * static_cast<double>(m.lateness.largest_ns()), ull{m.late_ticks});
}

std::uint64_t most_work(const WcetResult& loop) {
  std::uint64_t most = 0;
  for (const TickTime& t : loop.ticks) most = std::max(most, work_units(t.counters));
  return most;
}

void add_findings(std::string& text, const WcetReport& r, const SceneView& view) {
  const AdversarialLimits& limits = r.plan.adversarial;
  line(text,
       "adversarial search, seed %llu: worst of one tick over motions of at most %g m/s, "
       "%g rad/s",
       ull{limits.seed}, kAdversarialSpeed_m_per_s, kAdversarialTurn_rad_per_s);
  for (const AdversarialFinding& f : r.findings) {
    line(text, "  %-20s %12.6g %-8s tick %2zu  of %llu motions, %llu restarts%s", to_text(f.goal),
         f.value, unit_of(f.goal), f.tick, ull{f.evaluations}, ull{f.restarts},
         f.not_finite > 0 ? "  WRENCH NOT FINITE" : "");
    if (f.goal == AdversarialGoal::kWork) {
      line(text, "  %-20s %12llu units; of the given motion %llu", "  bound of work",
           ull{r.work_bound}, ull{most_work(r.loop)});
    }
  }
  // What a spring alone would do at that speed; more is a change of contact within the tick.
  const SceneParameters& p = view.parameters();
  const double k_n_per_m = p.law == LawId::kProxy ? p.coupling.k_t_n_per_m : p.k_f_n_per_m;
  line(text, "  %-20s %12.6g N        (%g N/m at that speed)", "  spring's own step",
       k_n_per_m * kAdversarialSpeed_m_per_s / p.rate_hz, k_n_per_m);
}

}  // namespace

std::string wcet_table(const WcetReport& report, const SceneView& view,
                       std::span<const MotionSample> motion) {
  std::string text;
  add_work(text, report, view);
  add_times(text, report, motion);
  add_wakeups(text, report);
  add_findings(text, report, view);
  return text;
}

}  // namespace haptic::sim
