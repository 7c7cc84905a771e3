// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/link_watch.hpp"

#include <algorithm>
#include <cstdlib>

#include "hal/clock/servo_clock.hpp"

namespace haptic::tools {
namespace {

// Rounding to a device's units, from which the next step counts; steps are of newtons.
constexpr double kSlack_n = 1e-4;

}  // namespace

bool LinkWatch::is_open() const noexcept {
  const std::atomic<CountWindow>* window = window_.load(std::memory_order_acquire);
  return window != nullptr && window->load(std::memory_order_relaxed) == CountWindow::kOpen &&
         !ending_.load(std::memory_order_relaxed);
}

void LinkWatch::add_step(std::int64_t stamp_ns, std::int64_t period_ns, std::int64_t& last_ns,
                         hal::IntervalHistogram& jitter) noexcept {
  if (last_ns != 0) jitter.add(std::abs(stamp_ns - last_ns - period_ns));
  last_ns = stamp_ns;
}

void LinkWatch::on_report(std::int64_t stamp_ns, std::span<const std::uint8_t> /*report*/,
                          hal::ReportVerdict verdict, std::uint64_t /*sequence*/) noexcept {
  if (!is_open()) return;
  if (verdict == hal::ReportVerdict::kState)
    add_step(stamp_ns, report_period_ns_, report_ns_, times_.report_jitter);
  unanswered_ns_ = stamp_ns;
}

void LinkWatch::on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> /*report*/,
                        const hal::GuardedOutput& output) noexcept {
  note_output(stamp_ns, output);
  if (!is_open()) return;
  add_step(stamp_ns, period_ns_, send_ns_, times_.send_jitter);
  // The bus has taken it by now; the stamp is from before.
  if (unanswered_ns_ != 0) times_.answer.add(hal::monotonic_ns() - unanswered_ns_);
  unanswered_ns_ = 0;
}

void LinkWatch::on_link(std::int64_t /*stamp_ns*/, LinkState state,
                        hal::HalStatus /*why*/) noexcept {
  if (state == LinkState::kAbsent) {
    force_n_.store(0, std::memory_order_relaxed);
    torque_nm_.store(0, std::memory_order_relaxed);
  }
  report_ns_ = send_ns_ = unanswered_ns_ = 0;
}

void LinkWatch::note_output(std::int64_t stamp_ns, const hal::GuardedOutput& output) noexcept {
  const Vec3 force_d = output.wrench_d.force_w;
  faults_.store(output.faults, std::memory_order_relaxed);
  end_.last_force_n = static_cast<double>(force_d.norm());
  end_.last_torque_nm = static_cast<double>(output.wrench_d.torque_w.norm());
  if (ending_.load(std::memory_order_relaxed)) {
    const double elapsed_s = std::min(1e-9 * static_cast<double>(stamp_ns - output_ns_),
                                      static_cast<double>(longest_step_s(period_ns_)));
    const auto step_n = static_cast<double>((force_d - force_d_).norm());
    end_.outputs += 1;
    end_.jumps += step_n > slew_n_per_s_ * elapsed_s + kSlack_n ? 1u : 0u;
  } else {
    end_.force_n = end_.last_force_n;
  }
  force_n_.store(end_.last_force_n, std::memory_order_relaxed);
  torque_nm_.store(end_.last_torque_nm, std::memory_order_relaxed);
  force_d_ = force_d;
  output_ns_ = stamp_ns;
}

}  // namespace haptic::tools
