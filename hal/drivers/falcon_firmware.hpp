// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Bringing a Falcon up: the settings of its FTDI bridge and the loading of its firmware, which it
/// forgets when it loses power. Facts: libnifalcon (BSD), FalconCommLibUSB.cpp setFirmwareMode and
/// setNormalMode, FalconFirmware.cpp loadFirmware.
///
/// The image is Novint's own and under its own licence: the user names the file, none is shipped,
/// and no hash of one is published by its maker. What is written into a motor controller must
/// therefore be one whose SHA-256 the user states, or which the user accepts unseen.
/// All of it blocks, is bounded, and gives up when the port is cancelled.

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/drivers/sha256.hpp"
#include "hal/drivers/usb_port.hpp"

namespace haptic::hal {

/// Vendor requests of the FTDI bridge (type 0x40, index 0, no bytes).
enum FtdiRequest : std::uint8_t {
  kFtdiReset = 0,    ///< value 1: purge what the host has not read, 2: what it has not sent
  kFtdiModem = 1,    ///< value: one of FtdiModemValue
  kFtdiFlow = 2,     ///< value 0: none
  kFtdiBaud = 3,     ///< value: encoded divisor
  kFtdiFormat = 4,   ///< value 8: 8 data bits, no parity, one stop bit
  kFtdiLatency = 9,  ///< value: after how long a packet is sent unfilled [ms]
};
enum FtdiModemValue : std::uint16_t {
  kFtdiDtrLow = 0x0100,
  kFtdiDtrHigh = 0x0101,
  kFtdiRtsLow = 0x0200
};
inline constexpr std::uint16_t kFtdiBaud9600 = 0x4138, kFtdiBaudLoad = 0x0015,
                               kFtdiBaudRun = 0x0002;  ///< 9600, 140 k, 1.5 Mbaud

/// The image goes out in blocks of this size, and each comes back as it was sent.
inline constexpr std::size_t kFalconBlockBytes = 62;
/// Sizes of a file that can be an image: the known ones have some 30 kB.
inline constexpr std::size_t kFalconLeastImageBytes = 1024, kFalconMostImageBytes = 262144;

/// The line as the running firmware wants it: latency 1 ms, 1.5 Mbaud, both buffers purged.
[[nodiscard]] HalStatus set_falcon_run_mode(UsbPort& port) noexcept;

/// True in `runs` where the firmware answers a packet of zero motor values with one of its own.
/// @return kOk whether or not it runs; the port's status where the port failed.
[[nodiscard]] HalStatus probe_falcon(UsbPort& port, bool& runs) noexcept;

struct FalconImage {
  const char* path = nullptr;
  std::span<const Sha256Digest> known;  ///< hashes of images that may be sent
  bool accept_unknown = false;          ///< and any other
};

/// Sends the image, at most `attempts` times from the beginning, and sets run mode. What is hashed
/// is what is sent.
/// @retval kBadFirmwareFile      no path, no file, not a regular file, or a size beyond the limits
///                               above; nothing was sent.
/// @retval kUnknownFirmwareFile  its hash is not among the known ones; nothing was sent.
/// @retval kStartFailed      the loader did not answer, or an echo was wrong, in every attempt.
/// @retval kTimeout          the port was cancelled.
[[nodiscard]] HalStatus load_falcon_firmware(UsbPort& port, const FalconImage& image,
                                             int attempts) noexcept;

}  // namespace haptic::hal
