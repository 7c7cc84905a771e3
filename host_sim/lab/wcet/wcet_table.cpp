// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/wcet/wcet_report.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

#include "host_sim/lab/wcet/core_stack.hpp"
#include "host_sim/session/replay_summary.hpp"
#include "host_sim/timing/cache_flush.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using tools::append_line;
using ull = unsigned long long;

void row(std::string& text, const char* name, const TimeFigures& f) {
  if (f.count == 0) return;
  append_line(text, "  %-32s %8zu %10.0f %10.0f %10.0f %10.0f", name, f.count, f.median, f.p99,
              f.p999, f.largest);
}

void columns(std::string& text) {
  append_line(text, "  %-32s %8s %10s %10s %10s %10s", "", "inputs", "median", "p99", "p99.9",
              "largest");
}

void add_work(std::string& text, const WcetReport& r, const SceneView& view) {
  const SceneCapacity& c = view.header().capacity;
  text += counters_text(r.bounds, view.parameters().law == LawId::kProxy);
  const double period_ns = 1e9 / view.parameters().rate_hz;
  const double bound_ns = r.loop.dearest_unit_ns * static_cast<double>(r.work_bound);
  append_line(
      text, "  %llu pairs, %llu bytes of state, %llu bytes of scene; %s", ull{view.pair_count()},
      ull{c.state_bytes}, ull{view.header().byte_count},
      c.unproven == 0 ? "exact at every pose" : "a tick may have to give up exactness, flagged");
  const bool searched = view.parameters().law != LawId::kProxy || r.loop.dearest_unit_ns > 0;
  if (searched)
    append_line(text,
                "  bound %llu units of work, most expensive unit %.1f ns: at most %.0f ns, %.1f %% "
                "of the period "
                "of %.0f ns%s",
                ull{r.work_bound}, r.loop.dearest_unit_ns, bound_ns, 100 * bound_ns / period_ns,
                period_ns, view.parameters().law == LawId::kProxy ? ", of the contact search" : "");
  if (view.parameters().law != LawId::kProxy) return;
  const double proxy_ns = r.loop.dearest_proxy_unit_ns * static_cast<double>(r.proxy_bound);
  const auto met = std::ranges::find(r.bounds, std::string("work_units"), &CounterBound::name);
  const double most = met == r.bounds.end() ? 1 : std::max<double>(1, met->peak);
  append_line(text,
              "  work of the proxy: budget %u units, at most %llu with what a tick may have begun, "
              "most met %.0f: bound / met %.1f",
              view.parameters().work_units, ull{r.proxy_bound}, most,
              static_cast<double>(r.proxy_bound) / most);
  append_line(text,
              "  at %.1f ns a unit, the most of a tick with much work: at most %.1f us, %.1f %% of "
              "the period; half a period at %.0f Hz on this machine",
              r.loop.dearest_proxy_unit_ns, 1e-3 * proxy_ns, 100 * proxy_ns / period_ns,
              proxy_ns > 0 ? 0.5e9 / proxy_ns : 0.0);
}

/// A row of the motion as its file has it; the header is line 1.
void input_row(std::string& text, const MotionSample& s, std::size_t tick) {
  append_line(text, "    its input, line %zu: %.6f,%.9f,%.9f,%.9f,%.12f,%.12f,%.12f,%.12f",
              tick + 2, s.t_s, s.p[0], s.p[1], s.p[2], s.q_wxyz[0], s.q_wxyz[1], s.q_wxyz[2],
              s.q_wxyz[3]);
}

/// The plain search of all nodes in the same run, against the core.
void add_ratio(std::string& text, const WcetReport& r) {
  const WcetResult& loop = r.loop;
  if (loop.exhaustive.count == 0 || !(loop.core.median > 0)) {
    append_line(text, "  exhaustive / core: not measured in a quick run without --motion");
    return;
  }
  double least = std::numeric_limits<double>::infinity();
  for (const TickTime& t : loop.ticks) least = std::min(least, t.exhaustive_ns / t.core_ns);
  const TickTime& worst = loop.ticks[loop.worst_tick];
  append_line(
      text,
      "  exhaustive / core: of the medians %.2f, of the largest %.2f, in the worst tick %.2f, "
      "least of any tick %.2f",
      loop.exhaustive.median / loop.core.median, loop.exhaustive.largest / loop.core.largest,
      worst.exhaustive_ns / worst.core_ns, least);
  append_line(text,
              "    (the search gives D_near alone; the core's time has its law, proxy included)");
}

