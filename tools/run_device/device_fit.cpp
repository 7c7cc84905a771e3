// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/device_fit.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "hal/device_limits.hpp"
#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/coupling/passivity_budget.hpp"
#include "tools/graph_compiler/coupling/served_size.hpp"

namespace haptic::tools {
namespace {

/// Numbers that differ by less are those of one device, written down twice.
constexpr double kSameDevice = 0.01;
constexpr double kRounding = 1.0e-6;
constexpr double kNsPerSecond = 1.0e9;

/// Largest share of its force for a loop that the machine may let down.
constexpr double kDegradedShare = 0.5;

std::string number(double value) { return short_number(value, 4); }

/// From a number of four digits to the next one. What a device states is known to a rounding.
constexpr double kOneDigit = 1 + 5.1e-4, kStated = static_cast<double>(kRealEpsilon);

/// A number to advise as it is printed: not below, or not above, what would do.
std::string at_least(double value) {
  const std::string text = number(value);
  return std::stod(text) < value * (1 - kStated) ? number(value * kOneDigit) : text;
}
std::string at_most(double value) {
  const std::string text = number(value);
  return std::stod(text) > value * (1 + kStated) ? number(value / kOneDigit) : text;
}

bool differs(double one, double other) {
  return one > 0 && other > 0 && std::abs(one - other) > kSameDevice * std::max(one, other);
}

/// The device as the budget takes it, in the units of the scene: x_w = s x_d, F_w = F_d / s.
DeviceParameters in_scene_units(const DeviceParameters& d, double s) {
  DeviceParameters scaled = d;
  scaled.mass_kg /= s * s;
  scaled.damping_ns_per_m /= s * s;
  scaled.coulomb_friction_n /= s;
  scaled.encoder_step_m *= s;
  return scaled;
}

class Fit {
 public:
  Fit(const FitQuestion& question, const hal::DeviceCapabilities& device)
      : q_(question), device_(device), proxy_(question.scene.law == LawId::kProxy) {}

  FitAnswer answer() {
    compare_devices();
    compare_reach();
    compare_periods();
    if (answer_.refusal.empty()) check_stated_gains();
    if (answer_.refusal.empty()) check_budget();
    return answer_;
  }

 private:
  void note(std::string text) { answer_.notes.push_back(std::move(text)); }
  [[nodiscard]] double square() const { return q_.scale * q_.scale; }
  [[nodiscard]] std::string at_scale() const {
    return q_.scale == 1 ? "" : " at [workspace] scale " + number(q_.scale);
  }
  [[nodiscard]] std::int64_t interval_ns() const { return hal::report_interval_ns(device_); }
  [[nodiscard]] double period_s() const {
    return static_cast<double>(std::max(q_.loop_period_ns, interval_ns())) / kNsPerSecond;
  }

  [[nodiscard]] double latency_s() const {
    return static_cast<double>(device_.latency_ns) / kNsPerSecond;
  }

  /// A scene that was compiled for one device, on another.
  void compare_devices() {
    const DeviceParameters& d = q_.scene.device;
    if (d.given == 0) return;
    const struct {
      const char* name;
      double scene;
      Real device;
    } rows[] = {{"mass_kg", d.mass_kg, device_.mass_kg},
                {"damping_ns_per_m", d.damping_ns_per_m, device_.damping_ns_per_m},
                {"coulomb_friction_n", d.coulomb_friction_n, device_.coulomb_friction_n},
                {"encoder_step_m", d.encoder_step_m, device_.encoder_step_m},
                {"encoder_step_rad", d.encoder_step_rad, device_.encoder_step_rad},
                {"max_force_n", d.max_force_n, device_.max_force_n},
                {"max_torque_nm", d.max_torque_nm, device_.max_torque_nm}};
    std::string list;
    for (const auto& row : rows) {
      const auto stated = static_cast<double>(row.device);
      if (!differs(row.scene, stated)) continue;
      list += (list.empty() ? "" : ", ") + std::string(row.name) + " " + number(row.scene) +
              " there, " + number(stated) + " here";
    }
    if (!list.empty()) note("the scene was budgeted for another device: " + list);
  }

