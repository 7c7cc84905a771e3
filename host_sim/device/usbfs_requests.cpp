// SPDX-License-Identifier: Apache-2.0
// What the kernel's usbfs answers, apart from transfers: descriptors, interfaces, control requests.
#include "host_sim/device/usbfs_bus.hpp"

// This order: the kernel's header of usbfs needs the types and macros of the first two.
#include <linux/types.h>

#include <linux/ioctl.h>

#include <linux/usbdevice_fs.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <thread>

namespace haptic::sim {
namespace {

constexpr unsigned kDeviceNumber = 1;
constexpr std::uint8_t kFull = 2;  // speed

// Capabilities of this bus. No mapped memory: that would need mmap of the descriptor.
constexpr std::uint32_t kCapabilities = USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_NO_PACKET_SIZE_LIM |
                                        USBDEVFS_CAP_BULK_SCATTER_GATHER |
                                        USBDEVFS_CAP_REAP_AFTER_DISCONNECT;

template <typename T>
T& as(void* argument) {
  return *static_cast<T*>(argument);
}

}  // namespace

UsbfsBus::UsbfsBus(UsbFunction& function, unsigned room)
    : function_(function), room_(room), descriptors_(function.descriptors()) {
  for (const auto& [address, described] : descriptors_.endpoints())
    endpoints_[address].described = described;
  flights_.reserve(16);
  ended_.reserve(16);
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
    case USBDEVFS_SETCONFIGURATION:
      if (as<unsigned>(argument) != descriptors_.configuration()) return -EINVAL;
      [[fallthrough]];
    case USBDEVFS_RESET:  // after which the kernel configures the device again
      return std::min(
          function_.control(0x00, kSetConfiguration, descriptors_.configuration(), 0, {}), 0);
    case USBDEVFS_SETINTERFACE: {
      const auto& s = as<usbdevfs_setinterface>(argument);
      if (!descriptors_.has_setting(s.interface, s.altsetting)) return -EINVAL;
      return std::min(
          function_.control(0x01, kSetInterface, static_cast<std::uint16_t>(s.altsetting),
                            static_cast<std::uint16_t>(s.interface), {}),
          0);
    }
    case USBDEVFS_CLEAR_HALT:
      return clear_halt(as<unsigned>(argument));
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
  if (!descriptors_.has_setting(interface, 0)) return -ENOENT;
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
    const bool ours = urb.type != USBDEVFS_URB_TYPE_CONTROL &&
                      endpoints_[urb.endpoint].described.interface == interface;
    if (ours && !flights_[i].at_device) finish(i, -ENOENT, 0);
  }
  return 0;
}

long UsbfsBus::clear_halt(unsigned endpoint) {
  const auto address = static_cast<std::uint8_t>(endpoint);
  if (endpoint == 0 || endpoint > 0xff || endpoints_.count(address) == 0) return -ENOENT;
  {
    const Lock lock(mutex_);
    if (!control_held_) return std::min(function_.control(0x02, kClearFeature, 0, address, {}), 0);
  }
  std::this_thread::sleep_for(UsbfsCarrier::kHeldCall);
  return -ETIMEDOUT;
}

long UsbfsBus::control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                       std::uint16_t index, std::span<std::uint8_t> bytes) {
  const long said = descriptors_.answer(request_type, request, value, index, bytes);
  if (said >= 0) return said;
  const int moved = function_.control(request_type, request, value, index, bytes);
  return std::min<long>(moved, static_cast<long>(bytes.size()));
}

long UsbfsBus::on_read(std::span<std::byte> bytes) {
  const Lock lock(mutex_);
  if (!plugged_) return -ENODEV;
  const std::span<const std::uint8_t> all = descriptors_.bytes();
  const std::size_t begin = std::min(position_, all.size());
  const std::size_t moved = std::min(bytes.size(), all.size() - begin);
  if (moved > 0) std::memcpy(bytes.data(), all.data() + begin, moved);
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
