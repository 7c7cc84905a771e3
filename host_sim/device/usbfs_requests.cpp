// SPDX-License-Identifier: Apache-2.0
// What the kernel's usbfs answers beside transfers: descriptors, interfaces, control requests.
#include "host_sim/device/usbfs_bus.hpp"

// This order: the kernel's header of usbfs needs the types and macros of the first two.
#include <linux/types.h>

#include <linux/ioctl.h>

#include <linux/usbdevice_fs.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr std::uint8_t kDescriptorDevice = 1, kDescriptorConfiguration = 2,
                       kDescriptorInterface = 4, kDescriptorEndpoint = 5;
constexpr std::size_t kDeviceBytes = 18, kConfigurationBytes = 9, kInterfaceBytes = 9,
                      kEndpointBytes = 7;
constexpr unsigned kDeviceNumber = 1;
constexpr std::uint8_t kFull = 2;  // speed

// What this bus can do. No mapped memory: that would need mmap of the descriptor.
constexpr std::uint32_t kCapabilities = USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_NO_PACKET_SIZE_LIM |
                                        USBDEVFS_CAP_BULK_SCATTER_GATHER |
                                        USBDEVFS_CAP_REAP_AFTER_DISCONNECT;

[[noreturn]] void refuse(std::size_t offset, const std::string& defect) {
  throw tools::InputError("USB descriptors: byte " + std::to_string(offset) + ": " + defect);
}

template <typename T>
T& as(void* argument) {
  return *static_cast<T*>(argument);
}

}  // namespace

UsbfsBus::UsbfsBus(UsbFunction& function, unsigned room)
    : function_(function), room_(room), descriptors_(function.descriptors()) {
  endpoints_[0];
  parse_descriptors();
  flights_.reserve(16);
  ended_.reserve(16);
}

// Interfaces and endpoints of the first configuration, which is the active one.
void UsbfsBus::parse_descriptors() {
  const std::vector<std::uint8_t>& d = descriptors_;
  if (d.size() < kDeviceBytes + kConfigurationBytes || d[0] != kDeviceBytes ||
      d[1] != kDescriptorDevice) {
    refuse(0, "a device descriptor of 18 bytes and a configuration must stand here");
  }
  const std::size_t begin = kDeviceBytes;
  if (d[begin] != kConfigurationBytes || d[begin + 1] != kDescriptorConfiguration)
    refuse(begin, "a configuration descriptor of 9 bytes must stand here");
  const std::size_t end = begin + (d[begin + 2] | static_cast<std::size_t>(d[begin + 3]) << 8);
  if (end > d.size()) refuse(begin + 2, "wTotalLength goes beyond the bytes given");
  configuration_ = d[begin + 5];
  unsigned interface = 0;
  for (std::size_t at = begin; at < end; at += d[at]) {
    if (d[at] < 2 || at + d[at] > end) refuse(at, "the length of this descriptor is wrong");
    if (d[at + 1] == kDescriptorInterface && d[at] >= kInterfaceBytes) {
      interface = d[at + 2];
      settings_.emplace(interface, d[at + 3]);
    }
    if (d[at + 1] == kDescriptorEndpoint && d[at] >= kEndpointBytes) {
      Endpoint& endpoint = endpoints_[d[at + 2]];
      endpoint.type = d[at + 3] & 3u;
      endpoint.interface = interface;
    }
  }
}

long UsbfsBus::on_ioctl(unsigned long request, void* argument) {
  switch (request) {
    case USBDEVFS_SUBMITURB:
      return submit(static_cast<usbdevfs_urb*>(argument));
    case USBDEVFS_REAPURBNDELAY:
      return reap(static_cast<void**>(argument));
    case USBDEVFS_DISCARDURB:
      return discard(static_cast<const usbdevfs_urb*>(argument));
    default:
      break;
  }
  if (!plugged()) return -ENODEV;
  switch (request) {
    case USBDEVFS_GET_CAPABILITIES:
      as<std::uint32_t>(argument) = kCapabilities;
      return 0;
    case USBDEVFS_CONNECTINFO:
      as<usbdevfs_connectinfo>(argument) = {kDeviceNumber, function_.speed() < kFull};
      return 0;
    case USBDEVFS_GET_SPEED:
      return function_.speed();
    case USBDEVFS_CONTROL: {
      const auto& c = as<usbdevfs_ctrltransfer>(argument);
      return control(c.bRequestType, c.bRequest, c.wValue, c.wIndex,
                     {static_cast<std::uint8_t*>(c.data), c.wLength});
    }
    case USBDEVFS_CLAIMINTERFACE:
      return claim(as<unsigned>(argument));
    case USBDEVFS_DISCONNECT_CLAIM:  // no kernel driver holds it
      return claim(as<usbdevfs_disconnect_claim>(argument).interface);
    case USBDEVFS_RELEASEINTERFACE:
      return release(as<unsigned>(argument));
    default:
      return on_rare_ioctl(request, argument);
  }
}

