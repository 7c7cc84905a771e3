// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/openhaptics/openhaptics_device.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "hal/clock/servo_clock.hpp"
#include "tools/bridges/openhaptics/hd_calls.hpp"
#include "tools/bridges/openhaptics/hd_handle.hpp"
#include "tools/bridges/openhaptics/hd_hints.hpp"
#include "tools/bridges/vendor/tapped_handle.hpp"
#include "tools/bridges/vendor/vendor_device.hpp"
#include "tools/bridges/vendor/vendor_library.hpp"

namespace haptic::tools {
namespace {

constexpr std::array<std::string_view, 3> kHdNames = {"libHD.so.3.4", "libHD.so.3", "libHD.so"};
constexpr double kStandardRate_hz = 1000;
// A device that states more uses another unit, or the library is another one.
constexpr double kLargestForce_n = 100, kLargestTorque_mnm = 10'000;
constexpr std::int64_t kMs_ns = 1'000'000;
constexpr int kLongestStop_ms = 100;
// libHD keeps its last force while its scheduler stalls.
constexpr std::int64_t kLongestRelease_ns = 100 * kMs_ns;

struct HdOptions {
  std::string library, device;
  double rate_hz = kStandardRate_hz;
  bool device_velocity = false;
};

/// Shared by the bridge's thread and the scheduler's.
struct HdSession {
  HdSession(const HdCalls& c, unsigned d, const HdSettings& s, const VendorLimits& limits,
            const std::shared_ptr<hal::DeviceTap>& tap)
      : calls(c),
        device(d),
        frames(c, d, s, tap),
        handle(frames, tap),
        exchange(std::make_shared<VendorExchange>(limits)) {}

  const HdCalls calls;
  const unsigned device;
  HdHandle frames;
  TappedHandle handle;
  const std::shared_ptr<VendorExchange> exchange;
  unsigned long scheduled = kHdNoHandle;
  bool is_started = false;
};

/// libHD's thread.
unsigned pass_frame(void* session) noexcept {
  HdSession& s = *static_cast<HdSession*>(session);
  return s.exchange->turn(s.handle) ? kHdCallbackContinue : kHdCallbackDone;
}

/// Ends a session without force. Any of the calls may block: where the scheduler has stalled, the
/// force output goes off before its end is waited for.
void end_session(HdSession& s) {
  const bool is_stalled = s.is_started && s.exchange->is_held(hal::monotonic_ns());
  for (int k = 0; s.is_started && !is_stalled && k < kLongestStop_ms && !s.exchange->has_stopped();
       ++k)
    (void)hal::sleep_until(hal::monotonic_ns() + kMs_ns);
  if (s.is_started && !s.exchange->has_stopped()) {
    s.calls.make_current(s.device);
    s.calls.disable(kHdForceOutput);
  }
  if (s.is_started) s.calls.stop_scheduler();
  if (s.scheduled != kHdNoHandle) s.calls.unschedule(s.scheduled);
  s.calls.make_current(s.device);
  s.calls.disable(kHdForceOutput);
  s.calls.disable_device(s.device);
}

class OpenHapticsDevice final : public VendorDevice {
 public:
  explicit OpenHapticsDevice(HdOptions options) : options_(std::move(options)) {}
  ~OpenHapticsDevice() override { close(); }

  [[nodiscard]] bool open(std::string& why) override;
  void close() noexcept override;

 private:
  [[nodiscard]] bool load(std::string& why);
  [[nodiscard]] bool init_device(std::string& why);
  [[nodiscard]] bool state_facts(std::string& why);
  [[nodiscard]] bool enable(std::string& why);
  [[nodiscard]] bool start(std::string& why);
  [[nodiscard]] bool has_failed(const std::string& what, std::string& why) const;
  [[nodiscard]] double number(unsigned parameter) const;
  [[nodiscard]] std::string text(unsigned parameter) const;
  [[nodiscard]] Real workspace_radius_m() const;
  [[nodiscard]] std::int64_t period_ns() const {
    return static_cast<std::int64_t>(std::llround(1.0e9 / options_.rate_hz));
  }