  /// How far the device reaches into the scene's workspace.
  void compare_reach() {
    const double reach_m = q_.scale * static_cast<double>(device_.workspace_radius_m);
    const EnvelopeParameters& box = q_.scene.envelope;
    double wanted_m = 0;
    for (int k = 0; k < 3; ++k) wanted_m = std::max(wanted_m, 0.5 * (box.max_m[k] - box.min_m[k]));
    // The device's radius is known to half a rounding of Real: what that reaches is reached.
    const bool reaches = !(wanted_m > reach_m * (1 + static_cast<double>(kRealEpsilon) / 2));
    if ((box.given & kWorkspaceGiven) == 0 || !(reach_m > 0) || reaches) return;
    note("the device reaches " + number(reach_m) + " m of the scene to either side" + at_scale() +
         ", whose workspace needs " + number(wanted_m) + " m; [workspace] scale = " +
         at_least(wanted_m / static_cast<double>(device_.workspace_radius_m)) + " would reach it");
  }

  /// Rates of the scene, of the loop and of the reports, against one another.
  void compare_periods() {
    const double loop_hz = kNsPerSecond / static_cast<double>(q_.loop_period_ns);
    const double scene_hz = q_.scene.rate_hz;
    const double reports_hz =
        interval_ns() > 0 ? kNsPerSecond / static_cast<double>(interval_ns()) : 0;
    const bool slow = interval_ns() > 0 && interval_ns() > q_.loop_period_ns;
    if (q_.report_clocked && slow && differs(loop_hz, reports_hz)) {
      answer_.refusal = "the loop is to tick at each report, " + in_hz(loop_hz) + ", and " +
                        delivers() + "; give [loop] rate_hz = " + rate(reports_hz) +
                        ", or clocking = \"timer\"";
      return;
    }
    if (reports_hz > 0 && scene_hz > reports_hz && differs(scene_hz, reports_hz))
      note("the scene is compiled for " + in_hz(scene_hz) + ", and " + delivers() +
           ": gains, passes and errors are those of " + in_hz(reports_hz) +
           "; compile it with [loop] rate_hz = " + rate(reports_hz) +
           ", or take a device that reports every " + in_ms(kNsPerSecond / scene_hz));
    if (differs(scene_hz, loop_hz))
      note("the scene is compiled for " + in_hz(scene_hz) + " and the loop ticks at " +
           in_hz(loop_hz) + "; give [loop] rate_hz = " + rate(scene_hz) +
           ", or compile the scene with [loop] rate_hz = " + rate(loop_hz));
    if (slow)
      note("the device reports every " + in_ms(static_cast<double>(interval_ns())) +
           " and the loop ticks every " + in_ms(static_cast<double>(q_.loop_period_ns)) +
           ": between two reports the wrench is held");
  }

  static std::string rate(double rate_hz) { return short_number(rate_hz, 6); }
  static std::string in_hz(double rate_hz) { return rate(rate_hz) + " Hz"; }
  static std::string in_ms(double ns) { return number(1e-6 * ns) + " ms"; }

  /// "the device delivers at most 1000 reports a second, one every 1 ms".
  [[nodiscard]] std::string delivers() const {
    const auto ns = static_cast<double>(interval_ns());
    const bool bus = device_.bus_interval_ns > device_.report_period_ns;
    return std::string("the device delivers at most ") + rate(kNsPerSecond / ns) +
           " reports a second, one every " + in_ms(ns) + (bus ? " by its bInterval" : "");
  }

  /// Stiffness and damping against what the device states for itself.
  void check_stated_gains() {
    // Two planes that face each other add up where no proxy stands between.
    const double k = proxy_ ? q_.scene.coupling.k_t_n_per_m : 2 * q_.scene.k_f_n_per_m;
    const double b = proxy_ ? q_.scene.coupling.damping_ns_per_m : 0;
    check_stated("stiffness", "N/m", k, static_cast<double>(device_.max_stiffness_n_per_m));
    check_stated("damping", "N s/m", b, static_cast<double>(device_.max_damping_ns_per_m));
  }