long UsbfsBus::on_rare_ioctl(unsigned long request, void* argument) {
  switch (request) {
    case USBDEVFS_SETCONFIGURATION: {
      const auto value = as<unsigned>(argument);
      if (value != configuration_) return -EINVAL;
      return std::min(function_.control(0x00, kSetConfiguration, configuration_, 0, {}), 0);
    }
    case USBDEVFS_SETINTERFACE: {
      const auto& s = as<usbdevfs_setinterface>(argument);
      if (settings_.count({s.interface, s.altsetting}) == 0) return -EINVAL;
      return std::min(
          function_.control(0x01, kSetInterface, static_cast<std::uint16_t>(s.altsetting),
                            static_cast<std::uint16_t>(s.interface), {}),
          0);
    }
    case USBDEVFS_CLEAR_HALT:
      return clear_halt(as<unsigned>(argument));
    case USBDEVFS_RESET:
      return 0;
    case USBDEVFS_GETDRIVER:  // no kernel driver is bound
      return -ENODATA;
    case USBDEVFS_IOCTL:  // nor can one be unbound, and none wants to be bound again
      return as<usbdevfs_ioctl>(argument).ioctl_code == static_cast<int>(USBDEVFS_CONNECT)
                 ? 0
                 : -ENODATA;
    default:
      return -ENOTTY;
  }
}

long UsbfsBus::claim(unsigned interface) {
  if (settings_.count({interface, 0}) == 0) return -ENOENT;
  const Lock lock(mutex_);
  claimed_.insert(interface);
  return 0;
}

// As usbfs does: what is in flight on the interface is cancelled.
long UsbfsBus::release(unsigned interface) {
  const Lock lock(mutex_);
  if (claimed_.erase(interface) == 0) return -EINVAL;
  for (std::size_t i = flights_.size(); i-- > 0;) {
    const usbdevfs_urb& urb = *flights_[i].urb;
    const bool ours =
        urb.type != USBDEVFS_URB_TYPE_CONTROL && endpoints_[urb.endpoint].interface == interface;
    if (ours && !flights_[i].at_device) finish(i, -ENOENT, 0);
  }
  return 0;
}

long UsbfsBus::clear_halt(unsigned endpoint) {
  const auto address = static_cast<std::uint8_t>(endpoint);
  if (endpoint == 0 || endpoint > 0xff || endpoints_.count(address) == 0) return -ENOENT;
  return std::min(function_.control(0x02, kClearFeature, 0, address, {}), 0);
}

long UsbfsBus::control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                       std::uint16_t index, std::span<std::uint8_t> bytes) {
  if (request_type == 0x80) {
    const long moved = standard(request, value, bytes);
    if (moved >= 0) return moved;
  }
  const int moved = function_.control(request_type, request, value, index, bytes);
  return std::min<long>(moved, static_cast<long>(bytes.size()));
}

// What the descriptors say; negative: a matter for the function.
long UsbfsBus::standard(std::uint8_t request, std::uint16_t value,
                        std::span<std::uint8_t> bytes) const {
  std::span<const std::uint8_t> answer;
  if (request == kGetConfiguration) answer = {&configuration_, 1};
  const unsigned kind = value >> 8u, which = value & 0xffu;
  const std::span<const std::uint8_t> all(descriptors_);
  if (request == kGetDescriptor && kind == kDescriptorDevice) answer = all.first(kDeviceBytes);
  if (request == kGetDescriptor && kind == kDescriptorConfiguration && which == 0) {
    answer = all.subspan(
        kDeviceBytes, all[kDeviceBytes + 2] | static_cast<std::size_t>(all[kDeviceBytes + 3]) << 8);
  }
  if (answer.empty()) return -1;
  const std::size_t moved = std::min(answer.size(), bytes.size());
  std::copy_n(answer.begin(), moved, bytes.begin());
  return static_cast<long>(moved);
}

long UsbfsBus::on_read(std::span<std::byte> bytes) {
  const Lock lock(mutex_);
  if (!plugged_) return -ENODEV;
  const std::size_t begin = std::min(position_, descriptors_.size());
  const std::size_t moved = std::min(bytes.size(), descriptors_.size() - begin);
  std::memcpy(bytes.data(), descriptors_.data() + begin, moved);
  position_ = begin + moved;
  return static_cast<long>(moved);
}

long UsbfsBus::on_seek(long offset, int whence) {
  const Lock lock(mutex_);
  long base = 0;
  if (whence == SEEK_CUR) base = static_cast<long>(position_);
  if (whence == SEEK_END) return -EINVAL;  // as usbfs
  if (base + offset < 0) return -EINVAL;
  position_ = static_cast<std::size_t>(base + offset);
  return static_cast<long>(position_);
}

}  // namespace haptic::sim
