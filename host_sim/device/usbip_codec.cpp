// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/usbip_codec.hpp"

#include <algorithm>

namespace haptic::sim {
namespace {

// Numbers of the commands are those of the protocol, in the order of the variant.
constexpr std::uint32_t kSubmit = 1, kUnlink = 2, kSubmitEnd = 3, kUnlinkEnd = 4;
// Byte offsets. The first five words are common to all.
constexpr std::size_t kCommandAt = 0, kSequenceAt = 4, kDeviceAt = 8, kDirectionAt = 12,
                      kEndpointAt = 16;
constexpr std::size_t kFlagsAt = 20, kRoomAt = 24, kPacketsAt = 32, kIntervalAt = 36, kSetupAt = 40;
constexpr std::size_t kTargetAt = 20, kStatusAt = 20, kMovedAt = 24;
constexpr std::uint32_t kMostEndpoint = 15;
// "Not isochronous": the protocol's text says all ones, the kernel says 0.
constexpr std::uint32_t kNoPackets = 0, kNoPacketsByText = 0xffff'ffff;

using Header = std::span<const std::uint8_t, kUsbipHeaderBytes>;

std::uint32_t word_at(Header header, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t k = 0; k < 4; ++k) word = word << 8 | header[at + k];
  return word;
}

void put_word(std::span<std::uint8_t, kUsbipHeaderBytes> header, std::size_t at,
              std::uint32_t word) {
  for (std::size_t k = 4; k-- > 0; word >>= 8)
    header[at + k] = static_cast<std::uint8_t>(word & 0xffu);
}

UsbipVerdict decode_submit(Header header, UsbipMessage& message) {
  const std::uint32_t direction = word_at(header, kDirectionAt);
  const std::uint32_t endpoint = word_at(header, kEndpointAt);
  const std::uint32_t packets = word_at(header, kPacketsAt);
  UsbipSubmit submit;
  submit.byte_count = word_at(header, kRoomAt);
  if (direction > 1) return UsbipVerdict::kBadDirection;
  if (endpoint > kMostEndpoint) return UsbipVerdict::kBadEndpoint;
  if (submit.byte_count > kUsbipMostBytes) return UsbipVerdict::kBadByteCount;
  if (packets != kNoPackets && packets != kNoPacketsByText) return UsbipVerdict::kIsochronous;
  submit.sequence = word_at(header, kSequenceAt);
  submit.device = word_at(header, kDeviceAt);
  submit.to_host = direction == 1;
  submit.endpoint = static_cast<std::uint8_t>(endpoint);
  submit.flags = word_at(header, kFlagsAt);
  submit.interval = word_at(header, kIntervalAt);
  std::copy_n(header.begin() + kSetupAt, submit.setup.size(), submit.setup.begin());
  message = submit;
  return UsbipVerdict::kOk;
}

struct Writer {
  std::span<std::uint8_t, kUsbipHeaderBytes> header;

  void begin(std::uint32_t command, std::uint32_t sequence) const {
    put_word(header, kCommandAt, command);
    put_word(header, kSequenceAt, sequence);
  }
  void operator()(const UsbipSubmit& submit) const {
    begin(kSubmit, submit.sequence);
    put_word(header, kDeviceAt, submit.device);
    put_word(header, kDirectionAt, submit.to_host ? 1 : 0);
    put_word(header, kEndpointAt, submit.endpoint);
    put_word(header, kFlagsAt, submit.flags);
    put_word(header, kRoomAt, submit.byte_count);
    put_word(header, kPacketsAt, kNoPackets);
    put_word(header, kIntervalAt, submit.interval);
    std::copy(submit.setup.begin(), submit.setup.end(), header.begin() + kSetupAt);
  }
  void operator()(const UsbipUnlink& unlink) const {
    begin(kUnlink, unlink.sequence);
    put_word(header, kDeviceAt, unlink.device);
    put_word(header, kTargetAt, unlink.target);
  }
  void operator()(const UsbipSubmitEnd& end) const {
    begin(kSubmitEnd, end.sequence);
    put_word(header, kStatusAt, static_cast<std::uint32_t>(end.status));
    put_word(header, kMovedAt, end.byte_count);
  }
  void operator()(const UsbipUnlinkEnd& end) const {
    begin(kUnlinkEnd, end.sequence);
    put_word(header, kStatusAt, static_cast<std::uint32_t>(end.status));
  }
};

}  // namespace

UsbipVerdict decode(Header header, UsbipMessage& message) {
  const std::uint32_t sequence = word_at(header, kSequenceAt);
  switch (word_at(header, kCommandAt)) {
    case kSubmit:
      return decode_submit(header, message);
    case kUnlink:
      message = UsbipUnlink{sequence, word_at(header, kDeviceAt), word_at(header, kTargetAt)};
      return UsbipVerdict::kOk;
    case kSubmitEnd: {
      const std::uint32_t moved = word_at(header, kMovedAt);
      if (moved > kUsbipMostBytes) return UsbipVerdict::kBadByteCount;
      message =
          UsbipSubmitEnd{sequence, static_cast<std::int32_t>(word_at(header, kStatusAt)), moved};
      return UsbipVerdict::kOk;
    }
    case kUnlinkEnd:
      message = UsbipUnlinkEnd{sequence, static_cast<std::int32_t>(word_at(header, kStatusAt))};
      return UsbipVerdict::kOk;
    default:
      return UsbipVerdict::kUnknownCommand;
  }
}

void encode(const UsbipMessage& message, std::span<std::uint8_t, kUsbipHeaderBytes> header) {
  std::fill(header.begin(), header.end(), std::uint8_t{0});
  std::visit(Writer{header}, message);
}

}  // namespace haptic::sim
