// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/faults/fault_matrix.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <exception>
#include <map>
#include <mutex>
#include <span>
#include <thread>

#include "hal/drivers/reference_codec.hpp"
#include "rt_core/safety/safety_limits.hpp"
#include "rt_core/safety/wrench_ramp.hpp"

namespace haptic::sim {
namespace {

/// Half a unit of each of two commands per axis, and as much for what the stages round.
constexpr double kRounding_n = 2 * hal::kReferenceForceUnit_n;
constexpr double kRounding_nm = 2 * hal::kReferenceTorqueUnit_nm;
/// A tolerated fault leaves the force within this of the run without it.
constexpr double kUnchanged_n = 0.1;
/// Of the force after re-arming: when a ramp in counts as over, and what it must come to.
constexpr double kRampedShare = 0.95, kLeastRecovered_n = 1.0;

Load operator-(const Load& l, const Load& r) {
  return {l.force_w - r.force_w, l.torque_w - r.torque_w};
}
bool is_zero(const Load& load) { return load.force_w.isZero(0) && load.torque_w.isZero(0); }

std::string failure_text(const char* format, double found, double stated) {
  char text[160];
  std::snprintf(text, sizeof text, format, found, stated);
  return text;
}

class FaultJudge {
 public:
  FaultJudge(FaultVerdict& verdict, const FaultTrace& unharmed, const FaultSettings& settings,
             const SafetyLimits& limits)
      : v_(verdict), t_(verdict.trace), unharmed_(unharmed), settings_(settings), limits_(limits) {}

  void judge() {
    measure_sends();
    measure_acting();
    measure_watch();
    measure_recovery();
    judge_limits();
    judge_outcome();
    judge_recovery();
  }
  /// The hand that the fault is not at.
  void judge_other() {
    measure_sends();
    measure_acting();
    measure_watch();
    judge_limits();
    judge_outcome();
  }

 private:
  void measure_sends();
  void measure_acting();
  void measure_watch();
  void measure_recovery();
  void judge_limits();
  void judge_outcome();
  void judge_recovery();

  void fail(std::string text) { v_.failures.push_back(std::move(text)); }
  /// Share of the allowed change within `elapsed_s`.
  [[nodiscard]] double change_share(const Load& change, double elapsed_s) const {
    const double counted_s =
        std::min(elapsed_s, static_cast<double>(longest_step_s(limits_.period_ns)));
    const double force_n = static_cast<double>(limits_.slew_n_per_s) * counted_s + kRounding_n;
    const double torque_nm = static_cast<double>(limits_.slew_nm_per_s) * counted_s + kRounding_nm;
    return std::max(change.force_w.norm() / force_n, change.torque_w.norm() / torque_nm);
  }
  void note_size(const Load& load) {
    FaultFigures& f = v_.found;
    f.largest_n = std::max(f.largest_n, load.force_w.norm());
    const double force_n = static_cast<double>(limits_.max_force_n) + kRounding_n;
    const double torque_nm = static_cast<double>(limits_.max_torque_nm) + kRounding_nm;
    f.limit_share =
        std::max({f.limit_share, load.force_w.norm() / force_n, load.torque_w.norm() / torque_nm});
  }

