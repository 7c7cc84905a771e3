// SPDX-License-Identifier: Apache-2.0
#include "hal/bridge/bridge_service.hpp"

#include <poll.h>

#include <algorithm>
#include <array>
#include <ctime>

#include "hal/bridge/bridge_units.hpp"
#include "hal/clock/servo_clock.hpp"
#include "hal/local/device_port.hpp"

namespace haptic::hal {
namespace {

constexpr std::int64_t kMs_ns = 1'000'000;
// Samples in a row that are no pose, after which the device is lost.
constexpr unsigned kMostBadSamples = 20;
// The force that is taken away at the end is handed over within this time, or not at all.
constexpr std::int64_t kLongestRelease_ns = 500 * kMs_ns;

constexpr std::size_t kBitsByte = 3;  // of a command; bit 0: the drives are asked for

constexpr std::uint64_t in_us(std::int64_t ns) noexcept {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(ns / 1000, 0));
}

/// An open device, while hosts come and go.
class OpenBridge final : PortDevice {
 public:
  OpenBridge(BridgedDevice& device, std::int64_t watchdog_ns)
      : device_(device),
        facts_(facts_of(device.facts().capabilities, watchdog_ns)),
        period_ns_(std::int64_t{facts_.report_period_us} * 1000),
        port_(2 * period_ns_) {
    haptic_device_begin(&firmware_, &facts_);
    sample_.orientation[3] = 1 << 30;
    reported_ns_ = monotonic_ns();
  }

  [[nodiscard]] int listen(const std::string& path) { return port_.listen(path); }
  [[nodiscard]] bool pass_period(const std::atomic<bool>& stop);
  /// The host is sent away. @param lost  the device is: nothing is waited for.
  /// @return false: it could not be told that its force is off.
  [[nodiscard]] bool finish(bool lost);
  /// True: the device was lost because its samples were no poses.
  [[nodiscard]] bool says_nothing() const { return bad_samples_ >= kMostBadSamples; }

 private:
  void sleep_until_woken(std::int64_t until_ns);
  [[nodiscard]] bool look();
  [[nodiscard]] bool take(const BridgeSample& sample, std::int64_t now_ns);
  void report();
  bool drive();

  // The device behind the port.
  void begin() override { haptic_device_bus_event(&firmware_); }
  std::ptrdiff_t control(const ControlRequest& request, std::span<const std::uint8_t> data,
                         std::span<std::uint8_t> room) override;
  void command(std::span<const std::uint8_t> bytes) override;
  void end() override;

