// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/realtime/rate_error.hpp"

#include <algorithm>
#include <cmath>

#include "hal/clock/servo_clock.hpp"
#include "host_sim/lab/laws/law_comparison.hpp"
#include "host_sim/lab/pareto/headline.hpp"
#include "host_sim/report/quantile.hpp"
#include "host_sim/session/core_session.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr int kErrorRepeats = 5;

struct RateWrench {
  Vector force_n, torque_nm;
  bool recovers = false;  ///< the part was inside: its force is being ramped in
};

struct RateRun {
  std::vector<RateWrench> wrenches;
  std::vector<double> ns;
};

/// Every `substeps`-th tick along the motion, whose samples are a sub-step apart.
RateRun run_rate(const SceneView& view, std::span<const MotionSample> motion, double rate_hz,
                 std::uint32_t passes, std::uint32_t substeps) {
  SceneParameters changed = view.parameters();
  changed.coupling.passes = passes;
  changed.rate_hz = rate_hz * substeps;
  CoreSession session(scene_with_parameters(view, changed), "passes");
  RateRun run;
  for (std::size_t k = 0; k < motion.size(); ++k) {
    StepInput input = input_of(motion[k], k);
    input.stamp_ns = std::llround(static_cast<double>(k) * 1e9 / changed.rate_hz);
    const std::int64_t begin_ns = hal::monotonic_ns();
    const StepResult result = session.core().step(input);
    const std::int64_t took_ns = hal::monotonic_ns() - begin_ns;
    if (result.status != RtStatus::kOk)
      throw tools::InputError("tick " + std::to_string(k) +
                              " of the motion: the pose is refused: " + to_text(result.status));
    if (k % substeps != 0) continue;
    run.ns.push_back(static_cast<double>(took_ns));
    run.wrenches.push_back({result.wrench_w.force_w.cast<double>(),
                            result.wrench_w.torque_w.cast<double>(),
                            (result.flags & kFlagRecovery) != 0});
  }
  return run;
}

RateError error_of(const RateRun& run, const RateRun& reference) {
  RateError error;
  std::vector<double> force_n, torque_nm, ns = run.ns;
  error.ticks = run.wrenches.size();
  for (std::size_t k = 0; k < run.wrenches.size(); ++k) {
    const RateWrench& exact = reference.wrenches[k];
    if (exact.force_n.isZero(0) && exact.torque_nm.isZero(0)) continue;
    if (exact.recovers || run.wrenches[k].recovers) continue;
    force_n.push_back((run.wrenches[k].force_n - exact.force_n).norm());
    torque_nm.push_back((run.wrenches[k].torque_nm - exact.torque_nm).norm());
    error.largest_force_n = std::max(error.largest_force_n, exact.force_n.norm());
    error.largest_torque_nm = std::max(error.largest_torque_nm, exact.torque_nm.norm());
  }
  error.contact_ticks = force_n.size();
  std::ranges::sort(ns);
  error.p99_tick_ns = ns.empty() ? 0 : quantile(ns, 0.99);
  if (force_n.empty()) return error;
  std::ranges::sort(force_n);
  std::ranges::sort(torque_nm);
  error.median_force_error_n = quantile(force_n, 0.5);
  error.p99_force_error_n = quantile(force_n, 0.99);
  error.max_force_error_n = force_n.back();
  error.p99_torque_error_nm = quantile(torque_nm, 0.99);
  error.max_torque_error_nm = torque_nm.back();
  return error;
}

}  // namespace

std::vector<RateError> rate_errors(const SceneView& view, const MotionScript& motion,
                                   std::span<const double> rates_hz) {
  const SceneParameters& own = view.parameters();
  if (own.law != LawId::kProxy)
    throw tools::InputError(std::string("law '") + law_name(own.law) +
                            "' has no passes; compile the scene with law = \"proxy\"");
  std::vector<RateError> errors;
  for (const double rate_hz : rates_hz) {
    MotionScript script = motion;
    script.rate_hz = rate_hz * kHeadlineSubsteps;
    const std::vector<MotionSample> fine = make_motion(script);
    std::vector<MotionSample> coarse;
    for (std::size_t k = 0; k < fine.size(); k += kHeadlineSubsteps) coarse.push_back(fine[k]);
    const RateRun reference = run_rate(view, fine, rate_hz, kReferencePasses, kHeadlineSubsteps);
    std::vector<std::uint32_t> passes = {own.coupling.passes};
    if (passes[0] > 1) passes.push_back(1);
    for (const std::uint32_t count : passes) {
      RateRun best = run_rate(view, coarse, rate_hz, count, 1);
      for (int repeat = 1; repeat < kErrorRepeats; ++repeat) {
        const RateRun again = run_rate(view, coarse, rate_hz, count, 1);
        for (std::size_t k = 0; k < best.ns.size(); ++k)
          best.ns[k] = std::min(best.ns[k], again.ns[k]);
      }
      RateError error = error_of(best, reference);
      error.rate_hz = rate_hz;
      error.passes = count;
      errors.push_back(error);
    }
  }
  return errors;
}

}  // namespace haptic::sim
