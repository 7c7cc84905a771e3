// SPDX-License-Identifier: Apache-2.0
#pragma once
/// An open device: found by identity or wrapped, its interface claimed, its endpoints checked; and
/// the blocking port that a driver starts it through.

#include <atomic>
#include <cstdint>
#include <string>

#include "hal/drivers/driver.hpp"
#include "hal/drivers/usb_port.hpp"
#include "hal/usb/usb_context.hpp"
#include "hal/usb/usb_text.hpp"

struct libusb_config_descriptor;
struct libusb_device;
struct libusb_device_handle;

namespace haptic::hal {

struct UsbAddress;

/// An endpoint as the device describes it.
struct UsbEndpoint {
  std::uint8_t address = 0;  ///< 0: none
  bool bulk = false;         ///< else interrupt
  std::uint16_t packet_bytes = 0;
  std::int64_t interval_ns = 0;  ///< of an interrupt endpoint; 0: bulk, or not known
};

/// How often an interrupt endpoint is looked at by USB 2.0: `b_interval` frames of 1 ms, or at high
/// speed and above 2^(b_interval - 1) microframes of 125 us; 0: out of its range.
[[nodiscard]] std::int64_t interrupt_interval_ns(bool high_speed, std::uint8_t b_interval) noexcept;

/// Owner: the USB thread.
class UsbConnection final : public UsbPort {
 public:
  UsbConnection(UsbContext& context, const std::atomic<bool>& cancelled) noexcept
      : context_(context), cancelled_(cancelled) {}
  ~UsbConnection() override { close(); }
  UsbConnection(const UsbConnection&) = delete;
  UsbConnection& operator=(const UsbConnection&) = delete;

  /// By identity, or by `wrapped_fd` where it is not negative. Of equal devices the first that can
  /// be opened and claimed. On failure nothing stays open and `trouble` says what to do: about a
  /// device that is there but held, where none is free. Allocates.
  [[nodiscard]] HalStatus open(const UsbProfile& profile, const UsbAddress& address, int wrapped_fd,
                               std::string& trouble);
  /// Gives the interface back to the kernel's driver, if it had one, and closes; a wrapped
  /// descriptor stays open.
  void close() noexcept;

  [[nodiscard]] libusb_device_handle* handle() const noexcept { return handle_; }
  /// File descriptor of the open device: the one that was wrapped, or the one that libusb has
  /// opened; negative: not known.
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }
  [[nodiscard]] const UsbEndpoint& in() const noexcept { return in_; }
  [[nodiscard]] const UsbEndpoint& out() const noexcept { return out_; }
  [[nodiscard]] const UsbName& name() const noexcept { return name_; }

  HalStatus control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                    std::size_t& moved, unsigned timeout_ms) noexcept override;
  HalStatus write(std::span<const std::uint8_t> bytes, unsigned timeout_ms) noexcept override;
  HalStatus read(std::span<std::uint8_t> bytes, std::size_t& moved,
                 unsigned timeout_ms) noexcept override;
  [[nodiscard]] bool cancelled() const noexcept override { return cancelled_.load(); }

 private:
  [[nodiscard]] int find(const UsbProfile& profile, const UsbAddress& address,
                         UsbAction& action) noexcept;
  [[nodiscard]] bool has_serial(libusb_device* device, const std::string& serial) noexcept;
  [[nodiscard]] int request(const ControlRequest& request, std::span<std::uint8_t> bytes,
                            std::size_t& moved, unsigned timeout_ms) noexcept;
  void close_handle() noexcept;
  [[nodiscard]] int claim(const UsbProfile& profile, UsbAction& action) noexcept;
  [[nodiscard]] int choose_endpoints(const UsbProfile& profile) noexcept;
  [[nodiscard]] int move(const UsbEndpoint& endpoint, std::span<std::uint8_t> bytes,
                         std::size_t& moved, unsigned timeout_ms) noexcept;

  UsbContext& context_;
  const std::atomic<bool>& cancelled_;
  libusb_device_handle* handle_ = nullptr;
  int claimed_interface_ = -1;
  int descriptor_ = -1;
  UsbName name_;
  UsbEndpoint in_, out_;
};

}  // namespace haptic::hal
