// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/forcedimension/forcedimension_device.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <string>
#include <thread>

#include "hal/clock/servo_clock.hpp"
#include "tools/bridges/forcedimension/dhd_calls.hpp"
#include "tools/bridges/forcedimension/dhd_handle.hpp"
#include "tools/bridges/forcedimension/dhd_models.hpp"
#include "tools/bridges/vendor/tapped_handle.hpp"
#include "tools/bridges/vendor/vendor_device.hpp"
#include "tools/bridges/vendor/vendor_library.hpp"

namespace haptic::tools {
namespace {

constexpr std::array<std::string_view, 4> kDhdNames = {"libdhd.so.3", "libdhd.so", "libdrd.so.3",
                                                       "libdrd.so"};
constexpr double kStandardRate_hz = 1000;
constexpr int kNotGiven = -1;

struct DhdOptions {
  std::string library;
  int serial = kNotGiven, index = kNotGiven;
  double rate_hz = kStandardRate_hz;
  double gripper_closed_rad = 0;
  bool device_velocity = false, no_gravity_compensation = false;
};

/// Shared by the bridge's thread and the device's; the last of them to end takes it away.
struct DhdSession {
  DhdSession(const DhdCalls& c, char i, const DhdSettings& s, const VendorLimits& limits,
             const std::shared_ptr<hal::DeviceTap>& tap)
      : calls(c),
        id(i),
        device(c, i, s, tap),
        handle(device, tap),
        exchange(std::make_shared<VendorExchange>(limits)) {}

  const DhdCalls calls;
  const char id;
  DhdHandle device;
  TappedHandle handle;
  const std::shared_ptr<VendorExchange> exchange;
  std::atomic<bool> has_ended{false};
};

/// The device's thread: at the device's pace, the newest both ways. It ends without force.
void run_session(const std::shared_ptr<DhdSession>& session, std::int64_t period_ns) {
  VendorExchange& exchange = *session->exchange;
  std::int64_t due_ns = hal::monotonic_ns();
  while (!exchange.is_stopping() && exchange.turn(session->handle)) {
    // A call that took longer than a period is not caught up.
    due_ns = std::max(due_ns + period_ns, hal::monotonic_ns());
    (void)hal::sleep_until(due_ns);
  }
  (void)session->handle.exert(false, Wrench{});
  (void)session->calls.stop(session->id);
  (void)session->calls.close(session->id);
  session->has_ended.store(true);
}

class ForceDimensionDevice final : public VendorDevice {
 public:
  explicit ForceDimensionDevice(DhdOptions options) : options_(std::move(options)) {}
  ~ForceDimensionDevice() override { close(); }

  [[nodiscard]] bool open(std::string& why) override;
  void close() noexcept override;

 private:
  [[nodiscard]] bool load(std::string& why);
  [[nodiscard]] bool open_device(std::string& why);
  [[nodiscard]] bool set_watchdog(std::string& why) const;
  [[nodiscard]] bool set_up(std::string& why);
  void state_facts(const DhdModel* model, const DhdSettings& settings);
  void start(const DhdSettings& settings);
  [[nodiscard]] std::string reason() const;
  [[nodiscard]] std::int64_t period_ns() const {
    return static_cast<std::int64_t>(std::llround(1.0e9 / options_.rate_hz));
  }

