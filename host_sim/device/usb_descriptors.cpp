// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/usb_descriptors.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr std::uint8_t kDescriptorDevice = 1, kDescriptorConfiguration = 2,
                       kDescriptorInterface = 4, kDescriptorEndpoint = 5;
constexpr std::size_t kDeviceBytes = 18, kConfigurationBytes = 9, kInterfaceBytes = 9,
                      kEndpointBytes = 7;
constexpr std::uint8_t kToHost = 0x80, kRecipients = 0x1f;  // bits of a request type
constexpr std::uint8_t kOfDevice = 0, kOfInterface = 1, kOfEndpoint = 2;
constexpr std::uint8_t kSelfPowered = 0x40;  // in bmAttributes of a configuration

[[noreturn]] void refuse(std::size_t offset, const std::string& defect) {
  throw tools::InputError("USB descriptors: byte " + std::to_string(offset) + ": " + defect);
}

std::size_t descriptor_word(std::uint8_t low, std::uint8_t high) {
  return low | static_cast<std::size_t>(high) << 8;
}

}  // namespace

UsbDescriptors::UsbDescriptors(std::vector<std::uint8_t> bytes) : bytes_(std::move(bytes)) {
  const std::vector<std::uint8_t>& d = bytes_;
  endpoints_[0];
  if (d.size() < kDeviceBytes + kConfigurationBytes || d[0] != kDeviceBytes ||
      d[1] != kDescriptorDevice) {
    refuse(0, "a device descriptor of 18 bytes and a configuration must stand here");
  }
  const std::size_t begin = kDeviceBytes;
  if (d[begin] != kConfigurationBytes || d[begin + 1] != kDescriptorConfiguration)
    refuse(begin, "a configuration descriptor of 9 bytes must stand here");
  const std::size_t end = begin + descriptor_word(d[begin + 2], d[begin + 3]);
  if (end > d.size()) refuse(begin + 2, "wTotalLength goes beyond the bytes given");
  configuration_ = d[begin + 5];
  unsigned interface = 0;
  for (std::size_t at = begin; at < end; at += d[at]) {
    if (at + 1 == end || d[at] < 2 || at + d[at] > end)
      refuse(at, "the length of this descriptor is wrong");
    if (d[at + 1] == kDescriptorInterface && d[at] >= kInterfaceBytes) {
      interface = d[at + 2];
      settings_.emplace(interface, d[at + 3]);
    }
    if (d[at + 1] == kDescriptorEndpoint && d[at] >= kEndpointBytes)
      endpoints_[d[at + 2]] = {d[at + 3] & 3u, interface};
  }
}

std::span<const std::uint8_t> UsbDescriptors::active() const {
  return bytes().subspan(kDeviceBytes,
                         descriptor_word(bytes_[kDeviceBytes + 2], bytes_[kDeviceBytes + 3]));
}

long UsbDescriptors::answer(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                            std::uint16_t index, std::span<std::uint8_t> bytes) const {
  if ((request_type & ~kRecipients) != kToHost) return -1;
  const std::uint8_t recipient = request_type & kRecipients;
  const unsigned kind = value >> 8u, which = value & 0xffu;
  std::span<const std::uint8_t> said;
  std::array<std::uint8_t, 2> status{};
  if (recipient == kOfDevice) {
    if (request == kGetConfiguration) said = {&configuration_, 1};
    if (request == kGetDescriptor && kind == kDescriptorDevice)
      said = this->bytes().first(kDeviceBytes);
    if (request == kGetDescriptor && kind == kDescriptorConfiguration && which == 0)
      said = active();
    if (request == kGetStatus) {
      status[0] = (active()[7] & kSelfPowered) != 0 ? 1 : 0;
      said = status;
    }
  }
  // Alternate setting 0 is the only one that a carrier keeps; a halt lasts for a transfer.
  const bool known_interface = recipient == kOfInterface && has_setting(index, 0);
  if (known_interface && request == kGetInterface) said = std::span(status).first(1);
  if (known_interface && request == kGetStatus) said = status;
  const bool known_endpoint = recipient == kOfEndpoint && index <= 0xff &&
                              endpoints_.count(static_cast<std::uint8_t>(index)) != 0;
  if (known_endpoint && request == kGetStatus) said = status;
  if (said.empty()) return -1;
  const std::size_t moved = std::min(said.size(), bytes.size());
  std::copy_n(said.begin(), moved, bytes.begin());
  return static_cast<long>(moved);
}

}  // namespace haptic::sim
