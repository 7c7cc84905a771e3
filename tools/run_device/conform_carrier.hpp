// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The way to a device that is checked against hal/drivers/PROTOCOL.md: bytes in, bytes out, and
/// no driver in between that would repair or refuse what the check is about.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "hal/drivers/usb_port.hpp"
#include "hal/usb/usb_connection.hpp"
#include "hal/usb/usb_link.hpp"

namespace haptic::tools {

/// Owner: one thread.
class ConformCarrier {
 public:
  virtual ~ConformCarrier() = default;
  /// Finds the device and holds it; once more after `disconnect`. Empty, or why it cannot be had.
  [[nodiscard]] virtual std::string connect() = 0;
  virtual void disconnect() noexcept = 0;
  /// A request on the control pipe, at most 100 ms. @retval kTransferFailed  it stalled
  [[nodiscard]] virtual hal::HalStatus control(const hal::ControlRequest& request,
                                               std::span<std::uint8_t> bytes,
                                               std::size_t& moved) = 0;
  /// The next report, waited for at most `wait_ns`. @return its length; 0: none came
  [[nodiscard]] virtual std::size_t receive(std::span<std::uint8_t> bytes,
                                            std::int64_t wait_ns) = 0;
  /// A packet to the command's endpoint. False: the device is gone.
  [[nodiscard]] virtual bool send(std::span<const std::uint8_t> bytes) = 0;
  /// Lets time go by.
  virtual void pass(std::int64_t time_ns) = 0;
  /// Its endpoints, where it is on a bus and connected.
  struct Endpoints {
    hal::UsbEndpoint in, out;
  };
  [[nodiscard]] virtual std::optional<Endpoints> endpoints() const = 0;
  /// The device is informed of a `disconnect`, as by a cable that is pulled.
  [[nodiscard]] virtual bool tells_of_its_end() const = 0;
};

/// By USB; of the identity of the reference device where the address has none.
[[nodiscard]] std::unique_ptr<ConformCarrier> conform_over_usb(const hal::UsbAddress& address);
/// A device in another process, behind a socket (hal/local/process_peer.hpp).
[[nodiscard]] std::unique_ptr<ConformCarrier> conform_over_socket(const std::string& path);

}  // namespace haptic::tools
