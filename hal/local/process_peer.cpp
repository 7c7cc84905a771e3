// SPDX-License-Identifier: Apache-2.0
#include "hal/local/process_peer.hpp"

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
// Messages of another kind than the one that is waited for, in a row: a device that floods the
// socket is not listened to for longer.
constexpr int kMostOtherMessages = 16;

// A device cannot wake this thread more often than any reports come, however often it tries.
constexpr std::int64_t kShortestSleep_ns = 20'000;

std::array<std::uint8_t, 9> memory_message() noexcept {
  std::array<std::uint8_t, 9> message{static_cast<std::uint8_t>(SocketMessage::kMemory)};
  const std::uint32_t numbers[] = {kSocketVersion, sizeof(CarrierHalf)};
  for (std::size_t k = 0; k < 8; ++k)
    message[1 + k] = static_cast<std::uint8_t>(numbers[k / 4] >> (8 * (k % 4)) & 0xffu);
  return message;
}

/// One message with the descriptors of the memory.
bool send_descriptors(int socket, std::span<std::uint8_t> bytes,
                      CarrierDescriptors descriptors) noexcept {
  constexpr std::size_t kCount = CarrierDescriptors::kCount;
  int numbers[kCount];
  for (std::size_t k = 0; k < kCount; ++k) numbers[k] = *descriptors.all()[k];
  iovec part{bytes.data(), bytes.size()};
  alignas(cmsghdr) char room[CMSG_SPACE(sizeof numbers)] = {};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = room;
  header.msg_controllen = sizeof room;
  cmsghdr* const control = CMSG_FIRSTHDR(&header);
  control->cmsg_level = SOL_SOCKET;
  control->cmsg_type = SCM_RIGHTS;
  control->cmsg_len = CMSG_LEN(sizeof numbers);
  std::memcpy(CMSG_DATA(control), numbers, sizeof numbers);
  return sendmsg(socket, &header, MSG_NOSIGNAL) >= 0;
}

}  // namespace

HalStatus ProcessPeer::plug(std::int64_t /*now_ns*/) noexcept {
  unplug();
  HalStatus status = open_socket();
  if (status == HalStatus::kOk) status = share_memory();
  if (status != HalStatus::kOk) unplug();
  return status;
}

HalStatus ProcessPeer::open_socket() noexcept {
  sockaddr_un address{};
  if (path_.size() >= sizeof address.sun_path) return HalStatus::kDeviceNotFound;
  address.sun_family = AF_UNIX;
  path_.copy(address.sun_path, path_.size());
  socket_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_ < 0) return HalStatus::kOsRefused;
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
    return HalStatus::kOk;
  if (errno == EACCES || errno == EPERM) return HalStatus::kDeviceDenied;
  return errno == EAGAIN ? HalStatus::kDeviceBusy : HalStatus::kDeviceNotFound;
}

/// Who takes us in has no other host; one that has closes at once.
HalStatus ProcessPeer::share_memory() noexcept {
  if (memory_.make() != 0) return HalStatus::kOsRefused;
  std::array<std::uint8_t, 9> message = memory_message();
  if (!send_descriptors(socket_, message, memory_.descriptors())) return HalStatus::kDeviceBusy;
  std::array<std::uint8_t, 1> answer{};
  const std::size_t size = receive(SocketMessage::kMemory, answer, monotonic_ns() + kControl_ns);
  if (gone_) return HalStatus::kDeviceBusy;
  return size == 1 && answer[0] == 1 ? HalStatus::kOk : HalStatus::kDeviceUnfit;
}

void ProcessPeer::unplug() noexcept {
  if (socket_ >= 0) close(socket_);
  socket_ = -1;
  gone_ = false;
  memory_.close();
}

