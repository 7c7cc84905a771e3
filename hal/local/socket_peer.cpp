// SPDX-License-Identifier: Apache-2.0
#include "hal/local/socket_peer.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <limits>

namespace haptic::hal {
namespace {

constexpr std::int64_t kControl_ns = 500'000'000;
constexpr std::size_t kRequestBytes = 8;  // as a setup packet: type, request, value, index, room

}  // namespace

HalStatus SocketPeer::plug(std::int64_t /*now_ns*/) noexcept {
  unplug();
  sockaddr_un address{};
  if (path_.size() >= sizeof address.sun_path) return HalStatus::kDeviceNotFound;
  address.sun_family = AF_UNIX;
  path_.copy(address.sun_path, path_.size());
  socket_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_ < 0) return HalStatus::kOsRefused;
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
    return HalStatus::kOk;
  const int error = errno;
  unplug();
  if (error == EACCES || error == EPERM) return HalStatus::kDeviceDenied;
  return error == EAGAIN ? HalStatus::kDeviceBusy : HalStatus::kDeviceNotFound;
}

void SocketPeer::unplug() noexcept {
  if (socket_ >= 0) close(socket_);
  socket_ = -1;
  gone_ = false;
}

void SocketPeer::wait(std::int64_t until_ns) noexcept {
  const std::int64_t left_ns = std::max<std::int64_t>(until_ns - monotonic_ns(), 0);
  const timespec left{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  pollfd watched{socket_, POLLIN, 0};
  (void)ppoll(&watched, 1, &left, nullptr);
}

bool SocketPeer::say(SocketMessage kind, std::span<const std::uint8_t> bytes) noexcept {
  std::array<std::uint8_t, kMostSocketBytes> message{};
  if (socket_ < 0 || bytes.size() + 1 > message.size()) return false;
  message[0] = static_cast<std::uint8_t>(kind);
  std::copy(bytes.begin(), bytes.end(), message.begin() + 1);
  const bool sent = send(socket_, message.data(), bytes.size() + 1, MSG_NOSIGNAL) >= 0;
  if (!sent && errno != EAGAIN) gone_ = true;
  return sent;
}

std::size_t SocketPeer::receive(SocketMessage wanted, std::span<std::uint8_t> bytes,
                                std::int64_t until_ns) noexcept {
  std::array<std::uint8_t, kMostSocketBytes> message;
  for (;;) {
    const ssize_t size = recv(socket_, message.data(), message.size(), 0);
    if (size > 0) {
      if (message[0] != static_cast<std::uint8_t>(wanted)) continue;
      const std::size_t count = std::min(static_cast<std::size_t>(size) - 1, bytes.size());
      std::copy_n(message.begin() + 1, count, bytes.begin());
      return count;
    }
    if (size == 0 || (errno != EAGAIN && errno != EINTR)) {
      gone_ = true;
      return 0;
    }
    if (monotonic_ns() >= until_ns) return 0;
    wait(until_ns);
  }
}

HalStatus SocketPeer::control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                              std::size_t& moved) noexcept {
  moved = 0;
  std::array<std::uint8_t, kMostSocketBytes> message{};
  const auto low = [](std::size_t v) { return static_cast<std::uint8_t>(v & 0xffu); };
  const bool in = (request.request_type & 0x80u) != 0;
  const std::size_t room = std::min(bytes.size(), message.size() - kRequestBytes - 1);
  message = {
      request.request_type, request.request,          low(request.value), low(request.value >> 8u),
      low(request.index),   low(request.index >> 8u), low(room),          low(room >> 8u)};
  if (!in) std::copy_n(bytes.begin(), room, message.begin() + kRequestBytes);
  if (!say(SocketMessage::kControl, std::span(message).first(kRequestBytes + (in ? 0 : room))))
    return HalStatus::kDeviceGone;
  std::array<std::uint8_t, kMostSocketBytes> answer{};
  const std::size_t size = receive(SocketMessage::kAnswer, answer, monotonic_ns() + kControl_ns);
  // Who takes us in has no other host; one that has closes at once.
  if (gone_) return HalStatus::kDeviceBusy;
  if (size == 0) return HalStatus::kTimeout;
  if (answer[0] == 0) return HalStatus::kTransferFailed;
  moved = in ? std::min(size - 1, bytes.size()) : room;
  if (in) std::copy_n(answer.begin() + 1, moved, bytes.begin());
  return HalStatus::kOk;
}

std::int64_t SocketPeer::next_report_ns() const noexcept {
  return std::numeric_limits<std::int64_t>::max();  // `wait` wakes at one
}

std::size_t SocketPeer::report(std::int64_t /*now_ns*/, std::span<std::uint8_t> bytes) noexcept {
  return receive(SocketMessage::kIn, bytes, 0);
}

void SocketPeer::command(std::int64_t /*now_ns*/, std::span<const std::uint8_t> bytes) noexcept {
  (void)say(SocketMessage::kOut, bytes);
}

HalStatus SocketPeer::write(std::span<const std::uint8_t> bytes) noexcept {
  return say(SocketMessage::kOut, bytes) ? HalStatus::kOk : HalStatus::kDeviceGone;
}

HalStatus SocketPeer::read(std::span<std::uint8_t> bytes, std::size_t& moved,
                           unsigned timeout_ms) noexcept {
  moved = receive(SocketMessage::kIn, bytes, monotonic_ns() + std::int64_t{timeout_ms} * 1'000'000);
  if (gone_) return HalStatus::kDeviceGone;
  return moved > 0 ? HalStatus::kOk : HalStatus::kTimeout;
}

}  // namespace haptic::hal
