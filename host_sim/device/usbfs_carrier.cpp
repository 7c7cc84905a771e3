// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/usbfs_carrier.hpp"

#include <dlfcn.h>
#include <linux/types.h>

#include <linux/ioctl.h>

#include <linux/usbdevice_fs.h>

#include <stdexcept>

#include "host_sim/device/usbfs_bus.hpp"

namespace haptic::sim {
namespace {

// Asks as the shared libusb will: through the ioctl that the dynamic linker finds first.
bool reached_from_libraries(int descriptor, int speed) {
  using Ioctl = int (*)(int, unsigned long, ...);
  const auto call = reinterpret_cast<Ioctl>(dlsym(RTLD_DEFAULT, "ioctl"));
  return call != nullptr && call(descriptor, USBDEVFS_GET_SPEED, nullptr) == speed;
}

}  // namespace

UsbfsCarrier::UsbfsCarrier(UsbFunction& function, unsigned room)
    : bus_(std::make_shared<UsbfsBus>(function, room)) {
  if (!begin_answers(bus_->descriptor(), bus_))
    throw std::logic_error("too many fake USB devices at one time");
  if (reached_from_libraries(bus_->descriptor(), function.speed())) return;
  end_answers(bus_->descriptor());
  throw std::logic_error(
      "libusb would not reach the fake USB device: link haptic_usbfs and set ENABLE_EXPORTS");
}

UsbfsCarrier::~UsbfsCarrier() { end_answers(bus_->descriptor()); }

int UsbfsCarrier::descriptor() const { return bus_->descriptor(); }

bool UsbfsCarrier::push(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) {
  return bus_->push(endpoint, bytes);
}

void UsbfsCarrier::fail_next(std::uint8_t endpoint, int negative_errno, unsigned times) {
  bus_->fail_next(endpoint, negative_errno, times);
}

void UsbfsCarrier::refuse_submit(std::uint8_t endpoint, int negative_errno, unsigned times) {
  bus_->refuse_submit(endpoint, negative_errno, times);
}

void UsbfsCarrier::hold_control(bool held) { bus_->hold_control(held); }
void UsbfsCarrier::hold_out(bool held) { bus_->hold_out(held); }

void UsbfsCarrier::unplug() { bus_->unplug(); }

void UsbfsCarrier::unplug_at_next_resubmit() { bus_->unplug_at_next_resubmit(); }

bool UsbfsCarrier::plugged() const { return bus_->plugged(); }

unsigned UsbfsCarrier::waiting(std::uint8_t endpoint) const { return bus_->waiting(endpoint); }

}  // namespace haptic::sim