  BridgedDevice& device_;
  const haptic_facts facts_;
  const std::int64_t period_ns_;
  DevicePort port_;
  haptic_device firmware_{};
  haptic_sample sample_{};
  std::int64_t sampled_ns_ = 0, reported_ns_ = 0;
  bool is_new_ = false;    ///< the sample was not reported yet
  bool is_silent_ = true;  ///< there is no sample that stands
  bool is_released_ = true;
  bool took_ = true;  ///< the device has what the firmware gives it
  unsigned missed_periods_ = 0, bad_samples_ = 0;
};

/// Sleeps for a period, or until the device has something new, hears host and device meanwhile, and
/// reports. False: the device is lost.
bool OpenBridge::pass_period(const std::atomic<bool>& stop) {
  const std::int64_t due_ns = std::max(reported_ns_ + period_ns_, monotonic_ns());
  // A device that is faster than it states is not reported faster than this.
  const std::int64_t soonest_ns = reported_ns_ + period_ns_ * 3 / 4;
  for (std::int64_t now_ns = monotonic_ns(); now_ns < due_ns && !stop.load();
       now_ns = monotonic_ns()) {
    if (is_new_ && now_ns >= soonest_ns) break;
    sleep_until_woken(is_new_ ? soonest_ns : due_ns);
    port_.serve(*this);
    if (!look()) return false;
  }
  if (!is_new_ && !look()) return false;
  report();
  return true;
}

bool OpenBridge::finish(bool lost) {
  port_.drop(*this);
  (void)drive();
  const std::int64_t until_ns = monotonic_ns() + (lost ? 0 : kLongestRelease_ns);
  while (!is_released_ && monotonic_ns() < until_ns) {
    (void)sleep_until(monotonic_ns() + kMs_ns);
    (void)drive();
  }
  return is_released_;
}

void OpenBridge::sleep_until_woken(std::int64_t until_ns) {
  const std::array<pollfd, 3> port = port_.watched();
  std::array<pollfd, 4> watched{port[0], port[1], port[2], device_.watched()};
  // A device that has said something already would wake us at once, again and again.
  if (is_new_) watched[3].fd = -1;
  const std::int64_t left_ns = std::max<std::int64_t>(until_ns - monotonic_ns(), 0);
  const timespec left{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  (void)ppoll(watched.data(), watched.size(), &left, nullptr);
}

/// Takes in what the device says. False: it is lost.
bool OpenBridge::look() {
  const std::int64_t now_ns = monotonic_ns();
  BridgeSample sample;
  switch (device_.read(now_ns, sample)) {
    case BridgeRead::kNew:
      return take(sample, now_ns);
    case BridgeRead::kSame:
      if (!is_new_ && device_.facts().rests_in_silence) sampled_ns_ = now_ns;
      return true;
    case BridgeRead::kSilent:
      is_silent_ = !is_new_;  // a sample that has come in this period is reported
      return true;
    case BridgeRead::kLost:
      break;
  }
  return false;
}

/// False: too many in a row were no poses.
bool OpenBridge::take(const BridgeSample& sample, std::int64_t now_ns) {
  haptic_sample made{};
  if (!sample_of(sample, made)) {
    is_silent_ = true;
    return ++bad_samples_ < kMostBadSamples;
  }
  if (is_new_) {  // a cause that was there in one sample only is reported all the same
    made.faults |= sample_.faults;
    made.stop_is_pressed |= sample_.stop_is_pressed;
    made.is_fatal |= sample_.is_fatal;
    made.is_calibrated &= sample_.is_calibrated;
  }
  sample_ = made;
  bad_samples_ = 0;
  is_new_ = true;
  is_silent_ = false;
  sampled_ns_ = std::clamp(sample.sampled_ns, sampled_ns_, now_ns);
  return true;
}

/// The firmware's period, which looks after the watchdog; the host hears of it unless the device is
/// silent, or has a force that it should not have.
void OpenBridge::report() {
  reported_ns_ = monotonic_ns();
  haptic_sample told = sample_;
  told.time_us = in_us(is_silent_ ? reported_ns_ : sampled_ns_);
  if (missed_periods_ >= kMostMissedPeriods) {
    told.faults |= HAPTIC_FAULT_DRIVE;
    told.is_fatal = 1;
  }
  std::array<std::uint8_t, HAPTIC_REPORT_BYTES> bytes{};
  const std::size_t size = haptic_device_period(&firmware_, &told, bytes.data(), bytes.size());
  missed_periods_ = drive() ? 0 : missed_periods_ + 1;
  // A report would say that the device has what it was not handed.
  if (!is_silent_ && took_) port_.publish(std::span(bytes).first(size), sampled_ns_);
  is_new_ = false;
}

/// The device gets what the firmware would give its motors. False: it could not be handed over.
bool OpenBridge::drive() {
  const haptic_drive& drive = *haptic_device_drive(&firmware_);
  const std::int64_t now_ns = monotonic_ns();
  if (drive.is_on != 0) {
    is_released_ = false;
    took_ = device_.write(now_ns, wrench_of(drive));
  } else {
    is_released_ = is_released_ || device_.release(now_ns);
    took_ = is_released_;
  }
  return took_;
}

std::ptrdiff_t OpenBridge::control(const ControlRequest& request,
                                   std::span<const std::uint8_t> /*data*/,
                                   std::span<std::uint8_t> room) {
  return haptic_device_answer(&firmware_, request.request_type, request.request, request.value,
                              room.data(), room.size());
}

void OpenBridge::command(std::span<const std::uint8_t> bytes) {
  // A command is accepted by a device that has taken the one before it: the host counts on that.
  // One that takes the drives off is not held up by it.
  const bool is_off = bytes.size() > kBitsByte && (bytes[kBitsByte] & 1u) == 0;
  if (!took_ && !is_off && !drive()) return;
  const std::uint64_t now_us = in_us(monotonic_ns());
  if (haptic_device_command(&firmware_, bytes.data(), bytes.size(), now_us) != 0) (void)drive();
}

void OpenBridge::end() {
  haptic_device_bus_event(&firmware_);
  (void)drive();
}

/// Waits for the next try; false: `stop`.
bool wait_for(std::int64_t ns, const std::atomic<bool>& stop) {
  const std::int64_t until_ns = monotonic_ns() + ns;
  while (!stop.load() && monotonic_ns() < until_ns) (void)sleep_until(monotonic_ns() + 10 * kMs_ns);
  return !stop.load();
}

/// Says each reason once.
class Sayer {
 public:
  explicit Sayer(const BridgeSettings& settings) : settings_(settings) {}
  void say(const std::string& line) {
    if (line == last_ || line.empty() || !settings_.say) return;
    last_ = line;
    settings_.say(line);
  }

 private:
  const BridgeSettings& settings_;
  std::string last_;
};

}  // namespace

int serve_bridge(BridgedDevice& device, const BridgeSettings& settings,
                 const std::atomic<bool>& stop) {
  Sayer sayer(settings);
  bool confined = !settings.confine;
  while (!stop.load()) {
    std::string why;
    if (!device.open(why)) {
      device.close();
      sayer.say(why);
      if (!wait_for(settings.again_ns, stop)) return 0;
      continue;
    }
    {
      OpenBridge bridge(device, settings.watchdog_ns);
      if (const int error = bridge.listen(settings.path); error != 0) return error;
      sayer.say(device.facts().name + " is there");
      sayer.say(device.facts().words);
      if (!confined && device.can_be_confined() && settings.confine() != 0)
        sayer.say("the bridge keeps system calls that it could do without");
      confined = true;
      bool is_there = true;
      while (!stop.load() && is_there) is_there = bridge.pass_period(stop);
      if (!bridge.finish(!is_there))
        sayer.say(device.facts().name + " was not told that its force is off");
      if (bridge.says_nothing())
        sayer.say(device.facts().name + " sends what is no pose");
      else if (!stop.load())
        sayer.say(device.facts().name + " is lost");
    }
    device.close();
    if (!wait_for(settings.again_ns, stop)) return 0;
  }
  return 0;
}

}  // namespace haptic::hal
