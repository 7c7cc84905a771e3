// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/processes/served_device.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <span>
#include <system_error>
#include <utility>

#include "hal/clock/linux_process.hpp"
#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_codec.hpp"
#include "hal/socket_message.hpp"
#include "host_sim/device/pressing_script.hpp"
#include "host_sim/lab/faults/fault_script.hpp"

namespace haptic::sim {
namespace {

constexpr double kHandSpeed_m_per_s = 0.2;
constexpr int kDevicePriority = 81;  // it stands for hardware: above all that is tested
constexpr std::size_t kRequestBytes = 8;

[[noreturn]] void refuse(const std::string& what) {
  throw std::system_error(errno, std::generic_category(), what);
}

}  // namespace

ServedDevice::ServedDevice(std::string path, const ReferenceModelSettings& settings)
    : path_(std::move(path)) {
  sockaddr_un address{};
  if (path_.size() >= sizeof address.sun_path) {
    errno = ENAMETOOLONG;
    refuse(path_);
  }
  address.sun_family = AF_UNIX;
  path_.copy(address.sun_path, path_.size());
  unlink(path_.c_str());
  listener_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (listener_ < 0) refuse(path_);
  if (bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(listener_, 4) != 0)
    refuse(path_);
  height_m_ = wanted_m_ = 0.005;
  model_ = std::make_unique<ReferenceModel>(settings, [this](double) { return hand(); });
  model_->power_up();
  thread_ = std::thread([this] { serve(); });
}

ServedDevice::~ServedDevice() {
  stop_.store(true);
  thread_.join();
  drop_host();
  close(listener_);
  unlink(path_.c_str());
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

void ServedDevice::replace(const ReferenceModelSettings& settings) {
  const std::lock_guard lock(mutex_);
  drop_host();
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

unsigned ServedDevice::hosts() const {
  const std::lock_guard lock(mutex_);
  return hosts_;
}

unsigned ServedDevice::refused() const {
  const std::lock_guard lock(mutex_);
  return refused_;
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
      int host = -1;
      {
        const std::lock_guard lock(mutex_);
        host = host_;
      }
      pollfd watched[] = {{listener_, POLLIN, 0}, {host, POLLIN, 0}};
      if (ppoll(watched, 2, &left, nullptr) <= 0) continue;
      const std::lock_guard lock(mutex_);
      if (watched[0].revents != 0) take_host();
      if (watched[1].revents != 0) read_host();
    }
    const std::lock_guard lock(mutex_);
    pass_period(due_ns);
  }
}

// One host at a time, as a claimed interface has.
void ServedDevice::take_host() {
  const int came = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (came < 0) return;
  if (host_ >= 0) {
    ++refused_;
    close(came);
    return;
  }
  // As on a bus, where a few transfers are queued: who does not read misses reports.
  const int room = 4096;
  (void)setsockopt(came, SOL_SOCKET, SO_SNDBUF, &room, sizeof room);
  host_ = came;
  ++hosts_;
}

void ServedDevice::drop_host() {
  if (host_ >= 0) close(host_);
  host_ = -1;
  handed_n_ = 0;
}

void ServedDevice::read_host() {
  std::array<std::uint8_t, hal::kMostSocketBytes> message;
  while (host_ >= 0) {
    const ssize_t size = recv(host_, message.data(), message.size(), 0);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (size <= 0) return drop_host();
    const std::span<const std::uint8_t> bytes(message.data() + 1,
                                              static_cast<std::size_t>(size) - 1);
    if (message[0] == static_cast<std::uint8_t>(hal::SocketMessage::kControl)) answer(bytes);
    if (message[0] != static_cast<std::uint8_t>(hal::SocketMessage::kOut)) continue;
    hal::ReferenceCommand command;
    if (!model_->command(bytes) || hal::decode(bytes, command) != hal::CodecVerdict::kOk) continue;
    WireCommand wire;
    wire.stamp_ns = hal::monotonic_ns();
    for (int k = 0; k < 3; ++k) {
      const auto at = static_cast<std::size_t>(k);
      wire.wrench.force_w[k] = command.force[at] * hal::kReferenceForceUnit_n;
      wire.wrench.torque_w[k] = command.torque[at] * hal::kReferenceTorqueUnit_nm;
    }
    wire.drives_on = command.drives_on;
    wire.host = hosts_;
    handed_n_ = wire.drives_on ? wire.wrench.force_w.norm() : 0;
    record_.commands.push_back(wire);
  }
}

void ServedDevice::answer(std::span<const std::uint8_t> request) {
  std::array<std::uint8_t, 2 + hal::kReferenceBlockBytes> message{};
  message[0] = static_cast<std::uint8_t>(hal::SocketMessage::kAnswer);
  std::size_t size = 2;
  if (request.size() >= kRequestBytes && request[0] == hal::kReferenceBlockRequestType &&
      request[1] == hal::kReferenceBlockRequest) {
    message[1] = 1;
    hal::encode(model_->block(), std::span(message).subspan<2, hal::kReferenceBlockBytes>());
    size += hal::kReferenceBlockBytes;
  }
  (void)send(host_, message.data(), size, MSG_NOSIGNAL | MSG_DONTWAIT);
}

void ServedDevice::pass_period(std::int64_t due_ns) {
  model_->advance();
  const std::int64_t now = hal::monotonic_ns();
  record_.periods.push_back(
      {now, now - due_ns, model_->acting().force_w.norm(), model_->drives_on(), model_->cuts()});
  if (host_ < 0) return;
  const std::vector<std::uint8_t> report = model_->report();
  std::array<std::uint8_t, 1 + hal::kReferenceReportBytes> message{};
  message[0] = static_cast<std::uint8_t>(hal::SocketMessage::kIn);
  std::copy_n(report.begin(), std::min(report.size(), message.size() - 1), message.begin() + 1);
  const ssize_t sent = send(host_, message.data(), message.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  // A host that does not read for long is one whose queue is full: reports are lost, as on a bus.
  if (sent < 0 && errno != EAGAIN) drop_host();
}

}  // namespace haptic::sim