  void check_stated(const char* what, const char* unit, double scene, double most) {
    const double felt = square() * scene;
    if (!(most > 0) || felt <= most * (1 + kRounding) || !answer_.refusal.empty()) return;
    answer_.refusal = std::string("the device would feel a ") + what + " of " + number(felt) + " " +
                      unit + at_scale() + ", more than the " + number(most) +
                      " that it states as its largest; compile the scene with a " + what +
                      " of at most " + at_most(most / square()) + ", or give [workspace] scale = " +
                      at_most(q_.scale * std::sqrt(most / felt)) + " or less";
  }

  /// The scene's parameters with the connected device in them.
  [[nodiscard]] SceneParameters on_device() const {
    SceneParameters p = q_.scene;
    const auto take = [](Real stated, double& value) {
      if (stated > 0) value = static_cast<double>(stated);
    };
    DeviceParameters& d = p.device;
    take(device_.mass_kg, d.mass_kg);
    // A device that states its mass and a damping of 0 has no damping.
    if (device_.mass_kg > 0) d.damping_ns_per_m = static_cast<double>(device_.damping_ns_per_m);
    take(device_.coulomb_friction_n, d.coulomb_friction_n);
    take(device_.encoder_step_m, d.encoder_step_m);
    d.given = 1;
    // At the handle, before lengths are scaled: the scale does not change a rotor.
    if (proxy_ && !has_rotor(d) && d.mass_kg > 0) {
      const double r2 = kAssumedRotorRadius_m * kAssumedRotorRadius_m;
      std::ranges::fill(d.rotor_inertia_kg_m2, d.mass_kg * r2);
      std::ranges::fill(d.rotor_damping_nms_per_rad, d.damping_ns_per_m * r2);
    }
    const double tick_s = q_.longest_tick * period_s();
    p.rate_hz = 1 / tick_s;
    const double late_s = (q_.report_clocked ? 0.5 * tick_s : tick_s) + latency_s();
    d.delay_s = std::max(d.delay_s, late_s);
    d = in_scene_units(d, q_.scale);
    return p;
  }

  void check_budget() {
    const SceneParameters p = on_device();
    PassivityBudget budget = passivity_budget(p, q_.radius_m);
    // A torque that the device cannot exert makes nothing unstable.
    if ((device_.driven_dof & hal::kDofRotation) == 0)
      std::erase_if(budget.states, [](const ContactStateBudget& s) {
        return std::string_view(s.state).starts_with("rotation");
      });
    std::string defect;
    if (!budget.unchecked.empty()) {
      defect =
          "no passivity budget can be computed: the device states no mass, and the scene has none "
          "in [device]";
    } else if (!budget.holds()) {
      defect = "beyond the passivity budget of this device" + at_scale() + ", every " +
               number(1e3 * period_s()) + " ms and " + number(1e3 * p.device.delay_s) + " ms late" +
               of_its_own() + ": " + beyond(budget);
    }
    if (defect.empty()) {
      note("within the passivity budget of this device" + of_its_own() + ": " + margin(budget));
      return;
    }
    if (q_.scene.coupling.allow_active != 0 || q_.accept_unbudgeted) {
      note(defect + (q_.accept_unbudgeted ? "; accepted by --accept-unbudgeted"
                                          : "; the scene allows it by allow_active"));
      return;
    }
    answer_.refusal = defect +
                      "; give the scene a [device] table with the numbers of this device and "
                      "compile it again, or run it all the same with --accept-unbudgeted";
  }

  /// ", 0.4 ms of it the device's own".
  [[nodiscard]] std::string of_its_own() const {
    return device_.latency_ns > 0
               ? ", with " + number(1e3 * latency_s()) + " ms of latency that the device states"
               : "";
  }

  static std::string beyond(const PassivityBudget& budget) {
    std::string text;
    for (const ContactStateBudget& s : budget.states) {
      if (s.holds()) continue;
      if (text.empty() || text.find(s.gain) == std::string::npos)
        text += (text.empty() ? "" : ", ") + std::string(s.gain) + " is " + number(s.given) +
                ", at most " + number(budget.limit_of(s.gain)) + " is stable";
    }
    if (!budget.damping_holds())
      text += (text.empty() ? "" : ", ") + std::string("damping is ") +
              number(budget.virtual_damping_ns_per_m) + ", at most " +
              number(budget.damping_limit_ns_per_m) + " is stable";
    return text;
  }