void ProcessPeer::wait_for_message(std::int64_t until_ns) noexcept {
  const std::int64_t left_ns = std::max<std::int64_t>(until_ns - monotonic_ns(), 0);
  const timespec left{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  pollfd watched{socket_, POLLIN, 0};
  (void)ppoll(&watched, 1, &left, nullptr);
}

/// Until a report is there, or the device's process is gone.
void ProcessPeer::wait(std::int64_t until_ns) noexcept {
  const std::int64_t rest_ns = woken_ns_ + kShortestSleep_ns;
  if (rest_ns > monotonic_ns()) (void)sleep_until(std::min(rest_ns, until_ns));
  const std::int64_t left_ns = std::max<std::int64_t>(until_ns - monotonic_ns(), 0);
  const timespec left{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  // The socket's end alone counts: messages are not read while reports flow.
  pollfd watched[] = {{socket_, 0, 0}, {memory_.wakes_us(), POLLIN, 0}};
  if (ppoll(watched, 2, &left, nullptr) <= 0) return;
  gone_ = gone_ || watched[0].revents != 0;
  if (watched[1].revents != 0) woken_ns_ = monotonic_ns();
}

bool ProcessPeer::say(SocketMessage kind, std::span<const std::uint8_t> bytes) noexcept {
  std::array<std::uint8_t, kMostSocketBytes> message{};
  if (socket_ < 0 || bytes.size() + 1 > message.size()) return false;
  message[0] = static_cast<std::uint8_t>(kind);
  std::copy(bytes.begin(), bytes.end(), message.begin() + 1);
  const bool sent = send(socket_, message.data(), bytes.size() + 1, MSG_NOSIGNAL) >= 0;
  if (!sent && errno != EAGAIN) gone_ = true;
  return sent;
}

std::size_t ProcessPeer::receive(SocketMessage wanted, std::span<std::uint8_t> bytes,
                                 std::int64_t until_ns) noexcept {
  std::array<std::uint8_t, kMostSocketBytes> message;
  for (int others = 0; others < kMostOtherMessages;) {
    const ssize_t size = recv(socket_, message.data(), message.size(), 0);
    if (size > 0) {
      if (message[0] != static_cast<std::uint8_t>(wanted)) {
        ++others;
        continue;
      }
      const std::size_t count = std::min(static_cast<std::size_t>(size) - 1, bytes.size());
      std::copy_n(message.begin() + 1, count, bytes.begin());
      return count;
    }
    if (size == 0 || (errno != EAGAIN && errno != EINTR)) {
      gone_ = true;
      return 0;
    }
    if (monotonic_ns() >= until_ns) return 0;
    wait_for_message(until_ns);
  }
  return 0;
}

HalStatus ProcessPeer::control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                               std::size_t& moved) noexcept {
  moved = 0;
  std::array<std::uint8_t, kMostSocketBytes> message{};
  const auto low = [](std::size_t v) { return static_cast<std::uint8_t>(v & 0xffu); };
  const bool in = (request.request_type & 0x80u) != 0;
  const std::size_t room = std::min(bytes.size(), message.size() - kControlRequestBytes - 1);
  message = {
      request.request_type, request.request,          low(request.value), low(request.value >> 8u),
      low(request.index),   low(request.index >> 8u), low(room),          low(room >> 8u)};
  if (!in) std::copy_n(bytes.begin(), room, message.begin() + kControlRequestBytes);
  if (!say(SocketMessage::kControl,
           std::span(message).first(kControlRequestBytes + (in ? 0 : room))))
    return HalStatus::kDeviceGone;
  std::array<std::uint8_t, kMostSocketBytes> answer{};
  const std::size_t size = receive(SocketMessage::kAnswer, answer, monotonic_ns() + kControl_ns);
  if (gone_) return HalStatus::kDeviceGone;
  if (size == 0) return HalStatus::kTimeout;
  if (answer[0] == 0) return HalStatus::kTransferFailed;
  moved = in ? std::min(size - 1, bytes.size()) : room;
  if (in) std::copy_n(answer.begin() + 1, moved, bytes.begin());
  return HalStatus::kOk;
}

std::int64_t ProcessPeer::next_report_ns() const noexcept {
  return std::numeric_limits<std::int64_t>::max();  // `wait` wakes at one
}

std::size_t ProcessPeer::report(std::int64_t /*now_ns*/, std::span<std::uint8_t> bytes,
                                std::int64_t& sampled_ns) noexcept {
  take_wake(memory_.wakes_us());
  const CarriedBytes* const newest = memory_.newest();
  if (newest == nullptr) return 0;
  sampled_ns = newest->stamp_ns;
  const std::span<const std::uint8_t> used = newest->used();
  const std::size_t size = std::min(used.size(), bytes.size());
  std::copy_n(used.begin(), size, bytes.begin());
  return size;
}

void ProcessPeer::command(std::int64_t now_ns, std::span<const std::uint8_t> bytes) noexcept {
  memory_.publish(carried(bytes, now_ns));
}

HalStatus ProcessPeer::write(std::span<const std::uint8_t> bytes) noexcept {
  return say(SocketMessage::kOut, bytes) ? HalStatus::kOk : HalStatus::kDeviceGone;
}

HalStatus ProcessPeer::read(std::span<std::uint8_t> bytes, std::size_t& moved,
                            unsigned timeout_ms) noexcept {
  moved = receive(SocketMessage::kIn, bytes, monotonic_ns() + std::int64_t{timeout_ms} * 1'000'000);
  if (gone_) return HalStatus::kDeviceGone;
  return moved > 0 ? HalStatus::kOk : HalStatus::kTimeout;
}

}  // namespace haptic::hal
