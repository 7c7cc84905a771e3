// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Headers of the USB/IP protocol, version 1.1.1: 48 bytes, big-endian, both ways. The host side
/// (vhci-hcd of the kernel) submits and unlinks transfers, the device side ends them. Only what
/// crosses an attached connection; finding and importing devices is not part of it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>

namespace haptic::sim {

inline constexpr std::size_t kUsbipHeaderBytes = 48;
/// Largest transfer that is taken: usbfs cuts bulk transfers into pieces of 16 KiB, control
/// transfers end at 64 KiB.
inline constexpr std::uint32_t kUsbipMostBytes = 1u << 17;
/// URB_SHORT_NOT_OK of the flags: fewer bytes than asked for are an error.
inline constexpr std::uint32_t kUsbipShortNotOk = 1;

/// Host: a transfer begins. Outwards its bytes follow the header.
struct UsbipSubmit {
  std::uint32_t sequence = 0, device = 0;
  bool to_host = false;
  std::uint8_t endpoint = 0;  ///< number, 0 to 15, without the direction
  std::uint32_t flags = 0;
  std::uint32_t byte_count = 0;  ///< room, or bytes that follow
  std::uint32_t interval = 0;
  std::array<std::uint8_t, 8> setup{};  ///< of control transfers
  friend bool operator==(const UsbipSubmit&, const UsbipSubmit&) = default;

  /// As descriptors have it; 0 for the control endpoint.
  [[nodiscard]] std::uint8_t address() const {
    return static_cast<std::uint8_t>(endpoint != 0 && to_host ? endpoint | 0x80u : endpoint);
  }
};

/// Host: takes back the transfer `target`.
struct UsbipUnlink {
  std::uint32_t sequence = 0, device = 0, target = 0;
  friend bool operator==(const UsbipUnlink&, const UsbipUnlink&) = default;
};

/// Device: a transfer has ended. To the host its bytes follow the header.
struct UsbipSubmitEnd {
  std::uint32_t sequence = 0;    ///< of the submit
  std::int32_t status = 0;       ///< 0, or a negative errno of Linux
  std::uint32_t byte_count = 0;  ///< moved
  friend bool operator==(const UsbipSubmitEnd&, const UsbipSubmitEnd&) = default;
};

/// Device: -ECONNRESET, the transfer was taken back; 0, it had ended before.
struct UsbipUnlinkEnd {
  std::uint32_t sequence = 0;  ///< of the unlink
  std::int32_t status = 0;
  friend bool operator==(const UsbipUnlinkEnd&, const UsbipUnlinkEnd&) = default;
};

using UsbipMessage = std::variant<UsbipSubmit, UsbipUnlink, UsbipSubmitEnd, UsbipUnlinkEnd>;

enum class UsbipVerdict : std::uint8_t {
  kOk = 0,
  kUnknownCommand,
  kBadDirection,  ///< neither 0 nor 1
  kBadEndpoint,   ///< beyond 15
  kBadByteCount,  ///< beyond kUsbipMostBytes, or negative
  kIsochronous    ///< packets follow, which no device here has
};

/// `message` is unchanged unless kOk. Reserved bytes are not looked at. Cost: constant.
[[nodiscard]] UsbipVerdict decode(std::span<const std::uint8_t, kUsbipHeaderBytes> header,
                                  UsbipMessage& message);
/// Reserved bytes become zero. A message within the ranges above decodes to itself.
void encode(const UsbipMessage& message, std::span<std::uint8_t, kUsbipHeaderBytes> header);

}  // namespace haptic::sim
