// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The device's end of a process_peer.hpp: what a program that serves a device needs to be held by
/// a host. One host at a time, as a claimed interface has.

#include <poll.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "hal/drivers/usb_port.hpp"
#include "hal/local/carrier_memory.hpp"
#include "hal/socket_message.hpp"

namespace haptic::hal {

/// Bytes of a device, behind a port. Called while the port is served.
class PortDevice {
 public:
  virtual ~PortDevice() = default;
  /// A host has come.
  virtual void begin() = 0;
  /// Answers a request of the host's driver; @return the bytes of `room` that are the answer;
  /// negative: refused, as by a stall.
  virtual std::ptrdiff_t control(const ControlRequest& request, std::span<const std::uint8_t> data,
                                 std::span<std::uint8_t> room) = 0;
  /// A command, which is the newest that there is.
  virtual void command(std::span<const std::uint8_t> bytes) = 0;
  /// The host has gone: without a zero command before it the device takes its force away itself.
  virtual void end() = 0;
};

/// Owner: one thread, or several one at a time. Allocates in `listen` alone; nothing blocks.
class DevicePort {
 public:
  /// Commands older than this when they are looked at are never passed on [ns]: two periods of the
  /// device.
  explicit DevicePort(std::int64_t oldest_ns) noexcept : oldest_ns_(oldest_ns) {}
  ~DevicePort();
  DevicePort(const DevicePort&) = delete;
  DevicePort& operator=(const DevicePort&) = delete;

  /// Listens at `path`, which is replaced. @return 0 or an errno.
  [[nodiscard]] int listen(const std::string& path);
  /// For poll(2): who knocks, what the host says, what it commands.
  [[nodiscard]] std::array<pollfd, 3> watched() const noexcept;
  /// Takes in a host, answers it, passes on a zero command and the newest command; nothing is
  /// waited for, and the host is heard a bounded number of times.
  void serve(PortDevice& device);
  /// To the host, if there is one; `sampled_ns` by CLOCK_MONOTONIC.
  void publish(std::span<const std::uint8_t> report, std::int64_t sampled_ns) noexcept;
  /// The host is sent away.
  void drop(PortDevice& device);

  [[nodiscard]] bool has_host() const noexcept { return host_ >= 0; }
  [[nodiscard]] unsigned hosts() const noexcept { return hosts_; }      ///< that were taken in
  [[nodiscard]] unsigned refused() const noexcept { return refused_; }  ///< while another was there
  [[nodiscard]] unsigned stale() const noexcept { return stale_; }  ///< commands that were too old

 private:
  void take_host(PortDevice& device);
  void hear(PortDevice& device);
  [[nodiscard]] bool take_memory(std::span<const std::uint8_t> message,
                                 CarrierDescriptors descriptors) noexcept;
  void answer(PortDevice& device, std::span<const std::uint8_t> request);
  void take_zero(PortDevice& device, std::span<const std::uint8_t> message);
  void take_command(PortDevice& device);

  const std::int64_t oldest_ns_;
  std::string path_;
  int listener_ = -1, host_ = -1;
  CarrierMemory memory_;
  std::int64_t zeroed_ns_ = 0;  ///< what was commanded up to then is void
  unsigned hosts_ = 0, refused_ = 0, stale_ = 0;
};

}  // namespace haptic::hal
