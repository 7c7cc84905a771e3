// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Messages over the Unix socket of a device in another process (SOCK_SEQPACKET, one message each):
/// a byte of kind, then the bytes. Reports and commands do not travel here but in memory
/// (local/carrier_memory.hpp), so nothing queues in front of a zero command. Nothing here is ever
/// larger than kMostSocketBytes.

#include <cstddef>
#include <cstdint>

namespace haptic::hal {

enum class SocketMessage : std::uint8_t {
  /// Host, first of all: kSocketVersion and the bytes of a half (little endian, 4 each), with the
  /// descriptors of CarrierDescriptors. Device: 1, it has mapped them.
  kMemory = 'm',
  kControl = 'c',  ///< host: request type, request, value, index (little endian), room or data
  kAnswer = 'a',   ///< device: 1 and the data, or 0: refused as by a stall
  kIn = 'i',       ///< device, before reports flow: bytes that a driver's start reads
  kOut = 'o',      ///< host, before reports flow: bytes that a driver's start writes
  /// Host, or who takes the force away when that is gone: when [ns of CLOCK_MONOTONIC, little
  /// endian, 8], and a command that comes before any other and makes all older ones void.
  kZero = 'z'
};

inline constexpr std::uint32_t kSocketVersion = 2;
inline constexpr std::size_t kZeroStampBytes = 8;
/// As a setup packet: type, request, value, index, room.
inline constexpr std::size_t kControlRequestBytes = 8;
inline constexpr std::size_t kMostSocketBytes = 4096 + 16;

}  // namespace haptic::hal
