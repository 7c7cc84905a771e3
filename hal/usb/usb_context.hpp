// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A libusb context of our own, and the one place where the USB thread waits: on the descriptors of
/// libusb, to the nanosecond, or until another thread wakes it. (libusb's own wait rounds up to
/// milliseconds.)

#include <poll.h>

#include <array>
#include <cstddef>
#include <cstdint>

struct libusb_context;

namespace haptic::hal {

/// Owner: the USB thread; `wake` may be called from any.
class UsbContext {
 public:
  UsbContext() noexcept;
  ~UsbContext();
  UsbContext(const UsbContext&) = delete;
  UsbContext& operator=(const UsbContext&) = delete;

  /// @param discovery  false: only wrapped descriptors are opened. libusb before 1.0.27 knows that
  ///   only as a default of the whole process, so that contexts made later find no devices either.
  /// @return a libusb code. Allocates.
  int open(bool discovery) noexcept;
  void close() noexcept;
  [[nodiscard]] libusb_context* get() const noexcept { return context_; }

  /// From now on, `arrived` tells of devices of this identity plugged in, where libusb can.
  void watch_arrivals(std::uint16_t vendor_id, std::uint16_t product_id) noexcept;
  /// True if a device arrived since the last call.
  [[nodiscard]] bool arrived() noexcept;

  /// Waits at most `timeout_ns` for the bus or `wake`, then runs the callbacks of what has ended.
  /// @return a libusb code. One ppoll; libusb is entered only when it has something.
  int handle_events(std::int64_t timeout_ns) noexcept;

  /// Ends the present or next wait.
  void wake() noexcept;

 private:
  static constexpr std::size_t kMostDescriptors = 16;
  static void on_added(int descriptor, short events, void* self);
  static void on_removed(int descriptor, void* self);

  libusb_context* context_ = nullptr;
  std::array<pollfd, kMostDescriptors> descriptors_{};  ///< the first is ours, to be woken by
  std::size_t count_ = 1;
  bool overflowed_ = false;  ///< libusb has more than fit: it waits itself
  bool arrived_ = false;
};

}  // namespace haptic::hal