  const DhdOptions options_;
  VendorLibrary library_;
  DhdCalls calls_;
  bool is_loaded_ = false;
  char id_ = -1;
  std::shared_ptr<DhdSession> session_;
};

std::string ForceDimensionDevice::reason() const {
  const char* const text = calls_.error_get_last_str();
  return text != nullptr ? text : "the library gives no reason";
}

bool ForceDimensionDevice::load(std::string& why) {
  if (is_loaded_) return true;
  is_loaded_ = library_.load(options_.library, kDhdNames, why) && bind_dhd(library_, calls_, why);
  return is_loaded_;
}

bool ForceDimensionDevice::open_device(std::string& why) {
  int id = -1;
  std::string which = "device";
  if (options_.serial != kNotGiven) {
    which = "device of serial number " + std::to_string(options_.serial);
    id = calls_.open_serial(options_.serial);
  } else if (options_.index != kNotGiven) {
    which = "device of index " + std::to_string(options_.index);
    id = calls_.open_id(static_cast<char>(options_.index));
  } else {
    id = calls_.open();
  }
  if (id < 0) {
    why = "no Force Dimension " + which + " (" + reason() + "; " + library_.file() + ", SDK " +
          dhd_version(calls_) + ", sees " + std::to_string(calls_.get_device_count()) +
          "): check its supply and cable, the udev rule for vendor 1451, and that no other program "
          "has it";
    return false;
  }
  id_ = static_cast<char>(id);
  return true;
}

bool ForceDimensionDevice::set_watchdog(std::string& why) const {
  constexpr auto kUnits = static_cast<unsigned char>(kDhdWatchdog_ns / kDhdWatchdogUnit_ns);
  (void)calls_.enable_expert_mode();
  unsigned char kept = 0;
  const bool is_set = calls_.set_watchdog(kUnits, id_) >= 0;
  const bool is_read = is_set && calls_.get_watchdog(&kept, id_) >= 0;
  (void)calls_.disable_expert_mode();
  if (is_read && kept == kUnits) return true;
  why = "the device does not keep a watchdog of 20 ms (160 units of 125 us were set, " +
        (is_read ? std::to_string(kept) + " are read back" : "and the call fails: " + reason()) +
        "): its force would outlive a program that stalls, so it is not used; update its firmware "
        "and SDK, and use driver = \"falcon\" for a Novint Falcon";
  return false;
}

void ForceDimensionDevice::state_facts(const DhdModel* model, const DhdSettings& settings) {
  const DhdModel& m = model != nullptr ? *model : unknown_dhd_model();
  hal::DeviceCapabilities c;
  c.sensed_dof = settings.has_wrist ? hal::kDofAll : hal::kDofTranslation;
  c.driven_dof = settings.has_active_wrist ? hal::kDofAll : hal::kDofTranslation;
  c.max_force_n = m.max_force_n;
  c.max_torque_nm = settings.has_active_wrist ? m.max_torque_nm : 0.0_r;
  // The library's own limits, where it has some: below 0 there is none.
  const auto tighten = [this](Real& limit, double (*call)(char)) {
    const double own = call != nullptr ? call(id_) : -1.0;
    if (own > 0) limit = std::min(limit, static_cast<Real>(own));
  };
  tighten(c.max_force_n, calls_.get_max_force);
  tighten(c.max_torque_nm, calls_.get_max_torque);
  c.max_stiffness_n_per_m = m.max_stiffness_n_per_m;
  c.max_damping_ns_per_m = m.max_damping_ns_per_m;
  c.workspace_radius_m = m.workspace_radius_m;
  c.report_period_ns = period_ns();
  c.watchdog_ns = kDhdWatchdog_ns;
  // An order waits for the next turn of the library's thread.
  c.latency_ns = period_ns();

  const char* const name = calls_.get_system_name(id_);
  unsigned short serial = 0;
  facts_.name = name != nullptr && *name != '\0' ? name : std::string(m.name);
  c.name = hal::device_text(facts_.name);
  if (calls_.get_serial_number(&serial, id_) >= 0) {
    c.serial = hal::device_text(std::to_string(serial));
    facts_.name += ", serial " + std::to_string(serial);
  }
  facts_.capabilities = c;
  facts_.name += ", SDK " + dhd_version(calls_);
  facts_.words = "its watchdog is set to 20 ms";
  if (model == nullptr)
    facts_.words += "; no source describes its type, so it gets the smallest limits";
  if (!settings.has_wrist)
    facts_.words += "; it senses no orientation";
  else if (!settings.has_active_wrist)
    facts_.words += "; it gives no torque";
  if (!options_.no_gravity_compensation)
    facts_.words += "; its library adds the force that carries the handle's weight";
}

bool ForceDimensionDevice::set_up(std::string& why) {
  if (!calls_.has_base(id_)) {
    why = "the device has no base that moves (type " + std::to_string(calls_.get_system_type(id_)) +
          "): name another by serial or index";
    return false;
  }
  if (!set_watchdog(why)) return false;
  if (calls_.set_gravity_compensation(options_.no_gravity_compensation ? 0 : 1, id_) < 0) {
    why = "its gravity compensation cannot be set: " + reason();
    return false;
  }
  DhdSettings settings;
  settings.has_wrist = calls_.has_wrist(id_);
  settings.has_active_wrist = settings.has_wrist && calls_.has_active_wrist(id_);
  settings.device_velocity = options_.device_velocity;
  if (options_.gripper_closed_rad > 0) {
    if (!calls_.has_gripper(id_)) {
      why = "gripper_closed is given, and the device has no gripper; remove the key";
      return false;
    }
    settings.gripper_closed_rad = static_cast<Real>(options_.gripper_closed_rad);
  }
  state_facts(find_dhd_model(calls_.get_system_type(id_)), settings);
  start(settings);
  hal::BridgeSample first;
  if (!wait_for_sample(first)) {
    why = facts_.name + " says no pose; switch it off and on";
    return false;
  }
  facts_.needs = first.calibrated ? ""
                                  : "it is not calibrated: put its handle into the calibration pit "
                                    "until the light is steady";
  if (!first.calibrated) facts_.words += "; " + facts_.needs;
  return true;
}

void ForceDimensionDevice::start(const DhdSettings& settings) {
  const VendorLimits limits = {period_ns(), facts_.capabilities.max_force_n,
                               facts_.capabilities.max_torque_nm, 0};
  note_settings(tap(), numbers_of(settings));
  session_ = std::make_shared<DhdSession>(calls_, id_, settings, limits, tap());
  exchange_ = session_->exchange;
  std::thread([session = session_, period = period_ns()] {
    run_session(session, period);
  }).detach();
}

bool ForceDimensionDevice::open(std::string& why) {
  if (!is_free(why) || !load(why) || !open_device(why)) return false;
  if (set_up(why)) return true;
  close();
  return false;
}

void ForceDimensionDevice::close() noexcept {
  if (session_) {
    exchange_->stop();
    // The thread closes the device; a call that it is held up in is left to it.
    end_by([session = std::move(session_)] {
      while (!session->has_ended.load()) (void)hal::sleep_until(hal::monotonic_ns() + 1'000'000);
    });
    session_.reset();
    exchange_.reset();
  } else if (id_ >= 0) {
    (void)calls_.stop(id_);
    (void)calls_.close(id_);
  }
  id_ = -1;
}

}  // namespace

std::unique_ptr<hal::BridgedDevice> make_forcedimension(const hal::DriverOptions& options,
                                                        hal::DriverDefect& /*defect*/) {
  DhdOptions o;
  if (const auto* library = options.value<std::string>("library")) o.library = *library;
  const double* const serial = options.value<double>("serial");
  const double* const index = options.value<double>("index");
  if (serial != nullptr) o.serial = static_cast<int>(*serial);
  if (index != nullptr) o.index = static_cast<int>(*index);
  if (const double* rate = options.value<double>("rate")) o.rate_hz = *rate;
  if (const double* angle = options.value<double>("gripper_closed")) o.gripper_closed_rad = *angle;
  if (const bool* flag = options.value<bool>("device_velocity")) o.device_velocity = *flag;
  if (const bool* flag = options.value<bool>("no_gravity_compensation"))
    o.no_gravity_compensation = *flag;
  return std::make_unique<ForceDimensionDevice>(std::move(o));
}

}  // namespace haptic::tools
