// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A USB device of two endpoints that answers what a test says, and libusb on it.

#include <doctest/doctest.h>
#include <libusb.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "host_sim/device/usbfs_carrier.hpp"

namespace haptic::sim {

using Bytes = std::vector<std::uint8_t>;
inline constexpr std::uint8_t kIn = 0x81, kOut = 0x01;
inline constexpr unsigned kPatience_ms = 20000;  // bounds a test that hangs; no test waits for it

/// Interface 0 with an interrupt endpoint each way; answers what the test says.
class Gadget : public UsbFunction {
 public:
  [[nodiscard]] Bytes descriptors() const override {
    return {18, 1, 0x00, 2,  0xff, 0, 0,  64, 0x09, 0x12, 1, 0,    0, 1,  1, 2,    3,
            1,  9, 2,    32, 0,    1, 1,  0,  0x80, 50,   9, 4,    0, 0,  2, 0xff, 0,
            0,  0, 7,    5,  kIn,  3, 96, 0,  1,    7,    5, kOut, 3, 56, 0, 1};
  }
  [[nodiscard]] int speed() const override { return 3; }
  int control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
              std::uint16_t index, std::span<std::uint8_t> bytes) override {
    requests.push_back({request_type, request, static_cast<std::uint8_t>(value),
                        static_cast<std::uint8_t>(index)});
    if (request_type == 0xc0 && request == 7) {
      for (std::size_t i = 0; i < bytes.size(); ++i)
        bytes[i] = static_cast<std::uint8_t>(value + index + i);
      return static_cast<int>(bytes.size());
    }
    if (request_type == 0x40 && request == 8) {
      taken.emplace_back(bytes.begin(), bytes.end());
      return static_cast<int>(bytes.size());
    }
    return request_type == 0x02 || request_type == 0x00 || request_type == 0x01 ? 0 : -EPIPE;
  }
  int out(std::uint8_t, std::span<const std::uint8_t> bytes) override {
    taken.emplace_back(bytes.begin(), bytes.end());
    if (on_out) on_out(bytes);
    return static_cast<int>(bytes.size());
  }

  std::vector<Bytes> taken;
  std::vector<std::array<std::uint8_t, 4>> requests;
  std::function<void(std::span<const std::uint8_t>)> on_out;
};

/// libusb on the carrier, interface claimed.
struct Host {
  explicit Host(const UsbfsCarrier& carrier) {
    // Per process and for the contexts made after it; set again each time it does no harm.
    libusb_set_option(nullptr, LIBUSB_OPTION_NO_DEVICE_DISCOVERY);
    REQUIRE(libusb_init(&context) == 0);
    REQUIRE(libusb_wrap_sys_device(context, carrier.descriptor(), &handle) == 0);
    REQUIRE(libusb_claim_interface(handle, 0) == 0);
  }
  ~Host() {
    libusb_release_interface(handle, 0);
    libusb_close(handle);
    libusb_exit(context);
  }
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  int transfer(std::uint8_t endpoint, Bytes& bytes, int& moved,
               unsigned timeout_ms = kPatience_ms) {
    return libusb_interrupt_transfer(handle, endpoint, bytes.data(), static_cast<int>(bytes.size()),
                                     &moved, timeout_ms);
  }

  libusb_context* context = nullptr;
  libusb_device_handle* handle = nullptr;
};

/// One asynchronous transfer and what became of it.
struct Async {
  Async(Host& host_, std::uint8_t endpoint, std::size_t size) : host(host_), bytes(size) {
    transfer = libusb_alloc_transfer(0);
    libusb_fill_interrupt_transfer(transfer, host.handle, endpoint, bytes.data(),
                                   static_cast<int>(size), &Async::ended, this, 0);
  }
  ~Async() { libusb_free_transfer(transfer); }
  Async(const Async&) = delete;
  Async& operator=(const Async&) = delete;

  int submit() {
    done = 0;
    return libusb_submit_transfer(transfer);
  }
  static void LIBUSB_CALL ended(libusb_transfer* transfer) {
    auto& self = *static_cast<Async*>(transfer->user_data);
    self.done = 1;
    ++self.times;
    if (self.on_end) self.on_end();
  }
  /// Handles events until this transfer has ended.
  [[nodiscard]] bool wait() {
    const auto begin = std::chrono::steady_clock::now();
    while (done == 0) {
      timeval pause{0, 100000};
      if (libusb_handle_events_timeout_completed(host.context, &pause, &done) != 0) return false;
      if (std::chrono::steady_clock::now() - begin > std::chrono::milliseconds(kPatience_ms))
        return false;
    }
    return true;
  }

  Host& host;
  Bytes bytes;
  libusb_transfer* transfer = nullptr;
  std::function<void()> on_end;
  int done = 0;
  unsigned times = 0;
};

inline Bytes report(std::uint8_t first, std::size_t size = 96) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(first + i);
  return bytes;
}

/// Handles what there is, without waiting.
inline void handle_pending(Host& host) {
  timeval none{0, 0};
  CHECK(libusb_handle_events_timeout_completed(host.context, &none, nullptr) == 0);
}

}  // namespace haptic::sim
