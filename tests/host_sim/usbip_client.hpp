// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The host's side of a USB/IP connection, as the kernel's vhci-hcd speaks it, for tests.

#include <doctest/doctest.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "host_sim/device/usbip_codec.hpp"

namespace haptic::sim {

constexpr std::uint8_t kInNumber = 1, kOutNumber = 1;  // of the endpoints

/// What came back.
struct UsbipAnswer {
  UsbipMessage message;
  std::vector<std::uint8_t> bytes;

  [[nodiscard]] const UsbipSubmitEnd& end() const { return std::get<UsbipSubmitEnd>(message); }
  [[nodiscard]] const UsbipUnlinkEnd& unlinked() const { return std::get<UsbipUnlinkEnd>(message); }
};

class UsbipClient {
 public:
  static constexpr int kPatience_ms = 20000;  // bounds a test that hangs; no test waits for it

  explicit UsbipClient(int descriptor) : descriptor_(descriptor) {}

  std::uint32_t submit_in(std::uint8_t endpoint, std::uint32_t room, std::uint32_t flags = 0) {
    UsbipSubmit submit = next(endpoint, true, room);
    submit.flags = flags;
    return begin(submit, {});
  }
  std::uint32_t submit_out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) {
    return begin(next(endpoint, false, static_cast<std::uint32_t>(bytes.size())), bytes);
  }
  /// `bytes` go out where the request type says so; else `length` may come in.
  std::uint32_t control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                        std::uint16_t index, std::uint16_t length,
                        std::span<const std::uint8_t> bytes = {}) {
    UsbipSubmit submit = next(0, (request_type & 0x80u) != 0, length);
    submit.setup = {request_type,
                    request,
                    static_cast<std::uint8_t>(value),
                    static_cast<std::uint8_t>(value >> 8),
                    static_cast<std::uint8_t>(index),
                    static_cast<std::uint8_t>(index >> 8),
                    static_cast<std::uint8_t>(length),
                    static_cast<std::uint8_t>(length >> 8)};
    return begin(submit, bytes);
  }
  std::uint32_t unlink(std::uint32_t target) {
    send(UsbipUnlink{++sequence_, kDevice, target}, {});
    return sequence_;
  }

  /// The next answer; nothing when the device has hung up.
  std::optional<UsbipAnswer> receive() {
    std::array<std::uint8_t, kUsbipHeaderBytes> header{};
    if (!read(header)) return std::nullopt;
    UsbipAnswer answer;
    REQUIRE(decode(header, answer.message) == UsbipVerdict::kOk);
    if (const auto* const end = std::get_if<UsbipSubmitEnd>(&answer.message)) {
      REQUIRE(end->sequence < to_host_.size());
      if (to_host_[end->sequence]) answer.bytes.resize(end->byte_count);
      if (!answer.bytes.empty()) REQUIRE(read(answer.bytes));
    }
    return answer;
  }

  /// Whether everything that was sent before has been seen to, and nothing of it was answered.
  bool is_silent() {
    const std::uint32_t mark = control(0x80, 8, 0, 0, 1);
    const std::optional<UsbipAnswer> answer = receive();
    const auto* const end = answer ? std::get_if<UsbipSubmitEnd>(&answer->message) : nullptr;
    return end != nullptr && end->sequence == mark;
  }

  void send_raw(std::span<const std::uint8_t> bytes) {
    // The device may have hung up already.
    (void)!::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }

 private:
  static constexpr std::uint32_t kDevice = 1u << 16 | 2u;

  UsbipSubmit next(std::uint8_t endpoint, bool to_host, std::uint32_t byte_count) {
    UsbipSubmit submit;
    submit.sequence = ++sequence_;
    submit.device = kDevice;
    submit.to_host = to_host;
    submit.endpoint = endpoint;
    submit.byte_count = byte_count;
    return submit;
  }
  std::uint32_t begin(const UsbipSubmit& submit, std::span<const std::uint8_t> bytes) {
    to_host_.resize(submit.sequence + 1, false);
    to_host_[submit.sequence] = submit.to_host;
    send(submit, bytes);
    return submit.sequence;
  }
  void send(const UsbipMessage& message, std::span<const std::uint8_t> bytes) {
    std::array<std::uint8_t, kUsbipHeaderBytes> header{};
    encode(message, header);
    send_raw(header);
    if (!bytes.empty()) send_raw(bytes);
  }
  bool read(std::span<std::uint8_t> bytes) const {
    while (!bytes.empty()) {
      pollfd watched{descriptor_, POLLIN, 0};
      REQUIRE(poll(&watched, 1, kPatience_ms) == 1);
      const ssize_t count = recv(descriptor_, bytes.data(), bytes.size(), 0);
      if (count <= 0) return false;
      bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
    return true;
  }

  int descriptor_;
  std::uint32_t sequence_ = 0;
  std::vector<bool> to_host_;  ///< by sequence: an answer's bytes follow
};

}  // namespace haptic::sim