  FaultVerdict& v_;
  const FaultTrace& t_;
  const FaultTrace& unharmed_;
  const FaultSettings& settings_;
  const SafetyLimits& limits_;
};

/// Newest command of a sample or the one before it.
Load handed_at(const FaultTrace& trace, std::size_t end) {
  while (end-- > 0) {
    if (!trace.samples[end].sent.empty()) return trace.samples[end].sent.back().wrench;
    if (trace.samples[end].link == LinkState::kAbsent) break;
  }
  return {};
}

/// Against the command before it or, where that did not arrive, the one that the device has. What
/// goes out while the drives are off is not felt: the next that is must begin at zero.
void FaultJudge::measure_sends() {
  StackSend last, arrived;
  std::map<std::uint32_t, StackSend> sent;
  std::uint32_t accepted = 0;  ///< by the device, before this period
  for (const FaultSample& sample : t_.samples) {
    if (const auto found = sent.find(accepted); found != sent.end()) arrived = found->second;
    accepted = sample.accepted;
    const auto forget = [&] {
      last.wrench = arrived.wrench = {};
      sent.clear();
    };
    if (!sample.drives_on) forget();
    for (const StackSend& send : sample.sent) {
      note_size(send.wrench);
      const auto share = [&](const StackSend& before) {
        return change_share(send.wrench - before.wrench,
                            1e-9 * static_cast<double>(send.stamp_ns - before.stamp_ns));
      };
      if (sample.drives_on) {
        v_.found.send_share = std::max(v_.found.send_share, std::min(share(last), share(arrived)));
        sent[send.sequence] = send;
      }
      last = send;
      if (!sample.drives_on) last.wrench = {};
    }
    if (sample.link == LinkState::kAbsent) forget();  // what was sent went out before
  }
}

/// A command acts from the period after its acceptance on: what it may change grows with the time
/// since the one accepted before it was sent.
void FaultJudge::measure_acting() {
  std::map<std::uint32_t, std::int64_t> sent_ns;
  std::int64_t acts_since_ns = 0;  ///< when what acts in a period was sent
  for (std::size_t k = 1; k < t_.samples.size(); ++k) {
    const FaultSample &before = t_.samples[k - 1], &now = t_.samples[k];
    // In real time it may have come after the period before was looked at.
    for (const FaultSample* sample : {&before, &now}) {
      for (const StackSend& send : sample->sent) sent_ns[send.sequence] = send.stamp_ns;
    }
    const auto sent = sent_ns.find(now.acts);
    const std::int64_t acts_ns = sent == sent_ns.end() ? acts_since_ns : sent->second;
    note_size(now.acting);
    const bool cut =
        !is_zero(before.acting) && is_zero(now.acting) && !(now.drives_on && before.drives_on);
    if (cut) {
      v_.found.cuts += 1;
    } else {
      const double elapsed_s = 1e-9 * static_cast<double>(acts_ns - acts_since_ns);
      v_.found.acting_share =
          std::max(v_.found.acting_share, change_share(now.acting - before.acting, elapsed_s));
    }
    acts_since_ns = acts_ns;
  }
}

void FaultJudge::measure_watch() {
  FaultFigures& f = v_.found;
  const FaultSample &begin = t_.samples[t_.injected - 1], &end = t_.samples[t_.cleared - 1];
  f.handed_before_n = handed_at(t_, t_.injected).force_w.norm();
  f.handed_after_n = handed_at(t_, t_.cleared).force_w.norm();
  f.acting_before_n = begin.acting.force_w.norm();
  f.acting_after_n = end.acting.force_w.norm();
  f.safety = end.safety;
  std::size_t zero_from = t_.cleared;
  for (std::size_t k = t_.cleared; k-- > t_.injected && is_zero(t_.samples[k].acting);)
    zero_from = k;
  if (zero_from < t_.cleared)
    f.zero_after_s = static_cast<double>(zero_from - t_.injected) * t_.period_s;
  for (std::size_t k = t_.injected; k < t_.cleared; ++k) {
    f.device |= t_.samples[k].device;
    if (k >= unharmed_.samples.size()) continue;
    f.dip_n = std::max(
        f.dip_n, unharmed_.samples[k].acting.force_w.norm() - t_.samples[k].acting.force_w.norm());
  }
}

void FaultJudge::measure_recovery() {
  FaultFigures& f = v_.found;
  f.recovered_n = t_.samples.back().acting.force_w.norm();
  std::size_t first = t_.samples.size(), over = t_.samples.size();
  for (std::size_t k = t_.samples.size(); k-- > t_.pressed;) {
    const double force_n = t_.samples[k].acting.force_w.norm();
    if (force_n > 0) first = k;
    if (force_n >= kRampedShare * f.recovered_n) over = k;
  }
  if (first < over) f.ramp_in_s = static_cast<double>(over - first) * t_.period_s;
}

void FaultJudge::judge_limits() {
  const FaultFigures& f = v_.found;
  if (f.limit_share > 1) fail(failure_text("%.4f of the largest wrench", f.limit_share, 1));
  if (f.send_share > 1)
    fail(failure_text("a command changes by %.4f of the slew limit", f.send_share, 1));
  if (f.acting_share > 1)
    fail(failure_text("the device's wrench changes by %.4f of the slew limit", f.acting_share, 1));
}

void FaultJudge::judge_outcome() {
  const FaultFigures& f = v_.found;
  const FaultExpectation& e = v_.expected;
  if ((f.safety & ~e.safety_may) != e.safety) {
    fail("latched " + safety_fault_names(f.safety) + " instead of " + safety_fault_names(e.safety));
  }
  if (f.device != e.device) {
    fail("reported " + device_fault_names(f.device) + " instead of " +
         device_fault_names(e.device));
  }
  // A cut counts where there is force to be cut.
  const bool may_cut = e.output == FaultOutput::kCut;
  const bool must_cut = may_cut && v_.cell.state == FaultState::kArmedContact;
  if (f.cuts > (may_cut ? 1u : 0u) || f.cuts < (must_cut ? 1u : 0u))
    fail(failure_text("%.0f cuts by the device instead of %.0f", f.cuts, may_cut ? 1 : 0));
  if (e.output == FaultOutput::kBounded) return;
  const bool ends_at_zero = e.output == FaultOutput::kRampsToZero || e.output == FaultOutput::kCut;
  if (ends_at_zero) {
    if (f.zero_after_s < 0 || f.zero_after_s > e.zero_within_s + 1e-9)
      fail(failure_text("zero after %.3f s, stated %.3f", f.zero_after_s, e.zero_within_s));
    // What an unplugged device was handed last is not taken back: nothing is handed any more.
    const bool away = t_.samples[t_.cleared - 1].link == LinkState::kAbsent;
    if (f.handed_after_n > 0 && !away)
      fail(failure_text("%.4f N are still handed over", f.handed_after_n, 0));
    return;
  }
  // Clocked by reports, what would dip may be overtaken by the next command before it is sent.
  const bool dips = f.dip_n > kUnchanged_n;
  const bool may_dip = e.output == FaultOutput::kDips;
  if (v_.cell.state == FaultState::kArmedContact &&
      (may_dip ? !dips && !settings_.report_clocked : dips))
    fail(failure_text("dips by %.3f N; what counts as a dip: %.3f", f.dip_n, kUnchanged_n));
  const double handed_n = handed_at(unharmed_, unharmed_.cleared).force_w.norm();
  const double acting_n = unharmed_.samples[unharmed_.cleared - 1].acting.force_w.norm();
  if (std::abs(f.handed_after_n - handed_n) > kUnchanged_n)
    fail(failure_text("%.3f N handed in the end, without the fault %.3f", f.handed_after_n,
                      handed_n));
  if (std::abs(f.acting_after_n - acting_n) > kUnchanged_n)
    fail(failure_text("%.3f N act in the end, without the fault %.3f", f.acting_after_n, acting_n));
  if (t_.samples[t_.cleared - 1].arming != unharmed_.samples[unharmed_.cleared - 1].arming)
    fail("armed otherwise than without the fault");
}

void FaultJudge::judge_recovery() {
  const FaultFigures& f = v_.found;
  const FaultSample& end = t_.samples.back();
  if (end.arming != ArmingState::kArmed || end.safety != 0 || end.device != 0)
    fail("cannot be armed again: " + safety_fault_names(end.safety) + ", " +
         device_fault_names(end.device));
  if (f.recovered_n < kLeastRecovered_n)
    fail(
        failure_text("%.3f N after arming again, at least %.3f", f.recovered_n, kLeastRecovered_n));
  // The part of one of two hands is pressed on once the ramp is over.
  if (settings_.hands == 1 && f.ramp_in_s < static_cast<double>(kMinRampIn_s))
    fail(failure_text("ramp in of %.3f s, at least %.3f", f.ramp_in_s,
                      static_cast<double>(kMinRampIn_s)));
  // A device or process that was plugged in, calibrated or started meanwhile gets zero until the
  // operator arms.
  bool connected = false;
  for (std::size_t k = t_.cleared; k < t_.pressed; ++k) {
    connected = connected || t_.samples[k - 1].link != LinkState::kReady;
    for (const StackSend& send : t_.samples[k].sent) {
      if (connected && !is_zero(send.wrench))
        return fail(
            failure_text("%.4f N handed over before arming", send.wrench.force_w.norm(), 0));
    }
  }
  if (!is_zero(t_.samples[t_.pressed - 1].acting)) fail("force before arming");
}

/// The other hand of a trace, as a trace of its own.
FaultTrace other_of(const FaultTrace& trace) {
  return {trace.period_s, trace.others, {}, trace.injected, trace.cleared, trace.pressed};
}

/// The state that the other hand is in, whose device is there and calibrated.
FaultState other_state(FaultState state) {
  return state == FaultState::kAbsent || state == FaultState::kStarting ? FaultState::kDisarmed
                                                                        : state;
}

/// A fault of the one servo loop or of the machine is one of both hands, and both are released by
/// an emergency stop; any other leaves the other hand as it is.
FaultExpectation expectation_of_other(const FaultCase& cell, const SafetyLimits& limits,
                                      bool linked) {
  const FaultCause cause = cell.fault->cause;
  const FaultCase in_force{other_state(cell.state), cell.fault};
  if (cause == FaultCause::kServoLost || cause == FaultCause::kServoStalled ||
      cause == FaultCause::kSuspended)
    return expectation_of(in_force, limits, linked);
  const FaultExpectation at_fault = expectation_of(cell, limits, linked);
  const bool stops =
      cell.state != FaultState::kFaulted && (at_fault.safety & kFaultEmergencyStop) != 0;
  const FaultCause felt = stops ? FaultCause::kEmergencyCall : FaultCause::kNothing;
  const auto fault = std::ranges::find(faults(), felt, &Fault::cause);
  return expectation_of({in_force.state, &*fault}, limits, linked);
}

/// A part of two hands begins again where it is felt, and so never inside another.
FaultExpectation beside_another(FaultExpectation e, const FaultSettings& settings) {
  if (settings.hands > 1) e.safety &= ~kFaultScene;
  return e;
}

std::vector<FaultCase> cells_of(const FaultMatrixOptions& options) {
  std::vector<FaultCase> cells;
  for (const Fault& fault : faults()) {
    for (int s = 0; s < static_cast<int>(FaultState::kCount); ++s) {
      const auto state = static_cast<FaultState>(s);
      const bool direct = options.run.carrier == StackCarrier::kDirect;
      if (direct && (!fault.without_bus() || state == FaultState::kAbsent)) continue;
      const bool forceful = state == FaultState::kArming || state == FaultState::kArmedContact ||
                            state == FaultState::kDisarming;
      if (options.quick && !forceful) continue;
      // One of two hands leads its part on from where that is, wherever its device was before.
      const bool not_there = state == FaultState::kAbsent || state == FaultState::kStarting;
      if (options.run.hands > 1 && not_there && fault.moves_hand()) continue;
      const FaultCase cell{state, &fault};
      if (!options.wanted || options.wanted(cell)) cells.push_back(cell);
    }
  }
  return cells;
}

/// Calls work(0) to work(count - 1), on several threads; the first exception comes out.
void run_shared(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next = 0;
  std::exception_ptr trouble;
  std::mutex mutex;
  const auto take = [&] {
    for (std::size_t k = next++; k < count; k = next++) {
      try {
        work(k);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!trouble) trouble = std::current_exception();
        next = count;
      }
    }
  };
  std::vector<std::thread> pool;
  for (unsigned k = 1; k < threads; ++k) pool.emplace_back(take);
  take();
  for (std::thread& thread : pool) thread.join();
  if (trouble) std::rethrow_exception(trouble);
}

}  // namespace

