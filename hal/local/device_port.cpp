// SPDX-License-Identifier: Apache-2.0
#include "hal/local/device_port.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "hal/clock/servo_clock.hpp"

namespace haptic::hal {
namespace {

constexpr int kMostMessages = 16;  // of one turn

/// Little endian.
std::uint64_t number_of(std::span<const std::uint8_t> bytes) noexcept {
  std::uint64_t number = 0;
  for (std::size_t k = bytes.size(); k-- > 0;) number = number << 8 | bytes[k];
  return number;
}

/// One message, and the descriptors that came with it; what else came is closed.
/// @return its length; 0: the host has gone; negative: nothing is there.
ssize_t receive_message(int socket, std::span<std::uint8_t> bytes,
                        CarrierDescriptors& descriptors) noexcept {
  constexpr std::size_t kCount = CarrierDescriptors::kCount;
  iovec part{bytes.data(), bytes.size()};
  alignas(cmsghdr) char room[CMSG_SPACE(kCount * sizeof(int))] = {};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = room;
  header.msg_controllen = sizeof room;
  const ssize_t size = recvmsg(socket, &header, MSG_CMSG_CLOEXEC | MSG_DONTWAIT);
  const cmsghdr* const control = size >= 0 ? CMSG_FIRSTHDR(&header) : nullptr;
  if (control == nullptr || control->cmsg_type != SCM_RIGHTS) return size;
  const std::size_t came = (control->cmsg_len - CMSG_LEN(0)) / sizeof(int);
  int numbers[kCount];
  std::memcpy(numbers, CMSG_DATA(control), std::min(came, kCount) * sizeof(int));
  for (std::size_t k = 0; k < std::min(came, kCount); ++k) *descriptors.all()[k] = numbers[k];
  if (came != kCount) descriptors.close_all();
  return size;
}

}  // namespace

DevicePort::~DevicePort() {
  if (host_ >= 0) close(host_);
  if (listener_ < 0) return;
  close(listener_);
  unlink(path_.c_str());
}

int DevicePort::listen(const std::string& path) {
  sockaddr_un address{};
  if (path.size() >= sizeof address.sun_path) return ENAMETOOLONG;
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, path.size());
  unlink(path.c_str());
  path_ = path;
  listener_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (listener_ < 0) return errno;
  if (bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      ::listen(listener_, 4) == 0)
    return 0;
  const int error = errno;
  close(listener_);
  listener_ = -1;
  return error;
}

std::array<pollfd, 3> DevicePort::watched() const noexcept {
  return {{{listener_, POLLIN, 0}, {host_, POLLIN, 0}, {memory_.wakes_us(), POLLIN, 0}}};
}

void DevicePort::serve(PortDevice& device) {
  take_host(device);
  if (host_ >= 0) hear(device);
  if (host_ >= 0) take_command(device);
}

void DevicePort::take_host(PortDevice& device) {
  const int came = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (came < 0) return;
  if (host_ >= 0) {
    ++refused_;
    close(came);
    return;
  }
  host_ = came;
  zeroed_ns_ = 0;
  ++hosts_;
  device.begin();
}

void DevicePort::drop(PortDevice& device) {
  if (host_ < 0) return;
  close(host_);
  host_ = -1;
  memory_.close();
  device.end();
}

void DevicePort::hear(PortDevice& device) {
  std::array<std::uint8_t, kMostSocketBytes> message;
  for (int k = 0; k < kMostMessages && host_ >= 0; ++k) {
    CarrierDescriptors descriptors;
    const ssize_t size = receive_message(host_, message, descriptors);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
    // A host that ends with answers unread says this before what it has sent last, a zero maybe.
    if (size < 0 && errno == ECONNRESET) continue;
    if (size <= 0) {
      descriptors.close_all();
      return drop(device);
    }
    const auto bytes =
        std::span<const std::uint8_t>(message).subspan(1, static_cast<std::size_t>(size) - 1);
    switch (static_cast<SocketMessage>(message[0])) {
      case SocketMessage::kMemory:
        if (!take_memory(bytes, descriptors)) return drop(device);
        continue;
      case SocketMessage::kControl:
        answer(device, bytes);
        break;
      case SocketMessage::kOut:
        device.command(bytes);
        break;
      case SocketMessage::kZero:
        take_zero(device, bytes);
        break;
      default:
        break;
    }
    descriptors.close_all();
  }
}

/// The descriptors are taken over in any case.
bool DevicePort::take_memory(std::span<const std::uint8_t> message,
                             CarrierDescriptors descriptors) noexcept {
  std::array<std::uint8_t, 2> reply{static_cast<std::uint8_t>(SocketMessage::kMemory), 1};
  const bool fits = message.size() == 8 && number_of(message.first<4>()) == kSocketVersion &&
                    number_of(message.subspan<4, 4>()) == sizeof(CarrierHalf);
  if (!fits) {
    descriptors.close_all();
    reply[1] = 0;
  } else if (memory_.take(descriptors) != 0) {
    reply[1] = 0;
  }
  return send(host_, reply.data(), reply.size(), MSG_NOSIGNAL | MSG_DONTWAIT) >= 0 && reply[1] == 1;
}

void DevicePort::answer(PortDevice& device, std::span<const std::uint8_t> request) {
  if (request.size() < kControlRequestBytes) return drop(device);
  const auto word = [&](std::size_t at) {
    return static_cast<std::uint16_t>(number_of(request.subspan(at, 2)));
  };
  const ControlRequest asked{request[0], request[1], word(2), word(4)};
  std::array<std::uint8_t, kMostSocketBytes> message{};
  message[0] = static_cast<std::uint8_t>(SocketMessage::kAnswer);
  const std::size_t room = std::min<std::size_t>(word(6), message.size() - 2);
  const std::ptrdiff_t size = device.control(asked, request.subspan(kControlRequestBytes),
                                             std::span(message).subspan(2, room));
  message[1] = size >= 0 ? 1 : 0;
  (void)send(host_, message.data(), 2 + static_cast<std::size_t>(std::max<std::ptrdiff_t>(size, 0)),
             MSG_NOSIGNAL | MSG_DONTWAIT);
}

void DevicePort::take_zero(PortDevice& device, std::span<const std::uint8_t> message) {
  if (message.size() < kZeroStampBytes) return;
  const auto stamp_ns = static_cast<std::int64_t>(number_of(message.first<kZeroStampBytes>()));
  zeroed_ns_ = std::clamp(stamp_ns, zeroed_ns_, monotonic_ns());
  device.command(message.subspan(kZeroStampBytes));
}

void DevicePort::take_command(PortDevice& device) {
  if (!memory_.is_open()) return;
  take_wake(memory_.wakes_us());
  const CarriedBytes* const newest = memory_.newest();
  if (newest == nullptr || newest->stamp_ns <= zeroed_ns_) return;
  if (monotonic_ns() - newest->stamp_ns > oldest_ns_) {
    ++stale_;
    return;
  }
  device.command(newest->used());
}

void DevicePort::publish(std::span<const std::uint8_t> report, std::int64_t sampled_ns) noexcept {
  memory_.publish(carried(report, sampled_ns));
}

}  // namespace haptic::hal