void add_times(std::string& text, const WcetReport& r, std::span<const MotionSample> motion) {
  const WcetResult& loop = r.loop;
  append_line(
      text,
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
  append_line(text, "  first tick %.0f ns; worst later tick %zu (t = %.3f s, %.0f ns%s)",
              loop.first_tick_ns, loop.worst_tick, motion[loop.worst_tick].t_s,
              loop.ticks[loop.worst_tick].core_ns,
              loop.ticks[loop.worst_tick].relocalised ? ", re-localised" : "");
  input_row(text, motion[loop.worst_tick], loop.worst_tick);
  append_line(text, "  worst flushed tick %zu; %u repeats; flushed by %s, %zu bytes",
              r.same_state.worst_flushed, r.same_state.repeats, CacheFlush::method(),
              r.same_state.flushed_bytes);
  input_row(text, motion[r.same_state.worst_flushed], r.same_state.worst_flushed);
  add_ratio(text, r);
  append_line(text, "  empty measurement %.1f ns, subtracted", loop.clock_empty_ns);
  if (!r.same_state.same_result) append_line(text, "  REPEATS OF A TICK ENDED IN DIFFERENT STATES");
  append_line(text, "noise of this machine in ns: every repeat as it was, nothing about the code");
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
    append_line(text, "wake-ups of this machine: not measured: %s", std::strerror(m.error));
    return;
  }
  const auto us = [&](double q) { return 1e-3 * static_cast<double>(m.lateness.quantile_ns(q)); };
  append_line(text, "wake-ups of this machine in us (%llu, %s, memory %s), to be added by the user",
              ull{m.lateness.count()}, m.priority > 0 ? "SCHED_FIFO" : "ORDINARY PRIORITY",
              m.memory_locked ? "locked" : "not locked");
  append_line(text, "  p50 %.0f, p99 %.0f, p99.9 %.0f, largest %.0f; a period late or more: %llu",
              us(0.5), us(0.99), us(0.999), 1e-3 * static_cast<double>(m.lateness.largest_ns()),
              ull{m.late_ticks});
}

std::uint64_t most_work(const WcetResult& loop) {
  std::uint64_t most = 0;
  for (const TickTime& t : loop.ticks) most = std::max(most, work_units(t.counters));
  return most;
}

/// Whose doing a step of the wrench was.
void add_cause(std::string& text, const AdversarialFinding& f) {
  const StepCause& c = f.cause;
  std::string flags;
  for (std::size_t bit = 0; bit < kFlagCount; ++bit) {
    if ((c.flags >> bit & 1u) != 0) flags += " " + std::string(flag_name(bit));
  }
  append_line(
      text,
      "    of it the spring %.4g, damping %.4g %s; goal moved %.3g mm, %.3g rad, proxy %.3g mm, "
      "%.3g rad;%s",
      c.spring, c.damping, unit_of(f.goal), 1e3 * c.goal_m, c.goal_rad, 1e3 * c.proxy_m,
      c.proxy_rad, flags.empty() ? " no flags" : flags.c_str());
}

void add_findings(std::string& text, const WcetReport& r, const SceneView& view) {
  const AdversarialLimits& limits = r.plan.adversarial;
  append_line(text,
              "adversarial search, seed %llu: worst of one tick over motions of at most %g m/s, "
              "%g rad/s",
              ull{limits.seed}, kAdversarialSpeed_m_per_s, kAdversarialTurn_rad_per_s);
  for (const AdversarialFinding& f : r.findings) {
    append_line(text, "  %-20s %12.6g %-8s tick %2zu  of %llu motions, %llu restarts%s",
                to_text(f.goal), f.value, unit_of(f.goal), f.tick, ull{f.evaluations},
                ull{f.restarts}, f.not_finite > 0 ? "  WRENCH NOT FINITE" : "");
    if (f.goal == AdversarialGoal::kWork) {
      append_line(text, "  %-20s %12llu units; of the given motion %llu", "  bound of work",
                  ull{r.work_bound}, ull{most_work(r.loop)});
    }
    if (f.goal == AdversarialGoal::kForceStep || f.goal == AdversarialGoal::kTorqueStep)
      add_cause(text, f);
    if (f.goal != AdversarialGoal::kSituationChanges && !f.motion.empty())
      input_row(text, f.motion[f.tick], f.tick);
  }
  // What a spring alone would do at that speed; more is a change of contact within the tick.
  const SceneParameters& p = view.parameters();
  const double k_n_per_m = p.law == LawId::kProxy ? p.coupling.k_t_n_per_m : p.k_f_n_per_m;
  const double goal_m = kAdversarialSpeed_m_per_s / p.rate_hz;
  append_line(text, "  %-20s %12.6g N        (%g N/m at that speed)", "  spring's own step",
              k_n_per_m * goal_m, k_n_per_m);
}

}  // namespace

std::string wcet_table(const WcetReport& report, const SceneView& view,
                       std::span<const MotionSample> motion) {
  std::string text;
  add_work(text, report, view);
  text += stack_text(core_stack());
  text += instruction_table(report.instructions);
  add_times(text, report, motion);
  add_wakeups(text, report);
  add_findings(text, report, view);
  return text;
}

}  // namespace haptic::sim
