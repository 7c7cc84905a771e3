// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/processes/served_device.hpp"

#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <span>
#include <system_error>

#include "hal/clock/linux_process.hpp"
#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_codec.hpp"
#include "host_sim/device/pressing_script.hpp"
#include "host_sim/lab/faults/fault_script.hpp"

namespace haptic::sim {
namespace {

constexpr double kHandSpeed_m_per_s = 0.2;
constexpr int kDevicePriority = 81;  // it stands for hardware: above all that is tested
constexpr std::int64_t kPeriod_ns = 1'000'000;

}  // namespace

ServedDevice::ServedDevice(const std::string& path, const ReferenceModelSettings& settings)
    : port_(2 * kPeriod_ns) {
  errno = port_.listen(path);
  if (errno != 0) throw std::system_error(errno, std::generic_category(), path);
  height_m_ = wanted_m_ = 0.005;
  model_ = std::make_unique<ReferenceModel>(settings, [this](double) { return hand(); });
  model_->power_up();
  thread_ = std::thread([this] { serve(); });
}

ServedDevice::~ServedDevice() {
  stop_.store(true);
  thread_.join();
}

void ServedDevice::hold(double height_m, std::uint32_t switches) {
  const std::lock_guard lock(mutex_);
  wanted_m_ = height_m;
  switches_ = switches;
}

void ServedDevice::press_emergency_stop(bool pressed) {
  const std::lock_guard lock(mutex_);
  model_->press_emergency_stop(pressed);
}

void ServedDevice::be_deaf(bool deaf) {
  const std::lock_guard lock(mutex_);
  deaf_ = deaf;
}

void ServedDevice::pass_on_after(std::int64_t late_ns) {
  const std::lock_guard lock(mutex_);
  late_ns_ = late_ns;
}

void ServedDevice::replace(const ReferenceModelSettings& settings) {
  const std::lock_guard lock(mutex_);
  port_.drop(*this);
  const DeviceState state = model_->state();
  model_ = std::make_unique<ReferenceModel>(settings, [this](double) { return hand(); });
  model_->place(state);
  model_->power_up();
}

WireRecord ServedDevice::record() const {
  const std::lock_guard lock(mutex_);
  return record_;
}

double ServedDevice::handed_n() const {
  const std::lock_guard lock(mutex_);
  return handed_n_;
}

bool ServedDevice::is_asked_for_drives() const {
  const std::lock_guard lock(mutex_);
  return !record_.commands.empty() && record_.commands.back().drives_on;
}

unsigned ServedDevice::hosts() const {
  const std::lock_guard lock(mutex_);
  return port_.hosts();
}

unsigned ServedDevice::refused() const {
  const std::lock_guard lock(mutex_);
  return port_.refused();
}

// Called by the model, with the lock held.
HandAction ServedDevice::hand() {
  const double step_m = kHandSpeed_m_per_s * (model_ != nullptr ? model_->period_s() : 0);
  height_m_ += std::clamp(wanted_m_ - height_m_, -step_m, step_m);
  HandAction action;
  action.target.x0_w = Vector(0, 0, kTouchHeight_m + height_m_);
  action.switches = switches_;
  return action;
}

void ServedDevice::serve() {
  (void)hal::set_fifo_priority(kDevicePriority);  // refused: lateness is judged with what it did
  std::int64_t due_ns = hal::monotonic_ns();
  const auto period_ns = static_cast<std::int64_t>(1e9 * model_->period_s());
  while (!stop_.load()) {
    due_ns += period_ns;
    for (std::int64_t now = hal::monotonic_ns(); now < due_ns; now = hal::monotonic_ns()) {
      const std::int64_t left_ns = due_ns - now;
      const timespec left{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
      std::array<pollfd, 3> watched;
      bool deaf = false;
      {
        const std::lock_guard lock(mutex_);
        watched = port_.watched();
        deaf = deaf_;
      }
      if (ppoll(watched.data(), deaf ? 0 : watched.size(), &left, nullptr) <= 0) continue;
      const std::lock_guard lock(mutex_);
      port_.serve(*this);
    }
    const std::lock_guard lock(mutex_);
    pass_period(due_ns);
  }
}

void ServedDevice::command(std::span<const std::uint8_t> bytes) {
  if (late_ns_ == 0) return take(bytes);
  queue_.emplace_back(hal::monotonic_ns() + late_ns_,
                      std::vector<std::uint8_t>(bytes.begin(), bytes.end()));
}

void ServedDevice::take(std::span<const std::uint8_t> bytes) {
  hal::ReferenceCommand command;
  if (!model_->command(bytes) || hal::decode(bytes, command) != hal::CodecVerdict::kOk) return;
  WireCommand wire;
  wire.stamp_ns = hal::monotonic_ns();
  for (int k = 0; k < 3; ++k) {
    const auto at = static_cast<std::size_t>(k);
    wire.wrench.force_w[k] = command.force[at] * hal::kReferenceForceUnit_n;
    wire.wrench.torque_w[k] = command.torque[at] * hal::kReferenceTorqueUnit_nm;
  }
  wire.drives_on = command.drives_on;
  wire.host = port_.hosts();
  wire.tick = command.tick;
  handed_n_ = wire.drives_on ? wire.wrench.force_w.norm() : 0;
  record_.commands.push_back(wire);
}

std::ptrdiff_t ServedDevice::control(const hal::ControlRequest& request,
                                     std::span<const std::uint8_t> /*data*/,
                                     std::span<std::uint8_t> room) {
  if (request.request_type != hal::kReferenceBlockRequestType ||
      request.request != hal::kReferenceBlockRequest || room.size() < hal::kReferenceBlockBytes)
    return -1;
  hal::encode(model_->block(), room.first<hal::kReferenceBlockBytes>());
  return hal::kReferenceBlockBytes;
}

void ServedDevice::pass_period(std::int64_t due_ns) {
  while (!queue_.empty() && queue_.front().first <= hal::monotonic_ns()) {
    take(queue_.front().second);
    queue_.pop_front();
  }
  model_->advance();
  const std::int64_t now = hal::monotonic_ns();
  record_.periods.push_back(
      {now, now - due_ns, model_->acting().force_w.norm(), model_->drives_on(), model_->cuts()});
  if (port_.has_host()) port_.publish(model_->report(), now);
}

}  // namespace haptic::sim
