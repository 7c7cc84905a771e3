// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Messages of a device in another process over a Unix socket (SOCK_SEQPACKET, one message each): a
/// byte of kind, then the bytes. Nothing here is ever larger than kMostSocketBytes.

#include <cstddef>
#include <cstdint>

namespace haptic::hal {

enum class SocketMessage : std::uint8_t {
  kControl = 'c',  ///< host: request type, request, value, index (little endian), room or data
  kAnswer = 'a',   ///< device: 1 and the data, or 0: refused as by a stall
  kIn = 'i',       ///< device: a report
  kOut = 'o'       ///< host: a command
};

inline constexpr std::size_t kMostSocketBytes = 4096 + 16;

}  // namespace haptic::hal