  const HdOptions options_;
  VendorLibrary library_;
  HdCalls calls_;
  HdSettings settings_;
  bool is_loaded_ = false;
  unsigned device_ = kHdNoHandle;
  std::shared_ptr<HdSession> session_;
};

/// True where the library has an error to say: `why` has it.
bool OpenHapticsDevice::has_failed(const std::string& what, std::string& why) const {
  const HdErrorInfo error = take_hd_errors(calls_);
  if (error.code == kHdSuccess) return false;
  why = what + ": " + hd_error_text(calls_, error) + "; " + hd_open_hint(error, options_.device);
  return true;
}

/// 0 where the device does not say it.
double OpenHapticsDevice::number(unsigned parameter) const {
  double value = 0;
  calls_.get_double(parameter, &value);
  const bool is_said = take_hd_errors(calls_).code == kHdSuccess && std::isfinite(value);
  return is_said && value > 0 ? value : 0;
}

std::string OpenHapticsDevice::text(unsigned parameter) const {
  const char* const words = calls_.get_string(parameter);
  return take_hd_errors(calls_).code == kHdSuccess && words != nullptr ? words : "";
}

bool OpenHapticsDevice::load(std::string& why) {
  if (is_loaded_) return true;
  is_loaded_ = library_.load(options_.library, kHdNames, why) && bind_hd(library_, calls_, why);
  return is_loaded_;
}

bool OpenHapticsDevice::init_device(std::string& why) {
  (void)take_hd_errors(calls_);
  // Null is the vendor's own name for the default; a name is looked for as it stands.
  const unsigned device =
      calls_.init_device(options_.device.empty() ? nullptr : options_.device.c_str());
  const std::string what =
      options_.device.empty() ? "no default device" : "no device '" + options_.device + "'";
  if (has_failed(what, why)) {
    if (device != kHdNoHandle) calls_.disable_device(device);
    return false;
  }
  if (device == kHdNoHandle) {
    why = what + ", and the library gives no reason; " + hd_open_hint({}, options_.device);
    return false;
  }
  device_ = device;
  const std::string version = text(kHdVersion);
  if (is_hd_version(version)) return true;
  why = library_.file() + " says that it is version " + version +
        "; this bridge knows the calls of version 3: install OpenHaptics 3.x";
  return false;
}

/// From the origin to the nearest side of the usable box; 0 where the origin is not inside.
Real OpenHapticsDevice::workspace_radius_m() const {
  double box[6] = {};
  calls_.get_double(kHdUsableWorkspace, box);
  if (take_hd_errors(calls_).code != kHdSuccess) return 0;
  double radius_mm = HUGE_VAL;
  for (int k = 0; k < 3; ++k) radius_mm = std::min({radius_mm, -box[k], box[k + 3]});
  return std::isfinite(radius_mm) && radius_mm > 0 ? static_cast<Real>(radius_mm * 1.0e-3) : 0.0_r;
}

bool OpenHapticsDevice::state_facts(std::string& why) {
  int inputs = 0, outputs = 0;
  calls_.get_integer(kHdInputDof, &inputs);
  calls_.get_integer(kHdOutputDof, &outputs);
  calls_.get_integer(kHdCalibrationStyle, &settings_.calibration_style);
  if (has_failed("the device does not say what it is", why)) return false;
  const double force_n = number(kHdMaxForce), torque_mnm = number(kHdMaxTorque);
  settings_.has_wrist = inputs >= 6;
  settings_.has_torque = settings_.has_wrist && outputs >= 6 && torque_mnm > 0;
  settings_.device_velocity = options_.device_velocity;
  if (inputs < 3 || outputs < 3 || force_n <= 0 || force_n > kLargestForce_n ||
      torque_mnm > kLargestTorque_mnm) {
    why = "the device states " + std::to_string(inputs) + " sensed and " + std::to_string(outputs) +
          " driven degrees of freedom, " + std::to_string(force_n) + " N and " +
          std::to_string(torque_mnm) +
          " mN m at most, which is no haptic device; check the version of the library";
    return false;
  }
  hal::DeviceCapabilities c;
  c.sensed_dof = settings_.has_wrist ? hal::kDofAll : hal::kDofTranslation;
  c.driven_dof = settings_.has_torque ? hal::kDofAll : hal::kDofTranslation;
  c.max_force_n = static_cast<Real>(force_n);
  c.max_torque_nm = settings_.has_torque ? static_cast<Real>(torque_mnm * 1.0e-3) : 0.0_r;
  c.max_stiffness_n_per_m = static_cast<Real>(number(kHdMaxStiffness) * 1.0e3);
  c.max_damping_ns_per_m = static_cast<Real>(number(kHdMaxDamping) * 1.0e3);
  c.workspace_radius_m = workspace_radius_m();
  c.report_period_ns = period_ns();
  // An order waits for the next turn of the library's thread.
  c.latency_ns = period_ns();
  const std::string model = text(kHdModel), serial = text(kHdSerial), version = text(kHdVersion);
  c.name = hal::device_text(model);
  c.serial = hal::device_text(serial);
  facts_.capabilities = c;

  facts_.name = model.empty() ? "device of OpenHaptics" : model;
  if (!serial.empty()) facts_.name += ", serial " + serial;
  facts_.name += ", HDAPI " + (version.empty() ? "of a version that it does not say" : version);
  facts_.words = "it states no watchdog: the bridge takes the force away";
  if (!settings_.has_torque) facts_.words += "; it gives no torque";
  if (const double lasting_n = number(kHdMaxContinuousForce); lasting_n > 0) {
    char figure[32];
    (void)std::snprintf(figure, sizeof figure, "%.2f", lasting_n);
    facts_.words += std::string("; more than ") + figure + " N for long warms its motors";
  }
  return true;
}

/// Force ramps up after the start and after an error, and is clamped to what the device can do.
bool OpenHapticsDevice::enable(std::string& why) {
  for (const unsigned capability : {kHdForceRamping, kHdMaxForceClamping, kHdForceOutput})
    calls_.enable(capability);
  if (has_failed("the force output cannot be switched on", why)) return false;
  const bool is_on = calls_.is_enabled(kHdForceOutput) != 0;
  const bool is_safe =
      calls_.is_enabled(kHdForceRamping) != 0 && calls_.is_enabled(kHdMaxForceClamping) != 0;
  if (has_failed("the force output cannot be asked for", why)) return false;
  if (!is_on || !is_safe)
    why = std::string(is_on ? "force ramping and clamping stay" : "the force output stays") +
          " off although they were switched on; check the version of OpenHaptics";
  return is_on && is_safe;
}

bool OpenHapticsDevice::start(std::string& why) {
  const VendorLimits limits = {period_ns(), facts_.capabilities.max_force_n,
                               facts_.capabilities.max_torque_nm, kLongestRelease_ns};
  note_settings(tap(), numbers_of(settings_));
  session_ = std::make_shared<HdSession>(calls_, device_, settings_, limits, tap());
  exchange_ = session_->exchange;
  calls_.set_scheduler_rate(static_cast<unsigned long>(std::llround(options_.rate_hz)));
  if (has_failed("the scheduler does not take the key rate", why)) return false;
  session_->scheduled = calls_.schedule(pass_frame, session_.get(), kHdHighestPriority);
  if (has_failed("the scheduler takes no callback", why)) return false;
  calls_.start_scheduler();
  session_->is_started = true;
  if (has_failed("the scheduler does not start", why)) return false;
  hal::BridgeSample first;
  if (!wait_for_sample(first)) {
    why = facts_.name + " says no pose; " + hd_open_hint({}, options_.device);
    return false;
  }
  facts_.needs = first.calibrated
                     ? ""
                     : "it is not calibrated: " + hd_calibration_hint(settings_.calibration_style);
  if (!first.calibrated) facts_.words += "; " + facts_.needs;
  return true;
}

bool OpenHapticsDevice::open(std::string& why) {
  if (!is_free(why) || !load(why)) return false;
  if (init_device(why) && state_facts(why) && enable(why) && start(why)) return true;
  close();
  return false;
}

void OpenHapticsDevice::close() noexcept {
  if (exchange_) exchange_->stop();
  if (session_) {
    end_by([session = std::move(session_)] { end_session(*session); });
  } else if (device_ != kHdNoHandle) {
    calls_.disable_device(device_);
  }
  session_.reset();
  exchange_.reset();
  device_ = kHdNoHandle;
}

}  // namespace

std::unique_ptr<hal::BridgedDevice> make_openhaptics(const hal::DriverOptions& options,
                                                     hal::DriverDefect& defect) {
  HdOptions o;
  if (const auto* library = options.value<std::string>("library")) o.library = *library;
  if (const auto* device = options.value<std::string>("device")) o.device = *device;
  if (const double* rate = options.value<double>("rate")) o.rate_hz = *rate;
  if (const bool* flag = options.value<bool>("device_velocity")) o.device_velocity = *flag;
  if (o.device.find('\0') != std::string::npos || o.device.find('/') != std::string::npos) {
    defect = {"device", "is no name of a device; give the one that the vendor's Touch_Setup shows"};
    return nullptr;
  }
  return std::make_unique<OpenHapticsDevice>(std::move(o));
}

}  // namespace haptic::tools