  static std::string margin(const PassivityBudget& budget) {
    std::string text;
    for (const ContactStateBudget& s : budget.states) {
      if (text.find(s.gain) != std::string::npos) continue;
      text += (text.empty() ? "" : ", ") + std::string(s.gain) + " " + number(s.given) + " of " +
              number(budget.limit_of(s.gain));
    }
    return text;
  }

  const FitQuestion& q_;
  const hal::DeviceCapabilities& device_;
  bool proxy_;
  FitAnswer answer_;
};

std::string limits_text(const SafetyLimits& l) {
  const auto text = [](Real value) { return number(static_cast<double>(value)); };
  return "sent to this device: at most " + text(l.max_force_n) + " N, " + text(l.max_torque_nm) +
         " N m, " + text(l.slew_n_per_s) + " N/s, " + text(l.slew_nm_per_s) + " N m/s";
}

std::string in_us(std::int64_t ns) { return formatted("%.0f", 1e-3 * static_cast<double>(ns)); }

}  // namespace

FitQuestion fit_question(const SceneView& scene, double scale, std::int64_t loop_period_ns,
                         bool report_clocked, bool accept_unbudgeted) {
  return {scene.parameters(), served_size(scene).radius_m, scale, loop_period_ns, report_clocked,
          accept_unbudgeted};
}

FitAnswer fit_of(const FitQuestion& question, const hal::DeviceCapabilities& device) {
  return device.driven_dof == 0 ? FitAnswer{} : Fit(question, device).answer();
}

MachineFit machine_fit(const hal::WakeupMeasurement& wakeups, std::int64_t period_ns,
                       bool all_granted) {
  MachineFit machine;
  const hal::WakeupHistogram& late = wakeups.lateness;
  const std::int64_t limit_ns = period_ns / 4;
  const bool in_time = wakeups.error == 0 && late.count() > 0 && late.largest_ns() <= limit_ns;
  machine.fit = all_granted && in_time;
  if (!machine.fit) {
    machine.share = kDegradedShare;
    if (late.largest_ns() > 0) {
      const double periods =
          static_cast<double>(late.largest_ns()) / static_cast<double>(period_ns);
      machine.share = std::min(machine.share, 1 / periods);
    }
  }
  if (late.count() == 0) {
    machine.found = "wake-ups could not be measured";
  } else {
    machine.found = formatted("%llu wake-ups: ", static_cast<unsigned long long>(late.count())) +
                    "p99.9 " + in_us(late.quantile_ns(0.999)) + ", largest " +
                    in_us(late.largest_ns()) + " us late; at most " + in_us(limit_ns) +
                    " us is in time";
  }
  return machine;
}

SafetyLimits lowered(const SafetyLimits& limits, double share) noexcept {
  SafetyLimits l = limits;
  const auto s = static_cast<Real>(std::clamp(share, 0.0, 1.0));
  l.max_force_n *= s;
  l.max_torque_nm *= s;
  l.max_axis_force_n *= s;
  l.max_axis_torque_nm *= s;
  return l;
}

std::string DeviceGate::admit(const hal::DeviceCapabilities& device) {
  FitAnswer answer = fit_of(question_, device);
  if (device.driven_dof != 0 && answer.refusal.empty())
    answer.notes.push_back(limits_text(hal::limits_of_connection(limits_, device, share_)));
  const std::lock_guard lock(mutex_);
  refusal_ = answer.refusal;
  if (answer.notes != told_) untold_ = told_ = std::move(answer.notes);
  return answer.refusal;
}

std::string DeviceGate::refusal() const {
  const std::lock_guard lock(mutex_);
  return refusal_;
}

std::vector<std::string> DeviceGate::take_notes() {
  const std::lock_guard lock(mutex_);
  return std::exchange(untold_, {});
}

}  // namespace haptic::tools
