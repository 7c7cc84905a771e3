// SPDX-License-Identifier: Apache-2.0
#include "hal/zero_command.hpp"

#include <linux/ioctl.h>
#include <linux/types.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include "hal/clock/servo_clock.hpp"
#include "hal/socket_message.hpp"

namespace haptic::hal {
namespace {

constexpr unsigned kTimeout_ms = 50;

}  // namespace

bool send_zero(const ZeroCommand& command) noexcept {
  if (command.descriptor < 0 || command.size == 0 || command.size > ZeroCommand::kMostBytes)
    return false;
  struct stat what {};
  if (fstat(command.descriptor, &what) != 0) return false;
  if (S_ISSOCK(what.st_mode)) {
    constexpr std::size_t kHead = 1 + kZeroStampBytes;
    std::array<std::uint8_t, ZeroCommand::kMostBytes + kHead> message{};
    message[0] = static_cast<std::uint8_t>(SocketMessage::kZero);
    const auto stamp = static_cast<std::uint64_t>(monotonic_ns());
    for (std::size_t k = 0; k < kZeroStampBytes; ++k)
      message[1 + k] = static_cast<std::uint8_t>(stamp >> (8 * k) & 0xffu);
    for (std::size_t k = 0; k < command.size; ++k) message[k + kHead] = command.bytes[k];
    return send(command.descriptor, message.data(), command.size + kHead,
                MSG_DONTWAIT | MSG_NOSIGNAL) >= 0;
  }
  // Synchronous, so that nothing has to be reaped; interrupt endpoints are served by it too.
  std::array<std::uint8_t, ZeroCommand::kMostBytes> bytes = command.bytes;
  usbdevfs_bulktransfer transfer{};
  transfer.ep = command.endpoint;
  transfer.len = command.size;
  transfer.timeout = kTimeout_ms;
  transfer.data = bytes.data();
  return ioctl(command.descriptor, USBDEVFS_BULK, &transfer) >= 0;
}

}  // namespace haptic::hal