FaultVerdict judge_fault(const FaultCase& cell, FaultTrace trace, const FaultTrace& unharmed,
                         const FaultSettings& settings) {
  const SafetyLimits limits = reference_stack(settings.carrier).limits;
  FaultVerdict verdict;
  verdict.cell = cell;
  verdict.hand = settings.faulty;
  const bool linked = settings.carrier == StackCarrier::kUsb;
  verdict.expected = beside_another(expectation_of(cell, limits, linked), settings);
  verdict.trace = std::move(trace);
  FaultJudge(verdict, unharmed, settings, limits).judge();
  if (settings.hands == 1) return verdict;
  FaultVerdict other;
  other.cell = {other_state(cell.state), cell.fault};
  other.expected = beside_another(expectation_of_other(cell, limits, linked), settings);
  other.trace = other_of(verdict.trace);
  FaultJudge(other, other_of(unharmed), settings, limits).judge_other();
  for (const std::string& failure : other.failures)
    verdict.failures.push_back("the other hand: " + failure);
  return verdict;
}

namespace {

/// The cells with the fault at one device, into `verdicts`.
void run_cells(const std::vector<std::byte>& scene, const std::vector<FaultCase>& cells,
               const FaultSettings& settings, unsigned threads, std::span<FaultVerdict> verdicts) {
  std::array<FaultTrace, static_cast<std::size_t>(FaultState::kCount)> unharmed;
  run_shared(unharmed.size(), threads, [&](std::size_t k) {
    const FaultCase cell{static_cast<FaultState>(k), &faults().front()};
    const bool asked = std::any_of(cells.begin(), cells.end(),
                                   [&](const FaultCase& c) { return c.state == cell.state; });
    if (asked) unharmed[k] = run_fault(scene, cell, settings);
  });
  run_shared(cells.size(), threads, [&](std::size_t k) {
    verdicts[k] = judge_fault(cells[k], run_fault(scene, cells[k], settings),
                              unharmed[static_cast<std::size_t>(cells[k].state)], settings);
  });
}

}  // namespace

std::vector<FaultVerdict> run_fault_matrix(const FaultMatrixOptions& options) {
  const std::vector<std::byte> scene = fault_scene(options.run.hands);
  const std::vector<FaultCase> cells = cells_of(options);
  std::vector<FaultVerdict> verdicts(cells.size() * options.run.hands);
  for (std::size_t hand = 0; hand < options.run.hands; ++hand) {
    FaultSettings settings = options.run;
    settings.faulty = hand;
    run_cells(scene, cells, settings, options.threads,
              std::span(verdicts).subspan(hand * cells.size(), cells.size()));
  }
  return verdicts;
}

bool all_hold(const std::vector<FaultVerdict>& verdicts) {
  return std::all_of(verdicts.begin(), verdicts.end(),
                     [](const FaultVerdict& v) { return v.failures.empty(); });
}

}  // namespace haptic::sim
